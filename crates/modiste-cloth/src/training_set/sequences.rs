//! The motions that garments are simulated through, and those kept back for tests.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;

use modiste_body::motion::{DEFAULT_GAP, RetargetOptions, clear_limbs, generate, retarget};
use modiste_body::{Body, BodyError, Motion, Part};
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
pub const TRAINING_CLIPS: [Window; 68] = [
    window("walk_02_01", 0.0, 2.8),
    window("walk_07_04", 0.0, 3.7),
    window("walk_08_11", 0.0, 3.0),
    window("walk_16_58", 0.0, 3.0),
    window("walk_32_02", 0.0, 3.6),
    window("turn_05_11", 0.0, 4.8),
    window("turn_49_21", 2.0, 4.0),
    window("turn_49_21", 8.0, 3.5),
    window("turn_49_21", 12.0, 4.0),
    window("dance_05_02", 1.0, 4.0),
    window("dance_05_02", 5.0, 3.5),
    window("dance_05_04", 0.0, 4.0),
    window("dance_05_04", 4.0, 4.0),
    window("dance_05_17", 1.0, 4.0),
    window("dance_49_09", 3.0, 4.0),
    window("dance_49_09", 8.0, 4.0),
    window("dance_49_09", 12.0, 3.9),
    window("dance_60_01", 2.0, 4.0),
    window("dance_60_01", 8.0, 4.0),
    window("dance_60_01", 15.0, 4.0),
    window("dance_60_01", 22.0, 4.0),
    window("dance_60_01", 29.0, 4.0),
    window("head_02_10", 2.0, 4.0),
    window("head_02_10", 9.0, 4.0),
    window("head_02_10", 15.0, 4.0),
    window("misc_02_05", 2.0, 4.0),
    window("misc_02_05", 7.0, 4.0),
    window("misc_02_05", 11.0, 4.0),
    window("stretcharms_49_18", 0.0, 4.0),
    window("stretcharms_49_18", 4.0, 4.0),
    window("run_02_03", 0.0, 1.4),
    window("run_35_17", 0.0, 1.4),
    window("run_49_04", 0.0, 2.0),
    window("jump_02_04", 0.0, 3.9),
    window("jump_49_02", 1.0, 4.0),
    window("jump_49_02", 6.0, 4.0),
    window("jump_49_02", 12.0, 4.0),
    window("kick_11_01", 1.0, 3.4),
    window("kick_135_04", 2.0, 3.4),
    window("kick_135_04", 6.5, 3.4),
    window("kick_135_07", 1.5, 3.4),
    window("kick_135_07", 6.0, 3.4),
    window("twist_13_29b", 0.0, 5.5),
    window("squat_13_29f", 0.0, 3.2),
    window("squat_13_29f", 3.2, 3.2),
    window("armcircle_14_14e", 0.0, 4.0),
    window("armcircle_14_14e", 5.0, 4.0),
    window("jumpingjack_13_29a", 0.0, 2.8),
    window("kneeraise_13_30c", 0.0, 2.6),
    window("kneeraise_13_30c", 2.6, 2.5),
    window("dance_60_01", 5.5, 2.5),
    window("dance_60_01", 12.0, 3.0),
    window("dance_60_01", 19.0, 3.0),
    window("dance_60_01", 26.0, 3.0),
    window("dance_60_01", 33.0, 4.0),
    window("dance_49_09", 0.0, 3.0),
    window("dance_05_17", 5.0, 3.7),
    window("dance_05_04", 7.5, 2.5),
    window("dance_05_06", 3.0, 4.0),
    window("turn_49_21", 5.5, 2.5),
    window("turn_49_21", 16.0, 4.0),
    window("head_02_10", 6.0, 3.0),
    window("head_02_10", 19.0, 3.0),
    window("jump_49_02", 10.0, 2.5),
    window("kick_135_07", 9.3, 3.0),
    window("kick_135_04", 0.0, 3.0),
    window("misc_02_05", 0.0, 2.5),
    window("armcircle_14_14e", 8.5, 2.3),
];

