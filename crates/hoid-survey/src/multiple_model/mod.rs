//! The bank of hypotheses of the real-time kernel ([`crate::kernel::multiple_model`]) as a recursion, with assumptions
//! about a person in seconds.
//!
//! If the delay is tracked, other delays are proposed every 1.28 s.
//!
//! The constants were tuned on conditions C3 and C5 with remnants of order 2 and 3; the errors change by a tenth or
//! less if any constant is halved or doubled.

mod prior;
mod smoother;

use std::collections::BTreeMap;

use hoid_core::{
    delay::DelayLine,
    state::{State, visit_all},
};
use hoid_model::{
    Record, SampleTime, Structure,
    uncertainty::{Estimate, OperatorEstimate},
};

use hoid_ident::{Constraint, IdentError, settings, settings::Bounds};

use hoid_track::{
    BoundOptions, Change, DelayOptions, GuardChoice, GuardOptions, Memory, Sample,
    building::{
        CausalRun, MethodDescription, Recursion, RecursiveMethod, ReportedModel, Setup, StartState, StepOutcome,
        TwoSidedEstimate, invalid_option as bad_option,
    },
};

use crate::{
    kernel::multiple_model::{
        MultipleModelFilter, change as kernel_change, hypothesis as kernel, prior::PARAMETER_COUNT, response::Signals,
    },
    known_noise::{MAX_ND, check_model_of_change},
};
use prior::{candidate_delays, change_prior, first_hypothesis, invalid_prior, out_of_range_error};

/// Capacity for hypotheses if the delay is known; `MAX_HYPOTHESES_WITH_DELAYS` is the capacity if it is tracked.
const MAX_HYPOTHESES: usize = 16;
const MAX_HYPOTHESES_WITH_DELAYS: usize = 48;
/// Limit on innovations, in standard deviations.
const INNOVATION_LIMIT: f64 = 3.5;
/// Default order of the noise model; the odds require white innovations.
const DEFAULT_ND: usize = 6;

settings! {
    /// Options of the bank of hypotheses.
    pub struct MultipleModelOptions {
        /// Log odds at which a change is declared
        pub alarm: f64 = 6.0,
        /// Limit on innovations, in standard deviations
        #[setting(bounds(Bounds::Positive), default("3.5"))]
        pub limit: Option<f64> = None,
        /// Smooth a recorded run: use the whole run for each estimate, not only the past (hypotheses run from both
        /// ends)
        pub smooth: bool = false,
    }
    groups {
        /// Bounds of the parameters.
        pub bounds: BoundOptions,
        /// Range of a tracked delay.
        pub delay: DelayOptions,
        /// Options of the guard.
        pub guard: GuardOptions,
    }
}

impl RecursiveMethod for MultipleModelOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: "multiple-model",
            help: "a bank of hypotheses about when the person changed, which sets its own memory and reports changes",
            source: "Andersson 1985; Willsky and Jones 1976; Adams and MacKay 2007; the book, page A person who changes",
            structures: &[Structure::BoxJenkins, Structure::OutputError, Structure::General],
            defaults: &[],
        }
    }

    fn default_nd(&self) -> Option<usize> {
        Some(DEFAULT_ND)
    }

    /// The memory length follows from the model of the change.
    fn default_memory(&self, _parameter: &str) -> Memory {
        Memory::Infinite
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        check_model_of_change("multiple-model", setup)?;
        if self.smooth && self.delay.track_delay_s.is_some() {
            return Err(bad_option(
                "the range of the delay",
                "a tracked delay with the two-sided estimate".to_owned(),
                "a delay given or searched on the start span, because past and future need the same delay",
            ));
        }
        Ok(())
    }

    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        match setup.track_delay_s {
            None => Ok(Box::new(MultipleModelRecursion::<MAX_HYPOTHESES>::new(
                self,
                setup,
                from,
                sample_time,
            )?)),
            Some(_) => Ok(Box::new(MultipleModelRecursion::<MAX_HYPOTHESES_WITH_DELAYS>::new(
                self,
                setup,
                from,
                sample_time,
            )?)),
        }
    }

    fn is_physical(&self) -> bool {
        true
    }

    fn models_change(&self) -> bool {
        true
    }

    fn memory_as_text(&self) -> Option<String> {
        Some(format!(
            "since the last change, by a bank of hypotheses; a change is declared at log odds of {}",
            self.alarm
        ))
    }

    fn requests_two_sided(&self) -> bool {
        self.smooth
    }

    fn two_sided(
        &self,
        record: &Record,
        causal: &CausalRun,
        from: &StartState,
    ) -> Result<Vec<TwoSidedEstimate>, IdentError> {
        smoother::two_sided_estimates(self.alarm, record, causal, from)
    }

    fn guard(&self) -> Option<GuardChoice> {
        self.guard.guard.or(Some(GuardChoice::Yes))
    }

    fn innovation_limit(&self) -> f64 {
        self.limit.unwrap_or(INNOVATION_LIMIT)
    }

    fn bounds(&self) -> BTreeMap<String, Constraint> {
        self.bounds.bound.clone()
    }

    fn track_delay_s(&self) -> Option<(f64, f64)> {
        self.delay.track_delay_s
    }

    fn retain(&mut self, known: &dyn Fn(&str) -> bool) {
        self.bounds.bound.retain(|key, _| known(key));
    }
}

