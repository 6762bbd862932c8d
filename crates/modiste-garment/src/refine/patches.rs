//! A garment in small patches, by which one tells quickly where it may cross itself.
//!
//! Cloth whose normals all point into one half of space does not cross itself, unless its rim does (Volino and
//! Magnenat-Thalmann 1994), so that a patch, or two that are neighbours, need a closer look only where the cloth is bent over.
//! Patches that are no neighbours need one where their boxes meet. Rims are not looked at: of a surface that passes through
//! itself all over, fewer than one pair in a thousand is missed.

use modiste_core::{Topology, Vec3, corners};
use rayon::prelude::*;

/// Faces of a patch, about.
const SIZE: usize = 24;
/// Product of normals with the mean of two patches above which the patches are taken to lie flat.
const FLAT: f32 = 0.15;
/// Patches that one thread compares with all others at a time.
const PATCHES_AT_ONCE: usize = 8;

/// The patches of a garment.
#[derive(Debug, Clone)]
pub(crate) struct Patches {
    /// Where the faces of each patch begin, and the end of the last.
    starts: Vec<u32>,
    /// The faces, patch by patch.
    faces: Vec<u32>,
    /// Of each patch those with larger numbers that share an edge with it, ascending.
    neighbours: Vec<Vec<u32>>,
    boxes: Vec<Box3>,
    normals: Vec<[f32; 3]>,
    bounds: Vec<Bounds>,
    /// Pairs of faces that were found, in runs of patches.
    of_runs: Vec<Vec<[u32; 2]>>,
}

/// Low and high corner (m).
type Box3 = [[f32; 3]; 2];

/// Around a patch.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    limits: Box3,
    /// Mean normal, of unit length.
    axis: [f32; 3],
}

const EMPTY: Box3 = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];

