//! `modiste body`.

pub(crate) mod make;
pub(crate) mod measure;
pub(crate) mod population;
pub(crate) mod train;

use anyhow::Result;
use clap::Subcommand;
use modiste::Job;

use make::BodyMakeArguments;
use measure::BodyMeasureArguments;
use population::BodyPopulationArguments;
use train::BodyTrainArguments;

/// Make, measure and learn bodies.
#[derive(Debug, Subcommand)]
pub(crate) enum BodyCommand {
    Make(BodyMakeArguments),
    Measure(BodyMeasureArguments),
    Population(BodyPopulationArguments),
    Train(BodyTrainArguments),
}

impl BodyCommand {
    pub(crate) fn job(&self) -> Result<Job> {
        Ok(match self {
            Self::Make(arguments) => Job::BodyMake(arguments.job()?),
            Self::Measure(arguments) => Job::BodyMeasure(arguments.job()),
            Self::Population(arguments) => Job::BodyPopulation(arguments.job()),
            Self::Train(arguments) => Job::BodyTrain(arguments.job()),
        })
    }

    pub(crate) fn json(&self) -> bool {
        match self {
            Self::Make(arguments) => arguments.json,
            Self::Measure(arguments) => arguments.json,
            Self::Population(arguments) => arguments.json,
            Self::Train(arguments) => arguments.json,
        }
    }
}
