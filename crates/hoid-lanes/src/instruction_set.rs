//! Choice of the vector registers, and tasks that run in them.

use fearless_simd::{Fallback, Level, Simd};

use crate::{number::Number, registers::TwoRegisters};

/// The vector registers in use. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InstructionSet {
    /// The widest registers of this processor.
    #[default]
    Best,
    /// Plain numbers in place of registers, two each, on any processor.
    Scalar,
    /// Four numbers per register, on processors with AVX2.
    Avx2,
    /// Eight numbers per register, on processors with the AVX-512 of Ice Lake and later.
    Avx512,
}

/// A computation that is written once for registers of any width.
pub trait LaneTask {
    /// Its result.
    type Output;
    /// Runs the computation, with numbers of the type of `zero`.
    ///
    /// Mark it `#[inline(always)]`, and all functions that it calls at every sample: a separate function is compiled
    /// for the narrowest registers.
    fn run<R: Number>(self, zero: R) -> Self::Output;
}

/// Runs a task with one run per lane of the registers of `S`.
fn in_registers<T: LaneTask, S: Simd>(simd: S, task: T) -> T::Output {
    simd.vectorize(
        #[inline(always)]
        || task.run(TwoRegisters::splat(simd, 0.0)),
    )
}

/// Runs a task in the widest registers of this processor.
fn in_widest<T: LaneTask>(task: T) -> T::Output {
    let level = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = level.as_avx512() {
        return in_registers(simd, task);
    } else if let Some(simd) = level.as_avx2() {
        return in_registers(simd, task);
    }
    #[cfg(target_arch = "aarch64")]
    if let Some(simd) = level.as_neon() {
        return in_registers(simd, task);
    }
    let _ = level;
    in_registers(Fallback::new(), task)
}

/// Runs a task for one run, with f64 numbers.
///
/// It is compiled with the instructions of AVX2 if this processor has them. They name three registers, so that an
/// operand need not be copied before it is overwritten. Products and sums are not contracted: the bits are the same.
pub fn with_one_lane<T: LaneTask>(task: T) -> T::Output {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = Level::new().as_avx2() {
        return simd.vectorize(
            #[inline(always)]
            || task.run(0.0),
        );
    }
    task.run(0.0)
}

impl InstructionSet {
    /// Returns all instruction sets of this processor, including [`InstructionSet::Best`].
    pub fn available() -> Vec<Self> {
        let all = [Self::Best, Self::Scalar, Self::Avx2, Self::Avx512];
        all.into_iter().filter(|set| set.lanes().is_some()).collect()
    }

    /// Returns the number of runs at a time; `None` if this processor does not have these registers.
    pub fn lanes(self) -> Option<usize> {
        self.with_lanes(CountLanes)
    }

    /// Runs a task with one run per lane; `None` if this processor does not have these registers.
    pub fn with_lanes<T: LaneTask>(self, task: T) -> Option<T::Output> {
        match self {
            Self::Best => Some(in_widest(task)),
            Self::Scalar => Some(in_registers(Fallback::new(), task)),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx2 => Some(in_registers(Level::new().as_avx2()?, task)),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx512 => Some(in_registers(Level::new().as_avx512()?, task)),
            #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
            Self::Avx2 | Self::Avx512 => None,
        }
    }
}

struct CountLanes;

impl LaneTask for CountLanes {
    type Output = usize;

    #[inline(always)]
    fn run<R: Number>(self, zero: R) -> usize {
        zero.lanes()
    }
}
