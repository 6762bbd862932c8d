//! The commands: for each its words, the job that they ask for, and its result in words.

pub(crate) mod bench;
pub(crate) mod body;
pub(crate) mod check;
pub(crate) mod crowd;
pub(crate) mod dress;
pub(crate) mod garment;
pub(crate) mod hair;
#[cfg(test)]
mod tests;

use anyhow::Result;
use clap::{Parser, Subcommand};
use modiste::Job;

use bench::BenchCommand;
use body::BodyCommand;
use check::CheckArguments;
use crowd::CrowdArguments;
use dress::DressArguments;
use garment::GarmentCommand;
use hair::HairCommand;

/// Dressed virtual people, learned from data.
#[derive(Debug, Parser)]
#[command(name = "modiste", version, arg_required_else_help = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Dress(DressArguments),
    Check(CheckArguments),
    Crowd(CrowdArguments),
    #[command(subcommand)]
    Body(BodyCommand),
    #[command(subcommand)]
    Garment(GarmentCommand),
    #[command(subcommand)]
    Hair(HairCommand),
    #[command(subcommand)]
    Bench(BenchCommand),
}

impl Arguments {
    /// The job that is asked for.
    pub(crate) fn job(&self) -> Result<Job> {
        Ok(match &self.command {
            Command::Dress(arguments) => Job::Dress(arguments.job()),
            Command::Check(arguments) => Job::Check(arguments.job()),
            Command::Crowd(arguments) => Job::Crowd(arguments.job()),
            Command::Body(command) => command.job()?,
            Command::Garment(command) => command.job(),
            Command::Hair(command) => command.job(),
            Command::Bench(command) => command.job(),
        })
    }

    /// Whether the result is wanted as JSON.
    pub(crate) fn json(&self) -> bool {
        match &self.command {
            Command::Dress(arguments) => arguments.json,
            Command::Check(arguments) => arguments.json,
            Command::Crowd(arguments) => arguments.json,
            Command::Body(command) => command.json(),
            Command::Garment(command) => command.json(),
            Command::Hair(command) => command.json(),
            Command::Bench(command) => command.json(),
        }
    }
}
