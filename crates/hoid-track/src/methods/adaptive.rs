//! The adaptive recursion ([`hoid_core::adaptive`]) as a method with the common interface of the recursions. Its
//! defaults are for people and in seconds.
//!
//! The method needs no start fit: it starts with the defaults for people ([`hoid_core::adaptive::defaults`]). The
//! initial delay follows from nk (0.2 s if nothing is specified), plus half a sample for an error that is held.
//!
//! **Prior knowledge of the person** before the first sample is selected by the option `prior`: the default, almost
//! none, some parameters, or an earlier fit, from whose estimate and covariance the recursion starts
//! (`starting_point`).
//!
//! **Reported estimate.** The recursion reports the gain and lead whose response is nearest to the response of the
//! gains of the basis ([`AdaptiveFilter::operator`]). The polynomials are this operator after a zero-order hold, with
//! the delay nk.

mod starting_point;

use hoid_core::{
    adaptive::{
        AdaptiveFilter, DYNAMICS_COUNT, GAIN_COUNT, LINEAR_COUNT, MAX_NOISE_ORDER, PARAMETER_COUNT,
        basis::Basis,
        defaults::{self, DefaultOperator},
        memory_needed,
    },
    state::{State, visit_all},
};
use hoid_ident::{IdentError, settings, settings::Bounds};
use hoid_model::{
    SampleTime, Structure,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_numerics::products::congruence;
use starting_point::{StartingPoint, initial_estimate};

use crate::{
    change::Change,
    guard::{GuardChoice, GuardOptions},
    memory::Memory,
    method::{MethodDescription, RecursiveMethod, check_delay, check_operator_orders, invalid_option as bad_option},
    person_prior::PersonPrior,
    recursion::{Recursion, Sample, StepOutcome},
    reported::ReportedModel,
    response::Response,
    setup::{DEFAULT_DELAY_S, Setup, StartSource},
    start::StartState,
};

settings! {
    /// Options of the recursion with gains in a basis for people.
    pub struct AdaptiveOptions {
        /// Accepted false alarms per hour (lower: fewer changes are detected, and later)
        #[setting(unit("1/h"), bounds(Bounds::PositiveFinite))]
        pub false_alarms: f64 = 1.0,
        /// Limit on innovations, in standard deviations
        #[setting(bounds(Bounds::Positive), default("8"))]
        pub limit: Option<f64> = None,
        /// Length of past data that are replayed (0: each sample is used once, as on a microcontroller)
        #[setting(unit("s"), bounds(Bounds::NonNegative))]
        pub replay: f64 = defaults::REPLAY_SPAN_S,
        /// Prior knowledge of the person: population, none, NAME=CENTRE:SPREAD for omega_nm, zeta_nm, tau_e, T_I
        /// (relative spread), or a file from hoid identify --json
        #[setting(default("population"))]
        pub prior: PersonPrior = PersonPrior::Population,
    }
    groups {
        /// Option of the guard.
        pub guard: GuardOptions,
    }
}

impl RecursiveMethod for AdaptiveOptions {
    fn description(&self) -> MethodDescription {
        MethodDescription {
            name: "adaptive",
            help: "gains in a basis common to all people, with its own noise model; needs no start fit",
            source: "McRuer and Jex 1967; Magill 1965; Chow 1960; White 1980; the book, page The default tracker",
            structures: &[Structure::BoxJenkins, Structure::OutputError, Structure::General],
            defaults: &[],
        }
    }

    fn earlier_name(&self) -> Option<&'static str> {
        Some("population")
    }

    fn default_nd(&self) -> Option<usize> {
        Some(defaults::NOISE_ORDER)
    }

    /// Returns an infinite memory, which is not used: the memory follows from the weights of the drifts.
    fn default_memory(&self, _parameter: &str) -> Memory {
        Memory::Infinite
    }

    fn check(&self, setup: &Setup) -> Result<(), IdentError> {
        check_operator_orders("adaptive", setup)?;
        check_delay(&setup.orders)?;
        let o = &setup.orders;
        if o.nc != 0 || o.nd > MAX_NOISE_ORDER {
            return Err(bad_option(
                "the noise model of adaptive",
                format!("nc={},nd={}", o.nc, o.nd),
                "nc = 0 and nd of at most 24",
            ));
        }
        let start = match setup.start {
            StartSource::Theta(_) => Some("coefficients"),
            StartSource::Nothing => Some("nothing"),
            StartSource::Span(_) => None,
        };
        if let Some(start) = start {
            return Err(bad_option(
                "the start of adaptive",
                start.to_owned(),
                "a prior instead: adaptive starts from the defaults for people, from almost no knowledge (prior = \
                 none) or from an earlier fit of the person; rpem, physical and rls accept a start",
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
        Ok(Box::new(AdaptiveRecursion::new(self, setup, from, sample_time)?))
    }

    fn is_physical(&self) -> bool {
        true
    }

    fn is_self_starting(&self) -> bool {
        true
    }

    fn memory_as_text(&self) -> Option<String> {
        Some(format!(
            "all samples since the last change; changes are declared with {} expected false alarm{} per hour",
            self.false_alarms,
            if self.false_alarms == 1.0 { "" } else { "s" }
        ))
    }

    fn guard(&self) -> Option<GuardChoice> {
        self.guard.guard.or(Some(GuardChoice::Yes))
    }

    fn innovation_limit(&self) -> f64 {
        self.limit.unwrap_or(defaults::INNOVATION_LIMIT)
    }

    fn prior_deviations(&self) -> Option<[f64; DYNAMICS_COUNT]> {
        // Parameters that an earlier fit determined count as known, regardless of the data.
        let known = self.prior.fit().is_some();
        let StartingPoint { point, spread } = StartingPoint::of(&self.prior, 0.0, false, SampleTime::AT_100_HZ).ok()?;
        (!known).then_some([spread[0] * point.omega, spread[1] * point.zeta, spread[2]])
    }

    fn basis_lag_s(&self) -> Option<f64> {
        let StartingPoint { point, .. } = StartingPoint::of(&self.prior, 0.0, false, SampleTime::AT_100_HZ).ok()?;
        Some(point.lag)
    }

    fn person_prior(&self) -> Option<&PersonPrior> {
        Some(&self.prior)
    }

    fn set_person_prior(&mut self, prior: PersonPrior) -> bool {
        self.prior = prior;
        true
    }
}

/// The filter of the method with its reported estimate.
struct AdaptiveRecursion {
    model: Box<AdaptiveFilter<Vec<f64>>>,
    reported: ReportedModel,
}

impl AdaptiveRecursion {
    fn new(
        options: &AdaptiveOptions,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Self, IdentError> {
        let ts = sample_time.s();
        let nk = setup.orders.nk;
        // A delay that differs from the default was given by the user.
        let is_given = nk != sample_time.nk(DEFAULT_DELAY_S);
        let beginning = StartingPoint::of(&options.prior, (nk as f64 - 0.5) * ts, is_given, sample_time)?;
        let point = beginning.point;
        let basis = Basis::new(point, ts).ok_or_else(|| unusable_fit(&format!("a delay of {} s", point.tau)))?;
        let fit = options.prior.fit();
        let known = fit.map(|fit| initial_estimate(fit, &basis, sample_time)).transpose()?;
        let supposed = DefaultOperator {
            point,
            spread: beginning.spread,
            // An nd of 0 or 1 gives no information about the colour of the noise, so the default order is used.
            order: match setup.orders.nd {
                0 | 1 => defaults::NOISE_ORDER,
                nd => nd,
            },
            limit: options.innovation_limit(),
            false_alarms: options.false_alarms,
        };
        let memory = vec![0.0; memory_needed(ts, options.replay)];
        let model = AdaptiveFilter::new(supposed.prior(ts), memory);
        let model = match &known {
            Some(known) => model.and_then(|model| model.with_initial_estimate(known)),
            None => model,
        };
        let model = model.ok_or_else(|| unusable_fit("this delay, sample time, prior and options"))?;
        let mut made = Self {
            model: Box::new(model),
            reported: ReportedModel::new(from, nk, sample_time),
        };
        if known.is_some() {
            made.report();
        }
        Ok(made)
    }

    /// True if an estimate exists and its response is not zero; a response of zero has no gain in dB and no phase.
    fn has_response(&self, [re, im]: [f64; 2]) -> bool {
        self.model.has_started() && (re != 0.0 || im != 0.0)
    }

    fn report(&mut self) {
        let [k_e, k_e_dot, omega, zeta, _] = self.model.operator();
        self.reported.set_operator([k_e, k_e_dot, omega, zeta]);
        self.reported.set_noise(self.model.d());
    }

    /// Returns K_e, K_e_dot, omega, zeta and tau before the last change, and the amounts by which they changed; the
    /// amount is zero for parameters that did not change.
    fn change_estimates(&self) -> [[Estimate; PARAMETER_COUNT]; 2] {
        let detector = self.model.detector();
        let map = self.model.gain_and_lead_matrix();
        let (at, hold) = (self.model.basis().point(), 0.5 * self.reported.sample_time_s());
        let beginning = [at.omega, at.zeta, at.tau - hold];
        let gain = |i: usize, state: &[f64], of: &dyn Fn(usize, usize) -> f64| {
            let value = map[i].iter().zip(state).map(|(m, s)| m * s).sum();
            let pairs = (0..GAIN_COUNT).flat_map(|a| (0..GAIN_COUNT).map(move |b| (a, b)));
            let variance = pairs.map(|(a, b)| map[i][a] * of(a, b) * map[i][b]).sum();
            Estimate::with_variance(value, variance)
        };
        let (told, by) = (detector.contrast(), detector.difference());
        let before = |i: usize| match i {
            0 | 1 => gain(i, &told.before, &|a, b| told.covariance_before[a][b]),
            _ => {
                let k = LINEAR_COUNT + i - 2;
                Estimate::with_variance(beginning[i - 2] + told.before[k], told.covariance_before[k][k])
            }
        };
        let difference = |i: usize| match i {
            0 | 1 => gain(i, &by.value, &|a, b| by.covariance[a][b]),
            _ => {
                let k = LINEAR_COUNT + i - 2;
                Estimate::with_variance(by.value[k], by.covariance[k][k])
            }
        };
        [std::array::from_fn(before), std::array::from_fn(difference)]
    }
}

fn unusable_fit(what: &str) -> IdentError {
    IdentError::BadStart {
        reason: format!("the basis cannot be computed for {what}; check nk and the sample time"),
    }
}

impl State for AdaptiveRecursion {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut *self.model, &mut self.reported], each);
    }
}

impl Recursion for AdaptiveRecursion {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let step = self.model.step(sample.e, sample.u);
        if self.model.has_started() {
            self.report();
        }
        step.into()
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        self.model.step_without_update(sample.e, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        self.model.bridge(sample.e);
    }

    fn theta(&self) -> &[f64] {
        self.reported.theta()
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        if !self.model.has_started() {
            return false;
        }
        let c = self.model.operator_covariance();
        let whole = std::array::from_fn(|i| std::array::from_fn(|j| c[i][j]));
        self.reported.covariance(&whole, into);
        match self.model.noise_model().covariance() {
            Some(of_d) => self.reported.write_noise_covariance(&of_d, into),
            None => return false,
        }
        true
    }

    fn innovation_variance(&self) -> f64 {
        self.model.variance()
    }

    fn operator(&self) -> Option<OperatorEstimate> {
        let (values, covariance) = (self.model.operator(), self.model.operator_covariance());
        let [lead, lead_variance] = match self.model.has_started() {
            true => self.model.lead_time(),
            false => [f64::NAN; 2],
        };
        let of = |i: usize| Estimate::with_variance(values[i], covariance[i][i]);
        Some(OperatorEstimate {
            k_e: of(0),
            t_l_s: Estimate::with_variance(lead, lead_variance),
            k_e_dot: of(1),
            omega_nm_rad_s: of(2),
            zeta_nm: of(3),
            tau_e_s: of(4),
        })
    }

    fn change_odds(&self) -> Option<f64> {
        Some(self.model.detector().log_significance())
    }

    fn change(&self) -> Option<Change> {
        let detector = self.model.detector();
        if !detector.is_change_declared() {
            return None;
        }
        let [old, by] = self.change_estimates();
        let z = |i: usize| match by[i].standard_error {
            Some(error) if error > 0.0 => by[i].value / error,
            _ => 0.0,
        };
        // Parameters that did not change keep their values.
        let new = |i: usize| match by[i].value == 0.0 {
            true => old[i],
            false => Estimate {
                value: old[i].value + by[i].value,
                ..by[i]
            },
        };
        let pair = |i: usize| [old[i], new(i)];
        let told = detector.contrast();
        let variance = detector.innovation_variances();
        let log_variance = 2.0 / told.samples[0] + 2.0 / told.samples[1];
        let level = (variance[1] / variance[0]).ln() / (log_variance * detector.typical_level()).sqrt();
        Some(Change {
            seconds_ago: detector.detection_delay_s(),
            odds: self.change_odds()?,
            k_e: pair(0),
            k_e_dot: pair(1),
            omega_nm_rad_s: pair(2),
            zeta_nm: pair(3),
            tau_e_s: pair(4),
            t_l_s: [old[1].value / old[0].value, new(1).value / new(0).value],
            innovation_variance: variance,
            z: [z(0), z(1), z(2), z(3), level, z(4)],
            of_operator: true,
        })
    }

    fn response(&self, omega_rad_s: f64) -> Option<Response> {
        let (value, by) = self.model.response_with_derivatives(omega_rad_s);
        self.has_response(value).then(|| Response {
            value,
            covariance: congruence(&by, &self.model.state_covariance()),
        })
    }

    fn response_value(&self, omega_rad_s: f64) -> Option<[f64; 2]> {
        let value = self.model.response(omega_rad_s);
        self.has_response(value).then_some(value)
    }
}

#[cfg(test)]
mod tests;
