//! Time per frame and stage.

use std::time::Duration;

use modiste_body::Motion;
use modiste_core::quantile;
use serde::{Deserialize, Serialize};

use crate::Dresser;

/// The stages of a frame, in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// The body takes its pose.
    Body,
    /// The garments are made for body and motion.
    Synthesis,
    /// The garments are put on, without a vertex inside the body.
    Fit,
}

impl Stage {
    /// Number of stages.
    pub const COUNT: usize = 3;
    /// All stages, in order.
    pub const ALL: [Self; Self::COUNT] = [Self::Body, Self::Synthesis, Self::Fit];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Body => "body",
            Self::Synthesis => "synthesis",
            Self::Fit => "fit",
        }
    }
}

/// What every frame took.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Timing {
    frames: Vec<[Duration; Stage::COUNT]>,
}

/// Times over many frames (ms).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Half of the frames took less.
    pub median: f64,
    /// 95% of the frames took less.
    pub p95: f64,
}

impl Timing {
    /// Adds a frame.
    pub fn push(&mut self, frame: [Duration; Stage::COUNT]) {
        self.frames.push(frame);
    }

    /// Median and 95th percentile of a stage, without the first `warm_up` frames; `None` when no frame is left.
    pub fn stage(&self, stage: Stage, warm_up: usize) -> Option<Summary> {
        summarise(self.measured(warm_up).map(|frame| frame[stage as usize]))
    }

    /// The same of whole frames.
    pub fn total(&self, warm_up: usize) -> Option<Summary> {
        summarise(self.measured(warm_up).map(|frame| frame.iter().sum()))
    }

    /// Number of frames.
    pub fn frame_count(&self) -> usize {
        self.frames.len()
    }

    fn measured(&self, warm_up: usize) -> impl Iterator<Item = &[Duration; Stage::COUNT]> {
        self.frames.iter().skip(warm_up)
    }
}

/// Lets somebody move for some frames, there and back again so that any number of them is one motion.
pub fn time_frames(dresser: &mut Dresser, motion: &Motion, frames: usize) -> Timing {
    let mut timing = Timing::default();
    let there = motion.frames.iter();
    for pose in there.clone().chain(there.rev()).cycle().take(frames) {
        dresser.step(pose);
        timing.push(dresser.times());
    }
    timing
}

pub(crate) fn summarise(times: impl Iterator<Item = Duration>) -> Option<Summary> {
    let milliseconds: Vec<f64> = times.map(|time| 1e3 * time.as_secs_f64()).collect();
    Some(Summary { median: quantile(&milliseconds, 0.5)?, p95: quantile(&milliseconds, 0.95)? })
}

#[cfg(test)]
mod tests {
    use super::{Stage, Timing};
    use std::time::Duration;

    #[test]
    fn stages_are_told_apart_and_the_warm_up_left_out() {
        let mut timing = Timing::default();
        for frame in 0..11u64 {
            let body = if frame == 0 { 1000 } else { frame };
            timing.push([Duration::from_millis(body), Duration::from_millis(2), Duration::from_millis(3)]);
        }
        let body = timing.stage(Stage::Body, 1).unwrap();
        assert!((body.median - 5.5).abs() < 1e-9);
        assert!((timing.stage(Stage::Fit, 1).unwrap().p95 - 3.0).abs() < 1e-9);
        assert!((timing.total(1).unwrap().median - 10.5).abs() < 1e-9);
        assert_eq!(timing.total(11), None);
    }
}
