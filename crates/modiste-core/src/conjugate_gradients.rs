//! Conjugate gradients with 3×3 block-Jacobi preconditioning, for local systems that change from frame to frame.

use crate::error::check_size;
use crate::{Mat3, SolveError, Vec3};

/// A symmetric matrix of 3×3 blocks: one per vertex on the diagonal, and scalar multiples of the identity off it.
///
/// The shape of fitting problems: isotropic coupling between neighbours, and per-vertex terms that know directions.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockSystem {
    diagonal: Vec<Mat3>,
    row_starts: Vec<u32>,
    columns: Vec<u32>,
    weights: Vec<f64>,
}

/// When to stop, and what was reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CgReport {
    /// Iterations made.
    pub iterations: usize,
    /// Norm of the residual over the norm of the right-hand side.
    pub relative_residual: f64,
}

impl BlockSystem {
    /// A matrix from its diagonal blocks and the entries `(row, column, weight)` off the diagonal, both halves given;
    /// entries at the same place are added.
    ///
    /// # Errors
    /// An index out of range.
    pub fn new(diagonal: Vec<Mat3>, off_diagonal: &[(u32, u32, f64)]) -> Result<Self, SolveError> {
        let n = diagonal.len();
        let mut row_starts = vec![0u32; n + 1];
        for &(row, column, _) in off_diagonal {
            if row as usize >= n || column as usize >= n {
                let (row, column) = (row as usize, column as usize);
                return Err(SolveError::IndexOutOfRange { row, column, rows: n, columns: n });
            }
            row_starts[row as usize + 1] += 1;
        }
        for row in 0..n {
            row_starts[row + 1] += row_starts[row];
        }
        let mut fill = row_starts.clone();
        let mut columns = vec![0u32; off_diagonal.len()];
        let mut weights = vec![0.0; off_diagonal.len()];
        for &(row, column, weight) in off_diagonal {
            let at = fill[row as usize] as usize;
            (columns[at], weights[at]) = (column, weight);
            fill[row as usize] += 1;
        }
        Ok(Self { diagonal, row_starts, columns, weights })
    }

    /// Number of block rows.
    pub fn size(&self) -> usize {
        self.diagonal.len()
    }

    /// The diagonal blocks, to change between solves.
    pub fn diagonal_mut(&mut self) -> &mut [Mat3] {
        &mut self.diagonal
    }

    /// `out = A x`.
    pub fn mul(&self, x: &[Vec3], out: &mut [Vec3]) {
        for (row, value) in out.iter_mut().enumerate() {
            let range = self.row_starts[row] as usize..self.row_starts[row + 1] as usize;
            let mut sum = self.diagonal[row] * x[row];
            for (&column, &weight) in self.columns[range.clone()].iter().zip(&self.weights[range]) {
                sum += weight * x[column as usize];
            }
            *value = sum;
        }
    }

