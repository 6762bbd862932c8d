//! Keeps a solved body from passing through itself where soft parts meet.

use std::collections::BTreeSet;

use modiste_core::Vec3;

use super::quality::mesh_quality;
use crate::makehuman::BODY_VERTEX_COUNT;
use crate::{MakeHumanModel, Part};

/// Distance from the middle plane (m) within which thighs and buttocks press against each other.
const PRESSING: f64 = 0.003;

/// Rings of vertices around a crossing that are smoothed.
const RINGS: usize = 3;

/// Rounds of smoothing before a fold is given up.
const ROUNDS: usize = 60;

/// Presses thighs and buttocks flat against the middle plane instead of through each other, then smooths skin folds
/// (below breasts and belly) until no face crosses another. Returns whether none does.
pub fn untangle(model: &MakeHumanModel, points: &mut [Vec3]) -> bool {
    press_sides(model, points);
    let vertices = &mut points[..BODY_VERTEX_COUNT];
    for _ in 0..ROUNDS {
        let quality = mesh_quality(model.topology(), model.face_parts(), vertices);
        if quality.crossings.is_empty() {
            return true;
        }
        let faces = model.topology().faces();
        let mut region: BTreeSet<u32> =
            quality.crossings.iter().flatten().flat_map(|&face| faces[face as usize]).collect();
        for _ in 0..RINGS {
            let ring: Vec<u32> =
                region.iter().flat_map(|&vertex| model.topology().neighbours(vertex as usize)).copied().collect();
            region.extend(ring);
        }
        smooth(model, vertices, &region);
    }
    false
}

/// `x' = m exp(x/m - 1)` for `x < m` on the left, its mirror image on the right: joins `x' = x` smoothly at `m`, keeps
/// the order of the vertices and never reaches the middle plane.
fn press_sides(model: &MakeHumanModel, points: &mut [Vec3]) {
    for (vertex, point) in points[..BODY_VERTEX_COUNT].iter_mut().enumerate() {
        let pressed = matches!(model.vertex_parts()[vertex], Part::Pelvis | Part::LeftThigh | Part::RightThigh);
        let side = model.side(vertex);
        let outwards = side * point.x;
        if pressed && side != 0.0 && outwards < PRESSING {
            point.x = side * PRESSING * (outwards / PRESSING - 1.0).exp();
        }
    }
}

/// One step of Laplacian smoothing of the region.
fn smooth(model: &MakeHumanModel, vertices: &mut [Vec3], region: &BTreeSet<u32>) {
    let moved: Vec<Vec3> = region
        .iter()
        .map(|&vertex| {
            let neighbours = model.topology().neighbours(vertex as usize);
            let mean = neighbours.iter().map(|&other| vertices[other as usize]).sum::<Vec3>() / neighbours.len() as f64;
            0.5 * (vertices[vertex as usize] + mean)
        })
        .collect();
    for (&vertex, place) in region.iter().zip(moved) {
        vertices[vertex as usize] = place;
    }
}

#[cfg(test)]
mod tests {
    use modiste_core::Vec3;

    use super::untangle;
    use crate::makehuman::tests::model;
    use crate::population::mesh_quality;
    use crate::{Gender, Part};

    #[test]
    fn thighs_that_overlap_are_pressed_flat_and_a_clean_body_hardly_moves() {
        let Some(model) = model(Gender::Male) else { return };
        let mut values = model.default_parameters().0;
        let clean = |points: &[Vec3]| mesh_quality(model.topology(), model.face_parts(), &points[..13_380]).is_clean();
        let mut points = model.points(&values);
        model.normalise_pose(&mut points);
        let before = points.clone();
        assert!(clean(&points) && untangle(model, &mut points));
        let worst = before.iter().zip(&points).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        assert!(worst < 0.002, "moved {worst}");

        values[model.parameter_index("weight").expect("known")] = 1.0;
        let mut heavy = model.points(&values);
        model.normalise_pose(&mut heavy);
        for (point, part) in heavy.iter_mut().zip(model.vertex_parts()) {
            let inwards = match part {
                Part::LeftThigh => -0.04,
                Part::RightThigh => 0.04,
                _ => 0.0,
            };
            // Only near the crotch, so that the knees stay where they are.
            point.x += inwards * (1.0 - ((point.y - 0.75) / 0.15).powi(2)).max(0.0);
        }
        assert!(!clean(&heavy));
        assert!(untangle(model, &mut heavy) && clean(&heavy));
    }
}
