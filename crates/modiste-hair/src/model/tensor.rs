//! Tensor algebra of §3, written out: unfolding, mode products and the N-mode singular value decomposition.
//!
//! The program itself works on the blocks of the data tensor ([`super::blocks`]), which gives the same matrices (see the
//! test there) without the mode of the frames ever being formed.

use modiste_core::{Matrix, thin_svd};

use crate::HairError;

/// An N-way array; the last index runs fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    /// Size of each mode.
    pub shape: Vec<usize>,
    /// The entries.
    pub data: Vec<f64>,
}

/// `D = Z ×₁ U₁ … ×_N U_N` (eq. 17).
#[derive(Debug, Clone)]
pub struct NModeSvd {
    /// The core tensor Z.
    pub core: Tensor,
    /// The mode matrices, each with orthonormal columns.
    pub modes: Vec<Matrix>,
}

impl Tensor {
    /// A tensor of zeros.
    pub fn zeros(shape: &[usize]) -> Self {
        Self { shape: shape.to_vec(), data: vec![0.0; shape.iter().product()] }
    }

    /// Flattening along a mode: its index runs down the rows, the others, in order, along the columns.
    pub fn unfold(&self, mode: usize) -> Matrix {
        let [before, size, after] = self.around(mode);
        Matrix::from_fn(size, before * after, |row, column| {
            self.data[(column / after * size + row) * after + column % after]
        })
    }

    /// Mode product `T ×_mode A`: every fibre of the mode is multiplied by the matrix.
    ///
    /// # Panics
    /// If the matrix has another number of columns than the mode has entries.
    pub fn mode_product(&self, mode: usize, matrix: &Matrix) -> Self {
        let [before, size, after] = self.around(mode);
        assert_eq!(matrix.cols, size, "one column per entry of the mode");
        let mut shape = self.shape.clone();
        shape[mode] = matrix.rows;
        let mut out = Self::zeros(&shape);
        for outer in 0..before {
            for row in 0..matrix.rows {
                for inner in 0..after {
                    out.data[(outer * matrix.rows + row) * after + inner] =
                        (0..size).map(|k| matrix[(row, k)] * self.data[(outer * size + k) * after + inner]).sum();
                }
            }
        }
        out
    }

    /// The N-mode singular value decomposition: each mode matrix is the left singular vectors of its flattening.
    ///
    /// # Errors
    /// A number that is not finite.
    pub fn n_mode_svd(&self) -> Result<NModeSvd, HairError> {
        let mut modes = Vec::with_capacity(self.shape.len());
        let mut core = self.clone();
        for mode in 0..self.shape.len() {
            let svd = thin_svd(&self.unfold(mode)).map_err(HairError::solving("mode matrix of the hair tensor"))?;
            core = core.mode_product(mode, &svd.u.transpose());
            modes.push(svd.u);
        }
        Ok(NModeSvd { core, modes })
    }

    fn around(&self, mode: usize) -> [usize; 3] {
        [self.shape[..mode].iter().product(), self.shape[mode], self.shape[mode + 1..].iter().product()]
    }
}

#[cfg(test)]
mod tests {
    use super::Tensor;
    use modiste_core::{normal, seeded_rng};

    #[test]
    fn core_and_modes_give_the_tensor_back() {
        let mut rng = seeded_rng(4);
        let mut tensor = Tensor::zeros(&[5, 2, 3, 11]);
        tensor.data.fill_with(|| normal(&mut rng));
        let svd = tensor.n_mode_svd().unwrap();
        let mut rebuilt = svd.core.clone();
        for (mode, matrix) in svd.modes.iter().enumerate() {
            rebuilt = rebuilt.mode_product(mode, matrix);
            let gram = matrix.transpose_matmul(matrix);
            for i in 0..gram.rows {
                for j in 0..gram.cols {
                    assert!((gram[(i, j)] - f64::from(u8::from(i == j))).abs() < 1e-10);
                }
            }
        }
        let worst = rebuilt.data.iter().zip(&tensor.data).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-10, "{worst}");
    }
}
