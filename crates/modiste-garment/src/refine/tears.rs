//! Mending what pushing vertices out has torn: neighbours that were sent different ways are brought together again.

use modiste_core::{Edge, Topology, Vec3};
use rayon::prelude::*;

use super::rings::Rings;

/// An edge is torn when it is longer than this many times its length as predicted, and by more than [`LEAST_TEAR`].
const TORN: f64 = 1.6;
/// Added to the length that an edge may have (m): short edges stretch much without being seen.
const LEAST_TEAR: f64 = 0.005;
/// Rings around a torn edge that give way.
const RINGS: usize = 3;
/// Rounds of averaging before the vertices are pushed out again.
const AVERAGES: usize = 6;
/// Edges that one thread takes at a time.
const EDGES_AT_ONCE: usize = 1024;

/// Finds torn edges and evens out the displacements around them. Keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Tears {
    region: Rings,
    /// Whether any of a run of edges is torn.
    torn_runs: Vec<bool>,
    displacements: Vec<Vec3>,
}

impl Tears {
    /// The vertices that [`Self::mend`] has moved.
    pub(crate) fn region(&self) -> &[u32] {
        self.region.vertices()
    }

    /// Replaces the displacements from `predicted` by the mean of their neighbours' around all torn edges. Returns
    /// whether there were any. Vertices that are `held` stay, and edges at them may be long.
    pub(crate) fn mend(
        &mut self,
        topology: &Topology,
        held: impl Fn(u32) -> bool + Sync,
        predicted: &[Vec3],
        garment: &mut [Vec3],
    ) -> bool {
        self.find(topology, held, predicted, garment);
        if self.region.vertices().is_empty() {
            return false;
        }
        self.displacements.resize(garment.len(), Vec3::ZERO);
        for ((displacement, at), from) in self.displacements.iter_mut().zip(garment.iter()).zip(predicted) {
            *displacement = *at - *from;
        }
        self.region.even_out(topology, AVERAGES, &mut self.displacements);
        for &vertex in self.region.vertices() {
            garment[vertex as usize] = predicted[vertex as usize] + self.displacements[vertex as usize];
        }
        true
    }

    /// The ends of torn edges and the rings around them.
    fn find(&mut self, topology: &Topology, held: impl Fn(u32) -> bool + Sync, predicted: &[Vec3], garment: &[Vec3]) {
        let Self { region, torn_runs, .. } = self;
        region.clear(garment.len());
        let is_torn = |edge: &Edge| {
            let [a, b] = edge.vertices.map(|vertex| vertex as usize);
            // Nearly all are told without a root.
            let (squared, was) = (garment[a].distance_squared(garment[b]), predicted[a].distance_squared(predicted[b]));
            let may_be = || TORN * was.sqrt() + LEAST_TEAR;
            let is_long = squared > TORN * TORN * was && squared > may_be().powi(2);
            is_long && !edge.vertices.iter().any(|&vertex| held(vertex))
        };
        let runs = topology.edges().par_chunks(EDGES_AT_ONCE);
        torn_runs.resize(runs.len(), false);
        runs.zip(&mut *torn_runs).for_each(|(edges, is_any_torn)| *is_any_torn = edges.iter().any(is_torn));
        let runs = topology.edges().chunks(EDGES_AT_ONCE).zip(torn_runs).filter(|(_, is_any_torn)| **is_any_torn);
        for edge in runs.flat_map(|(edges, _)| edges).filter(|edge| is_torn(edge)) {
            edge.vertices.iter().for_each(|&vertex| region.add(vertex));
        }
        region.grow(topology, RINGS, held);
    }
}

#[cfg(test)]
mod tests {
    use super::Tears;
    use modiste_core::Vec3;
    use modiste_core::shapes::grid;

    #[test]
    fn a_vertex_that_was_torn_out_comes_back_and_the_rest_stays() {
        let cloth = grid(20, 20);
        let mut garment: Vec<Vec3> = cloth.vertices.iter().map(|v| *v + 0.1 * Vec3::Y).collect();
        let torn = (0..garment.len()).min_by(|&a, &b| {
            let middle = Vec3::new(0.5, 0.1, 0.5);
            garment[a].distance(middle).total_cmp(&garment[b].distance(middle))
        });
        let torn = torn.unwrap();
        garment[torn] += 0.3 * Vec3::Y;
        let mut tears = Tears::default();
        let mut rounds = 0;
        while tears.mend(&cloth.topology, |_| false, &cloth.vertices, &mut garment) && rounds < 10 {
            assert!(tears.region().contains(&(torn as u32)) && tears.region().len() < 60);
            rounds += 1;
        }
        assert!((1..3).contains(&rounds));
        let height = |vertex: usize| garment[vertex].y;
        assert!(height(torn) < 0.15 && height(torn) > 0.1);
        assert!((height(0) - 0.1).abs() < 1e-15, "the rest stays");
        // A vertex that is held somewhere is not a tear.
        garment[torn] += 0.3 * Vec3::Y;
        let before = garment.clone();
        assert!(!tears.mend(&cloth.topology, |vertex| vertex as usize == torn, &cloth.vertices, &mut garment));
        assert_eq!(before, garment);
    }
}
