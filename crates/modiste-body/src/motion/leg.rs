//! Legs by where the foot is: two-bone inverse kinematics.

use modiste_core::{Mat3, Quat, Vec3};

use crate::{Part, Pose};

/// Left or right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Left,
    Right,
}

impl Side {
    pub(crate) const BOTH: [Self; 2] = [Self::Left, Self::Right];

    pub(crate) fn index(self) -> usize {
        self as usize
    }

    /// +1 for the left, which is at +X, −1 for the right.
    pub(crate) fn sign(self) -> f64 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }

    pub(crate) fn thigh(self) -> Part {
        if self == Self::Left { Part::LeftThigh } else { Part::RightThigh }
    }

    pub(crate) fn shin(self) -> Part {
        if self == Self::Left { Part::LeftShin } else { Part::RightShin }
    }

    pub(crate) fn foot(self) -> Part {
        if self == Self::Left { Part::LeftFoot } else { Part::RightFoot }
    }

    pub(crate) fn shoulder(self) -> Part {
        if self == Self::Left { Part::LeftShoulder } else { Part::RightShoulder }
    }

    pub(crate) fn upper_arm(self) -> Part {
        if self == Self::Left { Part::LeftUpperArm } else { Part::RightUpperArm }
    }

    pub(crate) fn forearm(self) -> Part {
        if self == Self::Left { Part::LeftForearm } else { Part::RightForearm }
    }

    pub(crate) fn hand(self) -> Part {
        if self == Self::Left { Part::LeftHand } else { Part::RightHand }
    }
}

/// Lengths of thigh and shin (m).
pub(crate) fn leg_bones(rest_joints: &[Vec3; Part::COUNT], side: Side) -> [f64; 2] {
    let [hip, knee, ankle] = [side.thigh(), side.shin(), side.foot()].map(|part| rest_joints[part.index()]);
    [hip.distance(knee), knee.distance(ankle)]
}

/// Share of its full length that a leg is stretched to at most: a locked knee would snap back and forth.
const LONGEST: f64 = 0.998;

/// Turns thigh, shin and foot so that the ankle comes as near as it can to `ankle` (world, m), the foot has the world
/// rotation `foot`, and the knee points along `forwards` as far as the hip allows.
pub(crate) fn place_foot(
    pose: &mut Pose,
    rest_joints: &[Vec3; Part::COUNT],
    side: Side,
    ankle: Vec3,
    foot: Quat,
    forwards: Vec3,
) {
    let world = pose.world_quaternions();
    let pelvis = world[Part::Pelvis.index()];
    let hip = pose.joints(rest_joints)[side.thigh().index()];
    let [thigh_length, shin_length] = leg_bones(rest_joints, side);
    let reach = (ankle - hip)
        .length()
        .clamp((thigh_length - shin_length).abs() + 1e-3 * thigh_length, LONGEST * (thigh_length + shin_length));
    let down = (ankle - hip).normalize_or(Vec3::NEG_Y);
    // Law of cosines: how far the thigh leans forward of the line from hip to ankle.
    let cosine = (thigh_length.powi(2) + reach.powi(2) - shin_length.powi(2)) / (2.0 * thigh_length * reach);
    let lean = cosine.clamp(-1.0, 1.0).acos();
    let hinge = forwards.cross(down).normalize_or(pelvis * Vec3::X);
    let thigh_direction = Quat::from_axis_angle(hinge, -lean) * down;
    let knee = hip + thigh_direction * thigh_length;
    let shin_direction = (hip + down * reach - knee).normalize_or(down);
    let rest = |part: Part, far: Part| rest_joints[far.index()] - rest_joints[part.index()];
    let thigh = turn_bone(rest(side.thigh(), side.shin()), thigh_direction, hinge);
    let shin = turn_bone(rest(side.shin(), side.foot()), shin_direction, hinge);
    pose.set_rotation(side.thigh(), pelvis.conjugate() * thigh);
    pose.set_rotation(side.shin(), thigh.conjugate() * shin);
    pose.set_rotation(side.foot(), shin.conjugate() * foot);
}

/// The rotation that takes a bone of the template pose to `direction` and the knee's axis there, X, to `hinge`.
fn turn_bone(rest: Vec3, direction: Vec3, hinge: Vec3) -> Quat {
    let frame = |bone: Vec3, axis: Vec3| {
        let bone = bone.normalize_or(Vec3::NEG_Y);
        let axis = (axis - bone * axis.dot(bone)).normalize_or(bone.any_orthonormal_vector());
        Mat3::from_cols(bone, axis, bone.cross(axis))
    };
    Quat::from_mat3(&(frame(direction, hinge) * frame(rest, Vec3::X).transpose()))
}

#[cfg(test)]
mod tests {
    use modiste_core::{Quat, Vec3};

    use super::{Side, place_foot};
    use crate::motion::test_body::rest_joints;
    use crate::{Part, Pose};

    #[test]
    fn the_ankle_comes_where_it_is_wanted() {
        let joints = rest_joints();
        for side in Side::BOTH {
            let mut pose = Pose::template(Vec3::new(0.1, 0.85, 0.2));
            pose.rotations[0] = Vec3::new(0.1, 0.7, -0.05);
            let (ankle, foot) = (Vec3::new(0.1 + 0.15 * side.sign(), 0.12, 0.4), Quat::from_rotation_x(0.3));
            let forwards = pose.rotation(Part::Pelvis) * Vec3::Z;
            place_foot(&mut pose, &joints, side, ankle, foot, forwards);
            let found = pose.joints(&joints);
            assert!(found[side.foot().index()].distance(ankle) < 1e-9);
            assert!(super::super::filter::angle_between(pose.world_quaternions()[side.foot().index()], foot) < 1e-7);
            let middle = 0.5 * (found[side.thigh().index()] + ankle);
            assert!((found[side.shin().index()] - middle).dot(forwards) > 0.05, "the knee bends forwards");
        }
    }

    #[test]
    fn too_far_is_as_near_as_the_leg_reaches() {
        let joints = rest_joints();
        let mut pose = Pose::template(Vec3::new(0.0, 2.0, 0.0));
        place_foot(&mut pose, &joints, Side::Left, Vec3::ZERO, Quat::IDENTITY, Vec3::Z);
        let found = pose.joints(&joints);
        let (hip, ankle) = (found[Part::LeftThigh.index()], found[Part::LeftFoot.index()]);
        assert!(((hip - ankle).normalize() - hip.normalize()).length() < 1e-6);
    }
}
