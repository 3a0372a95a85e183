//! Gain of the prediction-error method, computed from P, with a forgetting rule and protection against windup.
//!
//! The equations are in [`crate::adaptation`].
//!
//! **Windup.** In a direction that is not excited, forgetting alone would let P grow without limit. Each parameter in
//! turn therefore gets a pseudo-measurement of its current value: the estimate stays constant, and
//! `P^{-1} >= diag(1/bound_i)` holds except for the forgetting since the last turn. The information of the
//! pseudo-measurement is the part of `1/bound_i` that was forgotten since the last turn of that parameter.

use crate::{
    adaptation::{Adaptation, Forgetting, ParameterStep},
    error_bars::ErrorPropagation,
    ud_covariance::UdCovariance,
};

/// Number of times that each parameter gets a pseudo-measurement within the shortest memory, if N is small enough. The
/// variance of a parameter then grows by at most e^{1/4} between two of its pseudo-measurements.
const ROUNDS_PER_MEMORY: f64 = 4.0;
/// `psi' P psi` below which a sample is not used as a measurement.
const MIN_EXCITATION: f64 = 1e-100;
/// Weight of the newest sample in the mean power of psi.
const POWER_WEIGHT: f64 = 0.01;
/// Offset c of the normalised gradient, relative to the largest mean power of psi.
const GRADIENT_OFFSET: f64 = 0.01;
/// Value of the additional forgetting of early samples below which it ends.
const MIN_EARLY_FORGETTING: f64 = 1e-9;
/// Maximum number of samples between two pseudo-measurements.
const MAX_GUARD_PERIOD: f64 = 64.0;

/// P in factored form, with a forgetting rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance<const N: usize> {
    factors: UdCovariance<N>,
    /// Initial P.
    initial: UdCovariance<N>,
    forgetting: Forgetting<N>,
    /// Diagonals of Lambda and of its inverse, for unequal forgetting factors.
    scales: [[f64; N]; 2],
    /// `1/lambda` if all forgetting factors are equal, otherwise zero.
    uniform_growth: f64,
    /// Largest variance of each parameter.
    bound: [f64; N],
    /// Information of the pseudo-measurement of each parameter per unit of accumulated forgetting.
    guard: [f64; N],
    /// Forgetting accumulated since the start: the current value, and its value at the last pseudo-measurement of each
    /// parameter.
    forgotten: f64,
    forgotten_at_turn: [f64; N],
    /// Additional forgetting of an early sample, and the factor by which it decreases from sample to sample.
    early: f64,
    early_decay: f64,
    /// Mean power of psi, and its largest value so far, for the gradient method.
    power: f64,
    largest_power: f64,
    /// Number of samples between two pseudo-measurements, number of samples until the next pseudo-measurement, and
    /// index of the parameter that it concerns.
    period: u32,
    until_turn: u32,
    turn: usize,
}

crate::state!([const N: usize] Covariance<N> {
    factors, initial, scales, uniform_growth, bound, guard, forgotten, forgotten_at_turn, early, early_decay, power, largest_power, period, until_turn, turn,
}, limit_restored);

impl<const N: usize> Covariance<N> {
    fn limit_restored(&mut self) {
        self.period = self.period.max(1);
        self.until_turn = self.until_turn.clamp(1, self.period);
        self.turn = self.turn.min(N.saturating_sub(1));
    }

