//! What the coarse deformation is foretold from: the pose, where it has been, and how the body moves.

use modiste_body::{Part, Pose};
use modiste_core::Vec3;

use crate::drape::features::{InputOptions, PoseInputs, root_rotation};

/// Frames after which a mean of the past has forgotten all but 1/e of a pose. Cloth that slid up with an arm or a squat
/// comes down again with the next steps, or much later.
const HORIZONS: [f64; 3] = [4.0, 18.0, 70.0];

/// Weight of speeds and changes of speed (m a frame), so that those of a run lie as far apart as its poses.
const MOTION_WEIGHT: f64 = 10.0;

/// Turns poses into θ_c, its distance from the means of the past, and the speed of the pelvis and its change.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MotionInputs {
    pose: PoseInputs,
}

/// What of the past enters.
#[derive(Debug, Clone)]
pub(crate) struct MotionState {
    /// One mean of θ_c for each horizon.
    means: Vec<f64>,
    /// Place and speed of the pelvis in the last frame, the speed in its own frame; `None` before the first.
    pelvis: Option<[Vec3; 2]>,
}

impl MotionInputs {
    /// The inputs of a garment whose faces follow these parts.
    pub(crate) fn new(face_parts: &[Part]) -> Self {
        Self::of(PoseInputs::new(face_parts, Self::options()).parts().to_vec())
    }

    /// The inputs with given parts, as read from a file.
    pub(crate) fn of(parts: Vec<Part>) -> Self {
        Self { pose: PoseInputs::from_parts(parts, Self::options(), None) }
    }

    fn options() -> InputOptions {
        InputOptions { centres: 0, ..InputOptions::default() }
    }

    /// The parts whose relative rotations make θ_c.
    pub(crate) fn parts(&self) -> &[Part] {
        self.pose.parts()
    }

    /// Length of θ_c.
    pub(crate) fn pose_count(&self) -> usize {
        self.pose.plain_count()
    }

    /// Length of all inputs, θ_c first.
    pub(crate) fn count(&self) -> usize {
        (1 + HORIZONS.len()) * self.pose_count() + 6
    }

    /// A state before the first frame.
    pub(crate) fn start(&self) -> MotionState {
        MotionState { means: vec![0.0; HORIZONS.len() * self.pose_count()], pelvis: None }
    }

    /// Writes the inputs of the next frame; nothing is allocated.
    pub(crate) fn step(&self, state: &mut MotionState, pose: &Pose, out: &mut [f64]) {
        let count = self.pose_count();
        let (theta, rest) = out.split_at_mut(count);
        self.pose.pose(pose, theta);
        let (past, motion) = rest.split_at_mut(state.means.len());
        let is_first = state.pelvis.is_none();
        let means = state.means.chunks_exact_mut(count.max(1)).zip(past.chunks_exact_mut(count.max(1)));
        for ((means, past), horizon) in means.zip(HORIZONS) {
            let share = if is_first { 1.0 } else { 1.0 - (-1.0 / horizon).exp() };
            for ((mean, out), value) in means.iter_mut().zip(past).zip(theta.iter()) {
                *mean += share * (value - *mean);
                *out = *mean - value;
            }
        }
        let place = pose.root_translation;
        let [before, speed_before] = state.pelvis.unwrap_or([place, Vec3::ZERO]);
        let speed = root_rotation(pose).inverse() * (place - before);
        motion[..3].copy_from_slice(&(MOTION_WEIGHT * speed).to_array());
        motion[3..].copy_from_slice(&(MOTION_WEIGHT * (speed - speed_before)).to_array());
        state.pelvis = Some([place, speed]);
    }
}

#[cfg(test)]
mod tests {
    use super::MotionInputs;
    use modiste_body::{Part, Pose};
    use modiste_core::{Quat, Vec3};

    fn poses(count: usize) -> Vec<Pose> {
        let pose = |frame: usize| {
            let time = frame as f64;
            let mut pose = Pose::template(Vec3::new(0.03 * time, 1.0, 0.01 * (0.5 * time).sin()));
            pose.rotations[Part::Chest.index()] = Vec3::new((0.2 * time).sin(), 0.0, 0.1);
            pose.rotations[Part::Pelvis.index()] = Vec3::new(0.1, 0.02 * time, 0.0);
            pose
        };
        (0..count).map(pose).collect()
    }

    fn run(poses: &[Pose]) -> Vec<Vec<f64>> {
        let inputs = MotionInputs::new(&[Part::Chest]);
        let mut state = inputs.start();
        let row = |pose| {
            let mut out = vec![0.0; inputs.count()];
            inputs.step(&mut state, pose, &mut out);
            out
        };
        poses.iter().map(row).collect()
    }

    #[test]
    fn a_body_at_rest_has_no_past_and_no_speed() {
        let inputs = MotionInputs::new(&[Part::Chest]);
        let first = &run(&poses(1))[0];
        assert!(first[inputs.pose_count()..].iter().all(|&value| value == 0.0));
        let mut stopped = poses(20);
        stopped.extend(std::iter::repeat_n(stopped[19].clone(), 1500));
        let last = run(&stopped).pop().unwrap();
        assert!(last[inputs.pose_count()..].iter().all(|value| value.abs() < 1e-6));
        assert!(run(&stopped)[25][inputs.pose_count()..].iter().any(|value| value.abs() > 0.05), "it remembers");
    }

    #[test]
    fn heading_and_place_do_not_enter() {
        let plain = poses(30);
        let (turn, shift) = (Quat::from_rotation_y(1.3), Vec3::new(4.0, 0.0, -2.0));
        let moved: Vec<Pose> = plain
            .iter()
            .map(|pose| {
                let mut moved = pose.clone();
                moved.root_translation = turn * pose.root_translation + shift;
                moved.rotations[0] = (turn * Quat::from_scaled_axis(pose.rotations[0])).to_scaled_axis();
                moved
            })
            .collect();
        for (a, b) in run(&plain).iter().flatten().zip(run(&moved).iter().flatten()) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
}
