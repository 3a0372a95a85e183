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
//! **A further input** has a response with separate gains and a separate delay, and with the neuromuscular system of
//! the response to e. Its polynomials have the delay of their order; its parameters are K_f, K_f_dot and tau_f.
//!
//! **Reported estimate.** The recursion reports the gain and lead whose response is nearest to the response of the
//! gains of the basis ([`AdaptiveFilter::operator`]). The polynomials are this operator after a zero-order hold, with
//! the delay nk.

mod starting_point;

use hoid_core::{
    adaptive::{
        AdaptiveFilter, AdaptivePrior, DYNAMICS_COUNT, DelayPrior, GAIN_COUNT, MAX_NOISE_ORDER, PARAMETER_COUNT,
        TwoInputFilter,
        basis::{Basis, Point},
        correction_places,
        defaults::{self, DefaultOperator, further_delay},
        difference::ParameterGroup,
        first_gain, memory_needed_for,
    },
    state::State,
};
use hoid_ident::{IdentError, settings, settings::Bounds, several_inputs::InputOrders};
use hoid_model::{
    SampleTime, Structure,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_numerics::products::congruence;
use starting_point::{StartingPoint, initial_estimate};

use crate::{
    change::{Change, FurtherChange},
    further_input::{FurtherOperator, TrackedInput},
    guard::{GuardChoice, GuardOptions},
    memory::Memory,
    method::{MethodDescription, RecursiveMethod, check_delay, check_operator_orders, invalid_option as bad_option},
    person_prior::PersonPrior,
    recursion::{Recursion, Sample, StepOutcome},
    reported::ReportedModel,
    response::Response,
    setup::{Setup, StartSource},
    shared_options::DEFAULT_DELAY_S,
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
        if let Some(further) = &setup.further {
            let InputOrders { nb, nf, nk } = further.orders;
            if (nb, nf) != (2, 2) || nk == 0 {
                return Err(bad_option(
                    "the orders of the further input of adaptive",
                    format!("nb = {nb}, nf = {nf}, nk = {nk}"),
                    "nb = 2, nf = 2 and nk of 1 or more: the response has the form of the operator",
                ));
            }
            if self.prior.fit().is_some() {
                return Err(bad_option(
                    "the prior of adaptive",
                    format!("an earlier fit, with the further input {}", further.channel),
                    "population, none or single parameters: a fit has no covariance between the responses to two inputs",
                ));
            }
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
        match &setup.further {
            None => self.build_with_one_input(setup, from, sample_time),
            Some(further) => self.build_with_two_inputs(further, setup, from, sample_time),
        }
    }

    fn supports_further_input(&self) -> bool {
        true
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

    fn further_delay_deviation(&self, further: &TrackedInput, sample_time: SampleTime) -> Option<f64> {
        Some(further_delay_prior(further, sample_time).deviation)
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

impl AdaptiveOptions {
    fn build_with_one_input(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let (prior, point) = self.kernel_prior(setup, sample_time)?;
        let basis =
            Basis::new(point, sample_time.s()).ok_or_else(|| unusable_fit(&format!("a delay of {} s", point.tau)))?;
        let fit = self.prior.fit();
        let known = fit.map(|fit| initial_estimate(fit, &basis, sample_time)).transpose()?;
        let model = AdaptiveFilter::new(prior, self.memory(1, sample_time));
        let model = match &known {
            Some(known) => model.and_then(|model| model.with_initial_estimate(known)),
            None => model,
        };
        let reported = vec![ReportedModel::new(from, setup.orders.nk, sample_time)];
        Ok(Box::new(AdaptiveRecursion::new(model, reported, 0.0)?))
    }

    fn build_with_two_inputs(
        &self,
        further: &TrackedInput,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError> {
        let (prior, _) = self.kernel_prior(setup, sample_time)?;
        let nk = further.orders.nk;
        let delay = further_delay_prior(further, sample_time);
        let model = TwoInputFilter::with_further_input(prior, delay, self.memory(2, sample_time));
        // The coefficients of the further input follow those of the response to e.
        let own = from.values.len() - further.parameter_count();
        let starts = [from.part(0..own), from.part(own..from.values.len())];
        let reported = (starts.iter().zip([setup.orders.nk, nk]))
            .map(|(from, nk)| ReportedModel::new(from, nk, sample_time))
            .collect();
        Ok(Box::new(AdaptiveRecursion::new(model, reported, further.preview_s)?))
    }

    /// Returns the prior of the kernel, and the point at which its basis starts.
    fn kernel_prior(&self, setup: &Setup, sample_time: SampleTime) -> Result<(AdaptivePrior, Point), IdentError> {
        let (ts, nk) = (sample_time.s(), setup.orders.nk);
        let start = StartingPoint::of(
            &self.prior,
            (nk as f64 - 0.5) * ts,
            is_given(nk, sample_time),
            sample_time,
        )?;
        let supposed = DefaultOperator {
            point: start.point,
            spread: start.spread,
            // An nd of 0 or 1 gives no information about the colour of the noise, so the default order is used.
            order: match setup.orders.nd {
                0 | 1 => defaults::NOISE_ORDER,
                nd => nd,
            },
            limit: self.innovation_limit(),
            false_alarms: self.false_alarms,
        };
        Ok((supposed.prior(ts), start.point))
    }

    fn memory(&self, inputs: usize, sample_time: SampleTime) -> Vec<f64> {
        vec![0.0; memory_needed_for(inputs, sample_time.s(), self.replay)]
    }
}

fn further_delay_prior(further: &TrackedInput, sample_time: SampleTime) -> DelayPrior {
    let nk = further.orders.nk;
    further_delay((nk as f64 - 0.5) * sample_time.s(), is_given(nk, sample_time))
}

/// True for a delay that differs from the default and was therefore given by the user.
fn is_given(nk: usize, sample_time: SampleTime) -> bool {
    nk != sample_time.nk(DEFAULT_DELAY_S)
}

/// The filter of the method with its reported estimate, for the sizes of a number of inputs.
struct AdaptiveRecursion<const I: usize, const S: usize, const M: usize, const P: usize> {
    model: Box<AdaptiveFilter<Vec<f64>, I, S, M, P>>,
    /// Polynomials of the response to e with the noise model, and of the response to the further input.
    reported: Vec<ReportedModel>,
    /// Coefficients of all inputs.
    theta: Vec<f64>,
    /// Last known value of the further input.
    last: f64,
    preview_s: f64,
}

impl<const I: usize, const S: usize, const M: usize, const P: usize> AdaptiveRecursion<I, S, M, P> {
    fn new(
        model: Option<AdaptiveFilter<Vec<f64>, I, S, M, P>>,
        reported: Vec<ReportedModel>,
        preview_s: f64,
    ) -> Result<Self, IdentError> {
        let model = model.ok_or_else(|| unusable_fit("this delay, sample time, prior and options"))?;
        let mut made = Self {
            model: Box::new(model),
            reported,
            theta: Vec::new(),
            last: 0.0,
            preview_s,
        };
        match made.model.has_initial_estimate() {
            true => made.report(),
            false => made.join_coefficients(),
        }
        Ok(made)
    }

    /// Returns the inputs of a sample, and whether the further input is known; if not, its last value is used.
    fn inputs(&mut self, sample: Sample) -> ([f64; I], bool) {
        self.last = sample.reference.unwrap_or(self.last);
        let mut inputs = [self.last; I];
        inputs[0] = sample.e;
        (inputs, I == 1 || sample.reference.is_some())
    }

    /// True if an estimate exists and its response is not zero; a response of zero has no gain in dB and no phase.
    fn has_response(&self, [re, im]: [f64; 2]) -> bool {
        self.model.has_started() && (re != 0.0 || im != 0.0)
    }

    fn report(&mut self) {
        for (input, reported) in self.reported.iter_mut().enumerate() {
            let [k, k_dot, omega, zeta, _] = self.model.operator_of(input);
            reported.set_operator([k, k_dot, omega, zeta]);
        }
        self.reported[0].set_noise(self.model.d());
        self.join_coefficients();
    }

    fn join_coefficients(&mut self) {
        self.theta.clear();
        for reported in &self.reported {
            self.theta.extend_from_slice(reported.theta());
        }
    }

    fn response_of(&self, input: usize, omega_rad_s: f64) -> Option<Response> {
        let (value, by) = self.model.response_of_with_derivatives(input, omega_rad_s);
        self.has_response(value).then(|| Response {
            value,
            covariance: congruence(&by, &self.model.state_covariance()),
        })
    }

    /// Returns K_e, K_e_dot, omega, zeta and tau of the response to an input before the last change, and the amounts by
    /// which they changed; the amount is zero for parameters that did not change.
    fn change_estimates(&self, input: usize) -> [[Estimate; PARAMETER_COUNT]; 2] {
        let detector = self.model.detector();
        let map = self.model.gain_and_lead_matrix_of(input);
        let (at, hold) = (
            self.model.basis_of(input).point(),
            0.5 * self.reported[0].sample_time_s(),
        );
        let start = [at.omega, at.zeta, at.tau - hold];
        let (first, places) = (first_gain(input), correction_places(input));
        let gain = |i: usize, state: &[f64], of: &dyn Fn(usize, usize) -> f64| {
            let value = map[i].iter().zip(&state[first..]).map(|(m, s)| m * s).sum();
            let pairs = (0..GAIN_COUNT).flat_map(|a| (0..GAIN_COUNT).map(move |b| (a, b)));
            let variance = pairs
                .map(|(a, b)| map[i][a] * of(first + a, first + b) * map[i][b])
                .sum();
            Estimate::with_variance(value, variance)
        };
        let (contrast, difference) = (detector.contrast(), detector.difference());
        let before = |i: usize| match i {
            0 | 1 => gain(i, &contrast.before, &|a, b| contrast.covariance_before[a][b]),
            _ => {
                let k = places[i - 2];
                Estimate::with_variance(start[i - 2] + contrast.before[k], contrast.covariance_before[k][k])
            }
        };
        let change = |i: usize| match i {
            0 | 1 => gain(i, &difference.value, &|a, b| difference.covariance[a][b]),
            _ => {
                let k = places[i - 2];
                Estimate::with_variance(difference.value[k], difference.covariance[k][k])
            }
        };
        [std::array::from_fn(before), std::array::from_fn(change)]
    }

    /// Returns the parameters of the response to an input before and after the last change, and the changes divided by
    /// their standard errors.
    fn changed_parameters(&self, input: usize) -> ([[Estimate; 2]; PARAMETER_COUNT], [f64; PARAMETER_COUNT]) {
        let [old, by] = self.change_estimates(input);
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
        (std::array::from_fn(|i| [old[i], new(i)]), std::array::from_fn(z))
    }

    fn has_changed(&self, input: usize) -> bool {
        let difference = self.model.detector().difference();
        let of_input = [ParameterGroup::Gains(input), ParameterGroup::Delay(input)];
        of_input.into_iter().any(|group| difference.has_changed(group))
    }

    /// Returns the last declared change.
    fn last_change(&self) -> Option<Change> {
        let detector = self.model.detector();
        let (pairs, z) = self.changed_parameters(0);
        let further = self.further_change();
        let [before, now] = detector.contrast().samples;
        let variance = detector.innovation_variances();
        let log_variance = 2.0 / before + 2.0 / now;
        let level = (variance[1] / variance[0]).ln() / (log_variance * detector.typical_level()).sqrt();
        let [k_e, k_e_dot, omega_nm_rad_s, zeta_nm, tau_e_s] = pairs;
        Some(Change {
            seconds_ago: detector.detection_delay_s(),
            odds: self.change_odds()?,
            k_e,
            k_e_dot,
            omega_nm_rad_s,
            zeta_nm,
            tau_e_s,
            t_l_s: [0, 1].map(|side| k_e_dot[side].value / k_e[side].value),
            innovation_variance: variance,
            z: [z[0], z[1], z[2], z[3], level, z[4]],
            of_operator: I == 1 || self.has_changed(0) || detector.difference().has_changed(ParameterGroup::System),
            further,
        })
    }

    fn further_change(&self) -> Option<FurtherChange> {
        if I == 1 {
            return None;
        }
        let (pairs, z) = self.changed_parameters(1);
        let operator = |side: usize| FurtherOperator {
            k_f: pairs[0][side],
            k_f_dot: pairs[1][side],
            tau_f_s: Estimate {
                value: pairs[4][side].value - self.preview_s,
                ..pairs[4][side]
            },
        };
        Some(FurtherChange {
            operators: [operator(0), operator(1)],
            z: [z[0], z[1], z[4]],
            is_changed: self.has_changed(1),
        })
    }
}

fn unusable_fit(what: &str) -> IdentError {
    IdentError::BadStart {
        reason: format!("the basis cannot be computed for {what}; check nk and the sample time"),
    }
}

impl<const I: usize, const S: usize, const M: usize, const P: usize> State for AdaptiveRecursion<I, S, M, P> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.model.visit(each);
        self.reported.as_mut_slice().visit(each);
        if I > 1 {
            self.last.visit(each);
        }
        self.join_coefficients();
    }
}

impl<const I: usize, const S: usize, const M: usize, const P: usize> Recursion for AdaptiveRecursion<I, S, M, P> {
    fn step(&mut self, sample: Sample) -> StepOutcome {
        let (inputs, is_known) = self.inputs(sample);
        let step = match is_known {
            true => self.model.step_inputs(inputs, sample.u),
            false => self.model.follow_inputs(inputs, sample.u),
        };
        if self.model.has_started() {
            self.report();
        }
        step.into()
    }

    fn step_without_update(&mut self, sample: Sample) -> StepOutcome {
        let (inputs, _) = self.inputs(sample);
        self.model.follow_inputs(inputs, sample.u).into()
    }

    fn bridge(&mut self, sample: Sample) {
        let (inputs, _) = self.inputs(sample);
        self.model.bridge_inputs(inputs);
    }

    fn theta(&self) -> &[f64] {
        &self.theta
    }

    fn covariance(&self, into: &mut [f64]) -> bool {
        if !self.model.has_started() {
            return false;
        }
        let Some(of_d) = self.model.noise_model().covariance() else {
            return false;
        };
        let write_block = |input: usize, block: &mut [f64]| {
            let c = self.model.operator_covariance_of(input);
            let whole = std::array::from_fn(|i| std::array::from_fn(|j| c[i][j]));
            self.reported[input].covariance(&whole, block);
            if input == 0 {
                self.reported[input].write_noise_covariance(&of_d, block);
            }
        };
        if I == 1 {
            write_block(0, into);
            return true;
        }
        into.fill(0.0);
        // The coefficients of different inputs are reported without their covariance.
        let (width, mut first) = (self.theta.len(), 0);
        for (input, reported) in self.reported.iter().enumerate() {
            let own = reported.theta().len();
            let mut block = vec![0.0; own * own];
            write_block(input, &mut block);
            for (i, row) in block.chunks_exact(own).enumerate() {
                let at = (first + i) * width + first;
                into[at..at + own].copy_from_slice(row);
            }
            first += own;
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

    fn further_operator(&self) -> Option<FurtherOperator> {
        if I == 1 {
            return None;
        }
        let (values, covariance) = (self.model.operator_of(1), self.model.operator_covariance_of(1));
        let of = |i: usize, value: f64| Estimate::with_variance(value, covariance[i][i]);
        Some(FurtherOperator {
            k_f: of(0, values[0]),
            k_f_dot: of(1, values[1]),
            tau_f_s: of(4, values[4] - self.preview_s),
        })
    }

    fn change_odds(&self) -> Option<f64> {
        Some(self.model.detector().log_significance())
    }

    fn change(&self) -> Option<Change> {
        self.model.detector().is_change_declared().then(|| self.last_change())?
    }

    fn revised_change(&self) -> Option<Change> {
        self.model.detector().is_change_revised().then(|| self.last_change())?
    }

    fn response(&self, omega_rad_s: f64) -> Option<Response> {
        self.response_of(0, omega_rad_s)
    }

    fn further_response(&self, omega_rad_s: f64) -> Option<Response> {
        let found = (I > 1).then(|| self.response_of(1, omega_rad_s))??;
        // The model has the channel advanced by the preview as its input.
        Some(found.advanced(self.preview_s * omega_rad_s))
    }

    fn response_value(&self, omega_rad_s: f64) -> Option<[f64; 2]> {
        let value = self.model.response(omega_rad_s);
        self.has_response(value).then_some(value)
    }
}

#[cfg(test)]
mod tests;
