//! Faces whose boxes meet, and faces that cross.

use super::{Child, ChildKind, Node, STACK, TriangleBvh, WIDTH};
use crate::Vec3;
use crate::triangle::segment_crosses_triangle;

impl TriangleBvh {
    /// Calls `visit` with every face whose box may meet the given one (m); a few further faces can come along.
    pub fn for_each_in_box(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(u32)) {
        let query = (low, high);
        let mut stack = [0u32; STACK];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let node = &self.nodes[stack[depth] as usize];
            for slot in 0..WIDTH {
                if !meets(child_box(node, slot), query) {
                    continue;
                }
                match node.children[slot].kind() {
                    ChildKind::Empty => {}
                    ChildKind::Node(child) => {
                        stack[depth] = child as u32;
                        depth += 1;
                    }
                    ChildKind::Leaf(first, count) => self.faces[first..first + count].iter().for_each(|&f| visit(f)),
                }
            }
        }
    }

    /// Pairs of faces of this surface that cross each other, the smaller index first, ascending.
    ///
    /// Faces that share an edge are left out; of faces that share one corner the opposite edges decide. Faces that
    /// touch without crossing because they lie in one plane do not count.
    pub fn self_intersections(&self, x: &[Vec3]) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        self.meeting_leaves(self, |a, b| {
            if self.faces[a] < self.faces[b] && crosses_neighbour(self.corners[a], self.corners[b], x) {
                pairs.push([self.faces[a], self.faces[b]]);
            }
        });
        pairs.sort_unstable();
        pairs
    }

    /// Pairs of a face of this surface and a face of another that cross, ascending.
    pub fn intersections(&self, x: &[Vec3], other: &Self, other_x: &[Vec3]) -> Vec<[u32; 2]> {
        let mut pairs = Vec::new();
        self.meeting_leaves(other, |a, b| {
            if triangles_cross(self.triangle(a, x), other.triangle(b, other_x)) {
                pairs.push([self.faces[a], other.faces[b]]);
            }
        });
        pairs.sort_unstable();
        pairs
    }

    /// Calls `visit` with the leaf places of all pairs of faces whose leaves' boxes meet.
    fn meeting_leaves(&self, other: &Self, mut visit: impl FnMut(usize, usize)) {
        let (Some(own_bounds), Some(other_bounds)) = (self.bounds(), other.bounds()) else { return };
        let mut stack = vec![((Child::node(0), own_bounds), (Child::node(0), other_bounds))];
        while let Some((own, theirs)) = stack.pop() {
            if !meets(own.1, theirs.1) {
                continue;
            }
            match (own.0.kind(), theirs.0.kind()) {
                (ChildKind::Empty, _) | (_, ChildKind::Empty) => {}
                (ChildKind::Leaf(a, a_count), ChildKind::Leaf(b, b_count)) => {
                    for i in a..a + a_count {
                        (b..b + b_count).for_each(|j| visit(i, j));
                    }
                }
                (ChildKind::Node(node), ChildKind::Leaf(..)) => {
                    stack.extend(children(&self.nodes[node]).map(|child| (child, theirs)));
                }
                (ChildKind::Leaf(..), ChildKind::Node(node)) => {
                    stack.extend(children(&other.nodes[node]).map(|child| (own, child)));
                }
                (ChildKind::Node(a), ChildKind::Node(b)) => {
                    // Open the larger box.
                    let size = |(low, high): Box3| (high - low).length_squared();
                    if size(own.1) >= size(theirs.1) {
                        stack.extend(children(&self.nodes[a]).map(|child| (child, theirs)));
                    } else {
                        stack.extend(children(&other.nodes[b]).map(|child| (own, child)));
                    }
                }
            }
        }
    }
}

type Box3 = (Vec3, Vec3);

fn child_box(node: &Node, slot: usize) -> Box3 {
    let corner = |side: &[[f32; WIDTH]; 3]| Vec3::from_array([0, 1, 2].map(|axis| f64::from(side[axis][slot])));
    (corner(&node.low), corner(&node.high))
}

fn children(node: &Node) -> impl Iterator<Item = (Child, Box3)> {
    let present = (0..WIDTH).filter(|&slot| node.children[slot] != Child::EMPTY);
    present.map(|slot| (node.children[slot], child_box(node, slot)))
}

fn meets(a: Box3, b: Box3) -> bool {
    a.0.cmple(b.1).all() && b.0.cmple(a.1).all()
}

