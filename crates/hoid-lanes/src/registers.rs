//! Numbers in the lanes of two registers, one number in each lane.
//!
//! Two registers are used because the result of an operation takes several cycles, while another operation can start in
//! each cycle: two independent registers hide the latency of a recursion.

use std::ops::{Add, Div, Mul, Neg, Sub};

use pulp::Simd;

use crate::number::Number;

/// One number for each of [`TwoRegisters::LANES`] runs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TwoRegisters<S: Simd> {
    simd: S,
    registers: [S::f64s; 2],
}

impl<S: Simd> TwoRegisters<S> {
    /// Number of lanes in both registers.
    const LANES: usize = 2 * S::F64_LANES;

    /// Returns the same number in all lanes.
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
        impl<S: Simd> $name for TwoRegisters<S> {
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

impl<S: Simd> Neg for TwoRegisters<S> {
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

impl<S: Simd> Number for TwoRegisters<S> {
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn lane_count(self) -> usize {
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
