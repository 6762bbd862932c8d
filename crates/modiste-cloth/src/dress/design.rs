//! What a garment is made from.

use std::sync::Arc;

use super::{Mannequin, ReadyMade, ReadyMadeError};
use crate::pattern::{GradedPattern, PatternError};

/// What a garment is made from: a sewing pattern, or a mesh that somebody sewed already.
#[derive(Debug, Clone)]
pub enum Design {
    /// Flat panels in graded sizes.
    Pattern(Arc<GradedPattern>),
    /// A sewn mesh, made to measure for every body.
    ReadyMade(Arc<ReadyMade>),
}

/// Why a stored design cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum DesignError {
    /// It is no pattern.
    #[error(transparent)]
    Pattern(#[from] PatternError),
    /// It is no ready-made garment.
    #[error(transparent)]
    ReadyMade(#[from] ReadyMadeError),
}

impl From<Arc<GradedPattern>> for Design {
    fn from(pattern: Arc<GradedPattern>) -> Self {
        Self::Pattern(pattern)
    }
}

impl Design {
    /// Reads a stored design; `name` stands for the file in errors, `mean` is the mean body of its gender.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub fn from_json(name: &str, text: &str, mean: &Mannequin) -> Result<Self, DesignError> {
        Ok(if ReadyMade::is_one(text) {
            Self::ReadyMade(Arc::new(ReadyMade::from_json(name, text, mean)?))
        } else {
            Self::Pattern(Arc::new(GradedPattern::from_json(name, text)?))
        })
    }

    /// What is stored of it.
    pub fn to_json(&self) -> String {
        match self {
            Self::Pattern(pattern) => pattern.to_json(),
            Self::ReadyMade(mesh) => mesh.to_json(),
        }
    }

    /// Name of the garment.
    pub fn garment(&self) -> &str {
        match self {
            Self::Pattern(pattern) => &pattern.garment,
            Self::ReadyMade(mesh) => mesh.garment(),
        }
    }

    /// Whose: `female` or `male`.
    pub fn gender(&self) -> &str {
        match self {
            Self::Pattern(pattern) => &pattern.gender,
            Self::ReadyMade(mesh) => mesh.gender(),
        }
    }

    /// Name of its fabric.
    pub fn material(&self) -> &str {
        match self {
            Self::Pattern(pattern) => &pattern.material,
            Self::ReadyMade(mesh) => mesh.material(),
        }
    }

    /// Whether the cloth is kept from passing through itself. Nothing is known of a mesh, so it is.
    pub fn self_contact(&self) -> bool {
        match self {
            Self::Pattern(pattern) => pattern.self_contact,
            Self::ReadyMade(_) => true,
        }
    }
}
