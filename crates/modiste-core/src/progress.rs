//! How long work tells what it is doing. Libraries never print.

/// Hears of the progress of long work. Called from any thread.
pub trait Progress: Sync {
    /// A stage of `total` steps begins; 0 if the number is not known.
    fn start(&self, stage: &str, total: usize);
    /// `done` steps of the stage are finished.
    fn advance(&self, stage: &str, done: usize);
    /// Something the user should know, though the work goes on.
    fn warn(&self, message: &str);
    /// The stage has ended.
    fn finish(&self, stage: &str);
}

/// Hears and does nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn start(&self, _stage: &str, _total: usize) {}
    fn advance(&self, _stage: &str, _done: usize) {}
    fn warn(&self, _message: &str) {}
    fn finish(&self, _stage: &str) {}
}
