//! The body that a garment is put on, and what placing needs to know of it.

use std::sync::Arc;

use modiste_body::{Body, Gender, Part};
use modiste_core::{Topology, Vec2, Vec3};

use super::place::{crotch_line, shoulder_line};
use crate::BodyPoint;
use crate::pattern::{Girths, Wearer};

/// Height of the waist (at the navel) over stature: 0.602 for women, 0.601 for men in ANSUR II.
const WAIST_SHARE: f64 = 0.6015;

/// Half width (m) of a neck, where the shoulders of an ungraded top are placed.
const NECK_HALF: f64 = 0.09;

/// A body in the template pose.
#[derive(Debug, Clone)]
pub struct Mannequin {
    /// Its mesh.
    pub topology: Arc<Topology>,
    /// Vertices (m), feet on y = 0, facing +Z.
    pub vertices: Vec<Vec3>,
    /// Part of each face.
    pub face_parts: Vec<Part>,
    /// Part of each vertex.
    pub vertex_parts: Vec<Part>,
    /// Joint of each part (m).
    pub joints: [Vec3; Part::COUNT],
}

impl From<&Body> for Mannequin {
    fn from(body: &Body) -> Self {
        let model = body.model();
        Self {
            topology: Arc::clone(model.topology()),
            vertices: body.rest_vertices().to_vec(),
            face_parts: model.face_parts().to_vec(),
            vertex_parts: model.vertex_parts().to_vec(),
            joints: *body.rest_joints(),
        }
    }
}

impl Mannequin {
    /// The joint of a part (m).
    pub fn joint(&self, part: Part) -> Vec3 {
        self.joints[part.index()]
    }

    /// The place (m) of a point of the surface.
    pub fn surface_point(&self, point: &BodyPoint) -> Vec3 {
        let corners = self.topology.faces()[point.face as usize].map(|v| self.vertices[v as usize]);
        (0..3).map(|c| point.barycentric[c] * corners[c]).sum()
    }

