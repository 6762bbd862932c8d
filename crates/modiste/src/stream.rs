//! Jobs in the background.

use std::sync::mpsc;
use std::thread;

use crate::{Event, Job, JobError, Outcome, run};

/// What comes from a job that runs in the background.
#[derive(Debug)]
pub enum Update {
    /// The job goes on.
    Event(Event),
    /// The job has ended; nothing follows.
    Ended(Box<Result<Outcome, JobError>>),
}

/// The updates of a job, as they come; dropping it lets the job run on unheard.
#[derive(Debug)]
pub struct Events {
    receiver: mpsc::Receiver<Update>,
}

impl Iterator for Events {
    type Item = Update;

    fn next(&mut self) -> Option<Update> {
        self.receiver.recv().ok()
    }
}

/// Starts a job on a thread of its own.
pub fn start(job: Job) -> Events {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let result = run(&job, &|event| {
            // Nobody listens any more: the job is finished all the same, because its files are wanted.
            let _unheard = sender.send(Update::Event(event));
        });
        let _unheard = sender.send(Update::Ended(Box::new(result)));
    });
    Events { receiver }
}
