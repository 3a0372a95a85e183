//! From records to a fit.

use hoid_model::{Orders, PolynomialModel, Record, SampleTime, Structure};
use nalgebra::{DMatrix, SymmetricEigen};

use crate::{
    Fit, IdentError, InitialState, Reason, SearchOptions, Termination, arx,
    prediction_error::{Criterion, Data, Workspace, first_residual},
    search::{Minimum, Objective, minimise},
    starts,
};

/// Eigenvalue of the information matrix (scaled to a unit diagonal) below which a combination of parameters counts as not
/// determined by the data. Rounding leaves about 1e-15 times the number of parameters.
const SINGULAR: f64 = 1e-13;

/// What is to be estimated, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimator {
    /// The structure.
    pub structure: Structure,
    /// The orders.
    pub orders: Orders,
    /// Initial states of each record. Default: estimated.
    pub initial_state: InitialState,
    /// Limits of the search.
    pub search: SearchOptions,
    /// Number of own starts from which the search runs to its end; the best minimum wins. Default 2.
    pub starts: usize,
    /// Start of the search instead of the estimator's own; theta in the order of [`Orders::parameter_names`].
    pub start: Option<Vec<f64>>,
}

impl Estimator {
    /// An estimator with the default options.
    pub fn new(structure: Structure, orders: Orders) -> Self {
        Self {
            structure,
            orders,
            initial_state: InitialState::default(),
            search: SearchOptions::default(),
            starts: 2,
            start: None,
        }
    }

    /// The same estimator with other orders, and without a start (which would not fit them).
    pub fn with_orders(&self, orders: Orders) -> Self {
        Self {
            orders,
            start: None,
            ..self.clone()
        }
    }

    /// The rule for initial states that this structure follows: the regression of ARX is conditional on the first samples
    /// (eq. 5.33) under either rule, it needs no states.
    pub(crate) fn initial_state_in_use(&self) -> InitialState {
        if self.structure.is_linear() {
            InitialState::Estimate
        } else {
            self.initial_state
        }
    }

    /// Fits one model to all records: a common theta, initial states of each.
    ///
    /// # Errors
    /// [`IdentError`]; how a search ended is part of the fit.
    pub fn fit(&self, records: &[Record]) -> Result<Fit, IdentError> {
        self.fit_from(records, 0)
    }

    /// As [`Estimator::fit`], with residuals that count from sample `first` of each record at the earliest, so that models of
    /// different orders are compared on the same samples.
    ///
    /// # Errors
    /// As [`Estimator::fit`].
    pub fn fit_from(&self, records: &[Record], first: usize) -> Result<Fit, IdentError> {
        self.orders.check(self.structure)?;
        let sample_time = common_sample_time(records)?;
        let initial = self.initial_state_in_use();
        let first = first.max(first_residual(&self.orders, initial));
        for record in records {
            self.check_record(record, first)?;
        }
        let criterion = Criterion {
            orders: self.orders,
            data: records
                .iter()
                .map(|r| Data {
                    e: r.input(),
                    u: r.output(),
                })
                .collect(),
            initial,
            first,
        };
        self.check_degrees_of_freedom(&criterion, records)?;
        if self.structure.is_linear() {
            self.fit_linear(&criterion, sample_time)
        } else {
            self.fit_iteratively(&criterion, sample_time)
        }
    }

    fn fit_linear(&self, criterion: &Criterion<'_>, sample_time: SampleTime) -> Result<Fit, IdentError> {
        let solved = arx::regress(&self.orders, &criterion.data, criterion.first)?;
        let fit = self.result(
            criterion,
            sample_time,
            solved.theta,
            solved.sum_of_squares,
            Termination {
                reason: Reason::Direct,
                iterations: 0,
            },
            "none needed".to_owned(),
        )?;
        let sigma2 = fit.innovation_variance;
        Ok(Fit {
            covariance: Some(solved.inverse_gram.iter().map(|g| sigma2 * g).collect()),
            ..fit
        })
    }

