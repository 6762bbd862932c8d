//! Preconditioned conjugate gradients over the vertices of a cloth.

use super::matrix::SystemMatrix;
use glam::{Mat3A, Vec3A};

/// Vectors of the iteration by row of the matrix, kept to spare allocations.
///
/// The preconditioner is a symmetric Gauss-Seidel sweep, `P = (D + L) D⁻¹ (D + L)ᵀ`, in the form of Eisenstat (1981): the
/// iteration runs on `(D + L)⁻¹ A (D + L)⁻ᵀ`, where one substitution down and one up are both the sweep and the product
/// with `A`, so it costs no more than a plain product.
#[derive(Debug, Clone, Default)]
pub(crate) struct ConjugateGradients {
    /// `r̂ = (D + L)⁻¹ r` and `D r̂`.
    residual: Vec<Vec3A>,
    weighted: Vec<Vec3A>,
    /// `p̂`, and `p = (D + L)⁻ᵀ p̂` in the unknowns.
    direction: Vec<Vec3A>,
    change: Vec<Vec3A>,
    /// What is above the diagonal times `p`, stencils added.
    above: Vec<Vec3A>,
    /// `(D + L)⁻¹` of it, then the product of the iteration's matrix with `p̂`.
    swept: Vec<Vec3A>,
    /// `D` times that product.
    image: Vec<Vec3A>,
    solution: Vec<Vec3A>,
    inverse_diagonal: Vec<Mat3A>,
    /// Rows of the vertices that are not free.
    held: Vec<usize>,
}

/// How an iteration ended.
pub(crate) struct Outcome {
    pub(crate) iterations: usize,
    pub(crate) converged: bool,
}

impl ConjugateGradients {
    pub(crate) fn new(count: usize) -> Self {
        let zero = vec![Vec3A::ZERO; count];
        Self {
            residual: zero.clone(),
            weighted: zero.clone(),
            direction: zero.clone(),
            change: zero.clone(),
            above: zero.clone(),
            swept: zero.clone(),
            image: zero.clone(),
            solution: zero,
            inverse_diagonal: vec![Mat3A::ZERO; count],
            held: Vec::new(),
        }
    }

    /// Solves `A x = b` from zero (an earlier solution would keep what is below the tolerance, and feed energy in); `b` and `x` go by vertex.
    ///
    /// Stops where `r · P⁻¹ r` of the residual `r = b - A x` is below `target`. Vertices that are not `free` stay at zero.
    pub(crate) fn solve(
        &mut self,
        matrix: &SystemMatrix,
        free: &[bool],
        b: &[Vec3A],
        x: &mut [Vec3A],
        (target, max_iterations): (f64, usize),
    ) -> Outcome {
        matrix.inverse_diagonal(free, &mut self.inverse_diagonal);
        let mut energy = self.start(matrix, free, b);
        let mut ratio = 0.0;
        let mut iterations = 0;
        while energy > target && iterations < max_iterations {
            let curvature = self.product(matrix, ratio);
            if curvature <= 0.0 {
                break;
            }
            let next = self.advance(energy / curvature);
            #[expect(clippy::cast_possible_truncation, reason = "the iteration runs in f32")]
            let shrunk = (next / energy) as f32;
            (energy, ratio) = (next, shrunk);
            iterations += 1;
        }
        for (vertex, solution) in matrix.vertices().iter().zip(&self.solution) {
            x[*vertex as usize] = *solution;
        }
        Outcome { iterations, converged: energy <= target }
    }

    /// `r̂` and `D r̂` of `b`; returns `r · P⁻¹ r`.
    fn start(&mut self, matrix: &SystemMatrix, free: &[bool], b: &[Vec3A]) -> f64 {
        self.solution.fill(Vec3A::ZERO);
        self.direction.fill(Vec3A::ZERO);
        self.held.clear();
        let is_held = |(_, vertex): &(usize, &u32)| !free[**vertex as usize];
        self.held.extend(matrix.vertices().iter().enumerate().filter(is_held).map(|(row, _)| row));
        for (row, &vertex) in matrix.vertices().iter().enumerate() {
            self.weighted[row] = b[vertex as usize] - matrix.lower().row(row, &self.residual);
            self.residual[row] = self.inverse_diagonal[row] * self.weighted[row];
        }
        for &row in &self.held {
            self.weighted[row] = Vec3A::ZERO;
        }
        dot(&self.weighted, &self.residual)
    }

