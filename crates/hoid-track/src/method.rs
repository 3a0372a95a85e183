//! Self-description of a recursive method.
//!
//! A method consists of its options (a struct made by `settings!`), [`RecursiveMethod`] for these options, and the
//! [`Recursion`] that it builds, all in one file or folder. This makes it a [`Method`](crate::Method), in this or any
//! other crate; a line in the list of `hoid-survey` adds it to the command line, plans, Python and the book.

use std::{any::Any, collections::BTreeMap, fmt};

use hoid_core::recursion::StablePolynomials;
use hoid_ident::{
    Constraint, IdentError,
    settings::{MethodSpec, Setting, Settings},
};
use hoid_model::{Orders, Record, SampleTime, Structure};

use crate::{
    forgetting::ForgettingRule,
    further_input::TrackedInput,
    guard::GuardChoice,
    memory::{Memory, MemoryOptions},
    person_prior::PersonPrior,
    recursion::Recursion,
    setup::Setup,
    shared_options::{GainOptions, WindupGuard},
    start::StartState,
    two_sided::{CausalRun, TwoSidedEstimate},
};

/// Name and description of a method.
pub struct MethodDescription {
    /// Name as typed by users.
    pub name: &'static str,
    /// Definition, in one line without a full stop.
    pub help: &'static str,
    /// Source.
    pub source: &'static str,
    /// Supported structures. Box-Jenkins is the default if it is among them, otherwise the first structure.
    pub structures: &'static [Structure],
    /// Defaults that the method sets for options shared with other methods, as text.
    pub defaults: &'static [(&'static str, &'static str)],
}

/// Object-safe operations of a method: clone and comparison.
pub trait MethodObject: fmt::Debug + Send + Sync {
    /// Returns a copy.
    fn clone_boxed(&self) -> Box<dyn RecursiveMethod>;
    /// True if the other method is the same method with the same options.
    fn is_same(&self, other: &dyn RecursiveMethod) -> bool;
    /// Returns the method as [`Any`], for comparison with other methods.
    fn as_any(&self) -> &dyn Any;
}

