//! From hair coefficients to points: `Q y + μ` (eq. 15), as a dense product in small integers, by blocks of rows.

use modiste_core::QuantisedBasis;
use rayon::prelude::*;

/// Numbers of a block: they stay in the nearest cache while all components pass by.
const BLOCK: usize = 2048;

/// A basis laid out for expansion: block after block, within a block component after component.
#[derive(Debug, Clone)]
pub struct Expansion {
    mean: Vec<f32>,
    scales: Vec<f32>,
    values: Vec<i8>,
}

impl Expansion {
    /// Lays out a basis.
    pub fn new(mean: &[f32], basis: &QuantisedBasis<i8>) -> Self {
        let n = basis.dimensions();
        let mut values = Vec::with_capacity(basis.values().len());
        for first in (0..n).step_by(BLOCK) {
            let end = (first + BLOCK).min(n);
            for row in basis.values().chunks_exact(n.max(1)) {
                values.extend_from_slice(&row[first..end]);
            }
        }
        Self { mean: mean.to_vec(), scales: basis.scales().to_vec(), values }
    }

    /// Numbers of a result.
    pub fn dimensions(&self) -> usize {
        self.mean.len()
    }

    /// Writes `mean + sum_k c_k basis_k`, on as many threads as there are.
    ///
    /// # Panics
    /// If `out` has another number of dimensions.
    pub fn expand(&self, coefficients: &[f64], out: &mut [f32]) {
        assert_eq!(out.len(), self.mean.len(), "one number per dimension");
        let count = self.scales.len();
        let scaled: Vec<f32> =
            self.scales.iter().zip(coefficients).map(|(scale, c)| (f64::from(*scale) * c) as f32).collect();
        out.par_chunks_mut(BLOCK).zip(self.mean.par_chunks(BLOCK)).enumerate().for_each(|(index, (out, mean))| {
            out.copy_from_slice(mean);
            let block = &self.values[index * BLOCK * count..][..out.len() * count];
            // Four components at a time, so that sums are read and written a quarter as often.
            let rows: Vec<&[i8]> = block.chunks_exact(out.len()).collect();
            for (rows, c) in rows.chunks(4).zip(scaled.chunks(4)) {
                match (rows, c) {
                    (&[a, b, c, d], &[ca, cb, cc, cd]) => {
                        for (i, value) in out.iter_mut().enumerate() {
                            *value += ca * f32::from(a[i])
                                + cb * f32::from(b[i])
                                + cc * f32::from(c[i])
                                + cd * f32::from(d[i]);
                        }
                    }
                    _ => {
                        for (row, c) in rows.iter().zip(c) {
                            for (value, &entry) in out.iter_mut().zip(*row) {
                                *value += c * f32::from(entry);
                            }
                        }
                    }
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::{BLOCK, Expansion};
    use modiste_core::{QuantisedBasis, normal, seeded_rng};

    #[test]
    fn blocks_give_what_rows_give() {
        let (count, n) = (7, 2 * BLOCK + 123);
        let mut rng = seeded_rng(5);
        let numbers: Vec<f32> = (0..count * n).map(|_| normal(&mut rng) as f32).collect();
        let basis = QuantisedBasis::<i8>::from_f32(&numbers, count, n).unwrap();
        let mean: Vec<f32> = (0..n).map(|_| normal(&mut rng) as f32).collect();
        let coefficients: Vec<f64> = (0..count).map(|_| normal(&mut rng)).collect();
        let (mut plain, mut fast) = (vec![0.0; n], vec![0.0; n]);
        basis.expand(&mean, &coefficients, &mut plain);
        Expansion::new(&mean, &basis).expand(&coefficients, &mut fast);
        assert!(plain.iter().zip(&fast).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}
