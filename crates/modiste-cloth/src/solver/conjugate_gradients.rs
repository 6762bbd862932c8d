//! Preconditioned conjugate gradients over the vertices of a cloth.

use super::matrix::SystemMatrix;
use glam::{Mat3A, Vec3A};

/// Vectors of the iteration, kept to spare allocations.
#[derive(Debug, Clone, Default)]
pub(crate) struct ConjugateGradients {
    residual: Vec<Vec3A>,
    preconditioned: Vec<Vec3A>,
    direction: Vec<Vec3A>,
    image: Vec<Vec3A>,
    inverse_diagonal: Vec<Mat3A>,
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
            preconditioned: zero.clone(),
            direction: zero.clone(),
            image: zero,
            inverse_diagonal: vec![Mat3A::ZERO; count],
        }
    }

    /// Solves `A x = b` from the start `x`, with the blocks of the diagonal as preconditioner `P`.
    ///
    /// Stops where `r · P⁻¹ r` of the residual `r = b - A x` is below `target`. Vertices that are not `free` keep `x`.
    pub(crate) fn solve(
        &mut self,
        matrix: &SystemMatrix,
        free: &[bool],
        b: &[Vec3A],
        x: &mut [Vec3A],
        (target, max_iterations): (f64, usize),
    ) -> Outcome {
        matrix.inverse_diagonal(free, &mut self.inverse_diagonal);
        matrix.multiply(x, &mut self.image);
        for ((r, b), image) in self.residual.iter_mut().zip(b).zip(&self.image) {
            *r = *b - *image;
        }
        let mut energy = self.precondition();
        self.direction.copy_from_slice(&self.preconditioned);
        for iteration in 0..max_iterations {
            if energy <= target {
                return Outcome { iterations: iteration, converged: true };
            }
            matrix.multiply(&self.direction, &mut self.image);
            let curvature = dot(&self.direction, &self.image);
            if curvature <= 0.0 {
                return Outcome { iterations: iteration, converged: false };
            }
            #[expect(clippy::cast_possible_truncation, reason = "the iteration runs in f32")]
            let step = (energy / curvature) as f32;
            for (x, p) in x.iter_mut().zip(&self.direction) {
                *x += *p * step;
            }
            for (r, image) in self.residual.iter_mut().zip(&self.image) {
                *r -= *image * step;
            }
            let next = self.precondition();
            #[expect(clippy::cast_possible_truncation, reason = "the iteration runs in f32")]
            let ratio = (next / energy) as f32;
            for (p, z) in self.direction.iter_mut().zip(&self.preconditioned) {
                *p = *z + *p * ratio;
            }
            energy = next;
        }
        Outcome { iterations: max_iterations, converged: energy <= target }
    }

    /// `z = P⁻¹ r`; returns `r · z`.
    fn precondition(&mut self) -> f64 {
        let mut energy = 0.0;
        for ((z, r), inverse) in self.preconditioned.iter_mut().zip(&self.residual).zip(&self.inverse_diagonal) {
            *z = *inverse * *r;
            energy += f64::from(z.dot(*r));
        }
        energy
    }
}

fn dot(a: &[Vec3A], b: &[Vec3A]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from(a.dot(*b))).sum()
}
