//! From the gradient and the innovation to the step of the estimate, and to its error bars.
//!
//! A recursion with the negative gradient psi and the innovation eps moves by `g eps`. The gain is that of the prediction-error
//! method, `g = P psi/(1 + psi' P psi)`, `P <- P - g psi' P` (eq. 5.26, 31; L. Ljung and T. Söderström, *Theory and Practice of Recursive
//! Identification*, 1983, section 3.4), with P in units of the innovation variance. Before that, P grows by what is forgotten:
//!
//! | way of forgetting | P | source |
//! |---|---|---|
//! | [`Forgetting::Exponential`] | `Lambda P Lambda`, `Lambda = diag(lambda_i)^{-1/2}`; equal entries are the scalar factor | eq. 5.26 |
//! | [`Forgetting::RandomWalk`] | `P + Q`: the Kalman filter of parameters that drift | Ljung and Söderström, eq. 2.104 |
//! | [`Forgetting::Variable`] | `P/lambda(t)`, `lambda = 1 - eps^2/((1 + psi' P psi) N_0 sigma^2)` after the measurement: the weighted sum of squares stays what it is | T. R. Fortescue, L. S. Kershenbaum and B. E. Ydstie, *Automatica* 17 (1981) 831-835 |
//! | [`Forgetting::Directional`] | along psi only: measurement with `R = 1/beta`, `beta = lambda - (1 - lambda)/(psi' P psi)` | R. Kulhavý, *Automatica* 23 (1987) 589-600 |
//! | [`Forgetting::Gradient`] | none: `g = gamma psi/(c + psi' psi)`, c a hundredth of the largest mean power of psi so far | Ljung and Söderström, section 3.5 |
//!
//! A rectangular window is an adaptation of its own, [`crate::window`].
//!
//! **Windup.** Where nothing excites a direction, forgetting alone would let P grow without limit. So one parameter after another
//! is given a pseudo-measurement of itself, of the value that it has: it moves no estimate, and it
//! holds `P^{-1} >= diag(1/bound_i)` up to what is forgotten in one round. Its information is the share of `1/bound_i` that was forgotten
//! since the last turn of that parameter.
//!
//! What an estimate is worth that was made with such a gain: [`crate::error_bars`].

use crate::{
    error_bars::{ErrorBars, ErrorPropagation},
    ud_covariance::UdCovariance,
};

/// How old information loses its weight.
#[derive(Debug, Clone, PartialEq)]
pub enum Forgetting<const N: usize> {
    /// A factor `0 < lambda_i <= 1` for each parameter; all equal for the scalar factor, all 1 for an infinite memory.
    Exponential {
        /// The factors.
        lambda: [f64; N],
    },
    /// Variance by which each parameter drifts in a sample, over the innovation variance.
    RandomWalk {
        /// Diagonal of Q.
        drift: [f64; N],
    },
    /// A scalar factor that falls where the innovations are larger than their variance explains.
    Variable {
        /// Memory N_0 in samples while the innovations are what they are expected to be.
        memory: f64,
        /// Smallest factor.
        smallest: f64,
    },
    /// A scalar factor that acts along psi only.
    Directional {
        /// The factor.
        lambda: f64,
    },
    /// Normalised gradient.
    Gradient {
        /// Share gamma of the step that would bring the innovation to zero, below 2.
        rate: f64,
    },
}

/// The step for one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterStep<const N: usize> {
    /// What is to be added to theta.
    pub step: [f64; N],
    /// The gain g; `step = g eps` except in a window.
    pub gain: [f64; N],
}

/// What turns gradients into steps; [`Covariance`] and [`crate::window::Window`].
pub trait Adaptation<const N: usize> {
    /// The step for psi and the innovation eps of the given variance at theta; the memory moves on.
    fn update(&mut self, psi: &[f64; N], eps: f64, theta: &[f64; N], variance: f64) -> ParameterStep<N>;
    /// Covariance of theta over the innovation variance where it does not follow from the gains.
    fn own_covariance(&self) -> Option<[[f64; N]; N]> {
        None
    }
    /// Adds to the error bars what parameters drift in a sample.
    fn add_drift_to<const K: usize, B: ErrorPropagation<N, K>>(&self, _bars: &mut B) {}
    /// True when the variance that [`Adaptation::update`] is given has a part in the step.
    fn needs_innovation_variance(&self) -> bool {
        false
    }
    /// The covariance of theta over the innovation variance.
    fn normalised_covariance<const K: usize>(&self, bars: &ErrorBars<N, K>) -> [[f64; N]; N] {
        self.own_covariance().unwrap_or_else(|| bars.normalised_covariance())
    }
    /// True when every number inside is finite.
    fn is_valid(&self) -> bool;
}

