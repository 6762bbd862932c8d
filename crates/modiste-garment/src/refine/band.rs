//! The waist band drawn to the body: elastic lies close, wherever the prediction left it.

use std::collections::VecDeque;

use modiste_core::{Topology, Vec3};

use super::obstacle::{NO_HINT, Obstacle};

/// Height of an elastic band over the body (m).
const HEIGHT: f64 = 0.003;

/// Rings of vertices around the band that come along, each less than the one before.
const RINGS: u32 = 4;

/// Farther from the body than this (m) a band is not worn, and is left alone.
const REACH: f64 = 0.03;

/// The vertices at a waist band and how much of the way to the body they go.
///
/// The paper pulls the band by a term of the warp, λ_t, which leaves a predicted band that stands off the body mostly where it
/// is; the edge then shows through whatever is worn over it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Band {
    vertices: Vec<(u32, f64)>,
    hints: Vec<u32>,
}

impl Band {
    pub(crate) fn new(topology: &Topology, waist_band: &[u32]) -> Self {
        let mut ring = vec![RINGS; topology.vertex_count()];
        let mut queue: VecDeque<u32> = waist_band.iter().copied().collect();
        waist_band.iter().for_each(|&vertex| ring[vertex as usize] = 0);
        let mut vertices = Vec::new();
        while let Some(vertex) = queue.pop_front() {
            let here = ring[vertex as usize];
            vertices.push((vertex, 1.0 - f64::from(here) / f64::from(RINGS)));
            for &next in topology.neighbours(vertex as usize) {
                if here + 1 < ring[next as usize] {
                    ring[next as usize] = here + 1;
                    queue.push_back(next);
                }
            }
        }
        Self { hints: vec![NO_HINT; vertices.len()], vertices }
    }

    /// The vertices of the band itself.
    pub(crate) fn edge(&self) -> impl Iterator<Item = u32> {
        self.vertices.iter().filter(|(_, share)| *share >= 1.0).map(|&(vertex, _)| vertex)
    }

    /// Moves the vertices (m) that stand off `body`, and tells which they are.
    pub(crate) fn draw_in(&mut self, body: &Obstacle, garment: &mut [Vec3]) -> impl Iterator<Item = u32> {
        for (&(vertex, share), hint) in self.vertices.iter().zip(&mut self.hints) {
            let at = &mut garment[vertex as usize];
            let Some(contact) = body.contact(*at, REACH, hint) else { continue };
            if !contact.pinched && contact.distance > HEIGHT {
                *at -= share * (contact.distance - HEIGHT) * contact.normal;
            }
        }
        self.vertices.iter().map(|&(vertex, _)| vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::{Band, HEIGHT};
    use crate::refine::obstacle::Obstacle;
    use modiste_core::Vec3;
    use modiste_core::shapes::icosphere;

    #[test]
    fn the_band_goes_to_its_height_and_what_is_near_it_part_of_the_way() {
        let mut sphere = icosphere(4);
        sphere.vertices.iter_mut().for_each(|v| *v *= 0.2);
        let body = Obstacle::single(sphere.topology.clone(), &sphere.vertices);
        let cloth: Vec<Vec3> = sphere.vertices.iter().map(|v| 1.06 * *v).collect();
        let ring: Vec<u32> =
            (0u32..).zip(&cloth).filter(|(_, v)| v.y.abs() < 0.004).map(|(vertex, _)| vertex).collect();
        let mut drawn = cloth.clone();
        Band::new(&sphere.topology, &ring).draw_in(&body, &mut drawn).for_each(drop);
        let off = |v: Vec3| v.length() - 0.2;
        for &vertex in &ring {
            assert!((off(drawn[vertex as usize]) - HEIGHT).abs() < 3e-4, "{}", off(drawn[vertex as usize]));
        }
        let moved: Vec<f64> = cloth.iter().zip(&drawn).map(|(a, b)| a.distance(*b)).collect();
        assert!(moved.iter().all(|&way| way < 0.0095), "nothing goes further than the band");
        assert!(cloth.iter().zip(&moved).all(|(v, &way)| v.y.abs() < 0.08 || way < 1e-12), "far away all stays");
        assert!(moved.iter().filter(|&&way| way > 0.001 && way < 0.008).count() > ring.len(), "a smooth way between");
        let none = Band::new(&sphere.topology, &[]);
        assert!(none.vertices.is_empty());
    }
}
