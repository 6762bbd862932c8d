//! Sparse Cholesky factorisation with a fast solve for three interleaved right-hand sides.

use std::ops::{Mul, Sub};

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::solvers::LltError;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky, supernodal,
};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Par, Side};

use crate::lanes::{Kernel, with_widest_registers};
use crate::{SolveError, Vec3};

/// The factor `P A Pᵀ = L Lᵀ` of a symmetric positive definite matrix.
///
/// Ordered by approximate minimum degree and factored by supernodes (`faer`), then kept in a layout of our own: the
/// solve reads every entry of `L` twice, so memory order is what counts. One core; results do not depend on threads.
#[derive(Debug, Clone)]
pub struct SparseCholesky {
    size: usize,
    /// `old_from_new[i]` is the row of the matrix that elimination step `i` treats.
    old_from_new: Vec<u32>,
    /// Its inverse.
    new_from_old: Vec<u32>,
    /// The cycles of `new_from_old`, one after the other; the last element of each has its top bit set.
    cycles: Vec<u32>,
    supernodes: Vec<Supernode>,
    /// Rows below the diagonal block, supernode by supernode.
    rows: Vec<u32>,
    /// Per supernode: the lower triangle of the diagonal block row by row, with inverted diagonal, then the rows below.
    values: Vec<f64>,
}

/// Neighbouring columns of `L` with the same pattern below the diagonal.
#[derive(Debug, Clone, Copy)]
struct Supernode {
    start: u32,
    width: u32,
    first_row: u32,
    row_count: u32,
    first_value: usize,
}

/// Marks the last element of a cycle.
const LAST: u32 = 1 << 31;

/// The cycles of a permutation, one after the other: each element is followed by its image.
fn cycles(permutation: &[u32]) -> Vec<u32> {
    let mut seen = vec![false; permutation.len()];
    let mut cycles: Vec<u32> = Vec::with_capacity(permutation.len());
    for start in 0..permutation.len() {
        let mut at = start;
        while !std::mem::replace(&mut seen[at], true) {
            cycles.push(at as u32);
            at = permutation[at] as usize;
            if at == start
                && let Some(last) = cycles.last_mut()
            {
                *last |= LAST;
            }
        }
    }
    cycles
}

/// What the solve needs of a right-hand side entry: a number, or three at once.
pub(crate) trait Entry: Copy + Sub<Output = Self> + Mul<f64, Output = Self> {}

impl<T: Copy + Sub<Output = Self> + Mul<f64, Output = Self>> Entry for T {}

impl SparseCholesky {
    /// Factors an `n`×`n` symmetric matrix given by `(row, column, value)`; values at the same place are added.
    ///
    /// The lower half is read (`row >= column`), so both halves may be given or the lower one alone.
    ///
    /// # Errors
    /// An index out of range, a value that is not finite, or a matrix that is not positive definite.
    pub fn new(n: usize, triplets: &[(usize, usize, f64)]) -> Result<Self, SolveError> {
        let mut lower = Vec::with_capacity(triplets.len());
        for (index, &(row, column, value)) in triplets.iter().enumerate() {
            if row >= n || column >= n {
                return Err(SolveError::IndexOutOfRange { row, column, rows: n, columns: n });
            }
            if !value.is_finite() {
                return Err(SolveError::NotFinite { what: "sparse matrix", index });
            }
            if row >= column {
                lower.push(Triplet::new(row as u32, column as u32, value));
            }
        }
        if n == 0 {
            return Ok(Self::empty());
        }
        let out_of_memory = |_| SolveError::OutOfMemory { what: "the sparse Cholesky factor" };
        let matrix = SparseColMat::<u32, f64>::try_new_from_triplets(n, n, &lower)
            .map_err(|_creation| SolveError::OutOfMemory { what: "the sparse matrix" })?;
        let symbolic = factorize_symbolic_cholesky(
            matrix.symbolic(),
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams {
                // Below zero, so that a diagonal matrix, which takes no operations, is treated alike.
                supernodal_flop_ratio_threshold: SupernodalThreshold(-1.0),
                ..Default::default()
            },
        )
        .map_err(out_of_memory)?;
        let mut values = vec![0.0; symbolic.len_val()];
        let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::new(scratch);
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix.as_ref(),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .map_err(|LltError::NonPositivePivot { .. }| SolveError::NotPositiveDefinite { size: n })?;
        let SymbolicCholeskyRaw::Supernodal(structure) = symbolic.raw() else {
            unreachable!("the supernodal factorisation was asked for");
        };
        let mut factor = Self::empty();
        factor.size = n;
        match symbolic.perm() {
            Some(permutation) => {
                let (forward, inverse) = permutation.arrays();
                factor.old_from_new = forward.to_vec();
                factor.new_from_old = inverse.to_vec();
            }
            None => {
                factor.old_from_new = (0..n as u32).collect();
                factor.new_from_old = factor.old_from_new.clone();
            }
        }
        factor.cycles = cycles(&factor.new_from_old);
        factor.keep(structure, &values);
        if factor.values.iter().all(|value| value.is_finite()) {
            Ok(factor)
        } else {
            Err(SolveError::NotPositiveDefinite { size: n })
        }
    }

