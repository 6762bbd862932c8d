//! How well the garment shape of an unseen body is predicted (DRAPE fig. 13).

use modiste_core::{Mat3, Matrix, Vec3, centroid, symmetric_eigen};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::gradient::{TangentFrames, area_weights};
use super::shape::{ShapeOptions, Wearers, anchor_offsets, apply_regression, shape_gradients};
use super::training_set::{ShapeSample, TrainingSet};
use crate::GarmentError;
use crate::refine::anchors;

/// How predicted and true garment are brought together before distances are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Placement {
    /// By the translation that brings their centroids together: the error of form alone.
    Centroid,
    /// As at run time: anchors of the predicted garment at the predicted offset from those of the body.
    Anchors,
}

/// Errors of the garment on bodies that were left out of training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LeaveOneOut {
    /// Numbers of body shape coefficients that were tried.
    pub body_counts: Vec<usize>,
    /// Number of garment shape coefficients.
    pub garment_count: usize,
    /// Mean distance (m) between predicted and true vertices, one per entry of `body_counts`.
    pub mean_error: Vec<f64>,
    /// The same for the worst body (m).
    pub worst_error: Vec<f64>,
    /// Mean distance (m) if φ were known: the left-out garment projected on the other garments' components.
    pub projection_error: f64,
    /// Mean distance (m) of the prediction that ignores the body: the mean garment.
    pub mean_garment_error: f64,
}

/// For each body and each number of β: trains on the others, predicts the garment, measures its distance. The ease of a garment
/// that has one is known beside them.
///
/// No mesh is reconstructed. The principal components are combinations of the training gradients, and eq. 3 is linear,
/// with each training mesh for the solution at its own gradients; so the predicted mesh is the same combination of the
/// training meshes. Its weights come from the Gram matrix of the gradients.
///
/// # Errors
/// Fewer than three samples, or a solve that fails.
pub fn leave_one_out(
    set: &TrainingSet,
    options: &ShapeOptions,
    body_counts: &[usize],
    placement: Placement,
) -> Result<LeaveOneOut, GarmentError> {
    let samples = set.shapes.len();
    if samples < 3 {
        return Err(GarmentError::data("shape training set", "at least 3 bodies", samples));
    }
    let gram = gram(set, options.area_weighted);
    let folds: Vec<Fold> = (0..samples)
        .into_par_iter()
        .map(|left_out| fold(set, options, body_counts, placement, &gram, left_out))
        .collect::<Result<_, _>>()?;
    let mean = |of: &dyn Fn(&Fold) -> f64| folds.iter().map(of).sum::<f64>() / samples as f64;
    let worst = |of: &dyn Fn(&Fold) -> f64| folds.iter().map(of).fold(0.0, f64::max);
    Ok(LeaveOneOut {
        body_counts: body_counts.to_vec(),
        garment_count: options.count,
        mean_error: (0..body_counts.len()).map(|at| mean(&|fold| fold.predicted[at])).collect(),
        worst_error: (0..body_counts.len()).map(|at| worst(&|fold| fold.predicted[at])).collect(),
        projection_error: mean(&|fold| fold.projected),
        mean_garment_error: mean(&|fold| fold.mean_garment),
    })
}

/// Errors on one left-out body (m).
struct Fold {
    predicted: Vec<f64>,
    projected: f64,
    mean_garment: f64,
}

/// Inner products of all samples' gradients less the identity's, which keeps them small.
fn gram(set: &TrainingSet, area_weighted: bool) -> Matrix {
    let mut rows = shape_gradients(&set.garment, &set.shapes);
    let weights = if area_weighted { area_weights(&set.garment.topology, &set.garment.template) } else { Vec::new() };
    let frames = TangentFrames::new(&set.garment.topology, &set.garment.template);
    let identity = frames.flatten(&vec![Mat3::IDENTITY; set.garment.topology.face_count()]);
    for row in &mut rows {
        for (value, identity) in row.iter_mut().zip(&identity) {
            *value -= identity;
        }
        for (value, weight) in row.iter_mut().zip(&weights) {
            *value *= weight.sqrt();
        }
    }
    let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(&a, &b)| f64::from(a) * f64::from(b)).sum::<f64>();
    let count = rows.len();
    let lower: Vec<Vec<f64>> =
        (0..count).into_par_iter().map(|i| (0..=i).map(|j| dot(&rows[i], &rows[j])).collect()).collect();
    Matrix::from_fn(count, count, |i, j| lower[i.max(j)][i.min(j)])
}

