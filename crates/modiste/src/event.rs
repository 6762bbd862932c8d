//! What a job tells while it works.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use modiste_core::Progress;
use serde::Serialize;

/// Something a job has to say.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "event")]
pub enum Event {
    /// A stage of `total` steps begins; 0 if the number is not known.
    Started {
        /// Name of the stage.
        stage: String,
        /// Number of steps.
        total: usize,
    },
    /// `done` steps of a stage are finished.
    Advanced {
        /// Name of the stage.
        stage: String,
        /// Number of finished steps.
        done: usize,
    },
    /// A stage has ended.
    Finished {
        /// Name of the stage.
        stage: String,
    },
    /// Something the user should know, though the work goes on.
    Warning {
        /// One sentence.
        message: String,
    },
    /// A file is complete.
    Wrote {
        /// Where it is.
        path: PathBuf,
    },
}

/// Hears the events of a job; called from any thread.
pub type Listener<'a> = dyn Fn(Event) + Sync + 'a;

/// Turns the progress of the libraries into events, and keeps the warnings for the report.
pub(crate) struct Reporter<'a> {
    listener: &'a Listener<'a>,
    warnings: Mutex<Vec<String>>,
}

impl<'a> Reporter<'a> {
    pub(crate) fn new(listener: &'a Listener<'a>) -> Self {
        Self { listener, warnings: Mutex::default() }
    }

    pub(crate) fn wrote(&self, path: impl Into<PathBuf>) {
        (self.listener)(Event::Wrote { path: path.into() });
    }

    /// The warnings so far, in order.
    pub(crate) fn warnings(&self) -> Vec<String> {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Progress for Reporter<'_> {
    fn start(&self, stage: &str, total: usize) {
        (self.listener)(Event::Started { stage: stage.to_owned(), total });
    }

    fn advance(&self, stage: &str, done: usize) {
        (self.listener)(Event::Advanced { stage: stage.to_owned(), done });
    }

    fn warn(&self, message: &str) {
        self.warnings.lock().unwrap_or_else(PoisonError::into_inner).push(message.to_owned());
        (self.listener)(Event::Warning { message: message.to_owned() });
    }

    fn finish(&self, stage: &str) {
        (self.listener)(Event::Finished { stage: stage.to_owned() });
    }
}
