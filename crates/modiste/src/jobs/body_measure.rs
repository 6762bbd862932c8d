//! Measuring a body.

use std::path::PathBuf;

use modiste_body::{Gender, Measurements, ScapeModel};
use modiste_io::obj;
use serde::Serialize;

use crate::{Assets, JobError};

/// Measures a body in the template pose, such as [`crate::BodyMake`] writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BodyMeasure {
    /// The OBJ file.
    pub file: PathBuf,
}

/// What measuring gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasuredBody {
    /// The OBJ file.
    pub file: PathBuf,
    /// Measurements (m, kg).
    pub measurements: Measurements,
}

impl BodyMeasure {
    pub(crate) fn run(&self) -> Result<MeasuredBody, JobError> {
        let (vertices, faces) = obj::read(&self.file)?;
        let assets = Assets::find()?;
        // Both models have the same topology, and one is enough.
        let gender = Gender::ALL.into_iter().find(|&gender| modiste_io::exists(assets.body(gender)));
        let model = ScapeModel::load(assets.body(gender.unwrap_or(Gender::Female)))?;
        let name = self.file.display().to_string();
        if faces != model.topology().faces() {
            let wanted = model.topology().face_count();
            return Err(JobError::Request(format!(
                "{name}: wanted the {wanted} triangles of this project's bodies, found {} others; `modiste body make` \
                 writes such a file",
                faces.len()
            )));
        }
        let measurements = model.measure_template()?.measure(&vertices).map_err(JobError::measure(&name))?;
        Ok(MeasuredBody { file: self.file.clone(), measurements })
    }
}
