//! Principal component analysis of few samples with many dimensions.

use faer::linalg::matmul::matmul;
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

use crate::error::check_size;
use crate::{Matrix, SolveError, symmetric_eigen};

/// Samples per side of a tile of the Gram matrix, the unit of parallel work.
const TILE: usize = 128;
/// Dimensions that are converted to f64 at a time.
const BLOCK: usize = 512;
/// Components whose variance is below this part of the first are dropped: f32 samples do not carry them.
const RANK_TOLERANCE: f64 = 1e-10;

/// Mean and principal components of a set of samples.
///
/// `sample = mean + sum_k c_k basis_k`, `c_k` with standard deviation `std_devs[k]` over the samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pca {
    /// Mean of the samples (n).
    pub mean: Vec<f32>,
    /// Components, k rows of n; orthonormal, under the weights where there are any.
    pub basis: Vec<f32>,
    /// Standard deviation of each coefficient (k), largest first; divisor: samples - 1.
    pub std_devs: Vec<f64>,
    /// Variance of the samples summed over all dimensions, kept and dropped components alike.
    pub total_variance: f64,
    /// Weight per dimension in the inner product (n); empty if all are one.
    pub weights: Vec<f32>,
}

impl Pca {
    /// Finds the first `count` components, or as many as the samples span.
    ///
    /// Eigenvectors of the Gram matrix of the centred samples; sums in f64; the result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// No samples, samples of different lengths, or a number that is not finite.
    pub fn fit(samples: &[&[f32]], count: usize) -> Result<Self, SolveError> {
        Self::fit_weighted(samples, &[], count)
    }

    /// [`Self::fit`] under the inner product `sum_i w_i x_i y_i`; no weights mean ones.
    ///
    /// # Errors
    /// As [`Self::fit`]; also weights of the wrong length, or negative.
    pub fn fit_weighted(samples: &[&[f32]], weights: &[f32], count: usize) -> Result<Self, SolveError> {
        let n = samples.first().ok_or(SolveError::Empty { what: "the list of samples" })?.len();
        for sample in samples {
            check_size("dimensions of a sample", n, sample.len())?;
            check_finite_f32("a sample", sample)?;
        }
        if !weights.is_empty() {
            check_size("weights", n, weights.len())?;
            check_finite_f32("the weights", weights)?;
            if let Some(index) = weights.iter().position(|&weight| weight < 0.0) {
                return Err(SolveError::Negative { what: "the weights", index });
            }
        }
        let m = samples.len();
        let mean = mean(samples, n);
        let roots: Vec<f64> = weights.iter().map(|&weight| f64::from(weight).sqrt()).collect();
        let gram = gram(samples, &mean, &roots);
        let trace: f64 = (0..m).map(|i| gram[(i, i)]).sum();
        let (values, vectors) = symmetric_eigen(&gram)?;
        let floor = RANK_TOLERANCE * values[0].max(0.0);
        let kept = values.iter().take(count.min(m.saturating_sub(1))).take_while(|&&value| value > floor).count();
        let divisor = m.saturating_sub(1).max(1) as f64;
        // basis_k = Xᵀ v_k / sqrt(lambda_k)
        let combine = Matrix::from_fn(kept, m, |k, i| vectors[(i, k)] / values[k].sqrt());
        let basis = combine_samples(&combine, samples, &mean);
        Ok(Self {
            mean: mean.iter().map(|&value| value as f32).collect(),
            basis,
            std_devs: values[..kept].iter().map(|value| (value / divisor).sqrt()).collect(),
            total_variance: trace / divisor,
            weights: weights.to_vec(),
        })
    }

    /// Number of dimensions of a sample.
    pub fn dimensions(&self) -> usize {
        self.mean.len()
    }

    /// Number of components.
    pub fn count(&self) -> usize {
        self.std_devs.len()
    }

    /// One component.
    pub fn component(&self, k: usize) -> &[f32] {
        let n = self.dimensions();
        &self.basis[k * n..(k + 1) * n]
    }

