//! Whatever is given to `garment learn` and `garment import` is answered by one sentence that says what was wanted and found.
//! No panic, no wrong silence, nothing half-written.
#![expect(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test, which looks at the disk from outside")]

mod import;
mod meshes;
mod patterns;

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// An odd input: what it is, the words of the command with its files made in a folder of its own, and what the sentence holds.
pub(crate) struct Case {
    name: &'static str,
    make: Box<dyn Fn(&Path) -> Vec<String> + Sync>,
    wanted: &'static str,
}

impl Case {
    pub(crate) fn new(
        name: &'static str,
        wanted: &'static str,
        make: impl Fn(&Path) -> Vec<String> + Sync + 'static,
    ) -> Self {
        Self { name, make: Box::new(make), wanted }
    }

    /// What is wrong with the answer, if anything.
    fn fault(&self) -> Option<String> {
        let folder = tempfile::tempdir().unwrap();
        let words = (self.make)(folder.path());
        let before = files(folder.path());
        let Some((success, text)) = answered(&words, folder.path()) else {
            return Some(format!("{}: no answer within {} s", self.name, LONGEST.as_secs()));
        };
        let errors: Vec<&str> = text.lines().filter(|line| line.starts_with("error: ")).collect();
        let answer = match errors[..] {
            [one] if one.contains(self.wanted) && !success && !text.contains("panicked") => None,
            _ => Some(format!("said {text:?} instead of {:?}", self.wanted)),
        };
        // What was read before the fault stays for the next run.
        let is_new = |path: &PathBuf| !before.contains(path) && !path.starts_with(folder.path().join("training"));
        let left: Vec<PathBuf> = files(folder.path()).into_iter().filter(is_new).collect();
        let left = (!left.is_empty()).then(|| format!("left {left:?}"));
        answer.or(left).map(|fault| format!("{}: {fault}", self.name))
    }
}

/// Longest that an answer may take: it is given before any work.
const LONGEST: Duration = Duration::from_secs(60);

/// Whether the command succeeds, and what it says; none if it works on instead.
fn answered(words: &[String], folder: &Path) -> Option<(bool, String)> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_modiste"));
    let errors = tempfile::NamedTempFile::new().unwrap();
    command.args(words).current_dir(folder).stdout(Stdio::null()).stderr(errors.reopen().unwrap());
    let mut child = command.spawn().expect("the program starts");
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return Some((
                status.success(),
                String::from_utf8_lossy(&std::fs::read(errors.path()).unwrap()).into_owned(),
            ));
        }
        if started.elapsed() > LONGEST {
            child.kill().unwrap();
            child.wait().unwrap();
            return None;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn modiste(words: &[String], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_modiste")).args(words).current_dir(folder).output().expect("the program starts")
}

/// All files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

pub(crate) fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

/// Fewest odd inputs that are tried.
const FEWEST: usize = 50;

#[test]
fn every_odd_input_gets_its_sentence() {
    let cases: Vec<Case> = [patterns::cases(), meshes::cases(), import::cases()].into_iter().flatten().collect();
    assert!(cases.len() >= FEWEST, "{} odd inputs", cases.len());
    let (next, faults) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(2, |cores| cores.get().min(4)) {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    faults.lock().unwrap_or_else(PoisonError::into_inner).extend(case.fault());
                }
            });
        }
    });
    let faults = faults.into_inner().unwrap();
    assert!(faults.is_empty(), "{} of {} odd inputs:\n{}", faults.len(), cases.len(), faults.join("\n"));
}
