//! One hypothesis: a Kalman filter of the operator's parameters, given that they last changed at its birth.
//!
//! With `y = D u` and the whitened signals `r`, the innovation and its negative gradient at eta are
//!
//! `eps = y - K_e psi_1 - K_e_dot psi_2`, `psi_1 = r_1 + d_omega r_3 + d_zeta r_5`,
//! `psi_2 = r_2 + d_omega r_4 + d_zeta r_6`, `psi_3 = K_e r_3 + K_e_dot r_4`,
//! `psi_4 = K_e r_5 + K_e_dot r_6`,
//!
//! where `d_omega`, `d_zeta` are the distances from the linearisation point of the filters. The predictive distribution
//! of eps is Student's t with the variance `v = sigma^2 + psi' P psi` and n degrees of freedom, the number of residuals
//! in sigma^2. The density of eps is `v^{-1/2} exp(-(n + 1)/2 ln(1 + eps^2/(n v)) - 1/(4 n))` up to a factor (the Gamma
//! functions give `-1/(4 n) + O(n^{-3})`).
//!
//! An innovation beyond the limit is replaced by the limit, both in the density and in sigma^2, and the variance of the
//! measurement is increased until the innovation lies at the limit (P. J. Huber, *Robust Statistics*, 1981, section
//! 7.3): an outlier carries no information about which hypothesis predicts better.

use super::{
    elementary::{exp, log1p},
    prior::{ChangePrior, PARAMETER_COUNT},
    response::Signals,
};
use hoid_core::{innovation_variance::InnovationVariance, state::State, ud_covariance::UdCovariance};

/// Limit of variances and signals beyond which their products would overflow.
pub(super) const OVERFLOW_LIMIT: f64 = 1e60;
/// Largest ratio of a squared innovation to its variance that enters sigma^2.
const MAX_SQUARE_RATIO: f64 = 9.0;
/// Largest relative distance of omega_nm and zeta_nm from the linearisation point for which the linearisation is valid.
const MAX_RELATIVE_DISTANCE: f64 = 0.5;
/// Smallest innovation variance relative to the initial value, for spans without any signal.
const MIN_VARIANCE_RATIO: f64 = 1e-9;

/// One hypothesis: a Kalman filter of the operator's parameters since its birth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// Estimate of `[K_e, K_e_dot, omega_nm, zeta_nm]`.
    pub eta: [f64; PARAMETER_COUNT],
    /// Covariance of `eta`.
    pub covariance: UdCovariance<PARAMETER_COUNT>,
    /// Innovation variance.
    pub innovation_variance: InnovationVariance,
    /// Probability of the hypothesis.
    pub probability: f64,
    /// Sample at which the hypothesis was born.
    pub birth_sample: u64,
    /// True if the hypothesis assumes that the neuromuscular system also changed at its birth.
    pub neuromuscular_changed: bool,
    /// Delay of the hypothesis, in samples beyond the shortest delay.
    pub extra_delay: usize,
    /// Estimate before the birth of the hypothesis.
    pub before: Snapshot,
    min_variance: f64,
}

/// Estimate of a hypothesis at a given time.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Snapshot {
    /// Estimate of `[K_e, K_e_dot, omega_nm, zeta_nm]`.
    pub eta: [f64; PARAMETER_COUNT],
    /// Variance of K_e, variance of K_e_dot, and their covariance.
    pub gain_covariance: [f64; 3],
    /// Variances of omega_nm and zeta_nm.
    pub neuromuscular_variance: [f64; 2],
    /// Innovation variance.
    pub innovation_variance: f64,
    /// Mean and variance of the delay, in samples beyond the shortest delay.
    pub delay: [f64; 2],
}

hoid_core::state!([] Hypothesis { eta, covariance, innovation_variance, probability, birth_sample, neuromuscular_changed, extra_delay, before, min_variance });
hoid_core::state!([] Snapshot { eta, gain_covariance, neuromuscular_variance, innovation_variance, delay });

/// Visits the numbers of a slot of the bank: a number that indicates whether the slot is occupied, and the numbers of
/// its hypothesis.
pub(super) fn visit_slot(slot: &mut Option<Hypothesis>, each: &mut dyn FnMut(&mut f64)) {
    let mut is_there = slot.is_some();
    is_there.visit(each);
    // A hypothesis restored into an empty slot overwrites all of these numbers.
    *slot = is_there.then(|| slot.take().unwrap_or_else(Hypothesis::empty));
    if let Some(hypothesis) = slot {
        hypothesis.visit(each);
    }
}

