//! Dense matrices and what is solved with them.

use std::ops::{Index, IndexMut};

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par, Side};

use crate::error::{check_finite, check_size};
use crate::{SolveError, sequential};

/// A dense matrix, row by row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Matrix {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    /// Entries, row by row.
    pub data: Vec<f64>,
}

impl Matrix {
    /// A matrix of zeros.
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self { rows, cols, data: vec![0.0; rows * cols] }
    }

    /// The identity.
    pub fn identity(size: usize) -> Self {
        Self::from_diagonal(&vec![1.0; size])
    }

    /// A square matrix with these numbers on its diagonal.
    pub fn from_diagonal(diagonal: &[f64]) -> Self {
        let mut matrix = Self::zeros(diagonal.len(), diagonal.len());
        for (i, &value) in diagonal.iter().enumerate() {
            matrix[(i, i)] = value;
        }
        matrix
    }

    /// A matrix from its rows.
    ///
    /// # Panics
    /// If the rows differ in length.
    pub fn from_rows<R: AsRef<[f64]>>(rows: &[R]) -> Self {
        let cols = rows.first().map_or(0, |row| row.as_ref().len());
        let mut data = Vec::with_capacity(rows.len() * cols);
        for row in rows {
            assert_eq!(row.as_ref().len(), cols, "rows of one length");
            data.extend_from_slice(row.as_ref());
        }
        Self { rows: rows.len(), cols, data }
    }

    /// A matrix with entry `entry(row, column)`.
    pub fn from_fn(rows: usize, cols: usize, mut entry: impl FnMut(usize, usize) -> f64) -> Self {
        let mut matrix = Self::zeros(rows, cols);
        for row in 0..rows {
            for column in 0..cols {
                matrix[(row, column)] = entry(row, column);
            }
        }
        matrix
    }

    /// One row.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.data[row * self.cols..(row + 1) * self.cols]
    }

    /// One row, to change.
    pub fn row_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.data[row * self.cols..(row + 1) * self.cols]
    }

    /// A copy of one column.
    pub fn column(&self, column: usize) -> Vec<f64> {
        (0..self.rows).map(|row| self[(row, column)]).collect()
    }

    /// `Aᵀ`.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.cols, self.rows, |row, column| self[(column, row)])
    }

    /// `A B`.
    ///
    /// # Panics
    /// If the inner sizes differ.
    pub fn matmul(&self, other: &Self) -> Self {
        assert_eq!(self.cols, other.rows, "columns of the left, rows of the right");
        let mut product = Self::zeros(self.rows, other.cols);
        matmul(product.view_mut(), Accum::Replace, self.view(), other.view(), 1.0, Par::Seq);
        product
    }

    /// `Aᵀ B`.
    ///
    /// # Panics
    /// If the numbers of rows differ.
    pub fn transpose_matmul(&self, other: &Self) -> Self {
        assert_eq!(self.rows, other.rows, "rows of both");
        let mut product = Self::zeros(self.cols, other.cols);
        matmul(product.view_mut(), Accum::Replace, self.view().transpose(), other.view(), 1.0, Par::Seq);
        product
    }

    /// `A x`.
    ///
    /// # Panics
    /// If `x` does not have one number per column.
    pub fn mul(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.cols, "one number per column");
        (0..self.rows).map(|row| self.row(row).iter().zip(x).map(|(a, b)| a * b).sum()).collect()
    }

    /// Rounds every entry to single precision, in which models are stored.
    pub fn round_to_single(&mut self) {
        self.data.iter_mut().for_each(|value| *value = f64::from(*value as f32));
    }

    /// Square root of the sum of the squares of the entries.
    pub fn frobenius_norm(&self) -> f64 {
        self.data.iter().map(|value| value * value).sum::<f64>().sqrt()
    }

    pub(crate) fn view(&self) -> MatRef<'_, f64> {
        MatRef::from_row_major_slice(&self.data, self.rows, self.cols)
    }

    fn view_mut(&mut self) -> MatMut<'_, f64> {
        MatMut::from_row_major_slice_mut(&mut self.data, self.rows, self.cols)
    }

    fn from_view(view: MatRef<'_, f64>) -> Self {
        Self::from_fn(view.nrows(), view.ncols(), |row, column| view[(row, column)])
    }

    fn check_square(&self) -> Result<(), SolveError> {
        check_size("columns of a square matrix", self.rows, self.cols)?;
        check_finite("the matrix", &self.data)
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (row, column): (usize, usize)) -> &f64 {
        debug_assert!(column < self.cols, "column {column} of {}", self.cols);
        &self.data[row * self.cols + column]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut f64 {
        debug_assert!(column < self.cols, "column {column} of {}", self.cols);
        &mut self.data[row * self.cols + column]
    }
}

