//! The rods against closed forms.

use modiste_core::Vec3;

use super::block::{Block, Forces, Frame, Make, SEGMENTS};
use super::lanes::Lane3;
use super::material::GRAVITY;
use crate::POINTS;

const LENGTH: f64 = 0.3;

fn forces(step: f64, drag: f64, gravity: Vec3) -> Forces {
    Forces { step: step as f32, drag: drag as f32, friction: 0.0, gravity: Lane3::splat(gravity) }
}

fn frame(tangent: Vec3) -> Frame {
    let first = tangent.any_orthonormal_vector();
    Frame { first: Lane3::splat(first), second: Lane3::splat(tangent.cross(first)), tangent: Lane3::splat(tangent) }
}

fn straight(direction: Vec3) -> [Lane3; POINTS] {
    std::array::from_fn(|i| Lane3::splat(LENGTH * i as f64 / SEGMENTS as f64 * direction))
}

fn settle(block: &mut Block, root: Frame, forces: &Forces, steps: usize) {
    for _ in 0..steps {
        block.step(Lane3::default(), root, Lane3::default(), forces);
    }
}

#[test]
fn a_cantilever_sags_by_wl4_over_8ei() {
    // Euler and Bernoulli: tip deflection g L⁴ / (8 B) with B = EI/μ, for small deflections.
    for bending_length in [0.4f64, 0.6] {
        let bending = GRAVITY * bending_length.powi(3);
        let make = Make { bending, twist_ratio: 0.7, root_stiffness: 1.0, held_tip: false };
        let forces = forces(1.0 / 360.0, 20.0, GRAVITY * Vec3::NEG_Y);
        let root = frame(Vec3::X);
        let mut block = Block::new(straight(Vec3::X), root, make, &forces);
        settle(&mut block, root, &forces, 4000);
        let sag = -block.x[POINTS - 1].get(3).y;
        let wanted = GRAVITY * LENGTH.powi(4) / (8.0 * bending);
        assert!((sag / wanted - 1.0).abs() < 0.03, "sag {sag}, wanted {wanted}");
        assert!(block.v[POINTS - 1].get(3).length() < 1e-3);
    }
}

#[test]
fn a_limp_hair_held_at_both_ends_hangs_in_a_catenary() {
    let make = Make { bending: 0.0, twist_ratio: 0.7, root_stiffness: 1.0, held_tip: true };
    let forces = forces(1.0 / 360.0, 8.0, GRAVITY * Vec3::NEG_Y);
    // A zigzag of full length between ends that are nearer together.
    let span: f64 = 0.2;
    let rise = (LENGTH.powi(2) - span.powi(2)).sqrt();
    let rest: [Lane3; POINTS] = std::array::from_fn(|i| {
        let up = if i % 2 == 0 { 0.0 } else { rise / SEGMENTS as f64 };
        Lane3::splat(Vec3::new(span * i as f64 / SEGMENTS as f64, up, 0.0))
    });
    let root = frame(Vec3::X);
    let mut block = Block::new(rest, root, make, &forces);
    settle(&mut block, root, &forces, 8000);
    // y = a (cosh(x/a) − cosh(s/2a)), with 2 a sinh(s/2a) = L.
    let length = |a: f64| 2.0 * a * (span / (2.0 * a)).sinh();
    let (mut low, mut high) = (0.02, 1.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if length(middle) > LENGTH { low = middle } else { high = middle }
    }
    let sag = low * ((span / (2.0 * low)).cosh() - 1.0);
    let found = -block.x[POINTS / 2].get(0).y;
    assert!((found / sag - 1.0).abs() < 0.01, "sag {found}, wanted {sag}");
    for i in 0..POINTS {
        let p = block.x[i].get(0);
        let wanted = low * (((p.x - span / 2.0) / low).cosh() - (span / (2.0 * low)).cosh());
        assert!((p.y - wanted).abs() < 0.003, "point {i}: {} and {wanted}", p.y);
    }
}

#[test]
fn a_hanging_chain_swings_with_the_period_of_the_bessel_zero() {
    // Bernoulli 1733: ω = (j₀₁ / 2) √(g / L), j₀₁ = 2.40483; the first mode is J₀(j₀₁ √(s / L)), s from the tip.
    let make = Make { bending: 0.0, twist_ratio: 0.7, root_stiffness: 1.0, held_tip: false };
    let forces = forces(1.0 / 720.0, 0.0, GRAVITY * Vec3::NEG_Y);
    let root = frame(Vec3::NEG_Y);
    let bessel = |x: f64| {
        let mut term = 1.0;
        let mut sum = 1.0;
        for k in 1..30 {
            term *= -(x * x / 4.0) / f64::from(k * k);
            sum += term;
        }
        sum
    };
    let rest: [Lane3; POINTS] = std::array::from_fn(|i| {
        let s = 1.0 - i as f64 / SEGMENTS as f64;
        let away = 0.01 * bessel(2.404_826 * s.sqrt());
        Lane3::splat(Vec3::new(away, -LENGTH * i as f64 / SEGMENTS as f64, 0.0))
    });
    let mut block = Block::new(rest, root, make, &forces);
    let mut crossings = Vec::new();
    let mut last = rest[POINTS - 1].get(0).x;
    for step in 1..4000 {
        block.step(Lane3::default(), root, Lane3::default(), &forces);
        let x = block.x[POINTS - 1].get(0).x;
        if last > 0.0 && x <= 0.0 {
            crossings.push(f64::from(step) - x / (x - last));
        }
        last = x;
    }
    let period = (crossings[2] - crossings[0]) / 2.0 / 720.0;
    let wanted = std::f64::consts::TAU / (0.5 * 2.404_826 * (GRAVITY / LENGTH).sqrt());
    assert!((period / wanted - 1.0).abs() < 0.02, "period {period}, wanted {wanted}");
}

