//! Instrumental variables.
//!
//! The equation `y = Phi theta + r` of a model that is linear in theta (A or F of the denominator, and B) gives a biased least
//! squares estimate where r is correlated with the regressors, as past outputs always are and, in a closed loop, inputs too.
//! With instruments Z that follow the regressors but not the noise,
//!
//! `Z' Phi theta = Z' y`                                                        (L. Ljung, *System Identification*, 1999, eq. 7.118)
//!
//! is consistent whatever the noise. The methods differ in their instruments and in the filter that is laid over the equation:
//!
//! | method | model | filter |
//! |---|---|---|
//! | [`IvMethod::Iv4`] | `A u = B q^-nk e + v` | AR model of v |
//! | [`IvMethod::Sriv`] | `u = (B/F) q^-nk e + eps` | 1/F, repeated |
//! | [`IvMethod::RivBj`] | `u = (B/F) q^-nk e + (C/D) eps` | D/(C F), repeated |
//!
//! and instruments are made of an input that holds no noise: e itself in an open loop, and the part of e that follows an external
//! signal such as the forcing function f_t in a closed one ([`Instruments`]).
//!
//! **Pre-history.** Rows of the filtered equation are used from the first sample at which all of `D (F u - B q^-nk e)` lies inside the
//! record. What is then unknown, the free response of 1/(C F), is projected out of every column, record by record. Signals that are
//! simulated for the instruments get an invented past (the record reflected at its first sample, faded in); it does not matter for
//! consistency, only for how well the instruments follow the regressors: a jump at the start, raised by D, would outweigh all
//! that follows. Several records add up, row by row, with a common theta.

mod chain;
mod equation;
mod external;
mod iv4;
mod refined;
mod rivbj;
mod sriv;

use std::fmt;

use hoid_model::{Orders, PolynomialModel, Record, Structure};

use crate::{
    Fit, IdentError, InitialState, Reason, Termination, informative_data,
    linalg::least_squares::dot,
    pem::criterion::{Criterion, Data, Workspace, first_residual, output_variance},
};
use equation::{Problem, Source};

pub(crate) use chain::instrument_chain;

/// Channel of the forcing function in a record that has one.
pub const FORCING_CHANNEL: &str = "f_t";

/// Residuals below this share of the output, in amplitude, are rounding.
const EXACT: f64 = 1e-11;

/// Which instrumental variable method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum IvMethod {
    /// The four-step method for ARX models.
    Iv4,
    /// Simplified refined instrumental variable, for output-error models.
    Sriv,
    /// Refined instrumental variable, for Box-Jenkins models.
    RivBj,
}

impl IvMethod {
    /// All methods.
    pub const ALL: [Self; 3] = [Self::Iv4, Self::Sriv, Self::RivBj];

    /// Short name: `iv4`, `sriv`, `rivbj`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Iv4 => "iv4",
            Self::Sriv => "sriv",
            Self::RivBj => "rivbj",
        }
    }

    /// The structure that the method fits.
    pub fn structure(self) -> Structure {
        match self {
            Self::Iv4 => Structure::Arx,
            Self::Sriv => Structure::OutputError,
            Self::RivBj => Structure::BoxJenkins,
        }
    }
}

impl fmt::Display for IvMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What the instruments are made of.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum Instruments {
    /// The input itself and the output that the model simulates from it. For an open loop: in a closed one the input carries the
    /// noise, and the estimate is biased.
    #[default]
    Simulated,
    /// The part of the input that follows this channel, which the noise does not reach: the forcing function f_t or a known
    /// disturbance. For a closed loop.
    External(String),
}

impl Instruments {
    /// The forcing function f_t where all records have it: in a closed loop it is the signal that the noise does not reach. Else those that
    /// are simulated.
    pub fn usual(records: &[Record]) -> Self {
        if records.iter().all(|r| r.channel(FORCING_CHANNEL).is_some()) {
            Self::External(FORCING_CHANNEL.to_owned())
        } else {
            Self::Simulated
        }
    }
}

impl fmt::Display for Instruments {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Simulated => f.write_str("simulated instruments"),
            Self::External(channel) => write!(f, "instruments from {channel}"),
        }
    }
}

/// An estimator by instrumental variables.
#[derive(Debug, Clone, PartialEq)]
pub struct InstrumentalVariable {
    /// The method; it decides the structure.
    pub method: IvMethod,
    /// The orders.
    pub orders: Orders,
    /// What the instruments are made of.
    pub instruments: Instruments,
    /// Largest number of iterations of the refined methods. Default 100.
    pub max_iterations: usize,
    /// The refined methods have settled when an iteration moves theta by less than this share of its standard errors. Default
    /// 1e-4.
    pub tolerance: f64,
}

