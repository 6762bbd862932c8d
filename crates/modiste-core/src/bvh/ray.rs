//! The first face along a ray.

use super::{ChildKind, Node, STACK, TriangleBvh, WIDTH};
use crate::Vec3;
use crate::mesh::double_area_vector;
use crate::triangle::line_triangle;

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// The face it meets.
    pub face: u32,
    /// Coordinates on the face; they sum to 1.
    pub barycentric: [f64; 3],
    /// Where (m).
    pub point: Vec3,
    /// In lengths of the ray's direction.
    pub distance: f64,
}

/// Points nearer than this to an edge, as a share of the triangle's size, do not count as a clear crossing.
const CLEAR: f64 = 1e-9;

impl TriangleBvh {
    /// The first face, from either side, that `origin + t direction` meets with `0 <= t <= max_distance`.
    pub fn ray_hit(&self, x: &[Vec3], origin: Vec3, direction: Vec3, max_distance: f64) -> Option<RayHit> {
        let mut best: Option<RayHit> = None;
        self.along_ray(origin, direction, max_distance, |index, reach| {
            match line_triangle(origin, direction, self.triangle(index, x)) {
                Some((t, barycentric)) if t >= 0.0 && t <= reach => {
                    let point = origin + t * direction;
                    best = Some(RayHit { face: self.faces[index], barycentric, point, distance: t });
                    t
                }
                _ => reach,
            }
        });
        best
    }

    /// How often a closed surface goes around `p`: crossings outward less crossings inward of the ray from `p` along
    /// `direction`. `None` where the ray passes through an edge or `p` lies on the surface.
    ///
    /// The same number as [`winding_number`](Self::winding_number), several times faster, but nothing near holes.
    pub fn crossing_number(&self, x: &[Vec3], p: Vec3, direction: Vec3) -> Option<i32> {
        let (mut sum, mut is_clear) = (0, true);
        self.along_ray(p, direction, f64::INFINITY, |index, reach| {
            let triangle = self.triangle(index, x);
            let Some((t, barycentric)) = line_triangle(p, direction, triangle) else { return reach };
            if t >= -CLEAR {
                is_clear &= t > CLEAR && barycentric.into_iter().all(|share| share > CLEAR);
                sum += if double_area_vector(triangle).dot(direction) > 0.0 { 1 } else { -1 };
            }
            if is_clear { reach } else { STOP }
        });
        is_clear.then_some(sum)
    }

    /// Calls `visit` for the places of faces whose boxes the ray meets within its reach, which `visit` returns anew.
    #[inline(always)]
    fn along_ray(&self, origin: Vec3, direction: Vec3, mut reach: f64, mut visit: impl FnMut(usize, f64) -> f64) {
        let ray = BoxRay::new(origin, direction, self.rounding(origin));
        let mut stack = [0u32; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = &self.nodes[stack[depth] as usize];
            let entries = ray.entries(node, reach);
            for slot in 0..WIDTH {
                if entries[slot] == f32::INFINITY {
                    continue;
                }
                match node.children[slot].kind() {
                    ChildKind::Empty => {}
                    ChildKind::Node(child) => {
                        stack[depth] = child as u32;
                        depth += 1;
                    }
                    ChildKind::Leaf(first, count) => {
                        for index in first..first + count {
                            reach = visit(index, reach);
                        }
                    }
                }
            }
        }
    }
}

/// A reach in which nothing is met.
const STOP: f64 = -1.0;

/// Largest of the inverse of a direction: along a slab, zero times infinity would not be a number.
const LARGEST_INVERSE: f64 = 1e20;

/// Share by which the far side of a box is taken to be further away, more than f32 rounds in three operations.
const FURTHER: f32 = 1.0 + 4.0 * f32::EPSILON;

/// A ray in f32, for boxes: it meets all that it would meet in f64, and now and then a box that it just misses.
struct BoxRay {
    origin: [f32; 3],
    inverse: [f32; 3],
    /// Rounding of origin and boxes (m).
    rounding: f32,
}

impl BoxRay {
    fn new(origin: Vec3, direction: Vec3, rounding: f64) -> Self {
        let inverse = direction.to_array().map(|along| {
            let inverse = along.recip();
            if inverse.abs() < LARGEST_INVERSE { inverse } else { LARGEST_INVERSE.copysign(along) }
        });
        Self {
            origin: origin.as_vec3().to_array(),
            inverse: inverse.map(|inverse| inverse as f32),
            rounding: (rounding as f32).next_up(),
        }
    }

