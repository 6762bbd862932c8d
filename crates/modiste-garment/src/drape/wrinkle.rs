//! How the garment changes with the pose of the body, beyond the rotation of its parts (DRAPE §4.3).

use modiste_body::{Part, Pose};
use modiste_core::{Mat3, Pca, QuantisedBasis, Vec3, deformation_gradients};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::features::root_rotation;
use super::gradient::{PER_FACE, area_weights, flatten, gradient_of};
use super::training_set::{Garment, PoseSequence};
use crate::GarmentError;

/// The frame in which the pose-dependent deformations Q are written.
///
/// DRAPE eq. 2 is `A = Q R D` in the world. Left so, the same wrinkle has other numbers for every heading of the body,
/// and a garment learned from people who walk towards +Z is wrong on those who walk towards +X. So Q is written in a
/// frame that turns with the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WrinkleFrame {
    /// The paper's order, seen from the pelvis: `A = Γ Q Γ⁻¹ R_p D`.
    Pelvis,
    /// The order of SCAPE, in the frame of the face's own part: `A = R_p Q D`. Sleeves keep their wrinkles as arms swing.
    #[default]
    Part,
}

/// How the wrinkle space is learned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrinkleOptions {
    /// Part of the variance that the coefficients ψ are to hold.
    pub variance: f64,
    /// Fewest coefficients.
    pub min_count: usize,
    /// Most coefficients; each costs 9 bytes a face in the model file.
    pub max_count: usize,
    /// Frame of the deformations.
    pub frame: WrinkleFrame,
    /// Weighs each face by its area in the principal component analysis. The paper does not.
    pub area_weighted: bool,
}

impl Default for WrinkleOptions {
    fn default() -> Self {
        Self { variance: 0.95, min_count: 30, max_count: 110, frame: WrinkleFrame::default(), area_weighted: false }
    }
}

/// Principal components of the pose-dependent deformations: `Q = U_q ψ + μ_q`.
#[derive(Debug, Clone, PartialEq)]
pub struct WrinkleModel {
    pub(crate) frame: WrinkleFrame,
    pub(crate) mean: Vec<f32>,
    pub(crate) basis: QuantisedBasis<i8>,
    pub(crate) std_devs: Vec<f64>,
    pub(crate) total_variance: f64,
}

impl WrinkleModel {
    /// Learns the space from all frames, and returns it with the coefficients of every frame of every sequence.
    ///
    /// # Errors
    /// Fewer than two frames, or a solve that fails.
    pub fn train(
        garment: &Garment,
        sequences: &[PoseSequence],
        options: &WrinkleOptions,
    ) -> Result<(Self, Vec<Vec<Vec<f64>>>), GarmentError> {
        let rows: Vec<Vec<Vec<f32>>> =
            sequences.iter().map(|sequence| sequence_rows(garment, sequence, options.frame)).collect();
        let samples: Vec<&[f32]> = rows.iter().flatten().map(Vec::as_slice).collect();
        if samples.len() < 2 {
            return Err(GarmentError::data("pose training set", "at least 2 frames", samples.len()));
        }
        let weights =
            if options.area_weighted { area_weights(&garment.topology, &garment.template) } else { Vec::new() };
        let mut pca =
            Pca::fit_weighted(&samples, &weights, options.max_count).map_err(GarmentError::solve("PCA of wrinkles"))?;
        let count = enough(&pca.std_devs, options.variance * pca.total_variance, options.min_count);
        pca.std_devs.truncate(count);
        pca.basis.truncate(count * pca.dimensions());
        let coefficients: Vec<Vec<Vec<f64>>> =
            rows.iter().map(|rows| rows.par_iter().map(|row| pca.project(row)).collect()).collect();
        let basis = QuantisedBasis::from_f32(&pca.basis, count, pca.dimensions())
            .map_err(GarmentError::solve("basis of wrinkles"))?;
        let model = Self {
            frame: options.frame,
            mean: pca.mean,
            basis,
            std_devs: pca.std_devs,
            total_variance: pca.total_variance,
        };
        Ok((model, coefficients))
    }

    /// Number of wrinkle coefficients ψ.
    pub fn count(&self) -> usize {
        self.basis.count()
    }

    /// Frame of the deformations.
    pub fn frame(&self) -> WrinkleFrame {
        self.frame
    }

