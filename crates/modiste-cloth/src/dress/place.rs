//! Laying the flat panels around a body in the template pose, before they are sewn.

use std::f64::consts::{PI, TAU};

use modiste_body::Part;
use modiste_core::{Vec2, Vec3};

use super::mannequin::{LOWER_TRUNK, Mannequin, TRUNK};
use crate::cut::CutGarment;
use crate::pattern::{Fitting, Wrap};

/// How far above the shoulder the shirt starts, so that its shoulder seams close over the body (m).
const SHOULDER_LIFT: f64 = 0.03;

/// How far below the crotch the shorts start (m).
const CROTCH_DROP: f64 = 0.02;

/// Over this way below the crotch leg panels pass from the hip ring to tubes around the legs (m).
const CROTCH_BLEND: f64 = 0.2;

/// Distance of the legs' inner panels from the middle plane before sewing (m).
const INNER_GAP: f64 = 0.008;

/// The joints at the ends of upper and lower limbs.
const LEFT_ARM: [Part; 3] = [Part::LeftUpperArm, Part::LeftForearm, Part::LeftHand];
const RIGHT_ARM: [Part; 3] = [Part::RightUpperArm, Part::RightForearm, Part::RightHand];
const LEFT_LEG: [Part; 3] = [Part::LeftThigh, Part::LeftShin, Part::LeftFoot];
const RIGHT_LEG: [Part; 3] = [Part::RightThigh, Part::RightShin, Part::RightFoot];

/// Where each loose vertex goes (m).
///
/// Torso and hip panels lie on upright elliptic cylinders as long around as the garment, so side seams start almost closed;
/// sleeves are rolled to closed tubes around the arms; the parts of trousers that go between the legs hang in the middle
/// plane. The body inside has to be thin ([`thin_body`]) until the seams are closed.
pub fn place(cut: &CutGarment, fitting: Fitting, body: &Mannequin) -> Vec<Vec3> {
    let pattern = cut.pattern();
    let points = cut.points(fitting);
    let mut placed = vec![Vec3::ZERO; points.len()];
    let wrapped = |wrap: Wrap| -> Vec<Vec<Vec2>> {
        let panels = (0..pattern.panels.len()).filter(|&panel| pattern.panels[panel].wrap == wrap);
        panels.map(|panel| pattern.corners(panel, fitting)).collect()
    };
    let torso = ring(&wrapped(Wrap::TorsoFront), &wrapped(Wrap::TorsoBack));
    let legs = ring(&wrapped(Wrap::LeftLegFront), &wrapped(Wrap::LeftLegBack));
    let hips = legs.or_else(|| ring(&wrapped(Wrap::HipFront), &wrapped(Wrap::HipBack)));
    let torso = torso.map(|girth| {
        let neck_half = highest(wrapped(Wrap::TorsoFront).concat()).x.abs();
        let y = body.joint(Part::LeftUpperArm).y - 0.15;
        (Ellipse::around(&body.slice(y, &TRUNK), girth), shoulder_line(body, neck_half))
    });
    let hips = hips.map(|girth| {
        (Ellipse::around(&body.slice(body.crotch_height() + 0.06, &LOWER_TRUNK), girth), crotch_line(body))
    });
    let arms = [wrapped(Wrap::LeftArm), wrapped(Wrap::RightArm)];
    for (index, panel) in pattern.panels.iter().enumerate() {
        let outline = pattern.corners(index, fitting);
        let leg = leg_of(panel.wrap, &wrapped);
        for i in cut.panel_range(index) {
            let p = points[i];
            placed[i] = match (panel.wrap, &torso, &hips) {
                (_, _, Some(ring)) if let Some(leg) = &leg => leg.place(body, ring, &outline, p),
                (Wrap::TorsoFront, Some((ellipse, height)), _) => ellipse.at(p.x).lifted(height + p.y),
                (Wrap::TorsoBack, Some((ellipse, height)), _) => {
                    ellipse.at(0.5 * ellipse.girth - p.x).lifted(height + p.y)
                }
                (Wrap::HipFront, _, Some((ellipse, height))) => {
                    let flare = flare(&outline, p.y, 0.25 * ellipse.girth);
                    ellipse.at(p.x / flare).widened(ellipse, flare).lifted(height + p.y)
                }
                (Wrap::HipBack, _, Some((ellipse, height))) => {
                    let flare = flare(&outline, p.y, 0.25 * ellipse.girth);
                    ellipse.at(0.5 * ellipse.girth - p.x / flare).widened(ellipse, flare).lifted(height + p.y)
                }
                (Wrap::LeftArm, ..) => around_arm(body, LEFT_ARM, &arms[0], p),
                (Wrap::RightArm, ..) => around_arm(body, RIGHT_ARM, &arms[1], p),
                // A front without its back, or the other way round: flat, a hand's breadth before the body.
                _ => Vec3::new(p.x, body.waist_height() + p.y, 0.25),
            };
        }
    }
    placed
}

