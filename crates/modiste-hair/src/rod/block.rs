//! Eight guides as discrete elastic rods, and one small step of their motion.
//!
//! Each guide is a chain of points with mass, joined by segments of fixed length `l`. Joint `j` between the segments `e_{j-1}`
//! and `e_j` has the energy `½ EI/l |ε_j|²` with the bending strain
//!
//! `ε_j = e_j/l − e_{j−1}/l − b_j`,
//!
//! whose length is the turning angle beyond that at rest. `b_j` is the turn at rest, kept in a material frame that is clamped
//! to the scalp at the root, carried along the rod without twist (parallel transport, Bergou et al. 2008), and turned about the
//! tangent by the twist `θ`. Twist is quasi-static: waves of twist run through a hair within microseconds, so that the twist
//! between two segments is the torque of everything beyond over `GJ/l`.
//!
//! With `b_j` held over a small step the energy is quadratic with one constant matrix for all three coordinates, five
//! diagonals wide, which is factored once: backward Euler then costs a forward and a backward sweep. Segments are brought back
//! to their length by one Newton step on all of them together (a tridiagonal system), points out of the contact planes, and
//! velocities follow from positions.

use super::lanes::{LANES, Lane, Lane3};
use crate::POINTS;

/// Segments of a guide.
pub(super) const SEGMENTS: usize = POINTS - 1;
/// Strength of the clamp at the root relative to a joint: the middle of the first segment is half a segment away.
const CLAMP: f32 = 2.0;
/// Joints from the root on that styling stiffens.
const STYLED: usize = 5;
/// Mass of a point that is held in place, in masses of a free one.
const HELD: f32 = 1e9;

/// The plane that a point may not go through.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Plane {
    /// Unit normal; zero where there is nothing near.
    pub normal: Lane3,
    /// Distance from the origin along the normal that points must keep at the end of the step (m).
    pub offset: Lane,
    /// How fast that distance grows (m/s).
    pub rate: Lane,
    /// How the surface moves (m/s).
    pub velocity: Lane3,
}

/// A frame carried by eight roots: two normals and the tangent.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Frame {
    pub first: Lane3,
    pub second: Lane3,
    pub tangent: Lane3,
}

/// What a step needs to know that is the same for all guides.
#[derive(Debug, Clone, Copy)]
pub(super) struct Forces {
    /// Length of the step (s).
    pub step: f32,
    /// Air drag (1/s) at the tip; a third of it at the root, where hair is sheltered.
    pub drag: f32,
    /// Coulomb friction.
    pub friction: f32,
    /// Gravity (m/s²).
    pub gravity: Lane3,
}

/// Eight guides.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub x: [Lane3; POINTS],
    pub v: [Lane3; POINTS],
    pub planes: [Plane; POINTS],
    /// Segment length (m).
    pub length: Lane,
    /// Bending stiffness EI/(μ l⁴) (1/s²).
    stiffness: Lane,
    /// Twisting stiffness (GJ/μ)/l² (m²/s²), as torques here are per mass of a point.
    twisting: Lane,
    /// Stiffness of each joint relative to `stiffness`.
    profile: [f32; SEGMENTS],
    /// The turn at rest of each joint in the material frame of the segment before it.
    rest_turns: [Lane3; SEGMENTS],
    /// Twist of each segment (rad).
    twist: [Lane; SEGMENTS],
    /// Inverse mass of each point, 1 for a free one; 0 at the root.
    weights: [Lane; POINTS],
    factor: Factor,
}

/// `M (1 + h drag) + h² k K = L D Lᵀ`, five diagonals; row `p` belongs to point `p + 1`.
#[derive(Debug, Clone)]
struct Factor {
    inverse: [Lane; SEGMENTS],
    below: [Lane; SEGMENTS],
    below2: [Lane; SEGMENTS],
}

/// Physical make of the guides of a block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Make {
    /// EI / μ (m⁴/s²).
    pub bending: f64,
    /// GJ / EI.
    pub twist_ratio: f64,
    /// How much stiffer the joint at the root is than those beyond, as styling makes it; falls to 1 over a few joints.
    pub root_stiffness: f64,
    /// Whether the tip is held where it is, as in a catenary.
    pub held_tip: bool,
}

