//! Chores of the workspace: `cargo xtask ci | deps | test`.
#![expect(clippy::print_stdout, reason = "a program at a terminal")]

mod check;
mod deps;
mod shell;

use anyhow::Result;
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
}

fn main() -> Result<()> {
    match Arguments::parse().chore {
        Chore::Ci => check::ci(),
        Chore::Deps => deps::check(),
        Chore::Test => check::test(),
    }
}