/// Solves `A x = b` for symmetric positive definite `A` (n×n) and `b` (n×q) by Cholesky; the lower half of `A` is read.
///
/// # Errors
/// Sizes that do not agree, a number that is not finite, or a matrix that is not positive definite.
pub fn solve_spd(a: &Matrix, b: &Matrix) -> Result<Matrix, SolveError> {
    use faer::linalg::solvers::Solve as _;
    a.check_square()?;
    check_size("rows of the right-hand side", a.rows, b.rows)?;
    check_finite("the right-hand side", &b.data)?;
    sequential();
    let not_definite = SolveError::NotPositiveDefinite { size: a.rows };
    let factor = a.view().llt(Side::Lower).map_err(|_pivot| not_definite.clone())?;
    let mut x = b.clone();
    factor.solve_in_place(x.view_mut());
    check_finite("the solution", &x.data).map_err(|_overflow| not_definite)?;
    Ok(x)
}

/// Ridge regression: the `b` (p×q) that minimises `|x b - y|² + lambda |b|²`, for `x` (n×p) and `y` (n×q).
///
/// Every coefficient is penalised alike; add a column of ones to `x` for an intercept, or centre both sides first.
/// Solves the smaller of the two systems: `(xᵀx + λI) b = xᵀy`, or `b = xᵀ (x xᵀ + λI)⁻¹ y` when n < p.
///
/// # Errors
/// Sizes that do not agree, a number that is not finite, or a singular system (possible only when `lambda` is 0).
pub fn ridge(x: &Matrix, y: &Matrix, lambda: f64) -> Result<Matrix, SolveError> {
    check_size("rows of the targets", x.rows, y.rows)?;
    check_finite("the regressors", &x.data)?;
    check_finite("the targets", &y.data)?;
    check_finite("lambda", &[lambda])?;
    let add_lambda = |mut gram: Matrix| {
        for i in 0..gram.rows {
            gram[(i, i)] += lambda;
        }
        gram
    };
    if x.rows < x.cols && lambda > 0.0 {
        let transposed = x.transpose();
        let dual = solve_spd(&add_lambda(x.matmul(&transposed)), y)?;
        Ok(transposed.matmul(&dual))
    } else {
        solve_spd(&add_lambda(x.transpose_matmul(x)), &x.transpose_matmul(y))
    }
}

/// Eigenvalues, largest first, and orthonormal eigenvectors (the columns) of a symmetric matrix; its lower half is read.
///
/// The sign of a vector makes its entry of largest magnitude positive, so that results can be compared.
///
/// # Errors
/// A matrix that is not square or not finite, or an iteration that does not converge.
pub fn symmetric_eigen(a: &Matrix) -> Result<(Vec<f64>, Matrix), SolveError> {
    a.check_square()?;
    sequential();
    let n = a.rows;
    let evd = a
        .view()
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_evd| SolveError::NoConvergence { what: "the symmetric eigenvalue iteration", iterations: 0 })?;
    let (ascending, vectors) = (evd.S().column_vector(), evd.U());
    let values = (0..n).rev().map(|i| ascending[i]).collect();
    let mut columns = Matrix::zeros(n, n);
    for column in 0..n {
        let source = n - 1 - column;
        let mut largest = 0.0f64;
        for row in 0..n {
            let entry = vectors[(row, source)];
            if entry.abs() > largest.abs() + 1e-12 {
                largest = entry;
            }
        }
        let sign = if largest < 0.0 { -1.0 } else { 1.0 };
        for row in 0..n {
            columns[(row, column)] = sign * vectors[(row, source)];
        }
    }
    Ok((values, columns))
}

