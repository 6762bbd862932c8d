//! A tree of boxes over triangles that follows their motion.

use super::closest::{Closest, closest_on_triangle};
use modiste_core::Vec3;

/// Triangles in a leaf, at most.
const LEAF: usize = 4;

/// A tree of bounding boxes over some faces of a mesh, built once and refitted as the mesh moves.
#[derive(Debug, Clone, Default)]
pub(crate) struct FaceTree {
    nodes: Vec<Node>,
    /// Faces in leaf order.
    faces: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    low: glam::Vec3A,
    high: glam::Vec3A,
    /// The second child (the first follows its parent), or zero for a leaf.
    second: u32,
    /// The node after the last one of this subtree.
    after: u32,
    first_face: u32,
    face_count: u32,
}

impl FaceTree {
    /// Builds the tree over `subset`, faces of the mesh with corners `faces` at `x`.
    pub(crate) fn new(faces: &[[u32; 3]], subset: Vec<u32>, x: &[Vec3]) -> Self {
        let centres: Vec<Vec3> =
            subset.iter().map(|&f| faces[f as usize].iter().map(|&v| x[v as usize]).sum::<Vec3>() / 3.0).collect();
        let mut order: Vec<u32> = (0u32..).take(subset.len()).collect();
        let mut tree = Self { nodes: Vec::with_capacity(2 * subset.len() / LEAF + 1), faces: Vec::new() };
        if !order.is_empty() {
            let count = order.len();
            tree.split(&mut order, &centres, 0, count);
        }
        tree.faces = order.iter().map(|&i| subset[i as usize]).collect();
        tree.refit(faces, x);
        tree
    }

    #[expect(clippy::cast_possible_truncation, reason = "face counts fit u32 by construction of the topology")]
    fn split(&mut self, order: &mut [u32], centres: &[Vec3], first: usize, count: usize) {
        let node = self.nodes.len();
        let nothing = glam::Vec3A::ZERO;
        self.nodes.push(Node {
            low: nothing,
            high: nothing,
            second: 0,
            after: node as u32 + 1,
            first_face: first as u32,
            face_count: count as u32,
        });
        if count <= LEAF {
            return;
        }
        let part = &mut order[first..first + count];
        let (low, high) = part.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &i| {
            (low.min(centres[i as usize]), high.max(centres[i as usize]))
        });
        let axis = (high - low).max_position();
        let half = count / 2;
        part.select_nth_unstable_by(half, |&a, &b| {
            centres[a as usize][axis].total_cmp(&centres[b as usize][axis]).then(a.cmp(&b))
        });
        self.split(order, centres, first, half);
        self.nodes[node].second = self.nodes.len() as u32;
        self.split(order, centres, first + half, count - half);
        self.nodes[node].after = self.nodes.len() as u32;
    }

    /// Makes the boxes fit the mesh at `x` again.
    pub(crate) fn refit(&mut self, faces: &[[u32; 3]], x: &[Vec3]) {
        for index in (0..self.nodes.len()).rev() {
            let node = self.nodes[index];
            let (low, high) = if node.second == 0 {
                let range = node.first_face as usize..(node.first_face + node.face_count) as usize;
                let start = (glam::Vec3A::INFINITY, glam::Vec3A::NEG_INFINITY);
                let corners =
                    self.faces[range].iter().flat_map(|&f| faces[f as usize]).map(|v| x[v as usize].as_vec3a());
                corners.fold(start, |(low, high), p| (low.min(p), high.max(p)))
            } else {
                let (a, b) = (self.nodes[index + 1], self.nodes[node.second as usize]);
                (a.low.min(b.low), a.high.max(b.high))
            };
            (self.nodes[index].low, self.nodes[index].high) = (low, high);
        }
    }

    /// The face closest to `p`, nearer than `best` (distance, m), which is updated; only faces whose normal points
    /// against `facing` where it is given.
    pub(crate) fn closest(
        &self,
        faces: &[[u32; 3]],
        x: &[Vec3],
        p: Vec3,
        facing: Option<Vec3>,
        best: &mut f64,
    ) -> Option<(u32, Closest)> {
        if self.nodes.is_empty() {
            return None;
        }
        let single = p.as_vec3a();
        let mut found = None;
        let mut best_squared = *best * *best;
        // Boxes are rounded to f32: a relative slack keeps faces at the rim of a box.
        let lower_bound = |node: &Node| {
            let outside = (node.low - single).max(single - node.high).max(glam::Vec3A::ZERO);
            f64::from(outside.length_squared()) * 0.999_99 - 1e-9
        };
        let mut stack = [(0u32, 0.0f64); 64];
        let mut depth = 1;
        stack[0] = (0, lower_bound(&self.nodes[0]));
        while depth > 0 {
            depth -= 1;
            let (index, bound) = stack[depth];
            if bound > best_squared {
                continue;
            }
            let node = &self.nodes[index as usize];
            if node.second == 0 {
                let range = node.first_face as usize..(node.first_face + node.face_count) as usize;
                for &face in &self.faces[range] {
                    let corners = faces[face as usize].map(|v| x[v as usize]);
                    if facing.is_some_and(|facing| looks_along(corners, facing)) {
                        continue;
                    }
                    let closest = closest_on_triangle(p, corners);
                    let squared = closest.point.distance_squared(p);
                    if squared < best_squared {
                        best_squared = squared;
                        found = Some((face, closest));
                    }
                }
                continue;
            }
            let children = [index + 1, node.second];
            let bounds = children.map(|child| lower_bound(&self.nodes[child as usize]));
            let near = usize::from(bounds[1] < bounds[0]);
            // Median splits keep the depth below 32 for any u32 count of faces.
            stack[depth] = (children[1 - near], bounds[1 - near]);
            stack[depth + 1] = (children[near], bounds[near]);
            depth += 2;
        }
        if found.is_some() {
            *best = best_squared.sqrt();
        }
        found
    }
}

