//! Learning a garment from its training set.

use std::path::PathBuf;

use modiste_garment::{DrapeModel, TrainOptions, TrainingSet};
use serde::Serialize;

use crate::JobError;
use crate::event::Reporter;

/// Licence of garment models: patterns and simulation are our own, the bodies below are CC0 and Apache-2.0.
pub(super) const LICENCE: &str = "Apache-2.0 OR MIT";

/// Learns a garment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GarmentTrain {
    /// The training set, as [`crate::GarmentSimulate`] makes it.
    pub training: PathBuf,
    /// The model file.
    pub out: PathBuf,
}

/// What learning a garment gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrainedGarment {
    /// The model file.
    pub file: PathBuf,
    /// Bodies that the garment was draped over.
    pub shapes: usize,
    /// Frames of simulated motion.
    pub frames: usize,
    /// Largest magnitude of an eigenvalue of the wrinkle dynamics; below 1 they die out.
    pub spectral_radius: f64,
    /// Size of the file (bytes).
    pub bytes: u64,
}

/// The command that learns this garment again.
pub(super) fn provenance_command(set: &TrainingSet) -> String {
    format!("modiste garment train training/garments/{}-{}", set.garment.gender.name(), set.garment.name)
}

impl GarmentTrain {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<TrainedGarment, JobError> {
        let set = TrainingSet::load(&self.training)?;
        let (mut model, training) = DrapeModel::train(&set, &TrainOptions::default(), reporter)?;
        LICENCE.clone_into(&mut model.provenance.licence);
        model.provenance.command = provenance_command(&set);
        model.save(&self.out)?;
        reporter.wrote(&self.out);
        Ok(TrainedGarment {
            file: self.out.clone(),
            shapes: set.shapes.len(),
            frames: set.frame_count(),
            spectral_radius: training.spectral_radius,
            bytes: modiste_io::file_size(&self.out)?,
        })
    }
}
