//! Figures of a learned garment: wrinkles and errors on held-out motions, penetrations and times on dressed bodies.

use std::sync::Arc;

use modiste_body::{Body, Motion, Pose};
use modiste_core::{TriangleBvh, Vec3, mean_curvature, quantile};
use serde::{Deserialize, Serialize};

use crate::drape::{PoseSequence, Projection};
use crate::refine::penetration::measure_with;
use crate::refine::{FitOptions, Penetration};
use crate::{DrapeModel, GarmentError, Outfit, Synthesis, Wrinkles};

/// One way of making a sequence, compared with the simulation.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SequenceFigures {
    /// Mean of the mean curvature over the vertices (1/m), one per frame.
    pub curvature: Vec<f64>,
    /// Mean distance from the simulated vertices (m), one per frame.
    pub error: Vec<f64>,
}

/// Wrinkles and errors on one simulated sequence (DRAPE fig. 11 d).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct SequenceReport {
    /// Name of the sequence.
    pub name: String,
    /// Garment.
    pub garment: String,
    /// The simulation itself; its error is 0.
    pub physics: SequenceFigures,
    /// With dynamics.
    pub dynamic: SequenceFigures,
    /// Without dynamics.
    pub fixed: SequenceFigures,
    /// By the paper's model alone: with dynamics, without the coarse deformation.
    #[serde(default)]
    pub plain: SequenceFigures,
    /// With the wrinkles of the simulation projected on the learned space: what perfect dynamics would give.
    pub projected: SequenceFigures,
}

impl SequenceFigures {
    /// Mean curvature over all frames (1/m).
    pub fn mean_curvature(&self) -> f64 {
        mean(&self.curvature)
    }

    /// Mean error over all frames (m).
    pub fn mean_error(&self) -> f64 {
        mean(&self.error)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Makes a simulated sequence again with and without dynamics and compares wrinkles and vertices.
///
/// `shape` is β of the body that the garment was simulated on, empty for the mean body, and `posed_body` writes its vertices.
/// The garment is compared as it is synthesised, before the fit; wrinkles are projected for the mean body alone.
///
/// # Errors
/// A body that does not fit the model.
pub fn evaluate_sequence(
    model: &Arc<DrapeModel>,
    sequence: &PoseSequence,
    shape: &[f64],
    posed_body: &dyn Fn(&Pose, &mut Vec<Vec3>),
) -> Result<SequenceReport, GarmentError> {
    let topology = &model.garment().topology;
    let curvature = |x: &[Vec3]| mean(&mean_curvature(topology, x));
    let mut body = Vec::new();
    sequence.motion.frames.first().into_iter().for_each(|pose| posed_body(pose, &mut body));
    let start = |kind| Ok::<_, GarmentError>(Synthesis::new(model.clone(), shape, body.len())?.with_wrinkles(kind));
    let (mut dynamic, mut fixed) = (start(Wrinkles::Dynamic)?, start(Wrinkles::Static)?);
    let mut plain = start(Wrinkles::Dynamic)?.plain();
    let mut projection = shape.is_empty().then(|| Projection::new(model.clone(), body.len())).transpose()?;
    let mut report = SequenceReport {
        name: sequence.name.clone(),
        garment: model.garment().name.clone(),
        ..SequenceReport::default()
    };
    for (pose, truth) in sequence.motion.frames.iter().zip(&sequence.frames) {
        posed_body(pose, &mut body);
        report.physics.curvature.push(curvature(truth));
        report.physics.error.push(0.0);
        let projected = projection.as_mut().map(|p| (p.project(pose, &body, truth), &mut report.projected));
        let made = [
            Some((dynamic.step(pose, &body), &mut report.dynamic)),
            Some((fixed.step(pose, &body), &mut report.fixed)),
            Some((plain.step(pose, &body), &mut report.plain)),
            projected,
        ];
        for (made, figures) in made.into_iter().flatten() {
            figures.curvature.push(curvature(made));
            let distance = made.iter().zip(truth).map(|(made, truth)| made.distance(*truth)).sum::<f64>();
            figures.error.push(distance / truth.len() as f64);
        }
    }
    Ok(report)
}

/// Times of one stage over all frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// Median (s).
    pub median: f64,
    /// 95th percentile (s).
    pub p95: f64,
}

impl Times {
    fn of(seconds: &[f64]) -> Self {
        let [median, p95] = [0.5, 0.95].map(|share| quantile(seconds, share).unwrap_or(0.0));
        Self { median, p95 }
    }
}

/// One garment on one body in one motion.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct WearLayer {
    /// The garment.
    pub garment: String,
    /// Vertices inside the body as predicted, over all measured frames.
    pub predicted: Penetration,
    /// The same after the paper's three iterations alone.
    pub paper: Penetration,
    /// The same after the whole fit.
    pub fitted: Penetration,
    /// Frames in which vertices were caught between parts of the body that pass through each other.
    pub pinched_frames: usize,
    /// Time of the synthesis.
    pub synthesis: Times,
    /// Time of the fit.
    pub fit: Times,
}

