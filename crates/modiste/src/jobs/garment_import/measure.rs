//! What an imported garment is worth on motions of the same simulation that it was not learned from.

use std::sync::Arc;

use modiste_body::Body;
use modiste_core::Progress;
use modiste_garment::drape::{Placement, ShapeOptions, leave_one_out};
use modiste_garment::report::evaluate_sequence;
use modiste_garment::{DrapeModel, Evaluation, MotionFigures, TrainOptions, TrainingSet};

use crate::JobError;
use crate::event::Reporter;
use crate::jobs::garment_evaluate::BODY_COUNTS;

/// Fewest motions of which one can be spared.
const FEWEST_MOTIONS: usize = 3;

/// One motion in so many is held out.
const HELD_OUT: usize = 5;

/// Learns the garment without some of its motions and measures it on them. The stretches of one clip (`kick`, `kick-2`) stay
/// together: next to what is learned from, nothing is held out.
pub(super) fn held_out(set: &TrainingSet, mean: &Body, reporter: &Reporter<'_>) -> Result<Evaluation, JobError> {
    let clip = |name: &str| match name.rsplit_once('-') {
        Some((clip, stretch)) if stretch.bytes().all(|byte| byte.is_ascii_digit()) => clip.to_owned(),
        _ => name.to_owned(),
    };
    let mut clips: Vec<String> = set.sequences.iter().map(|sequence| clip(&sequence.name)).collect();
    clips.sort();
    clips.dedup();
    let mut part = set.clone();
    let kept_back = if clips.len() < FEWEST_MOTIONS {
        reporter.warn("there are fewer than three motions: none is held out to measure wrinkles by");
        Vec::new()
    } else {
        part.hold_out(|name| clips.binary_search(&clip(name)).is_ok_and(|index| index % HELD_OUT == HELD_OUT / 2))
    };
    let (model, _) = DrapeModel::train(&part, &TrainOptions::default(), reporter)?;
    let model = Arc::new(model);
    let mut evaluation = Evaluation {
        shape: Some(leave_one_out(set, &ShapeOptions::default(), &BODY_COUNTS, Placement::Anchors)?),
        garment_shape_count: model.shape().count(),
        wrinkle_count: model.wrinkle().count(),
        wrinkle_variance: model.wrinkle().explained_variance(),
        spectral_radius: model.dynamics().spectral_radius()?,
        ..Evaluation::default()
    };
    let garment = model.garment();
    let stage = format!("{} {}: evaluate", garment.gender.name(), garment.name);
    reporter.start(&stage, kept_back.len());
    for (index, sequence) in kept_back.iter().enumerate() {
        let report = evaluate_sequence(&model, sequence, &[], &|pose, out| mean.pose(pose, out))?;
        evaluation.mean_body.push(MotionFigures::of(&report, 0));
        reporter.advance(&stage, index + 1);
    }
    reporter.finish(&stage);
    Ok(evaluation)
}
