//! Captured motion carried over to one of our bodies.
//!
//! Joints are matched by name. A clip's rest pose (arms out, legs in some clips splayed) is not our template pose, so the
//! world rotation of a part is the clip's, after a fixed rotation that takes our bone to the clip's rest bone:
//! `world_from_part = world_from_clip_joint(frame) · rest_clip_from_part`. Bones then point where the clip's do,
//! whatever the rest poses. Positions are not used but for the root, which is scaled by leg length.

use modiste_core::{Progress, Quat, Vec3};
use modiste_io::bvh::{BvhClip, Channel};

use super::filter::{low_pass, remove_spikes, resample, soften_steps};
use super::floor::place_on_floor;
use super::leg::{Side, leg_bones};
use super::skeleton::{Family, Source};
use crate::{Body, BodyError, Motion, Part, Pose};

/// Frames at the start of a clip that show the calibration pose and the blend out of it.
const CALIBRATION_FRAMES: usize = 4;

/// Shortest clip worth keeping (s).
const SHORTEST: f64 = 0.3;

/// A step of a limb's rotation by more than this (radians) is a solver flip, not a movement.
const FLIP: f64 = 1.6;

/// What can be chosen in retargeting.
#[derive(Debug, Clone, PartialEq)]
pub struct RetargetOptions {
    /// Frame rate of the result (1/s).
    pub fps: f64,
    /// Frame rate of the clip where its header is wrong (1/s).
    pub clip_fps: Option<f64>,
    /// Frequency above which movement is taken for noise (Hz).
    pub cutoff: f64,
    /// Joint speed above which movement is taken for a defect (rad/s).
    pub max_speed: f64,
}

impl Default for RetargetOptions {
    fn default() -> Self {
        // Deliberate human movement stays below 6 to 8 Hz (Winter 2009, §3.4) and joints below about 30 rad/s.
        Self { fps: 30.0, clip_fps: None, cutoff: 7.0, max_speed: 35.0 }
    }
}

/// The clip on a body: cleaned, resampled, standing on the floor (y = 0), starting above the origin and facing +Z.
///
/// Warnings (cut or bridged defects) go to `progress`.
///
/// # Errors
/// Unknown or missing joints, numbers that are not finite, or too few usable frames.
pub fn retarget(
    clip: &BvhClip,
    body: &Body,
    options: &RetargetOptions,
    progress: &dyn Progress,
) -> Result<Motion, BodyError> {
    let clip_fps = options.clip_fps.unwrap_or(1.0 / clip.frame_time);
    for (what, value) in [("frame rate of the clip", clip_fps), ("frame rate of the motion", options.fps)] {
        if !(1.0..=1000.0).contains(&value) {
            return Err(BodyError::Value {
                what: what.to_owned(),
                wanted: "1 to 1000 per second".to_owned(),
                found: value,
            });
        }
    }
    let source = Source::new(clip)?;
    let alignment = Alignment::new(&source, body);
    let first = if clip.frames.len() > 2 * CALIBRATION_FRAMES { CALIBRATION_FRAMES } else { 0 };
    let mut motion = Motion { fps: clip_fps, frames: Vec::with_capacity(clip.frames.len()) };
    for (index, values) in clip.frames.iter().enumerate().skip(first) {
        let pose = alignment.pose(&source, values, body);
        if !pose.is_finite() {
            return Err(BodyError::Motion(format!("frame {index} holds a number that is not finite")));
        }
        motion.frames.push(pose);
    }
    clean(&mut motion, first, options, progress)?;
    let mut motion = resample(&motion, options.fps);
    start_at_origin(&mut motion);
    place_on_floor(&mut motion, body);
    Ok(motion)
}

