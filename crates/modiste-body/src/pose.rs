//! Poses and motions: relative part rotations along the kinematic tree.

pub use modiste_core::vector_from_quat as rotation_vector;
use modiste_core::{Mat3, Quat, Vec3};

use crate::Part;

/// One pose of the body (θ, with τ and Γ of DRAPE eq. 5).
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    /// World position of the pelvis joint (m), τ.
    pub root_translation: Vec3,
    /// Rotation of each part relative to its parent, as a rotation vector (Rodrigues, radians), zero in the template
    /// pose. Entry 0, the pelvis, is relative to the world: Γ.
    pub rotations: [Vec3; Part::COUNT],
}

/// Poses at a fixed rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Frames per second.
    pub fps: f64,
    /// The poses, one per frame.
    pub frames: Vec<Pose>,
}

impl Pose {
    /// The template pose, with the pelvis joint at `root_translation` (m).
    pub fn template(root_translation: Vec3) -> Self {
        Self { root_translation, rotations: [Vec3::ZERO; Part::COUNT] }
    }

    /// The pose whose parts have these rotations from the template pose to the world.
    pub fn from_world_rotations(root_translation: Vec3, world_from_template: &[Quat; Part::COUNT]) -> Self {
        let mut pose = Self::template(root_translation);
        for part in Part::ALL {
            let world = world_from_template[part.index()];
            let local = match part.parent() {
                Some(parent) => world_from_template[parent.index()].conjugate() * world,
                None => world,
            };
            pose.set_rotation(part, local);
        }
        pose
    }

    /// Rotation of `part` relative to its parent.
    pub fn rotation(&self, part: Part) -> Quat {
        Quat::from_scaled_axis(self.rotations[part.index()])
    }

    /// Sets the rotation of `part` relative to its parent, by the shorter way round.
    pub fn set_rotation(&mut self, part: Part, rotation: Quat) {
        self.rotations[part.index()] = rotation_vector(rotation);
    }

    /// Rotation of each part from the template pose to the world (R of DRAPE eq. 2, R_p of SCAPE), as quaternions.
    pub fn world_quaternions(&self) -> [Quat; Part::COUNT] {
        let mut world = [Quat::IDENTITY; Part::COUNT];
        for part in Part::ALL {
            let local = self.rotation(part);
            world[part.index()] = match part.parent() {
                Some(parent) => world[parent.index()] * local,
                None => local,
            };
        }
        world
    }

    /// Rotation of each part from the template pose to the world (R of DRAPE eq. 2, R_p of SCAPE).
    pub fn world_rotations(&self) -> [Mat3; Part::COUNT] {
        self.world_quaternions().map(Mat3::from_quat)
    }

    /// World positions (m) of the joint of each part, by the kinematic tree over the template pose's joints.
    pub fn joints(&self, rest_joints: &[Vec3; Part::COUNT]) -> [Vec3; Part::COUNT] {
        joint_positions(rest_joints, self.root_translation, &self.world_quaternions())
    }

    /// The pose a fraction `t` of the way from `self` to `other`; each joint by the shortest arc.
    pub fn interpolate(&self, other: &Self, t: f64) -> Self {
        let mut between = Self::template(self.root_translation.lerp(other.root_translation, t));
        for part in Part::ALL {
            between.set_rotation(part, self.rotation(part).slerp(other.rotation(part), t));
        }
        between
    }

    /// The pose as it is seen in a mirror at the plane x = 0.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        let x = self.root_translation;
        let mut mirrored = Self::template(Vec3::new(-x.x, x.y, x.z));
        for part in Part::ALL {
            // A rotation vector is a pseudovector: its part along the mirror turns round.
            let turn = self.rotations[part.index()];
            mirrored.rotations[part.mirrored().index()] = Vec3::new(turn.x, -turn.y, -turn.z);
        }
        mirrored
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        self.root_translation.is_finite() && self.rotations.iter().all(|rotation| rotation.is_finite())
    }
}

impl Motion {
    /// Length in seconds, from the first frame to the last.
    pub fn duration(&self) -> f64 {
        self.frames.len().saturating_sub(1) as f64 / self.fps
    }