    /// Solves `A x = rhs` from the `x` given, until the residual is `tolerance` times the right-hand side.
    ///
    /// # Errors
    /// Sizes that do not agree; a diagonal block or a search direction for which the matrix is not positive definite;
    /// more than `max_iterations` iterations.
    pub fn solve(
        &self,
        rhs: &[Vec3],
        x: &mut [Vec3],
        tolerance: f64,
        max_iterations: usize,
    ) -> Result<CgReport, SolveError> {
        let n = self.size();
        check_size("points of the right-hand side", n, rhs.len())?;
        check_size("points of the solution", n, x.len())?;
        let not_definite = SolveError::NotPositiveDefinite { size: 3 * n };
        if self.diagonal.iter().any(|block| block.determinant() <= 0.0 || block.is_nan()) {
            return Err(not_definite);
        }
        let inverses: Vec<Mat3> = self.diagonal.iter().map(Mat3::inverse).collect();
        let scale = norm(rhs);
        if scale <= 0.0 {
            x.fill(Vec3::ZERO);
            return Ok(CgReport { iterations: 0, relative_residual: 0.0 });
        }
        let mut product = vec![Vec3::ZERO; n];
        self.mul(x, &mut product);
        let mut residual: Vec<Vec3> = rhs.iter().zip(&product).map(|(b, ax)| b - ax).collect();
        let mut preconditioned: Vec<Vec3> = inverses.iter().zip(&residual).map(|(m, r)| m * r).collect();
        let mut direction = preconditioned.clone();
        let mut energy = dot(&residual, &preconditioned);
        let mut relative = norm(&residual) / scale;
        for iteration in 0..=max_iterations {
            if relative <= tolerance {
                return Ok(CgReport { iterations: iteration, relative_residual: relative });
            }
            self.mul(&direction, &mut product);
            let curvature = dot(&direction, &product);
            if curvature <= 0.0 || curvature.is_nan() {
                return Err(not_definite);
            }
            let step = energy / curvature;
            for i in 0..n {
                x[i] += step * direction[i];
                residual[i] -= step * product[i];
                preconditioned[i] = inverses[i] * residual[i];
            }
            let next_energy = dot(&residual, &preconditioned);
            let keep = next_energy / energy;
            energy = next_energy;
            for (d, z) in direction.iter_mut().zip(&preconditioned) {
                *d = *z + keep * *d;
            }
            relative = norm(&residual) / scale;
        }
        Err(SolveError::NoConvergence { what: "conjugate gradients", iterations: max_iterations })
    }
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn norm(a: &[Vec3]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::BlockSystem;
    use crate::shapes::icosphere;
    use crate::{Mat3, Matrix, SolveError, Vec3, normal, seeded_rng, solve_spd, vertex_normals};

    /// The graph Laplacian of a sphere with some mass, and stiff springs along the normals of every third vertex.
    fn example() -> (BlockSystem, Vec<Vec3>) {
        let mesh = icosphere(2);
        let normals = vertex_normals(&mesh.topology, &mesh.vertices);
        let mut diagonal = vec![Mat3::from_diagonal(Vec3::splat(0.1)); normals.len()];
        let mut off_diagonal = Vec::new();
        for edge in mesh.topology.edges() {
            let [a, b] = edge.vertices;
            for vertex in [a, b] {
                diagonal[vertex as usize] += Mat3::IDENTITY;
            }
            off_diagonal.extend([(a, b, -1.0), (b, a, -1.0)]);
        }
        for (block, n) in diagonal.iter_mut().zip(&normals).step_by(3) {
            *block += 50.0 * Mat3::from_cols(n.x * *n, n.y * *n, n.z * *n);
        }
        let mut rng = seeded_rng(1);
        let rhs = normals.iter().map(|_| Vec3::new(normal(&mut rng), normal(&mut rng), normal(&mut rng))).collect();
        (BlockSystem::new(diagonal, &off_diagonal).unwrap(), rhs)
    }

    #[test]
    fn agrees_with_dense_cholesky() {
        let (system, rhs) = example();
        let n = system.size();
        let mut dense = Matrix::zeros(3 * n, 3 * n);
        for column in 0..3 * n {
            let mut unit = vec![Vec3::ZERO; n];
            unit[column / 3][column % 3] = 1.0;
            let mut image = vec![Vec3::ZERO; n];
            system.mul(&unit, &mut image);
            for row in 0..3 * n {
                dense[(row, column)] = image[row / 3][row % 3];
            }
        }
        let b = Matrix::from_fn(3 * n, 1, |row, _| rhs[row / 3][row % 3]);
        let truth = solve_spd(&dense, &b).unwrap();
        for tolerance in [1e-4, 1e-8, 1e-12] {
            let mut x = vec![Vec3::ZERO; n];
            let report = system.solve(&rhs, &mut x, tolerance, 500).unwrap();
            assert!(report.relative_residual <= tolerance);
            let error = (0..3 * n).map(|row| (x[row / 3][row % 3] - truth[(row, 0)]).abs()).fold(0.0, f64::max);
            assert!(error < 200.0 * tolerance, "{error} at {tolerance}");
            // From the solution no iteration is needed.
            assert_eq!(system.solve(&rhs, &mut x, 2.0 * tolerance, 500).unwrap().iterations, 0);
        }
    }

    #[test]
    fn matrices_that_are_not_definite_are_refused() {
        let negative = BlockSystem::new(vec![-1.0 * Mat3::IDENTITY; 2], &[]).unwrap();
        let mut x = vec![Vec3::ZERO; 2];
        let rhs = [Vec3::X, Vec3::Y];
        assert_eq!(negative.solve(&rhs, &mut x, 1e-9, 10), Err(SolveError::NotPositiveDefinite { size: 6 }));
        let saddle = BlockSystem::new(vec![Mat3::IDENTITY; 2], &[(0, 1, 2.0), (1, 0, 2.0)]).unwrap();
        let difference = [Vec3::X, -Vec3::X];
        assert!(saddle.solve(&difference, &mut x, 1e-9, 10).is_err());
        assert!(BlockSystem::new(vec![Mat3::IDENTITY; 2], &[(0, 2, 1.0)]).is_err());
    }
}
