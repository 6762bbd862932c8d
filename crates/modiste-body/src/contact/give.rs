//! How skin gives way: the vertices that touch sink, and take their surroundings along.

use modiste_core::{Topology, Vec3};

use super::GAP;
use super::find::Touch;

/// Rings of edges around vertices that touch which move along.
const RINGS: usize = 4;

/// How often displacements are smoothed in each step.
const SMOOTHINGS: usize = 1;

/// The most (m) that two skins are parted by in a step: their normals turn on the way.
const MOST_AT_ONCE: f64 = 0.012;

/// The vertices that move, and by how much.
#[derive(Debug, Clone, Default)]
pub(super) struct Giving {
    touches: Vec<Touch>,
    /// Vertices that touch or lie around such, each once.
    active: Vec<u32>,
    is_active: Vec<bool>,
    is_listed: Vec<bool>,
    /// Where everything was before anything gave way (m).
    start: Vec<Vec3>,
    /// How far each vertex has been moved (m), zero but for the active ones, and a smoothed copy of those.
    moved: Vec<Vec3>,
    smooth: Vec<Vec3>,
}

impl Giving {
    /// Forgets what touched in another pose.
    pub(super) fn start(&mut self, x: &[Vec3]) {
        for vertex in self.active.drain(..) {
            self.is_active[vertex as usize] = false;
            self.moved[vertex as usize] = Vec3::ZERO;
        }
        self.touches.clear();
        self.start.clear();
        self.start.extend_from_slice(x);
        self.is_active.resize(x.len(), false);
        self.is_listed.resize(x.len(), false);
        self.moved.resize(x.len(), Vec3::ZERO);
    }

    /// Takes what touches now instead of what touched before.
    pub(super) fn take(&mut self, touches: impl Iterator<Item = Touch>, topology: &Topology, most: &[f64]) {
        self.touches.clear();
        self.touches.extend(touches);
        let mut first = self.active.len();
        for touch in &self.touches {
            if !std::mem::replace(&mut self.is_active[touch.vertex as usize], true) {
                self.active.push(touch.vertex);
            }
        }
        for _ in 0..RINGS {
            for index in std::mem::replace(&mut first, self.active.len())..self.active.len() {
                for &next in topology.neighbours(self.active[index] as usize) {
                    if most[next as usize] > 0.0 && !std::mem::replace(&mut self.is_active[next as usize], true) {
                        self.active.push(next);
                    }
                }
            }
        }
    }

    /// Writes the vertices that touch and those beside them, each once: no others are likely to touch next.
    pub(super) fn beside(&mut self, topology: &Topology, most: &[f64], out: &mut Vec<u32>) {
        out.clear();
        for touch in &self.touches {
            for &vertex in std::iter::once(&touch.vertex).chain(topology.neighbours(touch.vertex as usize)) {
                if most[vertex as usize] > 0.0 && !std::mem::replace(&mut self.is_listed[vertex as usize], true) {
                    out.push(vertex);
                }
            }
        }
        out.iter().for_each(|&vertex| self.is_listed[vertex as usize] = false);
    }

    /// The least room (m) between two skins: negative where one is inside the other, infinite where nothing touches.
    pub(super) fn least_room(&self, x: &[Vec3]) -> f64 {
        self.touches.iter().map(|touch| touch.height(x)).fold(f64::INFINITY, f64::min)
    }

    /// Smooths what has been moved so far, and then moves every vertex that touches by its share of what is missing to the gap;
    /// none further in all than `most` (m) allows.
    pub(super) fn step(&mut self, topology: &Topology, most: &[f64], x: &mut [Vec3]) {
        for _ in 0..SMOOTHINGS {
            let moved = &self.moved;
            let mean = |&vertex: &u32| {
                let around = topology.neighbours(vertex as usize);
                let sum: Vec3 = around.iter().map(|&next| moved[next as usize]).sum();
                0.5 * (moved[vertex as usize] + sum / around.len().max(1) as f64)
            };
            self.smooth.clear();
            self.smooth.extend(self.active.iter().map(mean));
            for (&vertex, &smooth) in self.active.iter().zip(&self.smooth) {
                self.moved[vertex as usize] = smooth;
            }
        }
        for &vertex in &self.active {
            x[vertex as usize] = self.start[vertex as usize] + self.moved[vertex as usize];
        }
        for touch in &self.touches {
            let missing = (GAP - touch.height(x)).clamp(0.0, MOST_AT_ONCE);
            let moved = &mut self.moved[touch.vertex as usize];
            *moved = (*moved - touch.share * missing * touch.normal).clamp_length_max(most[touch.vertex as usize]);
        }
        for touch in &self.touches {
            x[touch.vertex as usize] = self.start[touch.vertex as usize] + self.moved[touch.vertex as usize];
        }
    }
}
