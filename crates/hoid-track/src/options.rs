//! Options of a recursive estimate.

use std::borrow::Cow;

use hoid_ident::{Estimator, IdentError, SearchOptions};
use hoid_model::{ContinuousTransferFunction, Orders, Record, SampleTime, Structure};

use crate::{
    forgetting::ForgettingRule,
    further_input::{FURTHER_RESPONSES_RAD_S, TrackedInput, coefficient_names, submatrix},
    idle::default_start_span,
    memory::Memory,
    method::invalid_option,
    methods::Method,
    setup::{Setup, StartSource, parameter_names, polynomial_orders},
    shared_options::DEFAULT_DELAY_S,
    start::check_sample_time,
};

/// Longest preview of a further input, s.
const MAX_PREVIEW_S: f64 = 10.0;

/// Options of a recursive estimate: the method with its own options, and the options that all methods share.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackOptions {
    /// The method, with its options.
    pub method: Method,
    /// The structure.
    pub structure: Structure,
    /// The orders.
    pub orders: Orders,
    /// A further input of the model, for the methods `adaptive`, `rls` and `rpem`. Default none.
    pub further: Option<TrackedInput>,
    /// Start of the recursion. Default: a batch fit of the first third of the record.
    pub start: StartSource,
    /// Time from which the estimate is updated (in s); before it, only the filters are updated. Default: the end of the
    /// start span if P comes from the fit of this span, otherwise the start of the record.
    pub update_from_s: Option<f64>,
    /// Limits of the search in start fits and in fits of windows.
    pub search: SearchOptions,
    /// Magnitude of e or u beyond which a sample counts as faulty. Default 1e6.
    pub largest: f64,
    /// Frequencies at which a trace reports gain and phase, rad/s. Default none.
    pub at_rad_s: Vec<f64>,
    /// The controlled element, for crossover and phase margin. Default none.
    pub controlled_element: Option<ContinuousTransferFunction>,
}

impl TrackOptions {
    /// Default magnitude beyond which a sample counts as faulty.
    pub const DEFAULT_MAX_MAGNITUDE: f64 = 1e6;

    /// Returns the default options for the given orders.
    pub fn new(method: Method, structure: Structure, orders: Orders) -> Self {
        Self {
            method,
            structure,
            orders,
            further: None,
            start: StartSource::Span(None),
            update_from_s: None,
            search: SearchOptions::default(),
            largest: Self::DEFAULT_MAX_MAGNITUDE,
            at_rad_s: Vec::new(),
            controlled_element: None,
        }
    }

    /// Returns the default options of a method that needs no start fit, without prior knowledge of the person.
    pub fn without_prior(method: Method, sample_time: SampleTime) -> Self {
        Self::default_for(method, sample_time.nk(DEFAULT_DELAY_S))
    }

    /// Returns the default options with the default structure and orders of the method, for a delay of nk samples.
    pub fn default_for(method: Method, nk: usize) -> Self {
        let (structure, orders) = (method.default_structure(), method.default_orders(nk));
        Self::new(method, structure, orders)
    }

    /// Sets options of the method from text, such as `[("memory", "256"), ("covariance", "0.1")]`.
    ///
    /// # Errors
    /// Same as [`Method::set`].
    pub fn with(mut self, settings: &[(&str, &str)]) -> Result<Self, IdentError> {
        for (name, text) in settings {
            self.method.set(name, text)?;
        }
        Ok(self)
    }

    /// Returns the batch estimator of the start fit.
    pub fn start_estimator(&self) -> Estimator {
        Estimator {
            search: self.search,
            ..Estimator::new(self.structure, self.orders)
        }
    }

    /// Returns the span of the start fit in a record (in s); `None` without a start fit.
    pub fn start_span(&self, record: &Record) -> Option<(f64, f64)> {
        let StartSource::Span(span) = self.start else {
            return None;
        };
        Some(span.unwrap_or_else(|| default_start_span(record)))
    }

    /// Returns the range of tau_e in s; `None` unless tau_e is one of the estimated parameters.
    pub(crate) fn delay_range_s(&self) -> Option<(f64, f64)> {
        let method = &self.method;
        method.track_delay_s().filter(|_| method.delay_is_parameter())
    }

