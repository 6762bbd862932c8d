//! Seeded random numbers. Everything random takes one of these as an argument.

use rand::{Rng as _, RngExt as _, SeedableRng as _};

/// The one generator of this workspace: the same seed gives the same numbers on every platform.
pub type Rng = rand_chacha::ChaCha8Rng;

/// A generator from a seed.
pub fn seeded_rng(seed: u64) -> Rng {
    Rng::seed_from_u64(seed)
}

/// A number uniform in [0, 1).
pub fn uniform(rng: &mut Rng) -> f64 {
    // 53 random bits, so every representable step of the result has equal weight.
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

/// A whole number uniform in `0..bound`; 0 if `bound` is 0.
pub fn below(rng: &mut Rng, bound: usize) -> usize {
    if bound == 0 { 0 } else { rng.random_range(0..bound) }
}

/// A number from the standard normal distribution (Box and Muller 1958).
pub fn normal(rng: &mut Rng) -> f64 {
    // 1 - u lies in (0, 1], which keeps the logarithm finite.
    let radius = (-2.0 * (1.0 - uniform(rng)).ln()).sqrt();
    radius * (std::f64::consts::TAU * uniform(rng)).cos()
}

/// Puts a slice into a random order (Fisher and Yates).
pub fn shuffle<T>(rng: &mut Rng, items: &mut [T]) {
    for end in (1..items.len()).rev() {
        items.swap(end, below(rng, end + 1));
    }
}

#[cfg(test)]
mod tests {
    use super::{below, normal, seeded_rng, shuffle, uniform};

    #[test]
    fn the_same_seed_gives_the_same_numbers_everywhere() {
        let draw = |seed| {
            let mut rng = seeded_rng(seed);
            (uniform(&mut rng), normal(&mut rng), below(&mut rng, 1000))
        };
        assert_eq!(draw(42), draw(42));
        assert_ne!(draw(42), draw(43));
    }

    #[test]
    fn numbers_follow_their_distributions() {
        let mut rng = seeded_rng(1);
        let n = 200_000;
        let moments = |values: &[f64]| {
            let power = |k: i32| values.iter().map(|v| v.powi(k)).sum::<f64>() / n as f64;
            [power(1), power(2), power(3), power(4)]
        };
        let normals: Vec<f64> = (0..n).map(|_| normal(&mut rng)).collect();
        for (found, expected) in moments(&normals).into_iter().zip([0.0, 1.0, 0.0, 3.0]) {
            assert!((found - expected).abs() < 0.05, "{found} {expected}");
        }
        let uniforms: Vec<f64> = (0..n).map(|_| uniform(&mut rng)).collect();
        for (found, expected) in moments(&uniforms).into_iter().zip([0.5, 1.0 / 3.0, 0.25, 0.2]) {
            assert!((found - expected).abs() < 0.005, "{found} {expected}");
        }
        let mut counts = [0usize; 7];
        (0..n).for_each(|_| counts[below(&mut rng, 7)] += 1);
        assert!(counts.iter().all(|&count| (count as f64 * 7.0 / n as f64 - 1.0).abs() < 0.05));
    }

    #[test]
    fn shuffling_keeps_all_items() {
        let mut items: Vec<usize> = (0..100).collect();
        shuffle(&mut seeded_rng(3), &mut items);
        assert!(items.iter().enumerate().filter(|&(place, &item)| place == item).count() < 10);
        items.sort_unstable();
        assert!(items.into_iter().eq(0..100));
    }
}
