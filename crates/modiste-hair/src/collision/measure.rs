//! How much hair is inside, by the text's loose test and by an exact one.

use modiste_core::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::POINTS;
use crate::surface::Surface;

/// How far the surface is looked for (m).
const REACH: f64 = 0.12;

/// Points inside a surface in one frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Penetration {
    /// Points that were looked at; roots, which lie in the skin, are not.
    pub points: usize,
    /// Points inside.
    pub inside: usize,
    /// Depth of the deepest (m).
    pub deepest: f64,
}

/// `‖λ̃ᵀ(y* − y₀)‖ / ‖y₀‖` of §6: how far collision moved the coefficients, by their importance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct CoefficientDeviation(pub f64);

impl Penetration {
    /// Both together.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        Self {
            points: self.points + other.points,
            inside: self.inside + other.inside,
            deepest: self.deepest.max(other.deepest),
        }
    }

    /// Part of the points that is inside.
    pub fn rate(&self) -> f64 {
        self.inside as f64 / self.points.max(1) as f64
    }

    fn of_distances(distances: impl ParallelIterator<Item = Option<f64>>) -> Self {
        distances
            .map(|distance| {
                let depth = distance.map_or(0.0, |d| (-d).max(0.0));
                Self { points: 1, inside: usize::from(depth > 0.0), deepest: depth }
            })
            .reduce(Self::default, Self::join)
    }
}

impl CoefficientDeviation {
    /// The measure; `std_devs` are those of the coefficients, whose squares are the eigenvalues λ.
    pub fn new(y: &[f64], y0: &[f64], std_devs: &[f64]) -> Self {
        let total: f64 = std_devs.iter().map(|s| s * s).sum();
        let moved: f64 = std_devs.iter().zip(y.iter().zip(y0)).map(|(s, (a, b))| s * s / total * (a - b)).sum();
        let size = y0.iter().map(|y| y * y).sum::<f64>().sqrt();
        Self(moved.abs() / size.max(f64::MIN_POSITIVE))
    }
}

/// Points but roots whose offset from the nearest vertex is against its normal (eq. 28); a point that looks past the rim of the
/// surface is outside.
pub fn penetration_by_vertices(points: &[Vec3], surface: &Surface) -> Penetration {
    let points = points.par_iter().enumerate().filter(|(index, _)| index % POINTS != 0);
    Penetration::of_distances(points.map(|(_, &p)| {
        let (vertex, normal) = surface.nearest_vertex(p, REACH, u32::MAX)?;
        Some(normal.dot(p - surface.vertices()[vertex as usize]))
    }))
}

/// Points but roots that are inside the surface, against its triangles.
pub fn penetration_exact(points: &[Vec3], surface: &Surface) -> Penetration {
    let points = points.par_iter().enumerate().filter(|(index, _)| index % POINTS != 0);
    Penetration::of_distances(points.map(|(_, &p)| Some(surface.contact(p, REACH, None)?.distance)))
}
