//! One matrix per style: what follows from the blended tensor by conditioning (eq. 22–25), and its stability (§4.1).

use modiste_core::{Matrix, largest_eigenvalue_magnitude, solve_spd};
use serde::{Deserialize, Serialize};

use super::blocks::Blocks;
use crate::HairError;

/// Where the parts of an augmented vector `w = [x_t; y_{t−2}; y_{t−1}; z_{t,t−2}; z_{t−1,t−2}; y_t]` are; x_t are the inputs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Inputs: the bust coefficients, d_b, and what there is beside them.
    pub inputs: usize,
    /// Hair coefficients, d_h.
    pub hair: usize,
}

/// Numbers of `z_{t,t−2}` and `z_{t−1,t−2}` together.
pub const MOVES: usize = 10;

impl Layout {
    /// Length of an augmented vector, d_a = d_b + 3 d_h + 10.
    pub fn size(&self) -> usize {
        self.observed() + self.hair
    }

    /// Length of its observed part.
    pub fn observed(&self) -> usize {
        self.inputs + 2 * self.hair + MOVES
    }

    /// Which places the hair has no part in: all cells have them in common.
    pub fn shared(&self) -> Vec<bool> {
        let moves = self.observed() - MOVES..self.observed();
        (0..self.size()).map(|place| place < self.inputs || moves.contains(&place)).collect()
    }

    /// First place of `y_{t−2}`.
    pub fn older(&self) -> usize {
        self.inputs
    }

    /// First place of `y_{t−1}`.
    pub fn newer(&self) -> usize {
        self.inputs + self.hair
    }
}

/// What keeps the regression from believing small differences: as if the observed numbers were known with so much noise.
///
/// Independent noise is the ridge of the textbooks. Shared noise is the same in both earlier frames of a coefficient: where
/// the hair is, is known less well than how it moves, since in use it is the model's own answer. It makes the model lean on
/// the bust, and so draws the eigenvalues of the dynamics below 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Ridge {
    /// Variance of the independent noise, as a part of each number's own.
    pub independent: f64,
    /// Variance of the shared noise, as a part of each coefficient's own.
    pub shared: f64,
    /// Variance of independent noise of the inputs, in place of the first, as a part of each input's own.
    pub inputs: f64,
}

impl Ridge {
    /// No noise.
    pub const NONE: Self = Self { independent: 0.0, shared: 0.0, inputs: 0.0 };

    /// The ridge of a style between cells: its numbers' logarithms are blended, as far as cells are taken and not left.
    pub fn between(ridges: &[Self], weights: &[f64]) -> Self {
        let total: f64 = weights.iter().map(|weight| weight.max(0.0)).sum();
        let mean = |of: fn(&Self) -> f64| {
            let sum: f64 = ridges.iter().zip(weights).map(|(r, w)| w.max(0.0) * of(r).max(1e-12).ln()).sum();
            (sum / total.max(f64::MIN_POSITIVE)).exp()
        };
        Self { independent: mean(|r| r.independent), shared: mean(|r| r.shared), inputs: mean(|r| r.inputs) }
    }

    /// `G_yo (G_oo + noise)^{-1}` for a Gram matrix whose first `observed` rows are known.
    pub(super) fn condition(self, gram: &Matrix, observed: usize) -> Result<Matrix, HairError> {
        self.condition_with(gram, observed, None)
    }

    fn condition_with(self, gram: &Matrix, observed: usize, layout: Option<Layout>) -> Result<Matrix, HairError> {
        let mut known = Matrix::from_fn(observed, observed, |i, j| gram[(i, j)]);
        for i in 0..observed {
            let noise = if layout.is_some_and(|layout| i < layout.inputs) { self.inputs } else { self.independent };
            known[(i, i)] += (noise + 1e-12) * gram[(i, i)].max(1e-12);
        }
        if let Some(layout) = layout {
            for k in 0..layout.hair {
                let (a, b) = (layout.older() + k, layout.newer() + k);
                let noise = self.shared * gram[(b, b)];
                for (i, j) in [(a, a), (a, b), (b, a), (b, b)] {
                    known[(i, j)] += noise;
                }
            }
        }
        let right = Matrix::from_fn(observed, gram.rows - observed, |i, j| gram[(i, observed + j)]);
        Ok(solve_spd(&known, &right).map_err(HairError::solving("matrix of a hair style"))?.transpose())
    }
}

/// The dynamics of one style: `y_t = A x + B₁ y_{t−2} + B₂ y_{t−1} + C₁ z + C₂ z`.
#[derive(Debug, Clone, PartialEq)]
pub struct StyleMatrix {
    layout: Layout,
    /// `[A B₁ B₂ C₁ C₂]` (d_h × observed).
    all: Matrix,
    /// Hair from the bust alone, for the first two frames (d_h × inputs and 1).
    start: Matrix,
}

impl StyleMatrix {
    /// Blends the cells with these weights and conditions on what is observed.
    ///
    /// # Errors
    /// A system without solution: numbers that are not finite.
    pub fn new(blocks: &Blocks, weights: &[f64], layout: Layout, ridge: Ridge) -> Result<Self, HairError> {
        let gram = blocks.blended_gram(weights);
        let all = ridge.condition_with(&gram, layout.observed(), Some(layout))?;
        // With x alone observed, the rest of w is missing; of that only y_t is wanted. The last entry of z, a cosine near 1,
        // stands for the constant: it is as good as known, since a person at rest is at hand.
        let constant = layout.observed() - 1;
        let picked: Vec<usize> = (0..layout.inputs).chain([constant]).chain(layout.observed()..layout.size()).collect();
        let reduced = Matrix::from_fn(picked.len(), picked.len(), |i, j| gram[(picked[i], picked[j])]);
        let noise = Ridge { independent: ridge.inputs.max(1e-6), ..Ridge::NONE };
        let start = noise.condition(&reduced, layout.inputs + 1)?;
        Ok(Self { layout, all, start })
    }

    /// Hair of the next frame from the observed part of the augmented vector.
    pub fn predict(&self, observed: &[f64]) -> Vec<f64> {
        self.all.mul(observed)
    }

    /// Hair of a first frame, from the bust alone.
    pub fn first(&self, inputs: &[f64]) -> Vec<f64> {
        let mut observed = inputs.to_vec();
        observed.push(1.0);
        self.start.mul(&observed)
    }

    /// Largest magnitude λ of an eigenvalue of the dynamics (eq. 26): below 1, hair comes to rest.
    ///
    /// # Errors
    /// An iteration that does not converge.
    pub fn largest_eigenvalue(&self) -> Result<f64, HairError> {
        let d = self.layout.hair;
        // The state is [y_{t−1}; y_{t−2}].
        let companion = Matrix::from_fn(2 * d, 2 * d, |i, j| {
            if i >= d {
                return f64::from(u8::from(i - d == j));
            }
            let place = if j < d { self.layout.newer() + j } else { self.layout.older() + j - d };
            self.all[(i, place)]
        });
        largest_eigenvalue_magnitude(&companion).map_err(HairError::solving("eigenvalues of the hair dynamics"))
    }
}
