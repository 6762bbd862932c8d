//! The nearest point of the surface.

use super::{Child, ChildKind, Node, STACK, TriangleBvh, WIDTH};
use crate::{Vec3, closest_point_on_triangle};

/// A point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// The face it lies on.
    pub face: u32,
    /// Its coordinates on the face; they sum to 1.
    pub barycentric: [f64; 3],
    /// Where it is (m).
    pub point: Vec3,
    /// How far it is from the query point (m).
    pub distance: f64,
}

/// The best face so far, in leaf order.
struct Best {
    distance_squared: f64,
    index: usize,
    barycentric: [f64; 3],
    point: Vec3,
}

impl Best {
    /// Takes a face if it is nearer and accepted.
    #[inline(always)]
    fn offer(
        &mut self,
        index: usize,
        p: Vec3,
        triangle: [Vec3; 3],
        accept: &mut impl FnMut(usize, Vec3) -> bool,
    ) -> bool {
        let (point, barycentric) = closest_point_on_triangle(p, triangle);
        let distance_squared = point.distance_squared(p);
        let nearer = distance_squared < self.distance_squared && accept(index, point);
        if nearer {
            *self = Self { distance_squared, index, barycentric, point };
        }
        nearer
    }
}

impl TriangleBvh {
    /// The point of the surface nearest to `p`, if it is no further than `max_distance` (m).
    pub fn closest_point(&self, x: &[Vec3], p: Vec3, max_distance: f64) -> Option<SurfacePoint> {
        self.closest_point_near(x, p, max_distance, None)
    }

    /// [`Self::closest_point`], faster when a face is known that is likely to be near: that of the last frame.
    ///
    /// The result is as near as without it. A face that is not in the tree is ignored.
    pub fn closest_point_near(
        &self,
        x: &[Vec3],
        p: Vec3,
        max_distance: f64,
        likely: Option<u32>,
    ) -> Option<SurfacePoint> {
        self.closest_point_where(x, p, max_distance, likely, |_, _| true)
    }

    /// [`Self::closest_point_near`] among the points that `accept`, given a face and its point nearest to `p`, says yes to.
    ///
    /// It is asked only about points that are nearer than the best so far; a face whose nearest point it refuses is left
    /// out as a whole.
    pub fn closest_point_where(
        &self,
        x: &[Vec3],
        p: Vec3,
        max_distance: f64,
        likely: Option<u32>,
        mut accept: impl FnMut(u32, Vec3) -> bool,
    ) -> Option<SurfacePoint> {
        if !p.is_finite() {
            return None;
        }
        let mut accept = |index: usize, point: Vec3| accept(self.faces[index], point);
        // The bound itself counts as found.
        let distance_squared = (max_distance * max_distance).next_up();
        let mut best = Best { distance_squared, index: usize::MAX, barycentric: [0.0; 3], point: p };
        let place = likely.and_then(|face| self.places.get(face as usize)).filter(|&&place| place != u32::MAX);
        if let Some(&place) = place {
            best.offer(place as usize, p, self.triangle(place as usize, x), &mut accept);
        }
        self.search(x, p, &mut best, &mut accept);
        (best.index != usize::MAX).then(|| SurfacePoint {
            face: self.faces[best.index],
            barycentric: best.barycentric,
            point: best.point,
            distance: best.distance_squared.sqrt(),
        })
    }

    fn search(&self, x: &[Vec3], p: Vec3, best: &mut Best, accept: &mut impl FnMut(usize, Vec3) -> bool) {
        let rounding = self.rounding(p);
        let limit = |distance_squared: f64| {
            let reach = distance_squared.sqrt() + rounding;
            ((reach * reach) as f32).next_up()
        };
        let query = [p.x as f32, p.y as f32, p.z as f32];
        let mut bound = limit(best.distance_squared);
        let mut stack = [(Child::node(0), 0.0f32); STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (child, child_distance) = stack[depth];
            if child_distance > bound {
                continue;
            }
            match child.kind() {
                ChildKind::Empty => {}
                ChildKind::Node(index) => {
                    let node = &self.nodes[index];
                    let distances = squared_distances(node, query);
                    let first_waiting = depth;
                    for slot in 0..WIDTH {
                        if distances[slot] > bound {
                            continue;
                        }
                        // Insertion keeps the nearest child on top of the stack.
                        let mut at = depth;
                        while at > first_waiting && stack[at - 1].1 < distances[slot] {
                            stack[at] = stack[at - 1];
                            at -= 1;
                        }
                        stack[at] = (node.children[slot], distances[slot]);
                        depth += 1;
                    }
                }
                ChildKind::Leaf(first, count) => {
                    for index in first..first + count {
                        if best.offer(index, p, self.triangle(index, x), accept) {
                            bound = limit(best.distance_squared);
                        }
                    }
                }
            }
        }
    }
}