impl Block {
    /// Guides at rest: `rest` are their points, `frame` the material frame at their roots.
    pub(super) fn new(rest: [Lane3; POINTS], frame: Frame, make: Make, forces: &Forces) -> Self {
        let mut length = Lane::default();
        for i in 0..SEGMENTS {
            length += (rest[i + 1] - rest[i]).length() * Lane::splat(1.0 / SEGMENTS as f32);
        }
        let bending = make.bending as f32;
        let stiffness = length.map(|l| bending / (l * l * l * l));
        let twisting = length.map(|l| bending * make.twist_ratio as f32 / (l * l));
        let mut weights = [Lane::splat(1.0); POINTS];
        weights[0] = Lane::splat(0.0);
        // Half a segment hangs on the tip, a whole one on every other point.
        weights[POINTS - 1] = Lane::splat(if make.held_tip { 0.0 } else { 2.0 });
        let profile = std::array::from_fn(|joint| {
            let near = (1.0 - joint as f32 / STYLED as f32).max(0.0);
            let clamp = if joint == 0 { CLAMP } else { 1.0 };
            clamp * (1.0 + (make.root_stiffness as f32 - 1.0) * near)
        });
        let factor = Factor::new(stiffness, &profile, &weights, forces);
        let mut block = Self {
            x: rest,
            v: [Lane3::default(); POINTS],
            planes: [Plane::default(); POINTS],
            length,
            stiffness,
            twisting,
            profile,
            rest_turns: [Lane3::default(); SEGMENTS],
            twist: [Lane::default(); SEGMENTS],
            weights,
            factor,
        };
        block.learn_rest(frame);
        block
    }

    /// Takes the present shape for the shape at rest.
    fn learn_rest(&mut self, root: Frame) {
        let mut frame = root;
        for i in 0..SEGMENTS {
            let edge = self.x[i + 1] - self.x[i];
            let tangent = edge * edge.length().recip();
            let turn = tangent - frame.tangent;
            self.rest_turns[i] =
                Lane3 { x: turn.dot(frame.first), y: turn.dot(frame.second), z: turn.dot(frame.tangent) };
            frame = frame.carried(tangent);
        }
    }

    /// One step with the root at `root` and its frame `frame` at the end of it; `air` is the wind (m/s).
    pub(super) fn step(&mut self, root: Lane3, frame: Frame, air: Lane3, forces: &Forces) {
        let h = Lane::splat(forces.step);
        let before = self.x;
        self.x[0] = root;
        let mut push = [Lane3::default(); POINTS];
        self.bend(frame, &mut push, forces.step);
        self.predict(&push, air, forces);
        self.lengthen();
        for point in 1..POINTS {
            self.x[point] = contact(self.x[point], before[point], &self.planes[point], forces, self.weights[point]);
        }
        let rate = h.recip();
        for point in 0..POINTS {
            self.v[point] = (self.x[point] - before[point]) * rate;
        }
    }

    /// Adds the elastic accelerations times mass (m/s²) at the present positions, and moves the twist towards its balance.
    fn bend(&mut self, root: Frame, push: &mut [Lane3; POINTS], step: f32) {
        let k = self.stiffness;
        // The reaction is not part of the implicit matrix: where a joint swings faster than the step, it is held back.
        let steady = k.map(|k| 1.0 / (1.0 + 4.0 * k * step * step));
        let mut frame = root;
        let mut torques = [Lane::default(); SEGMENTS];
        let mut resistances = [Lane::default(); SEGMENTS];
        for joint in 0..SEGMENTS {
            let edge = self.x[joint + 1] - self.x[joint];
            // The twist turns the frame of the segment before; the clamp at the root does not twist.
            let twist = if joint == 0 { Lane::default() } else { self.twist[joint - 1] };
            let turn = frame.twisted(self.rest_turns[joint], twist);
            let behind = if joint == 0 { frame.tangent * self.length } else { self.x[joint] - self.x[joint - 1] };
            let strain = edge - behind - turn * self.length;
            let k = k * Lane::splat(self.profile[joint]);
            let force = strain * k;
            push[joint + 1] -= force;
            push[joint] += force;
            if joint > 0 {
                push[joint] += force;
                push[joint - 1] -= force;
                // The turn at rest follows the segment before it, which therefore feels a torque.
                let reaction = turn.cross(force).cross(frame.tangent) * steady;
                push[joint] += reaction;
                push[joint - 1] -= reaction;
            }
            // The torque of joint j acts on segment j − 1.
            let across = frame.tangent.cross(turn);
            torques[joint] = force.dot(across) * self.length;
            resistances[joint] = across.dot(across) * k * self.length * self.length;
            frame = frame.carried(edge * edge.length().max(Lane::splat(1e-9)).recip());
        }
        self.relax_twist(&torques, &resistances);
    }

