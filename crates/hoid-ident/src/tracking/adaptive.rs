//! The bank of hypotheses of the real-time kernel ([`hoid_core::adaptive`]) behind the face of a recursion: what it supposes of a person, in
//! seconds.
//!
//! The numbers were set on conditions C3 and C5 with remnants of order 2 and 3; the errors change by a tenth or less when any of them is halved or doubled.

use hoid_core::{
    adaptive::{
        Adaptive, Suppositions,
        hypothesis::{Hypothesis, OPERATOR},
    },
    delay::DelayLine,
    error_bars::Level,
    held_operator::held_operator,
    state::{State, visit_all},
};
use hoid_model::{
    SampleTime,
    uncertainty::{Estimate, OperatorEstimate},
};

use super::{
    Change, Recursion, Sample, Taken,
    options::TrackOptions,
    start::{self, StartState},
};
use crate::IdentError;

/// Room for hypotheses, and the largest order of the noise model.
const HYPOTHESES: usize = 16;
pub(super) const LARGEST_ND: usize = 8;
/// Time between two births, s.
const SPACING_S: f64 = 0.32;
/// Mean time between two changes, s.
const BETWEEN_CHANGES_S: f64 = 60.0;
/// Change of K_e and of K_e_dot to be expected, in the units of [`Suppositions::jump`].
const JUMP: [f64; 2] = [0.22, 0.5];
/// Drift of the gains in one second, in the same units.
const DRIFT: f64 = 0.005;
/// Crossover at which the gains are compared, rad/s.
const CROSSOVER_RAD_S: f64 = 2.0;
/// Memory of the innovation variance, and what of it is left after a change, s.
const LEVEL_MEMORY_S: f64 = 20.0;
const DOUBT_S: f64 = 1.0;
/// Births for which a hypothesis is kept whatever it foretells.
const PROTECTED_BIRTHS: f64 = 4.0;
/// Age from which a hypothesis can say what changed, s.
const SETTLED_S: f64 = 0.5;
/// A hypothesis of up to this age stands for a change, s.
const RECENT_S: f64 = 4.0;

/// The suppositions in samples.
///
/// # Errors
/// As [`start::physical_bounds`].
fn suppositions(options: &TrackOptions, sample_time: SampleTime) -> Result<Suppositions, IdentError> {
    let ts = sample_time.s();
    let spacing = (SPACING_S / ts).round().max(1.0);
    Ok(Suppositions {
        sample_time: ts,
        bounds: start::physical_bounds::<OPERATOR>(options, sample_time)?,
        spacing: spacing as u32,
        // Where samples are further apart than changes are supposed to be, half of them.
        hazard: (ts / BETWEEN_CHANGES_S).min(0.5 / spacing),
        jump: JUMP,
        drift: DRIFT * ts.sqrt(),
        crossover: CROSSOVER_RAD_S,
        doubt: (DOUBT_S / ts).max(4.0),
        protected: (PROTECTED_BIRTHS * spacing) as u64,
        limit: options.limit_in_use(),
        settled: (SETTLED_S / ts).round() as u64,
        recent: (RECENT_S / ts).round().max(2.0 * spacing) as u64,
        threshold: options.alarm,
    })
}

/// The bank with its delay line.
pub(super) struct AdaptiveRecursion {
    bank: Box<Adaptive<HYPOTHESES, LARGEST_ND>>,
    delay: DelayLine<Vec<f64>>,
    sample_time: SampleTime,
    fixed_tau_s: f64,
    /// `[b0, b1, d.., f1, f2]` and the covariance of d, which stays that of the start fit.
    theta: Vec<f64>,
    of_d: Vec<f64>,
    by: [[f64; 4]; 4],
}

