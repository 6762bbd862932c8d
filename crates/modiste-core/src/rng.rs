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
