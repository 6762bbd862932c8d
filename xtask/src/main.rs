//! Chores of the workspace: `cargo xtask ci | deps | test | report | assets`.
#![expect(clippy::print_stdout, reason = "a program at a terminal")]

mod assets;
mod check;
mod deps;
mod report;
mod shell;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Chores of the Modiste workspace.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(Debug, Subcommand)]
enum Chore {
    /// Everything `test` runs, then the doc tests, the examples and the documentation with warnings as errors.
    Ci,
    /// Check the direction between the crates and the licences of all dependencies.
    Deps,
    /// Format, lints, dependencies and all tests: what the continuous integration runs.
    Test,
    /// Measure what the project claims and write it to `calibration/`.
    Report(report::Arguments),
    /// Make the models in `assets/` again from source.
    Assets(assets::Arguments),
}

fn main() -> ExitCode {
    let result = match Arguments::parse().chore {
        Chore::Ci => check::ci(),
        Chore::Deps => deps::check(),
        Chore::Test => check::test(),
        Chore::Report(arguments) => report::run(&arguments),
        Chore::Assets(arguments) => assets::run(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {}", shell::sentence(&error));
            ExitCode::FAILURE
        }
    }
}
