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
    /// The pattern cannot be used.
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
    /// The garment is inside the body or overstretched in most frames of a motion.
    #[error("only {frames} frames in a row can be learned from, fewer than {wanted}")]
    Unsound {
        /// Length of the longest run.
        frames: usize,
        /// Shortest run that is kept.
        wanted: usize,
    },
    /// A sequence that was simulated elsewhere and cannot be learned from.
    #[error("{name}: {why}")]
    Imported {
        /// The sequence.
        name: String,
        /// What was wanted and found.
        why: String,
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
