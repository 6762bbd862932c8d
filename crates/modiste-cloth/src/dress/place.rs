//! Laying the flat panels around a body in the template pose, before they are sewn.

use std::f64::consts::{PI, TAU};

use modiste_body::Part;
use modiste_core::{Vec2, Vec3};

use super::mannequin::{LOWER_TRUNK, Mannequin, TRUNK};
use crate::cut::CutGarment;
use crate::pattern::{Outline, Wrap};

/// How far above the shoulder the shirt starts, so that its shoulder seams close over the body (m).
const SHOULDER_LIFT: f64 = 0.03;

/// How far below the crotch the shorts start (m).
const CROTCH_DROP: f64 = 0.02;

/// Distance of the legs' inner panels from the middle plane before sewing (m).
const INNER_GAP: f64 = 0.008;

/// Where each loose vertex goes (m).
///
/// Torso and hip panels lie on upright elliptic cylinders as long around as the garment, so side seams start almost closed;
/// sleeves are rolled to closed tubes around the arms; the parts of trousers that go between the legs hang in the middle
/// plane. The body inside has to be thin ([`thin_body`]) until the seams are closed.
pub fn place(cut: &CutGarment, size: usize, body: &Mannequin) -> Vec<Vec3> {
    let pattern = cut.pattern();
    let points = cut.points(size);
    let mut placed = vec![Vec3::ZERO; points.len()];
    let outline = |wrap: Wrap| pattern.panels.iter().find(|p| p.wrap == wrap).map(|p| &p.outlines[size]);
    let torso = ring(outline(Wrap::TorsoFront), outline(Wrap::TorsoBack));
    let hips = ring(outline(Wrap::LeftLegFront), outline(Wrap::LeftLegBack));
    let torso = torso.map(|girth| {
        let neck_half = outline(Wrap::TorsoFront).map_or(0.08, |o| top_of(o).x.abs());
        let y = body.joint(Part::LeftUpperArm).y - 0.15;
        (Ellipse::around(&body.slice(y, &TRUNK), girth), body.shoulder_height(neck_half) + SHOULDER_LIFT)
    });
    let hips = hips.map(|girth| {
        let crotch = body.crotch_height();
        (Ellipse::around(&body.slice(crotch + 0.06, &LOWER_TRUNK), girth), crotch - CROTCH_DROP)
    });
    for (index, panel) in pattern.panels.iter().enumerate() {
        for i in cut.panel_range(index) {
            let p = points[i];
            placed[i] = match (panel.wrap, &torso, &hips) {
                (Wrap::TorsoFront, Some((ellipse, height)), _) => ellipse.at(p.x).lifted(height + p.y),
                (Wrap::TorsoBack, Some((ellipse, height)), _) => {
                    ellipse.at(0.5 * ellipse.girth - p.x).lifted(height + p.y)
                }
                (Wrap::LeftArm, ..) => {
                    around_arm(body, [Part::LeftUpperArm, Part::LeftForearm], &panel.outlines[size], p)
                }
                (Wrap::RightArm, ..) => {
                    around_arm(body, [Part::RightUpperArm, Part::RightForearm], &panel.outlines[size], p)
                }
                (Wrap::LeftLegFront, _, Some(ring)) => around_leg(ring, p, 1.0, false),
                (Wrap::LeftLegBack, _, Some(ring)) => around_leg(ring, p, 1.0, true),
                (Wrap::RightLegFront, _, Some(ring)) => around_leg(ring, p, -1.0, false),
                (Wrap::RightLegBack, _, Some(ring)) => around_leg(ring, p, -1.0, true),
                // A front without its back, or the other way round: flat, a hand's breadth before the body.
                _ => Vec3::new(p.x, body.waist_height() + p.y, 0.25),
            };
        }
    }
    placed
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
            on_axis + share * (v - on_axis)
        })
        .collect()
}

/// Girth (m) of the ring that front and back make: twice the half widths at their widest corner above the hem.
fn ring(front: Option<&Outline>, back: Option<&Outline>) -> Option<f64> {
    let half_width = |o: &Outline| {
        let (low, high) = extent(o.vertices.iter().map(|v| v.y));
        // The hem may be wider; what counts is the chest or the hip, well above it.
        let above_hem = low + 0.4 * (high - low);
        o.vertices.iter().filter(|v| v.y > above_hem).map(|v| v.x.abs()).fold(0.0, f64::max)
    };
    Some(2.0 * (half_width(front?) + half_width(back?)))
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// The highest corner of an outline.
fn top_of(outline: &Outline) -> Vec2 {
    outline.vertices.iter().copied().fold(Vec2::new(0.0, f64::NEG_INFINITY), |top, v| if v.y > top.y { v } else { top })
}

/// A sleeve rolled around the upper arm, closed on the underside; cap top at the shoulder.
fn around_arm(body: &Mannequin, [upper, lower]: [Part; 2], outline: &Outline, p: Vec2) -> Vec3 {
    let (shoulder, elbow) = (body.joint(upper), body.joint(lower));
    let along = (elbow - shoulder).normalize_or(Vec3::NEG_Y);
    let outward = (Vec3::Y - along * along.y).normalize_or(Vec3::X);
    // Seen from outside, x runs to the back on the left sleeve and to the front on the right one.
    let across = outward.cross(along).normalize_or(Vec3::Z);
    let (low, high) = extent(outline.vertices.iter().map(|v| v.x));
    let radius = (high - low) / TAU;
    let angle = p.x / radius;
    shoulder + along * (0.01 - p.y) + radius * (angle.cos() * outward + angle.sin() * across)
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
