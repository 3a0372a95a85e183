//! Estimator based on the prediction error method, with its options.
//!
//! The estimator contains the options, validates them and starts the fit; the method itself is in [`crate::pem`].

use std::collections::BTreeMap;

use hoid_lanes::InstructionSet;
use hoid_model::{Orders, Record, Structure};

use crate::{
    Constraint, Fit, IdentError, InitialState, Loss, Prior, SearchOptions,
    faults::limited_records,
    pem::{batched, fit_settings::FitSettings, prediction_focus, simulation_focus},
};

/// Purpose of the fitted model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Focus {
    /// One-step-ahead prediction by the prediction error method, which is efficient if the structure is right.
    #[default]
    Prediction,
    /// Simulation from the input only: the system from e to u minimises the simulation error, and the noise model is
    /// fitted to the remainder. In a closed loop the system is then biased by the feedback.
    Simulation,
}

hoid_model::named_choice!(Focus, "focus", 2, { Prediction => "prediction", Simulation => "simulation" });

/// Structure, orders and options of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimator {
    /// The structure.
    pub structure: Structure,
    /// The orders.
    pub orders: Orders,
    /// Initial states of each record. Default (`None`): automatic, which means `Estimate` for a structure with an input
    /// and `Backcast` for a structure without one, whose output is assumed to be stationary before the record too.
    pub initial_state: Option<InitialState>,
    /// Search method and limits of the search.
    pub search: SearchOptions,
    /// Number of automatic starts from which the search runs to completion; the lowest minimum is used. Default 2.
    pub starts: usize,
    /// User-defined start of the search, which replaces the automatic starts: theta in the order of
    /// [`Orders::parameter_names`].
    pub start: Option<Vec<f64>>,
    /// Fixed and bounded coefficients, by name.
    pub constraints: BTreeMap<String, Constraint>,
    /// Weighted prior guesses of coefficients, by name.
    pub priors: BTreeMap<String, Prior>,
    /// Loss function of the residuals. Default: quadratic. With a robust loss, each sample of e and u is first limited
    /// to four standard deviations from the value interpolated from its neighbours ([`crate::faults::limited_record`]).
    pub loss: Loss,
    /// Purpose of the model. Default: prediction.
    pub focus: Focus,
    /// True if u of each record contains a constant that is not a response to e; the constant is estimated like the
    /// initial states ([`crate::level`]). Ignored with initial states of zero. Default false.
    pub level: bool,
    /// True if A is constrained to be stable too, so the model from e to u is stable; C and F are always stable.
    /// Default false.
    pub stable: bool,
}

impl Estimator {
    /// Creates an estimator with the default options.
    pub fn new(structure: Structure, orders: Orders) -> Self {
        Self {
            structure,
            orders,
            initial_state: None,
            search: SearchOptions::default(),
            starts: 2,
            start: None,
            constraints: BTreeMap::new(),
            priors: BTreeMap::new(),
            loss: Loss::default(),
            focus: Focus::default(),
            level: false,
            stable: false,
        }
    }

    /// Returns a copy of the estimator with other orders and without the user-defined start, which would not fit these
    /// orders.
    pub fn with_orders(&self, orders: Orders) -> Self {
        Self {
            orders,
            start: None,
            ..self.clone()
        }
    }

