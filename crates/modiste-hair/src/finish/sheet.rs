//! Cloth that hair may not go behind, remembered from frame to frame.

use modiste_core::Vec3;

use super::{DOUBT, GAP};
use crate::surface::{CLOTH_DEPTH, Surface};

/// Edge of a cell (m).
const EDGE: f64 = 0.025;
/// Most cells along an axis.
const MOST: usize = 80;
/// Space further than this from cloth (m) is not looked at: behind it, a point is on the cloth's other side.
const REACH: f64 = CLOTH_DEPTH;

/// Cloth with the space about it in cells, each of which knows how far the cloth near it has moved since the frame before.
///
/// Distance to the cloth changes by no more than a point and the cloth near it move. So a point that was 2 cm before it, and
/// moved by less together with it, is still before it, without a look at any triangle.
#[derive(Debug, Clone, Default)]
pub(super) struct Sheet {
    before: Vec<Vec3>,
    low: Vec3,
    counts: [usize; 3],
    /// Furthest motion (m) of cloth within reach of each cell; negative where there is none.
    motion: Vec<f32>,
}

impl Sheet {
    /// Gets ready for a frame with points in the box from `low` to `high`.
    pub(super) fn prepare(&mut self, surface: &Surface, (low, high): (Vec3, Vec3)) {
        let x = surface.vertices();
        if self.before.len() != x.len() {
            self.before = x.to_vec();
        }
        self.low = low;
        self.counts = ((high - low) / EDGE).ceil().to_array().map(|n| if n > 0.0 { (n as usize).min(MOST) } else { 0 });
        self.motion.clear();
        self.motion.resize(self.counts.iter().product(), -1.0);
        for face in surface.topology().faces() {
            let corners = face.map(|vertex| x[vertex as usize]);
            let moved =
                face.iter().map(|&v| x[v as usize].distance_squared(self.before[v as usize])).fold(0.0, f64::max);
            let moved = (moved.sqrt() as f32).next_up();
            let least = corners[0].min(corners[1]).min(corners[2]) - REACH;
            let most = corners[0].max(corners[1]).max(corners[2]) + REACH;
            let range = |axis: usize| {
                let place = |x: f64| ((x - self.low[axis]) / EDGE).floor();
                let count = self.counts[axis] as f64;
                place(least[axis]).clamp(0.0, count) as usize..(place(most[axis]) + 1.0).clamp(0.0, count) as usize
            };
            for i in range(0) {
                for j in range(1) {
                    let row = (i * self.counts[1] + j) * self.counts[2];
                    for cell in &mut self.motion[row..][range(2)] {
                        *cell = cell.max(moved);
                    }
                }
            }
        }
        self.before.copy_from_slice(x);
    }

    /// Motion of the cloth within reach of a point (m), if there is any.
    fn motion_near(&self, p: Vec3) -> Option<f64> {
        let cell = ((p - self.low) / EDGE).to_array().map(|n| if n >= 0.0 { n as usize } else { usize::MAX });
        if (0..3).any(|axis| cell[axis] >= self.counts[axis]) {
            return None;
        }
        let moved = self.motion[(cell[0] * self.counts[1] + cell[1]) * self.counts[2] + cell[2]];
        (moved >= 0.0).then(|| f64::from(moved))
    }
}

/// What is remembered of a point and a sheet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Memory {
    /// The cloth is at least so far before the point (m); negative infinity where nothing is known.
    pub(super) away: f32,
    /// The face that was nearest.
    likely: u32,
}

impl Default for Memory {
    fn default() -> Self {
        Self { away: f32::NEG_INFINITY, likely: 0 }
    }
}

impl Sheet {
    /// The way out for a point that was at `before` in the last frame, if it is behind the cloth or nearer than the gap, and
    /// whether triangles were looked at.
    pub(super) fn way_out(
        &self,
        surface: &Surface,
        (p, before): (Vec3, Vec3),
        memory: &mut Memory,
    ) -> (Option<Vec3>, bool) {
        let away = std::mem::replace(&mut memory.away, f32::NEG_INFINITY);
        let Some(moved) = self.motion_near(p) else { return (None, false) };
        let bound = f64::from(away).min(REACH) - p.distance(before) - moved;
        if bound > GAP + DOUBT {
            memory.away = (bound as f32).next_down();
            return (None, false);
        }
        let Some(contact) = surface.contact(p, REACH, Some(memory.likely)) else { return (None, true) };
        memory.likely = contact.at.face;
        if contact.distance < GAP {
            return (Some(contact.at.point + (GAP + DOUBT) * contact.outwards), true);
        }
        // Past a rim, a point may come behind the cloth without passing it: nothing is remembered there.
        if !contact.past {
            memory.away = (contact.distance as f32).next_down();
        }
        (None, true)
    }
}
