//! Four numbers in one register or two.
//!
//! A sum over a record is a recursion: each term has to wait for the sum of those before it. Four partial sums, each
//! of every fourth term, are independent of each other. Their number is four for all registers, since it determines
//! the last digits of the sum: with AVX2 they fill one register, elsewhere two. Products and sums are those of each
//! number by itself, without contraction: the same bits in all registers.

use std::ops::{Add, Mul, Sub};

use fearless_simd::{ExtractToken, Fallback, Level, Simd, SimdBase, SimdFrom, f64x4};

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

impl<S: Simd> FourLanes for f64x4<S> {
    #[inline(always)]
    fn splat(self, value: f64) -> Self {
        SimdBase::splat(self.token(), value)
    }

    #[inline(always)]
    fn load(self, values: &[f64; 4]) -> Self {
        Self::simd_from(self.token(), *values)
    }

    #[inline(always)]
    fn to_array(self) -> [f64; 4] {
        *self
    }
}

fn in_registers<T: FourLaneTask, S: Simd>(simd: S, task: T) -> T::Output {
    simd.vectorize(
        #[inline(always)]
        || task.run(f64x4::simd_from(simd, 0.0)),
    )
}

/// Runs a task in registers of AVX2, or returns the task if this processor has none.
fn in_avx2<T: FourLaneTask>(task: T) -> Result<T::Output, T> {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = Level::new().as_avx2() {
        return Ok(in_registers(simd, task));
    }
    Err(task)
}

/// Runs a task in the registers of every processor of the compilation target.
fn in_baseline<T: FourLaneTask>(task: T) -> T::Output {
    let level = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = level.as_sse2() {
        return in_registers(simd, task);
    }
    #[cfg(target_arch = "aarch64")]
    if let Some(simd) = level.as_neon() {
        return in_registers(simd, task);
    }
    let _ = level;
    in_registers(Fallback::new(), task)
}

/// Runs a task on four numbers at a time, in the widest suitable registers of this processor.
pub fn with_four_lanes<T: FourLaneTask>(task: T) -> T::Output {
    in_avx2(task).unwrap_or_else(in_baseline)
}

impl InstructionSet {
    /// Runs a task as [`with_four_lanes`] in these registers; `None` if this processor does not have them.
    ///
    /// Four numbers fill half of a register of AVX-512, so that [`InstructionSet::Avx512`] selects AVX2 here.
    /// [`InstructionSet::Scalar`] selects the registers of a processor without either.
    pub fn with_four_lanes<T: FourLaneTask>(self, task: T) -> Option<T::Output> {
        match self {
            Self::Best => Some(with_four_lanes(task)),
            Self::Scalar => Some(in_baseline(task)),
            Self::Avx2 | Self::Avx512 => in_avx2(task).ok(),
        }
    }
}
