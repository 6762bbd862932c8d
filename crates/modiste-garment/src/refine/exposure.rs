//! Which of the body's surface is buried in another part of the body.

use std::sync::atomic::{AtomicU8, Ordering};

use modiste_body::Part;
use modiste_core::{SurfacePoint, Topology, Vec3};
use rayon::prelude::*;

use super::crowding::{Crowding, FREE, REACH};
use super::obstacle::Obstacle;

/// Where the surface just outside a vertex is asked for (m).
const JUST_OUTSIDE: f64 = 0.0005;

/// Parts of a surface further from a nearest point than this (m) are not of its neighbourhood.
const NEIGHBOURHOOD: f64 = REACH;

/// How far outside a hull a point must be to be told to be outside of its part (m).
const HULL_MARGIN: f64 = 0.004;

/// By how much (m) a part of the surface must be further away than the nearest point found.
const CLEARLY: f64 = 0.003;

/// Tells whether the surface is buried, at a vertex or elsewhere.
///
/// The winding number just above the surface tells, for those vertices that are asked about. Outside the hulls of all
/// other parts it need not be taken.
#[derive(Debug, Clone)]
pub(crate) struct Exposure {
    parts: Vec<Part>,
    /// The vertices of the faces of each part. Those between two parts belong to both, so that nothing inside the body is
    /// outside all hulls.
    vertices_of: Vec<Vec<u32>>,
    hulls: Vec<Hull>,
    /// For each part a bit for every part that is no neighbour of it.
    others: [u32; Part::COUNT],
    /// A bit for every part whose surface is known closely, as cloth is worn on it.
    worn: u32,
    vertices: Lazy,
    /// How many corners of each face are exposed.
    corners: Lazy,
    /// Of the middles of faces whose corners differ.
    middles: Lazy,
    /// Whether there is room over the middle of a face.
    open: Lazy,
    crowding: Crowding,
}

/// What was found out so far. Atomic only so that a surface may be asked from several threads; the answer is the same.
#[derive(Debug)]
struct Lazy(Vec<AtomicU8>);

impl Clone for Lazy {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|state| AtomicU8::new(state.load(Ordering::Relaxed))).collect())
    }
}

impl Lazy {
    fn new(count: usize) -> Self {
        Self((0..count).map(|_| AtomicU8::new(0)).collect())
    }

    fn forget(&mut self) {
        self.0.iter_mut().for_each(|state| *state.get_mut() = 0);
    }

    /// Whether an item is exposed; `find_out` is asked where that is not known.
    fn is_exposed(&self, index: usize, find_out: impl FnOnce() -> bool) -> bool {
        self.count(index, || usize::from(find_out())) == 1
    }

    /// A small number of an item; `find_out` is asked where it is not known.
    #[inline]
    fn count(&self, index: usize, find_out: impl FnOnce() -> usize) -> usize {
        match self.0[index].load(Ordering::Relaxed) {
            0 => {
                let count = find_out();
                self.0[index].store(1 + count as u8, Ordering::Relaxed);
                count
            }
            known => usize::from(known) - 1,
        }
    }
}

/// Least and greatest extent of a part in 13 directions.
#[derive(Debug, Clone, Copy)]
struct Hull {
    low: [f64; DIRECTION_COUNT],
    high: [f64; DIRECTION_COUNT],
}

/// The directions to the middles of the faces and edges and to the corners of a cube, one of each pair.
const DIRECTION_COUNT: usize = 13;

/// How far a point lies along each direction; not normalised.
fn extents(point: Vec3) -> [f64; DIRECTION_COUNT] {
    let [x, y, z] = point.to_array();
    [x, y, z, x + y, x - y, x + z, x - z, y + z, y - z, x + y + z, x + y - z, x - y + z, y + z - x]
}

impl Hull {
    const EMPTY: Self = Self { low: [f64::INFINITY; DIRECTION_COUNT], high: [f64::NEG_INFINITY; DIRECTION_COUNT] };

    fn of(points: impl Iterator<Item = Vec3>) -> Self {
        let mut hull = Self::EMPTY;
        points.for_each(|point| hull.add(point));
        hull
    }

    fn add(&mut self, point: Vec3) {
        let Self { low, high } = self;
        let along = extents(point);
        // Comparisons rather than `min` and `max`, which mind what is no number.
        for i in 0..DIRECTION_COUNT {
            low[i] = if along[i] < low[i] { along[i] } else { low[i] };
            high[i] = if along[i] > high[i] { along[i] } else { high[i] };
        }
    }

