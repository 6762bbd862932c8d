//! Limbs kept out of the body.
//!
//! A capture was made by a lean actor; on a wide body the same angles put hands and elbows into the hips and thighs into
//! each other, and no garment can be dressed between them. Here upper arms are turned at the shoulder just so far that
//! the arm's skin keeps a gap to the body's, smoothly over time, and thighs are parted by one angle for the whole motion,
//! so that feet that stand keep standing.

use std::collections::BTreeSet;

use modiste_core::{Quat, SurfacePoint, TriangleBvh, Vec3, pseudonormal, signed_distance};
use rayon::prelude::*;

use super::filter::smooth_vectors;
use super::floor::place_on_floor;
use super::leg::Side;
use crate::{Body, Motion, Part, Pose, rotation_vector};

/// Gap (m) between limbs and body: room for what is worn on both.
pub const DEFAULT_GAP: f64 = 0.012;

/// How far (m) from a limb the body is looked for.
const SEARCH: f64 = 0.12;

/// Distance (m) between the tested vertices of an arm and of a leg.
const SPACING: [f64; 2] = [0.025, 0.04];

/// Share of the way from the root joint to the next in which a limb may touch the body: armpit and crotch.
const TOUCHING_SHARE: f64 = 0.7;

/// Most that a limb is turned in all and in one step (radians), and most steps.
const LARGEST_TURN: f64 = 0.7;
const LARGEST_STEP: f64 = 0.3;
const STEPS: usize = 8;

/// Most that each thigh is parted (radians), and the share of frames that may stay less clear: legs that cross in a
/// dance are meant to.
const LARGEST_PARTING: f64 = 0.15;
const UNCLEAR: f64 = 0.2;

/// Rounds over the whole motion: smoothing takes some of the turn away, the next round puts it back.
const ROUNDS: usize = 2;

/// How often limbs are looked at (Hz): turns are smoothed below a fraction of it.
const LOOKS: f64 = 10.0;

/// A turn is held for this long before and after it is needed (s) and smoothed below this frequency (Hz).
const HOLD: f64 = 0.15;
const SMOOTH: f64 = 1.6;

/// A limb that is kept clear.
struct Limb {
    /// The part that is turned.
    root: Part,
    /// Tested vertices with the gap (m) that each has to keep.
    samples: Vec<(u32, f64)>,
    /// The faces that they have to keep from.
    obstacle: TriangleBvh,
}

/// Turns upper arms and thighs outwards where they come nearer to the body than `gap` (m); says how far at most
/// (radians), 0 if nothing had to be done.
///
/// Near the root joints, and wherever limb and body are nearer than `gap` in the template pose already, less is asked.
/// Feet keep their turn in the world, and the motion is put on the floor again if the legs were parted.
pub fn clear_limbs(motion: &mut Motion, body: &Body, gap: f64) -> f64 {
    let parting = part_legs(motion, body, gap);
    let arms = Side::BOTH.map(|side| Limb::arm(body, side, gap));
    let mut largest = parting;
    for _ in 0..ROUNDS {
        let needed = needed_turns(&arms, body, motion);
        let mut done = true;
        for (index, arm) in arms.iter().enumerate() {
            let track: Vec<Vec3> = needed.iter().map(|frame| frame[index]).collect();
            if track.iter().all(|turn| turn.length() < 1e-3) {
                continue;
            }
            done = false;
            let held = hold(&track, (HOLD * motion.fps).ceil() as usize);
            for (pose, turn) in motion.frames.iter_mut().zip(smooth_vectors(&held, SMOOTH, motion.fps)) {
                let turned = Quat::from_scaled_axis(turn) * pose.rotation(arm.root);
                pose.set_rotation(arm.root, turned);
                largest = largest.max(turn.length());
            }
        }
        if done {
            break;
        }
    }
    largest
}

/// Parts both thighs by the same angle in every frame; returns it (radians).
fn part_legs(motion: &mut Motion, body: &Body, gap: f64) -> f64 {
    let legs = Side::BOTH.map(|side| Limb::leg(body, side, gap));
    // Each thigh takes half of what would clear one alone, and only what is sideways.
    let mut sideways: Vec<f64> =
        needed_turns(&legs, body, motion).iter().map(|turns| 0.5 * turns[0].z.max(-turns[1].z).max(0.0)).collect();
    sideways.sort_by(f64::total_cmp);
    let last = sideways.len().saturating_sub(1) as f64;
    let parting = sideways.get((last * (1.0 - UNCLEAR)) as usize).copied().unwrap_or(0.0).min(LARGEST_PARTING);
    if parting < 1e-3 {
        return 0.0;
    }
    for pose in &mut motion.frames {
        for side in Side::BOTH {
            let foot_before = pose.world_quaternions()[side.foot().index()];
            let turned = Quat::from_rotation_z(side.sign() * parting) * pose.rotation(side.thigh());
            pose.set_rotation(side.thigh(), turned);
            let shin = pose.world_quaternions()[side.shin().index()];
            pose.set_rotation(side.foot(), shin.conjugate() * foot_before);
        }
    }
    place_on_floor(motion, body);
    parting
}

