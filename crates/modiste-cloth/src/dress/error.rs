//! Why a body could not be dressed.

use crate::ClothError;
use crate::cut::CutError;

/// Why a body could not be dressed; the text is the reason given where a training body is dropped.
#[derive(Debug, thiserror::Error)]
pub enum DressError {
    /// The garment cannot be cut.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// The physics refused or diverged.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// The built-in fabrics do not have the pattern's material.
    #[error("there is no fabric named {0}")]
    Fabric(String),
    /// The seams did not close.
    #[error("a seam was still {:.1} mm open after {frames} frames of sewing", 1e3 * widest)]
    SeamsOpen {
        /// Widest gap (m).
        widest: f64,
        /// Frames spent.
        frames: usize,
    },
    /// Cloth ended inside the body.
    #[error("{count} garment vertices ended inside the body, the deepest {:.1} mm", 1e3 * deepest)]
    Inside {
        /// How many.
        count: usize,
        /// How deep (m).
        deepest: f64,
    },
    /// Part of the garment ended inside out.
    #[error("{:.0}% of the faces of {part} face the body: it is inside out", 1e2 * share)]
    InsideOut {
        /// The part of the garment.
        part: &'static str,
        /// Share of its faces.
        share: f64,
    },
    /// The cloth is stretched beyond what any cloth bears.
    #[error("the garment is stretched by {:.0}% (99th percentile): no size fits", 1e2 * stretch)]
    Stretched {
        /// 99th percentile of the edge stretch.
        stretch: f64,
    },
}
