//! A kick forwards with the right leg.

use modiste_core::{Quat, Vec3};

use super::actor::{Actor, Figure, Foot};
use super::{pulse, through};
use crate::motion::leg::{Side, leg_bones};

/// One kick in a phase from 0 to 1: weight to the left, leg back, kick, knee drawn in, foot down.
pub(super) fn kick(actor: &Actor<'_>, phase: f64) -> Figure {
    let mut figure = actor.standing();
    let side = Side::Right;
    let bearing = pulse(phase, [0.02, 0.22, 0.74, 0.98]);
    let hip_flexion = through(phase, &[(0.14, 0.05), (0.34, -0.35), (0.5, 1.35), (0.64, 0.9), (0.86, 0.1)]);
    let knee_flexion = through(phase, &[(0.14, 0.15), (0.34, 1.25), (0.5, 0.15), (0.64, 1.2), (0.86, 0.15)]);
    let lean = through(phase, &[(0.2, 0.0), (0.34, 0.08), (0.5, -0.26), (0.66, -0.08), (0.92, 0.0)]);

    figure.pelvis.x += bearing * 0.86 * actor.stance();
    figure.pelvis_turn = Quat::from_rotation_z(0.05 * bearing) * Quat::from_rotation_x(lean);
    figure.spine[0] = Quat::from_rotation_z(-0.06 * bearing) * Quat::from_rotation_x(-0.55 * lean);
    figure.spine[1] = Quat::from_rotation_x(-0.3 * lean);
    let reach = pulse(phase, [0.3, 0.5, 0.6, 0.9]);
    let back = pulse(phase, [0.12, 0.34, 0.38, 0.52]);
    for arm in &mut figure.arms {
        arm.out += 0.75 * bearing;
        arm.elbow += 0.25 * bearing;
    }
    figure.arms[Side::Left.index()].swing += 0.75 * reach - 0.3 * back;
    figure.arms[side.index()].swing += 0.4 * back - 0.65 * reach;

    // The supporting leg decides the height, then the free one hangs from it.
    figure.pelvis.y = figure.pelvis.y.min(actor.highest_pelvis(Side::Left, &figure)) - 0.012 * bearing;
    let lifted = pulse(phase, [0.12, 0.24, 0.78, 0.94]);
    let planted = figure.feet[side.index()];
    let ankle = free_ankle(actor, &figure, side, hip_flexion, knee_flexion);
    let pitch =
        through(phase, &[(0.1, 0.0), (0.34, 0.7), (0.5, 0.45), (0.66, 0.15), (0.86, 0.0)]) - hip_flexion * lifted * 0.7;
    // Rolled over the toes while it still bears; never into the floor.
    let start = actor.rolled(side, planted, pitch.max(0.0));
    let mut ankle = start.ankle.lerp(ankle, lifted);
    ankle.y = ankle.y.max(start.ankle.y);
    figure.feet[side.index()] = Foot { ankle, yaw: 0.0, pitch };
    figure
}

/// Where the ankle is for given bends of hip and knee (radians), the leg straight below the hip being zero.
fn free_ankle(actor: &Actor<'_>, figure: &Figure, side: Side, hip_flexion: f64, knee_flexion: f64) -> Vec3 {
    let hip = figure.pelvis + figure.pelvis_turn * actor.hip_from_pelvis(side);
    let [thigh, shin] = leg_bones(actor.rest_joints(), side);
    let direction = |angle: f64| figure.pelvis_turn * (Quat::from_rotation_x(-angle) * Vec3::NEG_Y);
    hip + direction(hip_flexion) * thigh + direction(hip_flexion - knee_flexion) * shin
}
