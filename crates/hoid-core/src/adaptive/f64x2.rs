//! Pair of f64 numbers for one vector register.
//!
//! Common 64-bit processors have vector registers for two f64 numbers; the pair is aligned to the 16 bytes of such a
//! register. Each number of the pair is computed as by a scalar operation, so the results are bit-identical on every
//! machine.

use core::ops::{Add, AddAssign, Div, Mul, Sub, SubAssign};

/// Pair of numbers, aligned to 16 bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(16))]
pub(super) struct F64x2(pub [f64; 2]);

impl crate::state::State for F64x2 {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.0.visit(each);
    }
}

impl F64x2 {
    pub const ZERO: Self = Self::splat(0.0);

    /// Returns a pair that contains the same number twice.
    #[inline(always)]
    pub const fn splat(x: f64) -> Self {
        Self([x; 2])
    }

    #[inline(always)]
    fn zip_with(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self(core::array::from_fn(|i| of(self.0[i], other.0[i])))
    }

    /// Returns the sum of the two numbers.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.0.iter().sum()
    }
}

impl Add for F64x2 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a + b)
    }
}

impl Sub for F64x2 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a - b)
    }
}

impl Mul for F64x2 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a * b)
    }
}

impl Div for F64x2 {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip_with(other, |a, b| a / b)
    }
}

impl AddAssign for F64x2 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for F64x2 {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
