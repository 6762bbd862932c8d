//! A tree of boxes over the faces of a mesh, with the queries that it makes fast.
//!
//! One file per query: [`closest`], [`ray`], [`winding`], [`overlap`].

mod build;
mod closest;
mod overlap;
mod ray;
mod winding;

pub use closest::SurfacePoint;
pub use overlap::triangles_cross;
pub use ray::RayHit;
pub use winding::winding_number_exact;

use crate::{Topology, Vec3};
use winding::Dipoles;

/// Children of a node.
const WIDTH: usize = 4;
/// Most faces in a leaf.
const LEAF: usize = 2;
/// Deep enough for any tree: a child has at most (5/6)³ of the faces of its node, which makes 33 levels for 2²⁸ faces,
/// and each level leaves up to three siblings waiting.
const STACK: usize = 128;

/// A tree of boxes over faces. It keeps no positions: every query takes those that the tree was built or refit with.
///
/// Four children per node, their boxes side by side in f32, so that one sweep of vector instructions tests all four.
/// Boxes are rounded outwards and queries widened by the rounding of their point, so results are those of f64.
#[derive(Debug, Clone)]
pub struct TriangleBvh {
    nodes: Vec<Node>,
    /// Per child what it is from afar; made by the first winding number after each motion.
    dipoles: Dipoles,
    /// Faces in the order of the leaves: corners, and index in the topology.
    corners: Vec<[u32; 3]>,
    faces: Vec<u32>,
    /// Place in the order of the leaves of each face of the topology; `u32::MAX` if it is not in the tree.
    places: Vec<u32>,
    /// Largest magnitude of a coordinate of a box.
    extent: f64,
}

/// The boxes and places of up to four children. Nodes come before their children.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(16))]
struct Node {
    low: [[f32; WIDTH]; 3],
    high: [[f32; WIDTH]; 3],
    children: [Child; WIDTH],
}

/// A child: nothing, a node, or a run of faces; packed into 32 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Child(u32);

/// What a [`Child`] stands for.
enum ChildKind {
    Empty,
    Node(usize),
    /// First of the faces in leaf order, and how many.
    Leaf(usize, usize),
}

impl Child {
    const EMPTY: Self = Self(u32::MAX);
    const LEAF_BIT: u32 = 1 << 31;

    fn node(index: usize) -> Self {
        Self(index as u32)
    }

    fn leaf(first: usize, count: usize) -> Self {
        debug_assert!((1..=LEAF).contains(&count) && first < 1 << 28);
        Self(Self::LEAF_BIT | (first as u32) << 3 | count as u32)
    }

    #[inline(always)]
    fn kind(self) -> ChildKind {
        if self == Self::EMPTY {
            ChildKind::Empty
        } else if self.0 & Self::LEAF_BIT == 0 {
            ChildKind::Node(self.0 as usize)
        } else {
            ChildKind::Leaf(((self.0 & !Self::LEAF_BIT) >> 3) as usize, (self.0 & 7) as usize)
        }
    }
}

impl Node {
    /// A node without children: boxes that no query meets.
    const EMPTY: Self = Self {
        low: [[f32::INFINITY; WIDTH]; 3],
        high: [[f32::NEG_INFINITY; WIDTH]; 3],
        children: [Child::EMPTY; WIDTH],
    };

    /// Sets the box of one child, rounded outwards.
    fn set_box(&mut self, slot: usize, (low, high): (Vec3, Vec3)) {
        let (low, high) = (low.to_array(), high.to_array());
        for axis in 0..3 {
            self.low[axis][slot] = (low[axis] as f32).next_down();
            self.high[axis][slot] = (high[axis] as f32).next_up();
        }
    }

    /// The box around all children.
    fn bounds(&self) -> (Vec3, Vec3) {
        let low = self.low.map(|axis| f64::from(axis.into_iter().fold(f32::INFINITY, f32::min)));
        let high = self.high.map(|axis| f64::from(axis.into_iter().fold(f32::NEG_INFINITY, f32::max)));
        (Vec3::from_array(low), Vec3::from_array(high))
    }
}

/// The lesser of two numbers by a single comparison; what is no number never is. `min` costs three instructions.
#[inline(always)]
fn lesser<T: PartialOrd>(a: T, b: T) -> T {
    if b < a { b } else { a }
}

#[inline(always)]
fn greater<T: PartialOrd>(a: T, b: T) -> T {
    if b > a { b } else { a }
}

impl TriangleBvh {
    /// Builds the tree over all faces.
    pub fn new(topology: &Topology, x: &[Vec3]) -> Self {
        let faces: Vec<u32> = (0..topology.face_count() as u32).collect();
        Self::of_faces(topology, x, &faces)
    }

    /// Builds the tree over some of the faces; results name them by their index in the topology.
    pub fn of_faces(topology: &Topology, x: &[Vec3], faces: &[u32]) -> Self {
        let corners: Vec<[u32; 3]> = faces.iter().map(|&face| topology.faces()[face as usize]).collect();
        let (nodes, order) = build::build(&corners, x);
        let mut places = vec![u32::MAX; topology.face_count()];
        for (place, &index) in (0u32..).zip(&order) {
            places[faces[index as usize] as usize] = place;
        }
        let mut tree = Self {
            places,
            dipoles: Dipoles::default(),
            nodes,
            corners: order.iter().map(|&index| corners[index as usize]).collect(),
            faces: order.iter().map(|&index| faces[index as usize]).collect(),
            extent: 0.0,
        };
        tree.refit(x);
        tree
    }

    /// Number of faces in the tree.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Fits the boxes to vertices that have moved. The tree keeps its shape, so after large motion queries get slower,
    /// never wrong.
    pub fn refit(&mut self, x: &[Vec3]) {
        self.dipoles.forget();
        for index in (0..self.nodes.len()).rev() {
            for slot in 0..WIDTH {
                match self.nodes[index].children[slot].kind() {
                    ChildKind::Empty => {}
                    ChildKind::Node(child) => {
                        let node = self.nodes[child];
                        for axis in 0..3 {
                            let (low, high) = (node.low[axis], node.high[axis]);
                            self.nodes[index].low[axis][slot] = low.into_iter().fold(f32::INFINITY, lesser);
                            self.nodes[index].high[axis][slot] = high.into_iter().fold(f32::NEG_INFINITY, greater);
                        }
                    }
                    ChildKind::Leaf(first, count) => {
                        let corners = &self.corners[first..first + count];
                        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
                        for vertex in corners.iter().flatten() {
                            let p = x[*vertex as usize].to_array();
                            low = [0, 1, 2].map(|axis| lesser(low[axis], p[axis]));
                            high = [0, 1, 2].map(|axis| greater(high[axis], p[axis]));
                        }
                        self.nodes[index].set_box(slot, (Vec3::from_array(low), Vec3::from_array(high)));
                    }
                }
            }
        }
        self.extent = self.bounds().map_or(0.0, |(low, high)| low.abs().max(high.abs()).max_element());
    }

    /// The box around everything, rounded outwards; `None` without faces.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        (!self.faces.is_empty()).then(|| self.nodes[0].bounds())
    }

    /// How far the f32 boxes and an f32 copy of `p` can be off together (m).
    fn rounding(&self, p: Vec3) -> f64 {
        4.0 * f64::from(f32::EPSILON) * p.abs().max_element().max(self.extent)
    }

    /// The corners of a face given in leaf order.
    #[inline(always)]
    fn triangle(&self, index: usize, x: &[Vec3]) -> [Vec3; 3] {
        self.corners[index].map(|vertex| x[vertex as usize])
    }
}