    /// Validates the structure, the orders and the options, each alone and in combination.
    ///
    /// # Errors
    /// [`IdentError`] describes the problem.
    pub fn check(&self) -> Result<(), IdentError> {
        self.orders.check(self.structure)?;
        let mut named = self.constraints.keys().chain(self.priors.keys()).peekable();
        // Most fits have no constraints or priors; the list of coefficient names is then not needed.
        let names = named.peek().map_or_else(Vec::new, |_| self.orders.parameter_names());
        for name in named {
            if !names.contains(name) {
                return Err(IdentError::UnknownParameter {
                    name: name.clone(),
                    available: names.join(", "),
                });
            }
        }
        if let Some((name, constraint)) = self.constraints.iter().find(|(_, c)| !c.is_valid()) {
            return Err(IdentError::BadOption {
                option: format!("the constraint on {name}"),
                found: format!("{constraint:?}"),
                expected: "a finite value, or a lower bound that does not exceed the upper one".to_owned(),
            });
        }
        let unsound = |p: &Prior| !(p.value.is_finite() && p.weight.is_finite() && p.weight >= 0.0);
        if let Some((name, prior)) = self.priors.iter().find(|(_, p)| unsound(p)) {
            return Err(IdentError::BadOption {
                option: format!("the prior of {name}"),
                found: format!("value {}, weight {}", prior.value, prior.weight),
                expected: "a finite value and a nonnegative weight".to_owned(),
            });
        }
        if let Loss::Huber { threshold } = self.loss
            && !(threshold.is_finite() && threshold > 0.0)
        {
            return Err(IdentError::BadOption {
                option: "the threshold of the robust loss".to_owned(),
                found: threshold.to_string(),
                expected: "a positive number of standard deviations, such as 1.345".to_owned(),
            });
        }
        if self.focus == Focus::Simulation {
            if !self.structure.has_input() {
                return Err(IdentError::BadOption {
                    option: "the focus".to_owned(),
                    found: format!("simulation with {}", self.structure),
                    expected: "a structure with an input; without an input there is nothing to simulate".to_owned(),
                });
            }
            if self.orders.na > 0 && self.orders.nf > 0 {
                return Err(IdentError::BadOption {
                    option: "the focus".to_owned(),
                    found: format!("simulation with {}", self.orders),
                    expected: "na = 0 or nf = 0: the simulation error does not distinguish A from F".to_owned(),
                });
            }
        }
        Ok(())
    }

    /// Returns the assumption about the initial states that the fit uses: the given one, or the automatic choice.
    pub fn effective_initial_state(&self) -> InitialState {
        self.initial_state.unwrap_or(if self.structure.has_input() {
            InitialState::Estimate
        } else {
            InitialState::Backcast
        })
    }

    /// Fits one model to all records, with a common theta and separate initial states for each record.
    ///
    /// # Errors
    /// [`IdentError`]. A search that does not converge is not an error: its termination is part of the fit.
    pub fn fit(&self, records: &[Record]) -> Result<Fit, IdentError> {
        self.fit_from(records, 0)
    }

    /// Like [`Estimator::fit`], but residuals count only from sample `first` of each record, or later if the orders
    /// require it, so models of different orders can be compared on the same samples.
    ///
    /// # Errors
    /// Same as [`Estimator::fit`].
    pub fn fit_from(&self, records: &[Record], first: usize) -> Result<Fit, IdentError> {
        self.check()?;
        // Outlying samples of e and u are limited first, since the robust loss bounds the effect of large residuals but
        // not the effect of faulty samples in the regressors.
        let held = match self.loss {
            Loss::Huber { .. } => limited_records(records),
            Loss::Quadratic => None,
        };
        let records = held.as_deref().unwrap_or(records);
        if self.minimises_simulation_error() {
            simulation_focus::fit(&self.settings(), records, first)
        } else {
            prediction_focus::fit(&self.settings(), records, first)
        }
    }

    /// Fits a model to each record separately.
    ///
    /// Box-Jenkins models of records of equal length are searched in parallel lanes, in about half the time of separate
    /// searches. The result of a fit does not depend on the records that share the lanes; it differs from the result of
    /// [`Estimator::fit`] only by rounding, less than 1e-7 of a standard error.
    ///
    /// # Errors
    /// The errors of [`Estimator::fit`], for each record separately.
    pub fn fit_each(&self, records: &[&Record]) -> Vec<Result<Fit, IdentError>> {
        let batched = match self.check() {
            Ok(()) if self.focus == Focus::Prediction => {
                batched::fit_each(&self.settings(), records, InstructionSet::Best)
            }
            _ => None,
        };
        batched.unwrap_or_else(|| {
            let alone = |record: &&Record| self.fit(std::slice::from_ref(*record));
            records.iter().map(alone).collect()
        })
    }

    /// True if the fit minimises a simulation error that differs from the prediction error, as for every structure
    /// except output error.
    fn minimises_simulation_error(&self) -> bool {
        self.focus == Focus::Simulation && self.structure != Structure::OutputError
    }

    /// Returns the options in the form required by [`crate::pem`].
    pub(crate) fn settings(&self) -> FitSettings {
        FitSettings {
            structure: self.structure,
            orders: self.orders,
            initial_state: self.effective_initial_state(),
            search: self.search,
            starts: self.starts,
            start: self.start.clone(),
            constraints: self.constraints.clone(),
            priors: self.priors.clone(),
            loss: self.loss,
            level: self.level && self.effective_initial_state() != InitialState::Zero,
            stable: self.stable,
        }
    }
}
