//! Feet on the floor.

use modiste_core::Vec3;
use rayon::prelude::*;

use super::filter::smooth_scalars;
use crate::{Body, Motion};

/// A body this near to the floor (m) stands on it; higher, it is in the air.
const STANDING: f64 = 0.025;

/// Share of the frames that may lie lower than what is taken for the floor: feet that a capture sank into it.
const SUNKEN: f64 = 0.1;

/// Frequency (Hz) up to which the correction follows the feet.
const FOLLOWS: f64 = 3.0;

/// Moves every frame up or down so that the lowest vertex of the posed body touches the floor (y = 0), but for jumps.
///
/// The floor of the capture is the height that the lowest vertex takes most often at the bottom of its range. Frames near
/// it are put on the floor exactly; between them, in the air, the correction is interpolated, so heights of jumps stay.
/// No vertex ends below the floor.
pub fn place_on_floor(motion: &mut Motion, body: &Body) {
    let lowest: Vec<f64> = motion
        .frames
        .par_iter()
        .map_init(Vec::new, |vertices: &mut Vec<Vec3>, pose| {
            body.pose_without_contact(pose, vertices);
            vertices.iter().map(|x| x.y).fold(f64::INFINITY, f64::min)
        })
        .collect();
    for (pose, lift) in motion.frames.iter_mut().zip(floor_correction(&lowest, motion.fps)) {
        pose.root_translation.y += lift;
    }
}

/// How much to lift each frame (m), given its lowest height.
fn floor_correction(lowest: &[f64], fps: f64) -> Vec<f64> {
    if lowest.is_empty() {
        return Vec::new();
    }
    let mut sorted = lowest.to_vec();
    sorted.sort_by(f64::total_cmp);
    let floor = sorted[((sorted.len() - 1) as f64 * SUNKEN) as usize];
    let standing: Vec<usize> = (0..lowest.len()).filter(|&frame| lowest[frame] - floor < STANDING).collect();
    let wanted = interpolated(lowest, &standing);
    let mut lift = smooth_scalars(&wanted, FOLLOWS, fps);
    // Smoothing lets the feet sink a little where they land; raise smoothly first, then to the floor exactly.
    let sunk: Vec<f64> = lowest.iter().zip(&lift).map(|(low, lift)| (-low - lift).max(0.0)).collect();
    let widened: Vec<f64> = (0..sunk.len())
        .map(|frame| sunk[frame.saturating_sub(2)..(frame + 3).min(sunk.len())].iter().copied().fold(0.0, f64::max))
        .collect();
    for ((lift, more), low) in lift.iter_mut().zip(smooth_scalars(&widened, FOLLOWS, fps)).zip(lowest) {
        *lift = (*lift + more).max(-low);
    }
    lift
}

/// `-lowest` at the standing frames, linear between them, constant outside.
fn interpolated(lowest: &[f64], standing: &[usize]) -> Vec<f64> {
    let mut wanted = vec![0.0; lowest.len()];
    let mut next = 0;
    for (frame, place) in wanted.iter_mut().enumerate() {
        while next < standing.len() && standing[next] < frame {
            next += 1;
        }
        let after = standing.get(next).copied();
        let before = next.checked_sub(1).map(|index| standing[index]);
        *place = match (before, after) {
            (_, Some(after)) if after == frame => -lowest[frame],
            (Some(before), Some(after)) => {
                let t = (frame - before) as f64 / (after - before) as f64;
                -(lowest[before] * (1.0 - t) + lowest[after] * t)
            }
            (Some(only), None) | (None, Some(only)) => -lowest[only],
            (None, None) => 0.0,
        };
    }
    wanted
}

#[cfg(test)]
mod tests {
    use super::{floor_correction, place_on_floor};
    use crate::Motion;
    use crate::motion::test_body;

    #[test]
    fn standing_is_corrected_and_a_jump_is_kept() {
        // Sunk by 7 cm with a sway of 1 cm; a jump 30 cm high in the middle.
        let lowest: Vec<f64> = (0..120)
            .map(|frame| {
                let sway = -0.07 + 0.01 * (f64::from(frame) * 0.05).sin();
                let air = (f64::from(frame) - 50.0) / 20.0;
                if (0.0..=1.0).contains(&air) { sway + 4.0 * 0.3 * air * (1.0 - air) } else { sway }
            })
            .collect();
        let lift = floor_correction(&lowest, 30.0);
        let height = |frame: usize| lowest[frame] + lift[frame];
        assert!((0..120).all(|frame| height(frame) >= -1e-12));
        assert!((0..45).chain(76..120).all(|frame| height(frame) < 5e-3));
        assert!((height(60) - 0.3).abs() < 0.02, "{}", height(60));
    }

    #[test]
    fn the_lowest_vertex_of_the_mesh_touches_the_floor() {
        let body = test_body::body();
        let mut pose = body.template_pose();
        pose.root_translation.y += 0.4;
        let mut motion = Motion { fps: 30.0, frames: vec![pose; 5] };
        place_on_floor(&mut motion, &body);
        let mut vertices = Vec::new();
        for pose in &motion.frames {
            body.pose_without_contact(pose, &mut vertices);
            let lowest = vertices.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
            assert!(lowest.abs() < 1e-9);
        }
    }
}
