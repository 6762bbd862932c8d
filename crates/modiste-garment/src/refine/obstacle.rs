//! A surface that cloth stays outside of: the body, or a garment worn below.

use std::sync::Arc;

use modiste_body::Part;
use modiste_core::{SurfacePoint, Topology, TriangleBvh, Vec3};

/// Barycentric coordinates below this count as zero when the feature of a closest point is told.
const ON_FEATURE: f64 = 1e-9;

/// A surface in sheets that may pass through each other.
///
/// Outside is told by the pseudo-normal at the closest point, which is exact for a surface that does not cross itself
/// (Bærentzen and Aanæs 2005). A posed body does cross itself, arm through chest, thigh through thigh; so it is cut into
/// sheets that each do not, and a point is inside if any sheet says so.
#[derive(Debug, Clone)]
pub struct Obstacle {
    topology: Arc<Topology>,
    sheets: Vec<TriangleBvh>,
    face_sheet: Vec<u8>,
    /// For each face the faces across the edges opposite its corners; `NONE` on the boundary.
    across: Vec<[u32; 3]>,
    /// Vertices whose faces are of different sheets.
    cut_vertices: Vec<bool>,
    boundary_vertices: Vec<bool>,
    vertices: Vec<Vec3>,
    face_normals: Vec<Vec3>,
    vertex_normals: Vec<Vec3>,
    /// Distance from the faces at which the outside begins (m).
    thickness: f64,
}

const NONE: u32 = u32::MAX;

/// What a sheet says about a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Contact {
    /// Distance from the sheet (m), negative inside.
    pub(crate) distance: f64,
    /// Unit direction in which the distance grows fastest.
    pub(crate) normal: Vec3,
    /// The nearest face.
    pub(crate) face: u32,
}

/// Where on the mesh a closest point lies.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Feature {
    Face,
    /// The edge opposite this corner.
    Edge(usize),
    /// This corner.
    Vertex(usize),
}

/// The sheet of a body part: trunk with head and shoulders, or one limb.
fn sheet_of(part: Part) -> u8 {
    match part {
        Part::Pelvis | Part::Abdomen | Part::Chest | Part::Neck | Part::Head | Part::LeftShoulder | Part::RightShoulder => 0,
        Part::LeftUpperArm | Part::LeftForearm | Part::LeftHand => 1,
        Part::RightUpperArm | Part::RightForearm | Part::RightHand => 2,
        Part::LeftThigh | Part::LeftShin | Part::LeftFoot => 3,
        Part::RightThigh | Part::RightShin | Part::RightFoot => 4,
    }
}

impl Obstacle {
    /// A body: five sheets, cut where the limbs begin.
    pub fn body(topology: Arc<Topology>, face_parts: &[Part], vertices: &[Vec3]) -> Self {
        Self::in_sheets(topology, face_parts.iter().map(|&part| sheet_of(part)).collect(), vertices)
    }

    /// A garment that others lie on: a surface that is taken not to cross itself, whose outside begins `thickness` (m)
    /// from its faces. More than cloth has, it keeps the edges of two wrinkled meshes from crossing between vertices.
    pub fn garment(topology: Arc<Topology>, vertices: &[Vec3], thickness: f64) -> Self {
        Self { thickness, ..Self::single(topology, vertices) }
    }

    /// A surface that is taken not to cross itself, closed or open.
    pub fn single(topology: Arc<Topology>, vertices: &[Vec3]) -> Self {
        let faces = topology.face_count();
        Self::in_sheets(topology, vec![0; faces], vertices)
    }

    fn in_sheets(topology: Arc<Topology>, face_sheet: Vec<u8>, vertices: &[Vec3]) -> Self {
        let sheet_count = face_sheet.iter().max().map_or(0, |&last| usize::from(last) + 1);
        let sheets = (0..sheet_count)
            .map(|sheet| {
                let faces: Vec<u32> =
                    (0u32..).zip(&face_sheet).filter(|(_, of)| usize::from(**of) == sheet).map(|(face, _)| face).collect();
                TriangleBvh::of_faces(&topology, vertices, &faces)
            })
            .collect();
        let mut across = vec![[NONE; 3]; topology.face_count()];
        let mut cut_vertices = vec![false; topology.vertex_count()];
        let mut boundary_vertices = vec![false; topology.vertex_count()];
        for edge in topology.edges() {
            match edge.faces {
                [Some(first), Some(second)] => {
                    for (face, other) in [(first, second), (second, first)] {
                        if let Some(corner) = opposite(topology.faces()[face as usize], edge.vertices) {
                            across[face as usize][corner] = other;
                        }
                    }
                    if face_sheet[first as usize] != face_sheet[second as usize] {
                        edge.vertices.iter().for_each(|&vertex| cut_vertices[vertex as usize] = true);
                    }
                }
                _ => edge.vertices.iter().for_each(|&vertex| boundary_vertices[vertex as usize] = true),
            }
        }
        let mut obstacle = Self {
            sheets,
            face_sheet,
            across,
            cut_vertices,
            boundary_vertices,
            vertices: Vec::new(),
            face_normals: vec![Vec3::ZERO; topology.face_count()],
            vertex_normals: vec![Vec3::ZERO; topology.vertex_count()],
            thickness: 0.0,
            topology,
        };
        obstacle.update(vertices);
        obstacle
    }

