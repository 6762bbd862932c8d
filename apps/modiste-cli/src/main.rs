//! The `modiste` command: words in, a [`Job`], and its events on the terminal.

mod commands;
mod progress;
mod results;
mod words;

use std::io::Write;
use std::process::ExitCode;

use anyhow::Context;
use clap::Parser;
use modiste::Outcome;

use commands::Arguments;
use progress::Display;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Does the job; tells whether the result is as it should be, which a check may deny.
fn run(arguments: &Arguments) -> anyhow::Result<bool> {
    let job = arguments.job()?;
    let display = Display::new();
    let outcome = modiste::run(&job, &|event| display.show(event))?;
    drop(display);
    let text = if arguments.json() { results::json(&outcome)? } else { results::text(&outcome) };
    let is_good = !matches!(&outcome, Outcome::Checked(checked) if !checked.report.holds);
    match writeln!(std::io::stdout(), "{text}") {
        // A reader such as `head` may have seen enough.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(is_good),
        result => result.map(|()| is_good).context("cannot print the result"),
    }
}
