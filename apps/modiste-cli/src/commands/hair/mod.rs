//! `modiste hair`.

pub(crate) mod animate;
pub(crate) mod learn;

use clap::Subcommand;
use modiste::Job;

use animate::HairAnimateArguments;
use learn::HairLearnArguments;

/// Learn hair, and let it follow a motion.
#[derive(Debug, Subcommand)]
pub(crate) enum HairCommand {
    Learn(HairLearnArguments),
    Animate(HairAnimateArguments),
}

impl HairCommand {
    pub(crate) fn job(&self) -> Job {
        match self {
            Self::Learn(arguments) => Job::HairLearn(arguments.job()),
            Self::Animate(arguments) => Job::Dress(arguments.job()),
        }
    }

    pub(crate) fn json(&self) -> bool {
        match self {
            Self::Learn(arguments) => arguments.json,
            Self::Animate(arguments) => arguments.json,
        }
    }
}
