//! A number in each lane of two registers.
//!
//! Two, because an operation on one register takes several cycles to finish but the next can begin in each: with two the waiting time of a
//! recursion is filled.

use std::ops::{Add, Div, Mul, Neg, Sub};

use hoid_core::number::Number;
use pulp::Simd;

/// A number of each of [`Wide::LANES`] runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wide<S: Simd> {
    simd: S,
    registers: [S::f64s; 2],
}

impl<S: Simd> Wide<S> {
    /// Number of lanes.
    pub(crate) const LANES: usize = 2 * S::F64_LANES;

    /// The same number in all lanes.
    #[inline(always)]
    pub(crate) fn splat(simd: S, value: f64) -> Self {
        Self {
            simd,
            registers: [simd.splat_f64s(value); 2],
        }
    }
}

macro_rules! operations {
    ($($name:ident, $method:ident, $of_simd:ident);+) => {$(
        impl<S: Simd> $name for Wide<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let [a, b] = self.registers;
                let [c, d] = other.registers;
                Self {
                    simd: self.simd,
                    registers: [self.simd.$of_simd(a, c), self.simd.$of_simd(b, d)],
                }
            }
        }
    )+};
}
operations!(Add, add, add_f64s; Sub, sub, sub_f64s; Mul, mul, mul_f64s; Div, div, div_f64s);

impl<S: Simd> Neg for Wide<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        let [a, b] = self.registers;
        Self {
            registers: [self.simd.neg_f64s(a), self.simd.neg_f64s(b)],
            ..self
        }
    }
}

impl<S: Simd> Number for Wide<S> {
    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        let [a, b] = self.registers;
        Self {
            registers: [self.simd.abs_f64s(a), self.simd.abs_f64s(b)],
            ..self
        }
    }

    #[inline(always)]
    fn all_below(self, other: Self) -> bool {
        let [a, b] = self.registers;
        let [c, d] = other.registers;
        let both = self
            .simd
            .and_m64s(self.simd.less_than_f64s(a, c), self.simd.less_than_f64s(b, d));
        self.simd.first_true_m64s(self.simd.not_m64s(both)) == S::F64_LANES
    }

    #[inline(always)]
    fn apart(self) -> Self {
        self
    }

    #[inline(always)]
    fn lanes(self) -> usize {
        Self::LANES
    }

    #[inline(always)]
    fn lane(self, lane: usize) -> f64 {
        pulp::bytemuck::cast_slice::<S::f64s, f64>(&self.registers)[lane]
    }

    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f64) {
        pulp::bytemuck::cast_slice_mut::<S::f64s, f64>(&mut self.registers)[lane] = value;
    }

    #[inline(always)]
    fn load(self, values: &[f64]) -> Self {
        let (all, _) = S::as_simd_f64s(&values[..Self::LANES]);
        Self {
            registers: [all[0], all[1]],
            ..self
        }
    }

    #[inline(always)]
    fn store(self, values: &mut [f64]) {
        let (all, _) = S::as_mut_simd_f64s(&mut values[..Self::LANES]);
        [all[0], all[1]] = self.registers;
    }
}
