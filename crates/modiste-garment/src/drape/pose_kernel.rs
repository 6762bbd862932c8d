//! Nearness of a pose to typical poses, as inputs of the wrinkle regression.

use modiste_core::{Matrix, symmetric_eigen};

use crate::GarmentError;

/// Share of the median squared distance between training poses that a kernel reaches (twice its squared width).
const REACH: f64 = 1.0;

/// Eigenvalues of the kernel among the centres below this are noise.
const SMALLEST_EIGENVALUE: f64 = 1e-6;

/// Pairs of poses that the median distance is taken over, about.
const PAIRS: usize = 200;

/// A Gaussian kernel on θ_c with a few training poses as centres (Nyström's approximation; Williams and Seeger 2001).
///
/// `φ(θ) = K_CC^(-1/2) k(θ, C)` with `k(a, b) = exp(-|a - b|² / reach)`. Ridge regression on φ is kernel ridge regression:
/// near a typical pose it can say what cloth does there, which no linear function of the pose can. Not in the paper.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseKernel {
    /// One θ_c per row.
    centres: Matrix,
    reach: f64,
    whitening: Matrix,
}

impl PoseKernel {
    /// Chooses `count` centres that lie far from each other among the poses: the first, then always the farthest.
    ///
    /// # Errors
    /// No poses, or an eigenvalue iteration that does not converge.
    pub fn choose(poses: &[Vec<f64>], count: usize) -> Result<Self, GarmentError> {
        let Some(first) = poses.first() else {
            return Err(GarmentError::data("poses of the training set", "at least one", "none"));
        };
        let mut chosen = vec![0];
        let mut distances: Vec<f64> = poses.iter().map(|pose| squared_distance(pose, first)).collect();
        while chosen.len() < count {
            let farthest = (1..poses.len()).fold(0, |far, i| if distances[i] > distances[far] { i } else { far });
            if !(distances[farthest] > 0.0) {
                break;
            }
            chosen.push(farthest);
            for (distance, pose) in distances.iter_mut().zip(poses) {
                *distance = distance.min(squared_distance(pose, &poses[farthest]));
            }
        }
        let median = median_squared_distance(poses);
        let rows: Vec<&[f64]> = chosen.iter().map(|&index| poses[index].as_slice()).collect();
        // Poses that are all alike leave no distance to measure by; then one centre is all there is.
        Self::new(Matrix::from_rows(&rows), if median > 0.0 { REACH * median } else { 1.0 })
    }

    /// A kernel with given centres, one θ_c per row, as read from a file.
    ///
    /// # Errors
    /// An eigenvalue iteration that does not converge.
    pub(crate) fn new(centres: Matrix, reach: f64) -> Result<Self, GarmentError> {
        let count = centres.rows;
        let kernel = Matrix::from_fn(count, count, |i, j| near(centres.row(i), centres.row(j), reach));
        let (values, vectors) = symmetric_eigen(&kernel).map_err(GarmentError::solve("kernel of the poses"))?;
        let roots: Vec<f64> = values.iter().map(|value| value.max(SMALLEST_EIGENVALUE).powf(-0.5)).collect();
        let scaled = Matrix::from_fn(count, count, |i, k| vectors[(i, k)] * roots[k]);
        Ok(Self { whitening: scaled.matmul(&vectors.transpose()), centres, reach })
    }

    /// Number of centres.
    pub fn count(&self) -> usize {
        self.centres.rows
    }

    /// The centres, one θ_c per row.
    pub(crate) fn centres(&self) -> &Matrix {
        &self.centres
    }

    /// Squared distance at which a centre's say has fallen to 1/e.
    pub(crate) fn reach(&self) -> f64 {
        self.reach
    }

    /// Writes φ of a pose.
    pub(crate) fn features(&self, pose: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (centre, weights) in (0..self.count()).map(|i| (self.centres.row(i), self.whitening.row(i))) {
            let nearness = near(pose, centre, self.reach);
            for (out, weight) in out.iter_mut().zip(weights) {
                *out += nearness * weight;
            }
        }
    }
}

/// The median squared distance between some of the poses, evenly spread.
pub(crate) fn median_squared_distance<R: AsRef<[f64]>>(poses: &[R]) -> f64 {
    let stride = poses.len().div_ceil(PAIRS).max(1);
    let some = || poses.iter().step_by(stride).map(AsRef::as_ref);
    let mut between: Vec<f64> =
        some().enumerate().flat_map(|(i, a)| some().take(i).map(|b| squared_distance(a, b))).collect();
    between.sort_by(f64::total_cmp);
    between.get(between.len() / 2).copied().unwrap_or(0.0)
}

/// The kernel: 1 where `a` is `b`, 1/e at a squared distance of `reach`.
pub(crate) fn near(a: &[f64], b: &[f64], reach: f64) -> f64 {
    (-squared_distance(a, b) / reach).exp()
}

pub(crate) fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

#[cfg(test)]
mod tests {
    use super::PoseKernel;

    fn poses() -> Vec<Vec<f64>> {
        (0..50).map(|i| vec![(0.37 * f64::from(i)).sin(), (0.23 * f64::from(i)).cos()]).collect()
    }

    #[test]
    fn inner_products_of_features_are_the_kernel_at_the_centres() {
        let kernel = PoseKernel::choose(&poses(), 12).unwrap();
        assert_eq!(kernel.count(), 12);
        let features = |pose: &[f64]| {
            let mut out = vec![0.0; 12];
            kernel.features(pose, &mut out);
            out
        };
        let (a, b) = (kernel.centres().row(3).to_vec(), kernel.centres().row(8).to_vec());
        let product: f64 = features(&a).iter().zip(features(&b)).map(|(a, b)| a * b).sum();
        assert!((product - super::near(&a, &b, kernel.reach())).abs() < 1e-3, "{product}");
        let own: f64 = features(&a).iter().map(|a| a * a).sum();
        assert!((own - 1.0).abs() < 1e-3, "{own}");
    }

    #[test]
    fn equal_poses_give_one_centre_and_no_poses_are_refused() {
        let same = vec![vec![0.5, 0.5]; 20];
        assert_eq!(PoseKernel::choose(&same, 8).unwrap().count(), 1);
        assert!(PoseKernel::choose(&[], 8).is_err());
    }
}
