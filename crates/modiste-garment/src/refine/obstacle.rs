//! A surface that cloth stays outside of: the body, or a garment worn below.

use std::sync::Arc;

use modiste_body::Part;
use modiste_core::{Adjacency, SurfacePoint, Topology, TriangleBvh, Vec3, corners, triangles_cross};

use super::contact::{Contact, Feature, feature};
use super::exposure::{Exposure, just_above};
use super::normals::find_normals;

/// Out of a standing body the way is shortest sideways; along no axis, so that rays seldom meet edges.
const SIDEWAYS: Vec3 = Vec3::new(0.8137, 0.0731, 0.5767);

/// How far beside the boundary of an open surface a point still counts as above or below it (m).
const BOUNDARY_REACH: f64 = 0.006;

/// A surface with what is needed to ask on which side of it a point is, and how far.
///
/// Outside is told by the pseudo-normal at the closest point, which is exact for a surface that does not cross itself
/// (Bærentzen and Aanæs 2005). A posed body does cross itself, arm through chest, thigh through belly; there the closest
/// point is looked for among those that are not buried in another part, and the side is told by the winding number.
#[derive(Debug, Clone)]
pub struct Obstacle {
    topology: Arc<Topology>,
    tree: TriangleBvh,
    /// For each face the faces across the edges opposite its corners; `NONE` on the boundary.
    across: Vec<[u32; 3]>,
    boundary_vertices: Vec<bool>,
    /// The corners of each face and the vertices next to them.
    rings: Arc<Adjacency>,
    vertices: Vec<Vec3>,
    face_normals: Vec<Vec3>,
    vertex_normals: Vec<Vec3>,
    /// The vertices at rest (m); empty for a garment.
    rest: Vec<Vec3>,
    /// Distance from the faces at which the outside begins (m).
    thickness: f64,
    /// Where the outside is at each vertex, where that is known better than by the sides of the faces; empty where not.
    outward: Vec<Vec3>,
    /// What is buried where; `None` for a surface that is taken not to cross itself.
    exposure: Option<Exposure>,
}

/// No face.
pub(crate) const NONE: u32 = u32::MAX;
/// A point that was not asked about before.
pub(crate) const NO_HINT: u32 = NONE;

impl Obstacle {
    /// A closed body whose parts may pass through each other, at rest, for garments worn on some of them.
    pub fn body(topology: Arc<Topology>, face_parts: &[Part], worn: &[Part], vertices: &[Vec3]) -> Self {
        let exposure = Exposure::new(&topology, face_parts, worn, vertices);
        let mut obstacle = Self::single(topology, vertices);
        obstacle.exposure = Some(exposure);
        obstacle.rest = vertices.to_vec();
        obstacle.update(vertices);
        obstacle
    }

    /// A garment that others lie on: a surface that is taken not to cross itself, whose outside begins `thickness` (m)
    /// from its faces. More than cloth has, it keeps the edges of two wrinkled meshes from crossing between vertices.
    pub fn garment(topology: Arc<Topology>, vertices: &[Vec3], thickness: f64) -> Self {
        Self { thickness, ..Self::single(topology, vertices) }
    }

    /// A surface that is taken not to cross itself, closed or open.
    pub fn single(topology: Arc<Topology>, vertices: &[Vec3]) -> Self {
        let mut across = vec![[NONE; 3]; topology.face_count()];
        let mut boundary_vertices = vec![false; topology.vertex_count()];
        for edge in topology.edges() {
            let [Some(first), Some(second)] = edge.faces else {
                edge.vertices.iter().for_each(|&vertex| boundary_vertices[vertex as usize] = true);
                continue;
            };
            for (face, other) in [(first, second), (second, first)] {
                if let Some(corner) = opposite(topology.faces()[face as usize], edge.vertices) {
                    across[face as usize][corner] = other;
                }
            }
        }
        let mut obstacle = Self {
            tree: TriangleBvh::new(&topology, vertices),
            across,
            boundary_vertices,
            rings: Arc::new(rings(&topology)),
            vertices: Vec::new(),
            face_normals: vec![Vec3::ZERO; topology.face_count()],
            vertex_normals: vec![Vec3::ZERO; topology.vertex_count()],
            rest: Vec::new(),
            thickness: 0.0,
            outward: Vec::new(),
            exposure: None,
            topology,
        };
        obstacle.update(vertices);
        obstacle
    }