/// An outfit on one body in one motion.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct WearReport {
    /// Name of the motion.
    pub motion: String,
    /// Body shape in standard deviations.
    pub shape: Vec<f64>,
    /// Frames that were dressed.
    pub frames: usize,
    /// Frames that were measured.
    pub measured_frames: usize,
    /// Measured frames in which the body passes through itself.
    pub self_crossing_frames: usize,
    /// Each garment, from the inside out.
    pub layers: Vec<WearLayer>,
    /// Time to take in the posed body.
    pub body: Times,
    /// Time of the whole frame, posing of the body not included.
    pub total: Times,
}

/// Dresses a body through a motion and measures penetrations against its triangles in every `stride`-th frame.
///
/// # Errors
/// Garments that do not fit the body.
pub fn wear(
    name: &str,
    body: &Body,
    garments: &[Arc<DrapeModel>],
    motion: &Motion,
    stride: usize,
) -> Result<WearReport, GarmentError> {
    let mut whole = Outfit::new(body, garments, &FitOptions::default())?;
    let mut paper = Outfit::new(body, garments, &FitOptions::paper_only())?;
    let topology = body.model().topology();
    let mut tree = TriangleBvh::new(topology, body.rest_vertices());
    let mut report = WearReport {
        motion: name.to_owned(),
        shape: body.shape().to_vec(),
        layers: garments
            .iter()
            .map(|model| WearLayer { garment: model.garment().name.clone(), ..WearLayer::default() })
            .collect(),
        ..WearReport::default()
    };
    let mut posed = Vec::new();
    let mut seconds = vec![Vec::new(); 2 * garments.len() + 2];
    for (frame, pose) in motion.frames.iter().enumerate() {
        body.pose(pose, &mut posed);
        let times = whole.step(pose, &posed).clone();
        paper.step(pose, &posed);
        report.frames += 1;
        seconds[0].push(times.prepare_seconds);
        seconds[1].push(times.seconds());
        for (index, layer) in times.layers.iter().enumerate() {
            seconds[2 + 2 * index].push(layer.synthesis_seconds);
            seconds[3 + 2 * index].push(layer.fit_seconds);
            report.layers[index].pinched_frames += usize::from(layer.pinched > 0);
        }
        if frame % stride.max(1) != 0 {
            continue;
        }
        report.measured_frames += 1;
        tree.refit(&posed);
        report.self_crossing_frames += usize::from(!tree.self_intersections(&posed).is_empty());
        for (index, layer) in report.layers.iter_mut().enumerate() {
            layer.predicted = layer.predicted.join(measure_with(topology, &tree, &posed, whole.predicted(index)));
            layer.paper = layer.paper.join(measure_with(topology, &tree, &posed, paper.vertices(index)));
            layer.fitted = layer.fitted.join(measure_with(topology, &tree, &posed, whole.vertices(index)));
        }
    }
    report.body = Times::of(&seconds[0]);
    report.total = Times::of(&seconds[1]);
    for (index, layer) in report.layers.iter_mut().enumerate() {
        layer.synthesis = Times::of(&seconds[2 + 2 * index]);
        layer.fit = Times::of(&seconds[3 + 2 * index]);
    }
    Ok(report)
}

/// The largest magnitude of any wrinkle coefficient, in its standard deviations, in a run of `frames` frames that repeats
/// a motion forwards and backwards.
pub fn longest_run(model: &DrapeModel, motion: &Motion, frames: usize) -> f64 {
    let count = motion.frames.len();
    if count == 0 {
        return 0.0;
    }
    let dynamics = model.dynamics();
    let mut state = dynamics.start();
    let mut largest: f64 = 0.0;
    for frame in 0..frames {
        // 0, 1, …, n-1, n-1, …, 1, 0, 0, 1, …: no jumps.
        let along = frame % (2 * count);
        let pose = &motion.frames[along.min(2 * count - 1 - along)];
        for (value, sd) in dynamics.step(&mut state, pose).iter().zip(model.wrinkle().std_devs()) {
            largest = largest.max(if value.is_finite() { value.abs() / sd } else { f64::INFINITY });
        }
    }
    largest
}
