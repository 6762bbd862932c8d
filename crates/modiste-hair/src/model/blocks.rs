//! The data tensor in blocks, one per combination of factors, without its frames.
//!
//! With one block `D_c` of augmented vectors (d_a × N_f) per cell `c`, interpolating rows of the mode matrices in barycentric
//! coordinates (§3) blends blocks: `Z ×_1 U_hair ×_2 v_length ×_3 v_softness ×_4 U_config = Σ_c w_c D_c`. Any orthogonal basis
//! of the frames gives the same predictions, because `M^y (M^o)^†` does not change when `M` is multiplied by an orthogonal
//! matrix from the right. So all blocks are stored as the one triangular matrix `L` with `L Lᵀ = D Dᵀ` of the stacked blocks:
//! `D_c = L_c Qᵀ`, nothing is lost, and the 10,000 frames are gone. Rows that are the same in all blocks, as what the bust does
//! is the same whatever the hair, are stacked once, before all others.

use std::sync::OnceLock;

use modiste_core::Matrix;

use crate::HairError;

/// Part of a variable's variance that keeps the factorisation from stopping where variables depend on each other.
const JITTER: f64 = 1e-11;

/// The triangular factor of the stacked blocks.
#[derive(Debug)]
pub struct Blocks {
    /// Where each row of each block is in the stack.
    places: Vec<Vec<usize>>,
    /// Rows of the lower triangle one after the other: row `i` has `i + 1` entries.
    triangle: Vec<f32>,
    products: Vec<OnceLock<Matrix>>,
}

impl Blocks {
    /// Where each row of each of `count` blocks is in the stack; rows that are `shared` come first, once.
    fn places(shared: &[bool], count: usize) -> Vec<Vec<usize>> {
        let mut free = shared.iter().filter(|&&shared| shared).count();
        let place_block = |_| {
            let mut once = 0;
            let place = |&shared: &bool| {
                let next = if shared { &mut once } else { &mut free };
                *next += 1;
                *next - 1
            };
            shared.iter().map(place).collect()
        };
        (0..count).map(place_block).collect()
    }

    /// Rows of the stack of `count` blocks.
    pub fn stacked(shared: &[bool], count: usize) -> usize {
        let once = shared.iter().filter(|&&shared| shared).count();
        once + count * (shared.len() - once)
    }

    /// Factors the Gram matrix of `count` stacked blocks; `shared` says of each row of a block whether all have it in common.
    ///
    /// # Errors
    /// A matrix that is no Gram matrix.
    pub fn from_gram(gram: &Matrix, shared: &[bool], count: usize) -> Result<Self, HairError> {
        let n = gram.rows;
        let mut lower: Vec<Vec<f64>> = Vec::with_capacity(n);
        for i in 0..n {
            let mut row = Vec::with_capacity(i + 1);
            for j in 0..i {
                let dot: f64 = dot(&row[..j], &lower[j][..j]);
                row.push((gram[(i, j)] - dot) / lower[j][j]);
            }
            let scale = gram[(i, i)].max(f64::MIN_POSITIVE);
            let pivot = scale * (1.0 + JITTER) - dot(&row, &row);
            if !pivot.is_finite() {
                return Err(HairError::data("hair tensor", "finite numbers", pivot));
            }
            row.push(pivot.max(JITTER * scale).sqrt());
            lower.push(row);
        }
        let triangle = lower.iter().flatten().map(|&value| value as f32).collect();
        Self::from_triangle(triangle, shared, count)
    }

    /// Blocks as they were stored.
    ///
    /// # Errors
    /// A triangle of another size.
    pub fn from_triangle(triangle: Vec<f32>, shared: &[bool], count: usize) -> Result<Self, HairError> {
        let n = Self::stacked(shared, count);
        if triangle.len() != n * (n + 1) / 2 {
            return Err(HairError::data("triangle of the hair tensor", n * (n + 1) / 2, triangle.len()));
        }
        Ok(Self {
            places: Self::places(shared, count),
            triangle,
            products: (0..count * count).map(|_| OnceLock::new()).collect(),
        })
    }

    /// The same blocks, without what has been made of them so far.
    pub(super) fn copied(&self) -> Self {
        Self {
            places: self.places.clone(),
            triangle: self.triangle.clone(),
            products: self.products.iter().map(|_| OnceLock::new()).collect(),
        }
    }

    /// Rows of a block, d_a.
    pub fn size(&self) -> usize {
        self.places.first().map_or(0, Vec::len)
    }

    /// Number of blocks.
    pub fn count(&self) -> usize {
        self.places.len()
    }

    /// The lower triangle, row after row.
    pub fn triangle(&self) -> &[f32] {
        &self.triangle
    }

    /// `M Mᵀ` of the blend `M = Σ_c w_c D_c` (d_a square).
    pub fn blended_gram(&self, weights: &[f64]) -> Matrix {
        let size = self.size();
        let mut sum = Matrix::zeros(size, size);
        for a in (0..self.count()).filter(|&a| weights[a] != 0.0) {
            for b in (0..self.count()).filter(|&b| weights[b] != 0.0) {
                let product = self.product(a.max(b), a.min(b));
                let weight = weights[a] * weights[b];
                for row in 0..size {
                    for column in 0..size {
                        let entry = if a >= b { product[(row, column)] } else { product[(column, row)] };
                        sum[(row, column)] += weight * entry;
                    }
                }
            }
        }
        sum
    }

