//! Points with normals, by which one finds what faces a point.

use modiste_core::{Vec3, bounds};

use super::crowding::{FREE, Found, REACH, SLACK};

/// Product of the normals of two points below which they are of surfaces that face each other.
const FACING: f32 = -0.2;

/// The same of points one of which is in front of the other: the walls of a crease, or of two parts that pass through each
/// other.
const CREASED: f32 = 0.5;

/// Most cells along one axis.
const MOST_CELLS: f64 = 256.0;

/// Vertices sorted into cells of the size of [`REACH`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Cloud {
    low: Vec3,
    cell: f32,
    cells: [i32; 3],
    /// Where each cell begins, and the end of the last.
    pub(crate) starts: Vec<u32>,
    cell_of: Vec<u32>,
    /// What the normals in each cell are between; of a cell without points it may be from an earlier frame.
    cones: Vec<Cone>,
    /// Which of a cell and those around it may hold points that face one of its own, one bit each.
    facing: Found,
    /// Places from the low corner (m).
    pub(crate) points: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl Cloud {
    pub(crate) fn fill(&mut self, vertices: &[Vec3], normals: &[Vec3]) {
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

    pub(crate) fn local(&self, point: Vec3) -> [f32; 3] {
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
    pub(crate) fn rows_around(&self, local: [f32; 3], reach: f32, mut visit: impl FnMut(std::ops::Range<usize>)) {
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
    pub(crate) fn room(&self, vertex: Vec3, normal: Vec3) -> f64 {
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
pub(crate) fn distance_squared(a: [f32; 3], b: [f32; 3]) -> f32 {
    let [x, y, z] = [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    x * x + y * y + z * z
}

#[cfg(test)]
mod tests {
    use super::{CREASED, Cloud, FACING};
    use crate::refine::crowding::{FREE, REACH, SLACK};
    use modiste_core::{Vec3, normal, seeded_rng};

    #[test]
    fn rooms_are_those_of_trying_all() {
        let mut rng = seeded_rng(12);
        let mut draw = |scale: f64| scale * Vec3::new(normal(&mut rng), normal(&mut rng), 0.3 * normal(&mut rng));
        let vertices: Vec<Vec3> = (0..1500).map(|_| draw(0.08)).collect();
        let normals: Vec<Vec3> = (0..1500).map(|_| draw(1.0).normalize()).collect();
        let mut cloud = Cloud::default();
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
        assert!(shorter > 200);
    }
}
