//! How the garment changes with the shape of the body (DRAPE §4.1).

use modiste_core::{Mat3, Matrix, Pca, Vec3, deformation_gradients, ridge};

use super::basis::{BasisScratch, GradientBasis};
use super::gradient::{TangentFrames, area_weights};
use super::training_set::{Garment, ShapeSample};
use crate::GarmentError;
use crate::refine::anchors::offset;

/// How the shape model is learned.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapeOptions {
    /// Number of garment shape coefficients φ.
    pub count: usize,
    /// Number of body shape coefficients β that are used.
    pub body_count: usize,
    /// Weight of |W|² in the regression of φ on β.
    pub ridge: f64,
    /// Weighs each face by its area in the principal component analysis. The paper does not; it lets slivers count as
    /// much as the broad faces between them.
    pub area_weighted: bool,
}

impl Default for ShapeOptions {
    fn default() -> Self {
        Self { count: 30, body_count: 20, ridge: 3.0, area_weighted: false }
    }
}

/// Garment shape from body shape and ease: `D = U_d φ + μ_d`, `φ = W [β; ease; 1]`, DRAPE eq. 4 with the comfort axis that the
/// paper leaves to future work. Without an ease it is the paper's `φ = W [β; 1]`.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeModel {
    pub(crate) frames: TangentFrames,
    pub(crate) mean: Vec<f32>,
    pub(crate) basis: GradientBasis,
    pub(crate) std_devs: Vec<f64>,
    /// How many of the body shape coefficients are used.
    pub(crate) body_count: usize,
    /// Wᵀ: one row per body shape coefficient, one for the ease where there is one, and a last one for the constant; one
    /// column per φ.
    pub(crate) regression: Matrix,
    /// Like `regression`, for how far the garment's anchors lie from those of the body (m); not in the paper.
    pub(crate) offset_regression: Matrix,
    pub(crate) total_variance: f64,
}

impl ShapeModel {
    /// Learns from the garment on many bodies.
    ///
    /// # Errors
    /// Fewer than two samples, or a solve that fails.
    pub fn train(garment: &Garment, samples: &[ShapeSample], options: &ShapeOptions) -> Result<Self, GarmentError> {
        if samples.len() < 2 {
            return Err(GarmentError::data("shape training set", "at least 2 bodies", samples.len()));
        }
        let rows = shape_gradients(garment, samples);
        let rows: Vec<&[f32]> = rows.iter().map(Vec::as_slice).collect();
        let weights =
            if options.area_weighted { area_weights(&garment.topology, &garment.template) } else { Vec::new() };
        let pca = Pca::fit_weighted(&rows, &weights, options.count).map_err(GarmentError::solve("PCA of shapes"))?;
        let coefficients: Vec<Vec<f64>> = rows.iter().map(|row| pca.project(row)).collect();
        let samples: Vec<&ShapeSample> = samples.iter().collect();
        let wearers = Wearers::new(&samples, options.body_count);
        let regression = wearers.regress(&Matrix::from_rows(&coefficients), options.ridge)?;
        let offset_regression = wearers.regress(&anchor_offsets(garment, &samples), options.ridge)?;
        // Gradients of meshes: no pattern is left.
        let mesh = (garment.topology.as_ref(), garment.template.as_slice());
        let basis =
            GradientBasis::new(mesh, &pca.basis, &pca.std_devs, 0).map_err(GarmentError::solve("basis of shapes"))?;
        Ok(Self {
            frames: TangentFrames::new(&garment.topology, &garment.template),
            mean: pca.mean,
            basis,
            std_devs: pca.std_devs,
            body_count: options.body_count,
            regression,
            offset_regression,
            total_variance: pca.total_variance,
        })
    }

    /// Number of garment shape coefficients φ.
    pub fn count(&self) -> usize {
        self.basis.count()
    }

    /// Number of body shape coefficients β that are used.
    pub fn body_count(&self) -> usize {
        self.body_count
    }

    /// Whether it was learned from slim and loose cuts too, so that the ease changes the garment.
    pub fn has_ease(&self) -> bool {
        self.regression.rows > self.body_count + 1
    }

    /// Standard deviation of each φ over the training bodies.
    pub fn std_devs(&self) -> &[f64] {
        &self.std_devs
    }

    /// Part of the variance of the training gradients that the coefficients hold.
    pub fn explained_variance(&self) -> f64 {
        self.std_devs.iter().map(|sd| sd * sd).sum::<f64>() / self.total_variance
    }

    /// φ from β in standard deviations and the ease (DRAPE eq. 4); missing β are 0, further ones are ignored, and so is the
    /// ease of a garment without one.
    pub fn predict(&self, shape: &[f64], ease: f64) -> Vec<f64> {
        apply_regression(&self.regression, &self.wearer(shape, ease))
    }

    /// How far (m) the garment's anchors lie from those of the body, in the template pose.
    pub fn predict_offset(&self, shape: &[f64], ease: f64) -> Vec3 {
        let offset = apply_regression(&self.offset_regression, &self.wearer(shape, ease));
        Vec3::new(offset[0], offset[1], offset[2])
    }

    fn wearer(&self, shape: &[f64], ease: f64) -> Vec<f64> {
        wearer(shape, self.body_count, self.has_ease().then_some(ease))
    }

