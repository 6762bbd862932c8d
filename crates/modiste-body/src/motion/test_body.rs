//! A person's joints and a box-like model around them, for the tests of motion.

use std::sync::{Arc, OnceLock};

use modiste_core::{Topology, Vec3};

use crate::scape::SkinWeights;
use crate::scape::train::{TrainOptions, TrainingBodies, train};
use crate::{Body, Gender, Part, ScapeModel};

/// Joints (m) of a person 1.7 m tall in the template pose.
pub(crate) fn rest_joints() -> [Vec3; Part::COUNT] {
    let mut joints = [Vec3::ZERO; Part::COUNT];
    let middle = [
        (Part::Pelvis, 0.95, 0.0),
        (Part::Abdomen, 1.05, -0.01),
        (Part::Chest, 1.18, -0.02),
        (Part::Neck, 1.43, -0.02),
        (Part::Head, 1.52, 0.0),
    ];
    for (part, y, z) in middle {
        joints[part.index()] = Vec3::new(0.0, y, z);
    }
    let left = [
        (Part::LeftShoulder, Part::RightShoulder, [0.03, 1.38, 0.0]),
        (Part::LeftUpperArm, Part::RightUpperArm, [0.17, 1.38, -0.02]),
        (Part::LeftForearm, Part::RightForearm, [0.37, 1.18, -0.02]),
        (Part::LeftHand, Part::RightHand, [0.54, 1.01, 0.03]),
        (Part::LeftThigh, Part::RightThigh, [0.09, 0.89, 0.0]),
        (Part::LeftShin, Part::RightShin, [0.13, 0.49, 0.03]),
        (Part::LeftFoot, Part::RightFoot, [0.165, 0.08, 0.015]),
    ];
    for (left, right, [x, y, z]) in left {
        joints[left.index()] = Vec3::new(x, y, z);
        joints[right.index()] = Vec3::new(-x, y, z);
    }
    joints
}

/// Where each part's bone ends in the template pose (m).
fn tip(part: Part, joints: &[Vec3; Part::COUNT]) -> Vec3 {
    let at = |part: Part| joints[part.index()];
    match part {
        Part::Pelvis => at(Part::Abdomen),
        Part::Abdomen => at(Part::Chest),
        Part::Chest => at(Part::Neck),
        Part::Neck => at(Part::Head),
        Part::Head => at(Part::Head) + Vec3::Y * 0.18,
        Part::LeftHand | Part::RightHand => at(part) + Vec3::new(0.1 * at(part).x.signum(), -0.1, 0.03),
        Part::LeftFoot | Part::RightFoot => at(part) + Vec3::new(0.0, -0.05, 0.17),
        _ => Part::ALL.into_iter().find(|child| child.parent() == Some(part)).map_or(at(part), at),
    }
}

/// One box per part, tied into one mesh only by sharing joints: enough to stand on.
fn boxes(scale: f64) -> (Vec<Vec3>, Vec<[u32; 3]>, SkinWeights) {
    let joints = rest_joints();
    let (mut vertices, mut faces, mut weights) = (Vec::new(), Vec::new(), Vec::new());
    for part in Part::ALL {
        let to = tip(part, &joints);
        // The soles are level, from heel to toes.
        let from = match part {
            Part::LeftFoot | Part::RightFoot => to - Vec3::Z * 0.23,
            _ => joints[part.index()],
        };
        let along = (to - from).normalize();
        let side = along.any_orthonormal_vector();
        let other = along.cross(side);
        let radius = match part {
            Part::Pelvis | Part::Abdomen | Part::Chest => 0.11,
            Part::LeftThigh | Part::RightThigh => 0.06,
            _ => 0.03,
        };
        let first = vertices.len() as u32;
        for end in [from, to] {
            for (a, b) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
                vertices.push((end + (side * a + other * b) * radius) * scale);
                weights.push(vec![(part, 1.0)]);
            }
        }
        for quad in [[0, 1, 2, 3], [7, 6, 5, 4], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]] {
            let [a, b, c, d] = quad.map(|corner: u32| first + corner);
            faces.extend([[a, c, b], [a, d, c]]);
        }
    }
    (vertices, faces, weights)
}

/// A body of boxes, one per part.
pub(crate) fn body() -> Body {
    static MODEL: OnceLock<Arc<ScapeModel>> = OnceLock::new();
    let make = || {
        let (vertices, faces, skin_weights) = boxes(1.0);
        let scales = [0.9, 1.0, 1.1];
        let bodies = TrainingBodies {
            gender: Gender::Male,
            topology: Arc::new(Topology::new(vertices.len(), faces).expect("boxes are a mesh")),
            vertices: scales.iter().map(|scale| boxes(*scale).0).collect(),
            joints: scales.iter().map(|scale| rest_joints().map(|joint| joint * *scale)).collect(),
            skin_weights,
        };
        let options =
            TrainOptions { shape_count: 1, pose_count: 2, learn_pose_deformation: false, ..TrainOptions::default() };
        train(&bodies, &options, &modiste_core::Silent).expect("boxes can be learned").model
    };
    MODEL.get_or_init(make).body(&[]).expect("the mean body")
}
