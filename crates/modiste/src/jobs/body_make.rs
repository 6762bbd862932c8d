//! Making a body from measurements.

use std::path::PathBuf;
use std::sync::Arc;

use modiste_body::make::{Wish, make_body};
use modiste_body::{Body, Gender, Measurements, Quantity, ScapeModel};
use modiste_core::Progress;
use modiste_io::obj;
use serde::Serialize;

use crate::event::Reporter;
use crate::{Assets, BodyChoice, JobError};

/// Makes the body that comes nearest to some measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMake {
    /// Whose body model.
    pub gender: Gender,
    /// Which body.
    pub body: BodyChoice,
    /// The OBJ file.
    pub out: PathBuf,
}

/// What making a body gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MadeBody {
    /// `female` or `male`.
    pub gender: Gender,
    /// Body shape in standard deviations, β.
    pub shape: Vec<f64>,
    /// Measurements of the body (m, kg).
    pub measurements: Measurements,
    /// The OBJ file.
    pub file: PathBuf,
}

impl BodyMake {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<MadeBody, JobError> {
        self.body.check()?;
        let assets = Assets::find()?;
        let model = ScapeModel::load(assets.body(self.gender))?;
        let body = self.body.make(&model, reporter)?;
        let measurements = body.measurements()?;
        obj::write(&self.out, body.rest_vertices(), model.topology().faces())?;
        reporter.wrote(&self.out);
        Ok(MadeBody { gender: self.gender, shape: body.shape().to_vec(), measurements, file: self.out.clone() })
    }
}

/// Finds the body, and passes on what is unusual about it.
pub(crate) fn solve(
    model: &Arc<ScapeModel>,
    wanted: &[(Quantity, f64)],
    progress: &dyn Progress,
) -> Result<Body, JobError> {
    let wishes: Vec<Wish> = wanted.iter().map(|&(quantity, value)| Wish { quantity, value }).collect();
    let made = make_body(model, &wishes)?;
    made.warnings.iter().for_each(|warning| progress.warn(warning));
    Ok(made.body)
}