/// Theta in the order of the orders, and what a method knows about it.
struct Solution {
    theta: Vec<f64>,
    covariance: Option<Vec<f64>>,
    termination: Termination,
}

impl InstrumentalVariable {
    /// An estimator with the default options and simulated instruments.
    pub fn new(method: IvMethod, orders: Orders) -> Self {
        Self {
            method,
            orders,
            instruments: Instruments::default(),
            max_iterations: 100,
            tolerance: 1e-4,
        }
    }

    /// Fits one model to all records: a common theta, initial states of each for the residuals.
    ///
    /// # Errors
    /// [`IdentError`]; how an iteration ended is part of the fit.
    pub fn fit(&self, records: &[Record]) -> Result<Fit, IdentError> {
        let structure = self.method.structure();
        self.orders.check(structure)?;
        self.check_options()?;
        let sample_time = informative_data::common_sample_time(records)?;
        let first = first_residual(&self.orders, InitialState::Estimate);
        for record in records {
            informative_data::check_record(structure, &self.orders, record, first)?;
        }
        let criterion = Criterion {
            orders: self.orders,
            data: Data::of(records),
            initial: InitialState::Estimate,
            first,
            weights: None,
        };
        informative_data::check_degrees_of_freedom(&criterion, records)?;
        let sources = match &self.instruments {
            Instruments::Simulated => Source::measured(&criterion.data),
            Instruments::External(name) => external::noise_free(&external::signals(records, name)?, &criterion.data),
        };
        let problem = Problem::new(&self.orders, criterion.data.clone(), sources);
        self.check_rows(&problem, records)?;
        let solution = match self.method {
            IvMethod::Iv4 => iv4::solve(&problem)?,
            IvMethod::Sriv => sriv::solve(self, &problem)?,
            IvMethod::RivBj => rivbj::solve(self, &problem, &criterion)?,
        };
        self.finish(&criterion, solution, sample_time)
    }

    fn finish(
        &self,
        criterion: &Criterion<'_>,
        solution: Solution,
        sample_time: hoid_model::SampleTime,
    ) -> Result<Fit, IdentError> {
        let mut workspace = Workspace::of_thread();
        let sum_of_squares: f64 = (0..criterion.data.len())
            .map(|record| {
                let eps = criterion.residuals_of(&solution.theta, record, &mut workspace);
                dot(&eps, &eps)
            })
            .sum();
        if !sum_of_squares.is_finite() {
            return Err(IdentError::NoFiniteLoss);
        }
        let power: f64 = criterion.data.iter().map(|d| dot(d.u, d.u)).sum();
        let exact = sum_of_squares <= EXACT * EXACT * power;
        let mut termination = solution.termination;
        if exact {
            termination.reason = Reason::ExactFit;
        }
        let n = criterion.residuals();
        let p = solution.theta.len();
        Ok(Fit {
            model: PolynomialModel::new(self.method.structure(), self.orders, sample_time, solution.theta)?,
            covariance: solution.covariance.filter(|_| !exact),
            loss: sum_of_squares / n as f64,
            innovation_variance: sum_of_squares / (n - p - criterion.states()) as f64,
            residuals: n,
            states: criterion.states(),
            initial_state: InitialState::Estimate,
            termination,
            start: format!("{}, {}", self.method, self.instruments),
            held: vec![false; p],
            output_variance: output_variance(&criterion.data, criterion.first),
            robust: false,
            physical: None,
        })
    }

    /// Fewer rows than parameters and free responses of the filter.
    fn check_rows(&self, problem: &Problem<'_>, records: &[Record]) -> Result<(), IdentError> {
        let o = &self.orders;
        let states = o.nf + o.nc;
        let each = problem.rows(o.nd);
        let rows: usize = each.iter().sum();
        let short = each.iter().position(|n| *n <= states);
        if rows > o.parameters() + states * records.len() && short.is_none() {
            return Ok(());
        }
        let record = &records[short.unwrap_or(0)];
        Err(IdentError::TooFewSamples {
            label: record.label().to_owned(),
            samples: record.len(),
            orders: o.to_string(),
            needed: problem.first + o.nd + states + o.parameters().div_ceil(records.len()),
        })
    }

    fn check_options(&self) -> Result<(), IdentError> {
        let refuse = |option: &str, found: String, expected: &str| {
            Err(IdentError::BadOption {
                option: option.to_owned(),
                found,
                expected: expected.to_owned(),
            })
        };
        if self.max_iterations == 0 {
            return refuse("the limit of iterations", "0".to_owned(), "1 or more");
        }
        if !(self.tolerance.is_finite() && self.tolerance > 0.0) {
            return refuse(
                "the tolerance",
                self.tolerance.to_string(),
                "a positive share of the standard errors, such as 1e-4",
            );
        }
        Ok(())
    }
}
