//! The estimator by the prediction error method and its options.
//!
//! Options, their validation, and the functions that fit. The method itself is in [`crate::pem`].

use std::collections::BTreeMap;

use hoid_lanes::InstructionSet;
use hoid_model::{Orders, Record, Structure};

use crate::{
    Constraint, Fit, IdentError, InitialState, Loss, Prior, SearchOptions,
    faults::held,
    pem::{batched, fit_settings::FitSettings, prediction_focus, simulation_focus},
};

/// Purpose of the fitted model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Focus {
    /// One-step-ahead prediction: the prediction error method, efficient if the structure is right.
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
    /// Initial states of each record. Default (`None`): automatic, which is `Estimate` with an input and `Backcast` for
    /// an output alone, whose past is as stationary as its present.
    pub initial_state: Option<InitialState>,
    /// Method and limits of the search.
    pub search: SearchOptions,
    /// Number of own starts from which the search runs to completion; the best minimum is used. Default 2.
    pub starts: usize,
    /// Start of the search instead of the estimator's own; theta in the order of
    /// [`Orders::parameter_names`].
    pub start: Option<Vec<f64>>,
    /// Fixed and bounded coefficients, by name.
    pub constraints: BTreeMap<String, Constraint>,
    /// Prior guesses of coefficients, by name.
    pub priors: BTreeMap<String, Prior>,
    /// Weight of a residual. Default: its square. With a robust loss each sample of e and u is limited by its
    /// neighbours beforehand ([`crate::faults::resistant`]).
    pub loss: Loss,
    /// Purpose of the model. Default: prediction.
    pub focus: Focus,
    /// True if u of each record has a constant that is not a response to e; it is an unknown like its initial states
    /// ([`crate::level`]); not with initial states of zero. Default false.
    pub level: bool,
    /// True if A must be stable too, so that the model from e to u is stable. C and F always are. Default false.
    pub stable: bool,
}

impl Estimator {
    /// An estimator with the default options.
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

    /// Returns the same estimator with other orders, and without a start (which would not fit them).
    pub fn with_orders(&self, orders: Orders) -> Self {
        Self {
            orders,
            start: None,
            ..self.clone()
        }
    }

    /// Checks structure, orders and options against each other.
    ///
    /// # Errors
    /// [`IdentError`] with the problem.
    pub fn check(&self) -> Result<(), IdentError> {
        self.orders.check(self.structure)?;
        let mut named = self.constraints.keys().chain(self.priors.keys()).peekable();
        // Most fits have no names, and the list of names is not made for them.
        let names = named.peek().map_or_else(Vec::new, |_| self.orders.parameter_names());
        for name in named {
            if !names.contains(name) {
                return Err(IdentError::UnknownParameter {
                    name: name.clone(),
                    available: names.join(", "),
                });
            }
        }
        if let Some((name, constraint)) = self.constraints.iter().find(|(_, c)| !c.is_sound()) {
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
                expected: "a finite value and a weight that is not negative".to_owned(),
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
                    expected: "a structure with an input; without one there is nothing to simulate".to_owned(),
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

    /// Returns the rule for initial states in use, with the automatic choice resolved.
    pub fn initial_state_in_use(&self) -> InitialState {
        self.initial_state.unwrap_or(if self.structure.has_input() {
            InitialState::Estimate
        } else {
            InitialState::Backcast
        })
    }

    /// Fits one model to all records: a common theta, and initial states of each record.
    ///
    /// # Errors
    /// [`IdentError`]; how a search ended is part of the fit.
    pub fn fit(&self, records: &[Record]) -> Result<Fit, IdentError> {
        self.fit_from(records, 0)
    }

    /// As [`Estimator::fit`], with residuals that count from sample `first` of each record at the earliest, so that
    /// models of different orders are compared on the same samples.
    ///
    /// # Errors
    /// As [`Estimator::fit`].
    pub fn fit_from(&self, records: &[Record], first: usize) -> Result<Fit, IdentError> {
        self.check()?;
        // The contribution of a sample to the filters is bounded first: the loss bounds only residuals.
        let held = match self.loss {
            Loss::Huber { .. } => held(records),
            Loss::Quadratic => None,
        };
        let records = held.as_deref().unwrap_or(records);
        if self.simulates() {
            simulation_focus::fit(&self.settings(), records, first)
        } else {
            prediction_focus::fit(&self.settings(), records, first)
        }
    }

    /// Fits a model to each record separately.
    ///
    /// Box-Jenkins models of records of one length are searched in parallel lanes, in about half the time that they
    /// would take one after the other. The result of a fit does not depend on the records that it is searched with; it
    /// differs from that of [`Estimator::fit`] by rounding, less than 1e-7 of a standard error.
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

    /// True if the system from e to u minimises an error other than that of the prediction.
    fn simulates(&self) -> bool {
        self.focus == Focus::Simulation && self.structure != Structure::OutputError
    }

    /// Returns the options that the method needs.
    pub(crate) fn settings(&self) -> FitSettings {
        FitSettings {
            structure: self.structure,
            orders: self.orders,
            initial_state: self.initial_state_in_use(),
            search: self.search,
            starts: self.starts,
            start: self.start.clone(),
            constraints: self.constraints.clone(),
            priors: self.priors.clone(),
            loss: self.loss,
            level: self.level && self.initial_state_in_use() != InitialState::Zero,
            stable: self.stable,
        }
    }
}
