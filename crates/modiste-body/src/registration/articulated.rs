//! First stage: parameters and part rotations of the artist-made body, fitted point to plane.

use modiste_core::{Mat3, Matrix, Quat, SolveError, Vec3, solve_spd, vertex_normals};

use super::Target;
use crate::makehuman::{BODY_VERTEX_COUNT, joints_of, skin};
use crate::population::{BodySpace, SoftDirections};
use crate::{MakeHumanModel, Part};

/// Our body in their pose and proportions.
pub(super) struct Articulated {
    pub(super) vertices: Vec<Vec3>,
    /// Per vertex, from our template pose to theirs.
    pub(super) rotations: Vec<Mat3>,
}

const ITERATIONS: usize = 24;

/// How far (m) a corresponding point may lie at the first and at the last iteration.
const REACH: [f64; 2] = [0.12, 0.03];

/// Standard deviation (m) of the distance of one vertex, against the priors: large, because neighbouring vertices say
/// the same.
const NOISE: f64 = 0.1;

/// Standard deviation of a part's rotation against its parent (rad).
const TURN: f64 = 0.3;

/// The unknowns: parameters of the body, rotations of the parts, translation.
struct State {
    values: Vec<f64>,
    rotations: [Mat3; Part::COUNT],
    translation: Vec3,
}

/// Gauss-Newton over closest points.
pub(super) fn fit(model: &MakeHumanModel, target: &Target<'_>) -> Result<Articulated, SolveError> {
    let none = SoftDirections::default();
    let space = BodySpace::new(model, &none);
    let mut state = State {
        values: model.default_parameters().0,
        rotations: [Mat3::IDENTITY; Part::COUNT],
        translation: Vec3::ZERO,
    };
    state.translation = start_translation(&space.points(&state.values), target.vertices);
    for iteration in 0..ITERATIONS {
        let along = iteration as f64 / (ITERATIONS - 1) as f64;
        step(&space, target, &mut state, REACH[0] + along * (REACH[1] - REACH[0]))?;
    }
    let points = posed(&space, &state);
    let rotations = model
        .skin_weights()
        .iter()
        .map(|weights| {
            let blend: Mat3 =
                weights.iter().fold(Mat3::ZERO, |sum, &(part, weight)| sum + weight * state.rotations[part.index()]);
            nearest_rotation(blend)
        })
        .collect();
    Ok(Articulated { vertices: points[..BODY_VERTEX_COUNT].to_vec(), rotations })
}

fn start_translation(points: &[Vec3], theirs: &[Vec3]) -> Vec3 {
    let bounds = |points: &[Vec3]| {
        points.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)))
    };
    let ((low, high), (their_low, their_high)) = (bounds(points), bounds(theirs));
    let middle = 0.5 * (their_low + their_high - low - high);
    Vec3::new(middle.x, their_low.y - low.y, middle.z)
}

fn posed(space: &BodySpace<'_>, state: &State) -> Vec<Vec3> {
    let mut points = space.points(&state.values);
    skin(&mut points, space.model().skin_weights(), &state.rotations);
    for point in &mut points {
        *point += state.translation;
    }
    points
}

/// A rotation near a blend of rotations that differ little.
fn nearest_rotation(blend: Mat3) -> Mat3 {
    let x = blend.x_axis.normalize_or(Vec3::X);
    let y = (blend.y_axis - x * x.dot(blend.y_axis)).normalize_or(Vec3::Y);
    Mat3::from_cols(x, y, x.cross(y))
}

