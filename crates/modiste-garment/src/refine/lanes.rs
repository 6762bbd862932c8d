//! Vectors in f32, one to a register of four lanes.

use modiste_core::{Mat3, Vec3};

/// A vector in the four lanes of a register; the last is 0.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(align(16))]
pub(crate) struct Lanes([f32; 4]);

impl Lanes {
    pub(crate) const ZERO: Self = Self([0.0; 4]);

    pub(crate) fn from_vec3(v: Vec3) -> Self {
        Self([v.x as f32, v.y as f32, v.z as f32, 0.0])
    }

    pub(crate) fn to_vec3(self) -> Vec3 {
        let [x, y, z, _] = self.0.map(f64::from);
        Vec3::new(x, y, z)
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| self.0[lane] + other.0[lane]))
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| self.0[lane] - other.0[lane]))
    }

    #[inline(always)]
    pub(crate) fn times(self, factor: f32) -> Self {
        Self(self.0.map(|lane| factor * lane))
    }

    #[inline(always)]
    pub(crate) fn by_lane(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| self.0[lane] * other.0[lane]))
    }

    /// The matrix of these columns times the vector.
    #[inline(always)]
    pub(crate) fn through(self, columns: &[Self; 3]) -> Self {
        let [x, y, z, _] = self.0;
        columns[0].times(x).plus(columns[1].times(y)).plus(columns[2].times(z))
    }
}

/// The columns of a matrix.
pub(crate) fn lanes_of_columns(matrix: Mat3) -> [Lanes; 3] {
    [matrix.x_axis, matrix.y_axis, matrix.z_axis].map(Lanes::from_vec3)
}

/// The dot product of two lists of vectors, summed in blocks so that little is lost of many small terms.
pub(crate) fn dot(a: &[Lanes], b: &[Lanes]) -> f64 {
    let block = |(a, b): (&[Lanes], &[Lanes])| {
        let sum = a.iter().zip(b).fold(Lanes::ZERO, |sum, (a, b)| sum.plus(a.by_lane(*b)));
        f64::from(sum.0[0]) + f64::from(sum.0[1]) + f64::from(sum.0[2])
    };
    a.chunks(64).zip(b.chunks(64)).map(block).sum()
}