    fn empty() -> Self {
        Self {
            size: 0,
            old_from_new: Vec::new(),
            new_from_old: Vec::new(),
            cycles: Vec::new(),
            supernodes: Vec::new(),
            rows: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Copies the factor into the layout of the solve.
    fn keep(&mut self, structure: &supernodal::SymbolicSupernodalCholesky<u32>, values: &[f64]) {
        let factor = supernodal::SupernodalLltRef::new(structure, values);
        for index in 0..structure.n_supernodes() {
            let node = factor.supernode(index);
            let block = node.val();
            let (width, height) = (block.ncols(), block.nrows());
            self.supernodes.push(Supernode {
                start: node.start() as u32,
                width: width as u32,
                first_row: self.rows.len() as u32,
                row_count: (height - width) as u32,
                first_value: self.values.len(),
            });
            self.rows.extend_from_slice(node.pattern());
            for row in 0..width {
                self.values.extend((0..row).map(|column| block[(row, column)]));
                self.values.push(block[(row, row)].recip());
            }
            for row in width..height {
                self.values.extend((0..width).map(|column| block[(row, column)]));
            }
        }
    }

    /// Number of rows of the matrix.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Number of stored entries of `L`.
    pub fn entry_count(&self) -> usize {
        self.values.len()
    }

    /// Where the solve keeps the entry of each row of the matrix.
    pub(crate) fn new_from_old(&self) -> &[u32] {
        &self.new_from_old
    }

    /// Replaces `rhs` by the solution of `A x = rhs`.
    ///
    /// # Panics
    /// If `rhs` does not have one number per row.
    pub fn solve(&self, rhs: &mut [f64]) {
        self.solve_entries(rhs);
    }

    /// Replaces a column of points by the solution of `A x = rhs`, the three coordinates in one sweep.
    ///
    /// # Panics
    /// If `rhs` does not have one point per row.
    pub fn solve_points(&self, rhs: &mut [Vec3]) {
        self.solve_entries(rhs);
    }

    /// Solves for a right-hand side in elimination order (see [`Self::new_from_old`]); the solution is in matrix order.
    ///
    /// Needs no memory besides `rhs`.
    pub(crate) fn solve_points_in_elimination_order(&self, rhs: &mut [Vec3]) {
        self.substitute(rhs);
        let mut cycle = self.cycles.iter();
        while let Some(&first) = cycle.next() {
            let mut at = (first & !LAST) as usize;
            if first & LAST != 0 {
                continue;
            }
            let saved = rhs[at];
            for &element in cycle.by_ref() {
                let next = (element & !LAST) as usize;
                rhs[at] = rhs[next];
                at = next;
                if element & LAST != 0 {
                    break;
                }
            }
            rhs[at] = saved;
        }
    }

    /// The same, but for the order: the solution stays where the right-hand side was.
    pub(crate) fn substitute<T: Entry>(&self, rhs: &mut [T]) {
        assert_eq!(rhs.len(), self.size, "one entry per row");
        with_widest_registers(Substitution { factor: self, rhs });
    }

    fn solve_entries<T: Entry>(&self, rhs: &mut [T]) {
        assert_eq!(rhs.len(), self.size, "one entry per row");
        let mut x: Vec<T> = self.old_from_new.iter().map(|&old| rhs[old as usize]).collect();
        self.substitute(&mut x);
        for (&old, value) in self.old_from_new.iter().zip(x) {
            rhs[old as usize] = value;
        }
    }

    /// `L y = x` in place, in elimination order.
    #[inline(always)]
    fn forward<T: Entry>(&self, x: &mut [T]) {
        for node in &self.supernodes {
            let (diagonal, below, rows) = self.parts(node);
            let (start, width) = (node.start as usize, node.width as usize);
            let mut at = 0;
            for row in 0..width {
                let mut value = x[start + row];
                for column in 0..row {
                    value = value - x[start + column] * diagonal[at + column];
                }
                x[start + row] = value * diagonal[at + row];
                at += row + 1;
            }
            // Four rows at a time read the supernode's own entries once.
            let (head, tail) = x.split_at_mut(start + width);
            let (own, passed) = (&head[start..], start + width);
            let (mut row_blocks, mut factor_blocks) = (rows.chunks_exact(4), below.chunks_exact(4 * width));
            for (rows, factors) in row_blocks.by_ref().zip(factor_blocks.by_ref()) {
                let at = [0, 1, 2, 3].map(|i| rows[i] as usize - passed);
                let mut values = at.map(|place| tail[place]);
                let [first, second, third, fourth] = [0, 1, 2, 3].map(|i| &factors[i * width..(i + 1) * width]);
                for (column, &other) in own.iter().enumerate() {
                    values[0] = values[0] - other * first[column];
                    values[1] = values[1] - other * second[column];
                    values[2] = values[2] - other * third[column];
                    values[3] = values[3] - other * fourth[column];
                }
                for (place, value) in at.into_iter().zip(values) {
                    tail[place] = value;
                }
            }
            let rest = factor_blocks.remainder().chunks_exact(width);
            for (&row, factors) in row_blocks.remainder().iter().zip(rest) {
                let mut value = tail[row as usize - passed];
                for (&factor, &other) in factors.iter().zip(own) {
                    value = value - other * factor;
                }
                tail[row as usize - passed] = value;
            }
        }
    }

    /// `Lᵀ z = x` in place, in elimination order.
    #[inline(always)]
    fn backward<T: Entry>(&self, x: &mut [T]) {
        for node in self.supernodes.iter().rev() {
            let (diagonal, below, rows) = self.parts(node);
            let (start, width) = (node.start as usize, node.width as usize);
            let (head, tail) = x.split_at_mut(start + width);
            let own = &mut head[start..];
            let passed = start + width;
            // From the end to the start of memory, which the processor can foresee.
            let (mut row_blocks, mut factor_blocks) = (rows.rchunks_exact(4), below.rchunks_exact(4 * width));
            for (rows, factors) in row_blocks.by_ref().zip(factor_blocks.by_ref()) {
                let others = [0, 1, 2, 3].map(|i| tail[rows[i] as usize - passed]);
                let [first, second, third, fourth] = [0, 1, 2, 3].map(|i| &factors[i * width..(i + 1) * width]);
                for (column, value) in own.iter_mut().enumerate() {
                    *value = *value
                        - others[0] * first[column]
                        - others[1] * second[column]
                        - others[2] * third[column]
                        - others[3] * fourth[column];
                }
            }
            let rest = factor_blocks.remainder().chunks_exact(width);
            for (&row, factors) in row_blocks.remainder().iter().zip(rest) {
                let other = tail[row as usize - passed];
                for (value, &factor) in own.iter_mut().zip(factors) {
                    *value = *value - other * factor;
                }
            }
            let mut at = diagonal.len();
            for row in (0..width).rev() {
                at -= row + 1;
                let value = own[row] * diagonal[at + row];
                own[row] = value;
                for column in 0..row {
                    own[column] = own[column] - value * diagonal[at + column];
                }
            }
        }
    }

    /// The values of the diagonal block, those below it, and the rows these belong to.
    #[inline(always)]
    fn parts(&self, node: &Supernode) -> (&[f64], &[f64], &[u32]) {
        let (width, row_count) = (node.width as usize, node.row_count as usize);
        let triangle = width * (width + 1) / 2;
        let values = &self.values[node.first_value..node.first_value + triangle + width * row_count];
        let (diagonal, below) = values.split_at(triangle);
        let first_row = node.first_row as usize;
        (diagonal, below, &self.rows[first_row..first_row + row_count])
    }
}

/// See [`SparseCholesky::substitute`].
struct Substitution<'a, T> {
    factor: &'a SparseCholesky,
    rhs: &'a mut [T],
}

impl<T: Entry> Kernel for Substitution<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.factor.forward(self.rhs);
        self.factor.backward(self.rhs);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{SparseCholesky, cycles};
    use crate::shapes::{grid, icosphere};
    use crate::{Matrix, Rng, SolveError, SparseMatrix, Topology, Vec3, normal, seeded_rng, shuffle, solve_spd};

