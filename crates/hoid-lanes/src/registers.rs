//! A number in each lane of two registers.
//!
//! Two, because the result of an operation takes several cycles while the next operation can start in each cycle: two
//! independent registers hide the latency of a recursion.

use std::ops::{Add, Div, Mul, Neg, Sub};

use fearless_simd::{Simd, SimdBase};

use crate::number::Number;

/// A number for each of [`TwoRegisters::LANES`] runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TwoRegisters<S: Simd> {
    simd: S,
    registers: [S::f64s; 2],
}

impl<S: Simd> TwoRegisters<S> {
    /// Number of lanes.
    const LANES: usize = 2 * Self::WIDTH;
    /// Number of lanes of one register.
    const WIDTH: usize = S::f64s::LEN;

    /// Returns the same number in all lanes.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self {
            simd,
            registers: [S::f64s::splat(simd, value); 2],
        }
    }
}

macro_rules! operations {
    ($($name:ident, $method:ident);+) => {$(
        impl<S: Simd> $name for TwoRegisters<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let [a, b] = self.registers;
                let [c, d] = other.registers;
                Self {
                    simd: self.simd,
                    registers: [a.$method(c), b.$method(d)],
                }
            }
        }
    )+};
}
operations!(Add, add; Sub, sub; Mul, mul; Div, div);

impl<S: Simd> Neg for TwoRegisters<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let [a, b] = self.registers;
        Self {
            registers: [-a, -b],
            ..self
        }
    }
}

impl<S: Simd> Number for TwoRegisters<S> {
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn lanes(self) -> usize {
        Self::LANES
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        self.registers[lane / Self::WIDTH][lane % Self::WIDTH]
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f64) {
        self.registers[lane / Self::WIDTH][lane % Self::WIDTH] = value;
    }

    #[inline(always)]
    fn load(self, values: &[f64]) -> Self {
        let (first, second) = values[..Self::LANES].split_at(Self::WIDTH);
        Self {
            registers: [first, second].map(|half| S::f64s::from_slice(self.simd, half)),
            ..self
        }
    }

    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        let (first, second) = values[..Self::LANES].split_at_mut(Self::WIDTH);
        self.registers[0].store_slice(first);
        self.registers[1].store_slice(second);
    }
}
