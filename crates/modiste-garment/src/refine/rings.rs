//! Vertices around some of a garment, and evening out what they carry.

use modiste_core::{Topology, Vec3};

/// A region that grows in rings. Keeps its memory.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rings {
    vertices: Vec<u32>,
    has: Vec<bool>,
    averages: Vec<Vec3>,
}

impl Rings {
    /// Empties the region, for a garment of `count` vertices.
    pub(crate) fn clear(&mut self, count: usize) {
        self.has.clear();
        self.has.resize(count, false);
        self.vertices.clear();
    }

    /// The vertices of the region.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// Whether a vertex is in the region.
    pub(crate) fn has(&self, vertex: u32) -> bool {
        self.has.get(vertex as usize).is_some_and(|&has| has)
    }

    /// Takes a vertex in, once.
    pub(crate) fn add(&mut self, vertex: u32) {
        if !std::mem::replace(&mut self.has[vertex as usize], true) {
            self.vertices.push(vertex);
        }
    }

    /// Takes in so many rings of neighbours, but for those that are `held`.
    pub(crate) fn grow(&mut self, topology: &Topology, rings: usize, held: impl Fn(u32) -> bool) {
        let mut begin = 0;
        for _ in 0..rings {
            let end = self.vertices.len();
            for index in begin..end {
                for &vertex in topology.neighbours(self.vertices[index] as usize) {
                    if !held(vertex) {
                        self.add(vertex);
                    }
                }
            }
            begin = end;
        }
    }

    /// Moves what every vertex of the region carries half of the way to the mean of its neighbours, so many times.
    pub(crate) fn even_out(&mut self, topology: &Topology, times: usize, carried: &mut [Vec3]) {
        for _ in 0..times {
            self.averages.clear();
            self.averages.extend(self.vertices.iter().map(|&vertex| {
                let around = topology.neighbours(vertex as usize);
                let sum: Vec3 = around.iter().map(|&other| carried[other as usize]).sum();
                carried[vertex as usize].midpoint(sum / around.len().max(1) as f64)
            }));
            for (&vertex, average) in self.vertices.iter().zip(&self.averages) {
                carried[vertex as usize] = *average;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Rings;
    use modiste_core::Vec3;
    use modiste_core::shapes::grid;

    #[test]
    fn a_spike_is_evened_out_within_the_rings_and_not_beyond() {
        let cloth = grid(10, 10);
        let mut heights = vec![Vec3::ZERO; cloth.vertices.len()];
        let spike = 5 * 11 + 5;
        heights[spike] = Vec3::Y;
        let mut rings = Rings::default();
        rings.clear(heights.len());
        rings.add(spike as u32);
        let held = cloth.topology.neighbours(spike)[0];
        rings.grow(&cloth.topology, 1, |vertex| vertex == held);
        assert_eq!(rings.vertices().len(), cloth.topology.neighbours(spike).len());
        rings.even_out(&cloth.topology, 4, &mut heights);
        assert!(heights[spike].y < 0.3 && heights[held as usize] == Vec3::ZERO);
        let moved = heights.iter().filter(|height| **height != Vec3::ZERO).count();
        assert_eq!(moved, rings.vertices().len());
    }
}
