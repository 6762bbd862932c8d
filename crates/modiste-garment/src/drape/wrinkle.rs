//! How the garment changes with the pose of the body, beyond the rotation of its parts (DRAPE §4.3).

use modiste_body::Pose;
use modiste_body::scape::RotationBlend;
use modiste_core::{Mat3, Pca, Vec3, deformation_gradients};
use rayon::prelude::*;

use super::basis::{BasisScratch, GradientBasis};
use super::blend::Turns;
use super::clips::{Clips, Standing};
use super::gradient::{PER_FACE, TangentFrames, area_weights, gradient_of_tangents};
use super::training_set::{Garment, PoseSequence};
use crate::GarmentError;

/// How the wrinkle space is learned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WrinkleOptions {
    /// Part of the variance that the coefficients ψ are to hold.
    pub variance: f64,
    /// Fewest coefficients.
    pub min_count: usize,
    /// Most coefficients; each costs 3 bytes a vertex in the model file.
    pub max_count: usize,
    /// Patterns of gradients that no mesh has (see [`GradientBasis`]) which are kept; each costs 6 bytes a face.
    pub pattern_count: usize,
    /// Weighs each face by its area in the principal component analysis. The paper does not.
    pub area_weighted: bool,
    /// The distance (m) over which the rotations of neighbouring parts pass into each other. 0 is the paper: a face turns with
    /// one part, and Q has to mend the tear between two.
    pub blend_width: f64,
}

impl Default for WrinkleOptions {
    fn default() -> Self {
        Self {
            variance: 0.95,
            min_count: 30,
            max_count: 120,
            pattern_count: 8,
            area_weighted: false,
            blend_width: 0.05,
        }
    }
}

/// Principal components of the pose-dependent deformations: `Q = U_q ψ + μ_q`.
#[derive(Debug, Clone, PartialEq)]
pub struct WrinkleModel {
    pub(crate) frames: TangentFrames,
    pub(crate) blend_width: f64,
    pub(crate) blend: RotationBlend,
    pub(crate) mean: Vec<f32>,
    pub(crate) basis: GradientBasis,
    pub(crate) std_devs: Vec<f64>,
    pub(crate) total_variance: f64,
    pub(crate) held_out_loss: f64,
}

/// Every so many clips are held out to see what a space learned from the others loses of them.
const HELD_OUT_STRIDE: usize = 4;

/// Frames, spread evenly, that the space is learned from; neighbours in time are alike, and the time grows with their square.
const MOST_FRAMES: usize = 3000;

/// The same for the space that shows what is lost of clips that are held out.
const MOST_FRAMES_HELD_OUT: usize = 1500;

/// Q of frames of some sequences as flat rows, evenly thinned so that there are no more than `most`. The rows of all frames
/// together would not fit into memory at the paper's resolution.
fn thinned<'a>(
    garment: &Garment,
    (blend, frames): (&RotationBlend, &TangentFrames),
    sequences: impl Iterator<Item = &'a PoseSequence>,
    most: usize,
) -> Vec<Vec<f32>> {
    let all: Vec<_> = sequences.flat_map(|sequence| sequence.motion.frames.iter().zip(&sequence.frames)).collect();
    let stride = all.len().div_ceil(most).max(1);
    let chosen: Vec<_> = all.into_iter().step_by(stride).collect();
    chosen.par_iter().map(|(pose, x)| frames.flatten(&wrinkle_gradients(garment, blend, pose, x))).collect()
}

