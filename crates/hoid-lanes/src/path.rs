//! The choice of the registers.

use hoid_core::number::Number;
use pulp::{NullaryFnOnce, Scalar, Simd, WithSimd};

use crate::wide::Wide;

/// Which registers are used. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Path {
    /// The widest that this processor has.
    #[default]
    Best,
    /// One number a register, on any processor.
    Scalar,
    /// Four numbers a register, on processors with AVX2.
    Avx2,
    /// Eight numbers a register, on processors with AVX-512.
    Avx512,
}

/// What is done with registers of any width.
pub trait SideBySide {
    /// Its result.
    type Output;
    /// Does it with numbers of the kind of `zero`. To be marked `#[inline(always)]`, as all that it calls at every sample.
    fn run<R: Number>(self, zero: R) -> Self::Output;
}

struct Do<T>(T);

impl<T: SideBySide> WithSimd for Do<T> {
    type Output = T::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> T::Output {
        self.0.run(Wide::splat(simd, 0.0))
    }
}

struct DoWith<T, S>(T, S);

impl<T: SideBySide, S: Simd> NullaryFnOnce for DoWith<T, S> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.0.run(Wide::splat(self.1, 0.0))
    }
}

fn with<T: SideBySide, S: Simd>(simd: S, task: T) -> T::Output {
    simd.vectorize(DoWith(task, simd))
}

struct Alone<T>(T);

impl<T: SideBySide> NullaryFnOnce for Alone<T> {
    type Output = T::Output;

    #[inline(always)]
    fn call(self) -> T::Output {
        self.0.run(0.0)
    }
}

/// One run by itself, with the instructions of AVX2 where this processor has them: they name three registers, and what would be copied
/// before it is overwritten stays where it is. Products and sums are not contracted: the same bits.
pub fn alone<T: SideBySide>(task: T) -> T::Output {
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return simd.vectorize(Alone(task));
    }
    task.run(0.0)
}

impl Path {
    /// All paths that this processor has, [`Path::Best`] among them.
    pub fn available() -> Vec<Self> {
        let all = [Self::Best, Self::Scalar, Self::Avx2, Self::Avx512];
        all.into_iter().filter(|path| path.lanes().is_some()).collect()
    }

    /// Number of runs side by side; `None` when this processor has no such registers.
    pub fn lanes(self) -> Option<usize> {
        self.do_with(Width)
    }

    /// Runs side by side; `None` when this processor has no such registers.
    pub fn do_with<T: SideBySide>(self, task: T) -> Option<T::Output> {
        match self {
            Self::Best => Some(pulp::Arch::new().dispatch(Do(task))),
            Self::Scalar => Some(with(Scalar, task)),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx2 => Some(with(pulp::x86::V3::try_new()?, task)),
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            Self::Avx512 => Some(with(pulp::x86::V4::try_new()?, task)),
            #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
            Self::Avx2 | Self::Avx512 => None,
        }
    }
}

struct Width;

impl SideBySide for Width {
    type Output = usize;

    #[inline(always)]
    fn run<R: Number>(self, zero: R) -> usize {
        zero.lanes()
    }
}
