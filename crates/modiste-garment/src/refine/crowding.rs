//! Where the surface of a body comes near to itself.

use modiste_core::Vec3;
use rayon::prelude::*;

/// Surfaces further apart than this (m) are not looked for.
pub(crate) const REACH: f64 = 0.025;

/// Product of the normals of two vertices below which they are of surfaces that face each other.
const FACING: f32 = -0.2;

/// The same of vertices one of which is in front of the other, by more than [`IN_FRONT`] of their distance: the walls of a
/// crease, or of two parts that pass through each other.
const CREASED: f32 = 0.5;
const IN_FRONT: f32 = 0.0;

/// Between the vertices of a surface it may be nearer than they are: what the square of a distance between vertices is
/// taken to be too large by (m²). A body's triangles have circles of up to 1.5 cm around them.
const SPACING: f64 = 0.015 * 0.015;

/// Of squared distances in 32 bits (m²).
const ROUNDING: f64 = 1e-9;

/// The room of a vertex that nothing faces (m).
pub(crate) const FREE: f64 = 0.02;

/// Vertices that one thread takes at a time.
const VERTICES_AT_ONCE: usize = 512;

/// Most cells along one axis.
const MOST_CELLS: f64 = 256.0;

/// For each vertex of a body how far it is to a part of the surface that faces the other way: the other thigh, the arm beside
/// the trunk, the other side of a crease, the trunk around an arm that has passed into it. Filled anew every frame.
#[derive(Debug, Clone, Default)]
pub(crate) struct Crowding {
    rooms: Vec<f64>,
    cloud: Cloud,
}

impl Crowding {
    /// Takes in a surface: its vertices (m), their unit normals, and those of them that are asked about.
    pub(crate) fn update(&mut self, vertices: &[Vec3], normals: &[Vec3], asked: &[bool]) {
        self.cloud.fill(vertices, normals);
        self.rooms.resize(vertices.len(), 0.0);
        let cloud = &self.cloud;
        let each = self.rooms.par_iter_mut().zip(vertices).zip(normals).zip(asked).with_min_len(VERTICES_AT_ONCE);
        each.for_each(|(((room, vertex), normal), &asked)| {
            *room = if asked { cloud.room(*vertex, *normal) } else { 0.0 };
        });
    }

    /// Less than the distance from a vertex to the surface that faces it (m), [`FREE`] where there is none. 0 where it was not
    /// asked.
    pub(crate) fn room(&self, vertex: u32) -> f64 {
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
        f64::from(nearest) - SPACING > distance.powi(2).min(REACH * REACH - SPACING - 1e-9)
    }
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
        let [x, y, z] = self.coordinates(local);
        let range = |at: usize, axis: usize| at.saturating_sub(1)..(at + 2).min(self.cells[axis]);
        let across = range(x, 0);
        for y in range(y, 1) {
            for z in range(z, 2) {
                let row = self.row(y, z);
                let slots = self.starts[row + across.start] as usize..self.starts[row + across.end] as usize;
                slots.for_each(&mut visit);
            }
        }
    }

    fn room(&self, vertex: Vec3, normal: Vec3) -> f64 {
        let (at, [x, y, z]) = (self.local(vertex), normal.as_vec3().to_array());
        let along = |v: [f32; 3]| x * v[0] + y * v[1] + z * v[2];
        let faces_it = |place: [f32; 3], other: [f32; 3]| {
            let product = along(other);
            let offset = [place[0] - at[0], place[1] - at[1], place[2] - at[2]];
            product < FACING || (product < CREASED && along(offset) > IN_FRONT * distance_squared(place, at).sqrt())
        };
        let mut nearest = (REACH * REACH) as f32;
        self.around(at, |slot| {
            let squared = distance_squared(self.points[slot], at);
            if squared < nearest && faces_it(self.points[slot], self.normals[slot]) {
                nearest = squared;
            }
        });
        // The root of the difference of the squares of the constants is `FREE`.
        (f64::from(nearest) - SPACING + ROUNDING).max(0.0).sqrt().min(FREE)
    }
}

#[inline]
fn distance_squared(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}

const _: () = assert!((REACH * REACH - SPACING - FREE * FREE).abs() < 1e-12, "the room of a free vertex");

#[cfg(test)]
mod tests {
    use super::{CREASED, Crowding, FACING, IN_FRONT, REACH, SPACING};
    use modiste_core::{Vec3, normal, seeded_rng};

    #[test]
    fn rooms_and_neighbours_are_those_of_trying_all() {
        let mut rng = seeded_rng(12);
        let mut draw = |scale: f64| scale * Vec3::new(normal(&mut rng), normal(&mut rng), 0.3 * normal(&mut rng));
        let vertices: Vec<Vec3> = (0..1500).map(|_| draw(0.08)).collect();
        let normals: Vec<Vec3> = (0..1500).map(|_| draw(1.0).normalize()).collect();
        let asked: Vec<bool> = (0..1500).map(|index| index % 7 != 0).collect();
        let mut crowding = Crowding::default();
        // The second time in memory that has been used.
        crowding.update(&vertices[..900], &normals[..900], &asked[..900]);
        crowding.update(&vertices, &normals, &asked);
        let mut shorter = 0;
        for index in 0..vertices.len() {
            let facing = vertices.iter().zip(&normals).filter(|(v, n)| {
                let (product, offset) = (n.dot(normals[index]), **v - vertices[index]);
                let in_front = offset.dot(normals[index]) > f64::from(IN_FRONT) * offset.length();
                product < f64::from(FACING) || (product < f64::from(CREASED) && in_front)
            });
            let squared = facing.map(|(v, _)| v.distance_squared(vertices[index])).fold(REACH * REACH, f64::min);
            let wanted = if asked[index] { (squared - SPACING).max(0.0).sqrt() } else { 0.0 };
            assert!((crowding.room(index as u32) - wanted).abs() < 1e-4, "{index}");
            shorter += usize::from(squared < 0.9 * REACH * REACH);
        }
        assert!(shorter > 200);
        let mut alone = 0;
        for _ in 0..500 {
            let (point, foot) = (draw(0.12), draw(0.12));
            let others = vertices.iter().filter(|v| v.distance(foot) > 0.03);
            let nearest = others.map(|v| v.distance_squared(point)).fold(f64::INFINITY, f64::min);
            let wanted = nearest - SPACING > 0.012 * 0.012;
            let found = crowding.is_alone(point, foot, 0.03, 0.012);
            assert!(found == wanted || (nearest - SPACING - 0.012 * 0.012).abs() < 1e-7);
            alone += usize::from(found);
        }
        assert!((50..450).contains(&alone), "{alone}");
    }
}
