//! Vectors in the lanes of a register, and the registers that the machine has.

use std::ops::{AddAssign, Mul, Sub, SubAssign};

use crate::Vec3;

/// A vector in the four lanes of a register; the last is 0.
///
/// Three numbers side by side do not fill one, and the compiler then takes two lanes and one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(align(32))]
pub struct Lanes([f64; 4]);

impl Lanes {
    /// The vector without its last lane.
    #[inline(always)]
    pub fn to_vec3(self) -> Vec3 {
        let [x, y, z, _] = self.0;
        Vec3::new(x, y, z)
    }
}

impl From<Vec3> for Lanes {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        Self([v.x, v.y, v.z, 0.0])
    }
}

impl Sub for Lanes {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|lane| self.0[lane] - other.0[lane]))
    }
}

impl Mul<f64> for Lanes {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|lane| lane * factor))
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = Self(std::array::from_fn(|lane| self.0[lane] + other.0[lane]));
    }
}

impl SubAssign for Lanes {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

/// What is to run with the widest registers. A type of its own rather than a closure, as [`call`](Kernel::call) can be told to be
/// inlined: only what is inlined is compiled for them.
pub(crate) use pulp::NullaryFnOnce as Kernel;

/// Runs a kernel with the widest registers that the machine has.
///
/// No operation is fused or reordered for it: the result is the same on every machine.
#[inline(always)]
pub(crate) fn with_widest_registers<K: Kernel>(kernel: K) -> K::Output {
    pulp::Arch::new().dispatch(kernel)
}

#[cfg(test)]
mod tests {
    use super::Lanes;
    use crate::Vec3;

    #[test]
    fn lanes_do_what_vectors_do() {
        let (a, b) = (Vec3::new(1.0, -2.0, 3.5), Vec3::new(0.25, 4.0, -1.0));
        let (wide, other) = (Lanes::from(a), Lanes::from(b));
        assert_eq!((wide - other * 3.0).to_vec3(), a - b * 3.0);
        let mut sum = wide;
        sum += other;
        assert_eq!(sum.to_vec3(), a + b);
        sum -= wide;
        assert_eq!(sum.to_vec3(), b);
    }
}
