//! Movements with both feet where they stand.

use modiste_core::{Quat, Vec3};

use super::actor::{Actor, Figure};
use super::{pulse, through};
use crate::motion::leg::Side;

/// Arms sideways up and down in the first half of the phase (0 to 1), forwards up and down in the second.
pub(super) fn raise_arms(actor: &Actor<'_>, phase: f64) -> Figure {
    let mut figure = actor.standing();
    let sideways = pulse(phase, [0.03, 0.21, 0.27, 0.46]);
    let forwards = pulse(phase, [0.53, 0.72, 0.78, 0.97]);
    let both = sideways + forwards;
    for arm in &mut figure.arms {
        arm.out += sideways * 2.65 - forwards * 0.06;
        arm.swing += forwards * 2.75;
        arm.elbow += both * -0.18;
        arm.shrug = both * 0.28;
    }
    // Reaching up arches the back and lifts the face a little.
    figure.spine[1] = Quat::from_rotation_x(-0.08 * both);
    figure.spine[2] = Quat::from_rotation_x(-0.06 * both);
    figure
}

/// One knee bend in a phase from 0 to 1.
pub(super) fn squat(actor: &Actor<'_>, phase: f64) -> Figure {
    let mut figure = actor.standing();
    let depth = pulse(phase, [0.04, 0.42, 0.52, 0.95]);
    let leg = actor.leg_length();
    figure.pelvis += Vec3::new(0.0, -0.42 * leg * depth, -0.22 * leg * depth);
    figure.pelvis_turn = Quat::from_rotation_x(0.5 * depth);
    figure.spine = [
        Quat::from_rotation_x(0.16 * depth),
        Quat::from_rotation_x(0.04 * depth),
        Quat::from_rotation_x(-0.22 * depth),
        Quat::from_rotation_x(-0.25 * depth),
    ];
    for side in Side::BOTH {
        let arm = &mut figure.arms[side.index()];
        arm.swing = through(depth, &[(0.0, 0.02), (1.0, 1.75)]);
        arm.elbow = through(depth, &[(0.0, 0.3), (1.0, 0.12)]);
    }
    figure
}
