//! What could not be done for a garment in a frame: the frames to be wary of.

use serde::{Deserialize, Serialize};

/// Why a garment is flagged in a frame. All zero where it is sound.
///
/// A body that is in itself, arm in trunk or thigh in thigh, leaves cloth between its parts no place outside. Such cloth is led
/// to the rim of the crossing, and what connects it to the rest may pass through skin and layers there.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct GarmentFlags {
    /// Vertices that were caught between parts of the body that are in each other.
    pub caught: usize,
    /// Vertices that are left inside the body or below a garment.
    pub inside: usize,
    /// Triangles that cross the body or a garment below by more than half a millimetre, if that was looked for.
    pub crossing: usize,
    /// Pairs of triangles of the garment that are left deep in each other, if that was looked for.
    pub folded: usize,
}

impl GarmentFlags {
    /// How many numbers there are.
    pub const COUNT: usize = 4;

    /// Whether anything is flagged.
    pub fn is_flagged(&self) -> bool {
        *self != Self::default()
    }

    /// The numbers in order.
    pub fn to_array(self) -> [usize; Self::COUNT] {
        [self.caught, self.inside, self.crossing, self.folded]
    }
}
