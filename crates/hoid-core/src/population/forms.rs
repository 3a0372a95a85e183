//! A number of each form, side by side.
//!
//! A filter does the same with the numbers of every form, so they stand side by side, and the processor
//! takes two at a time where it can. What is done to one does not depend on what stands beside it: the
//! digits are those of one alone, on every machine.

use core::ops::{Add, AddAssign, Div, Mul, Sub, SubAssign};

use super::sizes::FORMS;

/// A number of each form.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(16))]
pub(super) struct Forms(pub [f64; FORMS]);

impl crate::state::State for Forms {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.0.visit(each);
    }
}

impl Forms {
    pub const ZERO: Self = Self::all(0.0);

    /// The same for all.
    #[inline(always)]
    pub const fn all(x: f64) -> Self {
        Self([x; FORMS])
    }

    #[inline(always)]
    pub fn map(self, of: impl Fn(f64) -> f64) -> Self {
        Self(self.0.map(of))
    }

    #[inline(always)]
    fn with(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        Self(core::array::from_fn(|i| of(self.0[i], other.0[i])))
    }

    /// The larger; the bound where it is not a number.
    #[inline(always)]
    pub fn at_least(self, bound: Self) -> Self {
        self.with(bound, |x, bound| if x > bound { x } else { bound })
    }

    /// The smaller; the bound where it is not a number.
    #[inline(always)]
    pub fn at_most(self, bound: Self) -> Self {
        self.with(bound, |x, bound| if x < bound { x } else { bound })
    }

    /// Of all forms.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.0.iter().sum()
    }
}

impl Add for Forms {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
}

impl Sub for Forms {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
}

impl Mul for Forms {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
}

impl Div for Forms {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b)
    }
}

impl AddAssign for Forms {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Forms {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}
