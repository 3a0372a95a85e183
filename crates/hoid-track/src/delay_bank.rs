//! A delay that is tracked in whole samples, for any recursion with a given delay. There is one recursion for each
//! delay of a range, and the recursion that predicts best is reported (D. T. Magill, *Optimal adaptive estimation of
//! sampled stochastic processes*, 1965; with evidence that is forgotten as in A. H. Jazwinski, *Stochastic Processes
//! and Filtering Theory*, 1970, section 8.8).
//!
//! With the a-priori innovation eps_k of the recursion with the delay k, and the innovation variance sigma^2 of the
//! reported recursion, the logarithm of the evidence for the delay k is
//!
//! `L_k(t) = gamma L_k(t-1) - eps_k(t)^2/(2 sigma^2)`,  `gamma = 1 - Ts/T`,
//!
//! with T = 10 s: evidence from before a change fades with time. Another delay is reported once its L_k leads by 2. Its
//! recursion has been running all the time, so the estimate need not restart. The weights `p_k` are proportional to
//! `exp(L_k/3)`, because neighbouring innovations of a wrong model repeat the same information. (For a constant delay,
//! 95 % bands contain the delay in 82 % of cases without the factor 3, and in 95 % with it.) tau_e is reported as the
//! weighted mean of the delays; its variance is the weighted variance of the delays plus the variance of a delay
//! uniformly distributed between two samples, `Ts^2/12`.
//!
//! Before there is any evidence, the delay is distributed about the delay of the start,
//! `L_k = -(tau_k - tau_start)^2/(2 s^2)` with s = 0.03 s; this prior fades like all evidence. Innovations are limited
//! to [`INNOVATION_LIMIT`] standard deviations, so a single outlier does not decide. While the estimate is kept
//! constant, the evidence is not updated, because all recursions except one then have coefficients that belong to
//! another delay.

use hoid_core::state::{State, visit_all};
use hoid_model::{MAX_DELAY, Orders, SampleTime, uncertainty::Estimate};

use hoid_ident::IdentError;

use crate::{
    method::invalid_option,
    recursion::{Delay, Recursion, Sample, StepOutcome},
    setup::Setup,
};

/// Memory length of the evidence, s.
const MEMORY_S: f64 = 10.0;
/// Lead in the logarithm of the evidence from which another delay is reported.
const MIN_EVIDENCE_MARGIN: f64 = 2.0;
/// Divisor of the evidence in the weights of the delays.
const EVIDENCE_DIVISOR: f64 = 3.0;
/// Limit on the magnitude of an innovation in the evidence, in standard deviations.
const INNOVATION_LIMIT: f64 = 5.0;
/// Prior standard deviation of the delay about the delay of the start, s.
const PRIOR_DEVIATION_S: f64 = 0.03;
/// Largest number of tracked delays.
const MAX_DELAYS: usize = 128;

/// A bank with one recursion for each delay.
pub(crate) struct DelayBank {
    members: Vec<Box<dyn Recursion>>,
    /// nk of the first recursion.
    first_nk: usize,
    sample_time_s: f64,
    /// Factor gamma by which the evidence decays per sample.
    decay: f64,
    /// L_k of each delay, minus the largest of these values.
    evidence: Vec<f64>,
    best: usize,
    /// Innovation of each recursion at the last sample.
    innovations: Vec<f64>,
}

impl State for DelayBank {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        for member in &mut self.members {
            member.visit(each);
        }
        visit_all(&mut [&mut self.evidence.as_mut_slice(), &mut self.best], each);
        self.best = self.best.min(self.members.len().saturating_sub(1));
    }
}

