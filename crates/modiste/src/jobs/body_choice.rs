//! Which body is wanted.

use std::sync::Arc;

use modiste_body::{Body, Quantity, ScapeModel};
use modiste_core::Progress;

use crate::JobError;
use crate::limits::{check_measurements, check_range};

/// Furthest shape coefficient (standard deviations) that is accepted without doubt that it was meant.
const FURTHEST_COEFFICIENT: f64 = 6.0;

/// Which body is wanted.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum BodyChoice {
    /// The mean of all bodies.
    #[default]
    Average,
    /// Shape coefficients in standard deviations, β; missing ones are 0.
    Shape(Vec<f64>),
    /// The body that comes nearest to these measurements (m, kg).
    Measurements(Vec<(Quantity, f64)>),
}

impl BodyChoice {
    /// Refuses what no adult body has, before any work.
    pub(crate) fn check(&self) -> Result<(), JobError> {
        match self {
            Self::Average => Ok(()),
            Self::Shape(shape) => shape.iter().enumerate().try_for_each(|(index, &coefficient)| {
                let what = format!("shape coefficient {}", index + 1);
                let range = (-FURTHEST_COEFFICIENT, FURTHEST_COEFFICIENT);
                check_range(&what, coefficient, range, "standard deviations")
            }),
            Self::Measurements(measurements) => check_measurements(measurements),
        }
    }

    /// The body of a model.
    pub(crate) fn make(&self, model: &Arc<ScapeModel>, progress: &dyn Progress) -> Result<Body, JobError> {
        Ok(match self {
            Self::Average => model.body(&[])?,
            Self::Shape(shape) => model.body(shape)?,
            Self::Measurements(measurements) => super::body_make::solve(model, measurements, progress)?,
        })
    }
}
