//! The instrumental variable estimator: options, and the fit.

use hoid_model::{Orders, Record, SampleTime};

use super::{
    IvMethod,
    algorithm::{IterationLimits, IvSolution},
    equation::{IvProblem, Source},
    external_signal,
    instruments::Instruments,
};
use crate::{
    Fit, IdentError, InitialState, Reason,
    assembled_fit::{Solution, assemble_fit},
    criterion::{Criterion, Data, Workspace, first_residual},
    informative_data::{check_degrees_of_freedom, check_record, common_sample_time},
    linalg::vectors::dot,
};

/// Residuals are only rounding errors if their amplitude is below this share of the output.
const ROUNDING_SHARE: f64 = 1e-11;

/// Instrumental variable estimator with its options.
#[derive(Debug, Clone, PartialEq)]
pub struct InstrumentalVariable {
    /// Method, which also determines the structure.
    pub method: IvMethod,
    /// Orders of the model.
    pub orders: Orders,
    /// Choice of instruments.
    pub instruments: Instruments,
    /// Largest number of iterations of a refined method. Default 100.
    pub max_iterations: usize,
    /// A refined method has converged if an iteration changes theta by less than this number of standard errors.
    /// Default 1e-4.
    pub tolerance: f64,
}

impl InstrumentalVariable {
    /// Creates an estimator with the default options and simulated instruments.
    pub fn new(method: IvMethod, orders: Orders) -> Self {
        Self {
            method,
            orders,
            instruments: Instruments::default(),
            max_iterations: 100,
            tolerance: 1e-4,
        }
    }

    /// Fits one model to all records, with a common theta. The residuals are computed with initial states for each
    /// record.
    ///
    /// # Errors
    /// [`IdentError`] if no model can be fitted. The fit itself reports how its iteration ended.
    pub fn fit(&self, records: &[Record]) -> Result<Fit, IdentError> {
        let structure = self.method.structure();
        self.orders.check(structure)?;
        self.check_options()?;
        let sample_time = common_sample_time(records)?;
        let first = first_residual(&self.orders, InitialState::Estimate);
        for record in records {
            check_record(structure, &self.orders, record, first)?;
        }
        let criterion = Criterion {
            orders: self.orders,
            data: Data::of(records),
            initial: InitialState::Estimate,
            first,
            weights: None,
            further: Vec::new(),
        };
        check_degrees_of_freedom(&criterion, records)?;
        let sources = match &self.instruments {
            Instruments::Simulated => Source::measured_inputs(&criterion.data),
            Instruments::External(name) => {
                external_signal::noise_free_sources(&external_signal::external_signals(records, name)?, &criterion.data)
            }
        };
        let problem = IvProblem::new(&self.orders, criterion.data.clone(), sources);
        self.check_rows(&problem, records)?;
        let limits = IterationLimits {
            max_iterations: self.max_iterations,
            tolerance: self.tolerance,
        };
        let solution = (self.method.algorithm().solve)(&problem, &criterion, limits)?;
        self.assemble(&criterion, solution, sample_time)
    }

    fn assemble(
        &self,
        criterion: &Criterion<'_>,
        solution: IvSolution,
        sample_time: SampleTime,
    ) -> Result<Fit, IdentError> {
        let mut workspace = Workspace::borrow_from_thread();
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
        let exact = sum_of_squares <= ROUNDING_SHARE * ROUNDING_SHARE * power;
        let mut termination = solution.termination;
        if exact {
            termination.reason = Reason::ExactFit;
        }
        let minimum = Solution {
            is_fixed_or_bounded: vec![false; solution.theta.len()],
            theta: solution.theta,
            sum_of_squares,
            termination,
            start: format!("{}, {}", self.method, self.instruments),
        };
        Ok(Fit {
            covariance: solution.covariance.filter(|_| !exact),
            instrumented: true,
            ..assemble_fit(criterion, self.method.structure(), sample_time, minimum)?
        })
    }

    /// Returns an error if the filtered equation has fewer rows than there are parameters and initial states of the
    /// filter.
    fn check_rows(&self, problem: &IvProblem<'_>, records: &[Record]) -> Result<(), IdentError> {
        let o = &self.orders;
        let states = o.nf + o.nc;
        let each = problem.row_counts(o.nd);
        let rows: usize = each.iter().sum();
        let short = each.iter().position(|n| *n <= states);
        if rows > o.parameter_count() + states * records.len() && short.is_none() {
            return Ok(());
        }
        let record = &records[short.unwrap_or(0)];
        Err(IdentError::TooFewSamples {
            label: record.label().to_owned(),
            samples: record.len(),
            orders: o.to_string(),
            needed: problem.first + o.nd + states + o.parameter_count().div_ceil(records.len()),
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
            return refuse("the maximum number of iterations", "0".to_owned(), "1 or more");
        }
        if !(self.tolerance.is_finite() && self.tolerance > 0.0) {
            return refuse(
                "the tolerance",
                self.tolerance.to_string(),
                "a positive fraction of the standard errors, such as 1e-4",
            );
        }
        Ok(())
    }
}