/// A covariance in factors, with one way of forgetting.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance<const N: usize> {
    factors: UdCovariance<N>,
    /// P at the start.
    first: UdCovariance<N>,
    forgetting: Forgetting<N>,
    /// `lambda_i^{-1/2}` and its inverse, for unequal factors.
    scales: [[f64; N]; 2],
    /// `1/lambda` when all factors are equal, else zero.
    uniform: f64,
    /// Largest variance of each parameter.
    bound: [f64; N],
    /// Information that holds each parameter within its bound, per unit of what is forgotten.
    guard: [f64; N],
    /// What has been forgotten since the start, and when it was each parameter's turn last.
    forgotten: f64,
    settled: [f64; N],
    /// What the early samples forget besides, and what remains of it from sample to sample.
    early: f64,
    early_share: f64,
    /// Mean power of psi, and the largest so far, for the gradient.
    power: f64,
    largest_power: f64,
    /// Samples between two turns of the guard, those left until the next, and whose turn it is.
    period: u32,
    wait: u32,
    turn: usize,
}

crate::state!([const N: usize] Covariance<N> {
    factors, first, scales, uniform, bound, guard, forgotten, settled, early, early_share, power, largest_power, period, wait, turn,
});

/// Rounds of the guard within the shortest memory, where N is not too large for it: variances stay within e^{1/4} of the bound.
const TURNS_IN_A_MEMORY: f64 = 4.0;
/// `psi' P psi` below which there is no excitation.
const NO_EXCITATION: f64 = 1e-100;
/// Share of the newest sample in the mean power of psi, and of the largest mean power in the offset of the normalised gradient.
const POWER_SHARE: f64 = 0.01;
const OFFSET_SHARE: f64 = 0.01;
/// What the early samples forget is nothing any more.
const FORGOTTEN: f64 = 1e-9;
/// Longest period of the guard in samples.
const LONGEST_PERIOD: f64 = 64.0;

/// Samples between two turns of the guard, for the shortest memory and the number of parameters.
fn guard_period(shortest: f64, parameters: usize) -> u32 {
    (shortest / (TURNS_IN_A_MEMORY * parameters as f64)).clamp(1.0, LONGEST_PERIOD) as u32
}

/// The step `g eps`.
#[inline(always)]
fn along<const N: usize>(gain: [f64; N], eps: f64) -> ParameterStep<N> {
    ParameterStep {
        step: gain.map(|g| g * eps),
        gain,
    }
}

impl<const N: usize> Covariance<N> {
    /// `factors` is P; `bound` the largest variance of each parameter, in the units of P, infinite for none.
    pub fn new(factors: UdCovariance<N>, forgetting: Forgetting<N>, bound: [f64; N]) -> Self {
        let mut scales = [[1.0; N]; 2];
        let mut uniform = 0.0;
        let mut shortest = f64::INFINITY;
        match &forgetting {
            Forgetting::Exponential { lambda } => {
                shortest = lambda.iter().fold(f64::INFINITY, |m, l| m.min(1.0 / (1.0 - l)));
                scales = [lambda.map(|l| 1.0 / libm::sqrt(l)), lambda.map(libm::sqrt)];
                if lambda.iter().all(|l| *l == lambda[0]) {
                    uniform = 1.0 / lambda[0];
                }
            }
            Forgetting::Variable { smallest, .. } => shortest = 1.0 / (1.0 - smallest),
            Forgetting::Directional { lambda } => shortest = 1.0 / (1.0 - lambda),
            Forgetting::RandomWalk { .. } | Forgetting::Gradient { .. } => {}
        }
        let period = guard_period(shortest, N);
        let guard = core::array::from_fn(|i| {
            let information = if bound[i] > 0.0 { 1.0 / bound[i] } else { 0.0 };
            match &forgetting {
                Forgetting::Exponential { lambda } => (1.0 - lambda[i]) * information,
                Forgetting::RandomWalk { drift } => drift[i] * information * information,
                Forgetting::Variable { .. } | Forgetting::Directional { .. } => information,
                Forgetting::Gradient { .. } => 0.0,
            }
        });
        Self {
            first: factors,
            factors,
            forgetting,
            scales,
            uniform,
            bound,
            guard,
            forgotten: 0.0,
            settled: [0.0; N],
            early: 0.0,
            early_share: 0.0,
            power: 0.0,
            largest_power: 0.0,
            period,
            wait: period,
            turn: 0,
        }
    }

    /// With a memory that grows at the start, for a recursion that starts far from the truth: before the t-th sample all of P grows by
    /// `1/(1 - early share^t)` besides (Ljung and Söderström, eq. 5.77). The gradients of the first estimates are then forgotten.
    #[must_use]
    pub fn with_growing_memory(mut self, early: f64, share: f64) -> Self {
        self.early = early;
        self.early_share = share;
        self
    }

    /// P itself.
    pub fn matrix(&self) -> [[f64; N]; N] {
        self.factors.matrix()
    }