    fn fit_iteratively(&self, criterion: &Criterion<'_>, sample_time: SampleTime) -> Result<Fit, IdentError> {
        let mut workspace = Workspace::default();
        let candidates: Vec<(String, Vec<f64>)> = match &self.start {
            Some(theta) => vec![("given".to_owned(), self.check_start(theta, criterion)?)],
            None => starts::propose(criterion, sample_time, &mut workspace)
                .into_iter()
                .take(self.starts.max(1))
                .map(|s| (s.label, s.theta))
                .collect(),
        };
        let mut best: Option<(String, Minimum)> = None;
        for (label, theta) in candidates {
            let known = best.as_ref().map(|(_, b): &(String, Minimum)| b.at.sum_of_squares);
            let Some(minimum) = minimise(criterion, theta, &self.search, known, &mut workspace) else {
                continue;
            };
            if known.is_none_or(|known| minimum.at.sum_of_squares < known) {
                best = Some((label, minimum));
            }
        }
        let (label, minimum) = best.ok_or(IdentError::NoFiniteLoss)?;
        let fit = self.result(
            criterion,
            sample_time,
            minimum.theta,
            minimum.at.sum_of_squares,
            minimum.termination,
            label,
        )?;
        if fit.termination.reason == Reason::ExactFit {
            return Ok(fit);
        }
        let inverse = inverse_information(&minimum.at.gram, &self.orders.parameter_names())?;
        let sigma2 = fit.innovation_variance;
        Ok(Fit {
            covariance: Some(inverse.iter().map(|g| sigma2 * g).collect()),
            ..fit
        })
    }

    fn result(
        &self,
        criterion: &Criterion<'_>,
        sample_time: SampleTime,
        theta: Vec<f64>,
        sum_of_squares: f64,
        termination: Termination,
        start: String,
    ) -> Result<Fit, IdentError> {
        let n = criterion.residuals();
        let freedom = n - theta.len() - criterion.states();
        Ok(Fit {
            model: PolynomialModel::new(self.structure, self.orders, sample_time, theta)?,
            covariance: None,
            loss: sum_of_squares / n as f64,
            innovation_variance: sum_of_squares / freedom as f64,
            residuals: n,
            states: criterion.states(),
            initial_state: criterion.initial,
            termination,
            start,
        })
    }

    fn check_record(&self, record: &Record, first: usize) -> Result<(), IdentError> {
        let label = || record.label().to_owned();
        if self.structure.has_input() && record.input_channel().is_none() {
            return Err(IdentError::NoInput {
                structure: self.structure.to_string(),
                label: label(),
            });
        }
        let input = record.input_channel().filter(|_| self.structure.has_input());
        for channel in input.into_iter().chain([record.output_channel()]) {
            let value = channel.values[0];
            if channel.values.iter().all(|v| *v == value) {
                return Err(IdentError::NoExcitation {
                    channel: channel.name.clone(),
                    label: label(),
                    value,
                });
            }
        }
        if self.orders.nk >= record.len() {
            return Err(IdentError::DelayTooLong {
                nk: self.orders.nk,
                label: label(),
                samples: record.len(),
            });
        }
        let needed = first + self.orders.nf + self.orders.nc;
        if record.len() <= needed {
            return Err(IdentError::TooFewSamples {
                label: label(),
                samples: record.len(),
                orders: self.orders.to_string(),
                needed,
            });
        }
        Ok(())
    }

    fn check_degrees_of_freedom(&self, criterion: &Criterion<'_>, records: &[Record]) -> Result<(), IdentError> {
        let unknowns = self.orders.parameters() + criterion.states();
        if criterion.residuals() > unknowns {
            return Ok(());
        }
        Err(IdentError::TooFewSamples {
            label: records[0].label().to_owned(),
            samples: records[0].len(),
            orders: self.orders.to_string(),
            needed: criterion.first + unknowns.div_ceil(records.len()),
        })
    }

    fn check_start(&self, theta: &[f64], criterion: &Criterion<'_>) -> Result<Vec<f64>, IdentError> {
        let bad = |reason: &str| IdentError::BadStart {
            reason: reason.to_owned(),
        };
        if theta.len() != self.orders.parameters() {
            return Err(bad(&format!(
                "it has {} coefficients, the orders {} need {}",
                theta.len(),
                self.orders,
                self.orders.parameters()
            )));
        }
        if !criterion.is_feasible(theta) {
            return Err(bad(
                "C or F has a root on or outside the unit circle; give a stable start or none",
            ));
        }
        Ok(theta.to_vec())
    }
}