impl FaceTree {
    /// Calls `visit` for the faces of all leaves whose box comes within `reach` (m) of `p`.
    pub(crate) fn for_each_near(&self, p: Vec3, reach: f64, mut visit: impl FnMut(u32)) {
        let single = p.as_vec3a();
        let bound = reach * reach * 1.0001 + 1e-9;
        let mut index = 0;
        // Nodes stand in depth-first order: a node that is out of reach is left by jumping over its subtree.
        while let Some(node) = self.nodes.get(index) {
            let outside = (node.low - single).max(single - node.high).max(glam::Vec3A::ZERO);
            if f64::from(outside.length_squared()) > bound {
                index = node.after as usize;
                continue;
            }
            if node.second == 0 {
                let range = node.first_face as usize..(node.first_face + node.face_count) as usize;
                self.faces[range].iter().for_each(|&face| visit(face));
            }
            index += 1;
        }
    }
}

/// Whether a triangle's normal is less than about 110 degrees from `direction`.
#[inline]
fn looks_along([a, b, c]: [Vec3; 3], direction: Vec3) -> bool {
    let normal = (b - a).cross(c - a);
    let along = normal.dot(direction);
    along > 0.0 || along * along < 0.1 * normal.length_squared()
}

#[cfg(test)]
mod tests {
    use super::super::closest::closest_on_triangle;
    use super::FaceTree;
    use modiste_core::{Vec3, seeded_rng, uniform};

    #[test]
    fn tree_and_plain_search_agree_after_motion() {
        let mut rng = seeded_rng(11);
        let mut point = |scale: f64| Vec3::from_array(std::array::from_fn(|_| scale * (2.0 * uniform(&mut rng) - 1.0)));
        let mut x: Vec<Vec3> = Vec::new();
        let mut faces = Vec::new();
        for face in 0..200u32 {
            let centre = point(1.0);
            x.extend([0, 1, 2].map(|_| centre + point(0.1)));
            faces.push([3 * face, 3 * face + 1, 3 * face + 2]);
        }
        let mut tree = FaceTree::new(&faces, (0..200).collect(), &x);
        for p in &mut x {
            *p += point(0.2);
        }
        tree.refit(&faces, &x);
        for _ in 0..100 {
            let p = point(1.2);
            let plain = faces
                .iter()
                .map(|f| closest_on_triangle(p, f.map(|v| x[v as usize])).point.distance(p))
                .fold(f64::INFINITY, f64::min);
            let mut best = f64::INFINITY;
            assert!(tree.closest(&faces, &x, p, None, &mut best).is_some());
            assert!((best - plain).abs() < 1e-12);
            let mut near = Vec::new();
            tree.for_each_near(p, 0.3, |face| near.push(face));
            for (face, corners) in (0u32..).zip(&faces) {
                let corners = corners.map(|v| x[v as usize]);
                if closest_on_triangle(p, corners).point.distance(p) <= 0.3 {
                    assert!(near.contains(&face));
                }
            }
            let mut bound = plain * 0.9;
            assert!(tree.closest(&faces, &x, p, None, &mut bound).is_none());
        }
    }
}