    /// The motion as it is seen in a mirror at the plane x = 0.
    #[must_use]
    pub fn mirrored(&self) -> Self {
        Self { fps: self.fps, frames: self.frames.iter().map(Pose::mirrored).collect() }
    }

    /// The frames of `range` alone.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        let end = range.end.min(self.frames.len());
        Self { fps: self.fps, frames: self.frames[range.start.min(end)..end].to_vec() }
    }
}

/// World positions (m) of the joints for given world rotations of the parts.
pub(crate) fn joint_positions(
    rest_joints: &[Vec3; Part::COUNT],
    root_translation: Vec3,
    world_from_template: &[Quat; Part::COUNT],
) -> [Vec3; Part::COUNT] {
    let mut joints = [root_translation; Part::COUNT];
    for part in Part::ALL {
        if let Some(parent) = part.parent() {
            let bone = rest_joints[part.index()] - rest_joints[parent.index()];
            joints[part.index()] = joints[parent.index()] + world_from_template[parent.index()] * bone;
        }
    }
    joints
}

#[cfg(test)]
mod tests {
    use modiste_core::{Quat, Vec3};

    use super::{Pose, rotation_vector};
    use crate::Part;

    fn some_pose() -> Pose {
        let mut pose = Pose::template(Vec3::new(0.1, 1.0, -0.3));
        for part in Part::ALL {
            let i = part.index() as f64;
            pose.rotations[part.index()] = Vec3::new((i * 1.3).sin(), (i * 0.7).cos(), (i * 2.1).sin()) * 0.8;
        }
        pose
    }

    #[test]
    fn world_rotations_round_trip() {
        let pose = some_pose();
        let again = Pose::from_world_rotations(pose.root_translation, &pose.world_quaternions());
        for part in Part::ALL {
            assert!((pose.rotations[part.index()] - again.rotations[part.index()]).length() < 1e-12);
        }
        for (matrix, quaternion) in pose.world_rotations().iter().zip(pose.world_quaternions()) {
            assert!((*matrix * Vec3::X - quaternion * Vec3::X).length() < 1e-12);
        }
    }

    #[test]
    fn a_mirrored_pose_moves_the_mirrored_joints() {
        let mirror = |x: Vec3| Vec3::new(-x.x, x.y, x.z);
        let mut rest = [Vec3::ZERO; Part::COUNT];
        for part in Part::ALL {
            let i = part.index() as f64;
            rest[part.index()] = Vec3::new(i.sin(), i * 0.1, (i * 3.0).cos());
        }
        let mirrored_rest = Part::ALL.map(|part| mirror(rest[part.mirrored().index()]));
        let (posed, mirrored) = (some_pose().joints(&rest), some_pose().mirrored().joints(&mirrored_rest));
        for part in Part::ALL {
            assert!(mirrored[part.index()].distance(mirror(posed[part.mirrored().index()])) < 1e-12, "{}", part.name());
        }
    }

    #[test]
    fn rotation_vectors_take_the_shorter_way() {
        let long = Quat::from_axis_angle(Vec3::Y, 1.5 * std::f64::consts::PI);
        assert!((rotation_vector(long) + Vec3::Y * std::f64::consts::FRAC_PI_2).length() < 1e-12);
    }

    #[test]
    fn bones_keep_their_lengths_when_posed() {
        let mut rest = [Vec3::ZERO; Part::COUNT];
        for part in Part::ALL {
            let i = part.index() as f64;
            rest[part.index()] = Vec3::new(i.sin(), i * 0.1, (i * 3.0).cos());
        }
        let posed = some_pose().joints(&rest);
        assert_eq!(posed[0], some_pose().root_translation);
        for part in Part::ALL {
            if let Some(parent) = part.parent() {
                let before = rest[part.index()].distance(rest[parent.index()]);
                assert!((posed[part.index()].distance(posed[parent.index()]) - before).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn interpolation_ends_at_both_poses() {
        let (a, b) = (Pose::template(Vec3::ZERO), some_pose());
        for (t, wanted) in [(0.0, &a), (1.0, &b)] {
            let found = a.interpolate(&b, t);
            for part in Part::ALL {
                assert!((found.rotations[part.index()] - wanted.rotations[part.index()]).length() < 1e-9);
            }
        }
    }
}
