//! Progress on the error stream: bars with an estimate on a terminal, plain lines elsewhere.

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use modiste::Event;

/// Longest silence between two plain lines of one stage while it goes on.
const PLAIN_INTERVAL: Duration = Duration::from_secs(5);

/// Shows events as they come.
pub(crate) struct Display {
    bars: Option<MultiProgress>,
    stages: Mutex<BTreeMap<String, Stage>>,
}

struct Stage {
    total: usize,
    started: Instant,
    last_line: Instant,
    bar: Option<ProgressBar>,
}

impl Display {
    /// A display that fits the error stream.
    pub(crate) fn new() -> Self {
        let bars = std::io::stderr().is_terminal().then(MultiProgress::new);
        Self { bars, stages: Mutex::default() }
    }

    /// Shows an event.
    pub(crate) fn show(&self, event: Event) {
        match event {
            Event::Started { stage, total } => self.start(stage, total),
            Event::Advanced { stage, done } => self.advance(&stage, done),
            Event::Finished { stage } => self.finish(&stage),
            Event::Warning { message } => self.line(&format!("warning: {message}")),
            Event::Wrote { .. } => {}
        }
    }

    fn start(&self, name: String, total: usize) {
        let now = Instant::now();
        let bar = self.bars.as_ref().map(|bars| bars.add(new_bar(&name, total)));
        if bar.is_none() {
            self.line(&name);
        }
        self.stages().insert(name, Stage { total, started: now, last_line: now, bar });
    }

    fn advance(&self, name: &str, done: usize) {
        let mut stages = self.stages();
        let Some(stage) = stages.get_mut(name) else { return };
        match &stage.bar {
            Some(bar) => bar.set_position(done as u64),
            None if stage.last_line.elapsed() >= PLAIN_INTERVAL => {
                stage.last_line = Instant::now();
                eprintln!("{name}: {}", plain(done, stage.total, stage.started.elapsed()));
            }
            None => {}
        }
    }

    fn finish(&self, name: &str) {
        let Some(stage) = self.stages().remove(name) else { return };
        match stage.bar {
            Some(bar) => bar.finish_and_clear(),
            None => eprintln!("{name}: done in {:.1} s", stage.started.elapsed().as_secs_f64()),
        }
    }

    fn line(&self, text: &str) {
        match &self.bars {
            Some(bars) => bars.suspend(|| eprintln!("{text}")),
            None => eprintln!("{text}"),
        }
    }

    fn stages(&self) -> MutexGuard<'_, BTreeMap<String, Stage>> {
        self.stages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Display {
    /// Takes the bars of a job that failed from the screen.
    fn drop(&mut self) {
        for (_, stage) in std::mem::take(&mut *self.stages()) {
            if let Some(bar) = stage.bar {
                bar.finish_and_clear();
            }
        }
    }
}

fn new_bar(name: &str, total: usize) -> ProgressBar {
    let (bar, template) = if total == 0 {
        (ProgressBar::new_spinner(), "{prefix} {spinner} {pos} {elapsed}")
    } else {
        (ProgressBar::new(total as u64), "{prefix} [{bar:30}] {pos}/{len}  {elapsed}, about {eta} left")
    };
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_prefix(name.to_owned());
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

/// How far a stage is, in words.
fn plain(done: usize, total: usize, elapsed: Duration) -> String {
    if total == 0 || done == 0 {
        return format!("{done} done");
    }
    let left = elapsed.as_secs_f64() * (total.saturating_sub(done)) as f64 / done as f64;
    format!("{done} of {total}, about {left:.0} s left")
}

#[cfg(test)]
mod tests {
    use super::plain;
    use std::time::Duration;

    #[test]
    fn the_estimate_follows_from_what_is_done() {
        assert_eq!(plain(25, 100, Duration::from_secs(10)), "25 of 100, about 30 s left");
        assert_eq!(plain(0, 100, Duration::from_secs(10)), "0 done");
        assert_eq!(plain(7, 0, Duration::from_secs(1)), "7 done");
        assert_eq!(plain(120, 100, Duration::from_secs(1)), "120 of 100, about 0 s left");
    }
}
