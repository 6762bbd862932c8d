//! Wind with gusts.

use modiste_core::{Vec3, seeded_rng, uniform};

/// Wind speed (m/s) at strength 1: a fresh breeze at head height.
pub const FULL_WIND: f64 = 4.0;

/// Rates (Hz) of the gusts, which never fall into step.
const RATES: [f64; 4] = [0.23, 0.57, 1.13, 1.91];
/// Share of each in the gusts.
const SHARES: [f64; 4] = [0.45, 0.3, 0.17, 0.08];

/// Wind from one direction with gusts that travel with it.
#[derive(Debug, Clone)]
pub struct Wind {
    mean: Vec3,
    gust: f64,
    phases: [[f64; 4]; 3],
}

impl Wind {
    /// Still air.
    pub fn still() -> Self {
        Self::new(Vec3::ZERO, 0.0, 0)
    }

    /// Wind of mean velocity `mean` (m/s) whose gusts are `gust` of that, different for each seed.
    pub fn new(mean: Vec3, gust: f64, seed: u64) -> Self {
        let mut rng = seeded_rng(seed);
        let phases = std::array::from_fn(|_| std::array::from_fn(|_| uniform(&mut rng) * std::f64::consts::TAU));
        Self { mean, gust, phases }
    }

    /// Velocity (m/s) at a time (s) and place (m).
    pub fn velocity(&self, time: f64, place: Vec3) -> Vec3 {
        let speed = self.mean.length();
        if speed == 0.0 {
            return Vec3::ZERO;
        }
        // Gusts are carried along, so they come later further down the wind.
        let time = time - place.dot(self.mean) / (speed * speed);
        let wave = |component: usize| -> f64 {
            let phases = &self.phases[component];
            (0..RATES.len()).map(|i| SHARES[i] * (std::f64::consts::TAU * RATES[i] * time + phases[i]).sin()).sum()
        };
        let ahead = self.mean / speed;
        let across = Vec3::Y.cross(ahead).normalize_or(Vec3::X);
        let gust = self.gust * speed;
        self.mean + gust * (wave(0) * ahead + 0.4 * wave(1) * across + 0.25 * wave(2) * Vec3::Y)
    }
}

#[cfg(test)]
mod tests {
    use super::Wind;
    use modiste_core::Vec3;

    #[test]
    fn gusts_average_out_and_depend_on_the_seed() {
        let mean = Vec3::new(3.0, 0.0, 1.0);
        let wind = Wind::new(mean, 0.5, 7);
        let count = 40_000;
        let average =
            (0..count).map(|i| wind.velocity(0.01 * f64::from(i), Vec3::ZERO)).sum::<Vec3>() / f64::from(count);
        assert!(average.distance(mean) < 0.03, "{average}");
        let spread =
            (0..1000).map(|i| wind.velocity(0.1 * f64::from(i), Vec3::ZERO).distance(mean)).fold(0.0, f64::max);
        assert!(spread > 0.5 && spread < 3.0, "{spread}");
        assert_ne!(wind.velocity(1.0, Vec3::ZERO), Wind::new(mean, 0.5, 8).velocity(1.0, Vec3::ZERO));
        assert_eq!(Wind::still().velocity(3.0, Vec3::X), Vec3::ZERO);
    }
}