impl AdaptiveRecursion {
    /// From the batch fit of the start span.
    ///
    /// # Errors
    /// [`IdentError::BadStart`] without a fit.
    pub(super) fn new(options: &TrackOptions, from: &StartState, sample_time: SampleTime) -> Result<Self, IdentError> {
        let bad = |reason: &str| IdentError::BadStart {
            reason: reason.to_owned(),
        };
        if !from.from_fit {
            return Err(bad(
                "adaptive needs the noise model of a batch fit; start it from the fit of a span",
            ));
        }
        let p = from.values.len();
        let element = |i: usize, j: usize| from.variance * from.spread[i * p + j];
        let covariance = std::array::from_fn(|i| std::array::from_fn(|j| element(i, j)));
        let memory = (LEVEL_MEMORY_S / sample_time.s()).max(10.0);
        let level = Level::new(from.variance, from.residuals.clamp(1.0, memory), 1.0 - 1.0 / memory);
        let eta = std::array::from_fn(|i| from.values[i]);
        let d = &from.values[OPERATOR..];
        let suppositions = suppositions(options, sample_time)?;
        let bank = Hypothesis::new(eta, &covariance, level)
            .and_then(|first| Adaptive::new(first, d, suppositions))
            .ok_or_else(|| {
                bad("it lies outside the bounds of the physical parameters, or its covariance is not positive")
            })?;
        let nd = d.len();
        let of_d = (0..nd * nd)
            .map(|k| element(OPERATOR + k / nd, OPERATOR + k % nd))
            .collect();
        let mut recursion = Self {
            bank: Box::new(bank),
            delay: DelayLine::new(vec![0.0; options.orders.nk]),
            sample_time,
            fixed_tau_s: (options.orders.nk as f64 - 1.0) * sample_time.s(),
            theta: from.values.clone(),
            of_d,
            by: [[0.0; 4]; 4],
        };
        recursion.convert();
        Ok(recursion)
    }

    /// theta and the Jacobian of `[b0, b1, f1, f2]`, of the mean of the mixture.
    fn convert(&mut self) {
        let (values, by) = held_operator(self.bank.mixture().eta, self.sample_time.s());
        let p = self.theta.len();
        self.theta[..2].copy_from_slice(&values[..2]);
        self.theta[2..p - 2].copy_from_slice(self.bank.d());
        self.theta[p - 2..].copy_from_slice(&values[2..]);
        self.by = by;
    }
}

impl State for AdaptiveRecursion {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let parts: &mut [&mut dyn State] = &mut [
            &mut *self.bank,
            &mut self.delay,
            &mut self.theta.as_mut_slice(),
            &mut self.by,
        ];
        visit_all(parts, each);
    }
}

impl Recursion for AdaptiveRecursion {
    fn step(&mut self, sample: Sample) -> Taken {
        let x = self.delay.step(sample.e);
        let step = self.bank.step(x, sample.u);
        self.convert();
        step.into()
    }

    fn follow(&mut self, sample: Sample) -> Taken {
        let x = self.delay.step(sample.e);
        self.bank.follow(x, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        let x = self.delay.step(sample.e);
        self.bank.bridge(x);
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// `J C J'` of the operator, and that of d.
    fn covariance(&self, into: &mut [f64]) -> bool {
        let p = self.theta.len();
        let nd = p - OPERATOR;
        let of_eta = self.bank.covariance();
        into.fill(0.0);
        let place = |k: usize| if k < 2 { k } else { nd + k };
        for i in 0..OPERATOR {
            for j in 0..OPERATOR {
                let mut sum = 0.0;
                for k in 0..OPERATOR {
                    for l in 0..OPERATOR {
                        sum += self.by[i][k] * of_eta[k][l] * self.by[j][l];
                    }
                }
                into[place(i) * p + place(j)] = sum;
            }
        }
        for i in 0..nd {
            into[(2 + i) * p + 2..(2 + i) * p + 2 + nd].copy_from_slice(&self.of_d[i * nd..(i + 1) * nd]);
        }
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.bank.mixture().variance
    }

    fn operator(&self) -> Option<OperatorEstimate> {
        let eta = self.bank.mixture().eta;
        let covariance = self.bank.covariance();
        let estimate = |i: usize| Estimate::with_variance(eta[i], covariance[i][i]);
        let [lead, variance] = self.bank.lead(&covariance);
        Some(OperatorEstimate {
            k_e: estimate(0),
            t_l_s: Estimate::with_variance(lead, variance),
            k_e_dot: estimate(1),
            omega_nm_rad_s: estimate(2),
            zeta_nm: estimate(3),
            tau_e_s: Estimate::fixed(self.fixed_tau_s),
        })
    }

    fn change_odds(&self) -> Option<f64> {
        Some(self.bank.odds())
    }

    fn change(&self) -> Option<Change> {
        self.bank.change().map(|c| Change::new(&c, self.sample_time))
    }
}
