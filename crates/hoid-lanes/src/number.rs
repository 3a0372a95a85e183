//! Number type for one run or for several runs in lanes.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// One f64, or several f64 in lanes.
///
/// Code written for a `Number` processes one record with f64, or several records at a time in vector registers. Every
/// operation acts on each lane separately and in the order of the code, so each lane is bit-identical to its run alone;
/// products and sums are never contracted.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Returns a constant in all lanes.
    #[must_use]
    fn splat(self, value: f64) -> Self;
    /// Returns the number of lanes.
    fn lane_count(self) -> usize;
    /// Returns the number in the given lane.
    fn lane(self, lane: usize) -> f64;
    /// Sets the number in the given lane.
    fn set_lane(&mut self, lane: usize, value: f64);
    /// Loads the first numbers of a slice, one for each lane.
    ///
    /// # Panics
    /// If the slice is shorter than the number of lanes.
    #[must_use]
    fn load(self, values: &[f64]) -> Self;
    /// Writes the lanes to the start of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than the number of lanes.
    fn store(self, values: &mut [f64]);
}

impl Number for f64 {
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn lane_count(self) -> usize {
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
