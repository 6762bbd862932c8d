//! Where the surface of a body comes near to itself.

use std::sync::atomic::{AtomicU64, Ordering};

use modiste_core::{Topology, Vec3, bounds, corners};

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

/// Most cells along one axis.
const MOST_CELLS: f64 = 256.0;

/// For each face of a body how far it is to a part of the surface that faces the other way: the other thigh, the arm beside
/// the trunk, the other side of a crease, the trunk around an arm that has passed into it.
///
/// The surface is taken in once a frame; how much room there is, is found where it is asked for.
#[derive(Debug, Clone)]
pub(crate) struct Crowding {
    /// Whether a vertex, and with it its faces, is asked about.
    asked: Vec<bool>,
    /// Points between the corners of large faces, face after face.
    samples: Vec<Sample>,
    /// Where the samples of each face begin, and the end of the last.
    starts: Vec<u32>,
    /// Rooms (m) as far as they were asked for.
    vertex_rooms: Found,
    face_rooms: Found,
    /// The vertices, then the samples.
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    cloud: Cloud,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    face: u32,
    barycentric: [f64; 3],
}

/// What was found so far. Atomic only so that a surface may be asked from several threads; the answer is the same.
#[derive(Debug, Default)]
struct Found(Vec<AtomicU64>);

impl Clone for Found {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|item| AtomicU64::new(item.load(Ordering::Relaxed))).collect())
    }
}

impl Found {
    /// The bits of no number.
    const UNKNOWN: u64 = u64::MAX;

    fn resize(&mut self, count: usize) {
        self.0.resize_with(count, || AtomicU64::new(Self::UNKNOWN));
    }

    fn forget(&mut self, index: usize) {
        *self.0[index].get_mut() = Self::UNKNOWN;
    }

    fn forget_all(&mut self) {
        self.0.iter_mut().for_each(|item| *item.get_mut() = Self::UNKNOWN);
    }

    /// An item; `find_out` is asked where it is not known.
    fn get(&self, index: usize, find_out: impl FnOnce() -> u64) -> u64 {
        match self.0[index].load(Ordering::Relaxed) {
            Self::UNKNOWN => {
                let item = find_out();
                self.0[index].store(item, Ordering::Relaxed);
                item
            }
            known => known,
        }
    }

