//! `modiste garment evaluate`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use modiste::{EvaluatedGarment, GarmentEvaluate};

use crate::words::sources;

/// Measure a learned garment against physics on bodies and motions that it was not learned from.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  modiste garment evaluate skirt.safetensors")]
pub(crate) struct GarmentEvaluateArguments {
    /// The model file.
    model: PathBuf,
    /// Its training set, to measure its shape on bodies left out; otherwise what the model file says of it.
    #[arg(long, value_name = "FOLDER")]
    training: Option<PathBuf>,
    /// Number of bodies beside the mean one.
    #[arg(long, default_value_t = 4)]
    bodies: usize,
    /// Folder with captured motions (`mocap`).
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl GarmentEvaluateArguments {
    pub(crate) fn job(&self) -> GarmentEvaluate {
        GarmentEvaluate {
            model: self.model.clone(),
            training: self.training.clone(),
            bodies: self.bodies,
            sources: sources(&self.data),
        }
    }
}

pub(crate) fn text(made: &EvaluatedGarment) -> String {
    let evaluation = &made.evaluation;
    let mut text = format!("{}, {:.1} MB", made.garment, made.bytes as f64 / 1e6);
    if let Some(shape) = &evaluation.shape
        && let (Some(count), Some(error)) = (shape.body_counts.last(), shape.mean_error.last())
    {
        let _always_ok = write!(
            text,
            "\nshape on bodies left out: {:.1} mm at {count} body coefficients (mean garment {:.1} mm)",
            1e3 * error,
            1e3 * shape.mean_garment_error
        );
    }
    let _always_ok = write!(
        text,
        "\nwrinkles: {} coefficients, {:.0} % of the variance, spectral radius {:.4}",
        evaluation.wrinkle_count,
        100.0 * evaluation.wrinkle_variance,
        evaluation.spectral_radius
    );
    if made.mean_body.frames + made.other_bodies.frames > 0 {
        text += &motions_table(made);
    }
    for dropped in &evaluation.dropped {
        let _always_ok = write!(text, "\nleft out {dropped}");
    }
    text
}

/// Every motion against physics, and the means.
fn motions_table(made: &EvaluatedGarment) -> String {
    let mut text = String::new();
    let _always_ok = write!(
        text,
        "\n{:<24}{:>6}{:>8}{:>16}{:>12}{:>20}{:>18}",
        "motion", "body", "frames", "dynamic (mm)", "static (mm)", "paper's model (mm)", "curvature ratio"
    );
    for motion in made.evaluation.mean_body.iter().chain(&made.evaluation.other_bodies) {
        let body = if motion.body == 0 { "mean".to_owned() } else { motion.body.to_string() };
        let _always_ok = write!(
            text,
            "\n{:<24}{body:>6}{:>8}{:>16.1}{:>12.1}{:>20.1}{:>18.2}",
            motion.motion,
            motion.frames,
            1e3 * motion.error,
            1e3 * motion.static_error,
            1e3 * motion.plain_error,
            motion.curvature[1] / motion.curvature[0].max(f64::MIN_POSITIVE)
        );
    }
    for (name, mean) in [("all, mean body", made.mean_body), ("all, other bodies", made.other_bodies)] {
        let _always_ok = write!(
            text,
            "\n{name:<30}{:>8}{:>16.1}{:>12.1}{:>20.1}{:>18.2}",
            mean.frames,
            1e3 * mean.error,
            1e3 * mean.static_error,
            1e3 * mean.plain_error,
            mean.curvature_ratio
        );
    }
    text
}
