//! Garments in their order: the outer one outside the inner one.

use modiste_core::{Sounding, SurfacePoint, Vec3, centroid, corners, signed_distance};

use super::skin::Skin;
use super::{Found, Surface, faces_of};

/// Points further than this from the inner garment (m) are neither above nor below it: it has no inside.
const REACH: f64 = 0.03;

/// By how much the way up from a point leans, so that it goes through no corner of a mesh that is like the body's.
const ASIDE: Vec3 = Vec3::new(0.013, 0.007, -0.011);

/// An inner garment in one frame.
pub(super) struct Layer<'a> {
    surface: &'a Surface,
    x: &'a [Vec3],
    /// What it is worn on.
    skin: &'a Skin<'a>,
    /// Of each vertex whether it lies on the rim.
    rim: Vec<bool>,
}

impl<'a> Layer<'a> {
    pub(super) fn new(surface: &'a Surface, x: &'a [Vec3], skin: &'a Skin<'a>) -> Self {
        let mut rim = vec![false; x.len()];
        for edge in surface.topology.edges().iter().filter(|edge| edge.faces[1].is_none()) {
            edge.vertices.iter().for_each(|&vertex| rim[vertex as usize] = true);
        }
        Self { surface, x, skin, rim }
    }

    /// Whether a point of the surface lies on the rim. Beside it a point is past the garment's end, not above or below it.
    fn is_on_rim(&self, at: &SurfacePoint) -> bool {
        let face = self.surface.topology.faces()[at.face as usize];
        let within = at.barycentric.iter().all(|&share| share > 0.0);
        !within && (0..3).all(|corner| at.barycentric[corner] <= 0.0 || self.rim[face[corner] as usize])
    }

    /// Signed distance from the garment, where it is near.
    fn sound(&self, point: Vec3) -> Sounding {
        let Some(at) = self.surface.tree.closest_point(self.x, point, REACH) else {
            return Sounding { depth: -REACH, nearest: [point; 3] };
        };
        let nearest = corners(self.surface.topology.faces()[at.face as usize], self.x);
        let depth = -signed_distance(&self.surface.topology, self.x, point, &at);
        let is_below =
            depth > 0.0 && !self.is_on_rim(&at) && self.lies_right(nearest) && self.is_under(point, at.point);
        Sounding { depth: if is_below { depth } else { -at.distance }, nearest }
    }

    /// Whether a point is nearer to the body than one of the garment, and has the garment above itself as seen from there:
    /// behind cloth that stands off or crosses itself there is also the air outside, past a hem that is folded over nothing is
    /// below, and beside a fold that stands off the way up is free.
    fn is_under(&self, point: Vec3, cloth: Vec3) -> bool {
        let has_cloth_above = || {
            let up = (self.skin.normal_at(point).normalize_or_zero() + ASIDE).normalize_or_zero();
            up != Vec3::ZERO && self.surface.tree.ray_hit(self.x, point, up, REACH).is_some()
        };
        self.skin.normal_at(cloth).dot(cloth - point) > 0.0
            && self.skin.distance(point) < self.skin.distance(cloth)
            && has_cloth_above()
    }

    /// Whether a face has its outer side away from the body. Where cloth is folded over, its outer side does not say what is
    /// above it.
    fn lies_right(&self, face @ [a, b, c]: [Vec3; 3]) -> bool {
        self.skin.normal_at(centroid(&face)).dot((b - a).cross(c - a)) > 0.0
    }

    /// Vertices of an outer garment that are below this one, and pairs of triangles that cross.
    pub(super) fn check(&self, outer: &Surface, x: &[Vec3]) -> (Found, Found) {
        let mut below = Found::default();
        for &point in x {
            let depth = self.sound(point).depth;
            if depth > 0.0 {
                below.count += 1;
                below.offer(depth, point);
            }
        }
        let pairs = outer.tree.intersections(x, &self.surface.tree, self.x);
        let mut crossings = Found { count: pairs.len(), ..Found::default() };
        for face in faces_of(&pairs) {
            let triangle = corners(outer.topology.faces()[face as usize], x);
            crossings.offer_triangle(triangle, |point| self.sound(point));
        }
        (below, crossings)
    }
}