    /// One Newton step of the twist towards its balance: at each segment the difference of the twisting torques on its two
    /// sides is the torque of the bend after it, which falls as the frame turns with the bend. A tridiagonal system.
    fn relax_twist(&mut self, torques: &[Lane; SEGMENTS], resistances: &[Lane; SEGMENTS]) {
        let twisting = self.twisting;
        // Half a segment lies between the clamp and the middle of the first.
        let clamp = twisting * Lane::splat(CLAMP);
        let mut upper = [Lane::default(); SEGMENTS];
        let mut change = [Lane::default(); SEGMENTS];
        for segment in 0..SEGMENTS {
            let before = if segment == 0 { clamp } else { twisting };
            let last = segment + 1 == SEGMENTS;
            let after = if last { Lane::default() } else { twisting };
            let mut gradient = before * self.twist[segment];
            if segment > 0 {
                gradient = gradient - before * self.twist[segment - 1];
            }
            let mut diagonal = before + after + Lane::splat(1e-20);
            if !last {
                gradient = gradient - after * (self.twist[segment + 1] - self.twist[segment]) - torques[segment + 1];
                diagonal += resistances[segment + 1];
            }
            let (upper_before, change_before) = if segment == 0 {
                (Lane::default(), Lane::default())
            } else {
                (upper[segment - 1], change[segment - 1])
            };
            let lower = if segment == 0 { Lane::default() } else { -before };
            let inverse = (diagonal - lower * upper_before).recip();
            upper[segment] = -after * inverse;
            change[segment] = (-gradient - lower * change_before) * inverse;
        }
        for segment in (0..SEGMENTS).rev() {
            if segment + 1 < SEGMENTS {
                change[segment] = change[segment] - upper[segment] * change[segment + 1];
            }
            self.twist[segment] += change[segment];
        }
    }

    /// Backward Euler in the quadratic energy: velocities, then positions.
    fn predict(&mut self, push: &[Lane3; POINTS], air: Lane3, forces: &Forces) {
        let h = Lane::splat(forces.step);
        let mut v = [Lane3::default(); SEGMENTS];
        for row in 0..SEGMENTS {
            let point = row + 1;
            let mass = self.weights[point].map(mass);
            let outside = forces.gravity + air * Lane::splat(drag_at(point, forces.drag));
            let mut right = (self.v[point] + outside * h) * mass + push[point] * h;
            if row >= 1 {
                right -= v[row - 1] * self.factor.below[row];
            }
            if row >= 2 {
                right -= v[row - 2] * self.factor.below2[row];
            }
            v[row] = right;
        }
        for row in (0..SEGMENTS).rev() {
            let mut value = v[row] * self.factor.inverse[row];
            if row + 1 < SEGMENTS {
                value -= v[row + 1] * self.factor.below[row + 1];
            }
            if row + 2 < SEGMENTS {
                value -= v[row + 2] * self.factor.below2[row + 2];
            }
            v[row] = value;
        }
        for row in 0..SEGMENTS {
            let moving = self.weights[row + 1].map(|weight| if weight > 0.0 { 1.0 } else { 0.0 });
            self.x[row + 1] += v[row] * h * moving;
        }
    }

