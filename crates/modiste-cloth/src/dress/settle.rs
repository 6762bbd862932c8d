//! Letting cloth come to rest.

use crate::dress::DressError;
use crate::{BodyCollider, ClothModel, ClothState, Solver, SolverOptions};

/// How cloth is brought to rest under gravity.
#[derive(Debug, Clone, PartialEq)]
pub struct SettleOptions {
    /// Time of a frame (s).
    pub frame_time: f64,
    /// What happens, in order.
    pub stages: Vec<Stage>,
    /// Settling ends early in the last stage where no vertex is faster than this (m/s).
    pub rest_speed: f64,
}

/// A run of frames with settings of its own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stage {
    /// Number of frames.
    pub frames: usize,
    /// Drag (kg/(m² s)): much of it swallows swinging, little lets the cloth find its place.
    pub drag: f64,
    /// Share of the body's friction: with little the drape does not remember how it got there.
    pub friction: f64,
    /// Factor on the damping times of the fabric: at rest the same shape, reached without ringing.
    pub damping: f64,
}

impl Default for SettleOptions {
    fn default() -> Self {
        let stages = vec![
            Stage { frames: 25, drag: 1.5, friction: 0.1, damping: 3.0 },
            Stage { frames: 30, drag: 0.5, friction: 0.1, damping: 3.0 },
            Stage { frames: 20, drag: 1.5, friction: 1.0, damping: 3.0 },
        ];
        Self { frame_time: 1.0 / 30.0, stages, rest_speed: 0.004 }
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
        for (index, stage) in self.stages.iter().enumerate() {
            solver.set_options(SolverOptions {
                air_drag: stage.drag,
                damping: stage.damping * options.damping,
                friction: stage.friction * options.friction,
                static_friction: stage.friction * options.static_friction,
                ..options
            });
            for _ in 0..stage.frames {
                speed = solver.step(model, state, body, self.frame_time)?.max_speed;
                if index + 1 == self.stages.len() && speed < self.rest_speed {
                    return Ok(speed);
                }
            }
        }
        Ok(speed)
    }
}