    /// The step where it is not that of a recursion in its stride with an exponential memory.
    #[inline(never)]
    fn update_slowly(&mut self, psi: &[f64; N], eps: f64, variance: f64) -> ParameterStep<N> {
        if self.early > FORGOTTEN {
            self.factors.scale_all(1.0 / (1.0 - self.early));
            self.hold(self.early);
            self.early *= self.early_share;
        }
        let mut growth = 1.0;
        match &self.forgetting {
            Forgetting::Exponential { .. } => {
                if self.uniform != 1.0 {
                    if self.uniform > 0.0 {
                        growth = self.uniform;
                    } else {
                        self.factors.scale(&self.scales[0], &self.scales[1]);
                    }
                    self.hold(1.0);
                }
            }
            Forgetting::RandomWalk { drift } => {
                for (i, q) in drift.iter().enumerate() {
                    if *q > 0.0 {
                        let mut unit = [0.0; N];
                        unit[i] = 1.0;
                        self.factors.rank_one_update(*q, unit);
                    }
                }
                self.hold(1.0);
            }
            Forgetting::Variable { memory, smallest } => {
                return self.update_variable(psi, eps, *memory * variance, *smallest);
            }
            Forgetting::Directional { lambda } => return self.update_directional(psi, eps, *lambda),
            Forgetting::Gradient { rate } => return self.update_gradient(psi, eps, *rate),
        }
        along(self.factors.inflate_and_update(growth, psi, 1.0), eps)
    }

    /// `level` is N_0 sigma^2.
    fn update_variable(&mut self, psi: &[f64; N], eps: f64, level: f64, smallest: f64) -> ParameterStep<N> {
        let denominator = 1.0 + self.factors.quadratic_form(psi);
        let gain = self.factors.measurement_update(psi, 1.0);
        let expected = denominator * level;
        let lambda = if expected > 0.0 {
            (1.0 - eps * eps / expected).clamp(smallest, 1.0)
        } else {
            1.0
        };
        self.factors.scale_all(1.0 / lambda);
        self.hold(1.0 - lambda);
        along(gain, eps)
    }

    fn update_directional(&mut self, psi: &[f64; N], eps: f64, lambda: f64) -> ParameterStep<N> {
        let power = self.factors.quadratic_form(psi);
        let gain = self.factors.times(psi).map(|g| g / (1.0 + power));
        let beta = lambda - (1.0 - lambda) / power;
        // Without excitation nothing is measured, and there is no direction to forget along.
        if power > NO_EXCITATION && beta != 0.0 {
            self.factors.measurement_update(psi, 1.0 / beta);
        }
        self.hold(1.0 - lambda);
        along(gain, eps)
    }

    fn update_gradient(&mut self, psi: &[f64; N], eps: f64, rate: f64) -> ParameterStep<N> {
        let power: f64 = psi.iter().map(|p| p * p).sum();
        self.power += (power - self.power) * POWER_SHARE;
        self.largest_power = self.largest_power.max(self.power);
        let denominator = OFFSET_SHARE * self.largest_power + power;
        let scale = if denominator > 0.0 { rate / denominator } else { 0.0 };
        along(psi.map(|p| scale * p), eps)
    }

    /// Notes what this sample forgets, and gives the pseudo-measurement to the parameter whose turn it is.
    #[inline]
    fn hold(&mut self, forgotten: f64) {
        self.forgotten += forgotten;
        self.wait -= 1;
        if self.wait > 0 {
            return;
        }
        self.take_turn();
    }

    #[inline(never)]
    fn take_turn(&mut self) {
        self.wait = self.period;
        if !self.factors.is_valid() {
            // Lost to an overflow: nothing better is known than what was known at the start.
            self.factors.clone_from(&self.first);
        }
        let turn = self.turn;
        self.turn = if turn + 1 < N { turn + 1 } else { 0 };
        let information = (self.forgotten - self.settled[turn]) * self.guard[turn];
        self.settled[turn] = self.forgotten;
        if information > 0.0 {
            let mut unit = [0.0; N];
            unit[turn] = 1.0;
            self.factors.measurement_update(&unit, 1.0 / information);
        }
    }
}

impl<const N: usize> Adaptation<N> for Covariance<N> {
    #[inline(always)]
    fn update(&mut self, psi: &[f64; N], eps: f64, _theta: &[f64; N], variance: f64) -> ParameterStep<N> {
        let exponential = matches!(self.forgetting, Forgetting::Exponential { .. });
        if !exponential || self.early > FORGOTTEN {
            // A copy, so that psi can stay in registers where it is not called.
            let psi = *psi;
            return self.update_slowly(&psi, eps, variance);
        }
        let mut growth = 1.0;
        // At 1 nothing is forgotten.
        if self.uniform != 1.0 {
            if self.uniform > 0.0 {
                growth = self.uniform;
            } else {
                self.factors.scale(&self.scales[0], &self.scales[1]);
            }
            self.hold(1.0);
        }
        along(self.factors.inflate_and_update(growth, psi, 1.0), eps)
    }

    #[inline(always)]
    fn add_drift_to<const K: usize, B: ErrorPropagation<N, K>>(&self, bars: &mut B) {
        if let Forgetting::RandomWalk { drift } = &self.forgetting {
            for (i, (variance, bound)) in drift.iter().zip(&self.bound).enumerate() {
                bars.add_drift(i, *variance, *bound);
            }
        }
    }

    fn needs_innovation_variance(&self) -> bool {
        matches!(self.forgetting, Forgetting::Variable { .. })
    }

    fn is_valid(&self) -> bool {
        self.factors.is_valid()
    }
}
