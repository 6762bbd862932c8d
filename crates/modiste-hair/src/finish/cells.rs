//! Space about a skin in small cells: most points are answered for by the cell that they lie in.
//!
//! A cell knows how often the skin goes around its middle, and which faces come near it. Of a point in a cell without faces
//! that is all: it lies as the middle does. In another cell, the way from the middle to the point stays in the cell, and each
//! face that it crosses changes the number by one. So every point has its exact winding number, also where an arm has sunk
//! into the chest, for the price of a few planes.

use std::sync::atomic::{AtomicU8, Ordering::Relaxed};

use modiste_core::{SurfacePoint, Vec3, closest_point_on_triangle};
use rayon::prelude::*;

use super::closed::Closed;
use super::slab::{EDGE, Extent, Plate, Slab, Space, see};

/// Most cells along an axis: 2 m.
const MOST: usize = 250;
/// Layers across the first axis that are made together, each by one thread.
const LAYERS: usize = 8;

/// Cells about a skin in one pose.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cells {
    low: Vec3,
    counts: [usize; 3],
    /// Box around everything that is near the skin (m).
    skin: (Vec3, Vec3),
    reach: f64,
    x: Vec<Vec3>,
    plates: Vec<Plate>,
    extents: Vec<Extent>,
    slabs: Vec<Slab>,
    covered: Vec<Covered>,
    closed: Option<Closed>,
}

/// Whether a face is covered, once that has been asked: 0 not yet, 1 no, 2 yes. Whoever asks first finds the same.
#[derive(Debug, Default)]
struct Covered(AtomicU8);

impl Clone for Covered {
    fn clone(&self) -> Self {
        Self(AtomicU8::new(self.0.load(Relaxed)))
    }
}

/// Where a point is with regard to a skin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Standing {
    /// Outside, and further away than was asked for.
    Clear,
    /// Outside; the nearest point of the skin.
    Near(SurfacePoint),
    /// Inside; the nearest point among the faces of the cell, if there are any, and whether it is the nearest of all.
    Inside(Option<SurfacePoint>, bool),
    /// Not in the cells, though where skin may be.
    Unknown,
}

impl Cells {
    /// Makes the cells anew, where a surface with these positions (m) and the box from `low` to `high` meet. Points are told
    /// near if the skin is within `reach` (m).
    pub(crate) fn build(
        &mut self,
        topology: &std::sync::Arc<modiste_core::Topology>,
        x: &[Vec3],
        (low, high): (Vec3, Vec3),
        reach: f64,
    ) {
        let closed = match self.closed.take() {
            Some(closed) if closed.is_of(topology) => closed,
            _ => Closed::new(topology),
        };
        closed.positions(x, &mut self.x);
        self.reach = reach;
        let x = &self.x;
        let seen = closed.faces.par_iter().with_min_len(1024).map(|face| see(face.map(|vertex| x[vertex as usize])));
        seen.unzip_into_vecs(&mut self.plates, &mut self.extents);
        let zero = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (skin_low, skin_high) =
            self.extents.iter().fold(zero, |(low, high), extent| (low.min(extent.low), high.max(extent.high)));
        self.skin = (skin_low - 2.0 * reach, skin_high + 2.0 * reach);
        self.low = low.max(self.skin.0);
        let size = ((high.min(self.skin.1) - self.low) / EDGE).ceil();
        self.counts = size.to_array().map(|n| if n > 0.0 { (n as usize).min(MOST) } else { 0 });
        if self.counts.contains(&0) {
            self.counts = [0; 3];
        }
        let count = self.counts[0].div_ceil(LAYERS);
        self.slabs.resize_with(count, Slab::default);
        self.slabs.iter_mut().for_each(|slab| slab.all.clear());
        let top = self.low + EDGE * Vec3::from_array(self.counts.map(|n| n as f64));
        for (face, extent) in (0u32..).zip(&self.extents) {
            let beyond = extent.low.y - reach > top.y
                || extent.high.y + reach < self.low.y
                || extent.low.z - reach > top.z
                || extent.low.x - reach > top.x
                || extent.high.x + reach < self.low.x;
            if !beyond {
                let slab = |x: f64| ((x - self.low.x) / (EDGE * LAYERS as f64)).clamp(0.0, count as f64) as usize;
                let last = slab(extent.high.x + reach).min(count - 1);
                for slab in &mut self.slabs[slab(extent.low.x - reach)..=last] {
                    slab.all.push(face);
                }
            }
        }
        let (low, counts, plates, extents) = (self.low, self.counts, &self.plates, &self.extents);
        self.slabs.par_iter_mut().enumerate().for_each(|(index, slab)| {
            let layers = [index * LAYERS, ((index + 1) * LAYERS).min(counts[0])];
            slab.fill(&Space { low, counts, layers, reach, x, plates, extents, faces: &closed.faces });
        });
        self.covered.clear();
        self.covered.resize_with(closed.own, Covered::default);
        self.closed = Some(closed);
    }

