//! What heads do in the training sets: captured motion, and made head shakes, nods and turns, which no clip shows.

use std::path::Path;

use modiste_body::motion::{RetargetOptions, generate, retarget};
use modiste_body::{Body, Motion, Part, Pose};
use modiste_core::{Progress, Quat, Rng, Vec3, seeded_rng, uniform};
use modiste_io::bvh;

use crate::HairError;

/// Longest stretch of a clip, and length of a made sequence (s), of what is learned from and of what is held out. So there are
/// about 12,000 frames to learn from, as many as the thesis has.
const SECONDS: [f64; 2] = [24.0, 12.0];
/// The neck takes this part of a turn of the head.
const NECK_SHARE: f64 = 0.4;

/// A named motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// Name; those that no person performed start with `made_`.
    pub name: String,
    /// The motion.
    pub motion: Motion,
    /// Whether nothing is learned from it.
    pub held_out: bool,
}

/// Clips to learn from, with the first second used.
const TRAINING_CLIPS: [(&str, f64); 29] = [
    ("walk_02_01", 0.0),
    ("walk_07_04", 0.0),
    ("walk_08_11", 0.0),
    ("walk_16_58", 0.0),
    ("walk_32_02", 0.0),
    ("run_02_03", 0.0),
    ("run_35_17", 0.0),
    ("run_49_04", 0.0),
    ("jump_02_04", 0.0),
    ("jump_49_02", 0.0),
    ("jumpingjack_13_29a", 0.0),
    ("kick_11_01", 0.0),
    ("kick_135_04", 0.0),
    ("kick_135_07", 0.0),
    ("twist_13_29b", 0.0),
    ("turn_05_11", 0.0),
    ("turn_49_21", 2.0),
    ("squat_13_29f", 0.0),
    ("kneeraise_13_30c", 0.0),
    ("armcircle_14_14e", 0.0),
    ("stretcharms_49_18", 0.0),
    ("misc_02_05", 0.0),
    ("head_02_10", 2.0),
    ("dance_05_02", 0.0),
    ("dance_05_04", 0.0),
    ("dance_05_06", 0.0),
    ("dance_05_17", 0.0),
    ("dance_49_09", 0.0),
    ("dance_60_01", 2.0),
];

/// Clips that nothing is learned from.
const TEST_CLIPS: [(&str, f64); 6] = [
    ("walk_12_02", 0.0),
    ("run_35_22", 0.0),
    ("jump_01_01", 0.0),
    ("squat_14_14c", 0.0),
    ("kick_10_01", 0.0),
    ("stretcharms_02_06", 0.0),
];

/// How a head moves in a made sequence: amplitudes (rad) about X (nod), Y (shake) and Z (tilt), and time between turning
/// points (s).
struct Gesture {
    name: &'static str,
    amplitudes: [f64; 3],
    beat: [f64; 2],
    walking: bool,
}

const fn gesture(name: &'static str, amplitudes: [f64; 3], beat: [f64; 2], walking: bool) -> Gesture {
    Gesture { name, amplitudes, beat, walking }
}

const TRAINING_GESTURES: [Gesture; 6] = [
    gesture("made_shake", [0.05, 0.85, 0.05], [0.25, 0.7], false),
    gesture("made_nod", [0.55, 0.08, 0.05], [0.3, 0.8], false),
    gesture("made_turn_and_hold", [0.15, 1.0, 0.1], [0.5, 1.6], false),
    gesture("made_tilt", [0.1, 0.1, 0.5], [0.35, 1.0], false),
    gesture("made_circle", [0.45, 0.6, 0.35], [0.3, 0.9], false),
    gesture("made_walk_look_around", [0.25, 0.7, 0.15], [0.4, 1.2], true),
];

const TEST_GESTURES: [Gesture; 1] = [gesture("made_shake_and_nod", [0.4, 0.8, 0.2], [0.28, 0.9], false)];

/// The 35 sequences to learn from and the 7 kept back, as far as their clips are in `mocap`.
///
/// Without captured motion only the made ones remain.
///
/// # Errors
/// A clip that cannot be read or carried over.
pub fn sequences(
    body: &Body,
    mocap: Option<&Path>,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Vec<Sequence>, HairError> {
    let mut all = Vec::new();
    for (held_out, clips, gestures) in
        [(false, &TRAINING_CLIPS[..], &TRAINING_GESTURES[..]), (true, &TEST_CLIPS[..], &TEST_GESTURES[..])]
    {
        let seconds = SECONDS[usize::from(held_out)];
        for (clip, first) in clips {
            let Some(folder) = mocap else { continue };
            let path = folder.join(format!("{clip}.bvh.gz"));
            if !modiste_io::exists(&path) {
                progress.warn(&format!("{} is not there and is left out", path.display()));
                continue;
            }
            let motion = retarget(&bvh::read(&path)?, body, &RetargetOptions::default(), progress)?;
            let frame = |time: f64| ((time * motion.fps).round() as usize).min(motion.frames.len());
            let motion = motion.slice(frame(*first)..frame(first + seconds));
            all.push(Sequence { name: (*clip).to_owned(), motion, held_out });
        }
        for (index, gesture) in gestures.iter().enumerate() {
            let seed = seed.wrapping_mul(1009) + 31 * u64::from(held_out) + index as u64;
            let motion = made(body, gesture, seconds, seed)?;
            all.push(Sequence { name: gesture.name.to_owned(), motion, held_out });
        }
    }
    Ok(all)
}

/// Somebody who stands or walks and moves the head from turning point to turning point, each reached at rest.
fn made(body: &Body, gesture: &Gesture, seconds: f64, seed: u64) -> Result<Motion, HairError> {
    let fps = generate::FPS;
    let count = (seconds * fps) as usize;
    let mut motion = if gesture.walking {
        generate::walk(body, seconds)?
    } else {
        Motion { fps, frames: vec![generate::stand(body); count] }
    };
    let mut rng = seeded_rng(seed);
    let mut from = Vec3::ZERO;
    let mut to = turning_point(gesture, &mut rng);
    let (mut since, mut beat) = (0.0, gesture.beat[1]);
    for pose in &mut motion.frames {
        since += 1.0 / fps;
        if since >= beat {
            since -= beat;
            from = to;
            to = turning_point(gesture, &mut rng);
            beat = gesture.beat[0] + (gesture.beat[1] - gesture.beat[0]) * uniform(&mut rng);
        }
        let s = (since / beat).clamp(0.0, 1.0);
        turn_head(pose, from.lerp(to, s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)));
    }
    Ok(motion)
}

fn turning_point(gesture: &Gesture, rng: &mut Rng) -> Vec3 {
    Vec3::from_array(gesture.amplitudes.map(|amplitude| amplitude * (2.0 * uniform(rng) - 1.0)))
}

/// Turns head and neck further by these angles (rad) about X, Y and Z.
fn turn_head(pose: &mut Pose, angles: Vec3) {
    for (part, share) in [(Part::Neck, NECK_SHARE), (Part::Head, 1.0 - NECK_SHARE)] {
        let turn = Quat::from_scaled_axis(share * angles);
        pose.set_rotation(part, turn * pose.rotation(part));
    }
}
