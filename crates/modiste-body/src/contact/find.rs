//! Where a vertex meets other skin: seen along its normal, by rays.

use modiste_core::{RayHit, Topology, TriangleBvh, Vec3, corners};
use rayon::prelude::*;

use super::GAP;

/// Rays start this far (m) above the skin.
const LIFT: f64 = 1e-5;

/// How far (m) a vertex may be inside other skin for the way out to be looked for.
const DEEPEST: f64 = 0.08;

/// Other skin is looked for as far as this (m): a broad trunk is as wide, from armpit to armpit.
const FURTHEST: f64 = 0.6;

/// Two points of skin whose distance has shrunk by less than this since the template pose are two sides of one limb.
const CAME_NEARER: f64 = 1.3;

/// Skins that face each other less than the first (cosine, negated) do not count as meeting; from the second on they count
/// in full. Less is the slope of any fold.
const FACING: [f64; 2] = [0.3, 0.6];

/// Vertices that a thread looks at together.
const AT_ONCE: usize = 128;

/// A vertex that other skin comes near to, or has passed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    pub(super) vertex: u32,
    /// Normal of the skin at the vertex.
    pub(super) normal: Vec3,
    /// Corners of the face on the line through the vertex along its normal, and where on it.
    pub(super) face: [u32; 3],
    pub(super) barycentric: [f64; 3],
    /// Part of what is missing by which this vertex has to give way: half, or less where the skins hardly face each other.
    pub(super) share: f64,
}

impl Touch {
    /// Where the other skin is, along the normal (m): negative where the vertex is inside it.
    pub(super) fn height(&self, x: &[Vec3]) -> f64 {
        (at(self.face, self.barycentric, x) - x[self.vertex as usize]).dot(self.normal)
    }
}

/// A surface, ready to be looked at along rays.
pub(super) struct Surface<'a> {
    pub(super) topology: &'a Topology,
    pub(super) tree: &'a TriangleBvh,
    pub(super) x: &'a [Vec3],
}

impl Surface<'_> {
    /// What each of some vertices touches, in their order.
    pub(super) fn touches(&self, vertices: &[u32], rest: &[Vec3], thickness: &[f64], out: &mut Vec<Option<Touch>>) {
        let look = |&vertex: &u32| self.touch(vertex, rest, thickness[vertex as usize]);
        vertices.par_iter().with_min_len(AT_ONCE).map(look).collect_into_vec(out);
    }

    fn touch(&self, vertex: u32, rest: &[Vec3], thickness: f64) -> Option<Touch> {
        let normal = self.normal(vertex);
        let lifted = self.x[vertex as usize] + LIFT * normal;
        let first = self.tree.ray_hit(self.x, lifted, normal, FURTHEST)?;
        let came_nearer = |hit: &RayHit, distance: f64| {
            let face = self.topology.faces()[hit.face as usize];
            at(face, hit.barycentric, rest).distance(rest[vertex as usize]) > CAME_NEARER * distance
        };
        let (hit, weight) = if self.slope(&first, normal) > 0.0 {
            // What is met first is left, not entered: the vertex is inside. The way out is back through its own limb.
            let deepest = DEEPEST.min(thickness);
            let mut gone = 0.0;
            let exit = loop {
                let hit = self.tree.ray_hit(self.x, lifted - gone * normal, -normal, deepest - gone)?;
                gone += hit.distance + LIFT;
                if self.slope(&hit, -normal) > 0.0 {
                    break hit;
                }
            };
            // Where its own limb ends first, the limb is swallowed whole, and the way out is another.
            if !came_nearer(&exit, gone) {
                return None;
            }
            (exit, 1.0)
        } else {
            let facing = (-self.slope(&first, normal) - FACING[0]) / (FACING[1] - FACING[0]);
            if first.distance >= GAP || facing <= 0.0 || !came_nearer(&first, first.distance) {
                return None;
            }
            (first, facing.min(1.0))
        };
        let face = self.topology.faces()[hit.face as usize];
        Some(Touch { vertex, normal, face, barycentric: hit.barycentric, share: 0.5 * weight })
    }

    /// The skin that a vertex sees within a distance (m), if it faces the vertex.
    pub(super) fn facing(&self, x: Vec3, normal: Vec3, distance: f64) -> Option<RayHit> {
        let hit = self.tree.ray_hit(self.x, x + LIFT * normal, normal, distance)?;
        (self.slope(&hit, normal) < -FACING[0]).then_some(hit)
    }

    /// How thick the body is under a vertex (m), [`FURTHEST`] at most.
    pub(super) fn thickness(&self, x: Vec3, normal: Vec3) -> f64 {
        self.tree.ray_hit(self.x, x - LIFT * normal, -normal, FURTHEST).map_or(FURTHEST, |hit| hit.distance)
    }

    /// Cosine between a direction and the normal of the face that was met: positive where the face is left from inside.
    fn slope(&self, hit: &RayHit, direction: Vec3) -> f64 {
        let [a, b, c] = corners(self.topology.faces()[hit.face as usize], self.x);
        (b - a).cross(c - a).normalize_or_zero().dot(direction)
    }

    /// Normal of the skin at a vertex, by the areas of its faces.
    fn normal(&self, vertex: u32) -> Vec3 {
        let sum = |sum: Vec3, &face: &u32| {
            let [a, b, c] = corners(self.topology.faces()[face as usize], self.x);
            sum + (b - a).cross(c - a)
        };
        self.topology.vertex_faces(vertex as usize).iter().fold(Vec3::ZERO, sum).normalize_or_zero()
    }
}

fn at(face: [u32; 3], barycentric: [f64; 3], x: &[Vec3]) -> Vec3 {
    let [a, b, c] = corners(face, x);
    barycentric[0] * a + barycentric[1] * b + barycentric[2] * c
}
