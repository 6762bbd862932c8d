//! The one error of this crate.

use modiste_core::{SolveError, TopologyError};
use modiste_io::IoError;

/// Why a garment could not be learned, read or put on.
#[derive(Debug, thiserror::Error)]
pub enum GarmentError {
    /// A file could not be read or written, or a part of it is not what it must be.
    #[error(transparent)]
    Io(#[from] IoError),
    /// The faces of a garment are not a mesh.
    #[error("{garment}: {source}")]
    Topology {
        /// The garment.
        garment: String,
        /// What is wrong with its faces.
        source: TopologyError,
    },
    /// Numbers that must agree do not, or are out of range.
    #[error("{what}: wanted {wanted}, found {found}")]
    Data {
        /// Which datum.
        what: String,
        /// What it must be.
        wanted: String,
        /// What it is.
        found: String,
    },
    /// A numerical problem has no answer.
    #[error("{stage}: {source}")]
    Solve {
        /// What was being computed.
        stage: &'static str,
        /// Why there is no answer.
        source: SolveError,
    },
}

impl GarmentError {
    /// A datum that is not what it must be.
    pub(crate) fn data(what: impl ToString, wanted: impl ToString, found: impl ToString) -> Self {
        Self::Data { what: what.to_string(), wanted: wanted.to_string(), found: found.to_string() }
    }

    /// Names the computation in which a solve failed.
    pub(crate) fn solve(stage: &'static str) -> impl FnOnce(SolveError) -> Self {
        move |source| Self::Solve { stage, source }
    }
}
