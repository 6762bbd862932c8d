//! The `modiste` command: words in, a [`Job`], and its events on the terminal.

mod arguments;
mod progress;
mod results;

use std::io::Write;
use std::process::ExitCode;

use anyhow::Context;
use clap::Parser;

use arguments::Arguments;
use progress::Display;

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let job = arguments.job()?;
    let display = Display::new();
    let outcome = modiste::run(&job, &|event| display.show(event))?;
    drop(display);
    let text = if arguments.json() { results::json(&outcome)? } else { results::text(&outcome) };
    match writeln!(std::io::stdout(), "{text}") {
        // A reader such as `head` may have seen enough.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot print the result"),
    }
}
