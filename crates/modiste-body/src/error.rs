//! What can go wrong with bodies and motions.

use modiste_core::SolveError;

/// Why a body, a body model or a motion cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum BodyError {
    /// A file cannot be read or written, or does not hold what it should.
    #[error(transparent)]
    Io(#[from] modiste_io::IoError),
    /// A body cannot be measured.
    #[error(transparent)]
    Measure(#[from] crate::MeasureError),
    /// Wished measurements cannot be met.
    #[error("{0}")]
    Wish(String),
    /// A numerical problem has no answer.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A list has the wrong length.
    #[error("{what}: wanted {wanted}, found {found}")]
    Size {
        /// Which list.
        what: &'static str,
        /// How long it must be, in words where it is a range.
        wanted: String,
        /// How long it is.
        found: usize,
    },
    /// A number is not finite or lies outside what the method can work with.
    #[error("{what}: wanted {wanted}, found {found}")]
    Value {
        /// Which number.
        what: String,
        /// The range.
        wanted: String,
        /// The number.
        found: f64,
    },
    /// A motion file names a joint that no known skeleton has.
    #[error("unknown joint `{joint}`: known skeletons are {known}")]
    UnknownJoint {
        /// The joint.
        joint: String,
        /// The names that are known, by family.
        known: String,
    },
    /// A motion file lacks a joint that its skeleton family has.
    #[error("the {family} skeleton needs a joint `{joint}`, which the file lacks")]
    MissingJoint {
        /// The family that most joints belong to.
        family: &'static str,
        /// The joint.
        joint: &'static str,
    },
    /// A body model contradicts itself.
    #[error("unusable body model: {0}")]
    Model(String),
    /// A motion cannot be used.
    #[error("unusable motion: {0}")]
    Motion(String),
}
