//! The independent judge of a dressed result: what is inside the body, what crosses what, and how deep.
//!
//! It shares no code with the fit. Depths are measured thus:
//!
//! | finding | depth |
//! |---|---|
//! | garment in the body | the greatest distance from the skin of any point of the garment's triangles that is in one part of the body, corners or not |
//! | outer garment in an inner one | the same, below the inner garment's surface, where that lies with its outer side outwards, of points that are nearer to the body than it |
//! | garment in itself | the shortest way by which the two crossing triangles come apart ([`modiste_core::triangle_separation`]) |
//!
//! A point is in as many parts of the body as its winding number says. Where that is two or more, in a thigh that has sunk
//! into the other, cloth is *pinched*: it lies between the parts, and there is no surface that it could be outside of. It is
//! counted apart, and has no depth. In one part only it does have one, whichever skin is nearest: skin that is buried in
//! another part is where the place between the two begins.
//!
//! Triangles that cross the body within [the size of a triangle](skin) of skin that crosses other skin are *caught*: on their
//! way between the parts they must pass the crease, which triangles of a centimetre do not follow. They are counted and
//! measured like all others, but on a line of their own, and the frame is told; nothing else is ever caught.

mod layer;
mod report;
mod skin;

use std::sync::Arc;

use modiste_core::{Sounding, Topology, TriangleBvh, Vec3, centroid, deepest_on_triangle, triangle_separation};

pub use report::{CheckReport, Finding, GarmentFindings, LayerFindings, Limits};

use layer::Layer;
use skin::Skin;

/// Accuracy of depths (m).
pub const DEPTH_ACCURACY: f64 = 1e-5;

/// Checks frame after frame of one result. The first mesh is the body, garments follow from the innermost outwards.
#[derive(Debug, Clone)]
pub struct Checker {
    surfaces: Vec<Surface>,
}

/// A mesh and a tree that is refit to each frame.
#[derive(Debug, Clone)]
pub(crate) struct Surface {
    pub(crate) topology: Arc<Topology>,
    pub(crate) tree: TriangleBvh,
}

/// How often something was found in a frame, and how deep (m) at the worst.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Found {
    /// How many vertices or pairs of triangles.
    pub count: usize,
    /// The greatest depth (m); 0 for none.
    pub depth: f64,
    /// Where that is (m, world).
    pub place: Option<Vec3>,
}

impl Found {
    /// Takes a depth if it is the greatest so far.
    fn offer(&mut self, depth: f64, place: Vec3) {
        if depth > self.depth {
            (self.depth, self.place) = (depth, Some(place));
        }
    }

    /// Takes the deepest point of a triangle if it is deeper than all so far.
    fn offer_triangle(&mut self, triangle: [Vec3; 3], sound: impl FnMut(Vec3) -> Sounding) {
        if let Some((depth, place)) = deepest_on_triangle(triangle, self.depth, DEPTH_ACCURACY, sound) {
            self.offer(depth, place);
        }
    }
}

/// What was found of one garment.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct GarmentCheck {
    /// Vertices inside the body.
    pub inside: Found,
    /// Vertices caught between parts of the body that are in each other; depth below the nearest skin that is not.
    pub pinched: Found,
    /// Pairs of a triangle of the garment and one of the body that cross, but for those that are caught.
    pub body: Found,
    /// Such pairs where parts of the body are in each other.
    pub caught: Found,
    /// Pairs of triangles of the garment that cross.
    pub itself: Found,
}

/// What was found of two garments.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LayerCheck {
    /// Index of the inner garment.
    pub inner: usize,
    /// Index of the outer garment.
    pub outer: usize,
    /// Vertices of the outer garment below the inner one.
    pub below: Found,
    /// Pairs of their triangles that cross.
    pub crossings: Found,
}

/// What was found in one frame.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameCheck {
    /// Vertices of the body inside another part of it, and how deep they are.
    pub body: Found,
    /// One for each garment.
    pub garments: Vec<GarmentCheck>,
    /// One for each pair of garments.
    pub layers: Vec<LayerCheck>,
}

impl Checker {
    /// For these meshes, the body first, with their vertices (m) in some frame.
    pub fn new(meshes: &[(Arc<Topology>, &[Vec3])]) -> Self {
        let surface = |(topology, x): &(Arc<Topology>, &[Vec3])| Surface {
            topology: Arc::clone(topology),
            tree: TriangleBvh::new(topology, x),
        };
        Self { surfaces: meshes.iter().map(surface).collect() }
    }

    /// Checks one frame: the vertices (m) of every mesh, in the order of [`Self::new`].
    pub fn check(&self, frame: &[Vec<Vec3>]) -> FrameCheck {
        let mut surfaces = self.surfaces.clone();
        for (surface, x) in surfaces.iter_mut().zip(frame) {
            surface.tree.refit(x);
        }
        let Some(((body, garments), (body_x, garments_x))) = surfaces.split_first().zip(frame.split_first()) else {
            return FrameCheck::default();
        };
        let skin = Skin::new(body, body_x);
        let mut found = FrameCheck { body: skin.crossing(), ..FrameCheck::default() };
        for (garment, x) in garments.iter().zip(garments_x) {
            found.garments.push(GarmentCheck { itself: crossings_of(garment, x), ..skin.garment(garment, x) });
        }
        for inner in 0..garments.len() {
            let below = Layer::new(&garments[inner], &garments_x[inner], &skin);
            for outer in inner + 1..garments.len() {
                let (below, crossings) = below.check(&garments[outer], &garments_x[outer]);
                found.layers.push(LayerCheck { inner, outer, below, crossings });
            }
        }
        found
    }
}

/// Where a surface crosses itself.
fn crossings_of(surface: &Surface, x: &[Vec3]) -> Found {
    let pairs = surface.tree.self_intersections(x);
    let corners = |face: u32| modiste_core::corners(surface.topology.faces()[face as usize], x);
    let mut found = Found { count: pairs.len(), ..Found::default() };
    for pair in pairs {
        let [a, b] = pair.map(corners);
        if let Some(way) = triangle_separation(a, b) {
            found.offer(way.length(), centroid(&a));
        }
    }
    found
}

/// The faces of one side of some pairs, each once.
fn faces_of(pairs: &[[u32; 2]]) -> Vec<u32> {
    let mut faces: Vec<u32> = pairs.iter().map(|pair| pair[0]).collect();
    faces.dedup();
    faces
}

#[cfg(test)]
mod tests;
