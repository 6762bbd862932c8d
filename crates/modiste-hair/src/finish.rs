//! The last pass: no point of the hair ends inside body or clothing, by their triangles.

use modiste_core::Vec3;
use rayon::prelude::*;

use crate::POINTS;
use crate::surface::Surface;

/// Distance that points keep from skin and cloth after the pass (m).
pub const GAP: f64 = 0.0008;
/// How much further than needed the surface is looked for (m): what is found out lasts so much longer.
const AHEAD: f64 = 0.02;
/// Where parts of a surface may cross, points are looked for as deep as this every time (m).
const AMONG_FOLDS: f32 = 0.06;
/// Distances are believed to this (m): what a frame stores as f32 and what faces at an angle leave.
const DOUBT: f64 = 0.0002;

/// Lets points out of surfaces, and remembers from frame to frame how far away they were.
///
/// Distance to a surface changes by no more than a point and the surface move. So a point that was 3 cm away and moved by 1 cm
/// is still outside, without a look at any triangle; and one that must be looked at needs be looked for only so far as it
/// can have come.
#[derive(Debug, Clone, Default)]
pub struct Finish {
    layers: Vec<Layer>,
    /// Points of the frame before, canonical or world, as they are given.
    before: Vec<Vec3>,
}

/// What is remembered of one surface.
#[derive(Debug, Clone, Default)]
struct Layer {
    vertices: Vec<Vec3>,
    /// The surface is at least so far from each point (m).
    away: Vec<f32>,
    likely: Vec<u32>,
}

/// Counts of a pass.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FinishReport {
    /// Exact queries.
    pub asked: usize,
    /// Points that were moved.
    pub moved: usize,
}

impl Finish {
    /// Before the first frame.
    pub fn new() -> Self {
        Self::default()
    }

    /// Moves every point that is nearer than [`GAP`] to a surface, or inside it, to that distance; roots stay. Points are
    /// `POINTS` per guide. Surfaces keep their order from frame to frame; the first is the innermost.
    ///
    /// Points and surfaces may be given in the moving frame of the bust, where both move least.
    pub fn apply(&mut self, points: &mut [Vec3], surfaces: &[&Surface]) -> FinishReport {
        let mut report = FinishReport::default();
        let fresh = self.before.len() != points.len() || self.layers.len() != surfaces.len();
        if fresh {
            self.layers = vec![Layer::default(); surfaces.len()];
            self.before = points.to_vec();
        }
        for (layer, surface) in self.layers.iter_mut().zip(surfaces) {
            let part = layer.apply(points, &self.before, surface);
            report = FinishReport { asked: report.asked + part.asked, moved: report.moved + part.moved };
        }
        // What one surface moved may have come into another.
        if surfaces.len() > 1 && report.moved > 0 {
            for (layer, surface) in self.layers.iter_mut().zip(surfaces) {
                let before = points.to_vec();
                layer.apply(points, &before, surface);
            }
        }
        self.before.copy_from_slice(points);
        report
    }
}

impl Layer {
    fn apply(&mut self, points: &mut [Vec3], before: &[Vec3], surface: &Surface) -> FinishReport {
        let x = surface.vertices();
        if self.away.len() != points.len() || self.vertices.len() != x.len() {
            self.away = vec![f32::NEG_INFINITY; points.len()];
            self.likely = vec![0; points.len()];
            self.vertices = x.to_vec();
        }
        let moved = self.vertices.iter().zip(x).map(|(a, b)| a.distance_squared(*b)).fold(0.0, f64::max).sqrt();
        self.vertices.copy_from_slice(x);
        points
            .par_iter_mut()
            .zip(before)
            .zip(self.away.par_iter_mut().zip(&mut self.likely))
            .enumerate()
            .with_min_len(256)
            .filter(|(index, _)| index % POINTS != 0)
            .map(|(_, ((point, &before), (away, likely)))| {
                let bound = f64::from(*away) - point.distance(before) - moved;
                if bound > GAP + DOUBT {
                    *away = bound as f32;
                    return FinishReport::default();
                }
                let start = *point;
                // It is no deeper than the bound says; of a new point nothing is known.
                let reach = AHEAD + GAP - bound;
                let mut report = FinishReport { asked: 1, moved: 0 };
                // A fold may lead from one face into another.
                for _ in 0..5 {
                    let Some(contact) = surface.contact(*point, reach, Some(*likely)) else {
                        *away = reach as f32;
                        break;
                    };
                    *likely = contact.at.face;
                    *away = contact.distance.max(0.0) as f32;
                    if contact.distance >= GAP {
                        break;
                    }
                    *point = contact.at.point + (GAP + DOUBT) * contact.outwards;
                    *away = GAP as f32;
                }
                if surface.may_be_crossed(*likely) {
                    *away = -AMONG_FOLDS;
                }
                report.moved = usize::from(start != *point);
                report
            })
            .reduce(FinishReport::default, |a, b| FinishReport { asked: a.asked + b.asked, moved: a.moved + b.moved })
    }
}

#[cfg(test)]
mod tests {
    use super::{Finish, GAP};
    use crate::POINTS;
    use crate::surface::Surface;
    use modiste_core::shapes::icosphere;
    use modiste_core::{Vec3, normal, seeded_rng};

    #[test]
    fn no_point_stays_inside_and_the_memory_changes_nothing() {
        let ball = icosphere(4);
        let at =
            |t: f64| -> Vec<Vec3> { ball.vertices.iter().map(|v| 0.1 * *v + Vec3::new(0.01 * t, 0.0, 0.0)).collect() };
        let mut surface = Surface::new(&ball.topology, at(0.0));
        let mut rng = seeded_rng(9);
        let base: Vec<Vec3> = (0..20 * POINTS)
            .map(|_| {
                0.1 * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng)).normalize()
                    * (1.0 + 0.2 * normal(&mut rng))
            })
            .collect();
        let mut finish = Finish::new();
        let mut asked = Vec::new();
        for frame in 0..12 {
            let t = f64::from(frame);
            surface.set(&at(t));
            let mut points: Vec<Vec3> =
                base.iter().map(|p| *p + Vec3::new(0.012 * t, 0.003 * (t * 0.7).sin(), 0.0)).collect();
            let mut plain = points.clone();
            asked.push(finish.apply(&mut points, &[&surface]).asked);
            Finish::new().apply(&mut plain, &[&surface]);
            for (index, (point, plain)) in points.iter().zip(&plain).enumerate() {
                assert!(point.distance(*plain) < 1e-9, "point {index}");
                if index % POINTS != 0 {
                    assert!(surface.contact(*point, 1.0, None).unwrap().distance >= GAP - 1e-6);
                }
            }
        }
        assert!(asked[5] < asked[0], "{asked:?}");
    }
}