/// Takes defects out: bridges spikes, cuts at flips, spreads other steps, and low-passes what is left.
fn clean(
    motion: &mut Motion,
    first: usize,
    options: &RetargetOptions,
    progress: &dyn Progress,
) -> Result<(), BodyError> {
    let mut steps = remove_spikes(motion, options.max_speed, 0.1);
    let flips: Vec<usize> =
        steps.iter().filter(|step| step.angle > FLIP && is_limb(step.part)).map(|step| step.frame + 1).collect();
    if !flips.is_empty() {
        let kept = longest_sound_stretch(motion, &flips);
        progress.warn(&format!(
            "the clip has {} limb flips; only frames {} to {} of {} are kept",
            flips.len(),
            kept.start + first,
            kept.end + first - 1,
            motion.frames.len() + first
        ));
        *motion = motion.slice(kept.clone());
        steps.retain_mut(|step| {
            let inside = kept.contains(&step.frame) && kept.contains(&(step.frame + 1));
            step.frame = step.frame.saturating_sub(kept.start);
            inside
        });
    }
    if motion.duration() < SHORTEST {
        let left = motion.frames.len();
        return Err(BodyError::Motion(format!("only {left} usable frames are left, less than {SHORTEST} s")));
    }
    if !steps.is_empty() {
        progress.warn(&format!("{} sudden steps of single joints were smoothed", steps.len()));
        soften_steps(motion, &steps, 0.08);
    }
    low_pass(motion, options.cutoff);
    Ok(())
}

/// Parts whose flips cannot be smoothed away without the limb flying through the body.
fn is_limb(part: Part) -> bool {
    !matches!(part, Part::LeftFoot | Part::RightFoot | Part::LeftHand | Part::RightHand)
}

/// The longest stretch between flips in which no thigh is turned the wrong way round about its own axis.
fn longest_sound_stretch(motion: &Motion, flips: &[usize]) -> std::ops::Range<usize> {
    let mut bounds = vec![0];
    bounds.extend(flips);
    bounds.push(motion.frames.len());
    bounds.dedup();
    let sound = |range: &std::ops::Range<usize>| {
        let turned = motion.frames[range.clone()].iter().filter(|pose| {
            Side::BOTH
                .iter()
                .any(|side| twist(pose.rotation(side.thigh()), Vec3::Y).abs() > std::f64::consts::FRAC_PI_2)
        });
        2 * turned.count() <= range.len()
    };
    let stretches: Vec<std::ops::Range<usize>> = bounds.windows(2).map(|pair| pair[0]..pair[1]).collect();
    let longest = |ranges: Vec<&std::ops::Range<usize>>| ranges.into_iter().max_by_key(|range| range.len()).cloned();
    longest(stretches.iter().filter(|range| sound(range)).collect())
        .or_else(|| longest(stretches.iter().collect()))
        .unwrap_or(0..0)
}

/// Angle (radians) by which a rotation turns about `axis`, in `(-π, π]`.
fn twist(rotation: Quat, axis: Vec3) -> f64 {
    let shorter = if rotation.w < 0.0 { -rotation } else { rotation };
    2.0 * shorter.xyz().dot(axis).atan2(shorter.w)
}

/// Turns and moves a motion so that it starts above the origin, the pelvis facing +Z.
fn start_at_origin(motion: &mut Motion) {
    let Some(first) = motion.frames.first() else { return };
    let facing = first.rotation(Part::Pelvis) * Vec3::Z;
    let turn = Quat::from_rotation_y(-facing.x.atan2(facing.z));
    let start = Vec3::new(first.root_translation.x, 0.0, first.root_translation.z);
    for pose in &mut motion.frames {
        pose.root_translation = turn * (pose.root_translation - start);
        let turned = turn * pose.rotation(Part::Pelvis);
        pose.set_rotation(Part::Pelvis, turned);
    }
}

/// The fixed rotations between a clip's rest pose and a body's template pose.
struct Alignment {
    /// From each part of our template pose to the clip's rest pose.
    rest_clip_from_part: [Quat; Part::COUNT],
    /// Metres per unit of the clip.
    scale: f64,
}

impl Alignment {
    fn new(source: &Source<'_>, body: &Body) -> Self {
        let joints = body.rest_joints();
        let mut align = [Quat::IDENTITY; Part::COUNT];
        let ours = |part: Part, far: Part| (joints[far.index()] - joints[part.index()]).normalize_or(Vec3::NEG_Y);
        let theirs = |part: Part, far: Part| source.rest_bone(part, far).normalize_or(Vec3::NEG_Y);
        for side in Side::BOTH {
            let chains = [[side.upper_arm(), side.forearm(), side.hand()], [side.thigh(), side.shin(), side.foot()]];
            for [upper, lower, end] in chains {
                // Each segment starts from the alignment of the one above it, so that none twists against it.
                let first = Quat::from_rotation_arc(ours(upper, lower), theirs(upper, lower));
                let second = Quat::from_rotation_arc(first * ours(lower, end), theirs(lower, end)) * first;
                align[upper.index()] = first;
                align[lower.index()] = second;
                align[end.index()] = second;
            }
            align[side.foot().index()] = foot_alignment(source, body, side);
        }
        let length = |side| leg_bones(joints, side).iter().sum::<f64>();
        let clip_length = |side: Side| {
            source.rest_bone(side.thigh(), side.shin()).length() + source.rest_bone(side.shin(), side.foot()).length()
        };
        let ours: f64 = Side::BOTH.into_iter().map(length).sum();
        let theirs: f64 = Side::BOTH.into_iter().map(clip_length).sum();
        Self { rest_clip_from_part: align, scale: ours / theirs }
    }

