//! The matrix of the linear solve: 3×3 blocks for the membrane, scalars for bending, stencils for the rest.

use crate::energy::Hinge;
use glam::{Mat3A, Vec3A};
use modiste_core::{Topology, Vec3};

/// A symmetric matrix over the vertices of a mesh, split into `L + D + Lᵀ + S`.
///
/// Rows stand in an order that suits substitution: every row depends on earlier ones as in the order of the vertices, but rows
/// that do not depend on each other follow one another, so that a processor works on several at once. What couples
/// vertices that share neither face nor hinge (seams, self-contact) is `S`, a list of stencils.
#[derive(Debug, Clone)]
pub(crate) struct SystemMatrix {
    /// The vertex of each row, and the row of each vertex.
    vertices: Vec<u32>,
    rows: Vec<u32>,
    diagonal: Vec<Mat3A>,
    lower: Triangle,
    upper: Triangle,
    /// For each face the entries of its corner pairs, as in [`BLOCK_CORNERS`](crate::energy), then transposed.
    face_entries: Vec<[Entry; 9]>,
    bending: Bending,
    stencils: Vec<Stencil>,
}

/// The blocks on one side of the diagonal, row by row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Triangle {
    starts: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<Mat3A>,
    /// Bending between neighbours: the blocks before anything is added.
    bend: Vec<f32>,
    /// Bending between the far corners of hinges, which acts alike on the three coordinates.
    far_starts: Vec<u32>,
    far: Vec<(u32, f32)>,
}

/// Where a block is stored.
#[derive(Debug, Clone, Copy)]
enum Entry {
    Diagonal(u32),
    Lower(u32),
    Upper(u32),
}

/// The bending part in f64 over vertices, for forces: rounded weights would bend a flat sheet that is tilted.
#[derive(Debug, Clone)]
struct Bending {
    starts: Vec<u32>,
    entries: Vec<(u32, f64)>,
    diagonal: Vec<f64>,
}

/// `K (w wᵀ ⊗ block)` on up to four vertices; unused ones have weight zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stencil {
    pub(crate) vertices: [u32; 4],
    pub(crate) weights: [f32; 4],
    pub(crate) block: Mat3A,
}

impl Triangle {
    /// Sum of the row's blocks times `x`.
    #[inline]
    pub(crate) fn row(&self, row: usize, x: &[Vec3A]) -> Vec3A {
        let range = self.starts[row] as usize..self.starts[row + 1] as usize;
        let mut sum = Vec3A::ZERO;
        for (column, block) in self.columns[range.clone()].iter().zip(&self.blocks[range]) {
            sum += *block * x[*column as usize];
        }
        let range = self.far_starts[row] as usize..self.far_starts[row + 1] as usize;
        for &(column, value) in &self.far[range] {
            sum += x[column as usize] * value;
        }
        sum
    }

    #[expect(clippy::cast_possible_truncation, reason = "entry counts fit u32; the inner solve runs in f32")]
    fn push_row(&mut self, near: impl Iterator<Item = (u32, f64)>, far: impl Iterator<Item = (u32, f64)>) {
        for (column, bend) in near {
            self.columns.push(column);
            self.bend.push(bend as f32);
        }
        self.far.extend(far.map(|(column, bend)| (column, bend as f32)));
        self.starts.push(self.columns.len() as u32);
        self.far_starts.push(self.far.len() as u32);
    }

    fn entry(&self, row: u32, column: u32) -> Option<u32> {
        let range = self.starts[row as usize]..self.starts[row as usize + 1];
        range.into_iter().find(|&entry| self.columns[entry as usize] == column)
    }

    fn clear(&mut self) {
        self.blocks.clear();
        self.blocks.extend(self.bend.iter().map(|&bend| scalar(bend)));
    }
}

