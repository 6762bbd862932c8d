//! Where the surface of a body comes near to itself.

use modiste_core::{Topology, Vec3, corners};
use rayon::prelude::*;

use super::obstacle::Obstacle;

/// Surfaces further apart than this (m) are not looked for.
pub(crate) const REACH: f64 = 0.025;

/// Product of the normals of two points below which they are of surfaces that face each other.
const FACING: f32 = -0.2;

/// The same of points one of which is in front of the other: the walls of a crease, or of two parts that pass through each
/// other.
const CREASED: f32 = 0.5;

/// The surface is known at points no further apart than this along it (m); most triangles of a body are smaller, some three
/// times as large.
const SPACING: f64 = 0.016;

/// What the square of the distance between two points is taken to be too large by (m²), because the surface between them may be
/// nearer: the square of the radius of a circle through the corners of a triangle of such points.
const SLACK: f64 = 0.012 * 0.012;

/// The room of a point that nothing faces (m).
pub(crate) const FREE: f64 = 0.0219;

/// Points that one thread takes at a time.
const POINTS_AT_ONCE: usize = 512;

/// Most cells along one axis.
const MOST_CELLS: f64 = 256.0;

/// For each face of a body how far it is to a part of the surface that faces the other way: the other thigh, the arm beside
/// the trunk, the other side of a crease, the trunk around an arm that has passed into it.
#[derive(Debug, Clone)]
pub(crate) struct Crowding {
    /// Whether a vertex, and with it its faces, is asked about.
    asked: Vec<bool>,
    /// Points between the corners of large faces, face after face.
    samples: Vec<Sample>,
    /// Where the samples of each face begin, and the end of the last.
    starts: Vec<u32>,
    /// Of the vertices, then of the samples.
    rooms: Vec<f64>,
    face_rooms: Vec<f64>,
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    cloud: Cloud,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    face: u32,
    barycentric: [f64; 3],
}

impl Crowding {
    /// For a surface of this topology; `vertices` (m) in any pose say how large its faces are.
    pub(crate) fn new(topology: &Topology, vertices: &[Vec3], is_asked: impl Fn(usize) -> bool) -> Self {
        let mut asked = vec![false; vertices.len()];
        let (mut samples, mut starts) = (Vec::new(), vec![0]);
        for (index, &face) in topology.faces().iter().enumerate() {
            if is_asked(index) {
                face.iter().for_each(|&vertex| asked[vertex as usize] = true);
                let lattice = lattice(corners(face, vertices));
                samples.extend(lattice.map(|barycentric| Sample { face: index as u32, barycentric }));
            }
            starts.push(samples.len() as u32);
        }
        let (rooms, face_rooms) = (Vec::new(), vec![0.0; topology.face_count()]);
        let (points, normals) = (Vec::new(), Vec::new());
        Self { asked, samples, starts, rooms, face_rooms, points, normals, cloud: Cloud::default() }
    }

    /// Takes in the surface where it is now.
    pub(crate) fn update(&mut self, surface: &Obstacle) {
        let Self { asked, samples, starts, rooms, face_rooms, points, normals, cloud } = self;
        let faces = surface.topology().faces();
        points.clear();
        points.extend_from_slice(surface.vertices());
        points.extend(samples.iter().map(|sample| {
            let [a, b, c] = corners(faces[sample.face as usize], surface.vertices());
            let [u, v, w] = sample.barycentric;
            u * a + v * b + w * c
        }));
        normals.clear();
        normals.extend_from_slice(surface.vertex_normals());
        normals.extend(samples.iter().map(|sample| surface.face_normal(sample.face)));
        cloud.fill(points, normals);
        let cloud = &*cloud;
        rooms.resize(points.len(), 0.0);
        let each = rooms.par_iter_mut().zip(&*points).zip(&*normals).enumerate().with_min_len(POINTS_AT_ONCE);
        each.for_each(|(index, ((room, point), normal))| {
            *room = if asked.get(index).is_none_or(|&asked| asked) { cloud.room(*point, *normal) } else { 0.0 };
        });
        for (index, (room, face)) in face_rooms.iter_mut().zip(faces).enumerate() {
            let samples = starts[index] as usize..starts[index + 1] as usize;
            let own = rooms[asked.len()..][samples].iter().copied();
            *room = own.chain(face.iter().map(|&vertex| rooms[vertex as usize])).fold(FREE, f64::min);
        }
    }

