//! The one error of this crate.

use modiste_body::BodyError;
use modiste_core::SolveError;
use modiste_io::IoError;

/// Why hair could not be made, simulated, learned or animated.
#[derive(Debug, thiserror::Error)]
pub enum HairError {
    /// A file could not be read or written, or a part of it is not what it must be.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A body cannot be posed or a motion not be made.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A numerical problem has no answer.
    #[error("{what}: {source}")]
    Solve {
        /// What was to be found.
        what: &'static str,
        /// Why it cannot be.
        source: SolveError,
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
}

impl HairError {
    /// A datum that is not what it must be.
    pub fn data(what: impl ToString, wanted: impl ToString, found: impl ToString) -> Self {
        Self::Data { what: what.to_string(), wanted: wanted.to_string(), found: found.to_string() }
    }

    /// Says what a solver was asked for.
    pub(crate) fn solving(what: &'static str) -> impl Fn(SolveError) -> Self {
        move |source| Self::Solve { what, source }
    }
}

/// Refuses a number outside `low..=high`, NaN included.
pub(crate) fn check_range(what: &str, value: f64, low: f64, high: f64) -> Result<(), HairError> {
    if (low..=high).contains(&value) { Ok(()) } else { Err(HairError::data(what, format!("{low} to {high}"), value)) }
}