/// Whether two faces of one mesh cross, corners that they share aside.
fn crosses_neighbour(a: [u32; 3], b: [u32; 3], x: &[Vec3]) -> bool {
    let at = |face: [u32; 3]| face.map(|vertex| x[vertex as usize]);
    let mut shared = a.into_iter().filter(|vertex| b.contains(vertex));
    match (shared.next(), shared.next()) {
        (None, _) => triangles_cross(at(a), at(b)),
        (Some(vertex), None) => {
            let opposite = |face: [u32; 3]| {
                let corner = (0..3).find(|&corner| face[corner] == vertex).unwrap_or(0);
                [x[face[(corner + 1) % 3] as usize], x[face[(corner + 2) % 3] as usize]]
            };
            let ([a0, a1], [b0, b1]) = (opposite(a), opposite(b));
            segment_crosses_triangle(a0, a1, at(b)) || segment_crosses_triangle(b0, b1, at(a))
        }
        _ => false,
    }
}

/// Whether two triangles cross: an edge of one passes through the other.
pub fn triangles_cross(a: [Vec3; 3], b: [Vec3; 3]) -> bool {
    (0..3)
        .any(|i| segment_crosses_triangle(a[i], a[(i + 1) % 3], b) || segment_crosses_triangle(b[i], b[(i + 1) % 3], a))
}

#[cfg(test)]
mod tests {
    use super::triangles_cross;
    use crate::shapes::{icosphere, torus};
    use crate::{Topology, TriangleBvh, Vec3, bounds, corners};

    #[test]
    fn two_spheres_cross_where_brute_force_says() {
        let mesh = icosphere(2);
        let moved: Vec<Vec3> = mesh.vertices.iter().map(|&p| p + Vec3::new(0.9, 0.3, 0.1)).collect();
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        let other = TriangleBvh::new(&mesh.topology, &moved);
        let mut expected = Vec::new();
        for (a, &first) in (0u32..).zip(mesh.topology.faces()) {
            for (b, &second) in (0u32..).zip(mesh.topology.faces()) {
                if triangles_cross(corners(first, &mesh.vertices), corners(second, &moved)) {
                    expected.push([a, b]);
                }
            }
        }
        assert!(expected.len() > 20);
        assert_eq!(tree.intersections(&mesh.vertices, &other, &moved), expected);
    }

    #[test]
    fn sound_surfaces_do_not_cross_themselves_and_a_spindle_torus_does() {
        for mesh in [icosphere(3), torus(0.8, 0.3, 30, 20)] {
            let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
            assert_eq!(tree.self_intersections(&mesh.vertices), Vec::<[u32; 2]>::new());
        }
        let spindle = torus(0.2, 0.5, 30, 20);
        let tree = TriangleBvh::new(&spindle.topology, &spindle.vertices);
        assert!(!tree.self_intersections(&spindle.vertices).is_empty());
    }

    #[test]
    fn faces_that_share_a_corner_cross_when_folded_through() {
        let topology = Topology::new(5, vec![[0, 1, 2], [0, 3, 4]]).unwrap();
        let crossing = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.3, 0.3, 0.5], [0.3, 0.3, -0.5]];
        let apart = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.3, -0.3, 0.5], [-0.3, -0.3, -0.5]];
        for (points, expected) in [(crossing, 1), (apart, 0)] {
            let x = points.map(Vec3::from_array);
            assert_eq!(TriangleBvh::new(&topology, &x).self_intersections(&x).len(), expected);
        }
    }

    #[test]
    fn the_box_query_finds_every_face_whose_box_meets() {
        let mesh = icosphere(3);
        let tree = TriangleBvh::new(&mesh.topology, &mesh.vertices);
        let (low, high) = (Vec3::new(0.2, 0.1, -0.4), Vec3::new(0.9, 0.7, 0.5));
        let mut found = Vec::new();
        tree.for_each_in_box(low, high, |face| found.push(face));
        found.sort_unstable();
        found.dedup();
        for (index, &face) in (0u32..).zip(mesh.topology.faces()) {
            let (face_low, face_high) = bounds(&corners(face, &mesh.vertices)).unwrap();
            if face_low.cmple(high).all() && low.cmple(face_high).all() {
                assert!(found.binary_search(&index).is_ok());
            }
        }
        assert!(found.len() < mesh.topology.face_count() / 2);
    }
}