    /// Whether a point is clear of the skin at the first glance, as nearly all are.
    #[inline]
    pub(crate) fn is_free(&self, p: Vec3) -> bool {
        self.cell(p).is_some_and(|cell| {
            let (slab, index) = self.place(cell);
            slab.free[index]
        })
    }

    /// Where a point stands; `gap` (m) is at most the reach that the cells were made with.
    pub(crate) fn standing(&self, p: Vec3, gap: f64) -> Standing {
        let Some(cell) = self.cell(p) else {
            let far = p.cmplt(self.skin.0).any() || p.cmpgt(self.skin.1).any();
            return if far { Standing::Clear } else { Standing::Unknown };
        };
        let (slab, index) = self.place(cell);
        let faces = slab.faces_of(index);
        let winding = i32::from(slab.winding[index]);
        if faces.is_empty() {
            return if winding > 0 { Standing::Inside(None, false) } else { Standing::Clear };
        }
        let mut near = Near::default();
        if winding + self.crossings(p, cell, faces, |face| near.push(face), gap) <= 0 {
            return match self.nearest(p, near.faces().unwrap_or(faces), gap) {
                Some(at) => Standing::Near(at),
                None => Standing::Clear,
            };
        }
        let nearest = self.nearest(p, faces, f64::INFINITY);
        // All faces are listed that come as near to the cell as the reach.
        let corner = self.corner(cell);
        let inset = (p - corner).min_element().min((corner + Vec3::splat(EDGE) - p).min_element());
        let sure = nearest.is_some_and(|at| at.distance <= inset.max(0.0) + self.reach);
        Standing::Inside(nearest, sure)
    }

    /// Whether a point is inside; `None` where [`Self::standing`] does not know.
    pub(crate) fn is_inside(&self, p: Vec3) -> Option<bool> {
        let Some(cell) = self.cell(p) else {
            let far = p.cmplt(self.skin.0).any() || p.cmpgt(self.skin.1).any();
            return far.then_some(false);
        };
        let (slab, index) = self.place(cell);
        Some(i32::from(slab.winding[index]) + self.crossings(p, cell, slab.faces_of(index), |_| (), 0.0) > 0)
    }

    /// How the winding number changes from the middle of a cell to a point in it; `near` is told of faces of the surface
    /// whose planes are within `gap` (m).
    fn crossings(&self, p: Vec3, cell: [usize; 3], faces: &[u32], mut near: impl FnMut(u32), gap: f64) -> i32 {
        let Some(closed) = &self.closed else { return 0 };
        let middle = self.corner(cell) + Vec3::splat(0.5 * EDGE);
        let mut change = 0;
        for &face in faces {
            let plate = &self.plates[face as usize];
            let above = plate.normal.dot(p) - plate.offset;
            let from = plate.normal.dot(middle) - plate.offset;
            if (above >= 0.0) != (from >= 0.0) && crosses(middle, p, closed.faces[face as usize], &self.x) {
                change += if from >= 0.0 { 1 } else { -1 };
            }
            if above.abs() <= gap && (face as usize) < closed.own {
                near(face);
            }
        }
        change
    }

