//! One number, or the same number of several runs side by side.
//!
//! A recursion waits for its own last sample, so that one run leaves a processor mostly idle; runs side by side, each in a lane of a vector
//! register, do not. The filters and the covariance are written once for both: every operation acts on each lane alone and in the order
//! of the code, so that a lane has the bits of the run alone. Products and sums are never contracted.

use core::ops::{Add, Div, Mul, Neg, Sub};

/// An f64, or several in lanes.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant, in all lanes.
    #[must_use]
    fn like(self, value: f64) -> Self;
    /// The absolute value.
    #[must_use]
    fn abs(self) -> Self;
    /// True when this is below the other in all lanes; false where one is not a number.
    fn all_below(self, other: Self) -> bool;
    /// The number as it is, to be read from memory by itself.
    #[must_use]
    fn apart(self) -> Self;
    /// Number of lanes.
    fn lanes(self) -> usize;
    /// The number in a lane.
    fn lane(self, lane: usize) -> f64;
    /// Puts a number into a lane.
    fn set_lane(&mut self, lane: usize, value: f64);
    /// The first numbers of a slice, one for each lane; the slice has as many.
    #[must_use]
    fn load(self, values: &[f64]) -> Self;
    /// Puts the lanes into the first places of a slice, which has as many.
    fn store(self, values: &mut [f64]);
}

impl Number for f64 {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline(always)]
    fn all_below(self, other: Self) -> bool {
        self < other
    }

    /// One wide load of what was stored narrowly just before would wait until all before it has reached the memory, and no two samples
    /// could overlap. The compiler likes to make such loads.
    #[inline(always)]
    fn apart(self) -> Self {
        core::hint::black_box(self)
    }

    #[inline(always)]
    fn lanes(self) -> usize {
        1
    }

    #[inline(always)]
    fn lane(self, _lane: usize) -> f64 {
        self
    }

    #[inline(always)]
    fn set_lane(&mut self, _lane: usize, value: f64) {
        *self = value;
    }

    #[inline(always)]
    fn load(self, values: &[f64]) -> Self {
        values[0]
    }

    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        values[0] = self;
    }
}