/// Two stretches that are put together, the root and legs of the first with the trunk, head and arms of the second. In the
/// clips themselves limbs move together in the ways of a few exercises, so that what a leg does to a hem would be learned of
/// the arm that always swings with it.
const MIXED_CLIPS: [[Window; 2]; 14] = [
    [window("walk_07_04", 0.0, 3.7), window("misc_02_05", 3.0, 3.7)],
    [window("walk_02_01", 0.0, 2.8), window("dance_49_09", 4.0, 2.8)],
    [window("walk_32_02", 0.0, 3.6), window("head_02_10", 10.0, 3.6)],
    [window("walk_16_58", 0.0, 2.8), window("armcircle_14_14e", 1.0, 2.8)],
    [window("walk_08_11", 0.0, 3.0), window("twist_13_29b", 1.0, 3.0)],
    [window("squat_13_29f", 1.0, 3.4), window("stretcharms_49_18", 1.0, 3.4)],
    [window("squat_13_29f", 2.5, 3.4), window("dance_05_04", 4.0, 3.4)],
    [window("kneeraise_13_30c", 0.5, 3.4), window("dance_05_02", 2.0, 3.4)],
    [window("kick_11_01", 1.0, 3.4), window("turn_49_21", 8.0, 3.4)],
    [window("kick_135_04", 3.0, 3.4), window("walk_07_04", 0.0, 3.4)],
    [window("jump_49_02", 2.0, 3.8), window("dance_60_01", 9.0, 3.8)],
    [window("dance_60_01", 4.0, 3.8), window("jumpingjack_13_29a", 0.0, 3.8)],
    [window("dance_05_17", 1.0, 2.8), window("kick_135_07", 3.0, 2.8)],
    [window("stretcharms_49_18", 3.0, 3.6), window("walk_32_02", 0.0, 3.6)],
];

/// Longest motion (s) that is put together of three stretches, see [`crossed`].
const CROSSED_SECONDS: f64 = 3.4;

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
        let captured = clips(body, folder, &TRAINING_CLIPS, progress)?;
        let mut crossed = crossed(&captured);
        crossed.iter_mut().for_each(|sequence| _ = clear_limbs(&mut sequence.motion, body, DEFAULT_GAP));
        sequences.extend(captured);
        sequences.extend(mixed(body, folder, progress)?);
        sequences.extend(crossed);
    }
    Ok(sequences)
}

/// The motions of [`MIXED_CLIPS`] of which both halves are found in `mocap`.
fn mixed(body: &Body, mocap: &Path, progress: &dyn Progress) -> Result<Vec<Sequence>, TrainingError> {
    let mut sequences = Vec::new();
    for halves in &MIXED_CLIPS {
        let found = clips(body, mocap, halves, progress)?;
        let [below, above] = found.as_slice() else { continue };
        let name = format!("mixed_{}+{}", halves[0].clip, halves[1].clip);
        let mut motion = graft(&below.motion, &above.motion, Part::Abdomen);
        clear_limbs(&mut motion, body, DEFAULT_GAP);
        sequences.push(Sequence { name, motion });
    }
    Ok(sequences)
}

/// Motions with the root and right leg of one stretch, the left leg of another, and the trunk, head and arms of a third; two
/// for every three stretches. Nobody moves so, but cloth does not know, and with every doubling of what a garment learned
/// from its distance from physics on held-out clips fell by a tenth.
fn crossed(captured: &[Sequence]) -> Vec<Sequence> {
    let count = captured.len();
    let cross = |index: usize| {
        // Strides that meet every stretch about as often as any other, and no two of the same.
        let [right, left, above] = [7 * index, 11 * index + 20, 13 * index + 45].map(|at| &captured[at % count]);
        let mut motion = graft(&graft(&right.motion, &left.motion, Part::LeftThigh), &above.motion, Part::Abdomen);
        motion.frames.truncate((CROSSED_SECONDS * motion.fps) as usize);
        Sequence { name: format!("mixed_{}+{}+{}", right.name, left.name, above.name), motion }
    };
    (0..count * 2 / 3).map(cross).collect()
}