    /// [`Self::update`] of a garment: `outward` are the directions away from the body at its vertices.
    ///
    /// The outside is there even where the cloth is folded over, as the rim of a waist band may be, and shows its inner side.
    pub(crate) fn update_worn(&mut self, vertices: &[Vec3], outward: impl Iterator<Item = Vec3>) {
        self.outward.clear();
        self.outward.extend(outward);
        self.update(vertices);
    }

    /// Moves the surface to new vertices (m, world).
    pub fn update(&mut self, vertices: &[Vec3]) {
        self.vertices.clear();
        self.vertices.extend_from_slice(vertices);
        let Self { topology, tree, face_normals, vertex_normals, outward, .. } = self;
        rayon::join(
            || find_normals(topology, vertices, outward, face_normals, vertex_normals),
            || tree.refit(vertices),
        );
        if let Some(mut exposure) = self.exposure.take() {
            exposure.update(self);
            self.exposure = Some(exposure);
        }
    }

    /// The corners of a face and the vertices next to them.
    pub(crate) fn ring(&self, face: u32) -> &[u32] {
        self.rings.row(face as usize)
    }

    /// The face across the edge of a face that is opposite a corner; [`NONE`] on the boundary.
    pub(crate) fn across(&self, face: u32, corner: usize) -> u32 {
        self.across[face as usize][corner]
    }

    /// The faces of the surface.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// Its vertices (m, world).
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Angle-weighted unit normals of its vertices.
    pub fn vertex_normals(&self) -> &[Vec3] {
        &self.vertex_normals
    }

    /// The contact of a point with the surface, if that is no further than `reach` (m). `hint` is the face that was
    /// nearest when the same point was last asked about; it changes the time, not the answer. Where parts of a body pass
    /// through each other the rim of the crossing is found to about the size of a triangle.
    pub(crate) fn contact(&self, point: Vec3, reach: f64, hint: &mut u32) -> Option<Contact> {
        let likely = Some(*hint).filter(|&face| face != NONE);
        let Some(exposure) = &self.exposure else {
            let at = self.tree.closest_point_near(&self.vertices, point, reach, likely)?;
            *hint = at.face;
            return self.contact_at(point, &at);
        };
        // Nearest of the points that were refused because they are buried, and whether all around it is.
        let (mut refused, mut deep) = (f64::INFINITY, false);
        let at = self.tree.closest_point_where(&self.vertices, point, reach, likely, |face, at| {
            let exposed = exposure.is_exposed(self, face, at);
            let distance = at.distance(point);
            if !exposed && distance < refused {
                (refused, deep) = (distance, !exposure.is_mixed(self, face));
            }
            exposed
        })?;
        *hint = at.face;
        let is_buried = refused < at.distance;
        if !is_buried && !exposure.is_mixed(self, at.face) {
            let certain = exposure.has_room(self, at.face);
            return self.contact_at(point, &at).map(|contact| Contact { certain, ..contact });
        }
        // Next to a buried surface all is inside; along its rim the winding number tells.
        let inside = (is_buried && deep) || (!self.sees_outside(point, at.face) && self.is_inside(point));
        let offset = if inside { at.point - point } else { point - at.point };
        let normal = offset.normalize_or(self.face_normal(at.face));
        let distance = if inside { -at.distance } else { at.distance };
        Some(Contact { pinched: inside && is_buried, certain: false, ..Contact::at(&at, distance, normal) })
    }

    /// [`Self::contact`], but of a point between parts that pass through each other only that it is, and the buried surface
    /// nearest to it: the outside is a long way to look for.
    pub(crate) fn touch(&self, point: Vec3, reach: f64, hint: &mut u32) -> Option<Contact> {
        let Some(exposure) = &self.exposure else {
            // From the end of a walk the tree has hardly anything left to search.
            *hint = self.walked(point, *hint).map_or(NONE, |at| at.face);
            return self.contact(point, reach, hint);
        };
        let likely = match self.walked(point, *hint) {
            Some(at) if at.distance <= reach && exposure.is_certain(self, point, &at) => {
                *hint = at.face;
                return self.contact_at(point, &at);
            }
            walked => walked.map(|at| at.face),
        };
        let at = self.tree.closest_point_near(&self.vertices, point, reach, likely)?;
        *hint = at.face;
        match exposure.exposed_corners(self, at.face) {
            3 => {
                let certain = exposure.has_room(self, at.face);
                self.contact_at(point, &at).map(|contact| Contact { certain, nearest: true, ..contact })
            }
            // Where the nearest of all points is buried, so is what lies between.
            0 => {
                let (normal, distance) = (self.face_normal(at.face), -at.distance.max(f64::MIN_POSITIVE));
                Some(Contact { pinched: true, certain: false, ..Contact::at(&at, distance, normal) })
            }
            _ => self.contact(point, reach, hint),
        }
    }

