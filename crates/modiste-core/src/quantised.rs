//! Bases stored as small integers.

use crate::SolveError;
use crate::error::check_size;
use crate::lanes::{Kernel, with_widest_registers};

/// Numbers of the result that stay in the nearest cache while the components pass by.
const BLOCK: usize = 4096;

/// An integer that a basis may be stored in.
pub trait Step: Copy + Into<f32> {
    /// The largest magnitude that is used.
    const LARGEST: f32;

    /// The integer nearest to a number of at most [`LARGEST`](Self::LARGEST).
    fn nearest(value: f32) -> Self;
}

impl Step for i16 {
    const LARGEST: f32 = 32767.0;

    fn nearest(value: f32) -> Self {
        value.round() as Self
    }
}

impl Step for i8 {
    const LARGEST: f32 = 127.0;

    fn nearest(value: f32) -> Self {
        value.round() as Self
    }
}

/// Rows of integers with one scale per row: a half (i16) or a quarter (i8) of the memory, and so of the time, of f32.
///
/// A component is `scale * integers`; the largest magnitude of a row becomes the largest integer, so the error of an entry
/// is at most half of `scale`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct QuantisedBasis<T = i16> {
    dimensions: usize,
    scales: Vec<f32>,
    values: Vec<T>,
}

impl<T: Step> QuantisedBasis<T> {
    /// Quantises `k` rows of `n` numbers.
    ///
    /// # Errors
    /// A basis of another size, or a number that is not finite.
    pub fn from_f32(basis: &[f32], k: usize, n: usize) -> Result<Self, SolveError> {
        check_size("numbers of the basis", k * n, basis.len())?;
        if let Some(index) = basis.iter().position(|value| !value.is_finite()) {
            return Err(SolveError::NotFinite { what: "the basis", index });
        }
        let mut scales = Vec::with_capacity(k);
        let mut values = Vec::with_capacity(k * n);
        for row in 0..k {
            let row = &basis[row * n..(row + 1) * n];
            let largest = row.iter().fold(0.0f32, |largest, value| largest.max(value.abs()));
            let scale = if largest > 0.0 { largest / T::LARGEST } else { 1.0 };
            scales.push(scale);
            values.extend(row.iter().map(|value| T::nearest(value / scale)));
        }
        Ok(Self { dimensions: n, scales, values })
    }

    /// A basis as it was stored: one scale per row, then the rows.
    ///
    /// # Errors
    /// Sizes that do not agree, or a scale that is not finite.
    pub fn from_parts(scales: Vec<f32>, values: Vec<T>, n: usize) -> Result<Self, SolveError> {
        check_size("integers of the basis", scales.len() * n, values.len())?;
        if let Some(index) = scales.iter().position(|scale| !scale.is_finite()) {
            return Err(SolveError::NotFinite { what: "the scales of the basis", index });
        }
        Ok(Self { dimensions: n, scales, values })
    }

    /// Number of components.
    pub fn count(&self) -> usize {
        self.scales.len()
    }

    /// Numbers per component.
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// The scale of each component.
    pub fn scales(&self) -> &[f32] {
        &self.scales
    }

    /// The integers, component after component.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// The components as f32, k rows of n.
    pub fn to_f32(&self) -> Vec<f32> {
        let rows = self.scales.iter().zip(self.values.chunks(self.dimensions.max(1)));
        rows.flat_map(|(&scale, row)| row.iter().map(move |&value| scale * number(value))).collect()
    }

    /// A basis whose components are made from those of this one, one after the other.
    ///
    /// # Errors
    /// Components of another size than the first, or a number that is not finite.
    pub fn map(&self, new: impl Fn(&[f32]) -> Vec<f32>) -> Result<Self, SolveError> {
        let mut made = Self { dimensions: 0, scales: Vec::new(), values: Vec::new() };
        for (&scale, row) in self.scales.iter().zip(self.values.chunks(self.dimensions.max(1))) {
            let row: Vec<f32> = row.iter().map(|&value| scale * number(value)).collect();
            let row = new(&row);
            let width = if made.scales.is_empty() { row.len() } else { made.dimensions };
            check_size("numbers of a component", width, row.len())?;
            let one = Self::from_f32(&row, 1, width)?;
            made.dimensions = width;
            made.scales.extend(one.scales);
            made.values.extend(one.values);
        }
        Ok(made)
    }

    /// Writes `mean + sum_k c_k basis_k`; missing coefficients are 0, further ones are ignored.
    ///
    /// # Panics
    /// If `mean` or `out` has another number of dimensions.
    pub fn expand(&self, mean: &[f32], coefficients: &[f64], out: &mut [f32]) {
        let n = self.dimensions;
        assert_eq!(mean.len(), n, "one number of the mean per dimension");
        assert_eq!(out.len(), n, "one number per dimension");
        with_widest_registers(Sum { basis: self, mean, coefficients, out });
    }
}

/// See [`QuantisedBasis::expand`].
struct Sum<'a, T> {
    basis: &'a QuantisedBasis<T>,
    mean: &'a [f32],
    coefficients: &'a [f64],
    out: &'a mut [f32],
}