/// The bank with its filters and with a delay line for the shortest delay.
struct MultipleModelRecursion<const M: usize> {
    model: Box<MultipleModelFilter<M, MAX_ND, Vec<Signals>>>,
    delay: DelayLine<Vec<f64>>,
    shortest: usize,
    sample_time: SampleTime,
    reported: ReportedModel,
}

impl<const M: usize> MultipleModelRecursion<M> {
    fn new(
        options: &MultipleModelOptions,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        let (nk, delays) = (setup.orders.nk, candidate_delays(setup, sample_time));
        let shortest = *delays.start();
        if !delays.contains(&nk) {
            return Err(invalid_prior(&format!(
                "its delay of nk = {nk} is not among the tracked delays, {shortest} to {}",
                delays.end()
            )));
        }
        let first = first_hypothesis(from, 1.0, sample_time)?.with_extra_delay(nk - shortest);
        let d = &from.values[PARAMETER_COUNT..];
        let memory = vec![[0.0; 6]; delays.count()];
        let model =
            MultipleModelFilter::with_delays(first, d, change_prior(options.alarm, setup, sample_time)?, memory)
                .ok_or_else(out_of_range_error)?;
        Ok(Self {
            model: Box::new(model),
            delay: DelayLine::new(vec![0.0; shortest]),
            shortest,
            sample_time,
            reported: ReportedModel::new(from, nk, sample_time),
        })
    }

    /// Returns tau_e in s for a mean and a variance of the delay in samples beyond the shortest delay; a known delay
    /// has no variance.
    fn delay_s(&self, [later, variance]: [f64; 2]) -> Estimate {
        let ts = self.sample_time.s();
        let tau_e_s = (self.shortest as f64 - 1.0 + later) * ts;
        match self.model.bank().delay_count() {
            1 => Estimate::fixed(tau_e_s),
            _ => Estimate::with_variance(tau_e_s, variance * ts * ts),
        }
    }
}

/// Converts a change declared by the kernel to seconds; `tau_e_s` is the delay before and after the change.
fn change_in_seconds(change: &kernel_change::Change, tau_e_s: [Estimate; 2], sample_time: SampleTime) -> Change {
    let (before, now) = (&change.before, &change.after);
    let pair = |i: usize| {
        let of = |b: &kernel::Snapshot| {
            if i < 2 {
                b.gain_covariance[i]
            } else {
                b.neuromuscular_variance[i - 2]
            }
        };
        [before, now].map(|b| Estimate::with_variance(b.eta[i], of(b)))
    };
    let lead = |b: &kernel::Snapshot| {
        (b.eta[0] * b.eta[1] + b.gain_covariance[2]) / (b.eta[0] * b.eta[0] + b.gain_covariance[0])
    };
    Change {
        seconds_ago: change.samples_ago as f64 * sample_time.s(),
        odds: change.log_odds,
        k_e: pair(0),
        k_e_dot: pair(1),
        omega_nm_rad_s: pair(2),
        zeta_nm: pair(3),
        tau_e_s,
        t_l_s: [lead(before), lead(now)],
        innovation_variance: [before.innovation_variance, now.innovation_variance],
        z: change.z,
        of_operator: false,
        further: None,
    }
}

impl<const M: usize> State for MultipleModelRecursion<M> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut *self.model, &mut self.delay, &mut self.reported], each);
    }
}

impl<const M: usize> Recursion for MultipleModelRecursion<M> {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        let step = self.model.step(x, sample.u);
        self.reported.set_operator(self.model.bank().mixture().eta);
        step.into()
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        let x = self.delay.step(sample.e);
        self.model.step_without_update(x, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        let x = self.delay.step(sample.e);
        self.model.bridge(x);
    }

    fn theta(&self) -> &[f64] {
        self.reported.theta()
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        self.reported.covariance(&self.model.bank().covariance(), into);
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.model.bank().mixture().variance
    }

    fn operator(&self) -> Option<OperatorEstimate> {
        let bank = self.model.bank();
        let covariance = bank.covariance();
        let operator = self
            .reported
            .operator(bank.mixture().eta, &covariance, bank.lead_time(&covariance));
        Some(OperatorEstimate {
            tau_e_s: self.delay_s(bank.delay()),
            ..operator
        })
    }

    fn change_odds(&self) -> Option<f64> {
        Some(self.model.bank().log_odds())
    }

    fn change(&self) -> Option<Change> {
        let change = self.model.bank().change()?;
        let tau_e_s = [change.before, change.after].map(|b| self.delay_s(b.delay));
        Some(change_in_seconds(&change, tau_e_s, self.sample_time))
    }
}