fn fold(
    set: &TrainingSet,
    options: &ShapeOptions,
    body_counts: &[usize],
    placement: Placement,
    gram: &Matrix,
    left_out: usize,
) -> Result<Fold, GarmentError> {
    let kept: Vec<usize> = (0..set.shapes.len()).filter(|&sample| sample != left_out).collect();
    let n = kept.len();
    let row_mean: Vec<f64> = kept.iter().map(|&i| kept.iter().map(|&j| gram[(i, j)]).sum::<f64>() / n as f64).collect();
    let grand_mean = row_mean.iter().sum::<f64>() / n as f64;
    let centred = Matrix::from_fn(n, n, |i, j| gram[(kept[i], kept[j])] - row_mean[i] - row_mean[j] + grand_mean);
    let (values, vectors) = symmetric_eigen(&centred).map_err(GarmentError::solve("PCA of shapes"))?;
    let count = values.iter().take(options.count).take_while(|&&value| value > 1e-10 * values[0]).count();
    let coefficients = Matrix::from_fn(n, count, |i, k| vectors[(i, k)] * values[k].sqrt());
    let bodies: Vec<&ShapeSample> = kept.iter().map(|&sample| &set.shapes[sample]).collect();
    let offsets = anchor_offsets(&set.garment, &bodies);
    let predict = |targets: &Matrix, body_count: usize| -> Result<Vec<f64>, GarmentError> {
        let wearers = Wearers::new(&bodies, body_count);
        let regression = wearers.regress(targets, options.ridge)?;
        Ok(apply_regression(&regression, &wearers.of(&set.shapes[left_out], body_count)))
    };
    let offset = |body_count: usize| -> Result<Vec3, GarmentError> {
        let offset = predict(&offsets, body_count)?;
        Ok(Vec3::new(offset[0], offset[1], offset[2]))
    };
    let error = |garment_shape: &[f64], offset: Vec3| {
        let weights: Vec<f64> = (0..n)
            .map(|i| {
                let along: f64 =
                    garment_shape.iter().enumerate().map(|(k, c)| c * vectors[(i, k)] / values[k].sqrt()).sum();
                1.0 / n as f64 + along
            })
            .collect();
        distance(set, &kept, &weights, left_out, (placement, offset))
    };
    // Inner products of the left-out gradients with the components, from those with the samples.
    let left_out_mean = kept.iter().map(|&j| gram[(left_out, j)]).sum::<f64>() / n as f64;
    let projected: Vec<f64> = (0..count)
        .map(|k| {
            let along: f64 =
                (0..n).map(|i| vectors[(i, k)] * (gram[(left_out, kept[i])] - left_out_mean - row_mean[i])).sum();
            along / values[k].sqrt()
        })
        .collect();
    let predicted = body_counts
        .iter()
        .map(|&body_count| Ok(error(&predict(&coefficients, body_count)?, offset(body_count)?)))
        .collect::<Result<_, GarmentError>>()?;
    let best = offset(options.body_count)?;
    Ok(Fold { predicted, projected: error(&projected, best), mean_garment: error(&[], offset(0)?) })
}

/// Mean distance (m) of the left-out garment from a combination of the others.
fn distance(
    set: &TrainingSet,
    kept: &[usize],
    weights: &[f64],
    left_out: usize,
    (placement, offset): (Placement, Vec3),
) -> f64 {
    let truth = &set.shapes[left_out].vertices;
    let mut predicted = vec![Vec3::ZERO; truth.len()];
    for (&sample, &weight) in kept.iter().zip(weights) {
        for (sum, vertex) in predicted.iter_mut().zip(&set.shapes[sample].vertices) {
            *sum += weight * *vertex;
        }
    }
    let shift = match placement {
        Placement::Centroid => centroid(truth) - centroid(&predicted),
        Placement::Anchors => {
            offset - anchors::offset(&set.garment.anchors, &predicted, &set.shapes[left_out].body_anchors)
        }
    };
    truth.iter().zip(&predicted).map(|(truth, predicted)| truth.distance(*predicted + shift)).sum::<f64>()
        / truth.len() as f64
}
