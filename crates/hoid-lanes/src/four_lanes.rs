//! Four numbers in one register or two.
//!
//! A sum over a record is a recursion: each term has to wait for the sum of those before it. Four partial sums, each
//! of every fourth term, are independent of each other. Their number is four for all registers, since it determines
//! the last digits of the sum: with AVX2 they fill one register, elsewhere two. Products and sums are those of each
//! number by itself, without contraction: the same bits in all registers.

use std::ops::{Add, Mul, Sub};

use crate::instruction_set::InstructionSet;

/// Four numbers with lane-wise operations.
pub trait FourLanes: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Returns the same number in all four lanes.
    fn splat(self, value: f64) -> Self;
    /// Returns these numbers.
    fn load(self, values: &[f64; 4]) -> Self;
    /// Returns the four numbers as an array.
    fn to_array(self) -> [f64; 4];
}

/// A computation on four numbers at a time.
pub trait FourLaneTask {
    /// Its result.
    type Output;
    /// Runs the computation, with numbers of the type of `zero`.
    ///
    /// Mark it `#[inline(always)]`, and all functions that it calls at every sample.
    fn run<F: FourLanes>(self, zero: F) -> Self::Output;
}

/// The registers of every processor of the compilation target.
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

    /// Four numbers in a register of AVX2.
    #[derive(Debug, Clone, Copy)]
    pub(super) struct Register {
        simd: V3,
        numbers: f64x4,
    }

    macro_rules! operations {
        ($($name:ident, $method:ident, $of_simd:ident);+) => {$(
            impl $name for Register {
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

    impl FourLanes for Register {
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

    /// The task in registers of AVX2.
    pub(super) struct InAvx2<T>(pub V3, pub T);

    impl<T: FourLaneTask> NullaryFnOnce for InAvx2<T> {
        type Output = T::Output;

        #[inline(always)]
        fn call(self) -> T::Output {
            let Self(simd, task) = self;
            let numbers = simd.splat_f64s(0.0);
            task.run(Register { simd, numbers })
        }
    }
}

/// Runs a task in registers of AVX2, or returns the task if this processor has none.
fn in_avx2<T: FourLaneTask>(task: T) -> Result<T::Output, T> {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return Ok(simd.vectorize(avx2::InAvx2(simd, task)));
    }
    Err(task)
}

/// Runs a task on four numbers at a time, in the widest suitable registers of this processor.
pub fn with_four_lanes<T: FourLaneTask>(task: T) -> T::Output {
    in_avx2(task).unwrap_or_else(|task| task.run(wide::f64x4::ZERO))
}

impl InstructionSet {
    /// Runs a task as [`with_four_lanes`] in these registers; `None` if this processor does not have them.
    ///
    /// Four numbers fill half of a register of AVX-512, so that [`InstructionSet::Avx512`] selects AVX2 here.
    /// [`InstructionSet::Scalar`] selects the registers of a processor without either.
    pub fn with_four_lanes<T: FourLaneTask>(self, task: T) -> Option<T::Output> {
        match self {
            Self::Best => Some(with_four_lanes(task)),
            Self::Scalar => Some(task.run(wide::f64x4::ZERO)),
            Self::Avx2 | Self::Avx512 => in_avx2(task).ok(),
        }
    }
}