    /// Whether a point, given by its extents, is in the hull or nearer to it than `margin` in some direction.
    fn holds(&self, extents: &[f64; DIRECTION_COUNT], margin: f64) -> bool {
        let bounds = self.low.iter().zip(&self.high);
        bounds.zip(extents).all(|((low, high), along)| (*low - margin..=*high + margin).contains(along))
    }
}

/// For each part a bit for every part that is no neighbour of it.
fn others() -> [u32; Part::COUNT] {
    let is_other = |own: Part, part: Part| part != own && part.parent() != Some(own) && own.parent() != Some(part);
    Part::ALL.map(|own| {
        Part::ALL.into_iter().filter(|&part| is_other(own, part)).fold(0, |bits, part| bits | 1 << part.index())
    })
}

/// Garments lie on all but head, hands and feet, which have half of a body's vertices.
fn is_covered(part: Part) -> bool {
    !matches!(part, Part::Head | Part::LeftHand | Part::RightHand | Part::LeftFoot | Part::RightFoot)
}

impl Exposure {
    /// For a surface and its vertices (m) in any pose. Cloth on the parts that are `worn` is told about quickly.
    pub(crate) fn new(topology: &Topology, face_parts: &[Part], worn: &[Part], vertices: &[Vec3]) -> Self {
        let mut parts = vec![Part::Pelvis; topology.vertex_count()];
        let mut vertices_of = vec![Vec::new(); Part::COUNT];
        for (face, &part) in topology.faces().iter().zip(face_parts) {
            face.iter().for_each(|&vertex| parts[vertex as usize] = part);
            vertices_of[part.index()].extend(face);
        }
        for vertices in &mut vertices_of {
            vertices.sort_unstable();
            vertices.dedup();
        }
        Self {
            vertices_of,
            hulls: vec![Hull::EMPTY; Part::COUNT],
            others: others(),
            worn: worn.iter().fold(0, |bits, part| bits | 1 << part.index()),
            vertices: Lazy::new(parts.len()),
            corners: Lazy::new(topology.face_count()),
            middles: Lazy::new(topology.face_count()),
            open: Lazy::new(topology.face_count()),
            crowding: Crowding::new(topology, vertices, |face| worn.contains(&face_parts[face])),
            parts,
        }
    }

    /// Takes in a surface that has moved.
    pub(crate) fn update(&mut self, surface: &Obstacle) {
        let hulls = self.hulls.par_iter_mut().zip(&self.vertices_of);
        let crowding = &mut self.crowding;
        rayon::join(
            || crowding.update(surface),
            || {
                let places = |vertices: &[u32]| Hull::of(vertices.iter().map(|&v| surface.vertices()[v as usize]));
                hulls.for_each(|(hull, vertices)| *hull = places(vertices));
            },
        );
        self.vertices.forget();
        self.corners.forget();
        self.middles.forget();
        self.open.forget();
    }

    /// Whether a point is in or next to the hull of another part than the one given.
    fn is_near_another(&self, part: Part, point: Vec3, margin: f64) -> bool {
        self.is_near_one_of(!(1 << part.index()), point, margin)
    }

    /// Whether a point is in or next to the hull of one of the parts that have a bit.
    fn is_near_one_of(&self, parts: u32, point: Vec3, margin: f64) -> bool {
        let extents = extents(point);
        self.hulls.iter().enumerate().any(|(part, hull)| parts >> part & 1 == 1 && hull.holds(&extents, margin))
    }

    /// Whether a point may be in another part than the face that it was found nearest to: in its hull, that is. Parts that
    /// meet at a joint have one surface, which leads from one to the other.
    pub(crate) fn may_be_in_another(&self, surface: &Obstacle, point: Vec3, face: u32) -> bool {
        let own = self.parts[surface.topology().faces()[face as usize][0] as usize];
        self.is_near_one_of(self.others[own.index()], point, 0.0)
    }

    /// Whether the surface at a vertex can be reached from outside.
    pub(crate) fn is_vertex_exposed(&self, surface: &Obstacle, vertex: u32) -> bool {
        self.vertices.is_exposed(vertex as usize, || {
            let above = just_above(surface, vertex);
            let is_free = !is_covered(self.parts[vertex as usize]) || self.crowding.room_of_vertex(vertex) >= FREE;
            (is_free && !self.is_near_another(self.parts[vertex as usize], above, HULL_MARGIN))
                || !surface.is_inside(above)
        })
    }

