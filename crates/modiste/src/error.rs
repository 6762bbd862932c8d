//! Why a job failed.

use std::path::Path;

use modiste_body::makehuman::MakeHumanError;
use modiste_body::measure::MeasureError;
use modiste_body::population::PopulationError;
use modiste_body::{BodyError, Gender};
use modiste_cloth::ClothError;
use modiste_cloth::dress::{DesignError, ReadyMadeError};
use modiste_cloth::pattern::PatternError;
use modiste_cloth::training_set::TrainingError;
use modiste_garment::GarmentError;
use modiste_hair::HairError;
use modiste_io::IoError;
use modiste_scene::SceneError;

/// Why a job failed; one sentence for the user.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    /// A file cannot be read or written, or is not what it must be.
    #[error(transparent)]
    Io(#[from] IoError),
    /// A body, a measurement or a motion cannot be.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A file was read but cannot be used.
    #[error("{file}: {source}")]
    Unusable {
        /// The file.
        file: String,
        /// What is wrong with what it holds.
        source: BodyError,
    },
    /// A body cannot be measured.
    #[error("{what}: {source}")]
    Measure {
        /// The file or model.
        what: String,
        /// Why not.
        source: MeasureError,
    },
    /// MakeHuman's files are not what they must be.
    #[error(transparent)]
    MakeHuman(#[from] MakeHumanError),
    /// A population cannot be read or written.
    #[error(transparent)]
    Population(#[from] PopulationError),
    /// Cloth cannot be cut, sewn or simulated.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// A sewing pattern cannot be used.
    #[error(transparent)]
    Pattern(#[from] PatternError),
    /// A garment mesh cannot be worn.
    #[error(transparent)]
    ReadyMade(#[from] ReadyMadeError),
    /// What is stored of a garment's pattern or mesh cannot be read.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A training set cannot be made.
    #[error(transparent)]
    Training(#[from] TrainingError),
    /// A garment cannot be learned or worn.
    #[error(transparent)]
    Garment(#[from] GarmentError),
    /// A person cannot be animated.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// There are no models.
    #[error(
        "no trained models found in {looked}; run in the project's folder, or let MODISTE_ASSETS name the folder of \
         the models (`cargo xtask assets` makes them)"
    )]
    Assets {
        /// Where they were looked for.
        looked: String,
    },
    /// A garment that no model was learned for.
    #[error("there is no garment `{name}` for a {} body; known: {}", .gender.name(), list(.known))]
    UnknownGarment {
        /// What was asked for.
        name: String,
        /// For which bodies.
        gender: Gender,
        /// What there is.
        known: Vec<String>,
    },
    /// An outfit that is not measured.
    #[error("there is no outfit `{name}` to measure; known: {}", list(.known))]
    UnknownOutfit {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// Hair that no model was learned for.
    #[error("there is no hair `{name}`; known: {}. Learn it by `modiste hair learn --style STYLE --out hair.safetensors` and name the file", list(.known))]
    UnknownHair {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// Hair cannot be learned or worn.
    #[error(transparent)]
    Hair(#[from] HairError),
    /// A number that no adult body or no sensible request has.
    #[error("{what}: wanted {low} to {high} {unit}, found {found}")]
    Range {
        /// Which number.
        what: String,
        /// Its smallest value.
        low: f64,
        /// Its largest value.
        high: f64,
        /// Its unit.
        unit: &'static str,
        /// The number.
        found: f64,
    },
    /// No threads to be had.
    #[error("cannot start {wanted} threads: {reason}")]
    Threads {
        /// How many.
        wanted: usize,
        /// What the system says.
        reason: String,
    },
    /// A request that contradicts itself.
    #[error("{0}")]
    Request(String),
}

impl JobError {
    /// Names what could not be measured.
    pub(crate) fn measure(what: &str) -> impl FnOnce(MeasureError) -> Self {
        move |source| Self::Measure { what: what.to_owned(), source }
    }

    /// Names the file that an error is about.
    pub(crate) fn in_file(path: &Path) -> impl FnOnce(BodyError) -> Self {
        move |source| match source {
            BodyError::Io(error) => Self::Io(error),
            source => Self::Unusable { file: path.display().to_string(), source },
        }
    }
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}