impl DelayBank {
    /// Builds the bank for the delay range of a setup; `build` makes the recursion for a setup with a single delay.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a range of too many samples; the errors of `build`.
    pub(crate) fn new(
        setup: &Setup,
        (low_s, high_s): (f64, f64),
        sample_time: SampleTime,
        build: impl Fn(&Setup) -> Result<Box<dyn Recursion>, IdentError>,
    ) -> Result<Self, IdentError> {
        let (first_nk, last_nk) = (sample_time.nk(low_s), sample_time.nk(high_s));
        let count = last_nk.saturating_sub(first_nk).saturating_add(1);
        if count > MAX_DELAYS {
            return Err(invalid_option(
                "the range of the delay",
                format!("{low_s} to {high_s} s, {count} samples"),
                &format!("at most {MAX_DELAYS} samples; narrow the range, or sample more slowly"),
            ));
        }
        if last_nk > MAX_DELAY {
            return Err(invalid_option(
                "the range of the delay",
                format!("{low_s} to {high_s} s, {last_nk} samples"),
                &format!("delays of at most {MAX_DELAY} samples"),
            ));
        }
        let of = |nk: usize| {
            build(&Setup {
                orders: Orders { nk, ..setup.orders },
                track_delay_s: None,
                ..setup.clone()
            })
        };
        let members = (first_nk..=last_nk).map(of).collect::<Result<Vec<_>, _>>()?;
        // The delay of the start fit, limited to the range.
        let best = setup.orders.nk.clamp(first_nk, last_nk).saturating_sub(first_nk);
        let before = |k: usize| -0.5 * ((k as f64 - best as f64) * sample_time.s() / PRIOR_DEVIATION_S).powi(2);
        Ok(Self {
            members,
            first_nk,
            sample_time_s: sample_time.s(),
            decay: 1.0 - (sample_time.s() / MEMORY_S).min(0.5),
            evidence: (0..count).map(before).collect(),
            best,
            innovations: vec![0.0; count],
        })
    }

    /// Returns the recursion whose estimate is reported.
    #[expect(
        clippy::indexing_slicing,
        reason = "`best` is the index of a member, also after a restore"
    )]
    fn reported_recursion(&self) -> &dyn Recursion {
        &*self.members[self.best]
    }

    fn update_weights(&mut self) {
        let variance = self.reported_recursion().innovation_variance();
        if !(variance > 0.0 && variance.is_finite()) {
            return;
        }
        let mut most = f64::NEG_INFINITY;
        for (evidence, innovation) in self.evidence.iter_mut().zip(&self.innovations) {
            let square = (innovation * innovation / variance).min(INNOVATION_LIMIT * INNOVATION_LIMIT);
            // A NaN innovation counts as the largest possible one.
            let square = if square.is_nan() {
                INNOVATION_LIMIT * INNOVATION_LIMIT
            } else {
                square
            };
            *evidence = self.decay * *evidence - 0.5 * square;
            most = most.max(*evidence);
        }
        self.evidence.iter_mut().for_each(|evidence| *evidence -= most);
        if self
            .evidence
            .get(self.best)
            .is_some_and(|evidence| *evidence < -MIN_EVIDENCE_MARGIN)
        {
            let leads = |(_, evidence): &(usize, &f64)| **evidence >= 0.0;
            self.best = self
                .evidence
                .iter()
                .enumerate()
                .find(leads)
                .map_or(self.best, |(k, _)| k);
        }
    }
}

impl Recursion for DelayBank {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let mut outcome = StepOutcome {
            innovation: 0.0,
            shortened: false,
        };
        for (k, (member, innovation)) in self.members.iter_mut().zip(&mut self.innovations).enumerate() {
            let of = member.step(sample);
            *innovation = of.innovation;
            if k == self.best {
                outcome = of;
            }
        }
        self.update_weights();
        outcome
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        let mut outcome = StepOutcome {
            innovation: 0.0,
            shortened: false,
        };
        for (k, member) in self.members.iter_mut().enumerate() {
            let of = member.step_without_update(sample);
            if k == self.best {
                outcome = of;
            }
        }
        outcome
    }

    fn bridge(&mut self, sample: Sample) {
        self.members.iter_mut().for_each(|member| member.bridge(sample));
    }

    fn theta(&self) -> &[f64] {
        self.reported_recursion().theta()
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        self.reported_recursion().covariance(into)
    }

    fn innovation_variance(&self) -> f64 {
        self.reported_recursion().innovation_variance()
    }

    fn delay(&self) -> Option<Delay> {
        let weights: Vec<f64> = self
            .evidence
            .iter()
            .map(|evidence| (evidence / EVIDENCE_DIVISOR).exp())
            .collect();
        let sum: f64 = weights.iter().sum();
        let moment = |of: &dyn Fn(f64) -> f64| {
            let each = weights.iter().enumerate().map(|(k, weight)| weight * of(k as f64));
            each.sum::<f64>() / sum
        };
        let mean = moment(&|k| k);
        let variance = moment(&|k| (k - mean) * (k - mean)) + 1.0 / 12.0;
        let ts = self.sample_time_s;
        // A zero-order hold adds a delay of one sample.
        let tau_s = (self.first_nk as f64 - 1.0 + mean) * ts;
        Some(Delay {
            nk: self.first_nk.saturating_add(self.best),
            tau_e_s: Estimate::with_variance(tau_s, variance * ts * ts),
        })
    }
}
