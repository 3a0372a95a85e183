//! Selection of the vector registers, and execution of tasks in them.

use pulp::{NullaryFnOnce, Scalar, Simd, WithSimd};

use crate::{number::Number, registers::TwoRegisters};

/// Vector registers to be used. All choices give bit-identical results.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum InstructionSet {
    /// Widest registers of this processor.
    #[default]
    Best,
    /// One number per register; available on any processor.
    Scalar,
    /// Four numbers per register, on processors with AVX2.
    Avx2,
    /// Eight numbers per register, on processors with AVX-512.
    Avx512,
}

/// Computation that is written once for registers of any width.
pub trait LaneTask {
    /// Result of the computation.
    type Output;
    /// Runs the computation with numbers of the same type as `zero`.
    ///
    /// Mark this function, and all functions that it calls at every sample, as `#[inline(always)]`: a function that is
    /// not inlined is compiled for the narrowest registers.
    fn run<R: Number>(self, zero: R) -> Self::Output;
}

/// Task for [`pulp::Arch`], which selects the registers.
struct DispatchedTask<T>(T);

impl<T: LaneTask> WithSimd for DispatchedTask<T> {
    type Output = T::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> T::Output {
        self.0.run(TwoRegisters::splat(simd, 0.0))
    }
}

/// Task that runs in the registers of `S`.
struct RegisterTask<T, S>(T, S);

impl<T: LaneTask, S: Simd> NullaryFnOnce for RegisterTask<T, S> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.0.run(TwoRegisters::splat(self.1, 0.0))
    }
}

fn run_in_registers<T: LaneTask, S: Simd>(simd: S, task: T) -> T::Output {
    simd.vectorize(RegisterTask(task, simd))
}

/// Task that processes a single run.
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
struct OneLaneTask<T>(T);

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
impl<T: LaneTask> NullaryFnOnce for OneLaneTask<T> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.0.run(0.0)
    }
}

/// Runs a task for a single run, with f64 numbers.
///
/// If this processor has AVX2, the task uses AVX2 instructions. These instructions have three register operands, so an
/// operand need not be copied before it is overwritten. Products and sums are not contracted, so the results are
/// bit-identical.
pub fn with_one_lane<T: LaneTask>(task: T) -> T::Output {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return simd.vectorize(OneLaneTask(task));
    }
    task.run(0.0)
}

impl InstructionSet {
    /// Returns all instruction sets that this processor supports, including [`InstructionSet::Best`].
    pub fn available() -> Vec<Self> {
        let all = [Self::Best, Self::Scalar, Self::Avx2, Self::Avx512];
        all.into_iter().filter(|set| set.lane_count().is_some()).collect()
    }

    /// Returns the number of runs computed at a time; `None` if the processor does not support this instruction set.
    pub fn lane_count(self) -> Option<usize> {
        self.with_lanes(CountLanes)
    }

    /// Runs a task with one run per lane; `None` if the processor does not support this instruction set.
    pub fn with_lanes<T: LaneTask>(self, task: T) -> Option<T::Output> {
        match self {
            Self::Best => Some(pulp::Arch::new().dispatch(DispatchedTask(task))),
            Self::Scalar => Some(run_in_registers(Scalar, task)),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx2 => Some(run_in_registers(pulp::x86::V3::try_new()?, task)),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx512 => Some(run_in_registers(pulp::x86::V4::try_new()?, task)),
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
        zero.lane_count()
    }
}