impl WrinkleModel {
    /// Learns the space from frames of all sequences, whose faces follow the parts of `blend`, and returns it with the coefficients of every frame of every sequence.
    ///
    /// # Errors
    /// Fewer than two frames, or a solve that fails.
    pub fn train(
        garment: &Garment,
        blend: RotationBlend,
        sequences: &[PoseSequence],
        options: &WrinkleOptions,
    ) -> Result<(Self, Vec<Vec<Vec<f64>>>), GarmentError> {
        let frames = TangentFrames::new(&garment.topology, &garment.template);
        let samples = thinned(garment, (&blend, &frames), sequences.iter(), MOST_FRAMES);
        let samples: Vec<&[f32]> = samples.iter().map(Vec::as_slice).collect();
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
        let project =
            |(pose, x): (&Pose, &Vec<Vec3>)| pca.project(&frames.flatten(&wrinkle_gradients(garment, &blend, pose, x)));
        let coefficients: Vec<Vec<Vec<f64>>> = sequences
            .iter()
            .map(|sequence| sequence.motion.frames.par_iter().zip(&sequence.frames).map(project).collect())
            .collect();
        let mesh = (garment.topology.as_ref(), garment.template.as_slice());
        let basis = GradientBasis::new(mesh, &pca.basis, &pca.std_devs, options.pattern_count)
            .map_err(GarmentError::solve("basis of wrinkles"))?;
        let clips = Clips::of(sequences);
        let some = |standing: Standing| {
            let is_chosen =
                |clips: &Clips| clips.standing(|clip| clip % HELD_OUT_STRIDE == HELD_OUT_STRIDE - 1) == standing;
            let chosen = sequences.iter().zip(&clips).filter(|(_, clips)| is_chosen(clips));
            thinned(garment, (&blend, &frames), chosen.map(|(sequence, _)| sequence), MOST_FRAMES_HELD_OUT)
        };
        let held_out_loss = held_out_loss([some(Standing::Kept), some(Standing::HeldOut)], &weights, count)?;
        let model = Self {
            held_out_loss,
            frames,
            blend_width: options.blend_width,
            blend,
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

    /// Standard deviation of each ψ over the training frames.
    pub fn std_devs(&self) -> &[f64] {
        &self.std_devs
    }

    /// Part of the variance of the training gradients that the coefficients hold.
    pub fn explained_variance(&self) -> f64 {
        self.std_devs.iter().map(|sd| sd * sd).sum::<f64>() / self.total_variance
    }

    /// Part of the variance of motions that were held out that as many coefficients, learned from the others, do not hold.
    pub fn held_out_loss(&self) -> f64 {
        self.held_out_loss
    }

    /// One factor per ψ that gives the folds which no ψ holds back to the finer ones of those that there are, so that all of
    /// them together vary as much as in simulations of motions that were held out. The coarse ones, which hold half the
    /// variance, stay, and no variance is more than doubled.
    pub(crate) fn fine_gains(&self) -> Vec<f64> {
        let variances: Vec<f64> = self.std_devs.iter().map(|sd| sd * sd).collect();
        let coarse = enough(&self.std_devs, 0.5 * self.total_variance, 0);
        let fine: f64 = variances[coarse..].iter().sum();
        let lost = self.held_out_loss * self.total_variance;
        let gain = if fine > 0.0 { (1.0 + (lost / fine).min(1.0)).sqrt() } else { 1.0 };
        (0..variances.len()).map(|k| if k < coarse { 1.0 } else { gain }).collect()
    }

    /// Writes Q of all faces for given ψ as a flat row.
    pub(crate) fn expand(&self, wrinkles: &[f64], scratch: &mut BasisScratch, out: &mut [f32]) {
        self.basis.expand(&self.mean, wrinkles, scratch, out);
    }

    /// Q of one frame on the mean body as a flat row.
    pub(crate) fn row_of(&self, garment: &Garment, pose: &Pose, vertices: &[Vec3]) -> Vec<f32> {
        self.frames.flatten(&wrinkle_gradients(garment, &self.blend, pose, vertices))
    }

    /// Writes the composed gradients `A = R Q D` of all faces. `shape_deformations` are D as
    /// [`TangentFrames::into_tangents`] gives them, `wrinkles` a flat row.
    pub(crate) fn compose(&self, pose: &Pose, shape_deformations: &[Mat3], wrinkles: &[f32], out: &mut [Mat3]) {
        let turns = Turns::new(&self.blend, pose);
        let faces = out.iter_mut().zip(shape_deformations).zip(wrinkles.as_chunks::<PER_FACE>().0).enumerate();
        for (face, ((out, shape_deformation), wrinkle)) in faces {
            *out = turns.rotation(face) * (gradient_of_tangents(wrinkle) * *shape_deformation);
        }
    }
}

/// See [`WrinkleModel::held_out_loss`]. 0 where there are too few sequences to hold any out.
fn held_out_loss([kept, held_out]: [Vec<Vec<f32>>; 2], weights: &[f32], count: usize) -> Result<f64, GarmentError> {
    if kept.len() < 2 || held_out.is_empty() {
        return Ok(0.0);
    }
    let kept: Vec<&[f32]> = kept.iter().map(Vec::as_slice).collect();
    let pca = Pca::fit_weighted(&kept, weights, count).map_err(GarmentError::solve("PCA of wrinkles"))?;
    let parts: Vec<[f64; 2]> = held_out
        .par_iter()
        .map(|row| {
            let weight = |at: usize| weights.get(at).map_or(1.0, |&weight| f64::from(weight));
            let squares = row.iter().zip(&pca.mean).map(|(x, mean)| (f64::from(*x) - f64::from(*mean)).powi(2));
            let all: f64 = squares.enumerate().map(|(at, square)| weight(at) * square).sum();
            [all, pca.project(row).iter().map(|value| value * value).sum()]
        })
        .collect();
    let [all, found] = [0, 1].map(|of| parts.iter().map(|part| part[of]).sum::<f64>());
    Ok(if all > 0.0 { (1.0 - found / all).clamp(0.0, 1.0) } else { 0.0 })
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

/// Q of each face of one frame on the mean body, whose D is the identity.
///
/// DRAPE eq. 2 is `A = Q R D` in the world. Left so, the same wrinkle has other numbers for every heading of the body, and
/// a garment learned from people who walk towards +Z is wrong on those who walk towards +X. So Q is written in the frame
/// that turns with the face, in the order of SCAPE, `A = R Q D`: sleeves keep their wrinkles as arms swing.
pub fn wrinkle_gradients(garment: &Garment, blend: &RotationBlend, pose: &Pose, vertices: &[Vec3]) -> Vec<Mat3> {
    let turns = Turns::new(blend, pose);
    let gradients = deformation_gradients(&garment.topology, &garment.template, vertices);
    gradients.iter().enumerate().map(|(face, gradient)| turns.rotation(face).transpose() * *gradient).collect()
}