    /// Moves the surface to new vertices (m, world).
    pub fn update(&mut self, vertices: &[Vec3]) {
        self.vertices.clear();
        self.vertices.extend_from_slice(vertices);
        self.vertex_normals.fill(Vec3::ZERO);
        for (&face, normal) in self.topology.faces().iter().zip(&mut self.face_normals) {
            let corners = face.map(|vertex| vertices[vertex as usize]);
            *normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            for (corner, angle) in angles(corners).into_iter().enumerate() {
                self.vertex_normals[face[corner] as usize] += angle * *normal;
            }
        }
        for normal in &mut self.vertex_normals {
            *normal = normal.normalize_or_zero();
        }
        for sheet in &mut self.sheets {
            sheet.refit(vertices);
        }
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

    /// Number of sheets.
    pub(crate) fn sheet_count(&self) -> usize {
        self.sheets.len()
    }

    /// The sheet of a face.
    pub(crate) fn sheet_of_face(&self, face: u32) -> usize {
        usize::from(self.face_sheet[face as usize])
    }

    /// Unit normal of a face.
    pub(crate) fn face_normal(&self, face: u32) -> Vec3 {
        self.face_normals[face as usize]
    }

    /// The closest point of a sheet no further than `reach` (m).
    pub(crate) fn closest(&self, sheet: usize, point: Vec3, reach: f64) -> Option<SurfacePoint> {
        self.sheets[sheet].closest_point(&self.vertices, point, reach)
    }

    /// The signed distance that follows from a closest point, and whether the point decides for itself.
    ///
    /// A point on the cut of its sheet does not: there the sheet ends, and only if it is the closest of all sheets does
    /// its pseudo-normal, which comes from the whole surface, tell inside from outside. On the boundary of an open
    /// surface only points straight above or below it are told; further aside there is no contact.
    pub(crate) fn contact(&self, point: Vec3, at: &SurfacePoint) -> Option<(Contact, bool)> {
        let face = self.topology.faces()[at.face as usize];
        let feature = feature(at.barycentric);
        let (pseudo_normal, on_cut, on_boundary) = match feature {
            Feature::Face => (self.face_normal(at.face), false, false),
            Feature::Vertex(corner) => {
                let vertex = face[corner] as usize;
                (self.vertex_normals[vertex], self.cut_vertices[vertex], self.boundary_vertices[vertex])
            }
            Feature::Edge(corner) => {
                let other = self.across[at.face as usize][corner];
                if other == NONE {
                    (self.face_normal(at.face), false, true)
                } else {
                    let sum = self.face_normal(at.face) + self.face_normal(other);
                    (sum.normalize_or_zero(), self.sheet_of_face(other) != self.sheet_of_face(at.face), false)
                }
            }
        };
        let offset = point - at.point;
        let height = offset.dot(pseudo_normal);
        if on_boundary {
            let aside = (at.distance * at.distance - height * height).max(0.0).sqrt();
            let contact = Contact { distance: height - self.thickness, normal: pseudo_normal, face: at.face };
            return (aside <= BOUNDARY_REACH).then_some((contact, true));
        }
        let sign = if height < 0.0 { -1.0 } else { 1.0 };
        // Close to the surface the offset is rounding, and the pseudo-normal is the direction.
        let normal = if at.distance > 1e-7 { sign / at.distance * offset } else { pseudo_normal };
        Some((Contact { distance: sign * at.distance - self.thickness, normal, face: at.face }, !on_cut))
    }
}

/// How far beside the boundary of an open surface a point still counts as above or below it (m).
const BOUNDARY_REACH: f64 = 0.006;

/// The corner of a face that is not on an edge.
fn opposite(face: [u32; 3], edge: [u32; 2]) -> Option<usize> {
    face.iter().position(|vertex| !edge.contains(vertex))
}

/// Inner angles of a triangle; zero where it has no area.
fn angles([a, b, c]: [Vec3; 3]) -> [f64; 3] {
    let (ab, bc, ca) = ((b - a).normalize_or_zero(), (c - b).normalize_or_zero(), (a - c).normalize_or_zero());
    let angle = |u: Vec3, v: Vec3| angle_of_cosine(-u.dot(v));
    [angle(ca, ab), angle(ab, bc), angle(bc, ca)]
}

/// Arc cosine within 7e-5, several times faster than the exact one (Abramowitz and Stegun 4.4.45). The angles weigh
/// normals, nothing else.
fn angle_of_cosine(cosine: f64) -> f64 {
    let x = cosine.abs().min(1.0);
    let positive = (1.0 - x).sqrt() * (1.570_728_8 + x * (-0.212_114_4 + x * (0.074_261 - 0.018_729_3 * x)));
    if cosine < 0.0 { std::f64::consts::PI - positive } else { positive }
}

fn feature(barycentric: [f64; 3]) -> Feature {
    let zero = barycentric.map(|value| value < ON_FEATURE);
    match zero {
        [false, true, true] => Feature::Vertex(0),
        [true, false, true] => Feature::Vertex(1),
        [true, true, false] => Feature::Vertex(2),
        [true, false, false] => Feature::Edge(0),
        [false, true, false] => Feature::Edge(1),
        [false, false, true] => Feature::Edge(2),
        _ => Feature::Face,
    }
}

/// What an obstacle says about one point: nothing, or a contact of each of a few sheets, the nearest first.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contacts {
    items: [Contact; Self::MOST],
    count: usize,
}