    /// `D_a D_bᵀ` for `a >= b`, kept once it is known.
    fn product(&self, a: usize, b: usize) -> &Matrix {
        self.products[a * self.count() + b].get_or_init(|| {
            // Columns beyond those of the earlier block are zero in its rows.
            let columns = self.places[b].iter().max().map_or(0, |last| last + 1);
            let block = |cell: usize| {
                Matrix::from_fn(self.size(), columns, |row, column| {
                    let row = self.places[cell][row];
                    if column <= row { f64::from(self.triangle[row * (row + 1) / 2 + column]) } else { 0.0 }
                })
            };
            block(a).matmul(&block(b).transpose())
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums side by side, which the compiler turns into vector instructions.
    let mut sums = [0.0; 4];
    let (chunks_a, rest_a) = a.as_chunks::<4>();
    let (chunks_b, rest_b) = b.as_chunks::<4>();
    for (a, b) in chunks_a.iter().zip(chunks_b) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::super::matrix::Ridge;
    use super::Blocks;
    use crate::model::tensor::Tensor;
    use modiste_core::{Matrix, normal, seeded_rng, thin_svd};

    /// `M^y (M^o)^†` of eq. 22 by singular values, as the text has it.
    fn conditioned(m: &Matrix, observed: usize) -> Matrix {
        let rows = |from: usize, to: usize| Matrix::from_fn(to - from, m.cols, |i, j| m[(from + i, j)]);
        let svd = thin_svd(&rows(0, observed)).unwrap();
        let inverse = Matrix::from_fn(m.cols, observed, |i, j| {
            (0..svd.singular_values.len()).map(|k| svd.v[(i, k)] * svd.u[(j, k)] / svd.singular_values[k]).sum()
        });
        rows(observed, m.rows).matmul(&inverse)
    }

    #[test]
    fn blocks_predict_what_the_tensor_of_the_text_predicts() {
        // d_a = 8 with the last 3 to be inferred; length × softness; 60 frames.
        let (size, observed, frames) = (8, 5, 60);
        let mut rng = seeded_rng(11);
        let mut tensor = Tensor::zeros(&[size, 2, 2, frames]);
        tensor.data.fill_with(|| normal(&mut rng));
        let svd = tensor.n_mode_svd().unwrap();
        let (alpha, beta) = (0.3, 1.2);
        // v = Uᵀ [α, 1 − α]: a row between the rows of the mode matrix.
        let row = |mode: usize, factor: f64| {
            let u = &svd.modes[mode];
            Matrix::from_fn(1, u.cols, |_, k| factor * u[(0, k)] + (1.0 - factor) * u[(1, k)])
        };
        let style =
            svd.core.mode_product(0, &svd.modes[0]).mode_product(1, &row(1, alpha)).mode_product(2, &row(2, beta));
        let wanted = conditioned(&style.unfold(0), observed);

        let cells = [(0, 0), (0, 1), (1, 0), (1, 1)];
        let stacked = Matrix::from_fn(4 * size, frames, |row, frame| {
            let (length, softness) = cells[row / size];
            tensor.data[((row % size * 2 + length) * 2 + softness) * frames + frame]
        });
        let blocks = Blocks::from_gram(&stacked.matmul(&stacked.transpose()), &[false; 8], 4).unwrap();
        let part = |factor: f64, index: usize| if index == 0 { factor } else { 1.0 - factor };
        let weights: Vec<f64> = cells.iter().map(|&(l, s)| part(alpha, l) * part(beta, s)).collect();
        let gram = blocks.blended_gram(&weights);
        let found = Ridge::NONE.condition(&gram, observed).unwrap();
        for i in 0..wanted.rows {
            for j in 0..wanted.cols {
                assert!((found[(i, j)] - wanted[(i, j)]).abs() < 2e-4, "{} {}", found[(i, j)], wanted[(i, j)]);
            }
        }
    }

    #[test]
    fn rows_that_blocks_share_are_stacked_once_and_change_nothing() {
        let (shared, count, frames) = ([true, false, true, false, false], 3, 40);
        let mut rng = seeded_rng(3);
        let once = Matrix::from_fn(2 + 3 * count, frames, |_, _| normal(&mut rng));
        let places = [[0, 2, 1, 3, 4], [0, 5, 1, 6, 7], [0, 8, 1, 9, 10]];
        let all = Matrix::from_fn(5 * count, frames, |row, frame| once[(places[row / 5][row % 5], frame)]);
        let weights = [0.6, -0.2, 0.6];
        let gram_of = |stack: &Matrix, shared: &[bool]| {
            let blocks = Blocks::from_gram(&stack.matmul(&stack.transpose()), shared, count).unwrap();
            (blocks.blended_gram(&weights), blocks.triangle().len())
        };
        let ((found, few), (wanted, many)) = (gram_of(&once, &shared), gram_of(&all, &[false; 5]));
        assert!(few < many);
        for (a, b) in found.data.iter().zip(&wanted.data) {
            assert!((a - b).abs() < 1e-4 * frames as f64, "{a} {b}");
        }
    }
}