impl Patches {
    pub(crate) fn new(topology: &Topology) -> Self {
        let mut patch_of = vec![u32::MAX; topology.face_count()];
        let (mut starts, mut faces) = (vec![0], Vec::new());
        for seed in 0..topology.face_count() as u32 {
            if patch_of[seed as usize] != u32::MAX {
                continue;
            }
            // Grown in rings around its first face.
            let patch = starts.len() as u32 - 1;
            let mut next = faces.len();
            patch_of[seed as usize] = patch;
            faces.push(seed);
            while next < faces.len() && faces.len() - (starts[patch as usize] as usize) < SIZE {
                for vertex in topology.faces()[faces[next] as usize] {
                    for &face in topology.vertex_faces(vertex as usize) {
                        if patch_of[face as usize] == u32::MAX {
                            patch_of[face as usize] = patch;
                            faces.push(face);
                        }
                    }
                }
                next += 1;
            }
            starts.push(faces.len() as u32);
        }
        let mut neighbours = vec![Vec::new(); starts.len() - 1];
        for edge in topology.edges() {
            if let [Some(first), Some(second)] = edge.faces.map(|face| face.map(|face| patch_of[face as usize])) {
                neighbours[first.min(second) as usize].extend((first != second).then(|| first.max(second)));
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        Self {
            starts,
            faces,
            neighbours,
            boxes: Vec::new(),
            normals: Vec::new(),
            bounds: Vec::new(),
            of_runs: Vec::new(),
        }
    }

    fn range(&self, patch: usize) -> std::ops::Range<usize> {
        self.starts[patch] as usize..self.starts[patch + 1] as usize
    }

    /// The pairs of faces that may cross each other in a garment (m): their boxes meet.
    pub(crate) fn pairs_that_may_cross(&mut self, topology: &Topology, garment: &[Vec3], pairs: &mut Vec<[u32; 2]>) {
        self.measure(topology, garment);
        let count = self.bounds.len();
        let mut of_runs = std::mem::take(&mut self.of_runs);
        of_runs.resize_with(count.div_ceil(PATCHES_AT_ONCE), Vec::new);
        let known = &*self;
        of_runs.par_iter_mut().enumerate().for_each(|(run, found)| {
            found.clear();
            for first in run * PATCHES_AT_ONCE..((run + 1) * PATCHES_AT_ONCE).min(count) {
                let own = known.bounds[first].limits;
                for second in first..count {
                    if meet(&own, &known.bounds[second].limits) && !known.lies_flat(first, second) {
                        found.extend(known.face_pairs([first, second]));
                    }
                }
            }
        });
        pairs.clear();
        of_runs.iter().for_each(|found| pairs.extend_from_slice(found));
        self.of_runs = of_runs;
    }

    /// Boxes and normals of faces and patches.
    fn measure(&mut self, topology: &Topology, garment: &[Vec3]) {
        self.boxes.clear();
        self.normals.clear();
        for &face in &self.faces {
            let triangle @ [a, b, c] = corners(topology.faces()[face as usize], garment);
            self.normals.push((b - a).cross(c - a).normalize_or_zero().as_vec3().to_array());
            self.boxes.push(
                triangle
                    .map(|corner| corner.as_vec3().to_array())
                    .iter()
                    .fold(EMPTY, |limits, corner| join(limits, [*corner; 2])),
            );
        }
        self.bounds.clear();
        for patch in 0..self.starts.len() - 1 {
            let range = self.starts[patch] as usize..self.starts[patch + 1] as usize;
            let limits = self.boxes[range.clone()].iter().fold(EMPTY, |limits, other| join(limits, *other));
            let sum = self.normals[range].iter().fold([0.0; 3], |sum, normal| add(sum, *normal));
            self.bounds.push(Bounds { limits, axis: unit(sum) });
        }
    }

    /// Whether two patches are one, or neighbours, and all their normals point one way.
    fn lies_flat(&self, first: usize, second: usize) -> bool {
        if first != second && self.neighbours[first].binary_search(&(second as u32)).is_err() {
            return false;
        }
        let axis = unit(add(self.bounds[first].axis, self.bounds[second].axis));
        let is_flat = |patch: usize| self.normals[self.range(patch)].iter().all(|normal| dot(*normal, axis) > FLAT);
        is_flat(first) && is_flat(second)
    }

    /// Pairs of faces of two patches whose boxes meet.
    fn face_pairs(&self, [first, second]: [usize; 2]) -> impl Iterator<Item = [u32; 2]> {
        let other = self.bounds[second].limits;
        let near = self.range(first).filter(move |&slot| meet(&self.boxes[slot], &other));
        near.flat_map(move |slot| {
            let rest = self.range(second).filter(move |&with| first != second || with > slot);
            let meeting = rest.filter(move |&with| meet(&self.boxes[slot], &self.boxes[with]));
            meeting.map(move |with| [self.faces[slot], self.faces[with]])
        })
    }
}

fn meet(a: &Box3, b: &Box3) -> bool {
    (0..3).all(|axis| a[0][axis] <= b[1][axis] && b[0][axis] <= a[1][axis])
}

fn join(a: Box3, b: Box3) -> Box3 {
    let least = |a: f32, b: f32| if b < a { b } else { a };
    [[0, 1, 2].map(|axis| least(a[0][axis], b[0][axis])), [0, 1, 2].map(|axis| -least(-a[1][axis], -b[1][axis]))]
}

fn add(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Of unit length, or zero.
fn unit(a: [f32; 3]) -> [f32; 3] {
    let length = dot(a, a).sqrt();
    if length > 0.0 { a.map(|along| along / length) } else { a }
}

#[cfg(test)]
mod tests {
    use super::Patches;
    use modiste_core::shapes::{grid, icosphere, torus};
    use modiste_core::{Mesh, TriangleBvh, Vec3};

    #[test]
    fn nearly_every_pair_that_crosses_is_among_those_that_may() {
        let spindle = torus(0.2, 0.5, 60, 40);
        let wave = grid(50, 50);
        let folded = |v: &Vec3| Vec3::new(0.2 * (9.0 * v.x).sin(), 0.05 * (14.0 * v.x + 3.0 * v.y).sin(), v.y);
        let wave = Mesh { vertices: wave.vertices.iter().map(folded).collect(), ..wave };
        for mesh in [spindle, wave] {
            let mut pairs = Vec::new();
            Patches::new(&mesh.topology).pairs_that_may_cross(&mesh.topology, &mesh.vertices, &mut pairs);
            let mut pairs: Vec<[u32; 2]> = pairs.into_iter().map(|[a, b]| [a.min(b), a.max(b)]).collect();
            pairs.sort_unstable();
            let crossing = TriangleBvh::new(&mesh.topology, &mesh.vertices).self_intersections(&mesh.vertices);
            assert!(crossing.len() > 100);
            let missed = crossing.iter().filter(|pair| pairs.binary_search(pair).is_err()).count();
            // Patches that lie flat may cross at their very rims.
            assert!(1000 * missed < crossing.len(), "{missed} of {}", crossing.len());
        }
    }

    #[test]
    fn a_surface_that_is_only_bent_needs_no_closer_look() {
        let ball = icosphere(4);
        let mut pairs = Vec::new();
        Patches::new(&ball.topology).pairs_that_may_cross(&ball.topology, &ball.vertices, &mut pairs);
        let faces = ball.topology.face_count();
        assert!(pairs.len() < 2 * faces, "{} of {faces} faces", pairs.len());
    }
}
