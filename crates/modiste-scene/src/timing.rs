//! Time per frame and stage.

use std::time::Duration;

use modiste_body::Motion;
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
    let mut milliseconds: Vec<f64> = times.map(|time| 1e3 * time.as_secs_f64()).collect();
    milliseconds.sort_by(f64::total_cmp);
    Some(Summary { median: quantile(&milliseconds, 0.5)?, p95: quantile(&milliseconds, 0.95)? })
}

/// Quantile of ascending values, interpolated between neighbours.
fn quantile(ascending: &[f64], fraction: f64) -> Option<f64> {
    let position = fraction * ascending.len().checked_sub(1)? as f64;
    let below = position.floor() as usize;
    let above = (below + 1).min(ascending.len() - 1);
    Some(ascending[below] + (position - below as f64) * (ascending[above] - ascending[below]))
}

#[cfg(test)]
mod tests {
    use super::{Stage, Timing, quantile};
    use std::time::Duration;

    #[test]
    fn quantiles_are_interpolated() {
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(quantile(&[4.0], 0.95), Some(4.0));
        assert_eq!(quantile(&[1.0, 2.0, 4.0], 0.5), Some(2.0));
        assert_eq!(quantile(&[0.0, 10.0], 0.95), Some(9.5));
    }

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
