//! Which of the body's surface is buried in another part of the body.

use std::sync::atomic::{AtomicU8, Ordering};

use modiste_body::Part;
use modiste_core::{Topology, Vec3};

use super::obstacle::Obstacle;

/// Where the surface just outside a vertex is asked for (m).
const JUST_OUTSIDE: f64 = 0.0005;

const UNKNOWN: u8 = 0;
const EXPOSED: u8 = 1;
const BURIED: u8 = 2;

/// Tells per vertex whether the surface there is buried, when it is first asked about in a frame.
///
/// A vertex outside the hulls of all other limbs cannot be buried in one; only for the others is a winding number taken.
#[derive(Debug, Clone)]
pub(crate) struct Exposure {
    limbs: Vec<u8>,
    hulls: Vec<Hull>,
    vertices: States,
    /// Of the middles of faces whose corners differ.
    middles: States,
}

/// What is known so far. Atomic only so that a surface may be asked from several threads; the answer is the same.
#[derive(Debug)]
struct States(Vec<AtomicU8>);

impl Clone for States {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|state| AtomicU8::new(state.load(Ordering::Relaxed))).collect())
    }
}

impl States {
    fn unknown(count: usize) -> Self {
        Self((0..count).map(|_| AtomicU8::new(UNKNOWN)).collect())
    }

    fn forget(&mut self) {
        self.0.iter_mut().for_each(|state| *state.get_mut() = UNKNOWN);
    }

    /// Whether an item is exposed; `find_out` is asked where that is not known.
    fn is_exposed(&self, index: usize, find_out: impl FnOnce() -> bool) -> bool {
        match self.0[index].load(Ordering::Relaxed) {
            UNKNOWN => {
                let exposed = find_out();
                self.0[index].store(if exposed { EXPOSED } else { BURIED }, Ordering::Relaxed);
                exposed
            }
            known => known == EXPOSED,
        }
    }
}

/// Least and greatest extent of a limb in 13 directions.
#[derive(Debug, Clone, Copy)]
struct Hull([(f64, f64); DIRECTIONS.len()]);

const DIRECTIONS: [Vec3; 13] = [
    Vec3::X,
    Vec3::Y,
    Vec3::Z,
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(1.0, -1.0, 0.0),
    Vec3::new(1.0, 0.0, 1.0),
    Vec3::new(1.0, 0.0, -1.0),
    Vec3::new(0.0, 1.0, 1.0),
    Vec3::new(0.0, 1.0, -1.0),
    Vec3::new(1.0, 1.0, 1.0),
    Vec3::new(1.0, 1.0, -1.0),
    Vec3::new(1.0, -1.0, 1.0),
    Vec3::new(-1.0, 1.0, 1.0),
];

impl Hull {
    const EMPTY: Self = Self([(f64::INFINITY, f64::NEG_INFINITY); DIRECTIONS.len()]);

    fn add(&mut self, point: Vec3) {
        for (direction, (low, high)) in DIRECTIONS.iter().zip(&mut self.0) {
            let along = direction.dot(point);
            *low = low.min(along);
            *high = high.max(along);
        }
    }

    fn holds(&self, point: Vec3) -> bool {
        DIRECTIONS.iter().zip(&self.0).all(|(direction, (low, high))| (*low..=*high).contains(&direction.dot(point)))
    }
}

/// Number of limbs that may pass through each other.
const LIMBS: usize = 9;

/// Trunk and head, or one segment of a limb.
fn limb(part: Part) -> u8 {
    match part {
        Part::Pelvis
        | Part::Abdomen
        | Part::Chest
        | Part::Neck
        | Part::Head
        | Part::LeftShoulder
        | Part::RightShoulder => 0,
        Part::LeftUpperArm => 1,
        Part::LeftForearm | Part::LeftHand => 2,
        Part::RightUpperArm => 3,
        Part::RightForearm | Part::RightHand => 4,
        Part::LeftThigh => 5,
        Part::LeftShin | Part::LeftFoot => 6,
        Part::RightThigh => 7,
        Part::RightShin | Part::RightFoot => 8,
    }
}

impl Exposure {
    pub(crate) fn new(topology: &Topology, face_parts: &[Part]) -> Self {
        let mut limbs = vec![0; topology.vertex_count()];
        for (face, &part) in topology.faces().iter().zip(face_parts) {
            face.iter().for_each(|&vertex| limbs[vertex as usize] = limb(part));
        }
        let (vertices, middles) = (States::unknown(limbs.len()), States::unknown(topology.face_count()));
        Self { limbs, hulls: vec![Hull::EMPTY; LIMBS], vertices, middles }
    }

    /// Forgets what was known and takes the hulls of the limbs from new vertices (m).
    pub(crate) fn update(&mut self, vertices: &[Vec3]) {
        self.hulls.fill(Hull::EMPTY);
        for (vertex, &limb) in vertices.iter().zip(&self.limbs) {
            self.hulls[usize::from(limb)].add(*vertex);
        }
        self.vertices.forget();
        self.middles.forget();
    }

    fn is_vertex_exposed(&self, surface: &Obstacle, vertex: u32) -> bool {
        let vertex = vertex as usize;
        self.vertices.is_exposed(vertex, || {
            let at = surface.vertices()[vertex];
            let own = usize::from(self.limbs[vertex]);
            let may_be_buried = (0..LIMBS).any(|limb| limb != own && self.hulls[limb].holds(at));
            !may_be_buried || !surface.is_inside(at + JUST_OUTSIDE * surface.vertex_normals()[vertex])
        })
    }

    /// How many corners of a face are exposed.
    fn exposed_corners(&self, surface: &Obstacle, face: u32) -> usize {
        let corners = surface.topology().faces()[face as usize];
        corners.iter().filter(|&&vertex| self.is_vertex_exposed(surface, vertex)).count()
    }

    /// Whether a face is partly buried.
    pub(crate) fn is_mixed(&self, surface: &Obstacle, face: u32) -> bool {
        !matches!(self.exposed_corners(surface, face), 0 | 3)
    }

    /// Whether a point of a face can be reached from outside.
    ///
    /// On a face that is partly buried the point is asked about itself if `precise`; otherwise the state of the nearest
    /// corner, or of the middle where that is nearer, stands for it.
    pub(crate) fn is_exposed(&self, surface: &Obstacle, face: u32, at: Vec3, precise: bool) -> bool {
        let is_outside = |point: Vec3| !surface.is_inside(point + JUST_OUTSIDE * surface.face_normal(face));
        match self.exposed_corners(surface, face) {
            3 => true,
            0 => false,
            _ if precise => is_outside(at),
            _ => {
                let corners = surface.topology().faces()[face as usize];
                let place = |vertex: u32| surface.vertices()[vertex as usize];
                let middle = corners.iter().map(|&vertex| place(vertex)).sum::<Vec3>() / 3.0;
                let mut nearest = (middle.distance_squared(at), None);
                for vertex in corners {
                    let distance = place(vertex).distance_squared(at);
                    if distance < nearest.0 {
                        nearest = (distance, Some(vertex));
                    }
                }
                match nearest.1 {
                    Some(vertex) => self.is_vertex_exposed(surface, vertex),
                    None => self.middles.is_exposed(face as usize, || is_outside(middle)),
                }
            }
        }
    }
}