/// A motion with the part `first` and all beyond it moving as in another, as long as the shorter one.
fn graft(motion: &Motion, other: &Motion, first: Part) -> Motion {
    let is_grafted = |part: Part| std::iter::successors(Some(part), |part| part.parent()).any(|p| p == first);
    let frames = motion.frames.iter().zip(&other.frames).map(|(pose, other)| {
        let mut pose = pose.clone();
        for part in Part::ALL.into_iter().filter(|&part| is_grafted(part)) {
            pose.rotations[part.index()] = other.rotations[part.index()];
        }
        pose
    });
    Motion { fps: motion.fps, frames: frames.collect() }
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
    let mut whole = BTreeMap::new();
    for (index, window) in windows.iter().enumerate() {
        let path = folder.join(format!("{}.bvh.gz", window.clip));
        if !modiste_io::exists(&path) {
            progress.warn(&format!("{} is not there and is left out", path.display()));
            continue;
        }
        let motion = match whole.entry(window.clip) {
            Entry::Occupied(entry) => entry.into_mut(),
            Entry::Vacant(entry) => {
                entry.insert(retarget(&bvh::read(&path)?, body, &RetargetOptions::default(), progress)?)
            }
        };
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

#[cfg(test)]
mod tests {
    use super::{Sequence, TRAINING_CLIPS, Window, crossed, graft, stretch_name};
    use modiste_body::{Motion, Part, Pose};
    use modiste_core::Vec3;
    use std::collections::HashSet;

    #[test]
    fn crossed_motions_use_nearly_every_stretch_and_are_all_different() {
        let motion = Motion { fps: 30.0, frames: vec![Pose::template(Vec3::ZERO); 120] };
        let stretch = |(index, window): (usize, &Window)| {
            let earlier = TRAINING_CLIPS[..index].iter().filter(|other| other.clip == window.clip).count();
            Sequence { name: stretch_name(window.clip, earlier), motion: motion.clone() }
        };
        let captured: Vec<Sequence> = TRAINING_CLIPS.iter().enumerate().map(stretch).collect();
        let made = crossed(&captured);
        let names: HashSet<&str> = made.iter().map(|sequence| sequence.name.as_str()).collect();
        assert_eq!(names.len(), made.len());
        assert!(made.iter().all(|sequence| sequence.motion.frames.len() == 102));
        let clips =
            |sequence: &Sequence| sequence.name["mixed_".len()..].split('+').map(str::to_owned).collect::<Vec<_>>();
        let used: HashSet<String> = made.iter().flat_map(clips).collect();
        assert!(used.len() * 10 > captured.len() * 9, "{} of {}", used.len(), captured.len());
        assert!(crossed(&captured[..1]).is_empty());
    }

    #[test]
    fn legs_come_from_one_motion_and_arms_from_the_other() {
        let motion = |turn: f64, frames: usize| {
            let mut pose = Pose::template(Vec3::new(turn, 1.0, 0.0));
            pose.rotations.fill(Vec3::new(turn, 0.0, 0.0));
            Motion { fps: 30.0, frames: vec![pose; frames] }
        };
        let mixed = graft(&motion(0.1, 5), &motion(0.2, 3), Part::Abdomen);
        assert_eq!(mixed.frames.len(), 3);
        let pose = &mixed.frames[2];
        let turn = |part: Part| pose.rotations[part.index()].x;
        assert!((pose.root_translation.x - 0.1).abs() < 1e-12);
        assert!([Part::Pelvis, Part::LeftThigh, Part::RightFoot].iter().all(|&part| (turn(part) - 0.1).abs() < 1e-12));
        assert!([Part::Abdomen, Part::Head, Part::RightHand].iter().all(|&part| (turn(part) - 0.2).abs() < 1e-12));
    }
}