impl Contacts {
    /// A point is near a trunk and two limbs at most; further sheets are dropped.
    const MOST: usize = 4;

    pub(crate) const EMPTY: Self =
        Self { items: [Contact { distance: 0.0, normal: Vec3::ZERO, face: 0 }; Self::MOST], count: 0 };

    pub(crate) fn as_slice(&self) -> &[Contact] {
        &self.items[..self.count]
    }

    pub(crate) fn push(&mut self, contact: Contact) {
        if self.count < Self::MOST {
            self.items[self.count] = contact;
            self.count += 1;
        }
    }

    /// The least distance (m); infinite without contacts.
    pub(crate) fn least(&self) -> f64 {
        self.as_slice().iter().fold(f64::INFINITY, |least, contact| least.min(contact.distance))
    }
}

/// For one vertex, the face that was nearest on each sheet when it was last asked: the next search starts from its distance.
pub(crate) type Hints = [u32; MAX_SHEETS];

/// Sheets for which hints are kept.
pub(crate) const MAX_SHEETS: usize = 5;

/// Without a hint.
pub(crate) const NO_HINTS: Hints = [NONE; MAX_SHEETS];

impl Obstacle {
    /// All contacts of a point with sheets no further than `reach` (m).
    pub(crate) fn contacts(&self, point: Vec3, reach: f64, hints: &mut Hints) -> Contacts {
        let mut found: [Option<SurfacePoint>; MAX_SHEETS] = [None; MAX_SHEETS];
        let mut nearest = (f64::INFINITY, 0);
        for sheet in 0..self.sheet_count().min(MAX_SHEETS) {
            let limit = self.hinted_reach(point, hints[sheet]).min(reach);
            found[sheet] = self.closest(sheet, point, limit);
            if let Some(at) = &found[sheet] {
                hints[sheet] = at.face;
                if at.distance < nearest.0 {
                    nearest = (at.distance, sheet);
                }
            }
        }
        let mut contacts = Contacts::EMPTY;
        for (sheet, at) in found.iter().enumerate() {
            let Some((contact, decides)) = at.as_ref().and_then(|at| self.contact(point, at)) else { continue };
            if decides || sheet == nearest.1 {
                contacts.push(contact);
            }
        }
        contacts
    }

    /// An upper bound of the distance from the face of a hint, with room for rounding.
    fn hinted_reach(&self, point: Vec3, hint: u32) -> f64 {
        let Some(&face) = self.topology.faces().get(hint as usize) else { return f64::INFINITY };
        let triangle = face.map(|vertex| self.vertices[vertex as usize]);
        modiste_core::closest_point_on_triangle(point, triangle).0.distance(point) * (1.0 + 1e-9) + 1e-12
    }
}

#[cfg(test)]
mod tests {
    use super::{NO_HINTS, Obstacle};
    use modiste_body::Part;
    use modiste_core::shapes::{grid, icosphere};
    use modiste_core::{Topology, Vec3, normal, seeded_rng};
    use std::sync::Arc;

    #[test]
    fn the_fast_arc_cosine_is_close() {
        for step in 0..=2000 {
            let x = f64::from(step) / 1000.0 - 1.0;
            assert!((super::angle_of_cosine(x) - x.acos()).abs() < 7e-5, "{x}");
        }
    }

