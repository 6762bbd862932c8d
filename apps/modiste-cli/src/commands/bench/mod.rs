//! `modiste bench`.

pub(crate) mod dress;
pub(crate) mod hair;

use clap::Subcommand;
use modiste::Job;

use dress::BenchDressArguments;
use hair::BenchHairArguments;

/// Measure how long a frame takes on this machine.
#[derive(Debug, Subcommand)]
pub(crate) enum BenchCommand {
    Dress(BenchDressArguments),
    Hair(BenchHairArguments),
}

impl BenchCommand {
    pub(crate) fn job(&self) -> Job {
        match self {
            Self::Dress(arguments) => Job::BenchDress(arguments.job()),
            Self::Hair(arguments) => Job::BenchHair(arguments.job()),
        }
    }

    pub(crate) fn json(&self) -> bool {
        match self {
            Self::Dress(arguments) => arguments.json,
            Self::Hair(arguments) => arguments.json,
        }
    }
}