/// Squared distance of a point from the box of each child (m²); infinite for no child.
#[inline(always)]
fn squared_distances(node: &Node, p: [f32; 3]) -> [f32; WIDTH] {
    let mut sum = [0.0f32; WIDTH];
    for axis in 0..3 {
        for slot in 0..WIDTH {
            let below = node.low[axis][slot] - p[axis];
            let above = p[axis] - node.high[axis][slot];
            // Comparisons rather than `max`, which costs three instructions for numbers that are not.
            let beyond = if below > above { below } else { above };
            let outside = if beyond > 0.0 { beyond } else { 0.0 };
            sum[slot] += outside * outside;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use crate::shapes::{icosphere, torus};
    use crate::{Mesh, TriangleBvh, Vec3, closest_point_on_triangle, corners, normal, seeded_rng};

    fn brute_force(mesh: &Mesh, x: &[Vec3], p: Vec3) -> f64 {
        let distance = |&face: &[u32; 3]| closest_point_on_triangle(p, corners(face, x)).0.distance(p);
        mesh.topology.faces().iter().map(distance).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn tree_and_brute_force_agree_also_after_motion() {
        let mut rng = seeded_rng(7);
        for mesh in [icosphere(3), torus(0.8, 0.3, 40, 20)] {
            let mut tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
            let mut x = mesh.vertices.clone();
            let mut rng_face = (0..mesh.topology.face_count() as u32 + 1).cycle();
            for _ in 0..2 {
                for _ in 0..300 {
                    let p = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
                    let truth = brute_force(&mesh, &x, p);
                    let found = tree.closest_point(&x, p, f64::INFINITY).unwrap();
                    assert!((found.distance - truth).abs() < 1e-12);
                    let on_face = corners(mesh.topology.faces()[found.face as usize], &x);
                    let rebuilt: Vec3 = (0..3).map(|i| found.barycentric[i] * on_face[i]).sum();
                    assert!(rebuilt.distance(found.point) < 1e-12);
                    assert!((found.point.distance(p) - found.distance).abs() < 1e-12);
                    assert!(tree.closest_point(&x, p, truth * 1.001).is_some());
                    let likely = Some(rng_face.next().unwrap());
                    let warm = tree.closest_point_near(&x, p, f64::INFINITY, likely).unwrap();
                    assert!((warm.distance - truth).abs() < 1e-12);
                    assert_eq!(tree.closest_point(&x, p, truth * 0.999), None);
                }
                for p in &mut x {
                    *p = Vec3::new(p.x + 0.3 * p.y.sin(), 1.5 * p.y, p.z - 0.2) * 0.7;
                }
                tree.refit(&x);
            }
        }
    }

    #[test]
    fn refused_faces_are_as_if_they_were_not_there() {
        let mesh = icosphere(3);
        let x = &mesh.vertices;
        let tree = TriangleBvh::new(&mesh.topology, x);
        let some: Vec<u32> = (0..mesh.topology.face_count() as u32).filter(|face| face % 7 == 1).collect();
        let fewer = TriangleBvh::of_faces(&mesh.topology, x, &some);
        let mut rng = seeded_rng(4);
        for face in 0..100 {
            let p = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
            let found = tree.closest_point_where(x, p, f64::INFINITY, Some(face), |face, _| face % 7 == 1).unwrap();
            assert!((found.distance - fewer.closest_point(x, p, f64::INFINITY).unwrap().distance).abs() < 1e-12);
            assert_eq!(tree.closest_point_where(x, p, f64::INFINITY, None, |_, _| false), None);
        }
    }

    #[test]
    fn a_point_on_the_surface_is_at_distance_zero() {
        let mesh = icosphere(2);
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        for &p in &mesh.vertices {
            assert!(tree.closest_point(&mesh.vertices, p, 0.0).unwrap().distance < 1e-15);
        }
    }

    #[test]
    fn a_tree_of_some_faces_finds_only_those() {
        let mesh = icosphere(2);
        let x = &mesh.vertices;
        let some: Vec<u32> = (0..mesh.topology.face_count() as u32).filter(|face| face % 5 == 2).collect();
        let tree = TriangleBvh::of_faces(&mesh.topology, x, &some);
        assert_eq!(tree.face_count(), some.len());
        let mut rng = seeded_rng(9);
        for face in 0..100 {
            let p = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
            let distance = |&face: &u32| {
                closest_point_on_triangle(p, corners(mesh.topology.faces()[face as usize], x)).0.distance(p)
            };
            let truth = some.iter().map(distance).fold(f64::INFINITY, f64::min);
            // Faces that are in the tree, faces that are not, and faces that do not exist.
            for likely in [Some(face), Some(u32::MAX), None] {
                let found = tree.closest_point_near(x, p, f64::INFINITY, likely).unwrap();
                assert!((found.distance - truth).abs() < 1e-12 && found.face % 5 == 2);
            }
        }
    }

    #[test]
    fn far_and_bad_points_are_handled() {
        let mesh = icosphere(2);
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        let far = Vec3::new(1e6, 2e6, -1e6);
        let found = tree.closest_point(&mesh.vertices, far, f64::INFINITY).unwrap();
        assert!((found.distance - brute_force(&mesh, &mesh.vertices, far)).abs() < 1e-9);
        assert_eq!(tree.closest_point(&mesh.vertices, Vec3::splat(f64::NAN), 1.0), None);
        let empty = TriangleBvh::of_faces(&mesh.topology, &mesh.vertices, &[]);
        assert_eq!(empty.closest_point(&mesh.vertices, Vec3::ZERO, f64::INFINITY), None);
    }
}
