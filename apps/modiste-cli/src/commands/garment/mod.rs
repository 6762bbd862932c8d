//! `modiste garment`.

mod design;
pub(crate) mod evaluate;
pub(crate) mod import;
pub(crate) mod learn;
pub(crate) mod simulate;
pub(crate) mod train;
mod training_set;

use clap::Subcommand;
use modiste::Job;

use evaluate::GarmentEvaluateArguments;
use import::GarmentImportArguments;
use learn::GarmentLearnArguments;
use simulate::GarmentSimulateArguments;
use train::GarmentTrainArguments;

/// Simulate and learn garments.
#[derive(Debug, Subcommand)]
pub(crate) enum GarmentCommand {
    Simulate(GarmentSimulateArguments),
    Learn(GarmentLearnArguments),
    Evaluate(GarmentEvaluateArguments),
    Import(GarmentImportArguments),
    Train(GarmentTrainArguments),
}

impl GarmentCommand {
    pub(crate) fn job(&self) -> Job {
        match self {
            Self::Simulate(arguments) => Job::GarmentSimulate(arguments.job()),
            Self::Learn(arguments) => Job::GarmentLearn(arguments.job()),
            Self::Evaluate(arguments) => Job::GarmentEvaluate(arguments.job()),
            Self::Import(arguments) => Job::GarmentImport(arguments.job()),
            Self::Train(arguments) => Job::GarmentTrain(arguments.job()),
        }
    }

    pub(crate) fn json(&self) -> bool {
        match self {
            Self::Simulate(arguments) => arguments.json,
            Self::Learn(arguments) => arguments.json,
            Self::Evaluate(arguments) => arguments.json,
            Self::Import(arguments) => arguments.json,
            Self::Train(arguments) => arguments.json,
        }
    }
}