    /// Whether there is room over a face; `find_out` is asked once.
    pub(crate) fn is_open(&self, face: u32, find_out: impl FnOnce() -> bool) -> bool {
        self.open.is_exposed(face as usize, find_out)
    }

    /// How many corners of a face are exposed.
    pub(crate) fn exposed_corners(&self, surface: &Obstacle, face: u32) -> usize {
        self.corners.count(face as usize, || {
            let corners = surface.topology().faces()[face as usize];
            corners.iter().filter(|&&vertex| self.is_vertex_exposed(surface, vertex)).count()
        })
    }

    /// Whether a face is partly buried.
    pub(crate) fn is_mixed(&self, surface: &Obstacle, face: u32) -> bool {
        !matches!(self.exposed_corners(surface, face), 0 | 3)
    }

    /// The part of a vertex.
    pub(crate) fn part(&self, vertex: u32) -> Part {
        self.parts[vertex as usize]
    }

    /// Less than the distance (m) from a face to surface that faces it.
    pub(crate) fn room(&self, surface: &Obstacle, face: u32) -> f64 {
        self.crowding.room(surface.topology(), face)
    }

    /// Whether no other surface comes so near to a face that it may pass through it.
    pub(crate) fn has_room(&self, surface: &Obstacle, face: u32) -> bool {
        self.crowding.room(surface.topology(), face) > CLEARLY
    }

    /// Whether the point of the surface that is nearest among those around it is so among all, and exposed.
    ///
    /// It is where nothing faces it that is near, or where no surface but that around it, which does not face it, is within
    /// [`FREE`]; further out any will do. Not all that are so are told.
    pub(crate) fn is_certain(&self, surface: &Obstacle, point: Vec3, at: &SurfacePoint) -> bool {
        if self.exposed_corners(surface, at.face) != 3 {
            return false;
        }
        let room = self.crowding.room(surface.topology(), at.face);
        if room > 2.0 * at.distance + CLEARLY {
            return true;
        }
        let is_inside = (point - at.point).dot(surface.face_normal(at.face)) < 0.0;
        let part = self.parts[surface.topology().faces()[at.face as usize][0] as usize];
        // Surface is looked for no further than `FREE`. Within that a neighbour which is known closely is either seen, or is the
        // surface around the nearest point that goes on.
        let is_seen = at.distance + CLEARLY <= FREE;
        let hidden = if is_seen { self.others[part.index()] | !self.worn } else { u32::MAX };
        let around = if room >= FREE { NEIGHBOURHOOD } else { room };
        !is_inside
            && is_covered(part)
            && (room >= FREE || is_seen && Crowding::fits_flat(around, at.distance, at.distance + CLEARLY))
            && !self.is_near_one_of(hidden & !(1 << part.index()), point, HULL_MARGIN)
            && self.crowding.is_alone(point, at.point, around, at.distance + CLEARLY)
    }

    /// Whether a point of a face can be reached from outside.
    ///
    /// On a face that is partly buried the state of the nearest corner, or of the middle where that is nearer, stands for
    /// it.
    pub(crate) fn is_exposed(&self, surface: &Obstacle, face: u32, at: Vec3) -> bool {
        match self.exposed_corners(surface, face) {
            3 => return true,
            0 => return false,
            _ => {}
        }
        let corners = surface.topology().faces()[face as usize];
        let place = |vertex: u32| surface.vertices()[vertex as usize];
        let middle = surface.middle(face);
        let mut nearest = (middle.distance_squared(at), None);
        for vertex in corners {
            let distance = place(vertex).distance_squared(at);
            if distance < nearest.0 {
                nearest = (distance, Some(vertex));
            }
        }
        match nearest.1 {
            Some(vertex) => self.is_vertex_exposed(surface, vertex),
            None => self.middles.is_exposed(face as usize, || is_outside_above(surface, face, middle)),
        }
    }
}

/// Whether the outside begins above a point of a face.
fn is_outside_above(surface: &Obstacle, face: u32, at: Vec3) -> bool {
    !surface.is_inside(at + JUST_OUTSIDE * surface.face_normal(face))
}

/// Where the surface just outside a vertex is asked for (m).
pub(crate) fn just_above(surface: &Obstacle, vertex: u32) -> Vec3 {
    let vertex = vertex as usize;
    surface.vertices()[vertex] + JUST_OUTSIDE * surface.vertex_normals()[vertex]
}
