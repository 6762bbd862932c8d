//! A tube of cloth with made-up behaviour, small enough for tests.

use std::sync::Arc;

use modiste_body::{Gender, Motion, Part, Pose};
use modiste_core::{Quat, Topology, Vec3, normal, seeded_rng};

use super::training_set::{Garment, PoseSequence, ShapeSample, TrainingSet};

const RINGS: usize = 12;
const SIDES: usize = 16;
const HEIGHT: f64 = 0.5;
/// Hip joint height of the made-up body (m).
pub(crate) const PELVIS: f64 = 0.9;

/// A tube of given radius around the Y axis from `low` upwards, its parts from pelvis to chest.
pub(crate) fn tube(name: &str, radius: f64, low: f64) -> Garment {
    let mut template = Vec::new();
    for ring in 0..RINGS {
        for side in 0..SIDES {
            let angle = side as f64 / SIDES as f64 * std::f64::consts::TAU;
            let height = low + HEIGHT * ring as f64 / (RINGS - 1) as f64;
            template.push(Vec3::new(radius * angle.sin(), height, 0.8 * radius * angle.cos()));
        }
    }
    let at = |ring: usize, side: usize| (ring * SIDES + side % SIDES) as u32;
    let mut faces = Vec::new();
    let mut face_parts = Vec::new();
    for ring in 0..RINGS - 1 {
        for side in 0..SIDES {
            let (a, b, c, d) = (at(ring, side), at(ring, side + 1), at(ring + 1, side + 1), at(ring + 1, side));
            faces.extend([[a, b, c], [a, c, d]]);
            face_parts.extend([[Part::Pelvis, Part::Abdomen, Part::Chest][ring * 3 / (RINGS - 1)]; 2]);
        }
    }
    let uv = vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; faces.len()];
    Garment {
        name: name.to_owned(),
        gender: Gender::Female,
        topology: Arc::new(Topology::new(template.len(), faces).unwrap()),
        face_parts,
        template,
        waist_band: Vec::new(),
        anchors: (0..4).map(|corner| [at(RINGS - 1, corner * SIDES / 4), corner as u32]).collect(),
        uv,
        pattern: String::new(),
    }
}

/// The body that the anchors of [`tube`] belong to: four points at its upper edge.
pub(crate) fn anchor_body(pose: &Pose) -> Vec<Vec3> {
    let tube = tube("tube", 0.15, PELVIS);
    tube.anchors.iter().map(|&[vertex, _]| bend(tube.template[vertex as usize], pose)).collect()
}

/// A point of the template carried along by the chain pelvis, abdomen, chest, smoothly.
pub(crate) fn bend(point: Vec3, pose: &Pose) -> Vec3 {
    let world = pose.world_quaternions();
    let along = ((point.y - PELVIS) / HEIGHT).clamp(0.0, 1.0);
    let rotation = world[Part::Pelvis.index()].slerp(world[Part::Chest.index()], along);
    pose.root_translation + rotation * (point - Vec3::new(0.0, PELVIS, 0.0))
}

/// A motion of trunk and root made of sines.
pub(crate) fn motion(seed: u64, frames: usize) -> Motion {
    let mut rng = seeded_rng(seed);
    let draws: Vec<[f64; 3]> = (0..12).map(|_| [normal(&mut rng), normal(&mut rng), normal(&mut rng)]).collect();
    let wave = |channel: usize, time: f64| {
        let [a, b, c] = draws[channel];
        0.1 * (a * (0.15 * (2.0 + b) * time).sin() + c * (0.1 * time).cos())
    };
    let pose = |frame: usize| {
        let time = frame as f64;
        let mut pose = Pose::template(Vec3::new(wave(0, time), PELVIS, wave(1, time)));
        pose.rotations[Part::Pelvis.index()] = Vec3::new(0.0, wave(2, time), 0.0);
        for (channel, part) in [Part::Abdomen, Part::Chest].into_iter().enumerate() {
            let at = 3 + 3 * channel;
            pose.rotations[part.index()] = Vec3::new(wave(at, time), wave(at + 1, time), wave(at + 2, time));
        }
        pose
    };
    Motion { fps: 30.0, frames: (0..frames).map(pose).collect() }
}

/// The tube on one body in the template pose.
pub(crate) fn shaped(garment: &Garment, shape: &[f64]) -> Vec<Vec3> {
    let at = |index: usize| shape.get(index).copied().unwrap_or(0.0);
    let scale = |point: &Vec3| {
        let up = (point.y - PELVIS) / HEIGHT;
        let bulge = 0.015 * at(2) * (up * std::f64::consts::PI).sin() * point.z.max(0.0) / 0.12;
        Vec3::new(point.x * (1.0 + 0.06 * at(0)), point.y + 0.02 * at(1) * up, point.z * (1.0 + 0.05 * at(0)) + bulge)
    };
    garment.template.iter().map(scale).collect()
}

/// The tube through a motion: bent with the trunk, with a ripple that the sideways steps of the body set swinging.
pub(crate) fn sequence(garment: &Garment, name: &str, motion: Motion) -> PoseSequence {
    let (mut newer, mut older) = (0.0f64, 0.0f64);
    let mut frames = Vec::new();
    for frame in 0..motion.frames.len() {
        let back = |steps: usize| &motion.frames[frame.saturating_sub(steps)];
        let from_world = Quat::from_scaled_axis(back(2).rotations[0]).inverse();
        let step = |pose: &Pose| (from_world * (pose.root_translation - back(2).root_translation)).x;
        let bent = motion.frames[frame].rotations[Part::Chest.index()].x;
        let swing = 1.5 * newer - 0.7 * older + step(back(0)) - 1.5 * step(back(1)) + 0.01 * bent;
        (newer, older) = (swing, newer);
        let pose = &motion.frames[frame];
        let ripple = |point: &Vec3| {
            let up = (point.y - garment.template[0].y) / HEIGHT;
            let out = Vec3::new(point.x, 0.0, point.z).normalize();
            bend(*point + out * 0.2 * swing * (1.0 - up) * (4.0 * point.x.atan2(point.z)).cos(), pose)
        };
        frames.push(garment.template.iter().map(ripple).collect());
    }
    let body_anchors = motion.frames.iter().map(anchor_body).collect();
    PoseSequence { name: name.to_owned(), motion, frames, body_anchors }
}

/// A whole training set: 12 bodies and 5 motions.
pub(crate) fn training_set() -> TrainingSet {
    training_set_of(tube("tube", 0.15, PELVIS))
}

/// [`training_set`] of a given tube.
pub(crate) fn training_set_of(garment: Garment) -> TrainingSet {
    let mut rng = seeded_rng(11);
    let mut draw = || (0..5).map(|_| normal(&mut rng)).collect::<Vec<f64>>();
    let sample = |shape: Vec<f64>| ShapeSample {
        vertices: shaped(&garment, &shape),
        body_anchors: anchor_body(&Pose::template(PELVIS * Vec3::Y)),
        shape,
        ease: 0.0,
    };
    let shapes = (0..12).map(|_| sample(draw())).collect();
    let sequences = (0..5).map(|seed| sequence(&garment, &format!("motion_{seed}"), motion(seed, 80))).collect();
    TrainingSet {
        garment,
        shapes,
        sequences,
        seed: 7,
        sources: vec![("pattern.json".into(), "abc".into())],
        vertex_count: None,
    }
}
