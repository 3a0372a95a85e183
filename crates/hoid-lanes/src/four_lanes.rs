//! Four numbers in one or two registers.
//!
//! A sum over a record is a recursion: each term must wait for the sum of the preceding terms. Four partial sums, each
//! over every fourth term, are independent of each other. The number of partial sums is four for all registers, because
//! it determines the last digits of the sum. With AVX2 four numbers fill one register; without it they fill two.
//! Products and sums act on each number separately, without contraction, so all registers give bit-identical results.

use std::ops::{Add, Mul, Sub};

use crate::instruction_set::InstructionSet;

/// Four numbers, with operations that act on each of them separately.
pub trait FourLanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Returns the same number in all four lanes.
    fn splat(self, value: f64) -> Self;
    /// Loads four numbers from an array.
    fn load(self, values: &[f64; 4]) -> Self;
    /// Returns the four numbers as an array.
    fn to_array(self) -> [f64; 4];
}

/// Computation on four numbers at a time.
pub trait FourLaneTask {
    /// Result of the computation.
    type Output;
    /// Runs the computation with numbers of the same type as `zero`.
    ///
    /// Mark this function, and all functions that it calls at every sample, as `#[inline(always)]`.
    fn run<F: FourLanes>(self, zero: F) -> Self::Output;
}

/// Four numbers in the registers that every processor of the compilation target has.
impl FourLanes for wide::f64x4 {
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn load(self, values: &[f64; 4]) -> Self {
        Self::new(*values)
    }

    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        self.to_array()
    }
}

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
mod avx2 {
    use std::ops::{Add, Mul, Sub};

    use pulp::{NullaryFnOnce, Simd, bytemuck, f64x4, x86::V3};

    use super::{FourLaneTask, FourLanes};

    /// Four numbers in an AVX2 register.
    #[derive(Debug, Clone, Copy)]
    pub(super) struct Avx2Register {
        simd: V3,
        numbers: f64x4,
    }

    macro_rules! operations {
        ($($name:ident, $method:ident, $of_simd:ident);+) => {$(
            impl $name for Avx2Register {
                type Output = Self;

                #[inline(always)]
                fn $method(self, other: Self) -> Self {
                    let numbers = self.simd.$of_simd(self.numbers, other.numbers);
                    Self { numbers, ..self }
                }
            }
        )+};
    }
    operations!(Add, add, add_f64s; Sub, sub, sub_f64s; Mul, mul, mul_f64s);

    impl FourLanes for Avx2Register {
        #[inline(always)]
        fn splat(self, value: f64) -> Self {
            let numbers = self.simd.splat_f64s(value);
            Self { numbers, ..self }
        }

        #[inline(always)]
        fn load(self, values: &[f64; 4]) -> Self {
            let numbers = bytemuck::cast(*values);
            Self { numbers, ..self }
        }

        #[inline(always)]
        fn to_array(self) -> [f64; 4] {
            bytemuck::cast(self.numbers)
        }
    }

    /// Task that runs in AVX2 registers.
    pub(super) struct Avx2Task<T>(pub V3, pub T);

    impl<T: FourLaneTask> NullaryFnOnce for Avx2Task<T> {
        type Output = T::Output;

        #[inline(always)]
        fn call(self) -> T::Output {
            let Self(simd, task) = self;
            let numbers = simd.splat_f64s(0.0);
            task.run(Avx2Register { simd, numbers })
        }
    }
}

/// Runs a task in AVX2 registers, or returns the task if this processor has none.
fn run_in_avx2<T: FourLaneTask>(task: T) -> Result<T::Output, T> {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return Ok(simd.vectorize(avx2::Avx2Task(simd, task)));
    }
    Err(task)
}

/// Runs a task on four numbers at a time, in the widest suitable registers of this processor.
pub fn with_four_lanes<T: FourLaneTask>(task: T) -> T::Output {
    run_in_avx2(task).unwrap_or_else(|task| task.run(wide::f64x4::ZERO))
}

impl InstructionSet {
    /// Runs a task like [`with_four_lanes`], but in the registers of this instruction set; `None` if the processor does
    /// not have them.
    ///
    /// Four numbers fill only half of an AVX-512 register, so [`InstructionSet::Avx512`] selects AVX2 here.
    /// [`InstructionSet::Scalar`] selects the registers of a processor with neither AVX2 nor AVX-512.
    pub fn with_four_lanes<T: FourLaneTask>(self, task: T) -> Option<T::Output> {
        match self {
            Self::Best => Some(with_four_lanes(task)),
            Self::Scalar => Some(task.run(wide::f64x4::ZERO)),
            Self::Avx2 | Self::Avx512 => run_in_avx2(task).ok(),
        }
    }
}
