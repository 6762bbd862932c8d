//! A garment in small patches, by which one tells quickly where it may cross itself.
//!
//! Cloth whose normals all point into one half of space does not cross itself, unless its rim does (Volino and
//! Magnenat-Thalmann 1994), so that a patch, or two that are neighbours, need a closer look only where the cloth is bent over.
//! Patches that are no neighbours need one where their boxes meet. Rims are not looked at: of a surface that passes through
//! itself all over, fewer than one pair in a thousand is missed.

use modiste_core::{Topology, Vec3, corners};
use rayon::prelude::*;

/// Faces of a patch, about, and at most.
const SIZE: usize = 24;
const MOST_FACES: usize = 64;
/// Product of normals with the mean of two patches above which the patches are taken to lie flat.
const FLAT: f32 = 0.15;
/// Faces that one thread takes at a time.
const FACES_AT_ONCE: usize = 512;
/// Room for the pairs of a run, whose patches are others in each frame.
const PAIRS_OF_RUN: usize = 4096;
/// The axis that clothes are longest along.
const UP: usize = 1;
/// Runs of patches that are compared with those above side by side.
const RUNS: usize = 16;

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
    /// The patches in the order of their low ends along [`UP`].
    upwards: Vec<u32>,
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
    /// Least product of it with the normal of a face.
    spread: f32,
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
                        let has_room = faces.len() - (starts[patch as usize] as usize) < MOST_FACES;
                        if has_room && patch_of[face as usize] == u32::MAX {
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
            upwards: (0..starts.len() as u32 - 1).collect(),
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
        of_runs.resize_with(RUNS, || Vec::with_capacity(PAIRS_OF_RUN));
        let at_once = count.div_ceil(RUNS);
        let known = &*self;
        of_runs.par_iter_mut().enumerate().for_each(|(run, found)| {
            found.clear();
            for place in (run * at_once).min(count)..((run + 1) * at_once).min(count) {
                let first = known.upwards[place] as usize;
                let own = known.bounds[first].limits;
                let others = known.upwards[place..].iter().map(|&second| second as usize);
                for second in others.take_while(|&second| known.bounds[second].limits[0][UP] <= own[1][UP]) {
                    let [low, high] = [first.min(second), first.max(second)];
                    if meet(&own, &known.bounds[second].limits) && !known.lies_flat(low, high) {
                        known.find_pairs([low, high], found);
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
        let Self { starts, faces, boxes, normals, bounds, upwards, .. } = self;
        let of_face = |&face: &u32| {
            let triangle @ [a, b, c] = corners(topology.faces()[face as usize], garment);
            let places = triangle.map(|corner| corner.as_vec3().to_array());
            let limits = places.iter().fold(EMPTY, |limits, corner| join(limits, [*corner; 2]));
            ((b - a).cross(c - a).normalize_or_zero().as_vec3().to_array(), limits)
        };
        faces.par_iter().with_min_len(FACES_AT_ONCE).map(of_face).unzip_into_vecs(normals, boxes);
        bounds.clear();
        bounds.extend(starts.array_windows().map(|&[start, end]| {
            let range = start as usize..end as usize;
            let limits = boxes[range.clone()].iter().fold(EMPTY, |limits, other| join(limits, *other));
            let axis = unit(normals[range.clone()].iter().fold([0.0; 3], |sum, normal| add(sum, *normal)));
            let spread = normals[range].iter().fold(1.0f32, |least, normal| least.min(dot(*normal, axis)));
            Bounds { limits, axis, spread }
        }));
        upwards.sort_unstable_by(|&a, &b| {
            let low = |patch: u32| bounds[patch as usize].limits[0][UP];
            low(a).total_cmp(&low(b)).then(a.cmp(&b))
        });
    }

    /// Whether two patches are one, or neighbours, and all their normals point one way.
    fn lies_flat(&self, first: usize, second: usize) -> bool {
        if first != second && self.neighbours[first].binary_search(&(second as u32)).is_err() {
            return false;
        }
        let axis = unit(add(self.bounds[first].axis, self.bounds[second].axis));
        let is_flat = |patch: usize| {
            // The cosine of the angle between the axes and that to the furthest normal together.
            let Bounds { axis: own, spread, .. } = self.bounds[patch];
            let (lean, sine) = (dot(own, axis), |cosine: f32| (1.0 - cosine * cosine).max(0.0).sqrt());
            (spread > 0.0 && lean * spread - sine(lean) * sine(spread) > FLAT)
                || self.normals[self.range(patch)].iter().all(|normal| dot(*normal, axis) > FLAT)
        };
        is_flat(first) && is_flat(second)
    }

    /// Finds the pairs of faces of two patches whose boxes meet.
    fn find_pairs(&self, [first, second]: [usize; 2], pairs: &mut Vec<[u32; 2]>) {
        let common = overlap(&self.bounds[first].limits, &self.bounds[second].limits);
        let is_near = |slot: &usize| meet(&self.boxes[*slot], &common);
        let (mut others, mut count) = ([0; MOST_FACES], 0);
        for slot in self.range(second).filter(is_near) {
            others[count] = slot;
            count += 1;
        }
        for slot in self.range(first).filter(is_near) {
            let others = others[..count].iter().filter(|&&with| first != second || with > slot);
            let meeting = others.filter(|&&with| meet(&self.boxes[slot], &self.boxes[with]));
            pairs.extend(meeting.map(|&with| [self.faces[slot], self.faces[with]]));
        }
    }
}

fn meet(a: &Box3, b: &Box3) -> bool {
    (0..3).all(|axis| a[0][axis] <= b[1][axis] && b[0][axis] <= a[1][axis])
}

/// What two boxes have in common, if they meet.
fn overlap(a: &Box3, b: &Box3) -> Box3 {
    let inner = |end: usize, axis: usize, least: bool| {
        let (a, b) = (a[end][axis], b[end][axis]);
        if (a < b) == least { b } else { a }
    };
    [[0, 1, 2].map(|axis| inner(0, axis, true)), [0, 1, 2].map(|axis| inner(1, axis, false))]
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
