//! Simulating what a garment is learned from.

use std::path::PathBuf;

use modiste_body::{Gender, ScapeModel};
use modiste_cloth::dress::TailorOptions;
use modiste_cloth::training_set::{TrainingOptions, generate, training_sequences};
use modiste_core::Progress;
use serde::Serialize;

use crate::event::Reporter;
use crate::limits::check_range;
use crate::{Assets, DesignChoice, JobError, Sources};

/// Dresses bodies of random shape and lets the mean body move in a garment, by physics. What an interrupted run finished
/// is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct GarmentSimulate {
    /// Whose bodies.
    pub gender: Gender,
    /// The garment.
    pub design: DesignChoice,
    /// Number of bodies that are dressed.
    pub bodies: usize,
    /// Seed of their shapes.
    pub seed: u64,
    /// About how many vertices the garment has, if not as many as usual.
    pub vertices: Option<usize>,
    /// Where captured motions are.
    pub sources: Sources,
    /// The folder for the training set.
    pub out: PathBuf,
}

/// What simulating gives back.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SimulatedGarment {
    /// The folder.
    pub folder: PathBuf,
    /// Dressed bodies.
    pub bodies: usize,
    /// Motions.
    pub sequences: usize,
    /// Their frames.
    pub frames: usize,
    /// Bodies and motions that were left out, with the reason.
    pub dropped: Vec<String>,
}

impl GarmentSimulate {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<SimulatedGarment, JobError> {
        check_range("number of bodies", self.bodies as f64, (3.0, 2000.0), "bodies")?;
        let mut tailor = TailorOptions::default();
        if let Some(vertices) = self.vertices {
            check_range("number of vertices", vertices as f64, (500.0, 60_000.0), "vertices")?;
            tailor.vertex_count = vertices;
        }
        let model = ScapeModel::load(Assets::find()?.body(self.gender))?;
        let mocap = self.sources.mocap();
        if mocap.is_none() {
            reporter.warn("no captured motions are there: the garment is learned from made motions alone");
        }
        let mean = model.body(&[])?;
        let design = self.design.load(&mean, reporter)?;
        let sequences = training_sequences(&mean, mocap.as_deref(), reporter)?;
        let options =
            TrainingOptions { body_count: self.bodies, seed: self.seed, tailor, ..TrainingOptions::new(design) };
        let summary = generate(&model, &sequences, &options, &self.out, reporter)?;
        Ok(SimulatedGarment {
            folder: self.out.clone(),
            bodies: summary.bodies,
            sequences: summary.sequences,
            frames: summary.frames,
            dropped: summary.dropped.iter().map(|part| format!("{}: {}", part.name, part.why)).collect(),
        })
    }
}
