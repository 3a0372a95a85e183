//! A number, or one number of each of several runs.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// An f64, or several in lanes.
///
/// Code that is written over a `Number` runs for one record with f64 and for several at a time in
/// vector registers. Every operation acts on each lane alone and in the order of the code, so that
/// a lane has the bits of its run alone; products and sums are never contracted.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A constant, in all lanes.
    #[must_use]
    fn splat(self, value: f64) -> Self;
    /// Number of lanes.
    fn lanes(self) -> usize;
    /// The number in a lane.
    fn lane(self, lane: usize) -> f64;
    /// Puts a number into a lane.
    fn set_lane(&mut self, lane: usize, value: f64);
    /// The first numbers of a slice, one for each lane.
    ///
    /// # Panics
    /// If the slice is shorter than the lanes.
    #[must_use]
    fn load(self, values: &[f64]) -> Self;
    /// Puts the lanes into the first places of a slice.
    ///
    /// # Panics
    /// If the slice is shorter than the lanes.
    fn store(self, values: &mut [f64]);
}

impl Number for f64 {
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        value
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
