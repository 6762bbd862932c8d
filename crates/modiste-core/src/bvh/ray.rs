//! The first face along a ray.

use super::{ChildKind, Node, STACK, TriangleBvh, WIDTH};
use crate::Vec3;
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

impl TriangleBvh {
    /// The first face, from either side, that `origin + t direction` meets with `0 <= t <= max_distance`.
    pub fn ray_hit(&self, x: &[Vec3], origin: Vec3, direction: Vec3, max_distance: f64) -> Option<RayHit> {
        let mut best: Option<RayHit> = None;
        let mut reach = max_distance;
        let inverse = direction.recip();
        let rounding = self.rounding(origin);
        let mut stack = [0u32; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = &self.nodes[stack[depth] as usize];
            for slot in 0..WIDTH {
                if !meets_box(node, slot, origin, inverse, rounding, reach) {
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
                            let Some((t, barycentric)) = line_triangle(origin, direction, self.triangle(index, x))
                            else {
                                continue;
                            };
                            if t >= 0.0 && t <= reach {
                                reach = t;
                                let point = origin + t * direction;
                                best = Some(RayHit { face: self.faces[index], barycentric, point, distance: t });
                            }
                        }
                    }
                }
            }
        }
        best
    }
}

/// Slab test.
fn meets_box(node: &Node, slot: usize, origin: Vec3, inverse: Vec3, rounding: f64, reach: f64) -> bool {
    let (mut enter, mut leave) = (0.0f64, reach);
    for axis in 0..3 {
        let low = f64::from(node.low[axis][slot]) - rounding - origin[axis];
        let high = f64::from(node.high[axis][slot]) + rounding - origin[axis];
        if inverse[axis].is_infinite() {
            // Along the slab: zero times infinity would not be a number.
            if low > 0.0 || high < 0.0 {
                return false;
            }
            continue;
        }
        let (low, high) = (low * inverse[axis], high * inverse[axis]);
        enter = enter.max(low.min(high));
        leave = leave.min(low.max(high));
    }
    enter <= leave
}

#[cfg(test)]
mod tests {
    use crate::shapes::icosphere;
    use crate::triangle::line_triangle;
    use crate::{TriangleBvh, Vec3, corners, normal, seeded_rng};

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
}
