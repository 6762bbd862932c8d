//! Letting cloth come to rest.

use crate::dress::DressError;
use crate::{BodyCollider, ClothModel, ClothState, Solver, SolverOptions};

/// How cloth is brought to rest: gravity acts, and drag first swallows all motion, then lets the cloth find its place.
#[derive(Debug, Clone, PartialEq)]
pub struct SettleOptions {
    /// Time of a frame (s).
    pub frame_time: f64,
    /// Stages of frames and the drag (kg/(m² s)) in each.
    pub stages: Vec<(usize, f64)>,
    /// Settling ends early in the last stage where no vertex is faster than this (m/s).
    pub rest_speed: f64,
}

impl Default for SettleOptions {
    fn default() -> Self {
        Self { frame_time: 1.0 / 30.0, stages: vec![(15, 4.0), (30, 0.8), (30, 2.5)], rest_speed: 0.004 }
    }
}

impl SettleOptions {
    /// Runs the stages on a body that stands still; returns the largest speed at the end (m/s).
    pub(super) fn run(
        &self,
        model: &ClothModel,
        state: &mut ClothState,
        body: &mut BodyCollider,
        options: SolverOptions,
    ) -> Result<f64, DressError> {
        let mut solver = Solver::new(model, options);
        let mut speed = 0.0;
        for (index, &(frames, drag)) in self.stages.iter().enumerate() {
            solver.set_options(SolverOptions { air_drag: drag, ..options });
            for _ in 0..frames {
                speed = solver.step(model, state, body, self.frame_time)?.max_speed;
                if index + 1 == self.stages.len() && speed < self.rest_speed {
                    return Ok(speed);
                }
            }
        }
        Ok(speed)
    }
}