    /// A face that is likely to be near a point; `None` if it lies in a cell that is outside and touches no part of the skin.
    /// Where no face is known, the result is `u32::MAX`.
    pub(crate) fn face_near(&self, p: Vec3) -> Option<u32> {
        let Some(cell) = self.cell(p) else { return Some(u32::MAX) };
        let (slab, index) = self.place(cell);
        match slab.faces_of(index) {
            [] if slab.winding[index] <= 0 => None,
            faces => Some(faces.first().copied().unwrap_or(u32::MAX)),
        }
    }

    fn corner(&self, cell: [usize; 3]) -> Vec3 {
        self.low + EDGE * Vec3::from_array(cell.map(|n| n as f64))
    }

    fn cell(&self, p: Vec3) -> Option<[usize; 3]> {
        let place = (p - self.low) / EDGE;
        // Comparisons fail for what is no number.
        let within = (0..3).all(|axis| place[axis] >= 0.0 && place[axis] < self.counts[axis] as f64);
        within.then(|| place.to_array().map(|n| n as usize))
    }

    fn place(&self, cell: [usize; 3]) -> (&Slab, usize) {
        let index = ((cell[0] % LAYERS) * self.counts[1] + cell[1]) * self.counts[2] + cell[2];
        (&self.slabs[cell[0] / LAYERS], index)
    }

    /// Whether a face lies in another part with its corners and its middle, each seen from a little `above` it (m).
    pub(crate) fn is_covered(&self, face: u32, above: f64) -> bool {
        let (Some(closed), Some(seen)) = (&self.closed, self.covered.get(face as usize)) else { return false };
        match seen.0.load(Relaxed) {
            0 => {
                let corners = closed.faces[face as usize].map(|vertex| self.x[vertex as usize]);
                let lift = above * self.normal(face);
                let middle = corners.iter().sum::<Vec3>() / 3.0;
                let is_covered = |p: &Vec3| self.is_inside(*p + lift) == Some(true);
                let covered = is_covered(&middle) && corners.iter().all(is_covered);
                seen.0.store(if covered { 2 } else { 1 }, Relaxed);
                covered
            }
            known => known == 2,
        }
    }

    /// Unit normal of a face.
    pub(crate) fn normal(&self, face: u32) -> Vec3 {
        self.plates[face as usize].normal
    }

    fn nearest(&self, p: Vec3, faces: &[u32], within: f64) -> Option<SurfacePoint> {
        let closed = self.closed.as_ref()?;
        let mut best: Option<SurfacePoint> = None;
        let mut least = within * within;
        for &face in faces.iter().filter(|&&face| (face as usize) < closed.own) {
            let plate = &self.plates[face as usize];
            let above = plate.normal.dot(p) - plate.offset;
            if above * above >= least {
                continue;
            }
            let extent = &self.extents[face as usize];
            if (extent.low - p).max(p - extent.high).max(Vec3::ZERO).length_squared() >= least {
                continue;
            }
            let triangle = closed.faces[face as usize].map(|vertex| self.x[vertex as usize]);
            let (point, barycentric) = closest_point_on_triangle(p, triangle);
            let squared = point.distance_squared(p);
            if squared < least {
                least = squared;
                best = Some(SurfacePoint { face, barycentric, point, distance: squared.sqrt() });
            }
        }
        best
    }
}

/// Some faces near a point: up to a few; more are as good as all.
#[derive(Default)]
struct Near {
    faces: [u32; 8],
    count: usize,
}

impl Near {
    fn push(&mut self, face: u32) {
        if let Some(slot) = self.faces.get_mut(self.count) {
            *slot = face;
        }
        self.count += 1;
    }

    fn faces(&self) -> Option<&[u32]> {
        self.faces.get(..self.count)
    }
}

