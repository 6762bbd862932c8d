//! Where a garment crosses itself: a sleeve in the trunk, folds of a skirt.

use modiste_core::{Topology, Vec3, corners, triangle_separation};

use super::patches::Patches;
use super::warp::Push;

/// Triangles in each other by less than this (m) are left: what is deeper shows.
const DEEP: f64 = 0.0015;
/// How far apart triangles are sent (m).
const CLEARANCE: f64 = 0.0003;

/// Two triangles of cloth that cross, and the way (m) that the second has to go to touch the first only.
#[derive(Debug, Clone, Copy)]
struct Fold {
    faces: [[u32; 3]; 2],
    way: Vec3,
}

/// Finds where a garment crosses itself. Keeps its memory.
#[derive(Debug, Clone)]
pub(crate) struct Folds {
    patches: Patches,
    /// Pairs of faces that came near each other when all were looked at.
    near: Vec<[u32; 2]>,
    found: Vec<Fold>,
}

impl Folds {
    pub(crate) fn new(topology: &Topology) -> Self {
        Self { patches: Patches::new(topology), near: Vec::new(), found: Vec::new() }
    }

    /// Looks at all of a garment (m), which [`Self::find`] looks at closely.
    pub(crate) fn survey(&mut self, topology: &Topology, garment: &[Vec3]) {
        self.patches.pairs_that_may_cross(topology, garment, &mut self.near);
    }

    /// Finds the pairs of triangles that are deep in each other, among those that were near each other in the survey. Those
    /// with a corner that is `held`, between parts of the body that pass through each other, are left out.
    pub(crate) fn find(&mut self, topology: &Topology, held: impl Fn(u32) -> bool, garment: &[Vec3]) {
        self.found.clear();
        for pair in &self.near {
            let faces = pair.map(|face| topology.faces()[face as usize]);
            // Faces that share a corner part by no push.
            let is_apart = !faces[0].iter().any(|vertex| faces[1].contains(vertex));
            if is_apart && !faces.as_flattened().iter().any(|&vertex| held(vertex)) {
                let [first, second] = faces.map(|face| corners(face, garment));
                let way = triangle_separation(first, second).filter(|way| way.length_squared() > DEEP * DEEP);
                self.found.extend(way.map(|way| Fold { faces, way }));
            }
        }
    }

    /// How many pairs were found.
    pub(crate) fn count(&self) -> usize {
        self.found.len()
    }

    /// Pushes that part the pairs, each triangle by half the way.
    pub(crate) fn pushes(&self, weight: f64) -> impl Iterator<Item = Push> {
        self.found.iter().flat_map(move |fold| {
            let length = fold.way.length();
            let normal = fold.way / length;
            let sides = [(fold.faces[0], -normal), (fold.faces[1], normal)];
            sides.into_iter().flat_map(move |(face, normal)| {
                face.map(|vertex| Push { vertex, normal, gap: 0.5 * length + CLEARANCE, weight })
            })
        })
    }
}
