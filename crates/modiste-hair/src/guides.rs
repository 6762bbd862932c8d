//! Guides: curves of a fixed number of points that stand for the strands around them.

use modiste_core::Vec3;

use crate::HairError;

/// Points of a guide, N_m.
pub const POINTS: usize = 15;

/// Shortest guide that is taken for hair (m).
const SHORTEST: f64 = 1e-3;
/// Longest guide that is taken for hair (m).
const LONGEST: f64 = 2.0;

/// Guides as one run of points: guide `k` has the points `k * POINTS..(k + 1) * POINTS`, the root first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Guides {
    /// Positions (m), `POINTS` per guide.
    pub points: Vec<Vec3>,
}

impl Guides {
    /// Number of guides, N_g.
    pub fn count(&self) -> usize {
        self.points.len() / POINTS
    }

    /// The points of one guide.
    pub fn guide(&self, index: usize) -> &[Vec3] {
        &self.points[index * POINTS..(index + 1) * POINTS]
    }

    /// Each guide in turn.
    pub fn iter(&self) -> impl Iterator<Item = &[Vec3]> {
        self.points.chunks_exact(POINTS)
    }

    /// Takes curves of any number of points, and gives each `POINTS` at even distances along it.
    ///
    /// # Errors
    /// No curve at all, a curve of fewer than two points, shorter than 1 mm or longer than 2 m, or a number that is not
    /// finite.
    pub fn from_curves(curves: &[Vec<Vec3>]) -> Result<Self, HairError> {
        if curves.is_empty() {
            return Err(HairError::data("guides", "at least one", 0));
        }
        let mut points = Vec::with_capacity(curves.len() * POINTS);
        for (index, curve) in curves.iter().enumerate() {
            let what = || format!("guide {index}");
            if curve.len() < 2 {
                return Err(HairError::data(what(), "two points or more", curve.len()));
            }
            if let Some(at) = curve.iter().position(|point| !point.is_finite()) {
                return Err(HairError::data(what(), "finite coordinates", format!("{} at point {at}", curve[at])));
            }
            let length = arc_length(curve);
            if !(SHORTEST..=LONGEST).contains(&length) {
                return Err(HairError::data(
                    what(),
                    format!("a length from {SHORTEST} to {LONGEST} m"),
                    format!("{length:.6} m"),
                ));
            }
            points.extend(resample(curve, POINTS));
        }
        Ok(Self { points })
    }
}

/// Length of a curve (m).
pub fn arc_length(curve: &[Vec3]) -> f64 {
    curve.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

/// `count` points at even distances along a curve, both ends among them; `count` is at least 2.
pub fn resample(curve: &[Vec3], count: usize) -> Vec<Vec3> {
    let total = arc_length(curve);
    let mut along = 0.0;
    let mut segment = 0;
    (0..count)
        .map(|index| {
            let wanted = total * index as f64 / (count - 1) as f64;
            while segment + 2 < curve.len() {
                let step = curve[segment].distance(curve[segment + 1]);
                if along + step >= wanted {
                    break;
                }
                along += step;
                segment += 1;
            }
            let [a, b] = [curve[segment], curve[segment + 1]];
            let step = a.distance(b);
            a.lerp(b, if step > 0.0 { ((wanted - along) / step).clamp(0.0, 1.0) } else { 0.0 })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Guides, POINTS, arc_length, resample};
    use modiste_core::Vec3;

    #[test]
    fn resampling_keeps_ends_and_spaces_evenly() {
        let curve: Vec<Vec3> = (0..400)
            .map(|i| {
                let t = (f64::from(i) / 399.0).powi(2) * 3.0;
                Vec3::new(t.cos(), t.sin(), 0.0)
            })
            .collect();
        let even = resample(&curve, POINTS);
        assert!(even[0].distance(curve[0]) < 1e-12 && even[POINTS - 1].distance(curve[399]) < 1e-12);
        let steps: Vec<f64> = even.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
        assert!(steps.iter().all(|step| (step / steps[0] - 1.0).abs() < 1e-2), "{steps:?}");
        assert!((arc_length(&even) / 3.0 - 1.0).abs() < 3e-3);
    }

    #[test]
    fn curves_that_are_no_hair_are_refused() {
        let message = |curves: &[Vec<Vec3>]| Guides::from_curves(curves).unwrap_err().to_string();
        assert!(message(&[]).contains("at least one"));
        assert!(message(&[vec![Vec3::X]]).contains("guide 0: wanted two points"));
        assert!(message(&[vec![Vec3::X, Vec3::Y], vec![Vec3::X; 5]]).contains("guide 1: wanted a length"));
        assert!(message(&[vec![Vec3::X, Vec3::new(0.0, f64::NAN, 0.0)]]).contains("finite"));
        assert!(message(&[vec![Vec3::ZERO, 30.0 * Vec3::X]]).contains("30.0"));
        assert_eq!(Guides::from_curves(&[vec![Vec3::ZERO, 0.2 * Vec3::X]]).unwrap().count(), 1);
    }
}