    fn random_points(rng: &mut Rng, n: usize) -> Vec<Vec3> {
        (0..n).map(|_| Vec3::new(normal(rng), normal(rng), normal(rng))).collect()
    }

    /// The graph Laplacian plus a small multiple of the identity, both halves.
    fn laplacian(topology: &Topology, shift: f64) -> Vec<(usize, usize, f64)> {
        let mut triplets: Vec<_> = (0..topology.vertex_count()).map(|i| (i, i, shift)).collect();
        for edge in topology.edges() {
            let [a, b] = edge.vertices.map(|vertex| vertex as usize);
            triplets.extend([(a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)]);
        }
        triplets
    }

    #[test]
    fn the_residual_of_a_mesh_laplacian_vanishes() {
        let mut rng = seeded_rng(1);
        for mesh in [icosphere(3), grid(40, 25)] {
            let n = mesh.vertices.len();
            let triplets = laplacian(&mesh.topology, 1e-3);
            let factor = SparseCholesky::new(n, &triplets).unwrap();
            let matrix = SparseMatrix::from_triplets(n, n, &triplets).unwrap();
            let rhs = random_points(&mut rng, n);
            let mut x = rhs.clone();
            factor.solve_points(&mut x);
            for (product, b) in matrix.mul_points(&x).iter().zip(&rhs) {
                assert!(product.distance(*b) < 1e-10);
            }
            // One coordinate alone, and the permuted road, give the same.
            let mut first: Vec<f64> = rhs.iter().map(|p| p.x).collect();
            factor.solve(&mut first);
            assert!(first.iter().zip(&x).all(|(a, p)| (a - p.x).abs() < 1e-10));
            let mut permuted = vec![Vec3::ZERO; n];
            for (&place, b) in factor.new_from_old().iter().zip(&rhs) {
                permuted[place as usize] = *b;
            }
            factor.solve_points_in_elimination_order(&mut permuted);
            assert!(permuted.iter().zip(&x).all(|(a, b)| a.distance(*b) < 1e-12));
        }
    }

