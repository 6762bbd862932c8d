//! How the garment changes with the shape of the body (DRAPE §4.1).

use modiste_core::{Mat3, Matrix, Pca, QuantisedBasis, Vec3, deformation_gradients, ridge};

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

/// Garment shape from body shape: `D = U_d φ + μ_d`, `φ = W [β; 1]` (DRAPE eq. 4).
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeModel {
    pub(crate) frames: TangentFrames,
    pub(crate) mean: Vec<f32>,
    pub(crate) basis: QuantisedBasis<i8>,
    pub(crate) std_devs: Vec<f64>,
    /// Wᵀ: one row per body shape coefficient and a last one for the constant, one column per φ.
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
        let bodies: Vec<&[f64]> = samples.iter().map(|sample| sample.shape.as_slice()).collect();
        let regression = regress(&bodies, options.body_count, &Matrix::from_rows(&coefficients), options.ridge)?;
        let offset_regression = regress(&bodies, options.body_count, &anchor_offsets(garment, samples), options.ridge)?;
        let basis = QuantisedBasis::from_f32(&pca.basis, pca.count(), pca.dimensions())
            .map_err(GarmentError::solve("basis of shapes"))?;
        Ok(Self {
            frames: TangentFrames::new(&garment.topology, &garment.template),
            mean: pca.mean,
            basis,
            std_devs: pca.std_devs,
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
        self.regression.rows - 1
    }

    /// Standard deviation of each φ over the training bodies.
    pub fn std_devs(&self) -> &[f64] {
        &self.std_devs
    }

    /// Part of the variance of the training gradients that the coefficients hold.
    pub fn explained_variance(&self) -> f64 {
        self.std_devs.iter().map(|sd| sd * sd).sum::<f64>() / self.total_variance
    }

    /// φ from β in standard deviations (DRAPE eq. 4); missing β are 0, further ones are ignored.
    pub fn predict(&self, shape: &[f64]) -> Vec<f64> {
        apply_regression(&self.regression, shape)
    }

    /// How far (m) the garment's anchors lie from those of the body, in the template pose.
    pub fn predict_offset(&self, shape: &[f64]) -> Vec3 {
        let offset = apply_regression(&self.offset_regression, shape);
        Vec3::new(offset[0], offset[1], offset[2])
    }

    /// D of each face for given φ.
    pub fn gradients(&self, garment_shape: &[f64]) -> Vec<Mat3> {
        let mut row = vec![0.0; self.mean.len()];
        self.basis.expand(&self.mean, garment_shape, &mut row);
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

/// How far the anchors of every sample lie from those of its body (m), one row each.
pub(crate) fn anchor_offsets(garment: &Garment, samples: &[ShapeSample]) -> Matrix {
    let offset = |sample: &ShapeSample| offset(&garment.anchors, &sample.vertices, &sample.body_anchors);
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