impl SystemMatrix {
    /// Lays out the matrix and fills in bending, scaled by `bend_scale`.
    pub(crate) fn new(topology: &Topology, hinges: &[Hinge], bend_scale: f64) -> Self {
        let count = topology.vertex_count();
        let bending = Bending::new(count, hinges, bend_scale);
        let vertices = substitution_order(topology, &bending);
        let mut rows = vec![0; count];
        for (row, &vertex) in (0..).zip(&vertices) {
            rows[vertex as usize] = row;
        }
        let empty = || Triangle { starts: vec![0], far_starts: vec![0], ..Triangle::default() };
        let (mut lower, mut upper) = (empty(), empty());
        for (row, &vertex) in (0u32..).zip(&vertices) {
            let neighbours = topology.neighbours(vertex as usize);
            let near = neighbours.iter().map(|&v| (rows[v as usize], bending.between(vertex, v)));
            let far = bending.row(vertex).iter().filter(|(v, _)| !neighbours.contains(v));
            let far = far.map(|&(v, bend)| (rows[v as usize], bend));
            lower.push_row(near.clone().filter(|e| e.0 < row), far.clone().filter(|e| e.0 < row));
            upper.push_row(near.filter(|e| e.0 > row), far.filter(|e| e.0 > row));
        }
        let entry = |row: u32, column: u32| {
            let within = || unreachable!("corners of a face are neighbours");
            match row.cmp(&column) {
                std::cmp::Ordering::Equal => Entry::Diagonal(row),
                std::cmp::Ordering::Greater => Entry::Lower(lower.entry(row, column).unwrap_or_else(within)),
                std::cmp::Ordering::Less => Entry::Upper(upper.entry(row, column).unwrap_or_else(within)),
            }
        };
        let faces = topology.faces().iter().map(|face| face.map(|vertex| rows[vertex as usize]));
        let face_entries = faces
            .map(|[a, b, c]| {
                [[a, a], [b, b], [c, c], [a, b], [b, c], [c, a], [b, a], [c, b], [a, c]].map(|[i, j]| entry(i, j))
            })
            .collect();
        let diagonal = vec![Mat3A::ZERO; count];
        Self { vertices, rows, diagonal, lower, upper, face_entries, bending, stencils: Vec::new() }
    }

    /// The vertex of each row.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// What is below the diagonal.
    pub(crate) fn lower(&self) -> &Triangle {
        &self.lower
    }

    /// What is above the diagonal.
    pub(crate) fn upper(&self) -> &Triangle {
        &self.upper
    }

    /// Subtracts the bending part times `x` from `forces`.
    ///
    /// Rows sum to zero, so the product is taken over differences: a shift of the whole cloth costs exactly nothing.
    pub(crate) fn subtract_bending(&self, x: &[Vec3], forces: &mut [Vec3]) {
        for ((vertex, force), here) in (0u32..).zip(forces).zip(x) {
            for &(column, value) in self.bending.row(vertex) {
                *force -= (x[column as usize] - *here) * value;
            }
        }
    }

    /// Clears everything but bending.
    #[expect(clippy::cast_possible_truncation, reason = "the inner solve runs in f32")]
    pub(crate) fn clear(&mut self) {
        for (block, vertex) in self.diagonal.iter_mut().zip(&self.vertices) {
            *block = scalar(self.bending.diagonal[*vertex as usize] as f32);
        }
        self.lower.clear();
        self.upper.clear();
        self.stencils.clear();
    }

    /// Adds the blocks of a face in the order of `BLOCK_CORNERS`.
    #[inline]
    pub(crate) fn add_face(&mut self, face: usize, blocks: &[Mat3A; 6]) {
        let [a, b, c, d, e, f] = *blocks;
        let all = [a, b, c, d, e, f, d.transpose(), e.transpose(), f.transpose()];
        for (entry, block) in self.face_entries[face].into_iter().zip(all) {
            match entry {
                Entry::Diagonal(index) => self.diagonal[index as usize] += block,
                Entry::Lower(index) => self.lower.blocks[index as usize] += block,
                Entry::Upper(index) => self.upper.blocks[index as usize] += block,
            }
        }
    }

    /// Adds to the diagonal block of a vertex.
    #[inline]
    pub(crate) fn add_diagonal(&mut self, vertex: usize, block: Mat3A) {
        self.diagonal[self.rows[vertex] as usize] += block;
    }