    /// Where the ray enters the box of each child, in lengths of its direction; infinite where it does not within `reach`.
    ///
    /// By slabs (Kay and Kajiya 1986), with the far side moved away as Ize 2013 proposes.
    #[inline(always)]
    fn entries(&self, node: &Node, reach: f64) -> [f32; WIDTH] {
        let mut enter = [0.0f32; WIDTH];
        let mut leave = [(reach as f32).next_up(); WIDTH];
        for axis in 0..3 {
            let (from, inverse) = (self.origin[axis], self.inverse[axis]);
            let (below, above) = (from + self.rounding, from - self.rounding);
            for slot in 0..WIDTH {
                let low = (node.low[axis][slot] - below) * inverse;
                let high = (node.high[axis][slot] - above) * inverse;
                let (near, far) = if low < high { (low, high) } else { (high, low) };
                enter[slot] = if near > enter[slot] { near } else { enter[slot] };
                leave[slot] = if far < leave[slot] { far } else { leave[slot] };
            }
        }
        for slot in 0..WIDTH {
            if !(enter[slot] <= leave[slot] * FURTHER) {
                enter[slot] = f32::INFINITY;
            }
        }
        enter
    }
}

#[cfg(test)]
mod tests {
    use crate::shapes::{icosphere, torus};
    use crate::triangle::line_triangle;
    use crate::{Mesh, Topology, TriangleBvh, Vec3, corners, normal, seeded_rng, winding_number_exact};

    #[test]
    fn tree_and_brute_force_agree() {
        let mesh = icosphere(3);
        let x = &mesh.vertices;
        let tree = TriangleBvh::new(&mesh.topology, x);
        let mut rng = seeded_rng(8);
        let mut random = || Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
        for _ in 0..500 {
            let (origin, direction) = (1.5 * random(), random());
            let hits = mesh.topology.faces().iter().filter_map(|&f| line_triangle(origin, direction, corners(f, x)));
            let nearest = hits.map(|(t, _)| t).filter(|&t| t >= 0.0).fold(f64::INFINITY, f64::min);
            let found = tree.ray_hit(x, origin, direction, f64::INFINITY).map_or(f64::INFINITY, |hit| hit.distance);
            let both_miss = found.is_infinite() && nearest.is_infinite();
            assert!(both_miss || (found - nearest).abs() < 1e-12);
        }
    }

    #[test]
    fn rays_along_an_axis_meet_both_sides_of_the_sphere() {
        let mesh = icosphere(3);
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let from_outside = tree.ray_hit(&mesh.vertices, -3.0 * axis, axis, 10.0).unwrap();
            assert!((from_outside.distance - 2.0).abs() < 0.01);
            let from_inside = tree.ray_hit(&mesh.vertices, Vec3::ZERO, axis, 10.0).unwrap();
            assert!((from_inside.distance - 1.0).abs() < 0.01);
            assert_eq!(tree.ray_hit(&mesh.vertices, -3.0 * axis, axis, 1.9), None);
        }
    }

    #[test]
    fn crossings_count_how_often_a_surface_goes_around() {
        // Two spheres that pass through each other, and a torus.
        let sphere = icosphere(3);
        let count = sphere.vertices.len() as u32;
        let shifted = sphere.vertices.iter().map(|v| *v + Vec3::X);
        let both: Vec<Vec3> = sphere.vertices.iter().copied().chain(shifted).collect();
        let faces = sphere.topology.faces();
        let doubled = faces.iter().copied().chain(faces.iter().map(|face| face.map(|vertex| vertex + count))).collect();
        let crossing = Mesh { topology: Topology::new(both.len(), doubled).unwrap().into(), vertices: both };
        let mut rng = seeded_rng(12);
        let mut random = || Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
        let mut seen = [0; 3];
        for mesh in [crossing, torus(0.8, 0.3, 60, 30)] {
            let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
            for _ in 0..2000 {
                let (p, direction) = (0.7 * random(), random());
                let exact = winding_number_exact(&mesh.topology, &mesh.vertices, p).round() as i32;
                assert_eq!(tree.crossing_number(&mesh.vertices, p, direction), Some(exact), "{p}");
                seen[exact as usize] += 1;
            }
        }
        assert!(seen.iter().all(|&count| count > 50), "{seen:?}");
    }

    #[test]
    fn a_ray_through_an_edge_is_not_counted() {
        let mesh = icosphere(2);
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        let [a, b] = mesh.topology.edges()[7].vertices.map(|vertex| mesh.vertices[vertex as usize]);
        assert_eq!(tree.crossing_number(&mesh.vertices, Vec3::ZERO, a + b), None);
        assert_eq!(tree.crossing_number(&mesh.vertices, Vec3::ZERO, Vec3::new(0.3, 0.5, 0.8)), Some(1));
        assert_eq!(tree.crossing_number(&mesh.vertices, a, a), None, "on the surface");
    }
}
