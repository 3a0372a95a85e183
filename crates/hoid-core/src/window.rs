//! Rectangular window: the last W samples count equally.
//!
//! Each sample gives a linear equation for theta, `y = psi' theta + eps` with `y = eps(t) + psi(t)' theta(t-1)`. For
//! ARX and FIR models, y is the output and psi the regressor, regardless of theta. The estimate is the least-squares
//! estimate over the window, `theta = R^{-1} sum psi y`, `R = sum psi psi'`. It is exact for ARX and FIR models; for
//! the other structures it is the recursive prediction-error method with a rectangular memory.
//!
//! If the oldest term were subtracted from a single sum at each sample, rounding errors would accumulate without limit.
//! The window is therefore kept as two sums. One sum grows from a boundary on; the other sum, which grew until that
//! boundary, loses its terms one by one. When the second sum has lost all terms, the first sum replaces it. No rounding
//! error persists for longer than two windows.
//!
//! The covariance of theta divided by sigma^2 is `R^{-1}`. If the window does not determine theta (fewer samples than
//! parameters, or no excitation), theta stays constant and there is no covariance. The caller owns the memory of
//! `W (N + 1)` numbers.

use hoid_numerics::cholesky;

use crate::adaptation::{Adaptation, ParameterStep};

/// Smallest pivot of R, scaled to a unit diagonal, with which a window determines theta; it is several hundred times
/// the rounding unit.
const SMALLEST_PIVOT: f64 = 1e-13;
/// Power of a gradient component, relative to its largest power so far, below which the parameter is not excited.
const MIN_EXCITATION: f64 = 1e-20;

/// Sums of the normal equations over a number of samples: `sum psi psi'` (lower triangle) and `sum psi y`.
#[derive(Debug, Clone, PartialEq)]
struct NormalEquations<const N: usize> {
    r: [[f64; N]; N],
    psi_y: [f64; N],
}

crate::state!([const N: usize] NormalEquations<N> { r, psi_y });

/// Adaptation with a rectangular window. N is the capacity for parameters, M the memory for the samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Window<const N: usize, M> {
    memory: M,
    /// Number of parameters to be estimated, at most N.
    parameters: usize,
    /// Length W of the window in samples.
    length: usize,
    /// Number of samples in the memory, and index at which the next sample is stored.
    filled: usize,
    next: usize,
    /// Sums since the boundary, and sums over the samples before the boundary that are still in the window.
    growing: NormalEquations<N>,
    fading: NormalEquations<N>,
    /// Largest power, so far, of each gradient component over a window.
    largest: [f64; N],
    /// Number of samples at which the window did not determine theta.
    undetermined: u64,
}

impl<const N: usize, M: AsMut<[f64]>> crate::state::State for Window<N, M> {
    /// The restored numbers may come from any source, so the index of the next sample is limited to the memory.
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let parts: &mut [&mut dyn crate::state::State] = &mut [
            &mut self.memory.as_mut(),
            &mut self.filled,
            &mut self.next,
            &mut self.growing,
            &mut self.fading,
            &mut self.largest,
            &mut self.undetermined,
        ];
        crate::state::visit_all(parts, each);
        self.filled = self.filled.min(self.length);
        self.next = self.next.min(self.length - 1);
    }
}

impl<const N: usize> NormalEquations<N> {
    const ZERO: Self = Self {
        r: [[0.0; N]; N],
        psi_y: [0.0; N],
    };

    #[inline]
    fn add(&mut self, sign: f64, psi: &[f64], y: f64) {
        for i in 0..psi.len() {
            let p = sign * psi[i];
            self.psi_y[i] += p * y;
            for j in 0..=i {
                self.r[i][j] += p * psi[j];
            }
        }
    }
}

impl<const N: usize, M: AsRef<[f64]> + AsMut<[f64]>> Window<N, M> {
    /// Returns the required length of the memory for a window of the given number of samples.
    pub const fn memory_length(samples: usize) -> usize {
        samples * (N + 1)
    }

    /// Builds a window as long as the memory allows, for `parameters` parameters, at most N. Returns `None` if the
    /// memory is too short for one sample or the number of parameters is not valid.
    pub fn new(memory: M, parameters: usize) -> Option<Self> {
        let length = memory.as_ref().len() / (N + 1);
        (length > 0 && (1..=N).contains(&parameters)).then_some(Self {
            memory,
            parameters,
            length,
            filled: 0,
            next: 0,
            growing: NormalEquations::ZERO,
            fading: NormalEquations::ZERO,
            largest: [0.0; N],
            undetermined: 0,
        })
    }