impl<T: Step> Kernel for Sum<'_, T> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { basis, mean, coefficients, out } = self;
        let n = basis.dimensions;
        // A list of factors would have to be allocated, so they are made again for every block.
        let count = coefficients.len().min(basis.scales.len());
        let factor = |k: usize| (coefficients[k] * f64::from(basis.scales[k])) as f32;
        for (block, (out, mean)) in out.chunks_mut(BLOCK).zip(mean.chunks(BLOCK)).enumerate() {
            out.copy_from_slice(mean);
            let length = out.len();
            let row = |k: usize| &basis.values[k * n + block * BLOCK..][..length];
            // Four components at a time read and write the result once.
            let mut k = 0;
            while k + 4 <= count {
                let f = [k, k + 1, k + 2, k + 3].map(factor);
                let (a, b, c, d) = (row(k), row(k + 1), row(k + 2), row(k + 3));
                for i in 0..length {
                    out[i] += (f[0] * number(a[i]) + f[1] * number(b[i])) + (f[2] * number(c[i]) + f[3] * number(d[i]));
                }
                k += 4;
            }
            for k in k..count {
                let factor = factor(k);
                for (value, &b) in out.iter_mut().zip(row(k)) {
                    *value += factor * number(b);
                }
            }
        }
    }
}

#[inline(always)]
fn number(value: impl Step) -> f32 {
    value.into()
}

#[cfg(test)]
mod tests {
    use super::QuantisedBasis;
    use crate::{SolveError, normal, seeded_rng};

    #[test]
    fn entries_are_off_by_at_most_half_a_step() {
        let mut rng = seeded_rng(1);
        let (k, n) = (4, 5000);
        let basis: Vec<f32> =
            (0..k * n).map(|i| (normal(&mut rng) * 10f64.powi((i / n) as i32 * 4 - 8)) as f32).collect();
        let quantised = QuantisedBasis::<i16>::from_f32(&basis, k, n).unwrap();
        for (i, (restored, original)) in quantised.to_f32().iter().zip(&basis).enumerate() {
            assert!((restored - original).abs() <= 0.502 * quantised.scales()[i / n]);
        }
        let coarse = QuantisedBasis::<i8>::from_f32(&basis, k, n).unwrap();
        for (i, (restored, original)) in coarse.to_f32().iter().zip(&basis).enumerate() {
            assert!((restored - original).abs() <= 0.502 * coarse.scales()[i / n]);
            assert!(coarse.scales()[i / n] > 200.0 * quantised.scales()[i / n]);
        }
    }

    #[test]
    fn components_are_mapped_one_by_one() {
        let basis = QuantisedBasis::<i8>::from_f32(&[1.0, -2.0, 0.5, 0.25], 2, 2).unwrap();
        let doubled = basis.map(|row| row.iter().flat_map(|value| [*value, 2.0 * value]).collect()).unwrap();
        assert_eq!((doubled.count(), doubled.dimensions()), (2, 4));
        for (found, wanted) in doubled.to_f32().iter().zip([1.0, 2.0, -2.0, -4.0, 0.5, 1.0, 0.25, 0.5]) {
            assert!((found - wanted).abs() < 0.04, "{found} {wanted}");
        }
        assert!(basis.map(|row| vec![0.0; if row[0] > 0.9 { 1 } else { 2 }]).is_err());
    }

    #[test]
    fn expansion_agrees_with_the_plain_sum() {
        let mut rng = seeded_rng(2);
        // More than one block, and not a whole number of them.
        let (k, n) = (7, 10_001);
        let basis: Vec<f32> = (0..k * n).map(|_| normal(&mut rng) as f32).collect();
        let mean: Vec<f32> = (0..n).map(|_| normal(&mut rng) as f32).collect();
        let quantised = QuantisedBasis::<i16>::from_f32(&basis, k, n).unwrap();
        let restored = quantised.to_f32();
        for count in [0, 1, 3, 7, 9] {
            let coefficients: Vec<f64> = (0..count).map(|_| normal(&mut rng)).collect();
            let mut out = vec![0.0; n];
            quantised.expand(&mean, &coefficients, &mut out);
            for i in 0..n {
                let terms = coefficients.iter().take(k).enumerate();
                let sum: f64 = terms.map(|(row, c)| c * f64::from(restored[row * n + i])).sum();
                assert!((f64::from(out[i]) - f64::from(mean[i]) - sum).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn stored_parts_come_back_and_bad_ones_are_refused() {
        let basis = QuantisedBasis::<i16>::from_f32(&[1.0, -2.0, 0.0, 0.0], 2, 2).unwrap();
        let (scales, values) = (basis.scales().to_vec(), basis.values().to_vec());
        assert_eq!(values, [16384, -32767, 0, 0]);
        assert_eq!(QuantisedBasis::from_parts(scales.clone(), values.clone(), 2), Ok(basis));
        assert!(matches!(
            QuantisedBasis::from_parts(scales, values, 3),
            Err(SolveError::Size { wanted: 6, found: 4, .. })
        ));
        assert!(matches!(QuantisedBasis::<i8>::from_f32(&[f32::NAN], 1, 1), Err(SolveError::NotFinite { .. })));
    }
}
