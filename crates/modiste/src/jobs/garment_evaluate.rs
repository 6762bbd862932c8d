//! Measuring a learned garment against physics that it has not seen.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use modiste_body::{Body, ScapeModel};
use modiste_cloth::dress::{Design, Mannequin, TailorOptions};
use modiste_cloth::training_set::{Sequence, Wardrobe, draw_shapes, held_out_sequences};
use modiste_core::Progress;
use modiste_garment::drape::{Placement, PoseSequence, ShapeOptions, leave_one_out};
use modiste_garment::report::evaluate_sequence;
use modiste_garment::{DrapeModel, Evaluation, MeanFigures, MotionFigures, TrainingSet};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::event::Reporter;
use crate::{Assets, JobError, Sources};

/// Numbers of body coefficients that the shape of the garment is predicted from (DRAPE fig. 13).
pub(super) const BODY_COUNTS: [usize; 10] = [1, 2, 4, 6, 8, 10, 12, 15, 18, 20];

/// Seed of the bodies that garments are tried on; training sets have others.
const OTHER_BODIES_SEED: u64 = 2026;

/// Measures a learned garment: its shape on bodies left out of training, and its motion against physics on the mean body and
/// on others, in motions that no garment learns from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GarmentEvaluate {
    /// The model file.
    pub model: PathBuf,
    /// Its training set, for the bodies left out; it may be absent.
    pub training: Option<PathBuf>,
    /// Number of bodies beside the mean one.
    pub bodies: usize,
    /// Where captured motions are.
    pub sources: Sources,
}

/// What measuring a garment gives back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvaluatedGarment {
    /// Whose garment, and its name.
    pub garment: String,
    /// Size of the model file (bytes).
    pub bytes: u64,
    /// Over all motions on the mean body.
    pub mean_body: MeanFigures,
    /// Over all motions on other bodies.
    pub other_bodies: MeanFigures,
    /// All figures.
    pub evaluation: Evaluation,
}

impl EvaluatedGarment {
    pub(crate) fn of(model: &DrapeModel, evaluation: Evaluation, bytes: u64) -> Self {
        Self {
            garment: format!("{} {}", model.garment().gender.name(), model.garment().name),
            bytes,
            mean_body: MeanFigures::over(&evaluation.mean_body),
            other_bodies: MeanFigures::over(&evaluation.other_bodies),
            evaluation,
        }
    }
}

impl GarmentEvaluate {
    pub(crate) fn run(&self, reporter: &Reporter<'_>) -> Result<EvaluatedGarment, JobError> {
        let model = Arc::new(DrapeModel::load(&self.model)?);
        let set = self.training.as_ref().map(|folder| TrainingSet::load_sequences(folder, |_| false)).transpose()?;
        let body_model = ScapeModel::load(Assets::find()?.body(model.garment().gender))?;
        let mut evaluation = evaluate(&model, &body_model, set.as_ref(), (self.bodies, &self.sources), reporter)?;
        if let Some(before) = &model.evaluation {
            evaluation.training_seconds = before.training_seconds;
            evaluation.shape = evaluation.shape.or_else(|| before.shape.clone());
        }
        Ok(EvaluatedGarment::of(&model, evaluation, modiste_io::file_size(&self.model)?))
    }
}

/// Measures a garment on `bodies` bodies beside the mean one.
pub(crate) fn evaluate(
    model: &Arc<DrapeModel>,
    body_model: &Arc<ScapeModel>,
    set: Option<&TrainingSet>,
    (bodies, sources): (usize, &Sources),
    reporter: &Reporter<'_>,
) -> Result<Evaluation, JobError> {
    let garment = model.garment();
    if garment.pattern.is_empty() {
        return Err(JobError::Request(format!(
            "{} has neither pattern nor mesh in its file, so physics cannot be run to measure it against",
            garment.name
        )));
    }
    let shape = set.map(|set| leave_one_out(set, &ShapeOptions::default(), &BODY_COUNTS, Placement::Anchors));
    let mean = body_model.body(&[])?;
    let design = Design::from_json(&garment.name, &garment.pattern, &Mannequin::from(&mean))?;
    let usual = TailorOptions::default();
    let tailor = TailorOptions { vertex_count: model.provenance.vertex_count.unwrap_or(usual.vertex_count), ..usual };
    let wardrobe = Wardrobe::new(body_model, design, tailor)?;
    if wardrobe.template().state.positions.len() != garment.template.len() {
        return Err(JobError::Request(format!(
            "{} was learned at {} vertices, and its pattern is cut at {}",
            garment.name,
            garment.template.len(),
            wardrobe.template().state.positions.len()
        )));
    }
    let motions = match sources.mocap() {
        Some(folder) => held_out_sequences(&mean, &folder, reporter)?,
        None => {
            reporter.warn("no captured motions are there: only shapes are measured");
            Vec::new()
        }
    };
    let mut shapes = vec![Vec::new()];
    shapes.extend(draw_shapes(bodies, model.shape().body_count(), OTHER_BODIES_SEED));
    let trial = Trial { model, wardrobe: &wardrobe };
    let stage = format!("{} {}: evaluate", garment.gender.name(), garment.name);
    let pairs: Vec<(usize, &Sequence)> =
        (0..shapes.len()).flat_map(|body| motions.iter().map(move |motion| (body, motion))).collect();
    reporter.start(&stage, pairs.len());
    let done = AtomicUsize::new(0);
    let results: Vec<Result<MotionFigures, String>> = pairs
        .par_iter()
        .with_max_len(1)
        .map(|&(body, motion)| {
            let found = trial.run(&body_model.body(&shapes[body])?, (body, &shapes[body]), motion);
            reporter.advance(&stage, done.fetch_add(1, Ordering::Relaxed) + 1);
            Ok(found.map_err(|error| format!("{} on body {body}: {error}", motion.name)))
        })
        .collect::<Result<_, JobError>>()?;
    reporter.finish(&stage);
    let mut evaluation = Evaluation {
        shape: shape.transpose()?,
        garment_shape_count: model.shape().count(),
        wrinkle_count: model.wrinkle().count(),
        wrinkle_variance: model.wrinkle().explained_variance(),
        spectral_radius: model.dynamics().spectral_radius()?,
        ..Evaluation::default()
    };
    for result in results {
        match result {
            Ok(figures) if figures.body == 0 => evaluation.mean_body.push(figures),
            Ok(figures) => evaluation.other_bodies.push(figures),
            Err(why) => evaluation.dropped.push(why),
        }
    }
    Ok(evaluation)
}

struct Trial<'a> {
    model: &'a Arc<DrapeModel>,
    wardrobe: &'a Wardrobe,
}

impl Trial<'_> {
    /// Simulates one motion on one body, and makes it again by the model.
    fn run(&self, body: &Body, (index, shape): (usize, &[f64]), motion: &Sequence) -> Result<MotionFigures, JobError> {
        let dressed = if index == 0 { self.wardrobe.template().clone() } else { self.wardrobe.dress(body, 0.0)? };
        let run = (motion.name.as_str(), &motion.motion);
        let simulation = self.wardrobe.simulate(body, &dressed, run, &|| {})?.soundest()?;
        let sequence = PoseSequence {
            name: motion.name.clone(),
            motion: simulation.motion,
            frames: simulation.frames,
            body_anchors: simulation.body_anchors,
        };
        let report = evaluate_sequence(self.model, &sequence, shape, &|pose, out| body.pose(pose, out))?;
        Ok(MotionFigures::of(&report, index))
    }
}