    /// Takes `p̂ = D r̂ + ratio p̂` and multiplies it by the matrix of the iteration; returns their dot product.
    fn product(&mut self, matrix: &SystemMatrix, ratio: f32) -> f64 {
        for row in (0..self.direction.len()).rev() {
            let above = matrix.upper().row(row, &self.change);
            let direction = self.weighted[row] + self.direction[row] * ratio;
            self.direction[row] = direction;
            self.above[row] = above;
            self.image[row] = direction - above;
            self.change[row] = self.inverse_diagonal[row] * self.image[row];
        }
        matrix.add_stencils(&self.change, &mut self.above);
        for row in 0..self.direction.len() {
            let rest = self.above[row] - matrix.lower().row(row, &self.swept);
            self.image[row] += rest;
            self.swept[row] = self.inverse_diagonal[row] * rest;
        }
        for &row in &self.held {
            self.image[row] = Vec3A::ZERO;
        }
        for (swept, change) in self.swept.iter_mut().zip(&self.change) {
            *swept += *change;
        }
        dot(&self.direction, &self.swept)
    }

    /// Goes `step` along `p`; returns `r · P⁻¹ r` there.
    fn advance(&mut self, step: f64) -> f64 {
        #[expect(clippy::cast_possible_truncation, reason = "the iteration runs in f32")]
        let step = step as f32;
        for row in 0..self.residual.len() {
            self.solution[row] += self.change[row] * step;
            self.residual[row] -= self.swept[row] * step;
            self.weighted[row] -= self.image[row] * step;
        }
        dot(&self.residual, &self.weighted)
    }
}

/// Rows whose products are summed in f32 before they go into an f64.
const DOT_CHUNK: usize = 64;

fn dot(a: &[Vec3A], b: &[Vec3A]) -> f64 {
    let chunks = a.chunks(DOT_CHUNK).zip(b.chunks(DOT_CHUNK));
    let sums = chunks.map(|(a, b)| a.iter().zip(b).fold(Vec3A::ZERO, |sum, (a, b)| sum + *a * *b));
    sums.map(|sum| f64::from(sum.x) + f64::from(sum.y) + f64::from(sum.z)).sum()
}

#[cfg(test)]
mod tests {
    use super::super::matrix::{Stencil, SystemMatrix};
    use super::ConjugateGradients;
    use crate::energy::Hinge;
    use glam::{Mat3A, Vec3A};
    use modiste_core::{Matrix, Rng, Topology, normal, seeded_rng, solve_spd};

    const SIDE: u32 = 5;
    const COUNT: usize = (SIDE * SIDE) as usize;

    fn block(matrix: &Matrix, i: usize, j: usize) -> Mat3A {
        let column = |c: usize| Vec3A::from_array([0, 1, 2].map(|r| matrix[(3 * i + r, 3 * j + c)] as f32));
        Mat3A::from_cols(column(0), column(1), column(2))
    }

    /// Adds `scale (w wᵀ ⊗ part)`.
    fn add(dense: &mut Matrix, (vertices, weights): ([u32; 4], [f64; 4]), part: &Matrix, scale: f64) {
        for (i, wi) in vertices.into_iter().zip(weights) {
            for (j, wj) in vertices.into_iter().zip(weights) {
                for row in 0..3 {
                    for column in 0..3 {
                        let entry = (3 * i as usize + row, 3 * j as usize + column);
                        dense[entry] += scale * wi * wj * part[(row, column)];
                    }
                }
            }
        }
    }

    /// A random positive semidefinite matrix.
    fn positive(size: usize, rng: &mut Rng) -> Matrix {
        let root = Matrix::from_fn(size, size, |_, _| normal(rng));
        root.transpose_matmul(&root)
    }