fn common_sample_time(records: &[Record]) -> Result<SampleTime, IdentError> {
    let first = records.first().ok_or(IdentError::NoRecords)?.sample_time();
    match records.iter().find(|r| !first.matches(r.sample_time())) {
        None => Ok(first),
        Some(other) => Err(IdentError::MixedSampling {
            label: other.label().to_owned(),
            found: other.sample_time().s(),
            expected: first.s(),
        }),
    }
}

/// Inverse of the information matrix by its eigenvalues, scaled to a unit diagonal.
fn inverse_information(gram: &[f64], names: &[String]) -> Result<Vec<f64>, IdentError> {
    let p = names.len();
    let zero: Vec<&str> = (0..p)
        .filter(|i| gram[i * p + i].is_nan() || gram[i * p + i] <= 0.0)
        .map(|i| names[i].as_str())
        .collect();
    if !zero.is_empty() {
        return Err(IdentError::SingularInformation {
            parameters: zero.join(", "),
        });
    }
    let scale: Vec<f64> = (0..p).map(|i| gram[i * p + i].sqrt()).collect();
    let scaled = DMatrix::from_fn(p, p, |i, j| gram[i * p + j] / (scale[i] * scale[j]));
    let eigen = SymmetricEigen::new(scaled);
    if let Some(k) = (0..p).find(|&k| eigen.eigenvalues[k] < SINGULAR) {
        let direction = eigen.eigenvectors.column(k);
        let largest = direction.amax();
        let involved: Vec<&str> = (0..p)
            .filter(|&i| direction[i].abs() > 0.1 * largest)
            .map(|i| names[i].as_str())
            .collect();
        return Err(IdentError::SingularInformation {
            parameters: involved.join(", "),
        });
    }
    let mut inverse = vec![0.0; p * p];
    for i in 0..p {
        for j in 0..p {
            let sum: f64 = (0..p)
                .map(|k| eigen.eigenvectors[(i, k)] * eigen.eigenvectors[(j, k)] / eigen.eigenvalues[k])
                .sum();
            inverse[i * p + j] = sum / (scale[i] * scale[j]);
        }
    }
    Ok(inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `J' J` by rows of a Jacobian given by columns.
    fn gram(columns: &[Vec<f64>]) -> Vec<f64> {
        let product = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(x, y)| x * y).sum();
        columns
            .iter()
            .flat_map(|a| columns.iter().map(move |b| product(a, b)))
            .collect()
    }

    fn columns() -> Vec<Vec<f64>> {
        let column = |w: f64, size: f64| (0..50).map(|t| size * (w * f64::from(t)).sin()).collect();
        vec![column(0.1, 1e3), column(0.7, 1.0), column(1.9, 1e-4)]
    }

    fn names() -> Vec<String> {
        ["b0", "d1", "f1"].map(String::from).to_vec()
    }

    #[test]
    fn inverse_information_is_the_inverse_whatever_the_units() {
        let g = gram(&columns());
        let inverse = inverse_information(&g, &names()).unwrap();
        for i in 0..3 {
            for j in 0..3 {
                let product: f64 = (0..3).map(|k| g[i * 3 + k] * inverse[k * 3 + j]).sum();
                let scale = (g[i * 4] / g[j * 4]).sqrt();
                assert!((product / scale - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn an_undetermined_combination_is_named() {
        let mut dependent = columns();
        dependent[2] = dependent[0].iter().map(|v| -1e-6 * v).collect();
        match inverse_information(&gram(&dependent), &names()) {
            Err(IdentError::SingularInformation { parameters }) => assert_eq!(parameters, "b0, f1"),
            other => panic!("expected singular information, found {other:?}"),
        }
        let mut silent = columns();
        silent[1].fill(0.0);
        match inverse_information(&gram(&silent), &names()) {
            Err(IdentError::SingularInformation { parameters }) => assert_eq!(parameters, "d1"),
            other => panic!("expected singular information, found {other:?}"),
        }
    }
}