    /// Whether a point (m) with this contact is inside the body; never where parts cannot pass through each other. Another
    /// part, such as a finger, may hold the point though nothing faces the surface under it; so a contact that says outside
    /// is believed only if it is the nearest of all, or outside the hulls of the parts that are no neighbours.
    pub(crate) fn holds(&self, point: Vec3, contact: &Contact) -> bool {
        let Some(exposure) = &self.exposure else { return false };
        if contact.certain {
            let is_under = contact.distance + contact.raised < 0.0;
            if is_under || contact.nearest || !exposure.may_be_in_another(self, point, contact.face) {
                return is_under;
            }
        }
        !self.sees_outside(point, contact.face) && self.is_inside(point)
    }

    /// Where a walk from a face leads, if there is one to begin with.
    fn walked(&self, point: Vec3, from: u32) -> Option<SurfacePoint> {
        (from != NONE).then(|| self.walk(point, from))
    }

    /// The contact of a point with the surface around a face, where that is not buried.
    pub(crate) fn contact_around(&self, point: Vec3, face: u32) -> Option<Contact> {
        let at = self.walk(point, face);
        if self.has_exposed_corner(at.face) { self.contact_at(point, &at) } else { None }
    }

    /// Whether this is a body, whose parts may pass through each other.
    pub(crate) fn crosses_itself(&self) -> bool {
        self.exposure.is_some()
    }

    /// The nearest of the points of the surface, each the nearest of its face, that `accept` says yes to, if it is `within` (m).
    pub(crate) fn nearest_where(
        &self,
        (point, within): (Vec3, f64),
        hint: &mut u32,
        accept: impl FnMut(u32, Vec3) -> bool,
    ) -> Option<SurfacePoint> {
        let likely = Some(*hint).filter(|&face| face != NONE);
        let at = self.tree.closest_point_where(&self.vertices, point, within, likely, accept)?;
        *hint = at.face;
        Some(at)
    }

    /// Whether any corner of a face can be reached from outside.
    pub(crate) fn has_exposed_corner(&self, face: u32) -> bool {
        let corners = self.topology.faces()[face as usize];
        self.exposure
            .as_ref()
            .is_none_or(|exposure| corners.iter().any(|&corner| exposure.is_vertex_exposed(self, corner)))
    }

    /// Whether the outside begins at `clearance` (m) above the middle of a face; it is told anew when the surface moves, and
    /// for one clearance only.
    pub(crate) fn is_open_above(&self, face: u32, clearance: f64) -> bool {
        let find_out = || !self.is_inside(self.middle(face) + clearance * self.face_normal(face));
        match &self.exposure {
            Some(exposure) => exposure.is_open(face, find_out),
            None => find_out(),
        }
    }

    /// Whether any face of it crosses a triangle (m).
    pub(crate) fn crosses(&self, triangle: [Vec3; 3]) -> bool {
        let [a, b, c] = triangle;
        let normal = (b - a).cross(c - a);
        let mut found = false;
        self.tree.for_each_in_box(a.min(b).min(c), a.max(b).max(c), |face| {
            let other = corners(self.topology.faces()[face as usize], &self.vertices);
            // Most lie on one side.
            let sides = other.map(|corner| normal.dot(corner - a) > 0.0);
            found = found || ((sides[0] != sides[1] || sides[1] != sides[2]) && triangles_cross(other, triangle));
        });
        found
    }

    /// Less than the distance (m) from a face to other parts of the surface that face it, as far as they are looked for.
    pub(crate) fn room(&self, face: u32) -> f64 {
        self.exposure.as_ref().map_or(f64::INFINITY, |exposure| exposure.room(self, face))
    }

    /// Where a vertex of a body is at rest (m), and its part.
    pub(crate) fn at_rest(&self, vertex: u32) -> Option<(Vec3, Part)> {
        self.exposure.as_ref().map(|exposure| (self.rest[vertex as usize], exposure.part(vertex)))
    }

    /// Distance from the faces at which the outside begins (m).
    pub(crate) fn thickness(&self) -> f64 {
        self.thickness
    }

    /// The middle of a face (m).
    pub(crate) fn middle(&self, face: u32) -> Vec3 {
        self.topology.faces()[face as usize].iter().map(|&vertex| self.vertices[vertex as usize]).sum::<Vec3>() / 3.0
    }

