//! `modiste garment simulate`.

use std::fmt::Write;
use std::path::PathBuf;

use clap::Args;
use modiste::{GarmentSimulate, SimulatedGarment};

use super::training_set::TrainingArguments;

/// Dress many bodies and one moving body by physics: what a garment is learned from. Resumes where it was stopped.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  modiste garment simulate tshirt --gender male")]
pub(crate) struct GarmentSimulateArguments {
    #[command(flatten)]
    set: TrainingArguments,
    /// Folder for the training set; otherwise `training/garments/<gender>-<garment>`.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl GarmentSimulateArguments {
    pub(crate) fn job(&self) -> GarmentSimulate {
        self.set.job(self.out.as_ref())
    }
}

pub(crate) fn text(made: &SimulatedGarment) -> String {
    let mut text = format!("{} bodies, {} motions of {} frames", made.bodies, made.sequences, made.frames);
    for dropped in &made.dropped {
        let _always_ok = write!(text, "\nleft out {dropped}");
    }
    let _always_ok = write!(text, "\nwrote {}", made.folder.display());
    text
}