    /// Less than the distance from a face to surface that faces it (m), [`FREE`] where there is none. 0 where it was not asked.
    pub(crate) fn room(&self, face: u32) -> f64 {
        self.face_rooms[face as usize]
    }

    /// The same from a vertex.
    pub(crate) fn room_of_vertex(&self, vertex: u32) -> f64 {
        self.rooms[vertex as usize]
    }

    /// Whether no part of the surface is nearer to a point than `distance` (m), or [`REACH`] where that is less, but what is
    /// nearer to its nearest point `foot` than `neighbourhood` (m).
    pub(crate) fn is_alone(&self, point: Vec3, foot: Vec3, neighbourhood: f64, distance: f64) -> bool {
        let (at, foot) = (self.cloud.local(point), self.cloud.local(foot));
        let far = (neighbourhood * neighbourhood) as f32;
        let mut nearest = (REACH * REACH) as f32;
        self.cloud.around(at, |slot| {
            let squared = distance_squared(self.cloud.points[slot], at);
            if squared < nearest && distance_squared(self.cloud.points[slot], foot) > far {
                nearest = squared;
            }
        });
        f64::from(nearest) - SLACK > distance.powi(2).min(FREE * FREE)
    }
}

/// Barycentric coordinates of points in and on the edges of a triangle, so that none is further than [`SPACING`] from the
/// next; its corners are not among them.
fn lattice(triangle: [Vec3; 3]) -> impl Iterator<Item = [f64; 3]> {
    let longest = (0..3).map(|i| triangle[i].distance(triangle[(i + 1) % 3])).fold(0.0, f64::max);
    let parts = (longest / SPACING).ceil().clamp(1.0, 16.0) as u32;
    let rows = (0..=parts).flat_map(move |i| (0..=parts - i).map(move |j| [i, j, parts - i - j]));
    let inner = rows.filter(move |point| !point.contains(&parts));
    inner.map(move |point| point.map(|share| f64::from(share) / f64::from(parts)))
}