    /// Returns the lag of the basis of a method with a basis (in s), if its model has one input: the tests of form and
    /// constancy of the response examine the response to e alone.
    pub(crate) fn basis_lag_of_one_input_s(&self) -> Option<f64> {
        self.method.basis_lag_s().filter(|_| self.further.is_none())
    }

    /// Returns the frequencies at which the trace of a method that starts itself contains the response to a further
    /// input, rad/s.
    pub(crate) fn further_rad_s(&self) -> Vec<f64> {
        let mut all = self.at_rad_s.clone();
        all.extend(
            FURTHER_RESPONSES_RAD_S
                .iter()
                .filter(|omega| !self.at_rad_s.contains(omega)),
        );
        all
    }

    /// Returns the names of the estimated parameters: coefficients of theta, or physical parameters.
    pub fn parameter_names(&self) -> Vec<String> {
        let with_delay = self.delay_range_s().is_some();
        let mut names = parameter_names(&self.orders, self.method.is_physical(), with_delay);
        names.extend(self.further.iter().flat_map(TrackedInput::names));
        names
    }

    /// Returns the names of the reported coefficients, in the order of theta.
    pub fn coefficient_names(&self) -> Vec<String> {
        coefficient_names(&self.polynomial_orders(), self.further.as_ref())
    }

