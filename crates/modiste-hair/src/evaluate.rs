//! How near learned hair comes to simulated hair: the measurements of table 6.1.

use modiste_core::{Affine3, Progress};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::HairError;
use crate::model::{BustState, Dynamics, HairModel};
use crate::training::{Factors, TrainingFolder};

/// Every so many frames, points are compared; the dynamics run through all.
const EVERY: usize = 3;

/// Errors of one cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellError {
    /// Name of the cell.
    pub cell: String,
    /// Mean distance of points (cm) over the sequences learned from.
    pub training_cm: f64,
    /// Mean distance of points (cm) over the sequences held out.
    pub test_cm: f64,
    /// The best that the components can do on the sequences held out (cm).
    pub projection_cm: f64,
    /// What hair that lies still at its mean in the model's moving space would be off by on these (cm).
    pub still_cm: f64,
    /// Frames compared, learned from and held out.
    pub frames: [usize; 2],
}

/// Sums over frames.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    free: f64,
    projected: f64,
    still: f64,
    frames: usize,
}

/// Lets the model run freely through every sequence in every cell, and compares with the simulation.
///
/// # Errors
/// A set whose files are absent or damaged.
pub fn evaluate(
    model: &HairModel,
    folder: &TrainingFolder,
    names: &[String],
    progress: &dyn Progress,
) -> Result<Vec<CellError>, HairError> {
    const STAGE: &str = "evaluate";
    let cells = &folder.recipe().cells;
    let mut sums = vec![[Sums::default(); 2]; cells.len()];
    progress.start(STAGE, names.len());
    for (index, name) in names.iter().enumerate() {
        let recorded = folder.body(name)?;
        let count = recorded.frames.len();
        let poses: Vec<Affine3> =
            recorded.busts().map(|(_, canonical)| model.space().pose(&canonical).inverse()).collect();
        let busts: Vec<BustState> =
            recorded.busts().map(|(frame, canonical)| model.bust_state(frame, canonical)).collect();
        for (cell, sums) in folder.recipe().cells.iter().zip(&mut sums) {
            let at = cells.iter().position(|other| other == cell).unwrap_or(0);
            let hair = folder.hair(name, at, count)?;
            let mut dynamics = Dynamics::new(model, Factors::of_cell(cell))?;
            let predicted: Vec<Vec<f64>> = busts.iter().map(|bust| dynamics.step(bust).to_vec()).collect();
            let frames: Vec<(usize, &[f32])> =
                hair.chunks_exact(hair.len() / count).enumerate().step_by(EVERY).collect();
            let more = frames
                .par_iter()
                .map(|(t, wanted)| compare(model, &predicted[*t], &model.space().carry(&poses[*t], wanted)))
                .reduce(Sums::default, Sums::join);
            let side = &mut sums[usize::from(recorded.held_out)];
            *side = side.join(more);
        }
        progress.advance(STAGE, index + 1);
    }
    progress.finish(STAGE);
    Ok(cells
        .iter()
        .zip(sums)
        .map(|(cell, [training, test])| {
            let mean = |sum: f64, side: Sums| 100.0 * sum / side.frames.max(1) as f64;
            CellError {
                cell: cell.name(),
                training_cm: mean(training.free, training),
                test_cm: mean(test.free, test),
                projection_cm: mean(test.projected, test),
                still_cm: mean(test.still, test),
                frames: [training.frames, test.frames],
            }
        })
        .collect())
}

impl Sums {
    fn join(self, other: Self) -> Self {
        Self {
            free: self.free + other.free,
            projected: self.projected + other.projected,
            still: self.still + other.still,
            frames: self.frames + other.frames,
        }
    }
}

fn compare(model: &HairModel, predicted: &[f64], wanted: &[f32]) -> Sums {
    let mut numbers = vec![0.0; wanted.len()];
    let mut distance = |y: &[f64]| {
        model.basis().expand(model.mean(), y, &mut numbers);
        mean_distance(&numbers, wanted)
    };
    Sums {
        free: distance(predicted),
        projected: distance(&model.hair_coefficients(wanted)),
        still: mean_distance(model.mean(), wanted),
        frames: 1,
    }
}

/// Mean distance between points (m), three numbers each.
fn mean_distance(a: &[f32], b: &[f32]) -> f64 {
    let squares = |a: &[f32], b: &[f32]| (0..3).map(|i| f64::from(a[i] - b[i]).powi(2)).sum::<f64>();
    let sum: f64 = a.chunks_exact(3).zip(b.chunks_exact(3)).map(|(a, b)| squares(a, b).sqrt()).sum();
    sum / (a.len() / 3).max(1) as f64
}