    /// The coefficients of a sample, in the units of the samples.
    ///
    /// # Panics
    /// If the sample has another number of dimensions.
    pub fn project(&self, sample: &[f32]) -> Vec<f64> {
        assert_eq!(sample.len(), self.dimensions(), "one number per dimension");
        let mut centred: Vec<f64> =
            sample.iter().zip(&self.mean).map(|(&value, &mean)| f64::from(value) - f64::from(mean)).collect();
        for (value, &weight) in centred.iter_mut().zip(&self.weights) {
            *value *= f64::from(weight);
        }
        (0..self.count())
            .map(|k| self.component(k).iter().zip(&centred).map(|(&b, c)| f64::from(b) * c).sum())
            .collect()
    }

    /// Writes `mean + sum_k c_k basis_k`; missing coefficients are 0, further ones are ignored.
    ///
    /// # Panics
    /// If `out` has another number of dimensions.
    pub fn expand(&self, coefficients: &[f64], out: &mut [f32]) {
        let n = self.dimensions();
        assert_eq!(out.len(), n, "one number per dimension");
        // A block of the result stays in the nearest cache while the components pass by.
        for (block, (out, mean)) in out.chunks_mut(4096).zip(self.mean.chunks(4096)).enumerate() {
            out.copy_from_slice(mean);
            for (k, &coefficient) in coefficients.iter().take(self.count()).enumerate() {
                let row = &self.component(k)[block * 4096..][..out.len()];
                let coefficient = coefficient as f32;
                for (value, &b) in out.iter_mut().zip(row) {
                    *value += coefficient * b;
                }
            }
        }
    }
}

fn check_finite_f32(what: &'static str, values: &[f32]) -> Result<(), SolveError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(SolveError::NotFinite { what, index }),
        None => Ok(()),
    }
}

fn mean(samples: &[&[f32]], n: usize) -> Vec<f64> {
    let mut mean = vec![0.0f64; n];
    mean.par_chunks_mut(BLOCK).enumerate().for_each(|(block, mean)| {
        for sample in samples {
            for (sum, &value) in mean.iter_mut().zip(&sample[block * BLOCK..]) {
                *sum += f64::from(value);
            }
        }
        for value in mean {
            *value /= samples.len() as f64;
        }
    });
    mean
}

/// Centred samples times the roots of the weights, dimensions `start..` of one block: one row per sample.
fn fill_panel(panel: &mut [f64], samples: &[&[f32]], mean: &[f64], roots: &[f64], start: usize) {
    let end = (start + BLOCK).min(mean.len());
    for (row, sample) in panel.chunks_exact_mut(BLOCK).zip(samples) {
        row.fill(0.0);
        for ((value, &x), mean) in row.iter_mut().zip(&sample[start..end]).zip(&mean[start..end]) {
            *value = f64::from(x) - mean;
        }
        if !roots.is_empty() {
            for (value, root) in row.iter_mut().zip(&roots[start..end]) {
                *value *= root;
            }
        }
    }
}

/// Inner products of the centred samples. Each tile is one task and sums over the dimensions in order.
fn gram(samples: &[&[f32]], mean: &[f64], roots: &[f64]) -> Matrix {
    let m = samples.len();
    let tiles: Vec<(usize, usize)> =
        (0..m).step_by(TILE).flat_map(|i| (0..=i).step_by(TILE).map(move |j| (i, j))).collect();
    let products: Vec<(usize, usize, Matrix)> = tiles
        .into_par_iter()
        .map(|(i, j)| {
            let left_samples = &samples[i..(i + TILE).min(m)];
            let right_samples = &samples[j..(j + TILE).min(m)];
            let mut left = vec![0.0; left_samples.len() * BLOCK];
            let mut right = vec![0.0; right_samples.len() * BLOCK];
            let mut product = Matrix::zeros(left_samples.len(), right_samples.len());
            for start in (0..mean.len()).step_by(BLOCK) {
                fill_panel(&mut left, left_samples, mean, roots, start);
                fill_panel(&mut right, right_samples, mean, roots, start);
                matmul(
                    MatMut::from_row_major_slice_mut(&mut product.data, left_samples.len(), right_samples.len()),
                    Accum::Add,
                    MatRef::from_row_major_slice(&left, left_samples.len(), BLOCK),
                    MatRef::from_row_major_slice(&right, right_samples.len(), BLOCK).transpose(),
                    1.0,
                    Par::Seq,
                );
            }
            (i, j, product)
        })
        .collect();
    let mut gram = Matrix::zeros(m, m);
    for (i, j, product) in products {
        for row in 0..product.rows {
            for column in 0..product.cols {
                gram[(i + row, j + column)] = product[(row, column)];
                gram[(j + column, i + row)] = product[(row, column)];
            }
        }
    }
    gram
}

