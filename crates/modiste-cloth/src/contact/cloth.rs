//! Contact of the cloth with itself: vertices keep their distance from faces, on the side where they are.

use super::closest::closest_on_triangle;
use super::tree::FaceTree;
use modiste_core::{Topology, Vec3};

/// Pairs are looked for within this many thicknesses at the start of a frame, beyond what the cloth moves.
const REACH: f64 = 2.0;

/// The most (m) that motion adds to the reach.
const MAX_MOTION: f64 = 0.02;

/// Vertices and faces of the cloth that may touch within the frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct SelfContacts {
    /// Vertex and face.
    pairs: Vec<(u32, u32)>,
}

/// A vertex too near to a face.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SelfForce {
    /// The vertex, then the corners of the face.
    pub(crate) vertices: [u32; 4],
    /// `normal · Σ w x` is the gap.
    pub(crate) weights: [f64; 4],
    pub(crate) normal: Vec3,
    /// How much nearer than the thickness they are (m).
    pub(crate) depth: f64,
}

impl SelfContacts {
    /// Number of pairs under watch.
    pub(crate) fn len(&self) -> usize {
        self.pairs.len()
    }

    /// Forgets all pairs.
    pub(crate) fn clear(&mut self) {
        self.pairs.clear();
    }

    /// Finds the pairs of a frame that lasts `dt`. `tree` fits the cloth at `x`.
    pub(crate) fn search(
        &mut self,
        cloth: &Topology,
        tree: &FaceTree,
        (x, v): (&[Vec3], &[Vec3]),
        thickness: f64,
        dt: f64,
    ) {
        self.pairs.clear();
        // Neighbours move together: what counts is how fast a vertex goes against the cloth as a whole.
        let mean = v.iter().sum::<Vec3>() / v.len().max(1) as f64;
        for (vertex, place) in (0u32..).zip(x) {
            let motion = (v[vertex as usize].distance(mean) * dt).min(MAX_MOTION);
            let reach = REACH * thickness + motion;
            let own = cloth.neighbours(vertex as usize);
            tree.for_each_near(*place, reach, |face| {
                let corners = cloth.faces()[face as usize];
                if !corners.iter().any(|corner| *corner == vertex || own.contains(corner)) {
                    self.pairs.push((vertex, face));
                }
            });
        }
    }

    /// Calls `push` for every pair that is nearer at `predicted` than the thickness, seen from the side that it has at
    /// `start`: what has once gone through stays there and is pushed apart on that side.
    pub(crate) fn forces(
        &self,
        cloth: &Topology,
        thickness: f64,
        (start, predicted): (&[Vec3], &[Vec3]),
        mut push: impl FnMut(SelfForce),
    ) {
        for &(vertex, face) in &self.pairs {
            let [a, b, c] = cloth.faces()[face as usize];
            let at = |x: &[Vec3]| [a, b, c].map(|v| x[v as usize]);
            let place = start[vertex as usize];
            let closest = closest_on_triangle(place, at(start));
            let offset = place - closest.point;
            let distance = offset.length();
            let moved = predicted[vertex as usize].distance(place) + predicted[a as usize].distance(start[a as usize]);
            if distance > thickness + moved || distance < 1e-9 {
                continue;
            }
            let normal = offset / distance;
            let [u, v, w] = closest.barycentric;
            let [p, q, r] = at(predicted);
            let gap = normal.dot(predicted[vertex as usize] - (p * u + q * v + r * w));
            if gap < thickness {
                let weights = [1.0, -u, -v, -w];
                push(SelfForce { vertices: [vertex, a, b, c], weights, normal, depth: thickness - gap });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::SelfContacts;
    use crate::contact::tree::FaceTree;
    use modiste_core::{Topology, Vec3};

    #[test]
    fn two_layers_are_pushed_apart_and_neighbours_left_alone() {
        // A triangle above the middle of another; the third face is tied to the first.
        let lower = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(0.03, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.03)];
        let upper = lower.map(|p| p * 0.2 + Vec3::new(0.005, 0.001, 0.005));
        let x = [lower.as_slice(), upper.as_slice(), &[Vec3::new(0.03, 0.0005, 0.03)]].concat();
        let topology = Topology::new(7, vec![[0, 1, 2], [3, 4, 5], [1, 6, 2]]).unwrap();
        let tree = FaceTree::new(topology.faces(), vec![0, 1, 2], &x);
        let mut contacts = SelfContacts::default();
        contacts.search(&topology, &tree, (&x, &[Vec3::ZERO; 7]), 0.002, 1.0 / 30.0);
        let mut found = Vec::new();
        contacts.forces(&topology, 0.002, (&x, &x), |force| found.push(force));
        assert!(found.iter().any(|f| f.vertices == [3, 0, 1, 2]));
        assert!(found.iter().all(|f| f.vertices[0] != 6 && f.vertices[0] != 0));
        for force in &found {
            assert!((force.depth - 0.001).abs() < 1e-9 && force.weights.iter().sum::<f64>().abs() < 1e-12);
        }
    }
}