    /// D of each face for given φ.
    pub fn gradients(&self, garment_shape: &[f64]) -> Vec<Mat3> {
        let mut row = vec![0.0; self.mean.len()];
        self.basis.expand(&self.mean, garment_shape, &mut BasisScratch::default(), &mut row);
        self.frames.gradients(&row)
    }
}

/// D of every sample as flat rows (DRAPE eq. 1).
pub(crate) fn shape_gradients(garment: &Garment, samples: &[ShapeSample]) -> Vec<Vec<f32>> {
    let gradients =
        |sample: &ShapeSample| deformation_gradients(&garment.topology, &garment.template, &sample.vertices);
    let frames = TangentFrames::new(&garment.topology, &garment.template);
    samples.iter().map(|sample| frames.flatten(&gradients(sample))).collect()
}

/// What garment shape is regressed on, one row per sample.
pub(crate) struct Wearers {
    rows: Vec<Vec<f64>>,
    has_ease: bool,
}

/// The ease is uniform in [-1, 1]; so scaled it varies as much as a β, and the ridge weighs it alike.
const EASE_SCALE: f64 = 1.732_050_807_568_877_2;

impl Wearers {
    /// Of these samples, with this number of body shape coefficients.
    pub(crate) fn new(samples: &[&ShapeSample], body_count: usize) -> Self {
        let has_ease = samples.iter().any(|sample| sample.ease.abs() > 0.0);
        let row =
            |sample: &&ShapeSample| wearer(&sample.shape, body_count, has_ease.then_some(EASE_SCALE * sample.ease));
        Self { rows: samples.iter().map(row).collect(), has_ease }
    }

    /// Ridge regression of one row of `targets` per sample; the last row of the result is the constant.
    pub(crate) fn regress(&self, targets: &Matrix, lambda: f64) -> Result<Matrix, GarmentError> {
        let rows: Vec<&[f64]> = self.rows.iter().map(Vec::as_slice).collect();
        let width = rows.first().map_or(0, |row| row.len());
        let mut regression = regress(&rows, width, targets, lambda)?;
        if self.has_ease {
            regression.row_mut(width - 1).iter_mut().for_each(|slope| *slope *= EASE_SCALE);
        }
        Ok(regression)
    }

    /// What a sample is applied to the regression as.
    pub(crate) fn of(&self, sample: &ShapeSample, body_count: usize) -> Vec<f64> {
        wearer(&sample.shape, body_count, self.has_ease.then_some(sample.ease))
    }
}

/// The first `body_count` β, zeros where there are fewer, and the ease if the garment has one.
fn wearer(shape: &[f64], body_count: usize, ease: Option<f64>) -> Vec<f64> {
    (0..body_count).map(|at| shape.get(at).copied().unwrap_or(0.0)).chain(ease).collect()
}

/// How far the anchors of every sample lie from those of its body (m), one row each.
pub(crate) fn anchor_offsets(garment: &Garment, samples: &[&ShapeSample]) -> Matrix {
    let offset = |sample: &&ShapeSample| offset(&garment.anchors, &sample.vertices, &sample.body_anchors);
    Matrix::from_rows(&samples.iter().map(|sample| offset(sample).to_array().to_vec()).collect::<Vec<_>>())
}

/// Ridge regression of `targets` on the first `body_count` numbers of β; the constant is not penalised.
pub(crate) fn regress(
    bodies: &[&[f64]],
    body_count: usize,
    targets: &Matrix,
    lambda: f64,
) -> Result<Matrix, GarmentError> {
    let (samples, outputs) = (bodies.len(), targets.cols);
    let at = |sample: usize, column: usize| bodies[sample].get(column).copied().unwrap_or(0.0);
    let mean_of = |values: &dyn Fn(usize) -> f64| (0..samples).map(values).sum::<f64>() / samples as f64;
    let body_mean: Vec<f64> = (0..body_count).map(|column| mean_of(&|sample| at(sample, column))).collect();
    let target_mean: Vec<f64> = (0..outputs).map(|column| mean_of(&|sample| targets[(sample, column)])).collect();
    let mut regression = Matrix::zeros(body_count + 1, outputs);
    if body_count > 0 {
        let x = Matrix::from_fn(samples, body_count, |sample, column| at(sample, column) - body_mean[column]);
        let y = Matrix::from_fn(samples, outputs, |sample, column| targets[(sample, column)] - target_mean[column]);
        let slopes = ridge(&x, &y, lambda).map_err(GarmentError::solve("regression of garment shape"))?;
        for row in 0..body_count {
            regression.row_mut(row).copy_from_slice(slopes.row(row));
        }
    }
    for column in 0..outputs {
        let at_mean: f64 = (0..body_count).map(|row| body_mean[row] * regression[(row, column)]).sum();
        regression[(body_count, column)] = target_mean[column] - at_mean;
    }
    Ok(regression)
}

/// `W [β; 1]`.
pub(crate) fn apply_regression(regression: &Matrix, shape: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; regression.cols];
    apply_regression_into(regression, shape, &mut out);
    out
}

/// [`apply_regression`] without allocation.
pub(crate) fn apply_regression_into(regression: &Matrix, shape: &[f64], out: &mut [f64]) {
    let body_count = regression.rows - 1;
    out.copy_from_slice(regression.row(body_count));
    for (row, value) in shape.iter().take(body_count).enumerate() {
        for (out, slope) in out.iter_mut().zip(regression.row(row)) {
            *out += value * slope;
        }
    }
}
