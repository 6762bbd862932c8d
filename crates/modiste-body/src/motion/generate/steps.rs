//! Going by steps: where and when each foot is set down, and a body that follows.

use modiste_core::{Quat, Vec3};

use super::actor::{Actor, Figure, Foot};
use super::{FPS, ease};
use crate::motion::filter::smooth_scalars;
use crate::motion::floor::place_on_floor;
use crate::motion::leg::Side;
use crate::{Body, Motion};

/// Standing still before the first and after the last step (s).
const PAUSE: f64 = 0.45;

/// Share of a step's time in which both feet bear: a fifth of the cycle of two (Winter 2009).
const DOUBLE_SUPPORT: f64 = 0.2;

/// Toes down when the foot leaves the floor after a full step, toes up when the heel meets it (radians).
const TOE_OFF: f64 = 0.55;
const HEEL_STRIKE: f64 = -0.3;

/// One step: the foot leaves the floor, moves, and is set down.
#[derive(Debug, Clone, Copy)]
struct Step {
    side: Side,
    lift: f64,
    land: f64,
    /// Where the ankle is when the foot is flat again.
    to: Foot,
    /// How much of the rolling of a full step the foot does.
    roll: f64,
}

impl Step {
    /// Pitch (radians, toes up) of the foot that comes down on its heel; it begins to flatten just before it lands.
    fn heel(&self, t: f64) -> f64 {
        HEEL_STRIKE * self.roll * (1.0 - ease(t, self.land - 0.1, self.land + 0.14))
    }
}

/// A plan of steps with the time that it takes (s) and the length of a full step (m).
struct Plan {
    steps: Vec<Step>,
    seconds: f64,
    stride: f64,
    /// How high the ankle is lifted (m).
    lift: f64,
}

/// Walking straight ahead: comfortable step length and cadence scale with the leg (Winter 2009).
pub(super) fn walk(body: &Body, seconds: f64) -> Motion {
    let actor = Actor::new(body);
    let leg = actor.leg_length();
    let stride = 0.8 * leg;
    // A pendulum's time: 0.55 s a step for a leg of 0.82 m.
    let time = 0.55 * (leg / 0.82).sqrt();
    let count = (((seconds - 2.0 * PAUSE) / time).round() as usize).max(2);
    let mut steps = Vec::with_capacity(count);
    let mut gone = 0.0;
    for index in 0..count {
        let side = if index % 2 == 0 { Side::Right } else { Side::Left };
        let ends = index == 0 || index + 1 == count;
        // The first and last step cover half as much: from and to feet side by side.
        gone += if index == 0 {
            0.5 * stride
        } else if ends {
            0.0
        } else {
            0.5 * stride
        };
        let ahead = if index + 1 == count { gone } else { gone + if index == 0 { 0.0 } else { 0.5 * stride } };
        let mut to = actor.planted(side);
        to.ankle.z += ahead;
        gone = ahead;
        let lift = PAUSE + index as f64 * time;
        steps.push(Step {
            side,
            lift,
            land: lift + (1.0 - DOUBLE_SUPPORT) * time,
            to,
            roll: if ends { 0.6 } else { 1.0 },
        });
    }
    let seconds = PAUSE + count as f64 * time + PAUSE;
    follow(&actor, body, &Plan { steps, seconds, stride, lift: 0.035 * leg })
}

/// Turning on the spot to the left.
pub(super) fn turn(body: &Body, seconds: f64) -> Motion {
    let actor = Actor::new(body);
    let time = 0.5;
    let pairs = (((seconds - 2.0 * PAUSE) / (2.0 * time)).round() as usize).max(1);
    let mut steps = Vec::with_capacity(2 * pairs);
    for index in 0..2 * pairs {
        let side = if index % 2 == 0 { Side::Left } else { Side::Right };
        let yaw = std::f64::consts::FRAC_PI_4 * (index / 2 + 1) as f64;
        let flat = actor.planted(side);
        let ankle = Quat::from_rotation_y(yaw) * super::horizontal(flat.ankle) + Vec3::Y * flat.ankle.y;
        let lift = PAUSE + index as f64 * time;
        steps.push(Step { side, lift, land: lift + 0.7 * time, to: Foot { ankle, yaw, pitch: 0.0 }, roll: 0.35 });
    }
    let seconds = PAUSE + 2.0 * pairs as f64 * time + PAUSE;
    follow(&actor, body, &Plan { steps, seconds, stride: 0.6, lift: 0.05 })
}

impl Plan {
    /// Where a foot is at a time, and how much it bears (0 in the air, 1 on the floor).
    fn foot(&self, actor: &Actor<'_>, side: Side, t: f64) -> (Foot, f64) {
        let mut from = actor.planted(side);
        let mut last: Option<&Step> = None;
        for step in self.steps.iter().filter(|step| step.side == side) {
            let time = step.land - step.lift;
            if t < step.lift {
                // Rolling over the toes begins while the foot still bears.
                let off = TOE_OFF * step.roll * ease(t, step.lift - 0.55 * time, step.lift + 0.15 * time);
                return (actor.rolled(side, from, off + last.map_or(0.0, |step| step.heel(t))), 1.0);
            }
            if t < step.land {
                return (self.swing(actor, step, from, t), 0.0);
            }
            from = step.to;
            last = Some(step);
        }
        (actor.rolled(side, from, last.map_or(0.0, |step| step.heel(t))), 1.0)
    }

