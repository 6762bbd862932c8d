//! Joining motions.

use super::floor::place_on_floor;
use modiste_core::{Quat, Vec3};

use crate::{Body, BodyError, Motion, Part, Pose};

/// The way from one pose to another in `seconds`, starting and ending at rest; both ends included.
pub fn transition(from: &Pose, to: &Pose, seconds: f64, fps: f64) -> Motion {
    let count = (seconds * fps).round().max(1.0) as usize;
    let eased = |frame: usize| {
        let s = frame as f64 / count as f64;
        s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
    };
    Motion { fps, frames: (0..=count).map(|frame| from.interpolate(to, eased(frame))).collect() }
}

/// The motion after `seconds` in which the body comes into its first frame from the template pose, in the same place and
/// facing the same way: cloth that was draped in the template pose can follow.
///
/// # Errors
/// A motion without frames.
pub fn from_template(motion: &Motion, body: &Body, seconds: f64) -> Result<Motion, BodyError> {
    let Some(first) = motion.frames.first() else {
        return Err(BodyError::Motion("it has no frames".to_owned()));
    };
    let facing = first.rotation(Part::Pelvis) * Vec3::Z;
    let mut template = body.template_pose();
    template.set_rotation(Part::Pelvis, Quat::from_rotation_y(facing.x.atan2(facing.z)));
    template.root_translation.x = first.root_translation.x;
    template.root_translation.z = first.root_translation.z;
    let mut lead = transition(&template, first, seconds, motion.fps);
    lead.frames.pop();
    let height = first.root_translation.y;
    place_on_floor(&mut lead, body);
    // The lead is put on the floor by itself; what the motion's first frame stands above it (a jump) is eased in.
    let count = lead.frames.len();
    if let Some(last) = lead.frames.last() {
        let gap = height - last.root_translation.y;
        for (frame, pose) in lead.frames.iter_mut().enumerate() {
            let s = (frame + 1) as f64 / (count + 1) as f64;
            pose.root_translation.y += gap.max(0.0) * s * s * (3.0 - 2.0 * s);
        }
    }
    lead.frames.extend(motion.frames.iter().cloned());
    Ok(lead)
}

/// Motions one after another. Each is turned about the vertical and moved on the floor to where the one before ends, and
/// `seconds` of transition lie between them.
///
/// # Errors
/// Motions of different rates.
pub fn concatenate(motions: &[Motion], seconds: f64) -> Result<Motion, BodyError> {
    let Some((first, rest)) = motions.split_first() else {
        return Err(BodyError::Motion("there is nothing to join".to_owned()));
    };
    let mut joined = first.clone();
    for next in rest {
        if (next.fps - joined.fps).abs() > 1e-9 * joined.fps {
            return Err(BodyError::Motion(format!(
                "rates of {} and {} frames a second cannot be joined",
                joined.fps, next.fps
            )));
        }
        let (Some(end), Some(start)) = (joined.frames.last().cloned(), next.frames.first()) else { continue };
        let heading = |pose: &Pose| {
            let facing = pose.rotation(Part::Pelvis) * Vec3::Z;
            facing.x.atan2(facing.z)
        };
        let turn = Quat::from_rotation_y(heading(&end) - heading(start));
        let shift = end.root_translation - turn * start.root_translation;
        let moved = |pose: &Pose| {
            let mut pose = pose.clone();
            pose.root_translation = turn * pose.root_translation + Vec3::new(shift.x, 0.0, shift.z);
            let turned = turn * pose.rotation(Part::Pelvis);
            pose.set_rotation(Part::Pelvis, turned);
            pose
        };
        let between = transition(&end, &moved(start), seconds, joined.fps);
        let inner = 1..between.frames.len() - 1;
        joined.frames.extend_from_slice(&between.frames[inner]);
        joined.frames.extend(next.frames.iter().map(moved));
    }
    Ok(joined)
}

#[cfg(test)]
mod tests {
    use modiste_core::Vec3;

    use super::{concatenate, from_template, transition};
    use crate::motion::filter::angle_between;
    use crate::motion::{generate, test_body};
    use crate::{Motion, Part, Pose};

    #[test]
    fn a_transition_has_both_ends() {
        let (from, mut to) = (Pose::template(Vec3::ZERO), Pose::template(Vec3::X));
        to.rotations[4] = Vec3::new(0.3, -0.2, 0.9);
        let motion = transition(&from, &to, 1.0, 30.0);
        assert_eq!(motion.frames.len(), 31);
        assert_eq!(motion.frames[0].root_translation, Vec3::ZERO);
        assert!(motion.frames[30].rotations[4].distance(to.rotations[4]) < 1e-12);
    }

    #[test]
    fn motions_join_without_a_jump() {
        let body = test_body::body();
        let parts = [generate::turn(&body, 3.0).unwrap(), generate::squat(&body, 2.4).unwrap()];
        let joined = concatenate(&parts, 0.3).unwrap();
        for pair in joined.frames.windows(2) {
            assert!(pair[0].root_translation.distance(pair[1].root_translation) < 0.06);
            assert!(angle_between(pair[0].rotation(Part::Pelvis), pair[1].rotation(Part::Pelvis)) < 0.2);
        }
        let other = Motion { fps: 25.0, ..parts[1].clone() };
        assert!(concatenate(&[parts[0].clone(), other], 0.3).is_err());
    }

    #[test]
    fn a_lead_starts_in_the_template_pose() {
        let body = test_body::body();
        let motion = generate::walk(&body, 3.0).unwrap();
        let led = from_template(&motion, &body, 1.0).unwrap();
        assert_eq!(led.frames.len(), motion.frames.len() + 30);
        for part in Part::ALL {
            assert!(led.frames[0].rotations[part.index()].length() < 1e-9);
        }
        for pair in led.frames.windows(2) {
            assert!(pair[0].root_translation.distance(pair[1].root_translation) < 0.08);
        }
    }
}
