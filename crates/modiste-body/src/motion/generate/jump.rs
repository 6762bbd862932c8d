//! A jump on the spot.

use modiste_core::{Quat, Vec3};

use super::actor::{Actor, Figure};
use super::{ease, pulse, through};
use crate::motion::leg::Side;

/// Acceleration of a fall (m/s²).
const GRAVITY: f64 = 9.81;

/// How high the body rises in the air (m).
const HEIGHT: f64 = 0.22;

/// Toes down at take-off and landing (radians).
const TOES_DOWN: f64 = 0.6;

/// One jump at `t` seconds of `length`: crouch with the arms back, swing them up, fly, land in a crouch, stand up.
pub(super) fn jump(actor: &Actor<'_>, t: f64, length: f64) -> Figure {
    let speed = (2.0 * GRAVITY * HEIGHT).sqrt();
    let flight = 2.0 * speed / GRAVITY;
    // Push and landing take as long as accelerating evenly over the crouch does; what time is left is for the rest.
    let push = 0.26;
    let lowest = 0.36 * (length - flight - 2.0 * push) + 0.05;
    let takeoff = lowest + push;
    let touchdown = takeoff + flight;
    let landed = touchdown + push;

    let mut figure = actor.standing();
    let leg = actor.leg_length();
    let depth = 0.24 * leg;
    // The heels leave the floor before the toes do, which lifts the pelvis above its standing height.
    let toes = pulse(t, [lowest + 0.4 * push, takeoff, touchdown, touchdown + 0.7 * push]);
    let lifted =
        actor.rolled(Side::Left, actor.planted(Side::Left), TOES_DOWN).ankle.y - actor.ankle_height(Side::Left);
    let rise = if t <= lowest {
        -depth * ease(t, 0.05, lowest)
    } else if t < takeoff {
        hermite((t - lowest) / push, [-depth, lifted], [0.0, speed * push])
    } else if t < touchdown {
        let air = t - takeoff;
        lifted + speed * air - 0.5 * GRAVITY * air * air
    } else if t < landed {
        hermite((t - touchdown) / push, [lifted, -depth], [-speed * push, 0.0])
    } else {
        -depth * (1.0 - ease(t, landed, length - 0.05))
    };
    figure.pelvis.y += rise;
    let crouch = (-rise / depth).clamp(0.0, 1.0);
    figure.pelvis.z -= 0.1 * leg * crouch;
    figure.pelvis_turn = Quat::from_rotation_x(0.42 * crouch);
    figure.spine[0] = Quat::from_rotation_x(0.12 * crouch);
    figure.spine[2] = Quat::from_rotation_x(-0.2 * crouch);
    figure.spine[3] = Quat::from_rotation_x(-0.18 * crouch);

    let swing =
        through(t, &[(0.05, 0.02), (lowest, -0.75), (takeoff + 0.1, 2.1), (landed + 0.1, 0.35), (length - 0.05, 0.02)]);
    for arm in &mut figure.arms {
        arm.swing = swing;
        arm.out += 0.12 * pulse(t, [0.05, lowest, landed, length]);
        arm.elbow += 0.25 * pulse(t, [0.05, lowest, landed, length]) - 0.4 * ease(swing, 0.8, 1.6);
        arm.out += 0.25 * ease(swing, 0.8, 1.6);
    }
    let air = if (takeoff..touchdown).contains(&t) { rise - lifted } else { 0.0 };
    for side in Side::BOTH {
        let foot = actor.rolled(side, actor.planted(side), TOES_DOWN * toes);
        figure.feet[side.index()] = foot;
        figure.feet[side.index()].ankle += Vec3::Y * air;
    }
    figure
}

/// Cubic between two values with given slopes, over `s` from 0 to 1.
fn hermite(s: f64, [from, to]: [f64; 2], [slope_from, slope_to]: [f64; 2]) -> f64 {
    let (s2, s3) = (s * s, s * s * s);
    from * (2.0 * s3 - 3.0 * s2 + 1.0)
        + slope_from * (s3 - 2.0 * s2 + s)
        + to * (3.0 * s2 - 2.0 * s3)
        + slope_to * (s3 - s2)
}

#[cfg(test)]
mod tests {
    use super::hermite;

    #[test]
    fn the_cubic_meets_values_and_slopes() {
        let (values, slopes) = ([0.3, -1.0], [2.0, 0.5]);
        assert!((hermite(0.0, values, slopes) - 0.3).abs() < 1e-12);
        assert!((hermite(1.0, values, slopes) + 1.0).abs() < 1e-12);
        let slope = |s: f64| (hermite(s + 1e-6, values, slopes) - hermite(s - 1e-6, values, slopes)) / 2e-6;
        assert!((slope(0.0) - 2.0).abs() < 1e-6 && (slope(1.0) - 0.5).abs() < 1e-6);
    }
}
