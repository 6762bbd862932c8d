//! Where the surface of a body comes near to itself.

use std::sync::atomic::{AtomicU64, Ordering};

use modiste_core::{Topology, Vec3, corners};

use super::cloud::{Cloud, distance_squared};
use super::obstacle::Obstacle;

/// Surfaces further apart than this (m) are not looked for.
pub(crate) const REACH: f64 = 0.025;

/// The surface is known at points no further apart than this along it (m); most triangles of a body are smaller, some three
/// times as large.
const SPACING: f64 = 0.016;

/// What the square of the distance between two points is taken to be too large by (m²), because the surface between them may be
/// nearer: the square of the radius of a circle through the corners of a triangle of such points.
pub(crate) const SLACK: f64 = 0.012 * 0.012;

/// The room of a point that nothing faces (m).
pub(crate) const FREE: f64 = 0.0219;

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
pub(crate) struct Found(Vec<AtomicU64>);

impl Clone for Found {
    fn clone(&self) -> Self {
        Self(self.0.iter().map(|item| AtomicU64::new(item.load(Ordering::Relaxed))).collect())
    }
}

impl Found {
    /// The bits of no number.
    const UNKNOWN: u64 = u64::MAX;

    pub(crate) fn resize(&mut self, count: usize) {
        self.0.resize_with(count, || AtomicU64::new(Self::UNKNOWN));
    }

    pub(crate) fn forget(&mut self, index: usize) {
        *self.0[index].get_mut() = Self::UNKNOWN;
    }

    fn forget_all(&mut self) {
        self.0.iter_mut().for_each(|item| *item.get_mut() = Self::UNKNOWN);
    }

    /// An item; `find_out` is asked where it is not known.
    pub(crate) fn get(&self, index: usize, find_out: impl FnOnce() -> u64) -> u64 {
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

    /// Whether a flat surface at this height (m) below a point is, as far as [`Self::is_alone`] tells for this distance, nearer
    /// to the foot than `neighbourhood` (m). Where it is not, there is no use in asking.
    pub(crate) fn fits_flat(neighbourhood: f64, height: f64, distance: f64) -> bool {
        distance.powi(2) + SLACK - height.powi(2) < neighbourhood.powi(2)
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

const _: () = assert!(FREE * FREE < REACH * REACH - SLACK, "the room of a point that nothing faces is reached");

#[cfg(test)]
mod tests {
    use super::{FREE, REACH, SLACK, lattice};
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
}
