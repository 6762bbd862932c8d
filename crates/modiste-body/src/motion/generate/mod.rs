//! Motions that need no file: what a garment does, anybody can see with these.
//!
//! Each starts and ends in the same relaxed standing pose. Feet are placed by inverse kinematics, so they do not slide.

mod actor;
mod gestures;
mod jump;
mod kick;
mod steps;

use modiste_core::Vec3;

use super::floor::place_on_floor;
use crate::{Body, BodyError, Motion, Pose};
use actor::{Actor, Figure};

/// Frames per second of every generated motion.
pub const FPS: f64 = 30.0;

/// Longest motion that is made (s).
const LONGEST: f64 = 600.0;

/// The relaxed standing pose that the generated motions start and end in, above the origin, facing +Z.
pub fn stand(body: &Body) -> Pose {
    let actor = Actor::new(body);
    let mut motion = Motion { fps: FPS, frames: vec![actor.pose(&actor.standing())] };
    place_on_floor(&mut motion, body);
    motion.frames.swap_remove(0)
}

/// Walking straight ahead (+Z) for about `seconds`, with a first and a last half step.
///
/// # Errors
/// Less than 2 s or more than 10 minutes.
pub fn walk(body: &Body, seconds: f64) -> Result<Motion, BodyError> {
    check("walk", seconds, 2.0)?;
    Ok(steps::walk(body, seconds))
}

/// Turning round on the spot to the left with small steps for about `seconds`, 45° for every two.
///
/// # Errors
/// Less than 2 s or more than 10 minutes.
pub fn turn(body: &Body, seconds: f64) -> Result<Motion, BodyError> {
    check("turn", seconds, 2.0)?;
    Ok(steps::turn(body, seconds))
}

/// Both arms sideways up over the head and down, then forwards up and down, in `seconds`.
///
/// # Errors
/// Less than 2 s or more than 10 minutes.
pub fn raise_arms(body: &Body, seconds: f64) -> Result<Motion, BodyError> {
    check("raise_arms", seconds, 2.0)?;
    Ok(perform(body, seconds, |actor, t| gestures::raise_arms(actor, t / seconds)))
}

/// Knee bends, about one in 2.4 s, for `seconds`.
///
/// # Errors
/// Less than 1.5 s or more than 10 minutes.
pub fn squat(body: &Body, seconds: f64) -> Result<Motion, BodyError> {
    check("squat", seconds, 1.5)?;
    let each = seconds / (seconds / 2.4).round().max(1.0);
    Ok(perform(body, seconds, |actor, t| gestures::squat(actor, (t / each).fract_or_end())))
}

/// Kicks forwards with the right leg, about one in 2.6 s, for `seconds`.
///
/// # Errors
/// Less than 2 s or more than 10 minutes.
pub fn kick(body: &Body, seconds: f64) -> Result<Motion, BodyError> {
    check("kick", seconds, 2.0)?;
    let each = seconds / (seconds / 2.6).round().max(1.0);
    Ok(perform(body, seconds, |actor, t| kick::kick(actor, (t / each).fract_or_end())))
}

/// Jumps on the spot, about one in 2.4 s, for `seconds`.
///
/// # Errors
/// Less than 2 s or more than 10 minutes.
pub fn jump(body: &Body, seconds: f64) -> Result<Motion, BodyError> {
    check("jump", seconds, 2.0)?;
    let each = seconds / (seconds / 2.4).round().max(1.0);
    Ok(perform(body, seconds, |actor, t| jump::jump(actor, each * (t / each).fract_or_end(), each)))
}

fn check(what: &str, seconds: f64, shortest: f64) -> Result<(), BodyError> {
    if (shortest..=LONGEST).contains(&seconds) {
        return Ok(());
    }
    Err(BodyError::Value {
        what: format!("length of `{what}`"),
        wanted: format!("{shortest} to {LONGEST} s"),
        found: seconds,
    })
}