/// Vertices sorted into cells of the size of [`REACH`], so that all neighbours are in 3×3×3 of them.
#[derive(Debug, Clone, Default)]
struct Cloud {
    low: Vec3,
    cell: f32,
    cells: [usize; 3],
    /// Where each cell begins, and the end of the last.
    starts: Vec<u32>,
    cell_of: Vec<u32>,
    /// The cells that hold points.
    occupied: Vec<u32>,
    /// Least and greatest of the normals in each cell, by axis.
    spans: Vec<[[f32; 3]; 2]>,
    /// The same of the cells and all around them; for occupied cells only.
    wide_spans: Vec<[[f32; 3]; 2]>,
    /// Places from the low corner (m).
    points: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Cloud {
    fn fill(&mut self, vertices: &[Vec3], normals: &[Vec3]) {
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (low, high) = vertices.iter().fold(none, |(low, high), v| (low.min(*v), high.max(*v)));
        let span = if vertices.is_empty() || !(high - low).is_finite() { Vec3::ZERO } else { high - low };
        self.low = low;
        self.cell = (span.max_element() / MOST_CELLS).max(REACH) as f32;
        self.cells = span.to_array().map(|length| (length as f32 / self.cell) as usize + 1);
        self.starts.clear();
        self.starts.resize(self.cells.iter().product::<usize>() + 1, 0);
        self.cell_of.clear();
        for vertex in vertices {
            let [x, y, z] = self.coordinates(self.local(*vertex));
            let cell = self.row(y, z) + x;
            self.cell_of.push(cell as u32);
            self.starts[cell] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.points.resize(vertices.len(), [0.0; 3]);
        self.normals.resize(vertices.len(), [0.0; 3]);
        // Each cell is filled from its end, and its start is right when it is full.
        for (index, (vertex, normal)) in vertices.iter().zip(normals).enumerate() {
            let slot = &mut self.starts[self.cell_of[index] as usize];
            *slot -= 1;
            let slot = *slot as usize;
            self.points[slot] = (*vertex - self.low).as_vec3().to_array();
            self.normals[slot] = normal.as_vec3().to_array();
        }
        self.span();
    }

    /// Notes between which bounds the normals in and around every occupied cell are.
    fn span(&mut self) {
        self.occupied.clear();
        self.occupied.extend_from_slice(&self.cell_of);
        self.occupied.sort_unstable();
        self.occupied.dedup();
        self.spans.resize(self.starts.len(), NO_SPAN);
        self.wide_spans.resize(self.starts.len(), NO_SPAN);
        for &cell in &self.occupied {
            let slots = self.starts[cell as usize] as usize..self.starts[cell as usize + 1] as usize;
            let normals = self.normals[slots].iter();
            self.spans[cell as usize] = normals.fold(NO_SPAN, |span, &normal| joined(span, [normal; 2]));
        }
        for &cell in &self.occupied {
            let [width, _, depth] = self.cells;
            let (x, rest) = (cell as usize % width, cell as usize / width);
            let (y, z) = (rest / depth, rest % depth);
            let mut span = NO_SPAN;
            self.rows_around([x, y, z], |row| {
                // An empty cell may still hold the span of an earlier frame.
                let filled = row.filter(|&cell| self.starts[cell] < self.starts[cell + 1]);
                span = filled.fold(span, |span, cell| joined(span, self.spans[cell]));
            });
            self.wide_spans[cell as usize] = span;
        }
    }

    fn local(&self, point: Vec3) -> [f32; 3] {
        (point - self.low).as_vec3().to_array()
    }

    fn coordinates(&self, local: [f32; 3]) -> [usize; 3] {
        std::array::from_fn(|axis| ((local[axis] / self.cell).max(0.0) as usize).min(self.cells[axis] - 1))
    }

    fn row(&self, y: usize, z: usize) -> usize {
        (y * self.cells[2] + z) * self.cells[0]
    }

    /// Visits all that lies in the cell of a place and in those around it.
    #[inline]
    fn around(&self, local: [f32; 3], mut visit: impl FnMut(usize)) {
        if self.points.is_empty() {
            return;
        }
        self.rows_around(self.coordinates(local), |cells| {
            let slots = self.starts[cells.start] as usize..self.starts[cells.end] as usize;
            slots.for_each(&mut visit);
        });
    }

    /// Visits a cell and those around it, row by row.
    #[inline]
    fn rows_around(&self, [x, y, z]: [usize; 3], mut visit: impl FnMut(std::ops::Range<usize>)) {
        let range = |at: usize, axis: usize| at.saturating_sub(1)..(at + 2).min(self.cells[axis]);
        let across = range(x, 0);
        for y in range(y, 1) {
            for z in range(z, 2) {
                let row = self.row(y, z);
                visit(row + across.start..row + across.end);
            }
        }
    }

    fn room(&self, vertex: Vec3, normal: Vec3) -> f64 {
        let (at, [x, y, z]) = (self.local(vertex), normal.as_vec3().to_array());
        let [cx, cy, cz] = self.coordinates(at);
        let [low, high] = self.wide_spans[self.row(cy, cz) + cx];
        // The least product that any normal between the bounds has with this one.
        let least: f32 =
            [x, y, z].into_iter().zip(low.into_iter().zip(high)).map(|(n, (l, h))| (n * l).min(n * h)).sum();
        if least >= CREASED {
            return FREE;
        }
        let along = |v: [f32; 3]| x * v[0] + y * v[1] + z * v[2];
        let faces_it = |place: [f32; 3], other: [f32; 3]| {
            let product = along(other);
            let offset = [place[0] - at[0], place[1] - at[1], place[2] - at[2]];
            product < FACING || (product < CREASED && along(offset) > 0.0)
        };
        let mut nearest = (REACH * REACH) as f32;
        self.around(at, |slot| {
            let squared = distance_squared(self.points[slot], at);
            if squared < nearest && faces_it(self.points[slot], self.normals[slot]) {
                nearest = squared;
            }
        });
        (f64::from(nearest) - SLACK).max(0.0).sqrt().min(FREE)
    }
}

/// Bounds that nothing is between.
const NO_SPAN: [[f32; 3]; 2] = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];

fn joined(a: [[f32; 3]; 2], b: [[f32; 3]; 2]) -> [[f32; 3]; 2] {
    let pick = |of: fn(f32, f32) -> f32, i: usize| std::array::from_fn(|axis| of(a[i][axis], b[i][axis]));
    [pick(f32::min, 0), pick(f32::max, 1)]
}

#[inline]
fn distance_squared(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}

const _: () = assert!(FREE * FREE < REACH * REACH - SLACK, "the room of a point that nothing faces is reached");

#[cfg(test)]
mod tests {
    use super::{CREASED, FACING, FREE, REACH, SLACK, SPACING, lattice};
    use crate::refine::obstacle::Obstacle;
    use modiste_core::shapes::icosphere;
    use modiste_core::{Mesh, Topology, Vec3, normal, seeded_rng};
    use std::sync::Arc;

