//! Where a garment crosses itself: a sleeve in the trunk, folds of a skirt.

use modiste_core::{Topology, Vec3, corners, triangle_separation};
use rayon::prelude::*;

use super::patches::Patches;
use super::rings::Rings;

/// Triangles in each other by less than this (m) are left: what is deeper shows.
const DEEP: f64 = 0.0015;
/// Rings around a pair that give way.
const RINGS: usize = 2;
/// How often the region is evened out before the vertices are pushed out again.
const TIMES: usize = 4;

/// Pairs that one thread takes at a time.
const PAIRS_AT_ONCE: usize = 256;

/// Finds where a garment crosses itself, and draws the folds out. Keeps its memory.
///
/// Which way two layers would part is not told by the triangles that cross: of a fold that has gone through itself they are
/// only the rim. Evened out, it is gone.
#[derive(Debug, Clone)]
pub(crate) struct Folds {
    patches: Patches,
    /// Pairs of faces that came near each other when all were looked at.
    near: Vec<[u32; 2]>,
    /// Those that are deep in each other, found side by side in runs of pairs.
    found: Vec<Vec<[u32; 2]>>,
    /// What [`Self::draw_out`] has moved.
    region: Rings,
    is_surveyed: bool,
}

impl Folds {
    pub(crate) fn new(topology: &Topology) -> Self {
        Self {
            patches: Patches::new(topology),
            near: Vec::new(),
            found: Vec::new(),
            region: Rings::default(),
            is_surveyed: false,
        }
    }

    /// Looks at all of a garment (m), which [`Self::find`] looks at closely.
    pub(crate) fn survey(&mut self, topology: &Topology, garment: &[Vec3]) {
        self.patches.pairs_that_may_cross(topology, garment, &mut self.near);
        self.is_surveyed = true;
    }

    /// Finds the pairs of triangles that are deep in each other, among those that were near each other in the survey; returns
    /// how many there are. Those with all corners `held`, between parts of the body that pass through each other, are left out.
    pub(crate) fn find(&mut self, topology: &Topology, held: impl Fn(u32) -> bool + Sync, garment: &[Vec3]) -> usize {
        let Self { near, found, region, .. } = self;
        // What has not moved since the survey was asked about then.
        let all = std::mem::take(&mut self.is_surveyed);
        let is_deep = |pair: &&[u32; 2]| {
            let faces @ [first, second] = pair.map(|face| topology.faces()[face as usize]);
            let corners_of_both = || faces.as_flattened().iter().copied();
            (all || corners_of_both().any(|vertex| region.has(vertex)))
                && !first.iter().any(|vertex| second.contains(vertex))
                && are_deep(corners(first, garment), corners(second, garment))
                && !corners_of_both().all(&held)
        };
        let runs = near.par_chunks(PAIRS_AT_ONCE);
        // Never fewer, and each with room for all, so that their memory is kept.
        found.resize_with(found.len().max(runs.len()), || Vec::with_capacity(PAIRS_AT_ONCE));
        found.iter_mut().for_each(Vec::clear);
        runs.zip(&mut *found).for_each(|(pairs, found)| found.extend(pairs.iter().filter(is_deep)));
        found.iter().map(Vec::len).sum()
    }

    /// Evens out the garment (m) around the pairs that were found, but for vertices that are `held`; returns what moved.
    pub(crate) fn draw_out(&mut self, topology: &Topology, held: impl Fn(u32) -> bool, garment: &mut [Vec3]) -> &[u32] {
        self.region.clear(garment.len());
        for &face in self.found.iter().flatten().flatten() {
            let free = topology.faces()[face as usize].into_iter().filter(|&vertex| !held(vertex));
            free.for_each(|vertex| self.region.add(vertex));
        }
        self.region.grow(topology, RINGS, held);
        self.region.even_out(topology, TIMES, garment);
        self.region.vertices()
    }
}

/// Whether two triangles (m) are deep in each other.
fn are_deep(first @ [a, b, c]: [Vec3; 3], second: [Vec3; 3]) -> bool {
    // Most lie on one side.
    let normal = (b - a).cross(c - a);
    let [p, q, r] = second.map(|corner| normal.dot(corner - a) > 0.0);
    (p != q || q != r) && triangle_separation(first, second).is_some_and(|way| way.length_squared() > DEEP * DEEP)
}