/// Returns psi at eta, computed from the whitened signals of filters that are linearised about the point
/// `[omega_nm, zeta_nm]`.
#[inline(always)]
pub fn gradient(eta: &[f64; PARAMETER_COUNT], r: &Signals, point: [f64; 2]) -> [f64; PARAMETER_COUNT] {
    let (omega, zeta) = (eta[2] - point[0], eta[3] - point[1]);
    [
        r[0] + omega * r[2] + zeta * r[4],
        r[1] + omega * r[3] + zeta * r[5],
        eta[0] * r[2] + eta[1] * r[3],
        eta[0] * r[4] + eta[1] * r[5],
    ]
}

/// Limits a value to the range from `low` to `high`. Unlike `f64::clamp`, it does not panic if the bounds are NaN or
/// not ordered.
#[inline(always)]
fn bounded(value: f64, low: f64, high: f64) -> f64 {
    if value < low {
        low
    } else if value > high {
        high
    } else {
        value
    }
}

impl Hypothesis {
    fn empty() -> Self {
        Self {
            eta: [0.0; PARAMETER_COUNT],
            covariance: UdCovariance::diagonal([0.0; PARAMETER_COUNT]),
            innovation_variance: InnovationVariance::new(0.0, 1.0, 1.0),
            probability: 0.0,
            birth_sample: 0,
            neuromuscular_changed: false,
            extra_delay: 0,
            before: Snapshot::default(),
            min_variance: 0.0,
        }
    }

    /// Creates a hypothesis from an estimate, its covariance and the innovation variance. `None` unless the covariance
    /// is positive definite.
    pub fn new(
        eta: [f64; PARAMETER_COUNT],
        covariance: &[[f64; PARAMETER_COUNT]; PARAMETER_COUNT],
        innovation_variance: InnovationVariance,
    ) -> Option<Self> {
        let covariance = UdCovariance::from_matrix(covariance)?;
        let mut first = Self {
            eta,
            covariance,
            innovation_variance,
            probability: 1.0,
            birth_sample: 0,
            neuromuscular_changed: false,
            extra_delay: 0,
            before: Snapshot::default(),
            min_variance: MIN_VARIANCE_RATIO * innovation_variance.variance(),
        };
        first.before = first.snapshot();
        Some(first)
    }

    /// Updates the hypothesis with one sample. Returns the innovation and its predictive density.
    #[inline(always)]
    pub fn step(&mut self, y: f64, r: &Signals, point: [f64; 2], prior: &ChangePrior) -> (f64, f64) {
        let psi = gradient(&self.eta, r, point);
        let eps = y - self.eta[0] * psi[0] - self.eta[1] * psi[1];
        let variance = self.innovation_variance.variance().max(self.min_variance);
        let (f, v) = self.covariance.projections(&psi);
        let total = variance + f[0] * v[0] + f[1] * v[1] + f[2] * v[2] + f[3] * v[3];
        if !(total > 0.0 && total < OVERFLOW_LIMIT) {
            return (eps, 1.0);
        }
        let deviation = libm::sqrt(total);
        let limit = prior.outlier_limit * deviation;
        let excess = eps.abs() / limit;
        let (used, variance_factor) = if excess > 1.0 {
            (libm::copysign(limit, eps), excess * excess)
        } else {
            (eps, 1.0)
        };
        let square = used * used / total;
        let n = self.innovation_variance.residual_count();
        let density = exp(-0.5 * (n + 1.0) * log1p(square / n) - 0.25 / n) / deviation;
        let gain = self
            .covariance
            .update_with_projections((f, v), variance * variance_factor);
        for i in 0..PARAMETER_COUNT {
            let [mut low, mut high] = prior.bounds[i];
            if i >= 2 {
                low = low.max((1.0 - MAX_RELATIVE_DISTANCE) * point[i - 2]);
                high = high.min((1.0 + MAX_RELATIVE_DISTANCE) * point[i - 2]);
            }
            self.eta[i] = bounded(self.eta[i] + gain[i] * used, low, high);
        }
        self.innovation_variance.update(square.min(MAX_SQUARE_RATIO) * variance);
        (eps, density)
    }