/// Whether the way between two points on different sides of a face's plane goes through the face. Both faces at an edge judge
/// by the same number, so that no way slips through between them.
fn crosses(from: Vec3, to: Vec3, corners: [u32; 3], x: &[Vec3]) -> bool {
    let way = to - from;
    let side = |u: u32, v: u32| {
        let [a, b] = [u.min(v), u.max(v)].map(|vertex| x[vertex as usize] - from);
        (way.dot(a.cross(b)) >= 0.0) == (u < v)
    };
    let first = side(corners[0], corners[1]);
    first == side(corners[1], corners[2]) && first == side(corners[2], corners[0])
}

#[cfg(test)]
mod tests {
    use super::{Cells, Standing};
    use modiste_core::shapes::{icosphere, torus};
    use modiste_core::{Mesh, Topology, TriangleBvh, Vec3, normal, seeded_rng, winding_number_exact};
    use std::sync::Arc;

    /// Two balls that have sunk into each other, and a ring.
    fn shapes() -> Vec<Mesh> {
        let ball = icosphere(4);
        let n = ball.vertices.len() as u32;
        let faces = ball.topology.faces().iter().copied();
        let two = faces.clone().chain(faces.map(|face| face.map(|vertex| vertex + n))).collect();
        let x: Vec<Vec3> = ball
            .vertices
            .iter()
            .map(|v| 0.07 * *v)
            .chain(ball.vertices.iter().map(|v| 0.05 * *v + Vec3::new(0.06, 0.013, 0.0)))
            .collect();
        let mut ring = torus(0.08, 0.03, 40, 20);
        ring.vertices.iter_mut().for_each(|v| *v += Vec3::new(0.1, 0.2, 0.3));
        vec![Mesh { topology: Arc::new(Topology::new(x.len(), two).unwrap()), vertices: x }, ring]
    }

    #[test]
    fn cells_say_what_winding_numbers_and_distances_say() {
        let (gap, reach) = (0.0012, 0.0013);
        let mut rng = seeded_rng(21);
        for mesh in shapes() {
            let x = &mesh.vertices;
            let tree = TriangleBvh::new(&mesh.topology, x);
            let (low, high) = tree.bounds().unwrap();
            let mut cells = Cells::default();
            cells.build(&mesh.topology, x, (low - 0.01, high + 0.01), reach);
            let mut seen = [0; 3];
            for index in 0..6000 {
                let vertex = x[index * 7 % x.len()];
                let spread = if index % 2 == 0 { 0.002 } else { 0.03 };
                let p = vertex + spread * Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng));
                let inside = winding_number_exact(&mesh.topology, x, p) > 0.5;
                let at = tree.closest_point(x, p, f64::INFINITY).unwrap();
                match cells.standing(p, gap) {
                    Standing::Clear => {
                        assert!(!inside && at.distance > gap, "{p}");
                        seen[0] += 1;
                    }
                    Standing::Near(found) => {
                        assert!(!inside && (found.distance - at.distance).abs() < 1e-12, "{p}");
                        seen[1] += 1;
                    }
                    Standing::Inside(found, sure) => {
                        assert!(inside, "{p}");
                        assert!(!sure || (found.unwrap().distance - at.distance).abs() < 1e-12, "{p}");
                        seen[2] += 1;
                    }
                    Standing::Unknown => panic!("{p} is not in the cells"),
                }
                assert_eq!(cells.is_inside(p), Some(inside), "{p}");
                assert!(cells.face_near(p).is_some() || !inside);
                assert!(!cells.is_free(p) || (!inside && at.distance > gap), "{p}");
            }
            assert!(seen.iter().all(|&count| count > 300), "{seen:?}");
        }
    }

    #[test]
    fn without_points_near_the_skin_there_are_no_cells() {
        let ball = icosphere(2);
        let mut cells = Cells::default();
        cells.build(&ball.topology, &ball.vertices, (Vec3::splat(5.0), Vec3::splat(6.0)), 0.001);
        assert_eq!(cells.standing(Vec3::splat(5.5), 0.001), Standing::Clear);
        assert_eq!(cells.standing(Vec3::ZERO, 0.001), Standing::Unknown);
    }
}