    fn pose(&self, source: &Source<'_>, values: &[f64], body: &Body) -> Pose {
        let (rotations, positions) = source.world(values);
        let world: [Quat; Part::COUNT] =
            std::array::from_fn(|part| rotations[source.joint(Part::ALL[part])] * self.rest_clip_from_part[part]);
        let hips = Side::BOTH.map(|side| positions[source.joint(side.thigh())]);
        let rest = body.rest_joints();
        let rest_hips = 0.5 * (rest[Part::LeftThigh.index()] + rest[Part::RightThigh.index()]);
        let root_from_hips = world[Part::Pelvis.index()] * (rest[Part::Pelvis.index()] - rest_hips);
        Pose::from_world_rotations(0.5 * self.scale * (hips[0] + hips[1]) + root_from_hips, &world)
    }
}

/// Feet are flat on the floor in our template pose. In a clip's rest pose they are level from heel to toe, but lean with
/// the shin where the legs are splayed; they may also point outwards by another angle than ours.
fn foot_alignment(source: &Source<'_>, body: &Body, side: Side) -> Quat {
    let shin = source.rest_bone(side.shin(), side.foot());
    let lean = Quat::from_rotation_z(shin.x.atan2(-shin.y));
    let theirs = lean.conjugate() * source.rest_foot(side);
    let ours = foot_direction(body, side);
    let yaw = |direction: Vec3| direction.x.atan2(direction.z);
    lean * Quat::from_rotation_y(yaw(theirs) - yaw(ours))
}

/// From heel to toes in the template pose.
fn foot_direction(body: &Body, side: Side) -> Vec3 {
    let ankle = body.rest_joints()[side.foot().index()];
    let of_foot =
        body.model().vertex_parts().iter().zip(body.rest_vertices()).filter(|(part, _)| **part == side.foot());
    let farthest = of_foot.map(|(_, x)| *x).max_by(|a, b| a.z.total_cmp(&b.z)).unwrap_or(ankle + Vec3::Z);
    let heel = body.model().vertex_parts().iter().zip(body.rest_vertices()).filter(|(part, _)| **part == side.foot());
    let heel = heel.map(|(_, x)| *x).min_by(|a, b| a.z.total_cmp(&b.z)).unwrap_or(ankle);
    farthest - heel
}

impl Source<'_> {
    /// World rotation and position (clip units) of every joint in a frame.
    fn world(&self, values: &[f64]) -> (Vec<Quat>, Vec<Vec3>) {
        let joints = &self.clip().joints;
        let (mut rotations, mut positions) = (Vec::with_capacity(joints.len()), Vec::with_capacity(joints.len()));
        for joint in joints {
            let (mut turn, mut shift) = (Quat::IDENTITY, joint.offset);
            let mut moved = Vec3::ZERO;
            for (channel, value) in joint.channels.iter().zip(&values[joint.first_channel..]) {
                let angle = value.to_radians();
                match channel {
                    Channel::XPosition => moved.x = *value,
                    Channel::YPosition => moved.y = *value,
                    Channel::ZPosition => moved.z = *value,
                    Channel::XRotation => turn *= Quat::from_rotation_x(angle),
                    Channel::YRotation => turn *= Quat::from_rotation_y(angle),
                    Channel::ZRotation => turn *= Quat::from_rotation_z(angle),
                }
            }
            shift += moved;
            match joint.parent {
                Some(parent) => {
                    let above: Quat = rotations[parent];
                    let at: Vec3 = positions[parent];
                    positions.push(at + above * shift);
                    rotations.push(above * turn);
                }
                None => {
                    positions.push(shift);
                    rotations.push(turn);
                }
            }
        }
        (rotations, positions)
    }
}

/// The names of the skeletons whose clips can be read.
pub fn known_skeletons() -> impl Iterator<Item = &'static str> {
    Family::ALL.iter().map(|family| family.name)
}