    /// Brings all segments back to their length together: one Newton step on `|e_i| = l`, corrections by inverse mass.
    fn lengthen(&mut self) {
        let mut normals = [Lane3::default(); SEGMENTS];
        let mut stretch = [Lane::default(); SEGMENTS];
        for i in 0..SEGMENTS {
            let edge = self.x[i + 1] - self.x[i];
            let length = edge.length().max(Lane::splat(1e-9));
            normals[i] = edge * length.recip();
            stretch[i] = length - self.length;
        }
        // Thomas algorithm on A λ = C with A = J W Jᵀ.
        let mut upper = [Lane::default(); SEGMENTS];
        let mut multiplier = [Lane::default(); SEGMENTS];
        for i in 0..SEGMENTS {
            let diagonal = self.weights[i] + self.weights[i + 1] + Lane::splat(1e-6);
            let lower = if i == 0 { Lane::default() } else { -(self.weights[i] * normals[i - 1].dot(normals[i])) };
            let (upper_before, before) =
                if i == 0 { (Lane::default(), Lane::default()) } else { (upper[i - 1], multiplier[i - 1]) };
            let inverse = (diagonal - lower * upper_before).recip();
            if i + 1 < SEGMENTS {
                upper[i] = -(self.weights[i + 1] * normals[i].dot(normals[i + 1])) * inverse;
            }
            multiplier[i] = (stretch[i] - lower * before) * inverse;
        }
        for i in (0..SEGMENTS - 1).rev() {
            multiplier[i] = multiplier[i] - upper[i] * multiplier[i + 1];
        }
        for i in 0..SEGMENTS {
            let pull = normals[i] * multiplier[i];
            self.x[i + 1] -= pull * self.weights[i + 1];
            self.x[i] += pull * self.weights[i];
        }
    }

    /// Twist of a segment of one guide (rad).
    #[cfg(test)]
    pub(super) fn twist_of(&self, segment: usize, lane: usize) -> f32 {
        self.twist[segment].0[lane]
    }

    /// Elastic energy over the mass per length of a point (m²/s²) of one guide at the present positions, for tests.
    #[cfg(test)]
    pub(super) fn energy(&self, root: Frame, lane: usize) -> f64 {
        let mut frame = root;
        let mut sum = 0.0;
        for joint in 0..SEGMENTS {
            let edge = self.x[joint + 1] - self.x[joint];
            let twist = if joint == 0 { Lane::default() } else { self.twist[joint - 1] };
            let turn = frame.twisted(self.rest_turns[joint], twist);
            let behind = if joint == 0 { frame.tangent * self.length } else { self.x[joint] - self.x[joint - 1] };
            let strain = (edge - behind - turn * self.length).get(lane);
            sum += 0.5 * f64::from(self.profile[joint]) * f64::from(self.stiffness.0[lane]) * strain.length_squared();
            frame = frame.carried(edge * edge.length().recip());
        }
        sum
    }

    /// The elastic push on every point, for tests.
    #[cfg(test)]
    pub(super) fn elastic_push(&mut self, root: Frame) -> [Lane3; POINTS] {
        let mut push = [Lane3::default(); POINTS];
        let twist = self.twist;
        self.bend(root, &mut push, 0.0);
        self.twist = twist;
        push
    }
}

impl Frame {
    /// The frame turned by the smallest rotation that takes its tangent to `tangent` (parallel transport).
    #[inline(always)]
    fn carried(self, tangent: Lane3) -> Self {
        // v' = v + c × v + c × (c × v) / (1 + cos) with c = t × t'.
        let axis = self.tangent.cross(tangent);
        let weight = (Lane::splat(1.0) + self.tangent.dot(tangent)).max(Lane::splat(1e-3)).recip();
        let across = axis.cross(self.first);
        let first = self.first + across + axis.cross(across) * weight;
        // Kept at right angles to the tangent against the drift of rounding.
        let first = first - tangent * first.dot(tangent);
        let first = first * first.length().max(Lane::splat(1e-9)).recip();
        Self { first, second: tangent.cross(first), tangent }
    }

