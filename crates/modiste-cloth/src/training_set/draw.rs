//! Body shapes and eases drawn at random.

use modiste_core::{normal, seeded_rng, uniform};

/// Coefficients beyond this are drawn again.
const LARGEST: f64 = 3.0;

/// `count` shapes of `dimensions` coefficients β from N(0, 1), truncated at ±3; the same seed gives the same shapes, and
/// more of them begin with the same ones.
pub fn draw_shapes(count: usize, dimensions: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut rng = seeded_rng(seed);
    let mut coefficient = || loop {
        let value = normal(&mut rng);
        if value.abs() <= LARGEST {
            return value;
        }
    };
    (0..count).map(|_| (0..dimensions).map(|_| coefficient()).collect()).collect()
}

/// Eases must not follow the shapes of the same seed.
const EASE_STREAM: u64 = 0x65_61_73_65;

/// `count` eases, uniform from -1 (slim) to 1 (loose); the same seed gives the same ones, and more of them begin with them.
pub fn draw_eases(count: usize, seed: u64) -> Vec<f64> {
    let mut rng = seeded_rng(seed ^ EASE_STREAM);
    (0..count).map(|_| 2.0 * uniform(&mut rng) - 1.0).collect()
}

#[cfg(test)]
mod tests {
    use super::{draw_eases, draw_shapes};

    #[test]
    fn eases_are_uniform_and_repeatable() {
        let eases = draw_eases(1000, 3);
        assert!(eases.iter().all(|ease| (-1.0..1.0).contains(ease)));
        let mean = eases.iter().sum::<f64>() / 1000.0;
        let variance = eases.iter().map(|ease| ease * ease).sum::<f64>() / 1000.0;
        assert!(mean.abs() < 0.05 && (variance - 1.0 / 3.0).abs() < 0.03, "{mean} {variance}");
        assert_eq!(draw_eases(10, 3), eases[..10]);
        assert_ne!(draw_eases(10, 4), eases[..10]);
    }

    #[test]
    fn shapes_are_standard_normal_and_repeatable() {
        let shapes = draw_shapes(500, 20, 7);
        let values: Vec<f64> = shapes.iter().flatten().copied().collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 0.973).abs() < 0.04, "{mean} {variance}");
        assert!(values.iter().all(|v| v.abs() <= 3.0));
        assert_eq!(draw_shapes(10, 20, 7), shapes[..10]);
        assert_ne!(draw_shapes(10, 20, 8), shapes[..10]);
    }
}