    #[test]
    fn the_solution_is_that_of_the_dense_matrix() {
        let mut rng = seeded_rng(8);
        let corner = |x: u32, y: u32| y * SIDE + x;
        let cells = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| (x, y)));
        let quads = cells.map(|(x, y)| [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)]);
        let quads: Vec<[u32; 4]> = quads.collect();
        let faces: Vec<[u32; 3]> = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let hinge = |&[a, b, c, d]: &[u32; 4]| Hinge {
            vertices: [a, c, b, d],
            weights: [-1.1, -0.9, 0.8, 1.2],
            stiffness: 0.7,
            rest: 0.0,
        };
        let hinges: Vec<Hinge> = quads.iter().map(hinge).collect();
        let topology = Topology::new(COUNT, faces.clone()).unwrap();
        let mut matrix = SystemMatrix::new(&topology, &hinges, 2.0);
        matrix.clear();
        let mut dense = Matrix::zeros(3 * COUNT, 3 * COUNT);
        let identity = Matrix::from_fn(3, 3, |row, column| f64::from(u8::from(row == column)));
        for hinge in &hinges {
            add(&mut dense, (hinge.vertices, hinge.weights), &identity, 2.0 * hinge.stiffness);
        }
        for (face, corners) in faces.iter().enumerate() {
            let local = positive(9, &mut rng);
            let pairs = [[0, 0], [1, 1], [2, 2], [0, 1], [1, 2], [2, 0]];
            matrix.add_face(face, &pairs.map(|[i, j]| block(&local, i, j)));
            for i in 0..9 {
                for j in 0..9 {
                    let at = |k: usize| 3 * corners[k / 3] as usize + k % 3;
                    dense[(at(i), at(j))] += local[(i, j)];
                }
            }
        }
        for vertex in 0..COUNT {
            matrix.add_diagonal(vertex, Mat3A::from_diagonal(glam::Vec3::splat(0.5)));
            (0..3).for_each(|axis| dense[(3 * vertex + axis, 3 * vertex + axis)] += 0.5);
        }
        // Far vertices, as seams and self-contact join them.
        for (vertices, weights) in [([0, 24, 0, 24], [1.0, -1.0, 0.0, 0.0]), ([3, 11, 16, 17], [1.0, -0.5, -0.3, -0.2])]
        {
            let part = positive(3, &mut rng);
            add(&mut dense, (vertices, weights), &part, 1.0);
            let weights = weights.map(|w| w as f32);
            matrix.add_stencil(Stencil { vertices, weights, block: block(&part, 0, 0) });
        }
        let mut free = vec![true; COUNT];
        for held in [7, 20] {
            free[held] = false;
            for k in 3 * held..3 * held + 3 {
                for other in 0..3 * COUNT {
                    dense[(k, other)] = 0.0;
                    dense[(other, k)] = 0.0;
                }
                dense[(k, k)] = 1.0;
            }
        }
        let right = Matrix::from_fn(3 * COUNT, 1, |row, _| if free[row / 3] { normal(&mut rng) } else { 0.0 });
        let wanted = solve_spd(&dense, &right).unwrap();
        let b: Vec<Vec3A> =
            (0..COUNT).map(|v| Vec3A::from_array([0, 1, 2].map(|axis| right[(3 * v + axis, 0)] as f32))).collect();
        let mut x = vec![Vec3A::ONE; COUNT];
        let mut solver = ConjugateGradients::new(COUNT);
        // Twice: nothing of the first solve may be left over.
        for _ in 0..2 {
            let outcome = solver.solve(&matrix, &free, &b, &mut x, (1e-11, 300));
            assert!(outcome.converged, "{} iterations", outcome.iterations);
            for (vertex, x) in x.iter().enumerate() {
                for axis in 0..3 {
                    let want = wanted[(3 * vertex + axis, 0)];
                    assert!((f64::from(x[axis]) - want).abs() < 1e-3, "{vertex}: {} {want}", x[axis]);
                }
            }
        }
    }
}