/// `combine · centred samples` as f32, k rows of n.
fn combine_samples(combine: &Matrix, samples: &[&[f32]], mean: &[f64]) -> Vec<f32> {
    let (k, n) = (combine.rows, mean.len());
    let blocks: Vec<Vec<f64>> = (0..n)
        .into_par_iter()
        .step_by(BLOCK)
        .map(|start| {
            let mut panel = vec![0.0; samples.len() * BLOCK];
            fill_panel(&mut panel, samples, mean, &[], start);
            let mut product = vec![0.0; k * BLOCK];
            matmul(
                MatMut::from_row_major_slice_mut(&mut product, k, BLOCK),
                Accum::Replace,
                combine.view(),
                MatRef::from_row_major_slice(&panel, samples.len(), BLOCK),
                1.0,
                Par::Seq,
            );
            product
        })
        .collect();
    let mut rows = vec![0.0f32; k * n];
    for (block, product) in blocks.iter().enumerate() {
        let start = block * BLOCK;
        let width = BLOCK.min(n - start);
        for row in 0..k {
            let target = &mut rows[row * n + start..][..width];
            for (value, &source) in target.iter_mut().zip(&product[row * BLOCK..]) {
                *value = source as f32;
            }
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::Pca;
    use crate::{Matrix, SolveError, normal, seeded_rng, thin_svd};

    /// Samples with a few strong directions and noise.
    fn samples(m: usize, n: usize, strong: usize) -> Vec<Vec<f32>> {
        let mut rng = seeded_rng(1);
        let directions: Vec<Vec<f64>> = (0..strong).map(|_| (0..n).map(|_| normal(&mut rng)).collect()).collect();
        let sample = |_| {
            let coefficients: Vec<f64> = (0..strong).map(|k| normal(&mut rng) * 0.5f64.powi(k as i32)).collect();
            let terms = |i: usize| coefficients.iter().zip(&directions).map(|(c, d)| c * d[i]).sum::<f64>();
            (0..n).map(|i| (3.0 + terms(i) + 0.01 * normal(&mut rng)) as f32).collect()
        };
        (0..m).map(sample).collect()
    }

    fn views(samples: &[Vec<f32>]) -> Vec<&[f32]> {
        samples.iter().map(Vec::as_slice).collect()
    }

    #[test]
    fn agrees_with_the_singular_value_decomposition() {
        // More than one tile of samples and several blocks of dimensions, neither a whole number.
        let (m, n, k) = (150, 1100, 6);
        let samples = samples(m, n, 5);
        let pca = Pca::fit(&views(&samples), k).unwrap();
        let mean: Vec<f64> = (0..n).map(|i| samples.iter().map(|s| f64::from(s[i])).sum::<f64>() / m as f64).collect();
        assert!(pca.mean.iter().zip(&mean).all(|(&a, &b)| (f64::from(a) - b).abs() < 1e-6));
        let centred = Matrix::from_fn(m, n, |row, i| f64::from(samples[row][i]) - mean[i]);
        let svd = thin_svd(&centred).unwrap();
        for row in 0..k {
            let expected = svd.singular_values[row] / ((m - 1) as f64).sqrt();
            assert!((pca.std_devs[row] / expected - 1.0).abs() < 1e-9);
            let cosine: f64 = pca.component(row).iter().enumerate().map(|(i, &b)| f64::from(b) * svd.v[(i, row)]).sum();
            assert!((cosine.abs() - 1.0).abs() < 1e-6, "{row}: {cosine}");
        }
        let total = centred.frobenius_norm().powi(2) / (m - 1) as f64;
        assert!((pca.total_variance / total - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_basis_is_orthonormal_and_projection_undoes_expansion() {
        let samples = samples(40, 3000, 8);
        let pca = Pca::fit(&views(&samples), 10).unwrap();
        for a in 0..10 {
            for b in 0..10 {
                let dot: f64 =
                    pca.component(a).iter().zip(pca.component(b)).map(|(&x, &y)| f64::from(x) * f64::from(y)).sum();
                assert!((dot - f64::from(u8::from(a == b))).abs() < 1e-6);
            }
        }
        let coefficients: Vec<f64> = pca.std_devs.iter().enumerate().map(|(k, s)| s * (k as f64 - 4.0)).collect();
        let mut sample = vec![0.0; 3000];
        pca.expand(&coefficients, &mut sample);
        for (found, expected) in pca.project(&sample).iter().zip(&coefficients) {
            assert!((found - expected).abs() < 1e-4 * pca.std_devs[0]);
        }
        // The spread of the projections is what std_devs says.
        for k in 0..3 {
            let squares: f64 = samples.iter().map(|s| pca.project(s)[k].powi(2)).sum();
            assert!(((squares / 39.0).sqrt() / pca.std_devs[k] - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn samples_span_no_more_components_than_they_have() {
        let few = samples(4, 100, 3);
        assert_eq!(Pca::fit(&views(&few), 10).unwrap().count(), 3);
        let flat = vec![vec![2.0f32; 50]; 5];
        let pca = Pca::fit(&views(&flat), 3).unwrap();
        assert_eq!((pca.count(), pca.mean[7]), (0, 2.0));
        assert_eq!(Pca::fit(&views(&few[..1]), 3).unwrap().count(), 0);
        // All of them together rebuild the samples.
        let all = Pca::fit(&views(&few), 3).unwrap();
        let mut rebuilt = vec![0.0; 100];
        all.expand(&all.project(&few[2]), &mut rebuilt);
        assert!(rebuilt.iter().zip(&few[2]).all(|(a, b)| (a - b).abs() < 1e-5));
    }

    #[test]
    fn whole_weights_count_like_repeated_dimensions() {
        let plain = samples(30, 60, 4);
        let weights: Vec<f32> = (0..60).map(|i| [1.0, 2.0, 3.0][i % 3]).collect();
        let repeat = |sample: &Vec<f32>| -> Vec<f32> {
            sample.iter().zip(&weights).flat_map(|(&value, &weight)| vec![value; weight as usize]).collect()
        };
        let repeated: Vec<Vec<f32>> = plain.iter().map(repeat).collect();
        let weighted = Pca::fit_weighted(&views(&plain), &weights, 4).unwrap();
        let expected = Pca::fit(&views(&repeated), 4).unwrap();
        for k in 0..4 {
            assert!((weighted.std_devs[k] / expected.std_devs[k] - 1.0).abs() < 1e-9);
        }
        let (a, b) = (weighted.project(&plain[3]), expected.project(&repeated[3]));
        assert!(a.iter().zip(&b).all(|(a, b)| (a.abs() - b.abs()).abs() < 1e-4 * weighted.std_devs[0]));
        // The coefficients of a sample rebuild it through the weighted projection too.
        let mut rebuilt = vec![0.0; 60];
        weighted.expand(&a, &mut rebuilt);
        assert!(weighted.project(&rebuilt).iter().zip(&a).all(|(x, y)| (x - y).abs() < 1e-4 * weighted.std_devs[0]));
    }

    #[test]
    fn the_number_of_threads_does_not_change_a_bit() {
        let samples = samples(140, 2000, 5);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Pca::fit(&views(&samples), 5).unwrap())
        };
        assert_eq!(with(1), with(3));
    }

    #[test]
    fn bad_samples_are_refused() {
        assert!(matches!(Pca::fit(&[], 1), Err(SolveError::Empty { .. })));
        assert!(matches!(Pca::fit(&[&[1.0, 2.0], &[1.0]], 1), Err(SolveError::Size { wanted: 2, found: 1, .. })));
        assert!(matches!(Pca::fit(&[&[1.0, f32::INFINITY]], 1), Err(SolveError::NotFinite { index: 1, .. })));
        let negative = Pca::fit_weighted(&[&[1.0, 2.0]], &[1.0, -1.0], 1);
        assert!(matches!(negative, Err(SolveError::Negative { index: 1, .. })));
    }
}