    #[test]
    fn distances_from_a_sphere_are_signed_and_exact_to_its_facets() {
        let sphere = icosphere(4);
        let obstacle = Obstacle::single(sphere.topology.clone(), &sphere.vertices);
        let mut rng = seeded_rng(1);
        for _ in 0..500 {
            let direction = Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng)).normalize();
            let radius = 0.9 + 0.1 * normal(&mut rng).abs().min(2.0);
            let contacts = obstacle.contacts(radius * direction, 0.5, &mut NO_HINTS.clone());
            let [contact] = contacts.as_slice() else { panic!("one sheet, one contact") };
            assert!((contact.distance - (radius - 1.0)).abs() < 2e-3, "{} {radius}", contact.distance);
            assert!(contact.normal.dot(direction) > 0.99);
        }
    }

    /// Two spheres that overlap, the second as a limb: its own sheet.
    fn crossing() -> Obstacle {
        let sphere = icosphere(3);
        let shift = Vec3::new(1.8, 0.0, 0.0);
        let count = sphere.vertices.len() as u32;
        let vertices: Vec<Vec3> =
            sphere.vertices.iter().copied().chain(sphere.vertices.iter().map(|v| *v + shift)).collect();
        let faces = sphere.topology.faces();
        let both = faces.iter().copied().chain(faces.iter().map(|face| face.map(|vertex| vertex + count))).collect();
        let mut parts = vec![Part::Chest; faces.len()];
        parts.resize(2 * faces.len(), Part::LeftThigh);
        Obstacle::body(Arc::new(Topology::new(vertices.len(), both).unwrap()), &parts, &vertices)
    }

    #[test]
    fn inside_one_sheet_is_inside_even_where_the_nearest_sheet_is_another() {
        let obstacle = crossing();
        // Just outside the first sphere, but inside the second.
        let contacts = obstacle.contacts(Vec3::new(1.02, 0.0, 0.0), 0.5, &mut NO_HINTS.clone());
        let distances: Vec<f64> = contacts.as_slice().iter().map(|contact| contact.distance).collect();
        assert_eq!(distances.len(), 2);
        assert!(distances.iter().any(|distance| (distance - 0.02).abs() < 0.01), "{distances:?}");
        assert!(distances.iter().any(|distance| (distance + 0.22).abs() < 0.01), "{distances:?}");
        assert!(contacts.least() < 0.0);
    }

    #[test]
    fn the_cut_between_sheets_leaves_no_gap() {
        let sphere = icosphere(4);
        let upper = |face: &[u32; 3]| face.iter().all(|&vertex| sphere.vertices[vertex as usize].y > 0.3);
        let parts: Vec<Part> =
            sphere.topology.faces().iter().map(|face| if upper(face) { Part::LeftThigh } else { Part::Pelvis }).collect();
        let cut = Obstacle::body(sphere.topology.clone(), &parts, &sphere.vertices);
        let whole = Obstacle::single(sphere.topology.clone(), &sphere.vertices);
        let mut rng = seeded_rng(8);
        for _ in 0..2000 {
            let direction = Vec3::new(normal(&mut rng), 0.3 + 0.1 * normal(&mut rng), normal(&mut rng)).normalize();
            let point = (1.0 + 0.02 * normal(&mut rng)) * direction;
            let wanted = whole.contacts(point, 0.3, &mut NO_HINTS.clone()).least();
            let found = cut.contacts(point, 0.3, &mut NO_HINTS.clone()).least();
            assert_eq!(wanted < 0.0, found < 0.0, "{point} {wanted} {found}");
        }
    }

    #[test]
    fn beside_an_open_surface_there_is_no_contact() {
        let square = grid(4, 4);
        let obstacle = Obstacle::single(square.topology.clone(), &square.vertices);
        let at = |x: f64, z: f64| obstacle.contacts(Vec3::new(x, 0.5, z), 0.1, &mut NO_HINTS.clone());
        assert!((at(0.5, 0.02).least() - 0.02).abs() < 1e-12);
        assert!((at(0.5, -0.02).least() + 0.02).abs() < 1e-12);
        assert!((at(-0.002, -0.02).least() + 0.02).abs() < 1e-12);
        assert!(at(-0.02, -0.02).as_slice().is_empty());
    }

    #[test]
    fn hints_change_the_time_but_not_the_answer() {
        let obstacle = crossing();
        let mut hints = NO_HINTS;
        let mut rng = seeded_rng(2);
        let mut point = Vec3::new(0.0, 1.05, 0.0);
        for _ in 0..200 {
            point += 0.05 * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
            point = point.clamp_length(0.9, 1.1);
            let warm = obstacle.contacts(point, 0.4, &mut hints);
            let cold = obstacle.contacts(point, 0.4, &mut NO_HINTS.clone());
            assert!((warm.least() - cold.least()).abs() < 1e-9 || warm.least() == cold.least());
        }
    }
}