    /// Whether a point is inside the closed surface: whether it goes around the point.
    pub(crate) fn is_inside(&self, point: Vec3) -> bool {
        match self.tree.crossing_number(&self.vertices, point, SIDEWAYS) {
            Some(count) => count > 0,
            None => self.tree.winding_number(&self.vertices, point) > 0.5,
        }
    }

    /// Whether one can go straight from a point to a corner of a near face that is exposed, with nothing between: then
    /// the point is outside. Much faster than the winding number, but not said of all points outside.
    pub(crate) fn sees_outside(&self, point: Vec3, face: u32) -> bool {
        let Some(exposure) = &self.exposure else { return false };
        let exposed =
            self.topology.faces()[face as usize].into_iter().filter(|&corner| exposure.is_vertex_exposed(self, corner));
        let distance = |corner: &u32| self.vertices[*corner as usize].distance_squared(point);
        let nearest = exposed.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.is_some_and(|corner| !self.passes_between(point, just_above(self, corner)))
    }

    /// Whether the surface passes between two points.
    pub(crate) fn passes_between(&self, from: Vec3, to: Vec3) -> bool {
        let length = from.distance(to);
        length > 0.0 && self.tree.ray_hit(&self.vertices, from, (to - from) / length, length).is_some()
    }

    /// Unit normal of a face.
    pub(crate) fn face_normal(&self, face: u32) -> Vec3 {
        self.face_normals[face as usize]
    }

    /// The signed distance that follows from a closest point.
    ///
    /// On the boundary of an open surface only points straight above or below it are told; further aside there is no
    /// contact.
    fn contact_at(&self, point: Vec3, at: &SurfacePoint) -> Option<Contact> {
        let face = self.topology.faces()[at.face as usize];
        let (pseudo_normal, on_boundary) = match feature(at.barycentric) {
            Feature::Face => (self.face_normal(at.face), false),
            Feature::Vertex(corner) => {
                let vertex = face[corner] as usize;
                (self.vertex_normals[vertex], self.boundary_vertices[vertex])
            }
            Feature::Edge(corner) => match self.across[at.face as usize][corner] {
                NONE => (self.face_normal(at.face), true),
                other => ((self.face_normal(at.face) + self.face_normal(other)).normalize_or_zero(), false),
            },
        };
        let offset = point - at.point;
        let height = offset.dot(pseudo_normal);
        if height < 0.0 && self.is_beyond(at, offset) {
            let distance = at.distance - self.thickness;
            return Some(Contact::at(at, distance, offset.normalize_or(pseudo_normal)));
        }
        if on_boundary {
            let aside = (at.distance * at.distance - height * height).max(0.0).sqrt();
            let distance = height - self.thickness;
            let contact = Contact::at(at, distance, pseudo_normal);
            return (aside <= BOUNDARY_REACH).then_some(contact);
        }
        let sign = if height < 0.0 { -1.0 } else { 1.0 };
        // Close to the surface the offset is rounding, and the pseudo-normal is the direction.
        let normal = if at.distance > 1e-7 { sign / at.distance * offset } else { pseudo_normal };
        Some(Contact::at(at, sign * at.distance - self.thickness, normal))
    }

    /// Whether a point is further out than the nearest point of a garment, as seen from the body. What is above it then is
    /// folded over cloth, or the rim of a band, whose sides do not tell above from below.
    fn is_beyond(&self, at: &SurfacePoint, offset: Vec3) -> bool {
        let face = self.topology.faces()[at.face as usize];
        let outward = |(&vertex, share): (&u32, f64)| share * self.outward[vertex as usize];
        !self.outward.is_empty() && face.iter().zip(at.barycentric).map(outward).sum::<Vec3>().dot(offset) > 0.0
    }
}

/// The corners of every face and the vertices next to them.
fn rings(topology: &Topology) -> Adjacency {
    let mut pairs = Vec::with_capacity(12 * topology.face_count());
    for (index, face) in (0u32..).zip(topology.faces()) {
        let first = pairs.len();
        pairs.extend(face.iter().map(|&corner| (index, corner)));
        for &corner in face {
            for &vertex in topology.neighbours(corner as usize) {
                if !pairs[first..].contains(&(index, vertex)) {
                    pairs.push((index, vertex));
                }
            }
        }
    }
    Adjacency::from_pairs(topology.face_count(), &pairs)
}

/// The corner of a face that is not on an edge.
fn opposite(face: [u32; 3], edge: [u32; 2]) -> Option<usize> {
    face.iter().position(|vertex| !edge.contains(vertex))
}

#[cfg(test)]
pub(crate) mod tests;
