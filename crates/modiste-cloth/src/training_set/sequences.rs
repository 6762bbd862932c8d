//! The motions that garments are simulated through, and those kept back for tests.

use std::path::Path;

use modiste_body::motion::{RetargetOptions, generate, retarget};
use modiste_body::{Body, BodyError, Motion};
use modiste_core::Progress;
use modiste_io::bvh;

use super::TrainingError;

/// A named motion.
#[derive(Debug, Clone)]
pub struct Sequence {
    /// Name, used for files.
    pub name: String,
    /// The motion.
    pub motion: Motion,
}

/// A stretch of a captured clip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Name of the clip: its file without endings.
    pub clip: &'static str,
    /// First second used.
    pub first: f64,
    /// How many seconds are used.
    pub seconds: f64,
}

const fn window(clip: &'static str, first: f64, seconds: f64) -> Window {
    Window { clip, first, seconds }
}

/// Captured motion to learn from. Long clips are taken in several stretches: each starts afresh, so that a garment torn in
/// one is whole in the next.
pub const TRAINING_CLIPS: [Window; 36] = [
    window("walk_02_01", 0.0, 2.8),
    window("walk_07_04", 0.0, 3.7),
    window("walk_08_11", 0.0, 3.0),
    window("walk_16_58", 0.0, 3.0),
    window("walk_32_02", 0.0, 3.6),
    window("turn_05_11", 0.0, 4.8),
    window("turn_49_21", 2.0, 4.0),
    window("turn_49_21", 8.0, 3.5),
    window("dance_05_02", 1.0, 4.0),
    window("dance_05_02", 5.0, 3.5),
    window("dance_05_04", 0.0, 4.0),
    window("dance_05_04", 4.0, 4.0),
    window("dance_05_17", 1.0, 4.0),
    window("dance_49_09", 3.0, 4.0),
    window("dance_49_09", 8.0, 4.0),
    window("dance_60_01", 2.0, 4.0),
    window("dance_60_01", 8.0, 4.0),
    window("head_02_10", 2.0, 4.0),
    window("head_02_10", 9.0, 4.0),
    window("misc_02_05", 2.0, 4.0),
    window("misc_02_05", 7.0, 4.0),
    window("stretcharms_49_18", 0.0, 4.0),
    window("stretcharms_49_18", 4.0, 4.0),
    window("run_02_03", 0.0, 1.4),
    window("run_35_17", 0.0, 1.4),
    window("run_49_04", 0.0, 2.0),
    window("jump_02_04", 0.0, 3.9),
    window("jump_49_02", 1.0, 4.0),
    window("kick_11_01", 1.0, 3.4),
    window("kick_135_04", 2.0, 3.4),
    window("twist_13_29b", 0.0, 5.5),
    window("squat_13_29f", 0.0, 3.2),
    window("armcircle_14_14e", 0.0, 4.0),
    window("armcircle_14_14e", 5.0, 4.0),
    window("jumpingjack_13_29a", 0.0, 2.8),
    window("kneeraise_13_30c", 0.0, 2.6),
];

/// Captured motion that no garment learns from.
pub const HELD_OUT_CLIPS: [Window; 6] = [
    window("walk_12_02", 0.0, 4.0),
    window("kick_10_01", 1.0, 4.0),
    window("run_35_22", 0.0, 1.4),
    window("jump_01_01", 1.0, 5.0),
    window("squat_14_14c", 0.0, 4.0),
    window("stretcharms_02_06", 2.0, 5.0),
];

/// The motions to learn from: made walks and turns, and the clips of [`TRAINING_CLIPS`] found in `mocap`.
///
/// Without captured motion, longer made ones of all kinds take its place, so that there are always 700 frames.
///
/// # Errors
/// A clip that cannot be read or carried over.
pub fn training_sequences(
    body: &Body,
    mocap: Option<&Path>,
    progress: &dyn Progress,
) -> Result<Vec<Sequence>, TrainingError> {
    let mut sequences = Vec::new();
    type Maker = fn(&Body, f64) -> Result<Motion, BodyError>;
    let with_clips = mocap.is_some_and(modiste_io::exists);
    let made: &[(&str, Maker, f64)] = if with_clips {
        &[
            ("made_walk", generate::walk, 4.0),
            ("made_turn", generate::turn, 4.0),
            ("made_raise_arms", generate::raise_arms, 4.0),
        ]
    } else {
        &[
            ("made_walk", generate::walk, 5.0),
            ("made_turn", generate::turn, 4.5),
            ("made_raise_arms", generate::raise_arms, 4.5),
            ("made_squat", generate::squat, 4.0),
            ("made_kick", generate::kick, 4.0),
            ("made_jump", generate::jump, 4.0),
        ]
    };
    for (name, make, seconds) in made {
        sequences.push(Sequence { name: (*name).to_owned(), motion: make(body, *seconds)? });
    }
    if let Some(folder) = mocap {
        sequences.extend(clips(body, folder, &TRAINING_CLIPS, progress)?);
    }
    Ok(sequences)
}

/// The motions of [`HELD_OUT_CLIPS`] found in `mocap`.
///
/// # Errors
/// A clip that cannot be read or carried over.
pub fn held_out_sequences(body: &Body, mocap: &Path, progress: &dyn Progress) -> Result<Vec<Sequence>, TrainingError> {
    clips(body, mocap, &HELD_OUT_CLIPS, progress)
}

/// What a stretch of a clip is called that has `earlier` others before it.
fn stretch_name(clip: &str, earlier: usize) -> String {
    if earlier == 0 { clip.to_owned() } else { format!("{clip}-{}", earlier + 1) }
}

fn clips(
    body: &Body,
    folder: &Path,
    windows: &[Window],
    progress: &dyn Progress,
) -> Result<Vec<Sequence>, TrainingError> {
    let mut sequences: Vec<Sequence> = Vec::new();
    for (index, window) in windows.iter().enumerate() {
        let path = folder.join(format!("{}.bvh.gz", window.clip));
        if !modiste_io::exists(&path) {
            progress.warn(&format!("{} is not there and is left out", path.display()));
            continue;
        }
        let motion = retarget(&bvh::read(&path)?, body, &RetargetOptions::default(), progress)?;
        let frame = |seconds: f64| ((seconds * motion.fps).round() as usize).min(motion.frames.len());
        let motion = motion.slice(frame(window.first)..frame(window.first + window.seconds));
        let earlier = windows[..index].iter().filter(|other| other.clip == window.clip).count();
        let name = stretch_name(window.clip, earlier);
        if motion.frames.is_empty() {
            progress.warn(&format!("{name}: the clip ends before {} s and is left out", window.first));
            continue;
        }
        sequences.push(Sequence { name, motion });
    }
    Ok(sequences)
}