    /// A vector of this frame after a turn of the frame about its tangent.
    #[inline(always)]
    fn twisted(&self, local: Lane3, twist: Lane) -> Lane3 {
        // A rotation exactly, by an angle that agrees with the twist to third order.
        let half = twist * Lane::splat(0.5);
        let square = half * half;
        let scale = (Lane::splat(1.0) + square).recip();
        let (cosine, sine) = ((Lane::splat(1.0) - square) * scale, (half + half) * scale);
        self.first * (cosine * local.x - sine * local.y)
            + self.second * (sine * local.x + cosine * local.y)
            + self.tangent * local.z
    }
}

impl Factor {
    fn new(stiffness: Lane, profile: &[f32; SEGMENTS], weights: &[Lane; POINTS], forces: &Forces) -> Self {
        let mut factor = Self { inverse: Default::default(), below: Default::default(), below2: Default::default() };
        let h = f64::from(forces.step);
        for lane in 0..LANES {
            let k = h * h * f64::from(stiffness.0[lane]);
            // Bands of the matrix: diagonal, first and second below it.
            let mut bands = [[0.0f64; SEGMENTS]; 3];
            for row in 0..SEGMENTS {
                let damping = 1.0 + h * f64::from(drag_at(row + 1, forces.drag));
                bands[0][row] = f64::from(mass(weights[row + 1].0[lane])) * damping;
            }
            bands[0][0] += f64::from(profile[0]) * k;
            for joint in 1..SEGMENTS {
                // x_{j+1} − 2 x_j + x_{j−1}; rows count from point 1, and the root is no unknown.
                let entries = [(joint as isize, 1.0), (joint as isize - 1, -2.0), (joint as isize - 2, 1.0)];
                for &(a, at_a) in &entries {
                    for &(b, at_b) in &entries {
                        if b >= 0 && a >= b {
                            bands[(a - b) as usize][a as usize] += k * f64::from(profile[joint]) * at_a * at_b;
                        }
                    }
                }
            }
            let mut pivots = [0.0f64; SEGMENTS];
            let mut lower = [[0.0f64; 2]; SEGMENTS];
            for row in 0..SEGMENTS {
                let second = if row >= 2 { bands[2][row] / pivots[row - 2] } else { 0.0 };
                let shared = if row >= 2 { second * pivots[row - 2] * lower[row - 1][0] } else { 0.0 };
                let first = if row >= 1 { (bands[1][row] - shared) / pivots[row - 1] } else { 0.0 };
                let mut pivot = bands[0][row];
                if row >= 1 {
                    pivot -= first * first * pivots[row - 1];
                }
                if row >= 2 {
                    pivot -= second * second * pivots[row - 2];
                }
                pivots[row] = pivot;
                lower[row] = [first, second];
                factor.inverse[row].0[lane] = (1.0 / pivot) as f32;
                factor.below[row].0[lane] = first as f32;
                factor.below2[row].0[lane] = second as f32;
            }
        }
        factor
    }
}

/// Mass of a point from its inverse; those that are held weigh much.
fn mass(weight: f32) -> f32 {
    if weight > 0.0 { 1.0 / weight } else { HELD }
}

/// Air drag (1/s) at a point: the hair around it shelters the root.
fn drag_at(point: usize, drag: f32) -> f32 {
    drag * (1.0 + 2.0 * point as f32 / SEGMENTS as f32) / 3.0
}

/// Where a point goes that may not pass its plane, and is held back by friction while it leans on it.
#[inline(always)]
fn contact(x: Lane3, before: Lane3, plane: &Plane, forces: &Forces, weight: Lane) -> Lane3 {
    let free = weight.map(|weight| if weight > 0.0 { 1.0 } else { 0.0 });
    let depth = (plane.offset - plane.normal.dot(x)).max(Lane::default()) * free;
    let x = x + plane.normal * depth;
    let slide = x - before - plane.velocity * Lane::splat(forces.step);
    let slide = slide - plane.normal * slide.dot(plane.normal);
    let length = slide.length().max(Lane::splat(1e-9));
    // Coulomb: the way back is at most μ times the depth that was taken away, and at most the whole slide.
    let held = (depth * Lane::splat(forces.friction) * length.recip()).min(Lane::splat(1.0));
    x - slide * held
}