    #[test]
    fn no_point_of_a_triangle_is_far_from_the_lattice() {
        let corners = [Vec3::ZERO, Vec3::new(0.05, 0.01, 0.0), Vec3::new(0.02, 0.04, 0.01)];
        let at = |[u, v, w]: [f64; 3]| u * corners[0] + v * corners[1] + w * corners[2];
        let points: Vec<Vec3> = lattice(corners).map(at).chain(corners).collect();
        for (i, j) in (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (i, j))) {
            let point = at([i, j, 40 - i - j].map(|share| f64::from(share) / 40.0));
            let nearest = points.iter().map(|p| p.distance_squared(point)).fold(f64::INFINITY, f64::min);
            assert!(nearest < SLACK, "{point} {nearest}");
        }
        assert_eq!(lattice(corners.map(|corner| 0.2 * corner)).count(), 0, "small triangles have none");
    }

    /// Two spheres of 0.1 m with a gap between them.
    fn spheres(gap: f64) -> Mesh {
        let sphere = icosphere(3);
        let count = sphere.vertices.len() as u32;
        let shift = Vec3::new(0.2 + gap, 0.0, 0.0);
        let faces = sphere.topology.faces().iter();
        let both = faces.clone().copied().chain(faces.map(|face| face.map(|vertex| vertex + count))).collect();
        let vertices = sphere.vertices.iter().map(|v| 0.1 * *v);
        let vertices: Vec<Vec3> = vertices.clone().chain(vertices.map(|v| v + shift)).collect();
        Mesh { topology: Arc::new(Topology::new(vertices.len(), both).unwrap()), vertices }
    }

    #[test]
    fn the_room_of_a_face_is_less_than_the_gap_and_free_where_there_is_none() {
        for gap in [0.0, 0.004, 0.01, 0.02, 0.04] {
            let mesh = spheres(gap);
            let surface = Obstacle::single(mesh.topology.clone(), &mesh.vertices);
            let mut crowding = super::Crowding::new(&mesh.topology, &mesh.vertices, |_| true);
            // The second time in memory that has been used.
            crowding.update(&surface);
            crowding.update(&surface);
            let mut least = f64::INFINITY;
            for (index, face) in mesh.topology.faces().iter().enumerate() {
                let middle = face.iter().map(|&v| mesh.vertices[v as usize]).sum::<Vec3>() / 3.0;
                let centres = [0.0, 0.2 + gap].map(|x| Vec3::new(x, 0.0, 0.0));
                let far = centres.map(|centre| middle.distance(centre)).into_iter().fold(0.0, f64::max);
                let room = crowding.room(index as u32);
                assert!(room <= (far - 0.1).max(0.0) + 1e-3, "{room} {far}");
                if far > 0.1 + 2.0 * REACH {
                    assert!((room - FREE).abs() < 1e-12, "nothing faces it: {room}");
                }
                least = least.min(room);
            }
            assert!(least < gap.max(1e-9) + 1e-3 || gap > FREE);
            assert!((least - FREE).abs() < 1e-12 || gap < 0.03, "{least}");
        }
    }

    #[test]
    fn rooms_are_those_of_trying_all() {
        let mut rng = seeded_rng(12);
        let mut draw = |scale: f64| scale * Vec3::new(normal(&mut rng), normal(&mut rng), 0.3 * normal(&mut rng));
        let vertices: Vec<Vec3> = (0..1500).map(|_| draw(0.08)).collect();
        let normals: Vec<Vec3> = (0..1500).map(|_| draw(1.0).normalize()).collect();
        let mut cloud = super::Cloud::default();
        cloud.fill(&vertices[..900], &normals[..900]);
        cloud.fill(&vertices, &normals);
        let mut shorter = 0;
        for (vertex, own) in vertices.iter().zip(&normals) {
            let facing = vertices.iter().zip(&normals).filter(|(v, n)| {
                let product = n.dot(*own);
                let in_front = (**v - *vertex).dot(*own) > 0.0;
                product < f64::from(FACING) || (product < f64::from(CREASED) && in_front)
            });
            let squared = facing.map(|(v, _)| v.distance_squared(*vertex)).fold(REACH * REACH, f64::min);
            let wanted = (squared - SLACK).max(0.0).sqrt().min(FREE);
            assert!((cloud.room(*vertex, *own) - wanted).abs() < 1e-4);
            shorter += usize::from(squared < 0.9 * REACH * REACH);
        }
        assert!(shorter > 200 && SPACING < REACH);
    }
}