#[test]
fn a_heavy_tip_twists_a_bent_hair_by_torque_times_length_over_gj() {
    // A hook: straight along −Y, then a turn towards X at the last joint; a push along Z on the tip twists the shaft.
    // Balance: the angle grows linearly along the shaft, and the sum of the torques of the joints beyond is the torque at
    // the hook, F · arm.
    let turn = SEGMENTS - 1;
    let l = LENGTH / SEGMENTS as f64;
    let rest: [Lane3; POINTS] = std::array::from_fn(|i| {
        let down = -l * i.min(turn) as f64;
        let across = l * i.saturating_sub(turn) as f64;
        Lane3::splat(Vec3::new(across, down, 0.0))
    });
    let push = 0.02;
    let bending = 9.81 * 0.1f64.powi(3);
    let make = Make { bending, twist_ratio: 0.05, root_stiffness: 1.0, held_tip: false };
    let forces = forces(1.0 / 720.0, 8.0, Vec3::new(0.0, 0.0, push));
    let root = frame(Vec3::NEG_Y);
    let mut block = Block::new(rest, root, make, &forces);
    settle(&mut block, root, &forces, 12_000);
    // Only the mass beyond the hook has an arm about the shaft: half a segment at the distance l.
    let torque = push * 0.5 * l;
    let softness = l * l / (bending * 0.05);
    let wanted = torque * softness * (0.5 + (turn - 1) as f64);
    let found = f64::from(block.twist_of(turn - 1, 0)).abs();
    assert!((found / wanted - 1.0).abs() < 0.06, "twist {found}, wanted {wanted}");
}

#[test]
fn the_elastic_push_is_the_slope_of_the_energy() {
    // A gently curved rod, bent further: joints are smooth away from right-angle turns.
    let rest: [Lane3; POINTS] = std::array::from_fn(|i| {
        let t = 0.12 * i as f64;
        Lane3::splat(0.16 * Vec3::new(t.sin(), t.cos() - 1.0, 0.0))
    });
    // Steps so short that the reaction is not held back.
    let forces = forces(1e-6, 0.0, Vec3::ZERO);
    let tangent = (rest[1].get(0) - rest[0].get(0)).normalize();
    let root = frame(tangent);
    let make = Make { bending: 1e-3, twist_ratio: 0.7, root_stiffness: 1.0, held_tip: false };
    let mut block = Block::new(rest, root, make, &forces);
    assert!(block.elastic_push(root).iter().all(|push| push.get(0).length() < 2e-2), "at rest nothing pushes");
    for (i, x) in block.x.iter_mut().enumerate().skip(1) {
        let t = i as f64;
        // In the plane of the rod, where carrying the frame along adds no twist.
        x.set(0, x.get(0) + 0.004 * Vec3::new((0.4 * t).sin(), (0.3 * t).cos() - 1.0, 0.0) * (0.2 * t).min(1.0));
    }
    let push = block.elastic_push(root);
    let scale = push.iter().map(|push| push.get(0).length()).fold(0.0, f64::max);
    for point in 1..POINTS {
        for axis in [Vec3::X, Vec3::Y] {
            let start = block.x[point].get(0);
            let step = 2e-4;
            let mut energy = [0.0; 2];
            for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
                block.x[point].set(0, start + sign * step * axis);
                energy[side] = block.energy(root, 0);
            }
            block.x[point].set(0, start);
            let slope = (energy[1] - energy[0]) / (2.0 * step);
            let found = push[point].get(0).dot(axis);
            assert!((found + slope).abs() < 0.02 * scale, "point {point}: push {found}, slope {slope}");
        }
    }
}

#[test]
fn segments_keep_their_length_while_the_root_is_shaken() {
    let make = Make { bending: 9.81 * 0.04f64.powi(3), twist_ratio: 0.7, root_stiffness: 1.0, held_tip: false };
    let forces = forces(1.0 / 360.0, 3.0, GRAVITY * Vec3::NEG_Y);
    let root = frame(Vec3::X);
    let mut block = Block::new(straight(Vec3::X), root, make, &forces);
    let mut worst = 0.0f64;
    for step in 0..1000 {
        let t = f64::from(step) / 360.0;
        let at = Vec3::new(0.1 * (9.0 * t).sin(), 0.02 * (23.0 * t).sin(), 0.05 * (14.0 * t).sin());
        block.step(Lane3::splat(at), root, Lane3::default(), &forces);
        for pair in block.x.windows(2) {
            worst = worst.max((pair[1].get(0).distance(pair[0].get(0)) * SEGMENTS as f64 / LENGTH - 1.0).abs());
        }
    }
    assert!(worst < 0.02, "a segment is off by {worst}");
}