/// Plays a figure over time and puts it on the floor.
fn perform(body: &Body, seconds: f64, figure: impl Fn(&Actor<'_>, f64) -> Figure) -> Motion {
    let actor = Actor::new(body);
    let count = (seconds * FPS).round() as usize;
    let frames = (0..=count).map(|frame| actor.pose(&figure(&actor, frame as f64 / FPS))).collect();
    let mut motion = Motion { fps: FPS, frames };
    place_on_floor(&mut motion, body);
    motion
}

/// Phase within a repeated movement: the fraction, but 1 at the very end rather than 0.
trait Phase {
    fn fract_or_end(self) -> f64;
}

impl Phase for f64 {
    fn fract_or_end(self) -> f64 {
        let fraction = self.fract();
        if fraction < 1e-9 && self > 0.5 { 1.0 } else { fraction }
    }
}

/// From 0 to 1 while `t` goes from `from` to `to`, starting and ending at rest without a jolt (minimum jerk).
fn ease(t: f64, from: f64, to: f64) -> f64 {
    let s = ((t - from) / (to - from)).clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// Up from 0 to 1 and down again over four times.
fn pulse(t: f64, [rise, top, fall, end]: [f64; 4]) -> f64 {
    ease(t, rise, top) * (1.0 - ease(t, fall, end))
}

/// Position between key positions at key times, each reached at rest.
fn through(t: f64, keys: &[(f64, f64)]) -> f64 {
    keys.windows(2).fold(keys[0].1, |value, pair| value + (pair[1].1 - pair[0].1) * ease(t, pair[0].0, pair[1].0))
}

/// The part of a vector that lies in the floor.
fn horizontal(x: Vec3) -> Vec3 {
    Vec3::new(x.x, 0.0, x.z)
}

#[cfg(test)]
mod tests {
    use modiste_core::{Quat, Vec3};

    use super::{FPS, ease, jump, kick, raise_arms, squat, stand, through, turn, walk};
    use crate::motion::filter::angle_between;
    use crate::motion::test_body;
    use crate::{Body, BodyError, Motion, Part};

    type Generator = fn(&Body, f64) -> Result<Motion, BodyError>;
    const ALL: [(&str, Generator); 6] =
        [("walk", walk), ("turn", turn), ("raise_arms", raise_arms), ("squat", squat), ("kick", kick), ("jump", jump)];

    #[test]
    fn every_motion_is_smooth_and_stands_at_both_ends() {
        let body = test_body::body();
        let standing = stand(&body);
        for (name, generate) in ALL {
            let motion = generate(&body, 5.0).unwrap();
            assert!((motion.duration() - 5.0).abs() < 1.5, "{name}: {}", motion.duration());
            for pair in motion.frames.windows(2) {
                for part in Part::ALL {
                    let speed = angle_between(pair[0].rotation(part), pair[1].rotation(part)) * FPS;
                    assert!(speed < 17.0, "{name}: {part:?} at {speed} rad/s");
                }
                assert!(pair[0].root_translation.distance(pair[1].root_translation) * FPS < 3.0, "{name}");
            }
            for end in [motion.frames.first().unwrap(), motion.frames.last().unwrap()] {
                for part in Part::ALL.into_iter().skip(1) {
                    let off = angle_between(end.rotation(part), standing.rotation(part));
                    assert!(off < 0.12, "{name}: {part:?} is {off} rad off");
                }
            }
        }
    }

    #[test]
    fn no_foot_goes_below_the_floor_and_some_foot_is_on_it() {
        let body = test_body::body();
        let mut vertices = Vec::new();
        for (name, generate) in ALL {
            let motion = generate(&body, 4.0).unwrap();
            let mut air = 0;
            for pose in &motion.frames {
                body.pose(pose, &mut vertices);
                let lowest = vertices.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
                assert!(lowest > -1e-9, "{name}: {lowest}");
                air += usize::from(lowest > 0.02);
            }
            let share = air as f64 / motion.frames.len() as f64;
            assert_eq!(share > 0.0, name == "jump", "{name}: {share} in the air");
        }
    }

    #[test]
    fn the_foot_that_bears_does_not_slide_in_walking() {
        let body = test_body::body();
        let motion = walk(&body, 6.0).unwrap();
        let rest = body.rest_joints()[Part::LeftFoot.index()].y;
        let mut flat_frames = 0;
        for pair in motion.frames.windows(2) {
            let [before, after] = [&pair[0], &pair[1]].map(|pose| (body.joints(pose), pose.world_quaternions()));
            for foot in [Part::LeftFoot, Part::RightFoot].map(Part::index) {
                let flat = |(joints, turns): &([Vec3; Part::COUNT], [Quat; Part::COUNT])| {
                    angle_between(turns[foot], Quat::IDENTITY) < 1e-3 && joints[foot].y < rest + 0.003
                };
                if flat(&before) && flat(&after) {
                    flat_frames += 1;
                    let slid = super::horizontal(after.0[foot] - before.0[foot]).length();
                    assert!(slid < 1e-3, "slid by {slid} m");
                }
            }
        }
        assert!(flat_frames > motion.frames.len() / 2, "only {flat_frames} feet stand flat");
        let gone = motion.frames.last().unwrap().root_translation - motion.frames[0].root_translation;
        assert!(gone.z > 3.0 && gone.x.abs() < 0.05, "{gone}");
    }

    #[test]
    fn impossible_lengths_are_refused() {
        let body = test_body::body();
        for (_, generate) in ALL {
            for seconds in [0.0, -1.0, f64::NAN, 1e9] {
                assert!(matches!(generate(&body, seconds), Err(BodyError::Value { .. })));
            }
        }
    }

    #[test]
    fn easing_meets_its_keys() {
        assert_eq!((ease(-1.0, 0.0, 1.0), ease(0.5, 0.0, 1.0), ease(2.0, 0.0, 1.0)), (0.0, 0.5, 1.0));
        let keys = [(0.0, 1.0), (1.0, 3.0), (2.0, -1.0)];
        for (t, value) in keys {
            assert!((through(t, &keys) - value).abs() < 1e-12);
        }
    }
}