    /// Standard deviation of each ψ over the training frames.
    pub fn std_devs(&self) -> &[f64] {
        &self.std_devs
    }

    /// Part of the variance of the training gradients that the coefficients hold.
    pub fn explained_variance(&self) -> f64 {
        self.std_devs.iter().map(|sd| sd * sd).sum::<f64>() / self.total_variance
    }

    /// Writes Q of all faces for given ψ as flat rows of nine.
    pub(crate) fn expand(&self, wrinkles: &[f64], out: &mut [f32]) {
        self.basis.expand(&self.mean, wrinkles, out);
    }
}

/// The fewest components whose variances add up to `wanted`, but at least `min_count` where there are so many.
fn enough(std_devs: &[f64], wanted: f64, min_count: usize) -> usize {
    let mut sum = 0.0;
    let reached = std_devs.iter().position(|sd| {
        sum += sd * sd;
        sum >= wanted
    });
    reached.map_or(std_devs.len(), |last| last + 1).max(min_count).min(std_devs.len())
}

/// Q of every frame of a sequence as flat rows.
pub(crate) fn sequence_rows(garment: &Garment, sequence: &PoseSequence, frame: WrinkleFrame) -> Vec<Vec<f32>> {
    let poses = &sequence.motion.frames;
    poses
        .par_iter()
        .zip(&sequence.frames)
        .map(|(pose, vertices)| flatten(&wrinkle_gradients(garment, frame, pose, vertices)))
        .collect()
}

/// Q of each face of one frame on the mean body, whose D is the identity.
pub fn wrinkle_gradients(garment: &Garment, frame: WrinkleFrame, pose: &Pose, vertices: &[Vec3]) -> Vec<Mat3> {
    let turns = PartTurns::new(frame, pose);
    let gradients = deformation_gradients(&garment.topology, &garment.template, vertices);
    gradients.iter().zip(&garment.face_parts).map(|(gradient, part)| turns.wrinkle(*gradient, *part)).collect()
}

/// The rotations of the parts of one pose, split as the wrinkle frame asks: `A = outer Q inner D`.
#[derive(Debug, Clone)]
pub(crate) struct PartTurns {
    outer: [Mat3; Part::COUNT],
    inner: [Mat3; Part::COUNT],
}

impl PartTurns {
    pub(crate) fn new(frame: WrinkleFrame, pose: &Pose) -> Self {
        let world = pose.world_rotations();
        match frame {
            WrinkleFrame::Part => Self { outer: world, inner: [Mat3::IDENTITY; Part::COUNT] },
            WrinkleFrame::Pelvis => {
                let world_from_pelvis = Mat3::from_quat(root_rotation(pose));
                let pelvis_from_world = world_from_pelvis.transpose();
                Self { outer: [world_from_pelvis; Part::COUNT], inner: world.map(|part| pelvis_from_world * part) }
            }
        }
    }

    /// Q from A, with D the identity.
    fn wrinkle(&self, gradient: Mat3, part: Part) -> Mat3 {
        let part = part.index();
        self.outer[part].transpose() * gradient * self.inner[part].transpose()
    }

    /// A = outer Q inner D of one face, with Q as a flat row of nine.
    pub(crate) fn compose(&self, wrinkle: &[f32], part: Part, shape_deformation: &Mat3, frame: WrinkleFrame) -> Mat3 {
        let part = part.index();
        let wrinkle = gradient_of(wrinkle);
        match frame {
            WrinkleFrame::Part => self.outer[part] * (wrinkle * *shape_deformation),
            WrinkleFrame::Pelvis => self.outer[part] * (wrinkle * (self.inner[part] * *shape_deformation)),
        }
    }
}

/// Writes the composed gradients A = Q R D of all faces (DRAPE eq. 2).
pub(crate) fn compose_all(
    frame: WrinkleFrame,
    pose: &Pose,
    face_parts: &[Part],
    shape_deformations: &[Mat3],
    wrinkles: &[f32],
    out: &mut [Mat3],
) {
    let turns = PartTurns::new(frame, pose);
    let faces = out.iter_mut().zip(face_parts).zip(shape_deformations).zip(wrinkles.chunks_exact(PER_FACE));
    for (((out, part), shape_deformation), wrinkle) in faces {
        *out = turns.compose(wrinkle, *part, shape_deformation, frame);
    }
}
