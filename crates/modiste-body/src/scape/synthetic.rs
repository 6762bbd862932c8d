//! A small made-up body for tests: a tube along the left arm, from the pelvis to the hand, with a model trained on it.

use std::sync::{Arc, OnceLock};

use modiste_core::{Topology, Vec3};

use super::skin::{Skin, SkinWeights};
use super::train::{TrainOptions, TrainingBodies, train};
use crate::{Gender, Part, ScapeModel};

const RINGS: usize = 60;
const SIDES: usize = 10;

/// A closed tube along X from x = 0 to x = 1.2 at y = 1, capped at both ends.
pub(crate) fn topology() -> Arc<Topology> {
    let vertex = |ring: usize, side: usize| (ring * SIDES + side % SIDES) as u32;
    let mut faces = Vec::new();
    for ring in 0..RINGS - 1 {
        for side in 0..SIDES {
            let (a, b) = (vertex(ring, side), vertex(ring, side + 1));
            let (c, d) = (vertex(ring + 1, side + 1), vertex(ring + 1, side));
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let (start, end) = ((RINGS * SIDES) as u32, (RINGS * SIDES + 1) as u32);
    for side in 0..SIDES {
        faces.push([start, vertex(0, side + 1), vertex(0, side)]);
        faces.push([end, vertex(RINGS - 1, side), vertex(RINGS - 1, side + 1)]);
    }
    Arc::new(Topology::new(RINGS * SIDES + 2, faces).expect("a tube is a mesh"))
}

/// The tube with `radius` (m) and `length` (m).
pub(crate) fn tube(radius: f64, length: f64) -> Vec<Vec3> {
    let mut vertices = Vec::new();
    for ring in 0..RINGS {
        for side in 0..SIDES {
            let angle = std::f64::consts::TAU * side as f64 / SIDES as f64;
            let x = length * ring as f64 / (RINGS - 1) as f64;
            vertices.push(Vec3::new(x, radius * angle.sin(), radius * angle.cos()));
        }
    }
    vertices.extend([Vec3::ZERO, Vec3::X * length]);
    vertices
}

/// The tube of the mean body.
pub(crate) fn vertices() -> Vec<Vec3> {
    tube(0.05, 1.2)
}

/// Where each part begins along the tube, as a share of its length; parts off the arm have no share of it.
fn start(part: Part) -> f64 {
    match part {
        Part::Abdomen => 1.0 / 7.0,
        Part::Chest => 2.0 / 7.0,
        Part::LeftShoulder => 3.0 / 7.0,
        Part::LeftUpperArm => 4.0 / 7.0,
        Part::LeftForearm => 5.0 / 7.0,
        Part::LeftHand => 6.0 / 7.0,
        Part::Neck | Part::Head | Part::RightShoulder | Part::RightUpperArm | Part::RightForearm | Part::RightHand => {
            3.0 / 7.0
        }
        _ => 0.0,
    }
}

const CHAIN: [Part; 7] = [
    Part::Pelvis,
    Part::Abdomen,
    Part::Chest,
    Part::LeftShoulder,
    Part::LeftUpperArm,
    Part::LeftForearm,
    Part::LeftHand,
];

pub(crate) fn joints_of(length: f64) -> [Vec3; Part::COUNT] {
    let mut joints = [Vec3::ZERO; Part::COUNT];
    for part in Part::ALL {
        joints[part.index()] = Vec3::X * (start(part) * length);
    }
    joints
}

pub(crate) fn joints() -> [Vec3; Part::COUNT] {
    joints_of(1.2)
}

pub(crate) fn weights() -> SkinWeights {
    let rings = (0..RINGS * SIDES).map(|v| (v / SIDES) as f64 / (RINGS - 1) as f64).chain([0.0, 1.0]);
    rings
        .map(|share| {
            let at = (share * 7.0).min(6.999);
            let (segment, within) = (at.floor() as usize, at.fract());
            // The blend reaches a third of a segment to either side of a joint.
            let toward = |distance: f64| (0.5 - 1.5 * distance).max(0.0);
            let mut weights = vec![];
            if within < 0.5 && segment > 0 && toward(within) > 0.0 {
                weights.push((CHAIN[segment - 1], toward(within)));
            } else if within >= 0.5 && segment < 6 && toward(1.0 - within) > 0.0 {
                weights.push((CHAIN[segment + 1], toward(1.0 - within)));
            }
            let rest = 1.0 - weights.iter().map(|(_, w)| w).sum::<f64>();
            weights.insert(0, (CHAIN[segment], rest));
            weights
        })
        .collect()
}

pub(crate) fn skin() -> Skin {
    Skin::new(topology(), vertices(), joints(), weights())
}

/// Twelve tubes of different length and thickness.
pub(crate) fn bodies() -> TrainingBodies {
    let sizes: Vec<(f64, f64)> =
        (0..12).map(|i| (0.05 + 0.01 * (f64::from(i) * 1.9).sin(), 1.2 + 0.1 * (f64::from(i) * 0.7).cos())).collect();
    TrainingBodies {
        gender: Gender::Female,
        topology: topology(),
        vertices: sizes.iter().map(|&(radius, length)| tube(radius, length)).collect(),
        joints: sizes.iter().map(|&(_, length)| joints_of(length)).collect(),
        skin_weights: weights(),
    }
}

/// The model trained on the tubes.
pub(crate) fn model() -> Arc<ScapeModel> {
    static MODEL: OnceLock<Arc<ScapeModel>> = OnceLock::new();
    let make = || {
        let options = TrainOptions { shape_count: 3, pose_count: 40, ..TrainOptions::default() };
        train(&bodies(), &options, &modiste_core::Silent).expect("tubes can be learned").model
    };
    Arc::clone(MODEL.get_or_init(make))
}
