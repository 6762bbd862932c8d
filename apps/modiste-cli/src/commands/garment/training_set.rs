//! The words for a training set of a garment, and where it lies.

use std::path::PathBuf;

use clap::Args;
use modiste::{GarmentSimulate, Gender};

use super::design::DesignArguments;
use crate::words::{GenderName, sources};

/// What a training set is made of.
#[derive(Debug, Args)]
pub(crate) struct TrainingArguments {
    #[command(flatten)]
    design: DesignArguments,
    /// Whose bodies.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// Number of bodies that are dressed.
    #[arg(long, default_value_t = 90)]
    bodies: usize,
    /// Seed of their shapes, and of how slim or loose the garment is cut for each.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// About how many vertices the garment has; a mesh keeps its own.
    #[arg(long, value_name = "NUMBER")]
    vertices: Option<usize>,
    /// Folder with captured motions (`mocap`); it may be absent.
    #[arg(long, value_name = "FOLDER", default_value = "../shared/data")]
    data: PathBuf,
}

impl TrainingArguments {
    /// Into `folder`, or the place of its name.
    pub(crate) fn job(&self, folder: Option<&PathBuf>) -> GarmentSimulate {
        let gender: Gender = self.gender.into();
        let design = self.design.choice();
        GarmentSimulate {
            gender,
            out: folder.cloned().unwrap_or_else(|| training_folder(gender, &design.garment())),
            design,
            bodies: self.bodies,
            seed: self.seed,
            vertices: self.vertices,
            sources: sources(&self.data),
        }
    }
}

/// Where a training set lies unless another folder is named.
pub(crate) fn training_folder(gender: Gender, garment: &str) -> PathBuf {
    PathBuf::from(format!("training/garments/{}-{garment}", gender.name()))
}
