//! Poses that cover what joints can do, to learn and to test Q with.

use modiste_core::{Quat, Rng, Vec3, uniform};

use crate::{Part, Pose};

/// Chance that a joint stays near the template pose, so that the small bends of everyday motion are well learned.
const CALM_JOINTS: f64 = 0.35;

/// Range of rotation (radians) about the three axes that describe a joint.
struct Range([[f64; 2]; 3]);

/// The ranges of a part of the left side or the middle: active ranges of motion of healthy adults, rounded.
///
/// Trunk, neck and legs turn about X (bending forwards is positive for the trunk, backwards for the thigh), Y (twist) and
/// Z. Arms: elevation about Z, swing about Y (forwards is negative on the left), twist about the limb; elbows and wrists:
/// flexion, twist about the limb, deviation.
fn range(part: Part) -> Range {
    Range(match part {
        Part::Pelvis => [[0.0, 0.0]; 3],
        Part::Abdomen => [[-0.25, 0.6], [-0.45, 0.45], [-0.3, 0.3]],
        Part::Chest => [[-0.25, 0.5], [-0.4, 0.4], [-0.25, 0.25]],
        Part::Neck => [[-0.4, 0.5], [-0.6, 0.6], [-0.3, 0.3]],
        Part::Head => [[-0.4, 0.4], [-0.5, 0.5], [-0.25, 0.25]],
        Part::LeftShoulder | Part::RightShoulder => [[-0.1, 0.45], [-0.3, 0.25], [-0.1, 0.1]],
        Part::LeftUpperArm | Part::RightUpperArm => [[-0.75, 1.9], [-1.6, 0.5], [-0.9, 0.9]],
        Part::LeftForearm | Part::RightForearm => [[-0.15, 2.2], [-1.2, 1.2], [-0.05, 0.05]],
        Part::LeftHand | Part::RightHand => [[-0.9, 0.9], [-0.4, 0.4], [-0.4, 0.4]],
        Part::LeftThigh | Part::RightThigh => [[-1.9, 0.5], [-0.6, 0.6], [-0.35, 0.8]],
        Part::LeftShin | Part::RightShin => [[-0.05, 2.2], [-0.2, 0.2], [-0.05, 0.05]],
        Part::LeftFoot | Part::RightFoot => [[-0.4, 0.7], [-0.3, 0.3], [-0.25, 0.25]],
    })
}

fn is_right(part: Part) -> bool {
    part.name().starts_with("right")
}

/// The rotation that three angles describe, for a limb that points along `limb` in the template pose (left side).
fn rotation(part: Part, angles: [f64; 3], limb: Vec3) -> Quat {
    let [a, b, c] = angles;
    match part {
        Part::LeftShoulder | Part::RightShoulder => {
            Quat::from_rotation_y(b) * Quat::from_rotation_z(a) * Quat::from_rotation_x(c)
        }
        Part::LeftUpperArm | Part::RightUpperArm => {
            Quat::from_rotation_y(b) * Quat::from_rotation_z(a) * Quat::from_axis_angle(limb, c)
        }
        Part::LeftForearm | Part::RightForearm | Part::LeftHand | Part::RightHand => {
            // The hinge that turns the limb forwards, square to it.
            let hinge = (limb.cross(Vec3::Z)).normalize_or(Vec3::NEG_Y);
            Quat::from_axis_angle(hinge, a)
                * Quat::from_axis_angle(limb.cross(hinge), c)
                * Quat::from_axis_angle(limb, b)
        }
        _ => Quat::from_rotation_z(c) * Quat::from_rotation_x(a) * Quat::from_rotation_y(b),
    }
}

/// `count` poses that draw every joint's angles from its range, each joint by itself. The pelvis stays unturned.
///
/// `rest_joints` (m) give the directions of the limbs in the template pose.
pub(crate) fn sample_poses(rest_joints: &[Vec3; Part::COUNT], count: usize, rng: &mut Rng) -> Vec<Pose> {
    (0..count)
        .map(|_| {
            let mut pose = Pose::template(rest_joints[Part::Pelvis.index()]);
            for part in Part::ALL.into_iter().skip(1) {
                let calm = if uniform(rng) < CALM_JOINTS { 0.25 } else { 1.0 };
                let Range(ranges) = range(part);
                let angles = ranges.map(|[low, high]| calm * (low + (high - low) * uniform(rng)));
                let left = rotation(part, angles, limb_direction(part, rest_joints));
                pose.set_rotation(part, if is_right(part) { mirrored(left) } else { left });
            }
            pose
        })
        .collect()
}

/// Direction of a part's bone in the template pose, seen on the left side.
fn limb_direction(part: Part, rest_joints: &[Vec3; Part::COUNT]) -> Vec3 {
    let (from, to) = match part {
        Part::LeftUpperArm => (Part::LeftUpperArm, Part::LeftForearm),
        Part::LeftForearm | Part::LeftHand => (Part::LeftForearm, Part::LeftHand),
        Part::RightUpperArm => (Part::RightUpperArm, Part::RightForearm),
        Part::RightForearm | Part::RightHand => (Part::RightForearm, Part::RightHand),
        _ => return Vec3::NEG_Y,
    };
    let direction = (rest_joints[to.index()] - rest_joints[from.index()]).normalize_or(Vec3::NEG_Y);
    if is_right(part) { Vec3::new(-direction.x, direction.y, direction.z) } else { direction }
}

/// The rotation seen in a mirror at the plane x = 0.
fn mirrored(rotation: Quat) -> Quat {
    Quat::from_xyzw(rotation.x, -rotation.y, -rotation.z, rotation.w)
}

#[cfg(test)]
mod tests {
    use modiste_core::{Vec3, seeded_rng};

    use super::{mirrored, sample_poses};
    use crate::Part;
    use crate::scape::synthetic;

    #[test]
    fn a_mirrored_rotation_turns_mirrored_points() {
        let rotation = modiste_core::Quat::from_scaled_axis(Vec3::new(0.3, 0.8, -0.4));
        let mirror = |x: Vec3| Vec3::new(-x.x, x.y, x.z);
        let x = Vec3::new(0.2, -0.5, 0.9);
        assert!((mirrored(rotation) * mirror(x)).distance(mirror(rotation * x)) < 1e-12);
    }

    #[test]
    fn seeds_give_the_same_poses_and_the_pelvis_stays() {
        let joints = synthetic::joints();
        let once = sample_poses(&joints, 5, &mut seeded_rng(7));
        assert_eq!(once, sample_poses(&joints, 5, &mut seeded_rng(7)));
        assert!(once.iter().all(|pose| pose.rotations[0] == Vec3::ZERO && pose.is_finite()));
        assert!(once.iter().any(|pose| pose.rotations[Part::LeftShin.index()].x > 1.0));
    }
}
