//! Poses and motions: relative part rotations along the kinematic tree.

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

    /// Rotation of each part from the template pose to the world (R of DRAPE eq. 2, R_p of SCAPE).
    pub fn world_rotations(&self) -> [Mat3; Part::COUNT] {
        let mut world = [Mat3::IDENTITY; Part::COUNT];
        for part in Part::ALL {
            let local = Mat3::from_quat(Quat::from_scaled_axis(self.rotations[part.index()]));
            world[part.index()] = match part.parent() {
                Some(parent) => world[parent.index()] * local,
                None => local,
            };
        }
        world
    }
}
