//! How far the garment slides on the body as it moves.

use modiste_core::{Mat3, Matrix, Vec3};

use super::shape::{apply_regression_into, regress};
use super::training_set::{Garment, PoseSequence};
use crate::GarmentError;
use crate::refine::anchors::offset;

/// Weight of the coefficients, relative to the number of frames and for wrinkles of unit variance.
const RIDGE: f64 = 1e-2;

/// The way of the garment's anchors from where they are in the template pose, linear in the wrinkles ψ.
///
/// Not in the paper, whose anchors keep their place on the body: a collar that rises with the arms is a shift of the whole
/// garment, which gradients do not know of.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drift {
    /// One row per ψ and a last one for the constant, one column per axis (m) of the part that the anchors follow.
    pub(crate) regression: Matrix,
}

impl Drift {
    /// Learns from all frames of `sequences` and their wrinkles. `rest` is the offset (m) of the anchors in the template pose.
    pub(crate) fn train(
        garment: &Garment,
        sequences: &[PoseSequence],
        wrinkles: &[Vec<Vec<f64>>],
        std_devs: &[f64],
        rest: Vec3,
    ) -> Result<Self, GarmentError> {
        let targets: Vec<Vec<f64>> = sequences
            .iter()
            .flat_map(|sequence| offsets(garment, sequence))
            .map(|offset| (offset - rest).to_array().to_vec())
            .collect();
        let scale: Vec<f64> = std_devs.iter().map(|&sd| if sd > 0.0 { 1.0 / sd } else { 0.0 }).collect();
        let unit = |row: &Vec<f64>| row.iter().zip(&scale).map(|(value, scale)| value * scale).collect();
        let rows: Vec<Vec<f64>> = wrinkles.iter().flatten().map(unit).collect();
        let rows: Vec<&[f64]> = rows.iter().map(Vec::as_slice).collect();
        let ridge = RIDGE * rows.len() as f64;
        let mut regression = regress(&rows, std_devs.len(), &Matrix::from_rows(&targets), ridge)?;
        for (row, scale) in scale.iter().enumerate() {
            regression.row_mut(row).iter_mut().for_each(|slope| *slope *= scale);
        }
        Ok(Self { regression })
    }

    /// The way (m) in the frame of the part that the anchors follow.
    pub(crate) fn of(&self, wrinkles: &[f64]) -> Vec3 {
        let mut drift = [0.0; 3];
        apply_regression_into(&self.regression, wrinkles, &mut drift);
        Vec3::from_array(drift)
    }
}

/// The offset of the anchors from their places on the body in every frame (m), seen from the part that they follow.
fn offsets(garment: &Garment, sequence: &PoseSequence) -> impl Iterator<Item = Vec3> {
    let part = garment.anchor_part().index();
    let frames = sequence.motion.frames.iter().zip(&sequence.frames).zip(&sequence.body_anchors);
    frames.map(move |((pose, vertices), places)| {
        let turn: Mat3 = pose.world_rotations()[part];
        turn.transpose() * offset(&garment.anchors, vertices, places)
    })
}
