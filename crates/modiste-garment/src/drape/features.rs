//! The inputs of the wrinkle dynamics: garment pose θ_c and its change z.

use modiste_body::{Part, Pose};
use modiste_core::{Mat3, Quat, Vec3};

use super::pose_kernel::PoseKernel;
use crate::GarmentError;

/// Which inputs beyond those of the paper drive the wrinkles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct InputOptions {
    /// Adds the direction of gravity seen from the pelvis, so that bending forward differs from standing. Not in the
    /// paper, whose θ_c holds no rotation of the pelvis.
    pub gravity: bool,
    /// Adds the turn of the pelvis between the two frames to z, so that spinning in place is felt. Not in the paper.
    pub pelvis_turn: bool,
    /// Adds the rotations of the parts at the pelvis (thighs below a T-shirt, abdomen above shorts), which push at hems
    /// that lie over them.
    pub neighbours: bool,
    /// Gives θ_c as rotation matrices less the identity instead of rotation vectors, in which a half turn is far from
    /// linear. Not in the paper. z is in rotation vectors either way.
    pub matrices: bool,
    /// Number of typical poses whose nearness is added to θ_c; see [`PoseKernel`]. 0 is the paper.
    pub centres: usize,
    /// Adds how far θ_c is from its mean over the last half second or so, with dynamics: cloth that slid up with an arm comes
    /// down later than the arm. Not in the paper.
    pub memory: bool,
}

/// Frames after which the mean of the past has forgotten all but 1/e of a pose.
const MEMORY_FRAMES: f64 = 18.0;

impl Default for InputOptions {
    fn default() -> Self {
        Self { gravity: true, pelvis_turn: true, neighbours: true, matrices: true, centres: 60, memory: true }
    }
}

impl InputOptions {
    /// Exactly the inputs of DRAPE eq. 5.
    pub const PAPER: Self =
        Self { gravity: false, pelvis_turn: false, neighbours: false, matrices: false, centres: 0, memory: false };
}

/// Turns poses into the inputs of DRAPE eq. 5.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseInputs {
    parts: Vec<Part>,
    options: InputOptions,
    kernel: Option<PoseKernel>,
}

impl PoseInputs {
    /// The inputs that matter to a garment: the parts that its faces follow and those between them and the pelvis.
    ///
    /// The pelvis itself is left out; its rotation is relative to the world, and the wrinkles are predicted in its frame.
    pub fn new(face_parts: &[Part], options: InputOptions) -> Self {
        let mut relevant = [false; Part::COUNT];
        for &part in face_parts {
            let mut next = Some(part);
            while let Some(part) = next {
                relevant[part.index()] = true;
                next = part.parent();
            }
        }
        if options.neighbours {
            for part in Part::ALL {
                relevant[part.index()] |= part.parent() == Some(Part::Pelvis);
            }
        }
        let parts = Part::ALL.into_iter().filter(|part| relevant[part.index()] && *part != Part::Pelvis).collect();
        Self { parts, options, kernel: None }
    }

    /// Inputs with given parts and kernel, as read from a file.
    pub(crate) fn from_parts(parts: Vec<Part>, options: InputOptions, kernel: Option<PoseKernel>) -> Self {
        Self { parts, options, kernel }
    }