    /// Height of the top of the head over the floor (m).
    pub fn stature(&self) -> f64 {
        let (low, high) =
            self.vertices.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v.y), h.max(v.y)));
        high - low
    }

    /// Height of the waist (m).
    pub fn waist_height(&self) -> f64 {
        WAIST_SHARE * self.stature()
    }

    /// What grading a pattern that was drawn for this body needs to know.
    pub fn wearer(&self, gender: Gender) -> Wearer {
        Wearer {
            gender,
            girths: self.girths(),
            shoulder: shoulder_line(self, NECK_HALF),
            stature: self.stature(),
            crotch: crotch_line(self),
            knee: self.joint(Part::LeftShin).y,
            upper_arm: self.joint(Part::LeftUpperArm).distance(self.joint(Part::LeftForearm)),
        }
    }

    /// Height of the crotch (m): the lowest point of the trunk and thighs in the middle plane.
    pub fn crotch_height(&self) -> f64 {
        let knee = self.joint(Part::LeftShin).y;
        let in_middle = |v: &Vec3, part: Part| {
            v.x.abs() < 0.012 && v.y > knee && matches!(part, Part::Pelvis | Part::LeftThigh | Part::RightThigh)
        };
        let lowest = self
            .vertices
            .iter()
            .zip(&self.vertex_parts)
            .filter(|(v, part)| in_middle(v, **part))
            .map(|(v, _)| v.y)
            .fold(f64::INFINITY, f64::min);
        if lowest.is_finite() { lowest } else { self.joint(Part::LeftThigh).y - 0.07 }
    }

    /// Height (m) of the shoulder surface at the distance `x` (m) from the middle.
    pub fn shoulder_height(&self, x: f64) -> f64 {
        let on_top = |part: Part| {
            matches!(
                part,
                Part::Chest
                    | Part::Neck
                    | Part::LeftShoulder
                    | Part::RightShoulder
                    | Part::LeftUpperArm
                    | Part::RightUpperArm
            )
        };
        let mut top = f64::NEG_INFINITY;
        for (face, &part) in self.topology.faces().iter().zip(&self.face_parts) {
            if on_top(part) {
                for (a, b) in edges(face, &self.vertices) {
                    if (a.x - x) * (b.x - x) <= 0.0 && (a.x - b.x).abs() > f64::EPSILON {
                        top = top.max(a.lerp(b, (x - a.x) / (b.x - a.x)).y);
                    }
                }
            }
        }
        if top.is_finite() { top } else { self.joint(Part::LeftUpperArm).y }
    }

    /// Points (x, z) where the faces of `parts` cross the height `y`.
    pub fn slice(&self, y: f64, parts: &[Part]) -> Vec<Vec2> {
        let mut points = Vec::new();
        for (face, part) in self.topology.faces().iter().zip(&self.face_parts) {
            if parts.contains(part) {
                for (a, b) in edges(face, &self.vertices) {
                    if (a.y - y) * (b.y - y) < 0.0 {
                        let p = a.lerp(b, (y - a.y) / (b.y - a.y));
                        points.push(Vec2::new(p.x, p.z));
                    }
                }
            }
        }
        points
    }

    /// Girth (m) at a height: the convex hull of the slice through `parts`, as a tape lies.
    pub fn girth(&self, y: f64, parts: &[Part]) -> f64 {
        hull_perimeter(self.slice(y, parts))
    }

    /// The girths by which a size is chosen.
    pub fn girths(&self) -> Girths {
        let steps = |low: f64, high: f64| (0..=24).map(move |i| low + (high - low) * f64::from(i) / 24.0);
        let largest =
            |low: f64, high: f64, parts: &[Part]| steps(low, high).map(|y| self.girth(y, parts)).fold(0.0, f64::max);
        let waist = self.waist_height();
        let crotch = self.crotch_height();
        let armpit = self.joint(Part::LeftUpperArm).y - 0.09;
        Girths {
            chest: largest(waist + 0.5 * (armpit - waist), armpit, &[Part::Chest, Part::Abdomen]),
            waist: self.girth(waist, &TRUNK),
            hip: largest(crotch + 0.02, waist - 0.04, &LOWER_TRUNK),
        }
    }
}

/// The parts that a shirt's torso goes around.
pub(super) const TRUNK: [Part; 3] = [Part::Pelvis, Part::Abdomen, Part::Chest];

/// The parts that the upper part of trousers goes around.
pub(super) const LOWER_TRUNK: [Part; 4] = [Part::Pelvis, Part::Abdomen, Part::LeftThigh, Part::RightThigh];

fn edges<'a>(face: &'a [u32; 3], vertices: &'a [Vec3]) -> impl Iterator<Item = (Vec3, Vec3)> + 'a {
    (0..3).map(move |c| (vertices[face[c] as usize], vertices[face[(c + 1) % 3] as usize]))
}

/// Perimeter of the convex hull (m).
fn hull_perimeter(mut points: Vec<Vec2>) -> f64 {
    if points.len() < 3 {
        return 0.0;
    }
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut hull: Vec<Vec2> = Vec::new();
    let half = |hull: &mut Vec<Vec2>, points: &mut dyn Iterator<Item = Vec2>| {
        let first = hull.len();
        for p in points {
            while hull.len() >= first + 2
                && (hull[hull.len() - 1] - hull[hull.len() - 2]).perp_dot(p - hull[hull.len() - 1]) <= 0.0
            {
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    };
    half(&mut hull, &mut points.iter().copied());
    half(&mut hull, &mut points.iter().rev().copied());
    (0..hull.len()).map(|i| hull[i].distance(hull[(i + 1) % hull.len()])).sum()
}

#[cfg(test)]
mod tests {
    use super::hull_perimeter;
    use modiste_core::Vec2;

    #[test]
    fn the_tape_skips_hollows() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.9), (0.5, 0.5), (0.5, 0.0)];
        let points = square.iter().map(|&(x, y)| Vec2::new(x, y)).collect();
        assert!((hull_perimeter(points) - 4.0).abs() < 1e-12);
    }
}