/// The largest magnitude among the (complex) eigenvalues of a square matrix: its spectral radius.
///
/// # Errors
/// A matrix that is not square or not finite, or an iteration that does not converge.
pub fn largest_eigenvalue_magnitude(a: &Matrix) -> Result<f64, SolveError> {
    a.check_square()?;
    sequential();
    let values = a
        .view()
        .eigenvalues()
        .map_err(|_evd| SolveError::NoConvergence { what: "the eigenvalue iteration", iterations: 0 })?;
    Ok(values.iter().map(|value| value.re.hypot(value.im)).fold(0.0, f64::max))
}

/// Thin singular value decomposition `A = U diag(s) Vᵀ`, singular values largest first.
#[derive(Debug, Clone)]
pub struct ThinSvd {
    /// Left singular vectors, the columns (rows × min(rows, cols)).
    pub u: Matrix,
    /// Singular values, largest first.
    pub singular_values: Vec<f64>,
    /// Right singular vectors, the columns (cols × min(rows, cols)).
    pub v: Matrix,
}

/// Thin singular value decomposition.
///
/// # Errors
/// A number that is not finite, or an iteration that does not converge.
pub fn thin_svd(a: &Matrix) -> Result<ThinSvd, SolveError> {
    check_finite("the matrix", &a.data)?;
    sequential();
    let svd = a
        .view()
        .thin_svd()
        .map_err(|_evd| SolveError::NoConvergence { what: "the singular value iteration", iterations: 0 })?;
    let diagonal = svd.S().column_vector();
    Ok(ThinSvd {
        u: Matrix::from_view(svd.U()),
        singular_values: (0..diagonal.nrows()).map(|i| diagonal[i]).collect(),
        v: Matrix::from_view(svd.V()),
    })
}

#[cfg(test)]
mod tests {
    use super::{Matrix, largest_eigenvalue_magnitude, ridge, solve_spd, symmetric_eigen, thin_svd};
    use crate::{SolveError, normal, seeded_rng};

    fn random(rows: usize, cols: usize, seed: u64) -> Matrix {
        let mut rng = seeded_rng(seed);
        Matrix::from_fn(rows, cols, |_, _| normal(&mut rng))
    }

