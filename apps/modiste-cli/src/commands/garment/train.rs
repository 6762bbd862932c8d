//! `modiste garment train`.

use std::path::PathBuf;

use clap::Args;
use modiste::{GarmentTrain, TrainedGarment};

/// Learn a garment from its training set.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  modiste garment train training/garments/male-tshirt --out assets/male-tshirt.safetensors"
)]
pub(crate) struct GarmentTrainArguments {
    /// The training set.
    training: PathBuf,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl GarmentTrainArguments {
    pub(crate) fn job(&self) -> GarmentTrain {
        GarmentTrain { training: self.training.clone(), out: self.out.clone() }
    }
}

pub(crate) fn text(trained: &TrainedGarment) -> String {
    format!(
        "learned from {} bodies and {} frames, spectral radius of the dynamics {:.4}\nwrote {} ({:.1} MB)",
        trained.shapes,
        trained.frames,
        trained.spectral_radius,
        trained.file.display(),
        trained.bytes as f64 / 1e6
    )
}
