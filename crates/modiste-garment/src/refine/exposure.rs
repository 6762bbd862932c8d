//! Which of the body's surface is buried in another part of the body.

use std::sync::atomic::{AtomicU8, Ordering};

use modiste_body::Part;
use modiste_core::{Topology, Vec3};
use rayon::prelude::*;

use super::obstacle::Obstacle;

/// Where the surface just outside a vertex is asked for (m).
const JUST_OUTSIDE: f64 = 0.0005;

/// What is known of a vertex or a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Unknown,
    Exposed,
    Buried,
}

/// Tells per vertex whether the surface there is buried.
///
/// The winding number just above the surface tells. It is the same at neighbours unless the surface passes between them:
/// it is taken once for each patch that the crossings cut off, not once a vertex. Heads, hands and feet outside the hulls
/// of all other limbs are taken to be exposed.
#[derive(Debug, Clone)]
pub(crate) struct Exposure {
    limbs: Vec<u8>,
    hulls: Vec<Hull>,
    vertices: Vec<State>,
    queue: Vec<u32>,
    /// Of the middles of faces whose corners differ.
    middles: Lazy,
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
        match self.0[index].load(Ordering::Relaxed) {
            0 => {
                let exposed = find_out();
                self.0[index].store(1 + u8::from(exposed), Ordering::Relaxed);
                exposed
            }
            known => known == 2,
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

/// Number of limbs.
const LIMBS: usize = 10;

/// Trunk and limbs, which garments lie on, come first, then the extremities.
fn limb(part: Part) -> u8 {
    match part {
        Part::Pelvis | Part::Abdomen | Part::Chest | Part::Neck | Part::LeftShoulder | Part::RightShoulder => 0,
        Part::LeftUpperArm | Part::LeftForearm => 1,
        Part::RightUpperArm | Part::RightForearm => 2,
        Part::LeftThigh | Part::LeftShin => 3,
        Part::RightThigh | Part::RightShin => 4,
        Part::Head => 5,
        Part::LeftHand => 6,
        Part::RightHand => 7,
        Part::LeftFoot => 8,
        Part::RightFoot => 9,
    }
}

/// Half of a body's vertices are those of head, hands and feet. Only where these come near another limb does it matter
/// for cloth whether they are buried.
fn is_extremity(limb: usize) -> bool {
    limb > 4
}

impl Exposure {
    pub(crate) fn new(topology: &Topology, face_parts: &[Part]) -> Self {
        let mut limbs = vec![0; topology.vertex_count()];
        for (face, &part) in topology.faces().iter().zip(face_parts) {
            face.iter().for_each(|&vertex| limbs[vertex as usize] = limb(part));
        }
        Self {
            hulls: vec![Hull::EMPTY; LIMBS],
            vertices: vec![State::Exposed; limbs.len()],
            queue: Vec::new(),
            middles: Lazy::new(topology.face_count()),
            limbs,
        }
    }

    /// Finds out anew about a surface that has moved.
    pub(crate) fn update(&mut self, surface: &Obstacle) {
        self.hulls.fill(Hull::EMPTY);
        for (vertex, &limb) in surface.vertices().iter().zip(&self.limbs) {
            self.hulls[usize::from(limb)].add(*vertex);
        }
        self.middles.forget();
        self.suspect(surface);
        self.spread(surface);
    }

    /// Forgets what is known of all vertices that may be buried.
    fn suspect(&mut self, surface: &Obstacle) {
        let Self { limbs, hulls, vertices, .. } = self;
        let each = (0..limbs.len() as u32).into_par_iter().zip(&*limbs);
        vertices.par_iter_mut().zip(each).with_min_len(512).for_each(|(state, (vertex, &own))| {
            let above = just_above(surface, vertex);
            let own = usize::from(own);
            let may_be_buried = !is_extremity(own) || (0..LIMBS).any(|limb| limb != own && hulls[limb].holds(above));
            *state = if may_be_buried { State::Unknown } else { State::Exposed };
        });
    }

    /// Spreads what is known along edges that nothing passes through.
    fn spread(&mut self, surface: &Obstacle) {
        let Self { vertices, queue, .. } = self;
        let above = |vertex: u32| just_above(surface, vertex);
        let ask = |vertex: u32| if surface.is_inside(above(vertex)) { State::Buried } else { State::Exposed };
        queue.clear();
        for seed in 0..vertices.len() as u32 {
            if vertices[seed as usize] != State::Unknown {
                continue;
            }
            let state = ask(seed);
            vertices[seed as usize] = state;
            queue.push(seed);
            while let Some(vertex) = queue.pop() {
                for &other in surface.topology().neighbours(vertex as usize) {
                    let found = vertices[other as usize];
                    // What is taken to be exposed, because no other limb is near, may be folded into its own.
                    let is_open = found == State::Unknown || (state == State::Buried && found == State::Exposed);
                    if is_open
                        && !surface.passes_between(above(vertex), above(other))
                        && (found == State::Unknown || ask(other) == State::Buried)
                    {
                        vertices[other as usize] = state;
                        queue.push(other);
                    }
                }
            }
        }
    }

    /// Whether the surface at a vertex can be reached from outside.
    pub(crate) fn is_vertex_exposed(&self, vertex: u32) -> bool {
        self.vertices[vertex as usize] == State::Exposed
    }

    /// How many corners of a face are exposed.
    fn exposed_corners(&self, surface: &Obstacle, face: u32) -> usize {
        let corners = surface.topology().faces()[face as usize];
        corners.iter().filter(|&&vertex| self.is_vertex_exposed(vertex)).count()
    }

    /// Whether a face is partly buried.
    pub(crate) fn is_mixed(&self, surface: &Obstacle, face: u32) -> bool {
        !matches!(self.exposed_corners(surface, face), 0 | 3)
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
        let middle = corners.iter().map(|&vertex| place(vertex)).sum::<Vec3>() / 3.0;
        let mut nearest = (middle.distance_squared(at), None);
        for vertex in corners {
            let distance = place(vertex).distance_squared(at);
            if distance < nearest.0 {
                nearest = (distance, Some(vertex));
            }
        }
        match nearest.1 {
            Some(vertex) => self.is_vertex_exposed(vertex),
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