    /// Returns the number of samples at which the window did not determine theta, so theta stayed constant.
    pub fn undetermined_count(&self) -> u64 {
        self.undetermined
    }

    /// Returns the Cholesky factors of R, or `None` if R is singular.
    fn cholesky(&self) -> Option<Cholesky<N>> {
        let p = self.parameters;
        let (mut l, mut scale) = ([[0.0; N]; N], [0.0; N]);
        for i in 0..p {
            let power = self.growing.r[i][i] + self.fading.r[i][i];
            if power.is_nan() || power <= MIN_EXCITATION * self.largest[i] {
                return None;
            }
            scale[i] = 1.0 / libm::sqrt(power);
            for j in 0..=i {
                l[i][j] = (self.growing.r[i][j] + self.fading.r[i][j]) * scale[i] * scale[j];
            }
        }
        cholesky::factor_with_min_pivot(&mut l, p, SMALLEST_PIVOT).then_some(Cholesky {
            l,
            scale,
            parameters: p,
        })
    }
}

/// Factors `R = S^{-1} L L' S^{-1}` with a diagonal S that scales R to a unit diagonal.
struct Cholesky<const N: usize> {
    l: [[f64; N]; N],
    /// Diagonal of S.
    scale: [f64; N],
    parameters: usize,
}

impl<const N: usize> Cholesky<N> {
    /// Returns `R^{-1} right`.
    fn solve(&self, right: &[f64; N]) -> [f64; N] {
        let p = self.parameters;
        let mut x = [0.0; N];
        for i in 0..p {
            x[i] = right[i] * self.scale[i];
        }
        cholesky::substitute_forward(&self.l, p, &mut x);
        cholesky::substitute_backward(&self.l, p, &mut x);
        for i in 0..p {
            x[i] *= self.scale[i];
        }
        x
    }
}

impl<const N: usize, M: AsRef<[f64]> + AsMut<[f64]>> Adaptation<N> for Window<N, M> {
    fn update(&mut self, psi: &[f64; N], eps: f64, theta: &[f64; N], _variance: f64) -> ParameterStep<N> {
        let p = self.parameters;
        let y = eps + (0..p).map(|i| psi[i] * theta[i]).sum::<f64>();
        let place = self.next * (N + 1);
        let slot = &mut self.memory.as_mut()[place..place + N + 1];
        if self.filled == self.length {
            self.fading.add(-1.0, &slot[..p], slot[N]);
        } else {
            self.filled += 1;
        }
        slot[..N].copy_from_slice(psi);
        slot[N] = y;
        self.growing.add(1.0, &psi[..p], y);
        self.next += 1;
        if self.next == self.length {
            self.next = 0;
            self.fading = core::mem::replace(&mut self.growing, NormalEquations::ZERO);
        }
        for i in 0..p {
            self.largest[i] = self.largest[i].max(self.growing.r[i][i] + self.fading.r[i][i]);
        }
        // If there are no more samples than parameters, the residuals are zero and carry no information.
        let factor = if self.filled > p { self.cholesky() } else { None };
        let Some(factor) = factor else {
            self.undetermined += 1;
            return ParameterStep::ZERO;
        };
        let right: [f64; N] = core::array::from_fn(|i| self.growing.psi_y[i] + self.fading.psi_y[i]);
        let best = factor.solve(&right);
        let gain = factor.solve(psi);
        if best.iter().all(|v| v.is_finite()) && gain.iter().all(|v| v.is_finite()) {
            ParameterStep {
                step: core::array::from_fn(|i| best[i] - theta[i]),
                gain,
            }
        } else {
            self.undetermined += 1;
            ParameterStep::ZERO
        }
    }

    fn own_covariance(&self) -> Option<[[f64; N]; N]> {
        let factor = self.cholesky()?;
        let mut spread = [[0.0; N]; N];
        for j in 0..self.parameters {
            let mut unit = [0.0; N];
            unit[j] = 1.0;
            for (row, value) in spread.iter_mut().zip(factor.solve(&unit)) {
                row[j] = value;
            }
        }
        Some(spread)
    }

    fn is_valid(&self) -> bool {
        let sound = |s: &NormalEquations<N>| s.r.iter().flatten().chain(&s.psi_y).all(|v| v.is_finite());
        sound(&self.growing) && sound(&self.fading)
    }
}