/// One Gauss-Newton step on `Σ (n · (x - c))² / NOISE² + priors`.
fn step(space: &BodySpace<'_>, target: &Target<'_>, state: &mut State, reach: f64) -> Result<(), SolveError> {
    let model = space.model();
    let points = posed(space, state);
    let joints = joints_of(&points);
    let normals = vertex_normals(model.topology(), &points[..BODY_VERTEX_COUNT]);
    let solved: Vec<usize> = (0..state.values.len()).filter(|&index| space.unknowns()[index].reach > 0.0).collect();
    let fields = parameter_fields(space, &state.values, &solved);
    let first_turn = solved.len();
    let first_shift = first_turn + 3 * Part::COUNT;
    let size = first_shift + 3;
    let mut normal_matrix = Matrix::zeros(size, size);
    let mut rhs = Matrix::zeros(size, 1);
    let weight = 1.0 / (NOISE * NOISE);
    let mut row = vec![0.0; size];
    for vertex in 0..BODY_VERTEX_COUNT {
        // The skull turns the head as theirs; fingers would only mislead.
        if matches!(model.vertex_parts()[vertex], Part::LeftHand | Part::RightHand) {
            continue;
        }
        let Some(found) = target.closest(points[vertex], normals[vertex], reach, 0.6) else { continue };
        let n = found.normal;
        row.fill(0.0);
        for (slot, field) in row.iter_mut().zip(&fields) {
            *slot = n.dot(field[vertex]);
        }
        for &(part, share) in &model.skin_weights()[vertex] {
            // A turn of an ancestor carries its whole subtree.
            let mut ancestor = Some(part);
            while let Some(own) = ancestor {
                let moment = (points[vertex] - joints[own.index()]).cross(n);
                for axis in 0..3 {
                    row[first_turn + 3 * own.index() + axis] += share * moment[axis];
                }
                ancestor = own.parent();
            }
        }
        for axis in 0..3 {
            row[first_shift + axis] = n[axis];
        }
        let residual = n.dot(points[vertex] - found.point);
        for i in 0..size {
            if row[i] != 0.0 {
                rhs[(i, 0)] -= weight * row[i] * residual;
                for j in 0..=i {
                    normal_matrix[(i, j)] += weight * row[i] * row[j];
                }
            }
        }
    }
    add_priors(space, state, &solved, &mut normal_matrix, &mut rhs);
    for i in 0..size {
        for j in 0..i {
            normal_matrix[(j, i)] = normal_matrix[(i, j)];
        }
    }
    let solution = solve_spd(&normal_matrix, &rhs)?;
    for (slot, &index) in solved.iter().enumerate() {
        let unknown = &space.unknowns()[index];
        state.values[index] = (state.values[index] + solution[(slot, 0)]).clamp(unknown.lowest, unknown.highest);
    }
    let triple = |first: usize| Vec3::new(solution[(first, 0)], solution[(first + 1, 0)], solution[(first + 2, 0)]);
    turn(&mut state.rotations, |part| triple(first_turn + 3 * part.index()));
    state.translation += triple(first_shift);
    Ok(())
}

/// Derivative of the points by each solved parameter (m), in the template pose.
fn parameter_fields(space: &BodySpace<'_>, values: &[f64], solved: &[usize]) -> Vec<Vec<Vec3>> {
    let model = space.model();
    let mut fields = vec![vec![Vec3::ZERO; BODY_VERTEX_COUNT + Part::COUNT]; solved.len()];
    model.visit_derivatives(values, |offsets, derivatives| {
        for &(parameter, derivative) in derivatives {
            if let Ok(slot) = solved.binary_search(&parameter) {
                offsets.add_to(derivative, &mut fields[slot]);
            }
        }
    });
    fields
}

fn add_priors(space: &BodySpace<'_>, state: &State, solved: &[usize], matrix: &mut Matrix, rhs: &mut Matrix) {
    for (slot, &index) in solved.iter().enumerate() {
        let unknown = &space.unknowns()[index];
        let stiffness = unknown.reach.powi(-2);
        matrix[(slot, slot)] += stiffness;
        rhs[(slot, 0)] -= stiffness * (state.values[index] - unknown.mean);
    }
    for part in Part::ALL {
        for axis in 0..3 {
            // On the step alone: enough to keep parts that no point holds, such as the hands.
            let slot = solved.len() + 3 * part.index() + axis;
            matrix[(slot, slot)] += TURN.powi(-2);
        }
    }
    for axis in 0..3 {
        let slot = solved.len() + 3 * Part::COUNT + axis;
        matrix[(slot, slot)] += 1e-6;
    }
}

/// Turns each part's subtree by the part's world rotation vector.
fn turn(rotations: &mut [Mat3; Part::COUNT], vector: impl Fn(Part) -> Vec3) {
    let mut carried = [Mat3::IDENTITY; Part::COUNT];
    for part in Part::ALL {
        let own = Mat3::from_quat(Quat::from_scaled_axis(vector(part)));
        let parent = part.parent().map_or(Mat3::IDENTITY, |parent| carried[parent.index()]);
        carried[part.index()] = parent * own;
        rotations[part.index()] = carried[part.index()] * rotations[part.index()];
    }
}
