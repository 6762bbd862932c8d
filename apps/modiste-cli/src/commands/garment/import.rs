//! `modiste garment import`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use modiste::{GarmentImport, Gender, UpAxis};

use super::training_set::training_folder;
use crate::words::GenderName;

/// Learn a garment from what another program simulated: the mesh in motion, and the bodies below it.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  modiste garment import --sequence sims/*.npz --bodies bodies/*.npz --gender female --out dress.safetensors"
)]
pub(crate) struct GarmentImportArguments {
    /// The garment as simulated: npz (`vertices` (F,V,3), `faces`), pc2, OBJ files with numbers, or folders. On at least
    /// three bodies of other shapes in the template pose, one frame each, and on the mean body in motion.
    #[arg(long, value_name = "FILES", num_args = 1.., required = true)]
    sequence: Vec<PathBuf>,
    /// The body of each sequence, under the same name: the same kinds of files, or BVH for a motion of the mean body; may be
    /// left out where an npz has it in `body`.
    #[arg(long, value_name = "FILES", num_args = 1..)]
    bodies: Vec<PathBuf>,
    /// OBJ of the garment's mesh on the mean body in the template pose; needed where all sequences are pc2.
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Whose bodies.
    #[arg(long, value_enum, default_value = "female")]
    gender: GenderName,
    /// What the garment is called; otherwise like the model file.
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Frames a second of files that do not say so; otherwise 30.
    #[arg(long, value_name = "NUMBER")]
    fps: Option<f64>,
    /// Which way is up in the files.
    #[arg(long, value_enum, default_value = "y")]
    up: UpName,
    /// Folder for the training set; otherwise `training/garments/<gender>-<garment>`.
    #[arg(long, value_name = "FOLDER")]
    training: Option<PathBuf>,
    /// The model file.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum UpName {
    Y,
    Z,
}

impl GarmentImportArguments {
    pub(crate) fn job(&self) -> GarmentImport {
        let gender: Gender = self.gender.into();
        let named_by_file = || self.out.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = self.name.clone().unwrap_or_else(named_by_file);
        GarmentImport {
            gender,
            sequences: self.sequence.clone(),
            bodies: self.bodies.clone(),
            mesh: self.mesh.clone(),
            fps: self.fps,
            up: match self.up {
                UpName::Y => UpAxis::Y,
                UpName::Z => UpAxis::Z,
            },
            training: self.training.clone().unwrap_or_else(|| training_folder(gender, &name)),
            name,
            out: self.out.clone(),
        }
    }
}
