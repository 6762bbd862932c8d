//! Some layers of cells, and how they are filled.

use modiste_core::Vec3;

/// Edge of a cell (m).
pub(super) const EDGE: f64 = 0.008;
/// The plane of a face: unit normal, and its distance from the origin along it (m).
#[derive(Debug, Clone, Copy)]
pub(super) struct Plate {
    pub(super) normal: Vec3,
    pub(super) offset: f64,
}

/// The box of a face (m).
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub(super) low: Vec3,
    pub(super) high: Vec3,
}

/// Some layers of cells.
#[derive(Debug, Clone, Default)]
pub(super) struct Slab {
    /// Whether each cell is outside and touches no part of the skin.
    pub(super) free: Vec<bool>,
    /// Winding number of the skin around the middle of each cell.
    pub(super) winding: Vec<i8>,
    /// Faces near cell `c` are `faces[starts[c]..starts[c + 1]]`.
    starts: Vec<u32>,
    faces: Vec<u32>,
    /// Faces that come near the slab, and pairs of cell and face before they are sorted.
    pub(super) all: Vec<u32>,
    pairs: Vec<(u32, u32)>,
}

/// What a slab is made from.
pub(super) struct Space<'a> {
    pub(super) low: Vec3,
    pub(super) counts: [usize; 3],
    /// First layer, and the one after the last.
    pub(super) layers: [usize; 2],
    pub(super) reach: f64,
    pub(super) x: &'a [Vec3],
    pub(super) plates: &'a [Plate],
    pub(super) extents: &'a [Extent],
    pub(super) faces: &'a [[u32; 3]],
}

/// Plane and box of a face.
pub(super) fn see([a, b, c]: [Vec3; 3]) -> (Plate, Extent) {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    (Plate { normal, offset: normal.dot(a) }, Extent { low: a.min(b).min(c), high: a.max(b).max(c) })
}

impl Slab {
    pub(super) fn faces_of(&self, cell: usize) -> &[u32] {
        &self.faces[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }

    /// Makes the layers anew, from the faces in `all`.
    pub(super) fn fill(&mut self, space: &Space<'_>) {
        let [_, across, deep] = space.counts;
        let cells = (space.layers[1] - space.layers[0]) * across * deep;
        self.winding.clear();
        self.winding.resize(cells, 0);
        self.pairs.clear();
        for face in std::mem::take(&mut self.all) {
            let (plate, extent) = (&space.plates[face as usize], &space.extents[face as usize]);
            self.count_crossings(face, plate, extent, space);
            self.list(face, plate, extent, space);
        }
        // From changes along each column to numbers.
        for column in self.winding.chunks_exact_mut(deep.max(1)) {
            let mut sum = 0i8;
            for value in column {
                sum = sum.wrapping_add(*value);
                *value = sum;
            }
        }
        self.starts.clear();
        self.starts.resize(cells + 1, 0);
        for &(cell, _) in &self.pairs {
            self.starts[cell as usize] += 1;
        }
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        self.faces.clear();
        self.faces.resize(self.pairs.len(), 0);
        for &(cell, face) in self.pairs.iter().rev() {
            let place = &mut self.starts[cell as usize];
            *place -= 1;
            self.faces[*place as usize] = face;
        }
        self.free.clear();
        let empty = self.starts.windows(2).map(|ends| ends[0] == ends[1]);
        self.free.extend(self.winding.iter().zip(empty).map(|(winding, empty)| *winding <= 0 && empty));
    }

    /// Where the columns through the middles of the cells, along the third axis, pass a face. Seen along it, the sides of
    /// the edges are told by the same numbers for both faces at an edge, so that no column slips through between them.
    fn count_crossings(&mut self, face: u32, plate: &Plate, extent: &Extent, space: &Space<'_>) {
        let corners = space.faces[face as usize];
        let [across, deep] = [space.counts[1], space.counts[2]];
        let first = |low: f64, from: f64| ((low - from) / EDGE - 0.5).ceil().max(0.0) as usize;
        let last =
            |high: f64, from: f64, count: usize| ((high - from) / EDGE + 0.5).floor().clamp(0.0, count as f64) as usize;
        let begin = first(extent.low.x, space.low.x).max(space.layers[0]);
        let end = last(extent.high.x, space.low.x, space.layers[1]);
        for layer in begin..end {
            let px = space.low.x + EDGE * (layer as f64 + 0.5);
            for row in first(extent.low.y, space.low.y)..last(extent.high.y, space.low.y, across) {
                let py = space.low.y + EDGE * (row as f64 + 0.5);
                let side = |u: u32, v: u32| {
                    let [a, b] = [u.min(v), u.max(v)].map(|vertex| space.x[vertex as usize]);
                    let positive = (b.x - a.x) * (py - a.y) - (b.y - a.y) * (px - a.x) >= 0.0;
                    positive == (u < v)
                };
                let sides = [0, 1, 2].map(|i| side(corners[i], corners[(i + 1) % 3]));
                if sides[0] != sides[1] || sides[1] != sides[2] {
                    continue;
                }
                let n = plate.normal;
                let a = space.x[corners[0] as usize];
                let z = if n.z == 0.0 { a.z } else { a.z - (n.x * (px - a.x) + n.y * (py - a.y)) / n.z };
                let cell = first(z, space.low.z);
                if cell < deep {
                    let column = (layer - space.layers[0]) * across + row;
                    let change = &mut self.winding[column * deep + cell];
                    // A face that is passed from outside has its normal against the way.
                    *change = change.wrapping_add(if sides[0] { -1 } else { 1 });
                }
            }
        }
    }

    /// Adds a face to the cells that it comes near.
    fn list(&mut self, face: u32, plate: &Plate, extent: &Extent, space: &Space<'_>) {
        let range = |axis: usize, from: usize, to: usize| {
            let place = |x: f64| (x - space.low[axis]) / EDGE;
            let first = place(extent.low[axis] - space.reach).floor().clamp(from as f64, to as f64) as usize;
            let end = (place(extent.high[axis] + space.reach).floor() + 1.0).clamp(from as f64, to as f64) as usize;
            first..end
        };
        let half = 0.5 * EDGE + space.reach;
        let spread = half * (plate.normal.x.abs() + plate.normal.y.abs() + plate.normal.z.abs());
        let [across, deep] = [space.counts[1], space.counts[2]];
        for layer in range(0, space.layers[0], space.layers[1]) {
            for row in range(1, 0, across) {
                let middle = space.low + EDGE * Vec3::new(layer as f64 + 0.5, row as f64 + 0.5, 0.5);
                let mut height = plate.normal.dot(middle) - plate.offset;
                let depths = range(2, 0, deep);
                height += EDGE * plate.normal.z * depths.start as f64;
                let column = ((layer - space.layers[0]) * across + row) * deep;
                for depth in depths {
                    if height.abs() <= spread + 1e-9 {
                        self.pairs.push(((column + depth) as u32, face));
                    }
                    height += EDGE * plate.normal.z;
                }
            }
        }
    }
}
