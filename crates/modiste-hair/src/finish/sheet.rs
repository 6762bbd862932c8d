//! Cloth that hair may not go behind.

use modiste_core::Vec3;

use super::{DOUBT, GAP};
use crate::surface::{CLOTH_DEPTH, Surface};

/// Edge of a cell (m).
const EDGE: f64 = 0.025;
/// Most cells along an axis.
const MOST: usize = 80;

/// Which cells of space have a piece of cloth within reach: behind it no further than hair can be, or close before it.
///
/// Elsewhere no point need ask. That a point was well before the cloth a frame ago says nothing: cloth is open and lies in
/// folds, so the nearest face may be another one, which the point is behind.
#[derive(Debug, Clone, Default)]
pub(super) struct Sheet {
    low: Vec3,
    counts: [usize; 3],
    near: Vec<bool>,
}

impl Sheet {
    /// Gets ready for a frame with points in the box from `low` to `high`.
    pub(super) fn prepare(&mut self, surface: &Surface, (low, high): (Vec3, Vec3)) {
        let x = surface.vertices();
        self.low = low;
        self.counts = ((high - low) / EDGE).ceil().to_array().map(|n| if n > 0.0 { (n as usize).min(MOST) } else { 0 });
        self.near.clear();
        self.near.resize(self.counts.iter().product(), false);
        for face in surface.topology().faces() {
            let [a, b, c] = face.map(|vertex| x[vertex as usize]);
            let least = ((a.min(b).min(c) - CLOTH_DEPTH - low) / EDGE).floor();
            let most = ((a.max(b).max(c) + CLOTH_DEPTH - low) / EDGE).floor() + 1.0;
            let range = |axis: usize| {
                let count = self.counts[axis] as f64;
                least[axis].clamp(0.0, count) as usize..most[axis].clamp(0.0, count) as usize
            };
            for i in range(0) {
                for j in range(1) {
                    let row = (i * self.counts[1] + j) * self.counts[2];
                    self.near[row..][range(2)].fill(true);
                }
            }
        }
    }

    fn is_near(&self, p: Vec3) -> bool {
        let place = (p - self.low) / EDGE;
        // Beyond the cells nothing is known.
        if !(0..3).all(|axis| place[axis] >= 0.0 && place[axis] < self.counts[axis] as f64) {
            return true;
        }
        let [i, j, k] = place.to_array().map(|n| n as usize);
        self.near[(i * self.counts[1] + j) * self.counts[2] + k]
    }

    /// The way out for a point, if it is behind the cloth or nearer than the gap, and whether triangles were looked at;
    /// `likely` is the face that was nearest in the last frame.
    pub(super) fn way_out(&self, surface: &Surface, p: Vec3, likely: &mut u32) -> (Option<Vec3>, bool) {
        if !self.is_near(p) {
            return (None, false);
        }
        let Some(contact) = surface.contact(p, CLOTH_DEPTH, Some(*likely)) else { return (None, true) };
        *likely = contact.at.face;
        let free = contact.at.point + (GAP + DOUBT) * contact.outwards;
        ((contact.distance < GAP).then_some(free), true)
    }
}