    fn distance(a: &Matrix, b: &Matrix) -> f64 {
        assert_eq!((a.rows, a.cols), (b.rows, b.cols));
        a.data.iter().zip(&b.data).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn products_agree_with_the_definition() {
        let (a, b) = (random(5, 7, 1), random(7, 3, 2));
        let product = a.matmul(&b);
        let by_hand = Matrix::from_fn(5, 3, |i, j| (0..7).map(|k| a[(i, k)] * b[(k, j)]).sum());
        assert!(distance(&product, &by_hand) < 1e-13);
        assert!(distance(&a.transpose().transpose_matmul(&b), &by_hand) < 1e-13);
        assert!(a.mul(&b.column(1)).iter().zip(product.column(1)).all(|(x, y)| (x - y).abs() < 1e-13));
        assert_eq!(a.matmul(&Matrix::identity(7)), a);
    }

    #[test]
    fn the_solution_of_a_definite_system_satisfies_it() {
        let root = random(9, 9, 3);
        let a = root.transpose_matmul(&root);
        let b = random(9, 4, 4);
        assert!(distance(&a.matmul(&solve_spd(&a, &b).unwrap()), &b) < 1e-9);
        let indefinite = Matrix::from_diagonal(&[1.0, -1.0]);
        assert_eq!(solve_spd(&indefinite, &random(2, 1, 5)), Err(SolveError::NotPositiveDefinite { size: 2 }));
        assert!(matches!(solve_spd(&a, &random(8, 1, 5)), Err(SolveError::Size { wanted: 9, found: 8, .. })));
    }

    #[test]
    fn ridge_is_stationary_and_both_roads_agree() {
        for (n, p) in [(20, 6), (6, 20), (8, 8)] {
            let (x, y) = (random(n, p, 6), random(n, 3, 7));
            for lambda in [1e-3, 0.2, 50.0] {
                let b = ridge(&x, &y, lambda).unwrap();
                // Half the gradient: xᵀ(x b - y) + lambda b.
                let mut residual = x.matmul(&b);
                residual.data.iter_mut().zip(&y.data).for_each(|(r, y)| *r -= y);
                let mut gradient = x.transpose_matmul(&residual);
                gradient.data.iter_mut().zip(&b.data).for_each(|(g, b)| *g += lambda * b);
                assert!(gradient.frobenius_norm() < 1e-9 * (1.0 + lambda), "{n} {p} {lambda}");
            }
        }
        // Without a penalty a full-rank system is met exactly.
        let (x, truth) = (random(30, 4, 8), random(4, 2, 9));
        assert!(distance(&ridge(&x, &x.matmul(&truth), 0.0).unwrap(), &truth) < 1e-10);
        assert!(ridge(&Matrix::zeros(3, 2), &random(3, 1, 1), 0.0).is_err());
    }

    #[test]
    fn eigenvectors_are_orthonormal_and_rebuild_the_matrix() {
        let root = random(12, 12, 10);
        let mut a = root.clone();
        a.data.iter_mut().zip(&root.transpose().data).for_each(|(a, b)| *a += b);
        let (values, vectors) = symmetric_eigen(&a).unwrap();
        assert!(values.is_sorted_by(|a, b| a >= b));
        assert!(distance(&vectors.transpose_matmul(&vectors), &Matrix::identity(12)) < 1e-12);
        let rebuilt = vectors.matmul(&Matrix::from_diagonal(&values)).matmul(&vectors.transpose());
        assert!(distance(&rebuilt, &a) < 1e-12);
        let (values, _) = symmetric_eigen(&Matrix::from_diagonal(&[2.0, -5.0, 7.0])).unwrap();
        assert!(values.iter().zip([7.0, 2.0, -5.0]).all(|(a, b)| (a - b).abs() < 1e-14));
    }

    #[test]
    fn the_spectral_radius_counts_complex_pairs() {
        // A rotation by 0.3 scaled by 0.9 beside a real 0.5: the largest magnitude is 0.9.
        let (s, c) = 0.3f64.sin_cos();
        let a = Matrix::from_rows(&[[0.9 * c, -0.9 * s, 5.0], [0.9 * s, 0.9 * c, -3.0], [0.0, 0.0, 0.5]]);
        assert!((largest_eigenvalue_magnitude(&a).unwrap() - 0.9).abs() < 1e-12);
        // The companion matrix of (t - 2)(t + 3)(t - 1) = t³ - 7t + 6.
        let companion = Matrix::from_rows(&[[0.0, 7.0, -6.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        assert!((largest_eigenvalue_magnitude(&companion).unwrap() - 3.0).abs() < 1e-12);
        assert!(largest_eigenvalue_magnitude(&Matrix::zeros(2, 3)).is_err());
        assert!(largest_eigenvalue_magnitude(&Matrix::from_rows(&[[f64::NAN]])).is_err());
    }

    #[test]
    fn the_thin_singular_value_decomposition_rebuilds_the_matrix() {
        for (rows, cols) in [(8, 3), (3, 8), (5, 5)] {
            let a = random(rows, cols, 11);
            let svd = thin_svd(&a).unwrap();
            assert!(svd.singular_values.is_sorted_by(|a, b| a >= b) && svd.singular_values.len() == rows.min(cols));
            let rebuilt = svd.u.matmul(&Matrix::from_diagonal(&svd.singular_values)).matmul(&svd.v.transpose());
            assert!(distance(&rebuilt, &a) < 1e-12);
        }
    }
}
