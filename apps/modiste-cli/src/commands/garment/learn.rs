//! `modiste garment learn`.

use std::path::PathBuf;

use clap::Args;
use modiste::{GarmentLearn, LearnedGarment};

use super::training_set::TrainingArguments;
use super::{evaluate, simulate};

/// From a sewing pattern to a learned garment: simulate, learn and measure. Resumes where it was stopped.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  modiste garment learn --pattern skirt2_specification.json --gender female --out skirt.safetensors\n  modiste garment learn pants --gender male --out pants.safetensors"
)]
pub(crate) struct GarmentLearnArguments {
    #[command(flatten)]
    set: TrainingArguments,
    /// Folder for the training set; otherwise `training/garments/<gender>-<garment>`.
    #[arg(long, value_name = "FOLDER")]
    training: Option<PathBuf>,
    /// Number of bodies beside the mean one that the garment is measured on.
    #[arg(long, default_value_t = 4)]
    trial_bodies: usize,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl GarmentLearnArguments {
    pub(crate) fn job(&self) -> GarmentLearn {
        GarmentLearn {
            training: self.set.job(self.training.as_ref()),
            trial_bodies: self.trial_bodies,
            out: self.out.clone(),
        }
    }
}

/// Also of a garment that was imported.
pub(crate) fn text(learned: &LearnedGarment) -> String {
    format!(
        "{}\n{}\nwrote {}",
        simulate::text(&learned.simulated),
        evaluate::text(&learned.evaluated),
        learned.file.display()
    )
}
