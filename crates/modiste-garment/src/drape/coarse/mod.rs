//! The coarse deformation: where the cloth as a whole goes, beside the wrinkles on it.
//!
//! Not in the paper. Its wrinkles ψ are principal components of gradients, and nearly all that varies in those is fine: of
//! where a hem hangs they keep little, and small errors of many gradients add up to centimetres at the far end of a mesh
//! that is held at its collar. So the places of the vertices are learned too: as displacements from the garment with mean
//! wrinkles, each in the frame of the parts that its vertex follows, in principal components κ foretold by kernel regression
//! from the pose, its past and the motion of the body. Then [`ScreenedReconstruction`] takes from the places what is coarse
//! and from the gradients what is fine.

mod inputs;
mod regression;

use modiste_body::Pose;
use modiste_body::scape::RotationBlend;
use modiste_core::{Mat3, Matrix, Pca, QuantisedBasis, ScreenedReconstruction, Vec3};
use rayon::prelude::*;

pub(crate) use inputs::{MotionInputs, MotionState};
use regression::Frames;
pub(crate) use regression::KernelRegression;

use super::blend::Turns;
use super::clips::Clips;
use super::training_set::{Garment, PoseSequence};
use crate::GarmentError;

/// How the coarse deformation is learned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoarseOptions {
    /// Number of coefficients κ. 0 is the paper: wrinkles alone.
    pub count: usize,
    /// Frames, spread evenly, that the kernels of the regression stand at.
    pub centres: usize,
    /// Length (m) between coarse and fine.
    pub length: f64,
}

impl Default for CoarseOptions {
    fn default() -> Self {
        Self { count: 60, centres: 400, length: 0.05 }
    }
}

/// Writes the garment with mean wrinkles (m) for a pose and the places of the body's anchors (m).
pub(crate) type Reference<'a> = dyn Fn(&Pose, &[Vec3], &mut [Vec3]) + Sync + 'a;

/// Frames, spread evenly, that the components are learned from.
const MOST_FRAMES: usize = 3000;

/// Displacements of the vertices in the frames of their parts, `U_c κ + μ_c`, and κ from the motion.
#[derive(Debug, Clone)]
pub(crate) struct CoarseModel {
    blend: RotationBlend,
    pub(crate) learned: Learned,
    reconstruction: ScreenedReconstruction,
}

/// What is learned, and stored.
#[derive(Debug, Clone)]
pub(crate) struct Learned {
    /// Mean displacement (m), three numbers a vertex.
    pub(crate) mean: Vec<f32>,
    /// Components of displacements (m), three numbers a vertex.
    pub(crate) basis: QuantisedBasis<i8>,
    pub(crate) inputs: MotionInputs,
    /// κ from pose, past and motion.
    pub(crate) dynamic: KernelRegression,
    /// κ from the pose alone.
    pub(crate) fixed: KernelRegression,
    /// Length (m) between coarse and fine.
    pub(crate) length: f64,
    /// Part of the variance of κ on held-out motions that `dynamic` misses.
    pub(crate) held_out_error: f64,
}

impl CoarseModel {
    /// Learns from all frames of some sequences.
    ///
    /// # Errors
    /// Fewer than two frames, or a solve that fails.
    pub(crate) fn train(
        garment: &Garment,
        blend: RotationBlend,
        sequences: &[PoseSequence],
        options: &CoarseOptions,
        reference: &Reference<'_>,
    ) -> Result<Self, GarmentError> {
        let rows: Vec<Vec<Vec<f32>>> =
            sequences.iter().map(|sequence| displacements(&blend, sequence, reference)).collect();
        let all: Vec<&[f32]> = rows.iter().flatten().map(Vec::as_slice).collect();
        let samples: Vec<&[f32]> = all.iter().copied().step_by(all.len().div_ceil(MOST_FRAMES).max(1)).collect();
        if samples.len() < 2 {
            return Err(GarmentError::data("pose training set", "at least 2 frames", samples.len()));
        }
        let pca = Pca::fit(&samples, options.count).map_err(GarmentError::solve("PCA of coarse deformations"))?;
        let count = pca.count();
        let basis = QuantisedBasis::from_f32(&pca.basis, count, pca.dimensions())
            .map_err(GarmentError::solve("basis of coarse deformations"))?;
        let inputs = MotionInputs::new(&garment.face_parts);
        let frames: Vec<Frames> = Clips::of(sequences)
            .into_iter()
            .zip(sequences)
            .zip(&rows)
            .map(|((clips, sequence), rows)| Frames {
                clips,
                inputs: input_rows(&inputs, &sequence.motion.frames),
                outputs: Matrix::from_rows(&rows.par_iter().map(|row| pca.project(row)).collect::<Vec<_>>()),
            })
            .collect();
        let (dynamic, held_out_error) = KernelRegression::fit(&frames, options.centres)?;
        let fixed: Vec<Frames> = frames
            .into_iter()
            .map(|frames| {
                let pose = |row: usize, column: usize| frames.inputs[(row, column)];
                Frames { inputs: Matrix::from_fn(frames.inputs.rows, inputs.pose_count(), pose), ..frames }
            })
            .collect();
        let (fixed, _) = KernelRegression::fit(&fixed, options.centres)?;
        let length = options.length;
        Self::assemble(
            garment,
            blend,
            Learned { mean: pca.mean, basis, inputs, dynamic, fixed, length, held_out_error },
        )
    }

