//! `modiste body train`.

use std::path::PathBuf;

use clap::Args;
use modiste::{BodyTrain, Gender, TrainedBody};

use crate::words::{GenderName, SourceArguments};

/// Learn the body model of one gender from its population.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  modiste body train --gender male --out assets/body-male.safetensors")]
pub(crate) struct BodyTrainArguments {
    /// Whose bodies.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// The population; otherwise `training/population-<gender>.npz`.
    #[arg(long, value_name = "FILE")]
    population: Option<PathBuf>,
    #[command(flatten)]
    sources: SourceArguments,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

impl BodyTrainArguments {
    pub(crate) fn job(&self) -> BodyTrain {
        let gender = self.gender.into();
        BodyTrain {
            gender,
            population: self.population.clone().unwrap_or_else(|| population_file(gender)),
            sources: self.sources.sources(),
            out: self.out.clone(),
        }
    }
}

/// Where a population lies unless another file is named.
fn population_file(gender: Gender) -> PathBuf {
    PathBuf::from(format!("training/population-{}.npz", gender.name()))
}

pub(crate) fn text(trained: &TrainedBody) -> String {
    format!(
        "learned from {} bodies\nwrote {} ({:.1} MB)",
        trained.bodies,
        trained.file.display(),
        trained.bytes as f64 / 1e6
    )
}
