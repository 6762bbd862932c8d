//! What is inside the body.

use modiste_core::{Sounding, SurfacePoint, Vec3, closest_point_on_triangle, corners, pseudonormal, vertex_normals};

use super::{Found, GarmentCheck, Surface, faces_of};

/// Where a point of the skin is asked whether it can be seen from outside (m above it).
const JUST_OUTSIDE: f64 = 1e-4;

/// Along this ray the crossings of a closed body are counted, its winding number: roughly ahead, which is the shortest way
/// through a body that stands, and along no edge of a regular mesh.
const AHEAD: Vec3 = Vec3::new(0.091, 0.127, 1.0);

/// Cloth nearer than this (m), the size of a triangle, to skin of a part that crosses another part is caught there.
const AT_CROSSING: f64 = 0.015;

/// The surface of a body in one frame.
pub(super) struct Skin<'a> {
    surface: &'a Surface,
    x: &'a [Vec3],
    /// Vertices at places where the body crosses itself; none means that all skin can be seen.
    crossing: Vec<u32>,
    is_closed: bool,
}

/// Where a point lies.
enum Place {
    Outside,
    /// In one part of the body, at this depth (m).
    Inside(f64),
    /// In two parts of the body or more, which are in each other there.
    Pinched,
}

impl<'a> Skin<'a> {
    pub(super) fn new(surface: &'a Surface, x: &'a [Vec3]) -> Self {
        let pairs = surface.tree.self_intersections(x);
        let mut crossing: Vec<u32> =
            pairs.into_iter().flatten().flat_map(|face| surface.topology.faces()[face as usize]).collect();
        crossing.sort_unstable();
        crossing.dedup();
        let is_closed = surface.topology.edges().iter().all(|edge| edge.faces[1].is_some());
        Self { surface, x, crossing, is_closed }
    }

    /// How many parts of the body a point is in.
    fn parts_around(&self, point: Vec3) -> u32 {
        let tree = &self.surface.tree;
        let crossings = if self.is_closed { tree.crossing_number(self.x, point, AHEAD) } else { None };
        let count = crossings.unwrap_or_else(|| tree.winding_number(self.x, point).round() as i32);
        count.max(0).cast_unsigned()
    }

    fn is_inside(&self, point: Vec3) -> bool {
        self.parts_around(point) > 0
    }

    fn nearest(&self, point: Vec3) -> Option<SurfacePoint> {
        self.surface.tree.closest_point(self.x, point, f64::INFINITY)
    }

    /// Outward normal of the skin nearest to a point; not of unit length.
    pub(super) fn normal_at(&self, point: Vec3) -> Vec3 {
        self.nearest(point).map_or(Vec3::ZERO, |at| pseudonormal(&self.surface.topology, self.x, &at))
    }

    /// Distance from the skin (m), negative inside the body.
    pub(super) fn distance(&self, point: Vec3) -> f64 {
        let distance = self.nearest(point).map_or(f64::INFINITY, |at| at.distance);
        if self.is_inside(point) { -distance } else { distance }
    }

    fn place(&self, point: Vec3) -> Place {
        match (self.parts_around(point), self.nearest(point)) {
            (0, _) | (_, None) => Place::Outside,
            (1, Some(at)) => Place::Inside(at.distance),
            _ => Place::Pinched,
        }
    }

    /// Signed distance from where cloth may be: outside of the body, or between two of its parts.
    fn sound(&self, point: Vec3) -> Sounding {
        let Some(at) = self.nearest(point) else {
            return Sounding { depth: f64::NEG_INFINITY, nearest: [point; 3] };
        };
        let below = self.parts_around(point) == 1;
        let face = self.surface.topology.faces()[at.face as usize];
        Sounding { depth: if below { at.distance } else { -at.distance }, nearest: corners(face, self.x) }
    }

    /// Distance (m) to the nearest skin that can be seen.
    fn to_visible(&self, point: Vec3) -> f64 {
        let visible = |face: u32, at: Vec3| {
            let [a, b, c] = corners(self.surface.topology.faces()[face as usize], self.x);
            !self.is_inside(at + JUST_OUTSIDE * (b - a).cross(c - a).normalize_or_zero())
        };
        let found = self.surface.tree.closest_point_where(self.x, point, f64::INFINITY, None, visible);
        found.map_or(f64::INFINITY, |at| at.distance)
    }

    /// Vertices at the places where the body crosses itself that are inside another part of it, and their depth there.
    pub(super) fn crossing(&self) -> Found {
        if self.crossing.is_empty() {
            return Found::default();
        }
        let normals = vertex_normals(&self.surface.topology, self.x);
        let mut found = Found::default();
        for &vertex in &self.crossing {
            let point = self.x[vertex as usize] + JUST_OUTSIDE * normals[vertex as usize];
            if self.is_inside(point) {
                found.count += 1;
                found.offer(self.to_visible(point), point);
            }
        }
        found
    }

    /// Whether a triangle of cloth is where parts of the body are in each other.
    fn is_at_crossing(&self, triangle: [Vec3; 3]) -> bool {
        let is_near = |&vertex: &u32| {
            let (nearest, _) = closest_point_on_triangle(self.x[vertex as usize], triangle);
            nearest.distance_squared(self.x[vertex as usize]) < AT_CROSSING * AT_CROSSING
        };
        self.crossing.iter().any(is_near)
    }

    /// Vertices of a garment inside the body, and its triangles that cross the body's.
    pub(super) fn garment(&self, garment: &Surface, x: &[Vec3]) -> GarmentCheck {
        let mut found = GarmentCheck::default();
        let mut sunk = vec![false; x.len()];
        for (vertex, &point) in x.iter().enumerate() {
            match self.place(point) {
                Place::Outside => {}
                Place::Inside(depth) => {
                    sunk[vertex] = true;
                    found.inside.count += 1;
                    found.inside.offer(depth, point);
                }
                Place::Pinched => {
                    found.pinched.count += 1;
                    found.pinched.offer(self.to_visible(point), point);
                }
            }
        }
        let pairs = garment.tree.intersections(x, &self.surface.tree, self.x);
        let triangle = |face: u32| corners(garment.topology.faces()[face as usize], x);
        let mut candidates = faces_of(&pairs);
        let caught: Vec<u32> = candidates.iter().copied().filter(|&face| self.is_at_crossing(triangle(face))).collect();
        let is_caught = |face: u32| caught.binary_search(&face).is_ok();
        found.caught.count = pairs.iter().filter(|pair| is_caught(pair[0])).count();
        found.body = Found { count: pairs.len() - found.caught.count, ..found.inside };
        let all = (0u32..).zip(garment.topology.faces());
        candidates.extend(all.filter(|(_, face)| face.iter().any(|&v| sunk[v as usize])).map(|(index, _)| index));
        candidates.sort_unstable();
        candidates.dedup();
        for face in candidates {
            let sum = if is_caught(face) { &mut found.caught } else { &mut found.body };
            sum.offer_triangle(triangle(face), |point| self.sound(point));
        }
        found
    }
}