    /// Returns `g^2` and `g^2/omega_c^2`, the units of the variances of K_e and K_e_dot.
    fn gain_scales(&self, prior: &ChangePrior) -> [f64; 2] {
        let square = prior.crossover * prior.crossover;
        let g = self.eta[0] * self.eta[0] + square * self.eta[1] * self.eta[1];
        [g, g / square]
    }

    /// Adds the drift of the parameters between two births, which is faster just after a change. A parameter stops
    /// drifting when its variance reaches the prior variance of a change.
    pub fn drift(&mut self, now: u64, prior: &ChangePrior) {
        let scales = self.gain_scales(prior);
        // The first hypothesis, born at sample 0, does not represent a change.
        let transient = match self.birth_sample {
            0 => 0.0,
            born => exp(-((now - born) as f64) / prior.transient_time_constant),
        };
        let samples = f64::from(prior.birth_interval);
        for i in 0..2 {
            let jump = prior.gain_jump[i] * prior.gain_jump[i];
            if self.covariance.element(i, i) < jump * scales[i] {
                let rate = prior.gain_drift * prior.gain_drift
                    + prior.transient_drift[i] * prior.transient_drift[i] * transient;
                self.inflate(i, rate * samples * scales[i]);
            }
        }
        if self.neuromuscular_changed {
            for i in 0..2 {
                let deviation = prior.neuromuscular_jump[i] * self.eta[2 + i];
                let variance = deviation * deviation;
                if self.covariance.element(2 + i, 2 + i) < variance {
                    self.inflate(
                        2 + i,
                        prior.transient_drift[2 + i] * prior.transient_drift[2 + i] * transient * samples * variance,
                    );
                }
            }
        }
    }

    /// Returns the same hypothesis with a delay that is `extra_delay` samples longer than the shortest.
    pub fn with_extra_delay(self, extra_delay: usize) -> Self {
        Self { extra_delay, ..self }
    }

    /// Returns a hypothesis that differs from this one only in its delay, which is assumed to have been valid all
    /// along, and in the variances, which are increased by the effect of the difference in delay.
    pub fn with_neighbouring_delay(&self, extra_delay: usize, prior: &ChangePrior) -> Self {
        let mut other = self.with_extra_delay(extra_delay);
        let (scales, away) = (self.gain_scales(prior), extra_delay.abs_diff(self.extra_delay) as f64);
        for i in 0..PARAMETER_COUNT {
            let scale = if i < 2 { scales[i] } else { self.eta[i] * self.eta[i] };
            let error = away * prior.delay.error_per_sample[i];
            other.inflate(i, error * error * scale);
        }
        other
    }

    /// Returns the hypothesis that the gains change now; if `neuromuscular` is true, omega_nm and zeta_nm change as
    /// well.
    pub fn with_change(&self, now: u64, neuromuscular: bool, prior: &ChangePrior) -> Self {
        let mut child = *self;
        let scales = self.gain_scales(prior);
        for i in 0..2 {
            child.inflate(i, prior.gain_jump[i] * prior.gain_jump[i] * scales[i]);
        }
        if neuromuscular {
            for i in 0..2 {
                let deviation = prior.neuromuscular_jump[i] * self.eta[2 + i];
                child.inflate(2 + i, deviation * deviation);
            }
        }
        child
            .innovation_variance
            .limit_residual_count(prior.residuals_after_change);
        child.birth_sample = now;
        child.neuromuscular_changed = neuromuscular;
        child.before = self.snapshot();
        child
    }

    /// Adds `variance` to the variance of parameter i.
    fn inflate(&mut self, i: usize, variance: f64) {
        let mut unit = [0.0; PARAMETER_COUNT];
        unit[i] = 1.0;
        self.covariance.rank_one_update(variance, unit);
    }

    /// Returns the current estimate.
    pub fn snapshot(&self) -> Snapshot {
        let p = &self.covariance;
        Snapshot {
            eta: self.eta,
            gain_covariance: [p.element(0, 0), p.element(1, 1), p.element(0, 1)],
            neuromuscular_variance: [p.element(2, 2), p.element(3, 3)],
            innovation_variance: self.innovation_variance.variance(),
            delay: [self.extra_delay as f64, 0.0],
        }
    }

    /// True if all numbers are finite.
    pub fn is_valid(&self) -> bool {
        self.covariance.is_valid()
            && self.eta.iter().all(|e| e.is_finite())
            && self.innovation_variance.variance().is_finite()
    }
}