impl Limb {
    fn arm(body: &Body, side: Side, gap: f64) -> Self {
        let obstacle = |part: Part| {
            matches!(
                part,
                Part::Pelvis
                    | Part::Abdomen
                    | Part::Chest
                    | Part::LeftThigh
                    | Part::RightThigh
                    | Part::LeftShin
                    | Part::RightShin
            )
        };
        Self::new(body, side, [side.upper_arm(), side.forearm(), side.hand()], &obstacle, gap)
    }

    fn leg(body: &Body, side: Side, gap: f64) -> Self {
        let other = match side {
            Side::Left => [Part::RightThigh, Part::RightShin, Part::RightFoot],
            Side::Right => [Part::LeftThigh, Part::LeftShin, Part::LeftFoot],
        };
        Self::new(body, side, [side.thigh(), side.shin(), side.foot()], &|part| other.contains(&part), gap)
    }

    fn new(body: &Body, side: Side, chain: [Part; 3], is_obstacle: &dyn Fn(Part) -> bool, gap: f64) -> Self {
        let model = body.model();
        let rest = body.rest_vertices();
        let faces: Vec<u32> =
            (0u32..).zip(model.face_parts()).filter(|(_, part)| is_obstacle(**part)).map(|(face, _)| face).collect();
        let obstacle = TriangleBvh::of_faces(model.topology(), rest, &faces);
        let [root, middle, _] = chain;
        let (from, to) = (body.rest_joints()[root.index()], body.rest_joints()[middle.index()]);
        let along = |x: Vec3| (x - from).dot(to - from) / (to - from).length_squared();
        let on_limb: Vec<u32> = (0u32..)
            .zip(model.vertex_parts().iter().zip(rest))
            .filter(|(_, (part, x))| chain.contains(part) && (**part != root || along(**x) > TOUCHING_SHARE))
            .map(|(vertex, _)| vertex)
            .collect();
        let samples = spread(&on_limb, rest, SPACING[usize::from(root == side.thigh())])
            .into_iter()
            .map(|vertex| {
                let x = rest[vertex as usize];
                let near = obstacle.closest_point(rest, x, SEARCH);
                let distance = near.map_or(SEARCH, |at| signed_distance(model.topology(), rest, x, &at));
                (vertex, gap.min(0.8 * distance))
            })
            .collect();
        Self { root, samples, obstacle }
    }
}

/// Vertices that are about `spacing` (m) apart: one for each cell of a grid.
fn spread(vertices: &[u32], x: &[Vec3], spacing: f64) -> Vec<u32> {
    let cell = |vertex: u32| (x[vertex as usize] / spacing).floor().to_array().map(|c| c as i64);
    let mut seen = BTreeSet::new();
    vertices.iter().copied().filter(|&vertex| seen.insert(cell(vertex))).collect()
}

/// For each frame and each limb the turn (rotation vector in the frame of the part that carries it) that clears it.
fn needed_turns(limbs: &[Limb; 2], body: &Body, motion: &Motion) -> Vec<[Vec3; 2]> {
    let start = || (Vec::new(), limbs.each_ref().map(|limb| limb.obstacle.clone()));
    let stride = ((motion.fps / LOOKS) as usize).max(1);
    let seen: Vec<[Vec3; 2]> = (motion.frames.par_iter().step_by(stride))
        .map_init(start, |(vertices, trees), pose: &Pose| {
            body.pose_without_contact(pose, vertices);
            let joints = body.joints(pose);
            let world = pose.world_quaternions();
            std::array::from_fn(|index| {
                let root = limbs[index].root;
                trees[index].refit(vertices);
                let turn = clearing_turn(&limbs[index], body, &trees[index], vertices, joints[root.index()]);
                let carrier = root.parent().unwrap_or(Part::Pelvis);
                world[carrier.index()].conjugate() * rotation_vector(turn)
            })
        })
        .collect();
    (0..motion.frames.len()).map(|frame| seen[((frame + stride / 2) / stride).min(seen.len() - 1)]).collect()
}

