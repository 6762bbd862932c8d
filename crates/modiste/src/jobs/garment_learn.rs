//! From a sewing pattern or a sewn mesh to a learned garment in one go.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use modiste_body::ScapeModel;
use modiste_garment::{DrapeModel, TrainOptions, TrainingSet};
use serde::Serialize;

use super::garment_evaluate::{EvaluatedGarment, evaluate};
use super::garment_simulate::{GarmentSimulate, SimulatedGarment};
use super::garment_train::{LICENCE, provenance_command};
use crate::event::Reporter;
use crate::{Assets, JobError};

/// Makes the training set of a garment, learns it, measures it and writes the model with its figures inside. What an
/// interrupted run simulated is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct GarmentLearn {
    /// What it is learned from.
    pub training: GarmentSimulate,
    /// Number of bodies beside the mean one that it is measured on.
    pub trial_bodies: usize,
    /// The model file.
    pub out: PathBuf,
}

/// What learning a garment from its pattern gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LearnedGarment {
    /// The model file.
    pub file: PathBuf,
    /// What was simulated.
    pub simulated: SimulatedGarment,
    /// What the garment is worth.
    pub evaluated: EvaluatedGarment,
}

impl GarmentLearn {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<LearnedGarment, JobError> {
        modiste_io::check_writable(&self.out)?;
        modiste_io::check_writable(self.training.out.join("manifest.json"))?;
        let started = Instant::now();
        let simulated = self.training.run(reporter)?;
        let set = TrainingSet::load(&self.training.out)?;
        let (mut model, _) = DrapeModel::train(&set, &TrainOptions::default(), reporter)?;
        let training_seconds = started.elapsed().as_secs_f64();
        LICENCE.clone_into(&mut model.provenance.licence);
        model.provenance.command = provenance_command(&set);
        let body_model = ScapeModel::load(Assets::find()?.body(self.training.gender))?;
        let shared = Arc::new(model);
        let mut evaluation =
            evaluate(&shared, &body_model, Some(&set), (self.trial_bodies, &self.training.sources), reporter)?;
        evaluation.training_seconds = training_seconds;
        let mut model = Arc::unwrap_or_clone(shared);
        model.evaluation = Some(evaluation.clone());
        model.save(&self.out)?;
        reporter.wrote(&self.out);
        let evaluated = EvaluatedGarment::of(&model, evaluation, modiste_io::file_size(&self.out)?);
        Ok(LearnedGarment { file: self.out.clone(), simulated, evaluated })
    }
}