    /// The foot in the air: from rolled over its toes to just before its heel touches.
    fn swing(&self, actor: &Actor<'_>, step: &Step, from: Foot, t: f64) -> Foot {
        let time = step.land - step.lift;
        let s = (t - step.lift) / time;
        let off = TOE_OFF * step.roll * ease(t, step.lift - 0.55 * time, step.lift + 0.15 * time);
        let start = actor.rolled(step.side, from, off * (1.0 - ease(s, 0.1, 0.75)));
        let on = HEEL_STRIKE * step.roll * ease(s, 0.45, 0.95);
        let end = actor.rolled(step.side, step.to, on.max(step.heel(t)));
        let way = ease(s, 0.0, 1.0);
        let bump = self.lift * (std::f64::consts::PI * s).sin().powi(2);
        Foot {
            ankle: start.ankle.lerp(end.ankle, way) + Vec3::Y * bump,
            yaw: start.yaw + (end.yaw - start.yaw) * way,
            pitch: start.pitch + end.pitch,
        }
    }
}

/// The body that goes with a plan: pelvis between the feet and towards the bearing one, arms against the legs.
fn follow(actor: &Actor<'_>, body: &Body, plan: &Plan) -> Motion {
    let count = (plan.seconds * FPS).round() as usize + 1;
    let feet: Vec<[(Foot, f64); 2]> =
        (0..count).map(|frame| Side::BOTH.map(|side| plan.foot(actor, side, frame as f64 / FPS))).collect();
    let track = |cutoff: f64, value: &dyn Fn(&[(Foot, f64); 2]) -> f64| -> Vec<f64> {
        smooth_scalars(&feet.iter().map(value).collect::<Vec<f64>>(), cutoff, FPS)
    };
    let stand = actor.standing();
    let middle = |feet: &[(Foot, f64); 2]| 0.5 * (feet[0].0.ankle + feet[1].0.ankle);
    let home = 0.5 * (stand.feet[0].ankle + stand.feet[1].ankle);
    let yaw = track(0.9, &|feet| 0.5 * (feet[0].0.yaw + feet[1].0.yaw));
    let x = track(0.8, &|feet| middle(feet).x);
    let z = track(0.8, &|feet| middle(feet).z);
    let bearing = track(2.0, &|feet| feet[0].1 - feet[1].1);
    let heading: Vec<Vec3> = yaw.iter().map(|yaw| Quat::from_rotation_y(*yaw) * Vec3::Z).collect();
    let ahead: Vec<f64> = feet
        .iter()
        .zip(&heading)
        .map(|(feet, heading)| (feet[0].0.ankle - feet[1].0.ankle).dot(*heading) / plan.stride)
        .collect();
    let ahead = smooth_scalars(&ahead, 2.2, FPS);

    let mut figures: Vec<Figure> = (0..count)
        .map(|frame| {
            let mut figure = stand.clone();
            let (d, b) = (ahead[frame], bearing[frame]);
            let facing = Quat::from_rotation_y(yaw[frame]);
            let aside = facing * Vec3::X * (0.32 * b * actor.stance());
            figure.pelvis =
                stand.pelvis + Vec3::new(x[frame], 0.0, z[frame]) - facing * super::horizontal(home) + aside;
            figure.pelvis_turn = facing * Quat::from_rotation_y(-0.1 * d) * Quat::from_rotation_z(0.045 * b);
            figure.spine = [
                Quat::from_rotation_y(0.1 * d)
                    * Quat::from_rotation_z(-0.04 * b)
                    * Quat::from_rotation_x(0.03 * d.abs()),
                Quat::from_rotation_y(0.08 * d) * Quat::from_rotation_z(-0.01 * b),
                Quat::from_rotation_y(-0.06 * d),
                Quat::IDENTITY,
            ];
            for side in Side::BOTH {
                let swing = -side.sign() * d;
                let arm = &mut figure.arms[side.index()];
                arm.swing += 0.38 * swing + 0.04 * d.abs();
                arm.elbow += 0.12 * d.abs() + 0.16 * swing.max(0.0);
                figure.feet[side.index()] = feet[frame][side.index()].0;
            }
            figure
        })
        .collect();
    settle_height(actor, &mut figures);
    let mut motion = Motion { fps: FPS, frames: figures.iter().map(|figure| actor.pose(figure)).collect() };
    place_on_floor(&mut motion, body);
    motion
}

/// The pelvis as high as the bearing legs let it: up when a leg passes below, down with the feet apart.
fn settle_height(actor: &Actor<'_>, figures: &mut [Figure]) {
    let reach: Vec<f64> = figures
        .iter()
        .map(|figure| {
            let legs = Side::BOTH.map(|side| actor.highest_pelvis(side, figure));
            legs[0].min(legs[1]).min(figure.pelvis.y)
        })
        .collect();
    let smooth = smooth_scalars(&reach, 2.5, FPS);
    for ((figure, smooth), reach) in figures.iter_mut().zip(smooth).zip(reach) {
        // Never so high that a leg falls short by more than its last bit of stretch.
        figure.pelvis.y = smooth.min(reach + 0.008);
    }
}
