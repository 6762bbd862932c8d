//! Where a garment crosses itself: a sleeve in the trunk, folds of a skirt.

use modiste_core::{Topology, Vec3, corners, triangle_separation};

use super::patches::Patches;
use super::rings::Rings;

/// Triangles in each other by less than this (m) are left: what is deeper shows.
const DEEP: f64 = 0.0015;
/// Rings around a pair that give way.
const RINGS: usize = 2;
/// How often the region is evened out before the vertices are pushed out again.
const TIMES: usize = 4;

/// Finds where a garment crosses itself, and draws the folds out. Keeps its memory.
///
/// Which way two layers would part is not told by the triangles that cross: of a fold that has gone through itself they are
/// only the rim. Evened out, it is gone.
#[derive(Debug, Clone)]
pub(crate) struct Folds {
    patches: Patches,
    /// Pairs of faces that came near each other when all were looked at.
    near: Vec<[u32; 2]>,
    found: Vec<[u32; 2]>,
    region: Rings,
}

impl Folds {
    pub(crate) fn new(topology: &Topology) -> Self {
        Self { patches: Patches::new(topology), near: Vec::new(), found: Vec::new(), region: Rings::default() }
    }

    /// Looks at all of a garment (m), which [`Self::find`] looks at closely.
    pub(crate) fn survey(&mut self, topology: &Topology, garment: &[Vec3]) {
        self.patches.pairs_that_may_cross(topology, garment, &mut self.near);
    }

    /// Finds the pairs of triangles that are deep in each other, among those that were near each other in the survey; returns
    /// how many there are. Those with all corners `held`, between parts of the body that pass through each other, are left out.
    pub(crate) fn find(&mut self, topology: &Topology, held: impl Fn(u32) -> bool, garment: &[Vec3]) -> usize {
        self.found.clear();
        for pair in &self.near {
            let faces = pair.map(|face| topology.faces()[face as usize]);
            let is_apart = !faces[0].iter().any(|vertex| faces[1].contains(vertex));
            if is_apart && !faces.as_flattened().iter().all(|&vertex| held(vertex)) {
                let [first, second] = faces.map(|face| corners(face, garment));
                let way = triangle_separation(first, second);
                self.found.extend(way.filter(|way| way.length_squared() > DEEP * DEEP).map(|_| *pair));
            }
        }
        self.found.len()
    }

    /// Evens out the garment (m) around the pairs that were found, but for vertices that are `held`; returns what moved.
    pub(crate) fn draw_out(&mut self, topology: &Topology, held: impl Fn(u32) -> bool, garment: &mut [Vec3]) -> &[u32] {
        self.region.clear(garment.len());
        for &face in self.found.as_flattened() {
            let free = topology.faces()[face as usize].into_iter().filter(|&vertex| !held(vertex));
            free.for_each(|vertex| self.region.add(vertex));
        }
        self.region.grow(topology, RINGS, held);
        self.region.even_out(topology, TIMES, garment);
        self.region.vertices()
    }
}