    /// Adds a stencil over vertices.
    pub(crate) fn add_stencil(&mut self, stencil: Stencil) {
        self.stencils.push(Stencil { vertices: stencil.vertices.map(|v| self.rows[v as usize]), ..stencil });
    }

    /// Adds to `y` the stencils times `x`, their diagonal blocks left out; both by row.
    pub(crate) fn add_stencils(&self, x: &[Vec3A], y: &mut [Vec3A]) {
        for stencil in &self.stencils {
            let [a, b, c, d] = stencil.vertices.map(|row| x[row as usize]);
            let w = stencil.weights;
            let sum = a * w[0] + b * w[1] + c * w[2] + d * w[3];
            for (row, weight) in stencil.vertices.into_iter().zip(w) {
                y[row as usize] += stencil.block * ((sum - x[row as usize] * weight) * weight);
            }
        }
    }

    /// Inverses of the diagonal blocks, stencils included, by row; zero where `free` says that a vertex is held.
    pub(crate) fn inverse_diagonal(&self, free: &[bool], out: &mut [Mat3A]) {
        out.copy_from_slice(&self.diagonal);
        for stencil in &self.stencils {
            for (row, weight) in stencil.vertices.into_iter().zip(stencil.weights) {
                out[row as usize] += stencil.block * (weight * weight);
            }
        }
        for (out, vertex) in out.iter_mut().zip(&self.vertices) {
            *out = if free[*vertex as usize] { out.inverse() } else { Mat3A::ZERO };
        }
    }
}

impl Bending {
    #[expect(clippy::cast_possible_truncation, reason = "entry counts fit u32")]
    fn new(count: usize, hinges: &[Hinge], scale: f64) -> Self {
        let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); count];
        let mut diagonal = vec![0.0; count];
        for hinge in hinges {
            let scale = hinge.stiffness * scale;
            for (i, ci) in hinge.vertices.into_iter().zip(hinge.weights) {
                diagonal[i as usize] += scale * ci * ci;
                for (j, cj) in hinge.vertices.into_iter().zip(hinge.weights) {
                    if i != j {
                        rows[i as usize].push((j, scale * ci * cj));
                    }
                }
            }
        }
        let mut starts = vec![0];
        let mut entries: Vec<(u32, f64)> = Vec::new();
        for mut row in rows {
            row.sort_by_key(|(column, _)| *column);
            for pairs in row.chunk_by(|a, b| a.0 == b.0) {
                entries.push((pairs[0].0, pairs.iter().map(|pair| pair.1).sum()));
            }
            starts.push(entries.len() as u32);
        }
        Self { starts, entries, diagonal }
    }

    fn row(&self, vertex: u32) -> &[(u32, f64)] {
        &self.entries[self.starts[vertex as usize] as usize..self.starts[vertex as usize + 1] as usize]
    }

    fn between(&self, vertex: u32, other: u32) -> f64 {
        self.row(vertex).iter().find(|(column, _)| *column == other).map_or(0.0, |(_, value)| *value)
    }
}

fn scalar(value: f32) -> Mat3A {
    Mat3A::from_diagonal(glam::Vec3::splat(value))
}

/// The vertices sorted by how long a chain of couplings to earlier vertices leads to them.
fn substitution_order(topology: &Topology, bending: &Bending) -> Vec<u32> {
    let mut level = vec![0u32; topology.vertex_count()];
    for vertex in 0..topology.vertex_count() {
        #[expect(clippy::cast_possible_truncation, reason = "meshes index their vertices by u32")]
        let bent = bending.row(vertex as u32).iter().map(|(v, _)| *v);
        let before = topology.neighbours(vertex).iter().copied().chain(bent).filter(|&v| (v as usize) < vertex);
        level[vertex] = before.map(|v| level[v as usize] + 1).max().unwrap_or(0);
    }
    let mut order: Vec<u32> = (0..).take(level.len()).collect();
    order.sort_by_key(|&vertex| level[vertex as usize]);
    order
}