/// Hands and feet are drawn in by this factor more, or hems would close on toes and thumbs.
const END_SHARE: f64 = 0.4;

fn is_end(part: Part) -> bool {
    matches!(part, Part::LeftHand | Part::RightHand | Part::LeftFoot | Part::RightFoot)
}

/// Height (m) at which the upper edge of a top with a neck of this half width is placed.
pub(super) fn shoulder_line(body: &Mannequin, neck_half: f64) -> f64 {
    body.shoulder_height(neck_half) + SHOULDER_LIFT
}

/// Height (m) at which the crotch line of trousers and skirts is placed.
pub(super) fn crotch_line(body: &Mannequin) -> f64 {
    body.crotch_height() - CROTCH_DROP
}

/// The leg that a panel is wrapped around; `wrapped` gives the corners of the panels that are wrapped in some way.
fn leg_of(wrap: Wrap, wrapped: &dyn Fn(Wrap) -> Vec<Vec<Vec2>>) -> Option<Leg> {
    let (joints, side, is_back, other) = match wrap {
        Wrap::LeftLegFront => (LEFT_LEG, 1.0, false, Wrap::LeftLegBack),
        Wrap::LeftLegBack => (LEFT_LEG, 1.0, true, Wrap::LeftLegFront),
        Wrap::RightLegFront => (RIGHT_LEG, -1.0, false, Wrap::RightLegBack),
        Wrap::RightLegBack => (RIGHT_LEG, -1.0, true, Wrap::RightLegFront),
        _ => return None,
    };
    Some(Leg { joints, side, is_back, other: wrapped(other).concat() })
}

/// The body with trunk and limbs drawn in towards their axes: room for seams to close in.
pub fn thin_body(body: &Mannequin, share: f64) -> Vec<Vec3> {
    let axis = |part: Part| -> [Vec3; 2] {
        let joint = |p: Part| body.joint(p);
        let beyond = |p: Part| joint(p) + 0.5 * (joint(p) - p.parent().map_or(joint(p), joint));
        match part {
            Part::LeftShoulder | Part::LeftUpperArm => [joint(Part::LeftUpperArm), joint(Part::LeftForearm)],
            Part::RightShoulder | Part::RightUpperArm => [joint(Part::RightUpperArm), joint(Part::RightForearm)],
            Part::LeftForearm => [joint(Part::LeftForearm), joint(Part::LeftHand)],
            Part::RightForearm => [joint(Part::RightForearm), joint(Part::RightHand)],
            Part::LeftThigh => [joint(Part::LeftThigh), joint(Part::LeftShin)],
            Part::RightThigh => [joint(Part::RightThigh), joint(Part::RightShin)],
            Part::LeftShin => [joint(Part::LeftShin), joint(Part::LeftFoot)],
            Part::RightShin => [joint(Part::RightShin), joint(Part::RightFoot)],
            Part::LeftHand | Part::RightHand | Part::LeftFoot | Part::RightFoot | Part::Head => {
                [joint(part), beyond(part)]
            }
            Part::Pelvis | Part::Abdomen | Part::Chest | Part::Neck => [joint(Part::Pelvis), joint(Part::Neck)],
        }
    };
    body.vertices
        .iter()
        .zip(&body.vertex_parts)
        .map(|(&v, &part)| {
            let [a, b] = axis(part);
            let along = (b - a).normalize_or(Vec3::Y);
            let on_axis = a + along * (v - a).dot(along);
            let share = if is_end(part) { END_SHARE * share } else { share };
            on_axis + share * (v - on_axis)
        })
        .collect()
}