    #[test]
    fn the_lower_half_alone_is_enough() {
        let mesh = icosphere(1);
        let triplets = laplacian(&mesh.topology, 0.5);
        let lower: Vec<_> = triplets.iter().copied().filter(|(row, column, _)| row >= column).collect();
        let n = mesh.vertices.len();
        let rhs: Vec<f64> = (0..n).map(|i| i as f64).collect();
        let (mut a, mut b) = (rhs.clone(), rhs);
        SparseCholesky::new(n, &triplets).unwrap().solve(&mut a);
        SparseCholesky::new(n, &lower).unwrap().solve(&mut b);
        assert_eq!(a, b);
    }

    #[test]
    fn bad_matrices_are_refused() {
        let singular = laplacian(&icosphere(0).topology, 0.0);
        assert_eq!(
            SparseCholesky::new(3, &[(0, 0, 1.0), (1, 1, -1.0), (2, 2, 1.0)]).unwrap_err(),
            SolveError::NotPositiveDefinite { size: 3 }
        );
        // A row without entries.
        assert!(SparseCholesky::new(2, &[(0, 0, 1.0)]).is_err());
        assert!(matches!(SparseCholesky::new(2, &[(0, 2, 1.0)]), Err(SolveError::IndexOutOfRange { column: 2, .. })));
        assert!(matches!(SparseCholesky::new(1, &[(0, 0, f64::NAN)]), Err(SolveError::NotFinite { index: 0, .. })));
        // Exactly singular in real numbers; rounding may leave a tiny pivot, and then the solution is huge.
        if let Ok(factor) = SparseCholesky::new(12, &singular) {
            let mut x = vec![1.0; 12];
            factor.solve(&mut x);
            assert!(x.iter().any(|value| value.abs() > 1e6 || !value.is_finite()));
        }
        SparseCholesky::new(0, &[]).unwrap().solve(&mut []);
    }

    #[test]
    fn cycles_cover_a_permutation_once() {
        let mut rng = seeded_rng(2);
        for n in [0usize, 1, 2, 50] {
            let mut permutation: Vec<u32> = (0..n as u32).collect();
            shuffle(&mut rng, &mut permutation);
            let mut elements: Vec<u32> = cycles(&permutation).iter().map(|element| element & !super::LAST).collect();
            elements.sort_unstable();
            assert!(elements.into_iter().eq(0..n as u32));
        }
    }

    proptest! {
        #[test]
        fn sparse_and_dense_agree(
            n in 1usize..14,
            entries in prop::collection::vec((0usize..14, 0usize..14, -2.0f64..2.0), 0..40),
            seed in 0u64..1000,
        ) {
            // BᵀB + I is positive definite for every B.
            let entries: Vec<_> = entries.into_iter().filter(|&(row, column, _)| row < n && column < n).collect();
            let b = SparseMatrix::from_triplets(n, n, &entries).unwrap();
            let mut triplets = b.gram();
            triplets.extend((0..n).map(|i| (i, i, 1.0)));
            let mut dense = Matrix::zeros(n, n);
            for &(row, column, value) in &triplets {
                dense[(row, column)] += value;
            }
            let mut rng = seeded_rng(seed);
            let rhs = Matrix::from_fn(n, 1, |_, _| normal(&mut rng));
            let expected = solve_spd(&dense, &rhs).unwrap();
            let mut x = rhs.data.clone();
            SparseCholesky::new(n, &triplets).unwrap().solve(&mut x);
            for (found, expected) in x.iter().zip(&expected.data) {
                prop_assert!((found - expected).abs() < 1e-9);
            }
        }
    }
}
