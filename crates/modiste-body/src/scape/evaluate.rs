//! How well a SCAPE model describes bodies and poses that it was not trained on.

use std::sync::Arc;

use modiste_core::{Mat3, Pca, Vec3, centroid, seeded_rng};
use rayon::prelude::*;

use super::model::ScapeModel;
use super::skin::Skin;
use super::train::shape_sample;
use super::training_poses::sample_poses;
use crate::make::{Outcome, Wish, make_body};
use crate::{BodyError, Part, Pose, Quantity};

/// Far from the small seeds that a user would train with.
const HELD_OUT_SEED: u64 = 0x9e37_79b9_7f4a_7c15;

/// Distances between vertices (mm).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VertexError {
    /// Mean over vertices and meshes.
    pub mean: f64,
    /// 95th percentile over the same.
    pub p95: f64,
    /// The largest.
    pub largest: f64,
}

impl VertexError {
    /// From distances (m).
    pub fn from_distances(mut distances: Vec<f64>) -> Self {
        if distances.is_empty() {
            return Self::default();
        }
        distances.sort_by(f64::total_cmp);
        let last = distances.len() - 1;
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        Self { mean: 1e3 * mean, p95: 1e3 * distances[last * 95 / 100], largest: 1e3 * distances[last] }
    }
}

/// Error (mm) of held-out bodies in the template pose, rebuilt from the first 1, 2, … coefficients of `space`.
///
/// The coefficients are the body's projections on the components; the rebuilt mesh is moved so that the centroids agree.
///
/// # Errors
/// A body with another number of vertices than the model.
pub fn shape_errors(model: &ScapeModel, space: &Pca, held_out: &[Vec<Vec3>]) -> Result<Vec<VertexError>, BodyError> {
    let topology = model.topology();
    let width = space.dimensions();
    let to_gradients = |numbers: &[f32]| -> Vec<Mat3> {
        numbers.chunks_exact(9).map(|d| Mat3::from_cols_array(&std::array::from_fn(|i| f64::from(d[i])))).collect()
    };
    let mut mean = Vec::new();
    let gradient_width = 9 * topology.face_count();
    model.reconstruct(&to_gradients(&space.mean[..gradient_width]), &mut mean);
    let directions: Vec<Vec<Vec3>> = (0..space.count())
        .map(|k| {
            let mut direction = Vec::new();
            model.reconstruct(&to_gradients(&space.basis[k * width..][..gradient_width]), &mut direction);
            direction
        })
        .collect();
    let mut distances = vec![Vec::with_capacity(held_out.len() * mean.len()); space.count()];
    for body in held_out {
        if body.len() != mean.len() {
            return Err(BodyError::Size {
                what: "vertices of a held-out body",
                wanted: mean.len().to_string(),
                found: body.len(),
            });
        }
        let centre = centroid(body);
        let coefficients = space.project(&shape_sample(topology, model.template(), body));
        let mut rebuilt = mean.clone();
        for (k, direction) in directions.iter().enumerate() {
            for ((x, d), truth) in rebuilt.iter_mut().zip(direction).zip(body) {
                *x += *d * coefficients[k];
                distances[k].push(x.distance(*truth - centre));
            }
        }
    }
    Ok(distances.into_iter().map(VertexError::from_distances).collect())
}

/// Share of held-out bodies that [`make_body`] rebuilds within 5 mm and 0.5 kg in every one of `quantities`, with the
/// 95th percentile of each quantity's misfit (m, kg). A body that is refused counts as missed.
///
/// # Errors
/// Bodies of another topology than the project's.
pub fn make_errors(
    model: &Arc<ScapeModel>,
    held_out: &[Vec<Vec3>],
    quantities: &[Quantity],
) -> Result<(f64, Vec<f64>), BodyError> {
    let template = model.measure_template()?;
    let outcomes: Vec<Option<Vec<Outcome>>> = held_out
        .par_iter()
        .map(|body| {
            let measured = template.measure(body)?;
            let wishes: Vec<Wish> =
                quantities.iter().map(|&quantity| Wish { quantity, value: measured.get(quantity) }).collect();
            Ok(make_body(model, &wishes).ok().map(|made| made.outcomes))
        })
        .collect::<Result<_, BodyError>>()?;
    let met = |outcomes: &&Option<Vec<Outcome>>| {
        outcomes.as_ref().is_some_and(|outcomes| outcomes.iter().all(|outcome| outcome.misfit() <= 1.0))
    };
    let share = outcomes.iter().filter(met).count() as f64 / outcomes.len().max(1) as f64;
    let percentile = |index: usize| {
        let off = |outcomes: &Option<Vec<Outcome>>| {
            outcomes.as_ref().map_or(f64::INFINITY, |all| (all[index].found - all[index].wish.value).abs())
        };
        let mut misfits: Vec<f64> = outcomes.iter().map(off).collect();
        misfits.sort_by(f64::total_cmp);
        misfits.get(misfits.len() * 95 / 100).copied().unwrap_or(0.0)
    };
    Ok((share, (0..quantities.len()).map(percentile).collect()))
}

/// Random poses that no training seed makes, for an individual with these joints (m) in the template pose.
pub fn held_out_poses(rest_joints: &[Vec3; Part::COUNT], count: usize) -> Vec<Pose> {
    sample_poses(rest_joints, count, &mut seeded_rng(HELD_OUT_SEED))
}

/// Error (mm) of the mean body in poses that Q was not learned from, against the skin that it was learned from.
///
/// # Errors
/// Does not fail for a model and a skin of the same mesh.
pub fn pose_errors(model: &Arc<ScapeModel>, skin: &Skin, held_out: &[Pose]) -> Result<Vec<VertexError>, BodyError> {
    let body = model.body(&[])?;
    let mut found = Vec::new();
    Ok(held_out
        .iter()
        .map(|pose| {
            body.pose_without_contact(pose, &mut found);
            let truth = skin.pose(pose);
            VertexError::from_distances(found.iter().zip(&truth).map(|(x, y)| x.distance(*y)).collect())
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use modiste_core::Silent;

    use super::{held_out_poses, pose_errors, shape_errors};
    use crate::scape::synthetic;
    use crate::scape::train::{TrainOptions, train};

    #[test]
    fn more_coefficients_and_blended_rotations_help() {
        let bodies = synthetic::bodies();
        let options = TrainOptions { shape_count: 3, pose_count: 40, ..TrainOptions::default() };
        let blended = train(&bodies, &options, &Silent).unwrap();
        let unseen = [synthetic::tube(0.045, 1.27), synthetic::tube(0.057, 1.13)];
        let errors = shape_errors(&blended.model, &blended.shape_space, &unseen).unwrap();
        assert!(errors[0].mean > errors[1].mean);
        assert!(errors[1].mean < 1.0, "two numbers make a tube: {:?}", errors[1]);

        let plain = train(&bodies, &TrainOptions { blend_rotations: false, ..options.clone() }, &Silent).unwrap();
        let rotation_only =
            train(&bodies, &TrainOptions { learn_pose_deformation: false, ..options }, &Silent).unwrap();
        let poses = held_out_poses(&synthetic::joints(), 10);
        let mean = |trained: &crate::scape::train::Trained| {
            let errors = pose_errors(&trained.model, &trained.skin, &poses).unwrap();
            errors.iter().map(|error| error.mean).sum::<f64>() / errors.len() as f64
        };
        let (blended, plain, rotation_only) = (mean(&blended), mean(&plain), mean(&rotation_only));
        assert!(blended < plain && blended < rotation_only, "{blended} {plain} {rotation_only}");
    }
}