    /// Builds the adaptation from the factors of the initial P. `bound` is the largest variance of each parameter in
    /// the units of P, or infinity for no limit.
    pub fn new(factors: UdCovariance<N>, forgetting: Forgetting<N>, bound: [f64; N]) -> Self {
        let mut scales = [[1.0; N]; 2];
        let mut uniform_growth = 0.0;
        let mut shortest = f64::INFINITY;
        match &forgetting {
            Forgetting::Exponential { lambda } => {
                shortest = lambda.iter().fold(f64::INFINITY, |m, l| m.min(1.0 / (1.0 - l)));
                scales = [lambda.map(|l| 1.0 / libm::sqrt(l)), lambda.map(libm::sqrt)];
                if lambda.iter().all(|l| *l == lambda[0]) {
                    uniform_growth = 1.0 / lambda[0];
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
            initial: factors,
            factors,
            forgetting,
            scales,
            uniform_growth,
            bound,
            guard,
            forgotten: 0.0,
            forgotten_at_turn: [0.0; N],
            early: 0.0,
            early_decay: 0.0,
            power: 0.0,
            largest_power: 0.0,
            period,
            until_turn: period,
            turn: 0,
        }
    }

    /// Makes the memory grow from a short initial length, for a recursion that starts far from the true parameters.
    /// Before sample t = 0, 1, ... P is additionally multiplied by `1/(1 - early decay^t)` (Ljung and Söderström, eq.
    /// 5.77), so the inaccurate gradients of the first estimates are forgotten.
    #[must_use]
    pub fn with_growing_memory(mut self, early: f64, decay: f64) -> Self {
        self.early = early;
        self.early_decay = decay;
        self
    }

    /// Multiplies P by a factor. With a factor below one, the estimate changes less until the earlier data are
    /// forgotten; with a factor above one, the estimate changes more.
    pub fn scale(&mut self, factor: f64) {
        self.factors.scale_all(factor);
    }

    /// Returns P.
    pub fn matrix(&self) -> [[f64; N]; N] {
        self.factors.matrix()
    }

    /// Returns the step for any forgetting rule, including the additional forgetting of early samples.
    /// [`Adaptation::update`] itself handles exponential forgetting without early forgetting.
    #[inline(never)]
    fn update_by_rule(&mut self, psi: &[f64; N], eps: f64, variance: f64) -> ParameterStep<N> {
        if self.early > MIN_EARLY_FORGETTING {
            self.factors.scale_all(1.0 / (1.0 - self.early));
            self.accumulate_forgetting(self.early);
            self.early *= self.early_decay;
        }
        let mut growth = 1.0;
        match &self.forgetting {
            Forgetting::Exponential { .. } => {
                if self.uniform_growth != 1.0 {
                    if self.uniform_growth > 0.0 {
                        growth = self.uniform_growth;
                    } else {
                        self.factors.scale(&self.scales[0], &self.scales[1]);
                    }
                    self.accumulate_forgetting(1.0);
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
                self.accumulate_forgetting(1.0);
            }
            Forgetting::Variable { memory, smallest } => {
                return self.update_variable(psi, eps, *memory * variance, *smallest);
            }
            Forgetting::Directional { lambda } => return self.update_directional(psi, eps, *lambda),
            Forgetting::Gradient { rate } => return self.update_gradient(psi, eps, *rate),
        }
        gain_step(self.factors.inflate_and_update(growth, psi, 1.0), eps)
    }

    /// Returns the step with the variable forgetting factor; `sum_of_squares` is N_0 sigma^2.
    fn update_variable(&mut self, psi: &[f64; N], eps: f64, sum_of_squares: f64, smallest: f64) -> ParameterStep<N> {
        // 1 + psi' P psi is the variance of the innovation divided by sigma^2. An innovation larger than expected from
        // this variance shortens the memory.
        let denominator = 1.0 + self.factors.quadratic_form(psi);
        let gain = self.factors.measurement_update(psi, 1.0);
        let expected = denominator * sum_of_squares;
        let lambda = if expected > 0.0 {
            (1.0 - eps * eps / expected).clamp(smallest, 1.0)
        } else {
            1.0
        };
        self.factors.scale_all(1.0 / lambda);
        self.accumulate_forgetting(1.0 - lambda);
        gain_step(gain, eps)
    }

    fn update_directional(&mut self, psi: &[f64; N], eps: f64, lambda: f64) -> ParameterStep<N> {
        let power = self.factors.quadratic_form(psi);
        let gain = self.factors.times(psi).map(|g| g / (1.0 + power));
        let beta = lambda - (1.0 - lambda) / power;
        // Without excitation there is nothing to measure and no direction in which to forget.
        if power > MIN_EXCITATION && beta != 0.0 {
            self.factors.measurement_update(psi, 1.0 / beta);
        }
        self.accumulate_forgetting(1.0 - lambda);
        gain_step(gain, eps)
    }

    fn update_gradient(&mut self, psi: &[f64; N], eps: f64, rate: f64) -> ParameterStep<N> {
        let power: f64 = psi.iter().map(|p| p * p).sum();
        self.power += (power - self.power) * POWER_WEIGHT;
        // The offset keeps the step bounded when psi vanishes; without it, the gain rate psi/(psi' psi) would grow
        // without limit.
        self.largest_power = self.largest_power.max(self.power);
        let denominator = GRADIENT_OFFSET * self.largest_power + power;
        let scale = if denominator > 0.0 { rate / denominator } else { 0.0 };
        gain_step(psi.map(|p| scale * p), eps)
    }

    /// Accumulates the forgetting of this sample, and makes the next pseudo-measurement at the end of a period.
    #[inline]
    fn accumulate_forgetting(&mut self, forgotten: f64) {
        self.forgotten += forgotten;
        self.until_turn -= 1;
        if self.until_turn > 0 {
            return;
        }
        self.guard_next_parameter();
    }

    /// Makes the pseudo-measurement of the parameter whose turn it is.
    #[inline(never)]
    fn guard_next_parameter(&mut self) {
        self.until_turn = self.period;
        if !self.factors.is_valid() {
            // After an overflow P is reset to its initial value.
            self.factors.clone_from(&self.initial);
        }
        let turn = self.turn;
        self.turn = if turn + 1 < N { turn + 1 } else { 0 };
        let information = (self.forgotten - self.forgotten_at_turn[turn]) * self.guard[turn];
        self.forgotten_at_turn[turn] = self.forgotten;
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
        if !exponential || self.early > MIN_EARLY_FORGETTING {
            // The copy allows psi to stay in registers under exponential forgetting.
            let psi = *psi;
            return self.update_by_rule(&psi, eps, variance);
        }
        let mut growth = 1.0;
        // With a growth of 1 nothing is forgotten.
        if self.uniform_growth != 1.0 {
            if self.uniform_growth > 0.0 {
                growth = self.uniform_growth;
            } else {
                self.factors.scale(&self.scales[0], &self.scales[1]);
            }
            self.accumulate_forgetting(1.0);
        }
        gain_step(self.factors.inflate_and_update(growth, psi, 1.0), eps)
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

/// Number of samples between two pseudo-measurements, for the shortest memory and the number of parameters.
fn guard_period(shortest: f64, parameters: usize) -> u32 {
    (shortest / (ROUNDS_PER_MEMORY * parameters as f64)).clamp(1.0, MAX_GUARD_PERIOD) as u32
}

/// Returns the step `g eps`.
#[inline(always)]
fn gain_step<const N: usize>(gain: [f64; N], eps: f64) -> ParameterStep<N> {
    ParameterStep {
        step: gain.map(|g| g * eps),
        gain,
    }
}
