//! Captured motion carried over to one of our bodies.
//!
//! Joints are matched by name. A clip's rest pose (arms out, legs in some clips splayed) is not our template pose, so the
//! world rotation of a part is the clip's, after a fixed rotation that takes our bone to the clip's rest bone:
//! `world_from_part = world_from_clip_joint(frame) · rest_clip_from_part`. Bones then point where the clip's do,
//! whatever the rest poses. Positions are not used but for the root, which is scaled by leg length.

use modiste_core::{Progress, Quat, Vec3, swing_twist};
use modiste_io::bvh::{BvhClip, Channel};

use super::clear::{DEFAULT_GAP, clear_limbs};
use super::filter::{low_pass, remove_spikes, resample, soften_steps};
use super::floor::place_on_floor;
use super::leg::{Side, leg_bones};
use super::skeleton::{Family, Source};
use crate::{Body, BodyError, Motion, Part, Pose, rotation_vector};

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

/// The clip on a body: cleaned, resampled, standing on the floor (y = 0), starting above the origin and facing +Z, its limbs
/// kept out of each other and of the trunk ([`clear_limbs`]).
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
    clear_limbs(&mut motion, body, DEFAULT_GAP);
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
            Side::BOTH.iter().any(|side| {
                rotation_vector(swing_twist(pose.rotation(side.thigh()), Vec3::Y).1).length()
                    > std::f64::consts::FRAC_PI_2
            })
        });
        2 * turned.count() <= range.len()
    };
    let stretches: Vec<std::ops::Range<usize>> = bounds.windows(2).map(|pair| pair[0]..pair[1]).collect();
    let longest = |ranges: Vec<&std::ops::Range<usize>>| ranges.into_iter().max_by_key(|range| range.len()).cloned();
    longest(stretches.iter().filter(|range| sound(range)).collect())
        .or_else(|| longest(stretches.iter().collect()))
        .unwrap_or(0..0)
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
    let parts = body.model().vertex_parts().iter().zip(body.rest_vertices());
    let foot: Vec<Vec3> = parts.filter(|(part, _)| **part == side.foot()).map(|(_, x)| *x).collect();
    let toes = foot.iter().max_by(|a, b| a.z.total_cmp(&b.z));
    let heel = foot.iter().min_by(|a, b| a.z.total_cmp(&b.z));
    toes.zip(heel).map_or(Vec3::Z, |(toes, heel)| *toes - *heel)
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

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use modiste_core::{Progress, Quat, Silent, Vec3};
    use modiste_io::bvh::{BvhClip, BvhJoint, Channel};

    use super::{Alignment, RetargetOptions, retarget};
    use crate::motion::leg::Side;
    use crate::motion::skeleton::{Family, Source};
    use crate::motion::test_body;
    use crate::{BodyError, Part};

    /// A skeleton of the CMU family in a T-pose with legs that stand apart, in units of about 5 cm.
    fn skeleton() -> Vec<BvhJoint> {
        let left = |part: Part| match part {
            Part::LeftThigh | Part::RightThigh => [1.6, -1.7, 0.8],
            Part::LeftShin | Part::RightShin => [2.2, -6.2, 0.0],
            Part::LeftFoot | Part::RightFoot => [2.7, -7.5, 0.0],
            Part::LeftUpperArm | Part::RightUpperArm => [3.4, 0.5, 0.2],
            Part::LeftForearm | Part::RightForearm => [5.4, 0.0, 0.0],
            Part::LeftHand | Part::RightHand => [2.4, 0.0, 0.0],
            Part::Pelvis | Part::LeftShoulder | Part::RightShoulder => [0.0, 0.0, 0.0],
            _ => [0.0, 2.0, 0.0],
        };
        let rotations = [Channel::ZRotation, Channel::YRotation, Channel::XRotation];
        let positions = [Channel::XPosition, Channel::YPosition, Channel::ZPosition];
        Part::ALL
            .into_iter()
            .map(|part| {
                let mut offset = Vec3::from_array(left(part));
                if part.name().starts_with("right") {
                    offset.x = -offset.x;
                }
                let is_foot = matches!(part, Part::LeftFoot | Part::RightFoot);
                BvhJoint {
                    name: Family::ALL[0].joint_name(part).to_owned(),
                    parent: part.parent().map(Part::index),
                    offset,
                    channels: if part == Part::Pelvis { [positions, rotations].concat() } else { rotations.to_vec() },
                    first_channel: if part == Part::Pelvis { 0 } else { 3 + 3 * part.index() },
                    end_site: is_foot.then_some(Vec3::new(0.1, -0.3, 2.0)),
                }
            })
            .collect()
    }

    /// Channel values of a frame that turns joints by rotation about Z, Y, X (degrees).
    fn frame(turns: &[(Part, [f64; 3])]) -> Vec<f64> {
        let mut values = vec![0.0; 3 + 3 * Part::COUNT];
        values[1] = 16.0;
        for (part, angles) in turns {
            values[3 + 3 * part.index()..][..3].copy_from_slice(angles);
        }
        values
    }

    fn clip(frames: Vec<Vec<f64>>) -> BvhClip {
        BvhClip { joints: skeleton(), frame_time: 1.0 / 120.0, frames }
    }

    /// Arms hanging, legs straight down, as somebody stands.
    fn standing() -> Vec<f64> {
        let splay = 2.2f64.atan2(6.2).to_degrees();
        frame(&[
            (Part::LeftUpperArm, [-80.0, 0.0, 0.0]),
            (Part::RightUpperArm, [80.0, 0.0, 0.0]),
            (Part::LeftThigh, [-splay, 0.0, 0.0]),
            (Part::RightThigh, [splay, 0.0, 0.0]),
        ])
    }

    #[test]
    fn bones_point_where_the_clips_do() {
        let body = test_body::body();
        let turns: Vec<(Part, [f64; 3])> = Part::ALL
            .into_iter()
            .map(|part| {
                let i = part.index() as f64;
                (part, [40.0 * (i * 1.3).sin(), 35.0 * (i * 0.7).cos(), 50.0 * (i * 2.1).sin()])
            })
            .collect();
        let clip = clip(vec![frame(&turns)]);
        let source = Source::new(&clip).unwrap();
        let pose = Alignment::new(&source, &body).pose(&source, &clip.frames[0], &body);
        let ours = body.joints(&pose);
        let (_, theirs) = source.world(&clip.frames[0]);
        for side in Side::BOTH {
            let bones = [
                (side.upper_arm(), side.forearm()),
                (side.forearm(), side.hand()),
                (side.thigh(), side.shin()),
                (side.shin(), side.foot()),
            ];
            for (from, to) in bones {
                let found = (ours[to.index()] - ours[from.index()]).normalize();
                let wanted = (theirs[source.joint(to)] - theirs[source.joint(from)]).normalize();
                assert!(found.distance(wanted) < 1e-9, "{from:?}: {found} instead of {wanted}");
            }
        }
        let trunk = pose.world_quaternions()[Part::Chest.index()];
        assert!((trunk * Vec3::Y).distance(source.world(&clip.frames[0]).0[2] * Vec3::Y) < 1e-9);
    }

    #[test]
    fn standing_stands_flat_on_the_floor_at_the_origin() {
        let body = test_body::body();
        let turned: Vec<f64> = standing().iter().enumerate().map(|(i, v)| if i == 4 { 70.0 } else { *v }).collect();
        let motion = retarget(&clip(vec![turned; 120]), &body, &RetargetOptions::default(), &Silent).unwrap();
        assert_eq!(motion.frames.len(), 29);
        let mut vertices = Vec::new();
        for pose in &motion.frames {
            body.pose(pose, &mut vertices);
            let lowest = vertices.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
            assert!(lowest.abs() < 1e-6);
            assert!((pose.rotation(Part::Pelvis) * Vec3::Z).distance(Vec3::Z) < 1e-6, "faces +Z");
            assert!(pose.root_translation.x.abs() < 1e-6 && pose.root_translation.z.abs() < 1e-6);
            for foot in [Part::LeftFoot, Part::RightFoot] {
                let up = pose.world_quaternions()[foot.index()] * Vec3::Y;
                // Shins are splayed a little more than thighs.
                assert!(up.distance(Vec3::Y) < 6e-3, "{foot:?} is flat: {up}");
            }
        }
    }

    #[derive(Default)]
    struct Listener(Mutex<Vec<String>>);

    impl Progress for Listener {
        fn start(&self, _: &str, _: usize) {}
        fn advance(&self, _: &str, _: usize) {}
        fn finish(&self, _: &str) {}
        fn warn(&self, message: &str) {
            self.0.lock().unwrap().push(message.to_owned());
        }
    }

    #[test]
    fn a_flipped_thigh_is_cut_off_and_told() {
        let mut frames = vec![standing(); 300];
        for frame in &mut frames[200..] {
            frame[3 + 3 * Part::RightThigh.index() + 1] += 180.0;
        }
        let listener = Listener::default();
        let body = test_body::body();
        let motion = retarget(&clip(frames), &body, &RetargetOptions::default(), &listener).unwrap();
        assert!((45..=50).contains(&motion.frames.len()), "{}", motion.frames.len());
        let told = listener.0.lock().unwrap();
        assert!(told[0].contains("only frames 4 to 199 of 300"), "{told:?}");
    }

    #[test]
    fn bad_clips_are_refused_with_the_reason() {
        let body = test_body::body();
        let refuse = |clip: &BvhClip| retarget(clip, &body, &RetargetOptions::default(), &Silent).unwrap_err();
        let good = clip(vec![standing(); 120]);

        let mut unknown = good.clone();
        unknown.joints[7].name = "LeftElbowish".to_owned();
        let BodyError::UnknownJoint { joint, known } = refuse(&unknown) else { panic!("accepted") };
        assert!(joint == "LeftElbowish" && known.contains("LeftUpLeg") && known.contains("lThigh"));

        let mut missing = good.clone();
        missing.joints.pop();
        for frame in &mut missing.frames {
            frame.truncate(3 * Part::COUNT);
        }
        assert!(matches!(refuse(&missing), BodyError::MissingJoint { joint: "RightFoot", .. }));

        let mut broken = good.clone();
        broken.frames[60][9] = f64::NAN;
        let BodyError::Motion(reason) = refuse(&broken) else { panic!("accepted") };
        assert!(reason.contains("frame 60"), "{reason}");

        broken.frames[60].pop();
        assert!(matches!(refuse(&broken), BodyError::Motion(_)));
        assert!(matches!(refuse(&clip(vec![standing(); 12])), BodyError::Motion(_)));
        assert!(matches!(refuse(&clip(Vec::new())), BodyError::Motion(_)));
        let still = BvhClip { frame_time: 0.0, ..good };
        assert!(matches!(refuse(&still), BodyError::Value { .. }));
    }

    #[test]
    fn the_wrong_rate_can_be_put_right() {
        let body = test_body::body();
        let options = RetargetOptions { clip_fps: Some(60.0), ..RetargetOptions::default() };
        let motion = retarget(&clip(vec![standing(); 120]), &body, &options, &Silent).unwrap();
        assert_eq!(motion.frames.len(), 58);
        let turn = motion.frames[0].rotation(Part::LeftUpperArm);
        assert!(turn.dot(Quat::IDENTITY).abs() < 0.99, "arms hang lower than in the template pose");
    }
}
