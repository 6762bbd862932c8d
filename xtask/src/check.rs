//! The checks: what a change must pass.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};

use crate::deps;
use crate::shell::{cargo, run, sentence, succeeds};

/// A check with the name shown in the summary.
struct Check {
    name: &'static str,
    run: fn() -> Result<()>,
}

const QUICK: [Check; 4] = [
    Check { name: "format", run: format },
    Check { name: "lints", run: lints },
    Check { name: "dependencies", run: deps::check },
    Check { name: "tests", run: tests },
];

const THOROUGH: [Check; 3] = [
    Check { name: "doc tests", run: doc_tests },
    Check { name: "examples", run: examples },
    Check { name: "documentation", run: documentation },
];

/// What the continuous integration runs.
pub(crate) fn test() -> Result<()> {
    run_all(&QUICK)
}

/// Everything.
pub(crate) fn ci() -> Result<()> {
    run_all(&QUICK).and(run_all(&THOROUGH))
}

/// Runs every check, even after a failure, and sums up.
fn run_all(checks: &[Check]) -> Result<()> {
    let results: Vec<(&str, Duration, Result<()>)> = checks
        .iter()
        .map(|check| {
            let start = Instant::now();
            let result = (check.run)();
            (check.name, start.elapsed(), result)
        })
        .collect();
    println!("\nWhat ran:");
    for (name, time, result) in &results {
        let outcome = if result.is_ok() { "passed" } else { "FAILED" };
        println!("  {outcome}  {name:<14} {:7.1} s", time.as_secs_f64());
    }
    let failures: Vec<String> = results
        .into_iter()
        .filter_map(|(name, _, result)| result.err().map(|error| format!("{name}: {}", sentence(&error))))
        .collect();
    if failures.is_empty() {
        return Ok(());
    }
    bail!("{}", failures.join("; "))
}

fn format() -> Result<()> {
    run(&mut cargo(&["fmt", "--all", "--check"]))
}

fn lints() -> Result<()> {
    run(&mut cargo(&["clippy", "--release", "--locked", "--workspace", "--all-targets", "--", "-D", "warnings"]))
}

/// All tests; by nextest where it is installed, which shows slow tests and kills stuck ones.
fn tests() -> Result<()> {
    if succeeds(&mut cargo(&["nextest", "--version"])) {
        run(&mut cargo(&["nextest", "run", "--release", "--locked", "--workspace"]))
    } else {
        println!("\ncargo-nextest is not installed: tests run by `cargo test`");
        run(&mut cargo(&[
            "test",
            "--release",
            "--locked",
            "--workspace",
            "--lib",
            "--bins",
            "--tests",
            "--no-fail-fast",
        ]))
    }
}

fn doc_tests() -> Result<()> {
    run(&mut cargo(&["test", "--release", "--locked", "--workspace", "--doc"]))
}

/// Builds all examples and runs those of the facade, which assert what they show.
fn examples() -> Result<()> {
    run(&mut cargo(&["build", "--release", "--locked", "--workspace", "--examples"]))?;
    let folder = crate::shell::workspace_root().join("crates/modiste/examples");
    for path in modiste_io::list_folder(&folder)? {
        if path.extension().is_some_and(|extension| extension == "rs")
            && let Some(name) = path.file_stem().and_then(|stem| stem.to_str())
        {
            run(&mut cargo(&["run", "--release", "--locked", "--package", "modiste", "--example", name]))?;
        }
    }
    Ok(())
}

fn documentation() -> Result<()> {
    let mut command = cargo(&["doc", "--release", "--locked", "--workspace", "--no-deps", "--document-private-items"]);
    run(command.env("RUSTDOCFLAGS", "-D warnings"))
}
