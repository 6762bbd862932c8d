//! The matrix of the linear solve: 3×3 blocks for the membrane, scalars for bending, stencils for the rest.

use crate::energy::Hinge;
use glam::{Mat3A, Vec3A};
use modiste_core::{Topology, Vec3};

/// A symmetric matrix over the vertices of a mesh.
///
/// Bending acts alike on the three coordinates, so it needs one number a pair; what couples vertices that share neither
/// face nor hinge (seams, self-contact) is kept as a list of stencils.
#[derive(Debug, Clone)]
pub(crate) struct SystemMatrix {
    /// Row starts in `columns` and `blocks`; the first entry of a row is the diagonal.
    starts: Vec<u32>,
    columns: Vec<u32>,
    blocks: Vec<Mat3A>,
    /// For each face the entries of its corner pairs, as in [`BLOCK_CORNERS`](crate::energy), then transposed.
    face_entries: Vec<[u32; 9]>,
    bend_starts: Vec<u32>,
    bend_entries: Vec<(u32, f32)>,
    /// The same for forces: rounded weights would bend a flat sheet that is tilted.
    exact_bend_entries: Vec<(u32, f64)>,
    bend_diagonal: Vec<f32>,
    stencils: Vec<Stencil>,
}

/// `K (w wᵀ ⊗ block)` on up to four vertices; unused ones have weight zero.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stencil {
    pub(crate) vertices: [u32; 4],
    pub(crate) weights: [f32; 4],
    pub(crate) block: Mat3A,
}

impl SystemMatrix {
    /// Lays out the matrix and fills in bending, scaled by `bend_scale`.
    #[expect(clippy::cast_possible_truncation, reason = "entry counts fit u32; the inner solve runs in f32")]
    pub(crate) fn new(topology: &Topology, hinges: &[Hinge], bend_scale: f64) -> Self {
        let count = topology.vertex_count();
        let mut starts = vec![0u32];
        let mut columns = Vec::new();
        for vertex in 0..count {
            columns.push(vertex as u32);
            let first = columns.len();
            columns.extend_from_slice(topology.neighbours(vertex));
            columns[first..].sort_unstable();
            starts.push(columns.len() as u32);
        }
        let entry = |row: u32, column: u32| {
            let range = starts[row as usize] as usize..starts[row as usize + 1] as usize;
            let within = columns[range.clone()].iter().position(|&c| c == column);
            (range.start + within.unwrap_or_else(|| unreachable!("corners of a face are neighbours"))) as u32
        };
        let face_entries = topology
            .faces()
            .iter()
            .map(|&[a, b, c]| {
                [[a, a], [b, b], [c, c], [a, b], [b, c], [c, a], [b, a], [c, b], [a, c]].map(|[i, j]| entry(i, j))
            })
            .collect();
        let mut bend_rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); count];
        let mut bend_diagonal = vec![0.0; count];
        for hinge in hinges {
            let scale = hinge.stiffness * bend_scale;
            for (i, ci) in hinge.vertices.into_iter().zip(hinge.weights) {
                bend_diagonal[i as usize] += scale * ci * ci;
                for (j, cj) in hinge.vertices.into_iter().zip(hinge.weights) {
                    if i != j {
                        bend_rows[i as usize].push((j, scale * ci * cj));
                    }
                }
            }
        }
        let mut bend_starts = vec![0u32];
        let mut exact_bend_entries: Vec<(u32, f64)> = Vec::new();
        for mut row in bend_rows {
            row.sort_by_key(|(column, _)| *column);
            for pairs in row.chunk_by(|a, b| a.0 == b.0) {
                exact_bend_entries.push((pairs[0].0, pairs.iter().map(|pair| pair.1).sum()));
            }
            bend_starts.push(exact_bend_entries.len() as u32);
        }
        Self {
            blocks: vec![Mat3A::ZERO; columns.len()],
            starts,
            columns,
            face_entries,
            bend_starts,
            bend_entries: exact_bend_entries.iter().map(|&(column, value)| (column, value as f32)).collect(),
            exact_bend_entries,
            bend_diagonal: bend_diagonal.into_iter().map(|value| value as f32).collect(),
            stencils: Vec::new(),
        }
    }

    /// Subtracts the bending part times `x` from `forces`.
    ///
    /// Rows sum to zero, so the product is taken over differences: a shift of the whole cloth costs exactly nothing.
    pub(crate) fn subtract_bending(&self, x: &[Vec3], forces: &mut [Vec3]) {
        for (row, force) in forces.iter_mut().enumerate() {
            let range = self.bend_starts[row] as usize..self.bend_starts[row + 1] as usize;
            for &(column, value) in &self.exact_bend_entries[range] {
                *force -= (x[column as usize] - x[row]) * value;
            }
        }
    }

    /// Clears everything but bending.
    pub(crate) fn clear(&mut self) {
        self.blocks.fill(Mat3A::ZERO);
        self.stencils.clear();
    }

    /// Adds the blocks of a face in the order of `BLOCK_CORNERS`.
    #[inline]
    pub(crate) fn add_face(&mut self, face: usize, blocks: &[Mat3A; 6]) {
        let entries = self.face_entries[face];
        for (entry, block) in entries.iter().zip(blocks) {
            self.blocks[*entry as usize] += *block;
        }
        for (entry, block) in entries[6..].iter().zip(&blocks[3..]) {
            self.blocks[*entry as usize] += block.transpose();
        }
    }

    /// Adds to the diagonal block of a vertex.
    #[inline]
    pub(crate) fn add_diagonal(&mut self, vertex: usize, block: Mat3A) {
        self.blocks[self.starts[vertex] as usize] += block;
    }

    /// Adds a stencil.
    pub(crate) fn add_stencil(&mut self, stencil: Stencil) {
        self.stencils.push(stencil);
    }

    /// `y = A x`.
    pub(crate) fn multiply(&self, x: &[Vec3A], y: &mut [Vec3A]) {
        for (row, out) in y.iter_mut().enumerate() {
            let mut sum = x[row] * self.bend_diagonal[row];
            let range = self.starts[row] as usize..self.starts[row + 1] as usize;
            for (column, block) in self.columns[range.clone()].iter().zip(&self.blocks[range]) {
                sum += *block * x[*column as usize];
            }
            let range = self.bend_starts[row] as usize..self.bend_starts[row + 1] as usize;
            for &(column, value) in &self.bend_entries[range] {
                sum += x[column as usize] * value;
            }
            *out = sum;
        }
        for stencil in &self.stencils {
            let [a, b, c, d] = stencil.vertices.map(|v| x[v as usize]);
            let w = stencil.weights;
            let pull = stencil.block * (a * w[0] + b * w[1] + c * w[2] + d * w[3]);
            for (vertex, weight) in stencil.vertices.into_iter().zip(w) {
                y[vertex as usize] += pull * weight;
            }
        }
    }

    /// Inverses of the diagonal blocks; zero where `free` says that a vertex is held.
    pub(crate) fn inverse_diagonal(&self, free: &[bool], out: &mut [Mat3A]) {
        for (row, out) in out.iter_mut().enumerate() {
            *out = self.blocks[self.starts[row] as usize]
                + Mat3A::from_diagonal(glam::Vec3::splat(self.bend_diagonal[row]));
        }
        for stencil in &self.stencils {
            for (vertex, weight) in stencil.vertices.into_iter().zip(stencil.weights) {
                out[vertex as usize] += stencil.block * (weight * weight);
            }
        }
        for (out, free) in out.iter_mut().zip(free) {
            *out = if *free { out.inverse() } else { Mat3A::ZERO };
        }
    }
}
