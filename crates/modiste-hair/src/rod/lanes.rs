//! Eight numbers side by side, one per guide of a block: what the compiler turns into vector instructions.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

use modiste_core::Vec3;

/// Guides of a block.
pub(super) const LANES: usize = 8;

/// One number per guide.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Lane(pub [f32; LANES]);

/// One vector per guide.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Lane3 {
    pub x: Lane,
    pub y: Lane,
    pub z: Lane,
}

impl Lane {
    #[inline(always)]
    pub(super) fn splat(value: f32) -> Self {
        Self([value; LANES])
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = [0.0; LANES];
        for i in 0..LANES {
            out[i] = f(self.0[i], other.0[i]);
        }
        Self(out)
    }

    #[inline(always)]
    pub(super) fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let mut out = [0.0; LANES];
        for i in 0..LANES {
            out[i] = f(self.0[i]);
        }
        Self(out)
    }

    #[inline(always)]
    pub(super) fn recip(self) -> Self {
        self.map(|value| 1.0 / value)
    }

    #[inline(always)]
    pub(super) fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    #[inline(always)]
    pub(super) fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
}

macro_rules! lane_operator {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Lane {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $operator b)
            }
        }
    };
}

lane_operator!(Add, add, +);
lane_operator!(Sub, sub, -);
lane_operator!(Mul, mul, *);

impl Neg for Lane {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|value| -value)
    }
}

impl AddAssign for Lane {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Lane3 {
    #[inline(always)]
    pub(super) fn splat(value: Vec3) -> Self {
        Self { x: Lane::splat(value.x as f32), y: Lane::splat(value.y as f32), z: Lane::splat(value.z as f32) }
    }

    #[inline(always)]
    pub(super) fn dot(self, other: Self) -> Lane {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub(super) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    #[inline(always)]
    pub(super) fn length(self) -> Lane {
        self.dot(self).map(f32::sqrt)
    }

    pub(super) fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(f64::from(self.x.0[lane]), f64::from(self.y.0[lane]), f64::from(self.z.0[lane]))
    }

    pub(super) fn set(&mut self, lane: usize, value: Vec3) {
        self.x.0[lane] = value.x as f32;
        self.y.0[lane] = value.y as f32;
        self.z.0[lane] = value.z as f32;
    }
}

impl Add for Lane3 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }
}

impl Sub for Lane3 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }
}

impl Mul<Lane> for Lane3 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: Lane) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
}

impl AddAssign for Lane3 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Lane3 {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
