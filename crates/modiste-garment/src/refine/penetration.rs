//! How much of a garment is inside the body: measured against its triangles, apart from how the fit finds it.

use modiste_core::{Topology, TriangleBvh, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Garment vertices inside the body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Penetration {
    /// How many vertices are inside.
    pub count: usize,
    /// Distance (m) from the surface of the one that is deepest.
    pub worst_depth: f64,
    /// Number of vertices of the garment.
    pub vertices: usize,
}

impl Penetration {
    /// Both measurements together.
    #[must_use]
    pub fn join(self, other: Self) -> Self {
        Self {
            count: self.count + other.count,
            worst_depth: self.worst_depth.max(other.worst_depth),
            vertices: self.vertices + other.vertices,
        }
    }
}

/// Where a point of the surface is asked whether it can be seen from outside (m above it).
const JUST_OUTSIDE: f64 = 1e-4;

/// Measures a garment against a closed body: a vertex is inside where the winding number of the body is above one half,
/// and its depth is the distance from the nearest triangle that is not buried in another part of the body.
///
/// The winding number counts a point that is inside an arm as inside even where the arm has sunk into the chest. Triangles
/// whose nearest point is buried count as buried as a whole, which errs towards deeper.
pub fn measure(topology: &Topology, body: &[Vec3], garment: &[Vec3]) -> Penetration {
    measure_with(topology, &TriangleBvh::new(topology, body), body, garment)
}

/// [`measure`] with a tree that is built already and fits the body.
pub fn measure_with(topology: &Topology, tree: &TriangleBvh, body: &[Vec3], garment: &[Vec3]) -> Penetration {
    let depths: Vec<Option<f64>> = garment
        .par_iter()
        .map(|&vertex| {
            let is_inside = |point: Vec3| tree.winding_number(body, point) > 0.5;
            is_inside(vertex).then(|| {
                let can_be_seen = |face: u32, at: Vec3| {
                    let [a, b, c] = topology.faces()[face as usize].map(|corner| body[corner as usize]);
                    !is_inside(at + JUST_OUTSIDE * (b - a).cross(c - a).normalize_or_zero())
                };
                // Most often the nearest point of all is not buried, and the search for others is spared.
                let nearest =
                    tree.closest_point(body, vertex, f64::INFINITY).filter(|at| can_be_seen(at.face, at.point));
                let visible = || tree.closest_point_where(body, vertex, f64::INFINITY, None, can_be_seen);
                nearest.or_else(visible).map_or(f64::INFINITY, |at| at.distance)
            })
        })
        .collect();
    let inside = depths.iter().flatten();
    Penetration {
        count: inside.clone().count(),
        worst_depth: inside.copied().fold(0.0, f64::max),
        vertices: garment.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::measure;
    use modiste_core::Vec3;
    use modiste_core::shapes::icosphere;

    #[test]
    fn depth_and_count_of_points_in_a_sphere() {
        let sphere = icosphere(4);
        let points = [Vec3::X * 0.9, Vec3::Y * 1.1, Vec3::Z * 0.99, Vec3::new(2.0, 0.0, 0.0)];
        let found = measure(&sphere.topology, &sphere.vertices, &points);
        assert_eq!((found.count, found.vertices), (2, 4));
        assert!((found.worst_depth - 0.1).abs() < 3e-3, "{found:?}");
    }
}