impl<M: RecursiveMethod + Clone + PartialEq + 'static> MethodObject for M {
    fn clone_boxed(&self) -> Box<dyn RecursiveMethod> {
        Box::new(self.clone())
    }

    fn is_same(&self, other: &dyn RecursiveMethod) -> bool {
        other.as_any().downcast_ref::<Self>() == Some(self)
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

/// A recursive method with its options.
pub trait RecursiveMethod: Settings + MethodObject + 'static {
    /// Returns the name and description of the method.
    fn description(&self) -> MethodDescription;

    /// Returns the earlier name of the method; `None` if no earlier name is accepted.
    fn earlier_name(&self) -> Option<&'static str> {
        None
    }

    /// Returns the default memory length of a parameter.
    fn default_memory(&self, parameter: &str) -> Memory;

    /// Builds the recursion.
    ///
    /// # Errors
    /// [`IdentError`] for options that contradict each other, or a start that the method cannot use.
    fn build(
        &self,
        setup: &Setup,
        from: &StartState,
        sample_time: SampleTime,
    ) -> Result<Box<dyn Recursion>, IdentError>;

    /// Checks the options against structure and orders.
    ///
    /// # Errors
    /// [`IdentError::BadOption`], which describes the problem.
    fn check(&self, setup: &Setup) -> Result<(), IdentError>;

    /// Checks the options that depend on the sample time.
    ///
    /// # Errors
    /// [`IdentError::BadOption`], which describes the problem.
    fn check_at(&self, _sample_time: SampleTime) -> Result<(), IdentError> {
        Ok(())
    }

    /// Returns the default order nd of the noise model; `None` for the order that follows from the structure.
    fn default_nd(&self) -> Option<usize> {
        None
    }

    /// True for a method that estimates the physical parameters of the operator.
    fn is_physical(&self) -> bool {
        false
    }

    /// True for a method that models how the person changes and has no memory length: it estimates physical parameters
    /// and keeps the noise model of a batch fit.
    fn models_change(&self) -> bool {
        false
    }

    /// True for a method that needs no start fit and updates its estimate from the first sample on.
    fn is_self_starting(&self) -> bool {
        false
    }

    /// Lag of the basis in which the gains are estimated (in s); `None` without a basis.
    fn basis_lag_s(&self) -> Option<f64> {
        None
    }

    /// True if the two-sided estimate of a recorded run is requested.
    fn requests_two_sided(&self) -> bool {
        false
    }

    /// Computes the two-sided estimate of a recorded run, with a row for each row of a causal trace.
    ///
    /// # Errors
    /// [`IdentError::BadStart`] for a start that cannot be used.
    fn two_sided(
        &self,
        _record: &Record,
        _causal: &CausalRun,
        _from: &StartState,
    ) -> Result<Vec<TwoSidedEstimate>, IdentError> {
        Ok(Vec::new())
    }

    /// True for a method that repeatedly fits its stored samples: it needs no start coefficients and no warm-up.
    fn refits_stored_samples(&self) -> bool {
        false
    }

    /// Describes the memory as text; `None` for a method with memory lengths of parameters.
    fn memory_as_text(&self) -> Option<String> {
        None
    }

    /// Returns the options of the gain; `None` if the method does not use the gain of the kernel.
    fn gain(&self) -> Option<&GainOptions> {
        None
    }

    /// Returns the memory lengths of the parameters; `None` if the method has none.
    fn memories(&self) -> Option<&MemoryOptions> {
        self.gain().map(|gain| &gain.memories)
    }

    /// Returns the forgetting rule.
    fn forgetting(&self) -> ForgettingRule {
        self.gain()
            .map_or(ForgettingRule::Exponential, |gain| gain.forgetting.clone())
    }

    /// Returns the multiple of the unit matrix that is P at the start; `None` if P comes from the start fit.
    fn initial_covariance(&self) -> Option<f64> {
        self.gain().and_then(|gain| gain.covariance)
    }

    /// Returns the limit on an innovation in the update, in standard deviations of the innovation.
    fn innovation_limit(&self) -> f64 {
        f64::INFINITY
    }

    /// Returns the limit of P for unexcited parameters; `None` if the limit follows from the start.
    fn windup_guard(&self, _structure: Structure) -> Option<WindupGuard> {
        self.gain().and_then(|gain| gain.windup_guard)
    }

    /// Returns the choice of a guard; `None` if neither the user nor the method specifies one, in which case there is
    /// no guard.
    fn guard(&self) -> Option<GuardChoice> {
        None
    }

    /// True if the recursion has a guard.
    fn is_guarded(&self) -> bool {
        self.guard() == Some(GuardChoice::Yes)
    }

    /// Returns the polynomials that are kept stable.
    fn stable(&self) -> StablePolynomials {
        StablePolynomials::Predictor
    }

    /// Returns the bounds of the physical parameters.
    fn bounds(&self) -> BTreeMap<String, Constraint> {
        BTreeMap::new()
    }

    /// Returns the range of the tracked delay tau_e (in s); `None` if the delay is not tracked.
    fn track_delay_s(&self) -> Option<(f64, f64)> {
        None
    }

    /// True if a tracked tau_e is one of the estimated parameters.
    fn delay_is_parameter(&self) -> bool {
        false
    }

    /// True for a method that tracks the responses to two inputs ([`crate::TrackedInput`]).
    fn supports_further_input(&self) -> bool {
        false
    }

    /// Returns the name of the channel of the external signal that the method uses.
    fn reference_channel(&self) -> Option<&str> {
        None
    }

    /// Returns the prior knowledge of the person before the first sample; `None` for methods without that option.
    fn person_prior(&self) -> Option<&PersonPrior> {
        None
    }

    /// Prior standard deviations of omega_nm in rad/s, zeta_nm and tau_e in s, for methods with a prior.
    fn prior_deviations(&self) -> Option<[f64; 3]> {
        None
    }

    /// Prior standard deviation of the delay of a further input (in s), for methods with a prior.
    fn further_delay_deviation(&self, _further: &TrackedInput, _sample_time: SampleTime) -> Option<f64> {
        None
    }

    /// Sets the prior knowledge of the person; returns false for methods without that option.
    fn set_person_prior(&mut self, _prior: PersonPrior) -> bool {
        false
    }

    /// Sets the options whose defaults depend on the record.
    fn prepare(&mut self, _record: &Record) {}

    /// Removes the settings of parameters that are not known.
    fn retain(&mut self, _known: &dyn Fn(&str) -> bool) {}
}

/// Returns the name, description and options of a method.
pub fn spec(method: &dyn RecursiveMethod) -> MethodSpec {
    let about = method.description();
    let own = |setting: Setting| match about.defaults.iter().find(|(name, _)| *name == setting.name) {
        Some((_, words)) => setting.default(words),
        None => setting,
    };
    MethodSpec {
        name: about.name,
        help: about.help,
        source: about.source,
        structures: about.structures,
        settings: method.list().into_iter().map(own).collect(),
    }
}

/// Builds an error about an option.
pub fn invalid_option(option: &str, found: String, expected: &str) -> IdentError {
    IdentError::BadOption {
        option: option.to_owned(),
        found,
        expected: expected.to_owned(),
    }
}

/// Checks that the orders belong to a Box-Jenkins model of the operator.
///
/// # Errors
/// [`IdentError::BadOption`].
pub fn check_operator_orders(name: &str, setup: &Setup) -> Result<(), IdentError> {
    let o = &setup.orders;
    if !(o.na == 0 && o.nb == 2 && o.nf == 2) {
        return Err(invalid_option(
            &format!("the orders of {name}"),
            format!("{} with {o}", setup.structure),
            "the structure of the operator, bj with nb = 2 and nf = 2; nc and nd are free",
        ));
    }
    Ok(())
}

/// Checks that the delay contains at least the one sample of the zero-order hold.
///
/// # Errors
/// [`IdentError::BadOption`].
pub fn check_delay(orders: &Orders) -> Result<(), IdentError> {
    match orders.nk {
        0 => Err(invalid_option(
            "the delay",
            "nk = 0".to_owned(),
            "nk of 1 or more: the hold alone delays by one sample",
        )),
        _ => Ok(()),
    }
}
