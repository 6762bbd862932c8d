//! What a learned garment was measured to be worth; stored with it.

use serde::{Deserialize, Serialize};

use crate::drape::LeaveOneOut;
use crate::report::SequenceReport;

/// Figures of a learned garment on bodies and motions that it was not learned from.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// The shape of the garment on bodies left out one by one (DRAPE fig. 13); absent without the training set.
    pub shape: Option<LeaveOneOut>,
    /// Against physics on the mean body.
    pub mean_body: Vec<MotionFigures>,
    /// Against physics on other bodies, which wrinkles are not learned from.
    pub other_bodies: Vec<MotionFigures>,
    /// Bodies and motions that physics itself could not do, with the reason.
    pub dropped: Vec<String>,
    /// Number of garment shape coefficients φ.
    pub garment_shape_count: usize,
    /// Number of wrinkle coefficients ψ, and the part of the variance of the training frames that they hold.
    pub wrinkle_count: usize,
    /// See [`Self::wrinkle_count`].
    pub wrinkle_variance: f64,
    /// Largest magnitude of an eigenvalue of the wrinkle dynamics.
    pub spectral_radius: f64,
    /// Time that simulating and learning took (s); 0 where it was not measured.
    pub training_seconds: f64,
}

/// One motion on one body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MotionFigures {
    /// The motion.
    pub motion: String,
    /// Which body: 0 is the mean body.
    pub body: usize,
    /// Frames that are compared.
    pub frames: usize,
    /// Mean distance from the simulated vertices (m) with dynamics.
    pub error: f64,
    /// The same without dynamics.
    pub static_error: f64,
    /// The same by the paper's model alone: with dynamics, without the coarse deformation.
    #[serde(default)]
    pub plain_error: f64,
    /// Mean curvature (1/m) of physics, with dynamics and without.
    pub curvature: [f64; 3],
}

impl MotionFigures {
    /// Takes the means of a sequence.
    pub fn of(report: &SequenceReport, body: usize) -> Self {
        Self {
            motion: report.name.clone(),
            body,
            frames: report.dynamic.error.len(),
            error: report.dynamic.mean_error(),
            static_error: report.fixed.mean_error(),
            plain_error: report.plain.mean_error(),
            curvature: [&report.physics, &report.dynamic, &report.fixed].map(|figures| figures.mean_curvature()),
        }
    }
}

/// Means over several motions, each frame counting alike.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanFigures {
    /// Frames.
    pub frames: usize,
    /// Mean distance from the simulated vertices (m) with dynamics.
    pub error: f64,
    /// The same without dynamics.
    pub static_error: f64,
    /// The same by the paper's model alone.
    #[serde(default)]
    pub plain_error: f64,
    /// Mean curvature as a share of that of physics, with dynamics.
    pub curvature_ratio: f64,
    /// The same without dynamics.
    pub static_curvature_ratio: f64,
}

impl MeanFigures {
    /// Over these motions; zeros where there are none.
    pub fn over(motions: &[MotionFigures]) -> Self {
        let frames: usize = motions.iter().map(|motion| motion.frames).sum();
        let mean = |of: &dyn Fn(&MotionFigures) -> f64| {
            motions.iter().map(|motion| motion.frames as f64 * of(motion)).sum::<f64>() / frames.max(1) as f64
        };
        let physics = mean(&|m| m.curvature[0]).max(f64::MIN_POSITIVE);
        Self {
            frames,
            error: mean(&|m| m.error),
            static_error: mean(&|m| m.static_error),
            plain_error: mean(&|m| m.plain_error),
            curvature_ratio: mean(&|m| m.curvature[1]) / physics,
            static_curvature_ratio: mean(&|m| m.curvature[2]) / physics,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{MeanFigures, MotionFigures};

    #[test]
    fn long_motions_count_more() {
        let motion = |frames, error, curvature| MotionFigures {
            motion: "walk".into(),
            body: 0,
            frames,
            error,
            static_error: 2.0 * error,
            plain_error: 3.0 * error,
            curvature,
        };
        let mean = MeanFigures::over(&[motion(30, 0.01, [10.0, 9.0, 5.0]), motion(10, 0.03, [20.0, 20.0, 10.0])]);
        assert_eq!(mean.frames, 40);
        assert!((mean.error - 0.015).abs() < 1e-12 && (mean.static_error - 0.03).abs() < 1e-12);
        assert!((mean.plain_error - 0.045).abs() < 1e-12);
        assert!((mean.curvature_ratio - 47.0 / 50.0).abs() < 1e-12);
        assert!((mean.static_curvature_ratio - 0.5).abs() < 1e-12);
        assert_eq!(MeanFigures::over(&[]).frames, 0);
    }
}