    /// Returns the coefficients of the model of the first input and their covariance, by rows.
    pub(crate) fn first_input_part<'t>(
        &self,
        theta: &'t [f64],
        covariance: Option<&'t [f64]>,
    ) -> (&'t [f64], Option<Cow<'t, [f64]>>) {
        if self.further.is_none() {
            return (theta, covariance.map(Cow::Borrowed));
        }
        let first = self.polynomial_orders().parameter_count();
        let places: Vec<usize> = (0..first).collect();
        let own = covariance.map(|c| Cow::Owned(submatrix(c, theta.len(), &places)));
        (&theta[..first], own)
    }

    /// Returns the number of reported coefficients.
    pub(crate) fn coefficient_count(&self) -> usize {
        self.polynomial_orders().parameter_count() + self.further.as_ref().map_or(0, TrackedInput::parameter_count)
    }

    /// Returns the orders of the reported polynomials.
    pub(crate) fn polynomial_orders(&self) -> Orders {
        polynomial_orders(self.orders, self.delay_range_s().is_some())
    }

    /// Returns the memory of each parameter, in the order of [`TrackOptions::parameter_names`].
    ///
    /// # Errors
    /// [`IdentError::UnknownParameter`] for a memory of a parameter that does not exist.
    pub fn memories(&self) -> Result<Vec<Memory>, IdentError> {
        let (names, method) = (self.parameter_names(), &self.method);
        let given = method.memories();
        if let Some(unknown) = given.and_then(|given| given.unknown_name(&names)) {
            return Err(IdentError::UnknownParameter {
                name: unknown.clone(),
                available: names.join(", "),
            });
        }
        let of = |name: &String| {
            let own = given.and_then(|given| given.given_memory(name));
            own.unwrap_or_else(|| method.default_memory(name))
        };
        Ok(names.iter().map(of).collect())
    }

    /// Returns the components of the recursion.
    ///
    /// # Errors
    /// Same as [`TrackOptions::memories`].
    pub(crate) fn setup(&self) -> Result<Setup, IdentError> {
        let method = &self.method;
        Ok(Setup {
            structure: self.structure,
            orders: self.orders,
            further: self.further.clone(),
            start: self.start.clone(),
            search: self.search,
            memories: self.parameter_names().into_iter().zip(self.memories()?).collect(),
            forgetting: method.forgetting(),
            covariance: method.initial_covariance(),
            windup_guard: method.windup_guard(self.structure),
            limit: method.innovation_limit(),
            stable: method.stable(),
            starts_itself: method.is_self_starting(),
            is_physical: method.is_physical(),
            bounds: method.bounds(),
            track_delay_s: method.track_delay_s(),
            delay_parameter_s: self.delay_range_s(),
        })
    }

    /// Checks the options as [`TrackOptions::check`] does, and also the options that depend on the sample time.
    ///
    /// # Errors
    /// [`IdentError`], which describes the problem.
    pub(crate) fn check_at(&self, sample_time: SampleTime) -> Result<(), IdentError> {
        check_sample_time(sample_time)?;
        self.check()?;
        self.method.check_at(sample_time)?;
        match self.method.person_prior() {
            Some(prior) => prior.check(sample_time, ["", ""]),
            None => Ok(()),
        }
    }

    /// Checks a further input against method and options.
    fn check_further_input(&self, setup: &Setup) -> Result<(), IdentError> {
        let Some(further) = &self.further else {
            return Ok(());
        };
        let refused = |found: String, expected: &str| Err(invalid_option("a further input", found, expected));
        let name = self.method.name();
        if !self.method.supports_further_input() {
            return refused(
                format!("{} with the method {name}", further.channel),
                "the method adaptive, rls or rpem; the other methods track the response to one input",
            );
        }
        if setup.track_delay_s.is_some() {
            return refused(
                format!("{} and track_delay", further.channel),
                "no track_delay: with a further input the delays are fixed",
            );
        }
        if self.method.is_guarded() && !self.method.is_self_starting() {
            return refused(
                format!("{} and guard = yes", further.channel),
                "guard = no: the guard compares the estimate with a start model, which has one input",
            );
        }
        if further.preview_s > 0.0 && !self.method.is_self_starting() {
            return refused(
                format!("{} with a preview and the method {name}", further.channel),
                "no preview with polynomials; the method adaptive has a preview",
            );
        }
        if !(0.0..=MAX_PREVIEW_S).contains(&further.preview_s) {
            return refused(
                format!("{} with {} s of preview", further.channel, further.preview_s),
                "0 to 10 s of preview",
            );
        }
        further.batch_model(self.structure, &self.orders, self.search).check()
    }

    /// Checks that the method, the structure, the orders and the options are compatible.
    ///
    /// # Errors
    /// [`IdentError`], which describes the problem.
    pub fn check(&self) -> Result<(), IdentError> {
        self.orders.check(self.structure)?;
        let (setup, method) = (self.setup()?, &self.method);
        self.check_further_input(&setup)?;
        method.check(&setup)?;
        setup.forgetting.check()?;
        if let Some((low, high)) = setup.track_delay_s
            && !(0.0 <= low && low <= high && high.is_finite())
        {
            return Err(invalid_option(
                "the range of the delay",
                format!("{:?} s", (low, high)),
                "two finite nonnegative times, the shorter time first",
            ));
        }
        if let Some(p) = setup.covariance
            && !(p > 0.0 && p.is_finite())
        {
            return Err(invalid_option(
                "the start covariance",
                p.to_string(),
                "a positive number, such as 0.1",
            ));
        }
        if let (Some(_), ForgettingRule::Window | ForgettingRule::Gradient(_)) = (setup.windup_guard, &setup.forgetting)
        {
            return Err(invalid_option(
                "windup_guard",
                "window or gradient forgetting, in which P does not grow".to_owned(),
                "forgetting = exponential, random-walk, variable or directional; or omit windup_guard",
            ));
        }
        if setup.limit.is_nan() || setup.limit <= 0.0 {
            return Err(invalid_option(
                "the limit on innovations",
                setup.limit.to_string(),
                "a positive multiple of sigma, or inf",
            ));
        }
        if self.largest.is_nan() || self.largest <= 0.0 {
            return Err(invalid_option(
                "the largest magnitude",
                self.largest.to_string(),
                "a positive number",
            ));
        }
        let wrong = self.at_rad_s.iter().find(|w| !(w.is_finite() && **w > 0.0));
        if let Some(wrong) = wrong {
            return Err(invalid_option(
                "a frequency of the response",
                format!("{wrong} rad/s"),
                "positive frequencies in rad/s, such as 0.5,1,2.5",
            ));
        }
        Ok(())
    }
}