/// Girth (m) of the ring that front and back make: twice the half widths at their widest corner above the hem.
fn ring(front: &[Vec<Vec2>], back: &[Vec<Vec2>]) -> Option<f64> {
    let half_width = |corners: &Vec<Vec2>| {
        let (low, high) = extent(corners.iter().map(|v| v.y));
        // The hem may be wider; what counts is the chest or the hip, well above it.
        let above_hem = low + 0.4 * (high - low);
        corners.iter().filter(|v| v.y > above_hem).map(|v| v.x.abs()).fold(0.0, f64::max)
    };
    let widest = |panels: &[Vec<Vec2>]| panels.iter().map(half_width).reduce(f64::max);
    Some(2.0 * (widest(front)? + widest(back)?))
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// How many times as wide as `half_width` (m) a panel is at height `y`, at least once: below the hip the panels of a skirt
/// lie on a cone.
fn flare(corners: &[Vec2], y: f64, half_width: f64) -> f64 {
    (row(corners, y).1 / half_width).max(1.0)
}

/// The highest corner of an outline.
fn highest(corners: Vec<Vec2>) -> Vec2 {
    corners.into_iter().fold(Vec2::new(0.0, f64::NEG_INFINITY), |top, v| if v.y > top.y { v } else { top })
}

/// A sleeve rolled around the arm, closed on the underside; cap top at the shoulder. Below the elbow it follows the forearm.
fn around_arm(body: &Mannequin, parts: [Part; 3], sleeve: &[Vec<Vec2>], p: Vec2) -> Vec3 {
    let [shoulder, elbow, wrist] = parts.map(|part| body.joint(part));
    let length = shoulder.distance(elbow);
    let from_shoulder = 0.01 - p.y;
    let (start, end, along_by) =
        if from_shoulder < length { (shoulder, elbow, from_shoulder) } else { (elbow, wrist, from_shoulder - length) };
    let along = (end - start).normalize_or(Vec3::NEG_Y);
    let outward = (Vec3::Y - along * along.y).normalize_or(Vec3::X);
    // Seen from outside, x runs to the back on the left sleeve and to the front on the right one.
    let across = outward.cross(along).normalize_or(Vec3::Z);
    let radius = sleeve_width(sleeve, p.y) / TAU;
    let angle = p.x / radius;
    start + along * along_by + radius * (angle.cos() * outward + angle.sin() * across)
}

/// Width (m) of a sleeve of one or two panels at height `y`; in the cap that of the underarm, its widest.
fn sleeve_width(sleeve: &[Vec<Vec2>], y: f64) -> f64 {
    let rows = sleeve.iter().map(|corners| {
        let widest = |widest: Vec2, c: &Vec2| if c.x.abs() > widest.x.abs() { *c } else { widest };
        row(corners, y.min(corners.iter().fold(Vec2::ZERO, widest).y))
    });
    let (low, high) = rows.fold((0.0, 0.0), |(low, high): (f64, f64), row| (low.min(row.0), high.max(row.1)));
    high - low
}

/// From where to where (x, m) the polygon through the corners of a panel reaches at height `y`.
fn row(corners: &[Vec2], y: f64) -> (f64, f64) {
    let (bottom, top) = extent(corners.iter().map(|c| c.y));
    let y = y.clamp(bottom, top);
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let crossed = edges.filter(|(a, b)| a.y.min(b.y) <= y && y <= a.y.max(b.y));
    extent(crossed.flat_map(|(a, b)| {
        let run = b.y - a.y;
        if run.abs() < 1e-9 { [a.x, b.x] } else { [a.lerp(*b, (y - a.y) / run).x; 2] }
    }))
}

/// A leg panel: beyond the centre line on the hip ring, before it inward through the middle plane.
fn around_leg((ellipse, height): &(Ellipse, f64), p: Vec2, side: f64, back: bool) -> Vec3 {
    let out = side * p.x;
    let place = ellipse.at(if back { 0.5 * ellipse.girth - out.max(0.0) } else { out.max(0.0) });
    let inward = if back { 1.0 } else { -1.0 };
    let z = place.z + inward * (-out).max(0.0);
    let x = side * place.x.max(INNER_GAP);
    Vec3::new(x, height + p.y, z)
}

/// A point of a leg panel below the crotch on a tube around the leg, as wide as front and back together.
fn around_shank(body: &Mannequin, leg: &Leg, own: &[Vec2], p: Vec2) -> Vec3 {
    let joints = leg.joints.map(|part| body.joint(part));
    let y = crotch_line(body) + p.y;
    let [upper, lower] = if y > joints[1].y { [joints[0], joints[1]] } else { [joints[1], joints[2]] };
    let axis = upper.lerp(lower, ((upper.y - y) / (upper.y - lower.y).max(f64::MIN_POSITIVE)).max(0.0));
    // The outer edge in this row: the largest x on the left leg, the smallest on the right one.
    let outer = |(low, high): (f64, f64)| if leg.side > 0.0 { high } else { -low };
    let width = |(low, high): (f64, f64)| high - low;
    let (own_row, other_row) = (row(own, p.y), row(&leg.other, p.y));
    let radius = (width(own_row) + width(other_row)) / TAU;
    let from_outer = (outer(own_row) - leg.side * p.x) / radius;
    let forward = if leg.is_back { -1.0 } else { 1.0 };
    let x = axis.x + leg.side * radius * from_outer.cos();
    Vec3::new(x, y, axis.z + forward * radius * from_outer.sin())
}

/// A leg panel: on the hip ring above the crotch, around the leg below it.
struct Leg {
    joints: [Part; 3],
    /// 1 on the left, −1 on the right.
    side: f64,
    is_back: bool,
    /// Corners of the other panel of the leg.
    other: Vec<Vec2>,
}

impl Leg {
    fn place(&self, body: &Mannequin, ring: &(Ellipse, f64), own: &[Vec2], p: Vec2) -> Vec3 {
        let hip = around_leg(ring, p, self.side, self.is_back);
        let share = (-p.y / CROTCH_BLEND).clamp(0.0, 1.0);
        hip.lerp(around_shank(body, self, own, p), share * share * (3.0 - 2.0 * share))
    }
}

/// An upright elliptic cylinder, walked by arc length from its front (+Z) towards the left (+X).
#[derive(Debug, Clone)]
struct Ellipse {
    centre_z: f64,
    semi_axes: Vec2,
    girth: f64,
    /// Cumulative arc length at even steps of the parameter.
    lengths: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct RingPoint {
    x: f64,
    z: f64,
}

impl RingPoint {
    /// Moved away from the axis of its ellipse.
    fn widened(self, ellipse: &Ellipse, by: f64) -> Self {
        Self { x: by * self.x, z: ellipse.centre_z + by * (self.z - ellipse.centre_z) }
    }

    fn lifted(self, y: f64) -> Vec3 {
        Vec3::new(self.x, y, self.z)
    }
}

impl Ellipse {
    const STEPS: usize = 360;

    /// The ellipse of this girth with the proportions and the middle of a slice (x, z).
    fn around(slice: &[Vec2], girth: f64) -> Self {
        let (low, high) = slice.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        let (extent, centre_z) =
            if slice.is_empty() { (Vec2::new(0.3, 0.2), 0.0) } else { (high - low, 0.5 * (low.y + high.y)) };
        let proportion = (extent.y / extent.x).clamp(0.55, 1.1);
        let unit = Self::lengths(Vec2::new(1.0, proportion));
        let scale = girth / unit[Self::STEPS];
        let semi_axes = scale * Vec2::new(1.0, proportion);
        Self { centre_z, semi_axes, girth, lengths: unit.into_iter().map(|l| scale * l).collect() }
    }

    fn lengths(semi_axes: Vec2) -> Vec<f64> {
        let point = |i: usize| {
            let t = TAU * i as f64 / Self::STEPS as f64;
            semi_axes * Vec2::new(t.sin(), t.cos())
        };
        let mut lengths = vec![0.0];
        for i in 1..=Self::STEPS {
            lengths.push(lengths[i - 1] + point(i).distance(point(i - 1)));
        }
        lengths
    }

    fn at(&self, arc_length: f64) -> RingPoint {
        let s = arc_length.rem_euclid(self.girth);
        let step = self.lengths.partition_point(|&l| l < s).clamp(1, Self::STEPS);
        let within = (s - self.lengths[step - 1]) / (self.lengths[step] - self.lengths[step - 1]);
        let t = 2.0 * PI * ((step - 1) as f64 + within) / Self::STEPS as f64;
        RingPoint { x: self.semi_axes.x * t.sin(), z: self.centre_z + self.semi_axes.y * t.cos() }
    }
}

#[cfg(test)]
mod tests {
    use super::Ellipse;
    use modiste_core::Vec2;

    #[test]
    fn walking_the_ellipse_keeps_lengths() {
        let slice = [Vec2::new(-0.2, -0.1), Vec2::new(0.2, 0.14)];
        let ellipse = Ellipse::around(&slice, 1.0);
        let point = |s: f64| {
            let p = ellipse.at(s);
            Vec2::new(p.x, p.z)
        };
        let total: f64 =
            (0..1000).map(|i| point(f64::from(i) / 1000.0).distance(point(f64::from(i + 1) / 1000.0))).sum();
        assert!((total - 1.0).abs() < 1e-3);
        assert!(point(0.0).x.abs() < 1e-12 && point(0.0).y > 0.02);
        assert!(point(0.25).x > 0.0 && (point(0.25).y - 0.02).abs() < 1e-9);
        assert!(point(-0.1).distance(Vec2::new(-point(0.1).x, point(0.1).y)) < 1e-9);
    }
}
