//! Where the joints lie in a body, as weighted means of its vertices.

use modiste_core::{Matrix, SolveError, Vec3, ridge};

use super::skin::SkinWeights;
use crate::Part;

/// Most vertices that a joint is computed from.
const MOST_VERTICES: usize = 90;

/// Weight of the squared departure from equal weights, against the mean squared distance of the vertices.
const RIDGE: f64 = 1e-4;

/// Weights of vertices, summing to one, whose mean is each part's joint, learned from bodies with known joints.
///
/// Only vertices near the joint that its part or its parent moves are used. The weights are those nearest to equal ones
/// that explain the known joints (ridge regression of the joint's offset from the vertices' mean).
pub(crate) fn fit_joint_regressor(
    bodies: &[Vec<Vec3>],
    joints: &[[Vec3; Part::COUNT]],
    template: &[Vec3],
    template_joints: &[Vec3; Part::COUNT],
    skin_weights: &SkinWeights,
) -> Result<Vec<Vec<(u32, f32)>>, SolveError> {
    Part::ALL
        .into_iter()
        .map(|part| fit_one(part, bodies, joints, &nearby(part, template_joints[part.index()], template, skin_weights)))
        .collect()
}

/// Vertices around a joint: moved by its part or parent (by any part if there are none), and not much further away than
/// the nearest.
fn nearby(part: Part, joint: Vec3, template: &[Vec3], skin_weights: &SkinWeights) -> Vec<u32> {
    let belongs = |weights: &[(Part, f64)]| {
        let own: f64 = weights.iter().filter(|(p, _)| *p == part || Some(*p) == part.parent()).map(|(_, w)| w).sum();
        own > 0.5
    };
    let any = !skin_weights.iter().any(|weights| belongs(weights));
    let mut around: Vec<(f64, u32)> = (0u32..)
        .zip(template.iter().zip(skin_weights))
        .filter(|(_, (_, weights))| any || belongs(weights))
        .map(|(vertex, (x, _))| (x.distance(joint), vertex))
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let reach = around.first().map_or(0.0, |nearest| (1.6 * nearest.0).max(0.04));
    let within: Vec<u32> =
        around.iter().filter(|(distance, _)| *distance <= reach).map(|&(_, vertex)| vertex).collect();
    let step = within.len().div_ceil(MOST_VERTICES).max(1);
    within.into_iter().step_by(step).collect()
}

fn fit_one(
    part: Part,
    bodies: &[Vec<Vec3>],
    joints: &[[Vec3; Part::COUNT]],
    vertices: &[u32],
) -> Result<Vec<(u32, f32)>, SolveError> {
    let count = vertices.len();
    let mean_of = |body: &[Vec3]| vertices.iter().map(|&v| body[v as usize]).sum::<Vec3>() / count as f64;
    let rows = 3 * bodies.len();
    let centres: Vec<Vec3> = bodies.iter().map(|body| mean_of(body)).collect();
    let offset = |row: usize, x: Vec3| (x - centres[row / 3])[row % 3];
    let x = Matrix::from_fn(rows, count, |row, column| offset(row, bodies[row / 3][vertices[column] as usize]));
    let y = Matrix::from_fn(rows, 1, |row, _| offset(row, joints[row / 3][part.index()]));
    let spread = x.frobenius_norm().powi(2) / count as f64;
    // One vertex is its own mean: there is nothing to learn, and any positive weight says so.
    let solution = ridge(&x, &y, (RIDGE * spread).max(f64::MIN_POSITIVE.sqrt()))?;
    let rest = (1.0 - (0..count).map(|i| solution[(i, 0)]).sum::<f64>()) / count as f64;
    Ok(vertices.iter().enumerate().map(|(i, &vertex)| (vertex, (solution[(i, 0)] + rest) as f32)).collect())
}
