//! What can be asked for.

mod bench_dress;
mod bench_hair;
mod body_choice;
mod body_make;
mod body_measure;
mod body_population;
mod body_train;
mod check;
mod crowd;
mod design_choice;
mod dress;
mod garment_evaluate;
mod garment_import;
mod garment_learn;
mod garment_simulate;
mod garment_train;
mod hair_choice;
mod hair_learn;
mod motion_choice;

use serde::Serialize;

pub use bench_dress::{BenchDress, BenchRow, BenchedDress, Resolution};
pub use bench_hair::{BenchHair, BenchHairRow, BenchedHair};
pub use body_choice::BodyChoice;
pub use body_make::{BodyMake, MadeBody};
pub use body_measure::{BodyMeasure, MeasuredBody};
pub use body_population::{BodyPopulation, MadePopulation};
pub use body_train::{BodyTrain, TrainedBody};
pub use check::{Check, Checked};
pub use crowd::{Character, Crowd, CrowdReport, MadeCrowd};
pub use design_choice::DesignChoice;
pub use dress::{Dress, Dressed};
pub use garment_evaluate::{EvaluatedGarment, GarmentEvaluate};
pub use garment_import::{GarmentImport, UpAxis};
pub use garment_learn::{GarmentLearn, LearnedGarment};
pub use garment_simulate::{GarmentSimulate, SimulatedGarment};
pub use garment_train::{GarmentTrain, TrainedGarment};
pub use hair_choice::HairChoice;
pub use hair_learn::{HairLearn, LearnedHair};
pub use motion_choice::{Action, Length, MotionChoice};

use crate::event::Reporter;
use crate::{JobError, Listener};

/// A request.
#[derive(Debug, Clone, PartialEq)]
pub enum Job {
    /// Dresses a moving body.
    Dress(Dress),
    /// Times characters.
    BenchDress(BenchDress),
    /// Checks a dressed result.
    Check(Check),
    /// Makes many people.
    Crowd(Crowd),
    /// Simulates and learns hair.
    HairLearn(HairLearn),
    /// Times learned hair.
    BenchHair(BenchHair),
    /// Makes a body from measurements.
    BodyMake(BodyMake),
    /// Measures a body.
    BodyMeasure(BodyMeasure),
    /// Makes a population of bodies.
    BodyPopulation(BodyPopulation),
    /// Learns a body model from a population.
    BodyTrain(BodyTrain),
    /// Simulates what a garment is learned from.
    GarmentSimulate(GarmentSimulate),
    /// Learns a garment.
    GarmentTrain(GarmentTrain),
    /// Simulates, learns and measures a garment.
    GarmentLearn(GarmentLearn),
    /// Measures a learned garment.
    GarmentEvaluate(GarmentEvaluate),
    /// Learns a garment from what another program simulated.
    GarmentImport(GarmentImport),
}

/// What a job gives back, beside its files.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Of [`Job::Dress`].
    Dressed(Dressed),
    /// Of [`Job::BenchDress`].
    BenchedDress(BenchedDress),
    /// Of [`Job::Check`].
    Checked(Checked),
    /// Of [`Job::Crowd`].
    MadeCrowd(MadeCrowd),
    /// Of [`Job::HairLearn`].
    LearnedHair(LearnedHair),
    /// Of [`Job::BenchHair`].
    BenchedHair(BenchedHair),
    /// Of [`Job::BodyMake`].
    MadeBody(MadeBody),
    /// Of [`Job::BodyMeasure`].
    MeasuredBody(MeasuredBody),
    /// Of [`Job::BodyPopulation`].
    MadePopulation(MadePopulation),
    /// Of [`Job::BodyTrain`].
    TrainedBody(TrainedBody),
    /// Of [`Job::GarmentSimulate`].
    SimulatedGarment(SimulatedGarment),
    /// Of [`Job::GarmentTrain`].
    TrainedGarment(TrainedGarment),
    /// Of [`Job::GarmentLearn`].
    LearnedGarment(LearnedGarment),
    /// Of [`Job::GarmentEvaluate`].
    EvaluatedGarment(EvaluatedGarment),
    /// Of [`Job::GarmentImport`].
    ImportedGarment(LearnedGarment),
}

/// Does a job on this thread; `listener` hears of its progress.
///
/// # Errors
/// [`JobError`], one sentence; nothing half-written is left.
pub fn run(job: &Job, listener: &Listener<'_>) -> Result<Outcome, JobError> {
    let reporter = Reporter::new(listener);
    match job {
        Job::Dress(job) => job.run(&reporter).map(Outcome::Dressed),
        Job::HairLearn(job) => job.run(&reporter).map(Outcome::LearnedHair),
        Job::BenchHair(job) => job.run(&reporter).map(Outcome::BenchedHair),
        Job::BenchDress(job) => job.run(&reporter).map(Outcome::BenchedDress),
        Job::Check(job) => job.run(&reporter).map(Outcome::Checked),
        Job::Crowd(job) => job.run(&reporter).map(Outcome::MadeCrowd),
        Job::BodyMake(job) => job.run(&reporter).map(Outcome::MadeBody),
        Job::BodyMeasure(job) => job.run().map(Outcome::MeasuredBody),
        Job::BodyPopulation(job) => job.run(&reporter).map(Outcome::MadePopulation),
        Job::BodyTrain(job) => job.run(&reporter).map(Outcome::TrainedBody),
        Job::GarmentSimulate(job) => job.run(&reporter).map(Outcome::SimulatedGarment),
        Job::GarmentTrain(job) => job.run(&reporter).map(Outcome::TrainedGarment),
        Job::GarmentLearn(job) => job.run(&reporter).map(Outcome::LearnedGarment),
        Job::GarmentEvaluate(job) => job.run(&reporter).map(Outcome::EvaluatedGarment),
        Job::GarmentImport(job) => job.run(&reporter).map(Outcome::ImportedGarment),
    }
}