    /// Puts what was learned together and factors the screened reconstruction.
    pub(crate) fn assemble(garment: &Garment, blend: RotationBlend, learned: Learned) -> Result<Self, GarmentError> {
        let reconstruction = ScreenedReconstruction::new(&garment.topology, &garment.template, learned.length)
            .map_err(GarmentError::solve("screened reconstruction"))?;
        Ok(Self { blend, learned, reconstruction })
    }

    /// Number of coefficients κ.
    pub(crate) fn count(&self) -> usize {
        self.learned.basis.count()
    }

    /// κ of a garment (m) whose form with mean wrinkles is `reference` (m), for its pose.
    pub(crate) fn coefficients_of(&self, pose: &Pose, reference: &[Vec3], vertices: &[Vec3]) -> Vec<f64> {
        let row = displacement(&self.blend, pose, reference, vertices);
        let basis = self.learned.basis.to_f32();
        let along = |component: &[f32]| {
            let numbers = component.iter().zip(&row).zip(&self.learned.mean);
            numbers.map(|((b, u), mean)| f64::from(*b) * (f64::from(*u) - f64::from(*mean))).sum()
        };
        basis.chunks_exact(row.len().max(1)).map(along).collect()
    }

    /// Moves the vertices of the garment with mean wrinkles (m) to the places that κ says.
    pub(crate) fn displace(&self, pose: &Pose, coefficients: &[f64], scratch: &mut Vec<f32>, places: &mut [Vec3]) {
        scratch.resize(self.learned.mean.len(), 0.0);
        self.learned.basis.expand(&self.learned.mean, coefficients, scratch);
        let turns = Turns::new(&self.blend, pose);
        for (vertex, (place, way)) in places.iter_mut().zip(scratch.as_chunks::<3>().0).enumerate() {
            *place += turns.rotation(vertex) * Vec3::from_array(way.map(f64::from));
        }
    }

    /// The places (m) that are foretold for the last of some poses in a row, from the body's anchors (m) then.
    pub(crate) fn places(&self, reference: &Reference<'_>, poses: &[Pose], anchors: &[Vec3]) -> Vec<Vec3> {
        let mut places = vec![Vec3::ZERO; self.learned.mean.len() / 3];
        if let Some(pose) = poses.last() {
            let inputs = input_rows(&self.learned.inputs, poses);
            let mut coefficients = vec![0.0; self.count()];
            self.learned.dynamic.predict(inputs.row(inputs.rows - 1), &mut coefficients);
            reference(pose, anchors, &mut places);
            self.displace(pose, &coefficients, &mut Vec::new(), &mut places);
        }
        places
    }

    /// The mesh with the coarse shape of `places` and the fine shape of `gradients`.
    pub(crate) fn reconstruct(&self, gradients: &[Mat3], places: &[Vec3], out: &mut [Vec3]) {
        self.reconstruction.reconstruct(gradients, places, out);
    }

    /// What takes from places what is coarse and from gradients what is fine.
    pub(crate) fn reconstruction(&self) -> &ScreenedReconstruction {
        &self.reconstruction
    }
}

/// One row of inputs per pose of a motion.
fn input_rows(inputs: &MotionInputs, poses: &[Pose]) -> Matrix {
    let mut state = inputs.start();
    let row = |pose| {
        let mut row = vec![0.0; inputs.count()];
        inputs.step(&mut state, pose, &mut row);
        row
    };
    Matrix::from_rows(&poses.iter().map(row).collect::<Vec<_>>())
}

/// Displacements in every frame of a sequence.
fn displacements(blend: &RotationBlend, sequence: &PoseSequence, reference: &Reference<'_>) -> Vec<Vec<f32>> {
    let frames = sequence.motion.frames.par_iter().zip(&sequence.frames).zip(&sequence.body_anchors);
    frames
        .map(|((pose, vertices), anchors)| {
            let mut plain = vec![Vec3::ZERO; vertices.len()];
            reference(pose, anchors, &mut plain);
            displacement(blend, pose, &plain, vertices)
        })
        .collect()
}

/// The way (m) of every vertex from `reference` to `vertices`, in the frame of its parts.
fn displacement(blend: &RotationBlend, pose: &Pose, reference: &[Vec3], vertices: &[Vec3]) -> Vec<f32> {
    let turns = Turns::new(blend, pose);
    let ways = vertices.iter().zip(reference).enumerate();
    ways.flat_map(|(vertex, (to, from))| (turns.rotation(vertex).transpose() * (*to - *from)).as_vec3().to_array())
        .collect()
}
