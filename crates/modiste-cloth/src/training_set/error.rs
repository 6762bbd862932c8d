//! Why a training set could not be made.

use std::path::PathBuf;

use modiste_body::BodyError;
use modiste_io::IoError;

use crate::ClothError;
use crate::dress::DressError;
use crate::pattern::PatternError;

/// Why a training set could not be made.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// There is no pattern of that name.
    #[error("there is no garment named {name}; there are {known}")]
    Garment {
        /// The name asked for.
        name: String,
        /// The names that there are.
        known: String,
    },
    /// The pattern in the program is damaged.
    #[error(transparent)]
    Pattern(#[from] PatternError),
    /// The body cannot be made or moved.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The mean body cannot be dressed.
    #[error(transparent)]
    Dress(#[from] DressError),
    /// The physics refused.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// A file could not be read or written.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A motion without frames.
    #[error("motion {0} has no frames")]
    NoFrames(String),
    /// The cloth was torn off or stretched beyond use in a motion.
    #[error("in frame {frame} the garment is stretched by {:.0}% (99th percentile)", 1e2 * stretch)]
    Torn {
        /// The frame.
        frame: usize,
        /// 99th percentile of the edge stretch.
        stretch: f64,
    },
    /// Every body was dropped.
    #[error("no body could be dressed; the last reason was: {0}")]
    NoBodies(String),
    /// A folder that holds another set.
    #[error("{} holds a training set of {found}, not of {wanted}; choose another folder", folder.display())]
    OtherSet {
        /// The folder.
        folder: PathBuf,
        /// The garment asked for.
        wanted: String,
        /// The garment found.
        found: String,
    },
}