/// The world rotation about `pivot` that lifts every sample of the limb to its gap: the deepest one first, again and
/// again. A displacement `e n` of a point at lever `r` takes the turn `e (r × n) / |r × n|²`.
fn clearing_turn(limb: &Limb, body: &Body, tree: &TriangleBvh, vertices: &[Vec3], pivot: Vec3) -> Quat {
    let topology = body.model().topology();
    let mut turn = Quat::IDENTITY;
    for _ in 0..STEPS {
        let mut worst: Option<(f64, Vec3, SurfacePoint)> = None;
        for &(vertex, gap) in &limb.samples {
            let x = pivot + turn * (vertices[vertex as usize] - pivot);
            let Some(at) = tree.closest_point(vertices, x, SEARCH) else { continue };
            let missing = gap - signed_distance(topology, vertices, x, &at);
            if missing > worst.as_ref().map_or(5e-4, |(most, ..)| *most) {
                worst = Some((missing, x, at));
            }
        }
        let Some((missing, x, at)) = worst else { break };
        let normal = pseudonormal(topology, vertices, &at).normalize_or_zero();
        let axis = (x - pivot).cross(normal);
        if axis.length_squared() < 1e-6 {
            break;
        }
        let step = (axis * (missing / axis.length_squared())).clamp_length_max(LARGEST_STEP);
        let whole = rotation_vector(Quat::from_scaled_axis(step) * turn);
        turn = Quat::from_scaled_axis(whole.clamp_length_max(LARGEST_TURN));
    }
    turn
}

/// The largest turn within `reach` frames of each: a turn must already be there when it is needed.
fn hold(track: &[Vec3], reach: usize) -> Vec<Vec3> {
    (0..track.len())
        .map(|frame| {
            let near = &track[frame.saturating_sub(reach)..(frame + reach + 1).min(track.len())];
            near.iter().copied().fold(Vec3::ZERO, |most, turn| if turn.length() > most.length() { turn } else { most })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use modiste_core::{Quat, Vec3};

    use super::{DEFAULT_GAP, clear_limbs, hold};
    use crate::motion::test_body;
    use crate::{Body, Motion, Part};

    /// Arms swung into the trunk in the middle of a second.
    fn elbows_in(body: &Body) -> Motion {
        let frames = (0..31)
            .map(|frame| {
                let mut pose = body.template_pose();
                let into = (f64::from(frame) / 30.0 * std::f64::consts::PI).sin();
                pose.set_rotation(Part::LeftUpperArm, Quat::from_rotation_z(-0.84 * into));
                pose
            })
            .collect();
        Motion { fps: 30.0, frames }
    }

    fn hand_x(body: &Body, motion: &Motion, frame: usize) -> f64 {
        body.joints(&motion.frames[frame])[Part::LeftHand.index()].x
    }

    #[test]
    fn an_arm_in_the_hip_is_turned_out_and_nothing_else_moves() {
        let body = test_body::body();
        let before = elbows_in(&body);
        let mut after = before.clone();
        let turned = clear_limbs(&mut after, &body, DEFAULT_GAP);
        assert!((0.02..0.4).contains(&turned), "{turned}");
        let (was, is) = (hand_x(&body, &before, 15), hand_x(&body, &after, 15));
        assert!(is > was + 0.01, "from {was} to {is}");
        for (a, b) in before.frames.iter().zip(&after.frames) {
            assert_eq!(a.rotations[Part::RightUpperArm.index()], b.rotations[Part::RightUpperArm.index()]);
            assert_eq!(a.rotations[Part::LeftThigh.index()], b.rotations[Part::LeftThigh.index()]);
        }
        for pair in after.frames.windows(2) {
            let step =
                pair[0].rotations[Part::LeftUpperArm.index()].distance(pair[1].rotations[Part::LeftUpperArm.index()]);
            assert!(step < 0.15, "{step}");
        }
    }

    #[test]
    #[expect(clippy::float_cmp, reason = "nothing is moved at all")]
    fn the_template_pose_is_clear() {
        let body = test_body::body();
        let mut motion = Motion { fps: 30.0, frames: vec![body.template_pose(); 3] };
        let before = motion.clone();
        assert_eq!(clear_limbs(&mut motion, &body, DEFAULT_GAP), 0.0);
        assert_eq!(motion, before);
    }

    #[test]
    fn a_turn_is_held_around_its_peak() {
        let mut track = vec![Vec3::ZERO; 9];
        track[4] = Vec3::X;
        let held = hold(&track, 2);
        assert_eq!(held.iter().filter(|turn| turn.length() > 0.5).count(), 5);
    }
}