    /// The same of an item that is a number.
    fn get_number(&self, index: usize, find_out: impl FnOnce() -> f64) -> f64 {
        f64::from_bits(self.get(index, || find_out().to_bits()))
    }
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
        let (mut vertex_rooms, mut face_rooms) = (Found::default(), Found::default());
        vertex_rooms.resize(vertices.len());
        face_rooms.resize(topology.face_count());
        Self {
            vertex_rooms,
            face_rooms,
            asked,
            samples,
            starts,
            points: Vec::new(),
            normals: Vec::new(),
            cloud: Cloud::default(),
        }
    }

    /// Takes in the surface where it is now.
    pub(crate) fn update(&mut self, surface: &Obstacle) {
        let Self { samples, points, normals, cloud, .. } = self;
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
        self.vertex_rooms.forget_all();
        self.face_rooms.forget_all();
    }

    /// Less than the distance from a face to surface that faces it (m), [`FREE`] where there is none. 0 where it was not asked.
    pub(crate) fn room(&self, topology: &Topology, face: u32) -> f64 {
        self.face_rooms.get_number(face as usize, || {
            let corners = topology.faces()[face as usize].into_iter().map(|vertex| self.room_of_vertex(vertex));
            let [start, end] = [0, 1].map(|i| self.asked.len() + self.starts[face as usize + i] as usize);
            let between = (start..end).map(|point| self.cloud.room(self.points[point], self.normals[point]));
            corners.chain(between).fold(FREE, f64::min)
        })
    }

    /// The same from a vertex.
    pub(crate) fn room_of_vertex(&self, vertex: u32) -> f64 {
        let index = vertex as usize;
        let find_out =
            || if self.asked[index] { self.cloud.room(self.points[index], self.normals[index]) } else { 0.0 };
        self.vertex_rooms.get_number(index, find_out)
    }

    /// Whether no part of the surface is nearer to a point than `distance` (m), or [`REACH`] where that is less, but what is
    /// nearer to its nearest point `foot` than `neighbourhood` (m).
    pub(crate) fn is_alone(&self, point: Vec3, foot: Vec3, neighbourhood: f64, distance: f64) -> bool {
        let (near, far) = (distance.powi(2).min(FREE * FREE) + SLACK, neighbourhood.powi(2));
        let offset = point - foot;
        // Points p that are near |p - point|² <= near and far |p - foot|² > far lie beyond a plane across the offset, in a cap of
        // the ball around the point.
        let height = (far - near - offset.length_squared()) / (2.0 * offset.length());
        if height > 0.0 && height * height >= near {
            return true;
        }
        let (centre, radius) = if height > 0.0 {
            (point + height * offset.normalize_or_zero(), (near - height * height).sqrt())
        } else {
            (point, near.sqrt())
        };
        let (at, foot) = (self.cloud.local(point), self.cloud.local(foot));
        let (near, far) = (near as f32, far as f32);
        let mut is_alone = true;
        self.cloud.rows_around(self.cloud.local(centre), radius as f32, |cells| {
            let slots = self.cloud.starts[cells.start] as usize..self.cloud.starts[cells.end] as usize;
            let is_other =
                |place: &[f32; 3]| distance_squared(*place, at) <= near && distance_squared(*place, foot) > far;
            is_alone = is_alone && !self.cloud.points[slots].iter().any(is_other);
        });
        is_alone
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

/// Vertices sorted into cells of the size of [`REACH`].
#[derive(Debug, Clone, Default)]
struct Cloud {
    low: Vec3,
    cell: f32,
    cells: [i32; 3],
    /// Where each cell begins, and the end of the last.
    starts: Vec<u32>,
    cell_of: Vec<u32>,
    /// What the normals in each cell are between; of a cell without points it may be from an earlier frame.
    cones: Vec<Cone>,
    /// Which of a cell and those around it may hold points that face one of its own, one bit each.
    facing: Found,
    /// Places from the low corner (m).
    points: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Cloud {
    fn fill(&mut self, vertices: &[Vec3], normals: &[Vec3]) {
        let (low, high) = bounds(vertices).unwrap_or_default();
        let span = if (high - low).is_finite() { high - low } else { Vec3::ZERO };
        self.low = low;
        self.cell = (span.max_element() / MOST_CELLS).max(REACH) as f32;
        self.cells = span.to_array().map(|length| (length as f32 / self.cell) as i32 + 1);
        let cell_count = self.cells.iter().map(|&count| count as usize).product::<usize>();
        self.starts.clear();
        self.starts.resize(cell_count + 1, 0);
        self.cones.resize(cell_count, Cone::default());
        self.facing.resize(cell_count);
        self.cell_of.clear();
        for vertex in vertices {
            let cell = self.index(self.coordinates(self.local(*vertex)));
            self.cell_of.push(cell as u32);
            if self.starts[cell] == 0 {
                self.cones[cell] = Cone::default();
                self.facing.forget(cell);
            }
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
        for ((vertex, normal), &cell) in vertices.iter().zip(normals).zip(&self.cell_of) {
            let slot = &mut self.starts[cell as usize];
            *slot -= 1;
            let (slot, normal) = (*slot as usize, normal.as_vec3().to_array());
            self.points[slot] = (*vertex - self.low).as_vec3().to_array();
            self.normals[slot] = normal;
            let axis = &mut self.cones[cell as usize].axis;
            *axis = [0, 1, 2].map(|i| axis[i] + normal[i]);
        }
        for (cell, cone) in self.cones.iter_mut().enumerate() {
            let slots = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            if !slots.is_empty() {
                cone.open(&self.normals[slots]);
            }
        }
    }

    fn local(&self, point: Vec3) -> [f32; 3] {
        (point - self.low).as_vec3().to_array()
    }

    fn coordinates(&self, local: [f32; 3]) -> [i32; 3] {
        std::array::from_fn(|axis| ((local[axis] / self.cell) as i32).clamp(0, self.cells[axis] - 1))
    }

    fn index(&self, [x, y, z]: [i32; 3]) -> usize {
        ((y * self.cells[2] + z) * self.cells[0] + x) as usize
    }

    /// Visits, row by row, the cells that hold all points within `reach` (m) of a place.
    #[inline]
    fn rows_around(&self, local: [f32; 3], reach: f32, mut visit: impl FnMut(std::ops::Range<usize>)) {
        if self.points.is_empty() {
            return;
        }
        let low = self.coordinates(local.map(|along| along - reach));
        let high = self.coordinates(local.map(|along| along + reach));
        for y in low[1]..=high[1] {
            for z in low[2]..=high[2] {
                visit(self.index([low[0], y, z])..self.index([high[0], y, z]) + 1);
            }
        }
    }

    /// Those of a cell and the cells around it that hold points which may face one of its own.
    fn find_facing(&self, cell: [i32; 3]) -> u64 {
        let own = self.cones[self.index(cell)];
        let holds_facing = |bit: &u32| {
            let other = neighbour(cell, *bit);
            let is_there = other.iter().zip(self.cells).all(|(at, count)| (0..count).contains(at));
            is_there && {
                let other = self.index(other);
                self.starts[other] < self.starts[other + 1] && own.may_face(&self.cones[other])
            }
        };
        (0..27).filter(holds_facing).fold(0, |facing, bit| facing | 1 << bit)
    }

    /// Less than the distance (m) from a point with a normal to the nearest that faces it, [`FREE`] where there is none.
    fn room(&self, vertex: Vec3, normal: Vec3) -> f64 {
        let (at, own) = (self.local(vertex), normal.as_vec3().to_array());
        let faces_it = |place: [f32; 3], other: [f32; 3]| {
            let along = product(own, other);
            let offset = [place[0] - at[0], place[1] - at[1], place[2] - at[2]];
            along < FACING || (along < CREASED && product(own, offset) > 0.0)
        };
        let cell = self.coordinates(at);
        let mut facing = self.facing.get(self.index(cell), || self.find_facing(cell));
        let mut nearest = (REACH * REACH) as f32;
        while facing != 0 {
            let other = self.index(neighbour(cell, facing.trailing_zeros()));
            facing &= facing - 1;
            if !self.cones[other].may_face_normal(own) {
                continue;
            }
            for slot in self.starts[other] as usize..self.starts[other + 1] as usize {
                let squared = distance_squared(self.points[slot], at);
                if squared < nearest && faces_it(self.points[slot], self.normals[slot]) {
                    nearest = squared;
                }
            }
        }
        (f64::from(nearest) - SLACK).max(0.0).sqrt().min(FREE)
    }
}

/// One of the 27 cells in and around a cell.
#[inline]
fn neighbour([x, y, z]: [i32; 3], bit: u32) -> [i32; 3] {
    let bit = bit as i32;
    [x + bit % 3 - 1, y + bit / 9 - 1, z + bit / 3 % 3 - 1]
}

/// A cone around unit normals.
#[derive(Debug, Clone, Copy, Default)]
struct Cone {
    axis: [f32; 3],
    /// Cosine and sine of the angle between the axis and the sides.
    cosine: f32,
    sine: f32,
    /// The product with the axis at or above which a normal has one of at least [`CREASED`] with all in the cone.
    certain: f32,
}

/// What rounding may do to a product of unit vectors.
const ROUNDING: f32 = 1e-5;

impl Cone {
    /// Finds the cone around normals whose sum is the axis.
    fn open(&mut self, normals: &[[f32; 3]]) {
        let length = product(self.axis, self.axis).sqrt();
        self.axis = self.axis.map(|along| along / length.max(f32::MIN_POSITIVE));
        let least = normals.iter().fold(1.0f32, |least, normal| lesser(least, product(self.axis, *normal)));
        self.cosine = (least - ROUNDING).max(-1.0);
        self.sine = (1.0 - self.cosine * self.cosine).max(0.0).sqrt();
        self.certain = Self::certain_for(self.cosine, self.sine);
    }

    /// The product at or above which two directions, the second with a cone of this half angle, are certain not to be
    /// [`CREASED`]: the cosine of what the half angle leaves of it.
    fn certain_for(cosine: f32, sine: f32) -> f32 {
        if cosine > CREASED {
            CREASED * cosine + (1.0 - CREASED * CREASED).sqrt() * sine + ROUNDING
        } else {
            f32::INFINITY
        }
    }

    /// Whether a unit normal may have a product below [`CREASED`] with one in the cone.
    #[inline(always)]
    fn may_face_normal(&self, normal: [f32; 3]) -> bool {
        !(product(self.axis, normal) >= self.certain)
    }

    /// Whether a normal in one cone may have a product below [`CREASED`] with one in the other.
    fn may_face(&self, other: &Self) -> bool {
        // Together they may go all the way around.
        if self.cosine <= 0.0 || other.cosine <= 0.0 {
            return true;
        }
        let cosine = self.cosine * other.cosine - self.sine * other.sine;
        let sine = self.sine * other.cosine + self.cosine * other.sine;
        !(product(self.axis, other.axis) >= Self::certain_for(cosine, sine))
    }
}

#[inline(always)]
fn product(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The lesser of two numbers by a single comparison: [`f32::min`] minds what is no number.
#[inline]
fn lesser(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
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
                let room = crowding.room(&mesh.topology, index as u32);
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
    fn what_is_alone_is_told_as_by_trying_all() {
        let mesh = spheres(0.03);
        let surface = Obstacle::single(mesh.topology.clone(), &mesh.vertices);
        let mut crowding = super::Crowding::new(&mesh.topology, &mesh.vertices, |_| true);
        crowding.update(&surface);
        let mut rng = seeded_rng(4);
        let mut counts = [0; 2];
        for _ in 0..3000 {
            let foot = 0.1 * Vec3::new(2.0 + normal(&mut rng), normal(&mut rng), normal(&mut rng)).normalize();
            let height = 0.02 * normal(&mut rng).abs();
            let (point, distance) = (foot * (1.0 + 10.0 * height), height + 0.003);
            let others = crowding.points.iter().filter(|place| place.distance(foot) > REACH);
            let nearest = others.map(|place| place.distance_squared(point)).fold(REACH * REACH, f64::min);
            let wanted = nearest - SLACK - distance.powi(2).min(FREE * FREE);
            if wanted.abs() > 1e-8 {
                assert_eq!(crowding.is_alone(point, foot, REACH, distance), wanted > 0.0, "{point} {foot}");
                counts[usize::from(wanted > 0.0)] += 1;
            }
        }
        assert!(counts[0] > 100 && counts[1] > 1000, "{counts:?}");
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
