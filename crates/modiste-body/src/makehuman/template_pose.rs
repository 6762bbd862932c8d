//! From MakeHuman's rest pose to the template pose of this project.

use modiste_core::{Mat3, Quat, Vec3};

use super::{BODY_VERTEX_COUNT, MakeHumanModel, Offsets, joints_of};
use crate::Part;

/// Limb segments whose direction the template pose fixes: the part and the part at its far end.
const SEGMENTS: [(Part, Part); 8] = [
    (Part::LeftUpperArm, Part::LeftForearm),
    (Part::LeftForearm, Part::LeftHand),
    (Part::RightUpperArm, Part::RightForearm),
    (Part::RightForearm, Part::RightHand),
    (Part::LeftThigh, Part::LeftShin),
    (Part::LeftShin, Part::LeftFoot),
    (Part::RightThigh, Part::RightShin),
    (Part::RightShin, Part::RightFoot),
];

/// Unit direction of a limb segment in the template pose.
///
/// Arms 45° below horizontal with the elbow bent 12° forward; legs as in the rest pose of the average MakeHuman body:
/// the thigh 6° outwards and 4.7° forwards, the shin 5.3° outwards and 2.1° backwards.
fn template_direction(part: Part) -> Vec3 {
    let splayed = |outwards: f64, forwards: f64| {
        Vec3::new(outwards.to_radians().tan(), -1.0, forwards.to_radians().tan()).normalize()
    };
    let bend = 12_f64.to_radians();
    let upper_arm = Vec3::new(1.0, -1.0, 0.0).normalize();
    let left = match part {
        Part::LeftUpperArm | Part::RightUpperArm => upper_arm,
        Part::LeftForearm | Part::RightForearm => upper_arm * bend.cos() + Vec3::Z * bend.sin(),
        Part::LeftThigh | Part::RightThigh => splayed(6.0, 4.7),
        _ => splayed(5.3, -2.1),
    };
    let right_side = matches!(part, Part::RightUpperArm | Part::RightForearm | Part::RightThigh | Part::RightShin);
    if right_side { Vec3::new(-left.x, left.y, left.z) } else { left }
}

/// World rotation of each part from the pose of `joints` to the template pose. Hands follow the forearms, feet stay
/// flat, the trunk stays.
pub(super) fn rotations_to_template(joints: &[Vec3; Part::COUNT]) -> [Mat3; Part::COUNT] {
    let mut rotations = [Mat3::IDENTITY; Part::COUNT];
    for (part, far) in SEGMENTS {
        let direction = (joints[far.index()] - joints[part.index()]).normalize_or(template_direction(part));
        rotations[part.index()] = Mat3::from_quat(Quat::from_rotation_arc(direction, template_direction(part)));
    }
    rotations[Part::LeftHand.index()] = rotations[Part::LeftForearm.index()];
    rotations[Part::RightHand.index()] = rotations[Part::RightForearm.index()];
    rotations
}

/// Linear blend skinning of points (body vertices, then joints) by world rotations about the joints.
///
/// `x' = Σ_p w_p (R_p (x - j_p) + j'_p)` with `j'` down the tree: linear in the points when the rotations are fixed,
/// so it applies to displacements as it does to positions.
pub(crate) fn skin(points: &mut [Vec3], skin_weights: &[Vec<(Part, f64)>], rotations: &[Mat3; Part::COUNT]) {
    let joints = joints_of(points);
    let mut posed = joints;
    for part in Part::ALL {
        if let Some(parent) = part.parent() {
            let bone = joints[part.index()] - joints[parent.index()];
            posed[part.index()] = posed[parent.index()] + rotations[parent.index()] * bone;
        }
    }
    for (point, weights) in points.iter_mut().zip(skin_weights) {
        *point = weights
            .iter()
            .map(|&(part, weight)| {
                let index = part.index();
                weight * (rotations[index] * (*point - joints[index]) + posed[index])
            })
            .sum();
    }
    let first = points.len() - Part::COUNT;
    points[first..].copy_from_slice(&posed);
}

impl MakeHumanModel {
    /// Turns the limbs of points (body vertices, then joints; m) exactly into the template pose, puts the feet on
    /// `y = 0` and the pelvis joint at `x = z = 0`.
    pub fn normalise_pose(&self, points: &mut [Vec3]) {
        let rotations = rotations_to_template(&joints_of(points));
        skin(points, &self.skin_weights, &rotations);
        let floor = points[..BODY_VERTEX_COUNT].iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        let pelvis = points[BODY_VERTEX_COUNT + Part::Pelvis.index()];
        let shift = Vec3::new(pelvis.x, floor, pelvis.z);
        for point in points {
            *point -= shift;
        }
    }

    /// Bends base and targets from the file's rest pose by the rotations that bring the average body to the template
    /// pose.
    pub(super) fn move_to_template_pose(&mut self) {
        let average = self.points(&self.default_parameters().0);
        let rotations = rotations_to_template(&joints_of(&average));
        skin(&mut self.base, &self.skin_weights, &rotations);
        let point_count = self.base.len();
        for term in &mut self.terms {
            let mut dense = vec![Vec3::ZERO; point_count];
            term.offsets.add_to(1.0, &mut dense);
            skin(&mut dense, &self.skin_weights, &rotations);
            term.offsets = Offsets::from_dense(&dense);
        }
    }
}

#[cfg(test)]
mod tests {
    use modiste_core::Vec3;

    use super::{rotations_to_template, skin, template_direction};
    use crate::Part;

    #[test]
    fn a_skeleton_in_any_pose_is_brought_to_the_template_pose() {
        let mut joints = [Vec3::ZERO; Part::COUNT];
        for part in Part::ALL {
            if let Some(parent) = part.parent() {
                let i = part.index() as f64;
                joints[part.index()] = joints[parent.index()] + 0.2 * Vec3::new(i.sin(), -1.0, (2.0 * i).cos());
            }
        }
        let rotations = rotations_to_template(&joints);
        let mut points = joints.to_vec();
        skin(&mut points, &[], &rotations);
        for (part, far) in super::SEGMENTS {
            let direction = (points[far.index()] - points[part.index()]).normalize();
            assert!((direction - template_direction(part)).length() < 1e-12, "{part:?}");
        }
        let right = template_direction(Part::RightForearm);
        assert_eq!(template_direction(Part::LeftForearm), Vec3::new(-right.x, right.y, right.z));
    }
}