    /// The inputs with the nearness to typical ones among `poses`, where the options ask for it.
    ///
    /// # Errors
    /// No poses to choose from.
    pub fn with_typical_poses<'a>(self, poses: impl Iterator<Item = &'a Pose>) -> Result<Self, GarmentError> {
        if self.options.centres == 0 {
            return Ok(self);
        }
        let rows = |pose: &Pose| {
            let mut row = vec![0.0; self.plain_count()];
            self.plain(pose, &mut row);
            row
        };
        let kernel = PoseKernel::choose(&poses.map(rows).collect::<Vec<_>>(), self.options.centres)?;
        Ok(Self { kernel: Some(kernel), ..self })
    }

    /// The kernel on typical poses, if there is one.
    pub fn kernel(&self) -> Option<&PoseKernel> {
        self.kernel.as_ref()
    }

    /// The parts whose relative rotations make θ_c.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// What was chosen.
    pub fn options(&self) -> InputOptions {
        self.options
    }

    /// Length of θ_c, gravity and kernel included.
    pub fn pose_count(&self) -> usize {
        self.plain_count() + self.kernel.as_ref().map_or(0, PoseKernel::count)
    }

    /// Length of θ_c before the kernel, which comes last.
    pub(crate) fn plain_count(&self) -> usize {
        let of_part = if self.options.matrices { 9 } else { 3 };
        of_part * self.parts.len() + 3 * usize::from(self.options.gravity)
    }

    /// Length of θ_c in rotation vectors, gravity included.
    fn angle_count(&self) -> usize {
        3 * (self.parts.len() + usize::from(self.options.gravity))
    }

    /// Length of z.
    pub fn change_count(&self) -> usize {
        self.angle_count() + 3 * (1 + usize::from(self.options.pelvis_turn))
    }

    /// Length of the memory of past poses; 0 where there is none.
    pub(crate) fn memory_count(&self) -> usize {
        if self.options.memory { self.plain_count() } else { 0 }
    }

    /// Takes the newest θ_c into the mean of the past, which begins with the first; an empty mean stays empty.
    pub(crate) fn remember(&self, theta: &[f64], is_first: bool, mean: &mut [f64]) {
        let share = if is_first { 1.0 } else { 1.0 - (-1.0 / MEMORY_FRAMES).exp() };
        for (mean, value) in mean.iter_mut().zip(theta) {
            *mean += share * (value - *mean);
        }
    }

    /// Writes θ_c: relative rotations, the direction of gravity in the pelvis less that of upright, the kernel.
    pub fn pose(&self, pose: &Pose, out: &mut [f64]) {
        let (plain, features) = out.split_at_mut(self.plain_count());
        self.plain(pose, plain);
        if let Some(kernel) = &self.kernel {
            kernel.features(plain, features);
        }
    }

    fn plain(&self, pose: &Pose, out: &mut [f64]) {
        if !self.options.matrices {
            return self.angles(pose, out);
        }
        let mut triples = out.as_chunks_mut::<3>().0.iter_mut();
        let mut put = |value: Vec3| triples.next().into_iter().for_each(|triple| *triple = value.to_array());
        for part in &self.parts {
            let turn = Mat3::from_quat(pose.rotation(*part)) - Mat3::IDENTITY;
            [turn.x_axis, turn.y_axis, turn.z_axis].into_iter().for_each(&mut put);
        }
        if self.options.gravity {
            put(gravity(pose));
        }
    }

    /// Writes θ_c with rotation vectors (radians).
    fn angles(&self, pose: &Pose, out: &mut [f64]) {
        let mut triples = out.as_chunks_mut::<3>().0.iter_mut();
        let mut put = |value: Vec3| triples.next().into_iter().for_each(|triple| *triple = value.to_array());
        for part in &self.parts {
            put(pose.rotations[part.index()]);
        }
        if self.options.gravity {
            put(gravity(pose));
        }
    }

    /// Writes `z^{j,k}` of DRAPE eq. 5 from frame k to frame j: Γ_k⁻¹(τ_j - τ_k) (m), θ_c of j less that of k, and the
    /// rotation vector of Γ_k⁻¹Γ_j where it is asked for. `scratch` is as long as θ_c.
    pub fn change(&self, later: &Pose, earlier: &Pose, scratch: &mut [f64], out: &mut [f64]) {
        let pelvis_from_world = root_rotation(earlier).inverse();
        let step = pelvis_from_world * (later.root_translation - earlier.root_translation);
        out[..3].copy_from_slice(&step.to_array());
        let count = self.angle_count();
        self.angles(later, &mut out[3..3 + count]);
        self.angles(earlier, scratch);
        for (value, before) in out[3..3 + count].iter_mut().zip(scratch.iter()) {
            *value -= before;
        }
        if self.options.pelvis_turn {
            let turn = pelvis_from_world * root_rotation(later);
            let turn = if turn.w < 0.0 { -turn } else { turn };
            out[3 + count..].copy_from_slice(&turn.to_scaled_axis().to_array());
        }
    }
}

/// The direction of gravity seen from the pelvis less that of upright.
fn gravity(pose: &Pose) -> Vec3 {
    root_rotation(pose).inverse() * Vec3::NEG_Y - Vec3::NEG_Y
}

/// Γ: from the pelvis to the world.
pub(crate) fn root_rotation(pose: &Pose) -> Quat {
    Quat::from_scaled_axis(pose.rotations[Part::Pelvis.index()])
}

#[cfg(test)]
mod tests {
    use super::{InputOptions, PoseInputs};
    use modiste_body::{Part, Pose};
    use modiste_core::{Quat, Vec3};

    fn pose(angle: f64) -> Pose {
        let mut pose = Pose::template(Vec3::new(0.3, 1.0, angle));
        for (index, rotation) in pose.rotations.iter_mut().enumerate() {
            *rotation = Vec3::new(0.1 * index as f64, angle, -0.05).clamp_length_max(1.2);
        }
        pose
    }

    fn moved(pose: &Pose, world_from_old: Quat, shift: Vec3) -> Pose {
        let mut moved = pose.clone();
        moved.root_translation = world_from_old * pose.root_translation + shift;
        moved.rotations[0] = (world_from_old * Quat::from_scaled_axis(pose.rotations[0])).to_scaled_axis();
        moved
    }

    #[test]
    fn parts_are_those_of_the_faces_and_the_way_to_the_pelvis() {
        let inputs = PoseInputs::new(&[Part::Chest, Part::LeftUpperArm], InputOptions::PAPER);
        assert_eq!(inputs.parts(), [Part::Abdomen, Part::Chest, Part::LeftShoulder, Part::LeftUpperArm]);
        let wider = PoseInputs::new(&[Part::Chest], InputOptions { neighbours: true, ..InputOptions::PAPER });
        assert!(wider.parts().contains(&Part::LeftThigh) && !wider.parts().contains(&Part::LeftShin));
    }

    #[test]
    fn heading_and_place_do_not_enter() {
        let poses: Vec<Pose> = (0..20).map(|i| pose(0.05 * f64::from(i))).collect();
        let plain = PoseInputs::new(&[Part::Chest, Part::LeftThigh], InputOptions::default());
        let inputs = plain.clone().with_typical_poses(poses.iter()).unwrap();
        assert_eq!(inputs.pose_count(), plain.pose_count() + 20, "no more centres than poses");
        let (n, m) = (inputs.pose_count(), inputs.change_count());
        let (earlier, later) = (pose(0.1), pose(0.3));
        let turn = Quat::from_rotation_y(2.1);
        let shift = Vec3::new(4.0, 0.0, -3.0);
        let run = |earlier: &Pose, later: &Pose| {
            let (mut theta, mut scratch, mut z) = (vec![0.0; n], vec![0.0; n], vec![0.0; m]);
            inputs.pose(later, &mut theta);
            inputs.change(later, earlier, &mut scratch, &mut z);
            [theta, z].concat()
        };
        let plain = run(&earlier, &later);
        let turned = run(&moved(&earlier, turn, shift), &moved(&later, turn, shift));
        for (a, b) in plain.iter().zip(&turned) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
        assert!(plain.iter().any(|value| value.abs() > 0.1));
    }
}
