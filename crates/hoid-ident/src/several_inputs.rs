//! Polynomial models with several inputs, fitted by the prediction error method.
//!
//! `A(q) u(t) = sum_i (B_i(q)/F_i(q)) q^-nk_i x_i(t) + (C(q)/D(q)) eps(t)`
//!
//! Source: L. Ljung, *System Identification*, 1999, section 4.2, eq. 4.35. The structures are ARX, FIR, ARMAX, ARARX,
//! ARARMAX, output error, Box-Jenkins and the general structure, with nb, nf and nk for each input. FIR and ARX are
//! linear in theta and solved in one step. The other structures start from a high-order ARX model: its response to each
//! input alone is nearly free of noise, and B and F of that input are fitted to this response as to a record with one
//! input.
//!
//! ```
//! use hoid_ident::several_inputs::{InputOrders, SeveralInputs};
//! use hoid_model::{Channel, Record, SampleTime, Structure};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let e: Vec<f64> = (0..400).map(|t| (0.3 * f64::from(t)).sin() + (0.7 * f64::from(t * t)).cos()).collect();
//! let r: Vec<f64> = (0..400).map(|t| (0.9 * f64::from(t * t)).sin()).collect();
//! let mut u = vec![0.0; 400];
//! for t in 2..400 {
//!     u[t] = 0.8 * u[t - 1] + 0.5 * e[t - 2] + 0.2 * r[t - 1] - 0.1 * r[t - 2];
//! }
//! let record = Record::new(SampleTime::AT_100_HZ, Channel::new("e", "", e), Channel::new("u", "", u))?
//!     .with_channel(Channel::new("r", "", r))?;
//! let fit = SeveralInputs {
//!     na: 1,
//!     inputs: vec![
//!         ("e".to_owned(), InputOrders { nb: 1, nf: 0, nk: 2 }),
//!         ("r".to_owned(), InputOrders { nb: 2, nf: 0, nk: 1 }),
//!     ],
//!     ..SeveralInputs::new(Structure::Arx)
//! }
//! .fit(&[record])?;
//! let b0_of_r = fit.parameters().into_iter().find(|(name, _)| name == "b0[r]").unwrap().1;
//! assert!((b0_of_r.value - 0.2).abs() < 1e-10);
//! # Ok(())
//! # }
//! ```

use hoid_core::filter::{divide_in_place, fir};
use hoid_model::{
    Channel, Complex64, Orders, Record, SampleTime, Structure, polynomial,
    uncertainty::{Estimate, variance_along},
};

pub use crate::criterion::further_input::InputOrders;
use crate::{
    Estimator, IdentError, InitialState, Reason, ResponsePoint, SearchOptions, Termination,
    criterion::{Criterion, Data, Workspace, further_input::FurtherInput},
    family::noise::{NoiseProducts, hannan_rissanen},
    informative_data::{check_degrees_of_freedom, common_sample_time},
    linalg::{
        least_squares::solve_symmetric,
        vectors::{add_scaled, dot},
    },
    optimize::{Linearisation, Minimum, Objective, minimise},
};

/// Maximum number of coefficients that A and each B of the high-order ARX model have in addition to the orders of the
/// fitted model.
const MAX_ADDITIONAL_ORDER: usize = 12;
/// Relative increase in the diagonal of the normal matrix in the regression for the high-order ARX model.
const RIDGE_FACTOR: f64 = 1e-8;
/// Order of the autoregression that estimates the innovations for the start of C.
const LONG_AR_ORDER: usize = 24;

/// Termination of a linear regression.
const DIRECT_TERMINATION: Termination = Termination {
    reason: Reason::Direct,
    iterations: 0,
};

/// Structure and orders of a model with several inputs, and options of its estimation.
#[derive(Debug, Clone, PartialEq)]
pub struct SeveralInputs {
    /// Structure of the model, which must have an input.
    pub structure: Structure,
    /// Number of coefficients of A.
    pub na: usize,
    /// Number of coefficients of C.
    pub nc: usize,
    /// Number of coefficients of D.
    pub nd: usize,
    /// Name and orders of each input. The first input is e of the records; the others are channels of the records.
    pub inputs: Vec<(String, InputOrders)>,
    /// Initial states: estimated (the default) or zero.
    pub initial_state: InitialState,
    /// True if a constant of u is estimated for each record, like its initial states; ignored with initial states of
    /// zero. Default true.
    pub level: bool,
    /// Limits of the search.
    pub search: SearchOptions,
}

/// Result of [`SeveralInputs::fit`].
#[derive(Debug, Clone, PartialEq)]
pub struct SeveralInputsFit {
    /// Structure, orders and options of the fitted model.
    pub model: SeveralInputs,
    theta: Vec<f64>,
    covariance: Option<Vec<f64>>,
    /// Loss `V = sum eps^2/n`.
    pub loss: f64,
    /// Unbiased innovation variance.
    pub innovation_variance: f64,
    /// Number n of residuals.
    pub residuals: usize,
    /// Termination of the search.
    pub termination: Termination,
    /// VAF of the one-step-ahead prediction, %.
    pub vaf_prediction: f64,
    /// Sample time of the records.
    pub sample_time: SampleTime,
}

impl SeveralInputs {
    /// Creates a model of this structure without inputs and with orders of zero.
    pub fn new(structure: Structure) -> Self {
        Self {
            structure,
            na: 0,
            nc: 0,
            nd: 0,
            inputs: Vec::new(),
            initial_state: InitialState::Estimate,
            level: true,
            search: SearchOptions::default(),
        }
    }

    fn refuse<T>(option: &str, found: impl ToString, expected: impl ToString) -> Result<T, IdentError> {
        Err(IdentError::BadOption {
            option: option.to_owned(),
            found: found.to_string(),
            expected: expected.to_string(),
        })
    }

    /// Returns the orders of A, C and D, and the orders of the first input.
    fn orders(&self) -> Orders {
        let first = self
            .inputs
            .first()
            .map_or_else(InputOrders::default, |(_, orders)| *orders);
        Orders {
            na: self.na,
            nb: first.nb,
            nc: self.nc,
            nd: self.nd,
            nf: first.nf,
            nk: first.nk,
        }
    }

    /// Validates the structure, the orders and the inputs, each alone and in combination.
    ///
    /// # Errors
    /// [`IdentError`] describes the problem.
    pub fn check(&self) -> Result<(), IdentError> {
        if !self.structure.has_input() {
            return Self::refuse("the structure", self.structure, "a structure with inputs");
        }
        if self.inputs.is_empty() {
            return Self::refuse("the inputs", "none", "at least one input, with its orders");
        }
        if self.initial_state == InitialState::Backcast {
            return Self::refuse("the initial states", "backcast", "estimate or zero for several inputs");
        }
        for (k, (name, orders)) in self.inputs.iter().enumerate() {
            if self.inputs[..k].iter().any(|(other, _)| other == name) {
                return Self::refuse("the inputs", format!("{name} twice"), "each input once");
            }
            Orders {
                nb: orders.nb,
                nf: orders.nf,
                nk: orders.nk,
                ..self.orders()
            }
            .check(self.structure)?;
        }
        Ok(())
    }

    /// Fits one model to all records.
    ///
    /// # Errors
    /// [`IdentError`] for invalid orders, inputs or records, and if no search reaches a finite loss.
    pub fn fit(&self, records: &[Record]) -> Result<SeveralInputsFit, IdentError> {
        self.check()?;
        let sample_time = common_sample_time(records)?;
        let criterion = self.criterion(records, self.orders(), |(_, orders)| *orders)?;
        check_degrees_of_freedom(&criterion, records)?;
        let mut workspace = Workspace::borrow_from_thread();
        let (theta, termination) = if self.structure.is_linear() {
            let at = criterion.linearise(&vec![0.0; self.parameter_count()], &mut workspace);
            (
                self.solve_refined(&criterion, &at.gram, &at.descent, &mut workspace)?,
                DIRECT_TERMINATION,
            )
        } else {
            let mut best: Option<Minimum> = None;
            for start in self.starts(records, &mut workspace)? {
                if let Some(found) = minimise(&criterion, start, &self.search, None, &mut workspace)
                    && best
                        .as_ref()
                        .is_none_or(|known| found.linearisation.sum_of_squares < known.linearisation.sum_of_squares)
                {
                    best = Some(found);
                }
            }
            let found = best.ok_or(IdentError::NoFiniteLoss)?;
            (found.theta, found.termination)
        };
        let at = criterion.linearise(&theta, &mut workspace);
        Ok(self.assemble(&criterion, sample_time, (theta, termination), &at))
    }

    /// Fits an ARX model of the orders of `criterion` by ridge regression. This gives a frequency response even if the
    /// records determine only a few combinations of the coefficients. `None` if the normal equations are singular.
    pub(crate) fn fit_ridge(
        &self,
        criterion: &Criterion<'_>,
        ridge: f64,
        sample_time: SampleTime,
    ) -> Option<SeveralInputsFit> {
        let mut at = criterion.linearise(
            &vec![0.0; criterion.parameter_count()],
            &mut Workspace::borrow_from_thread(),
        );
        let theta = at.solution(ridge)?;
        // The sum of squares must not be smaller than the rounding error of this regression.
        let squares = (at.sum_of_squares - dot(&theta, &at.descent)).max(1e-12 * at.sum_of_squares);
        at.sum_of_squares = squares;
        Some(self.assemble(criterion, sample_time, (theta, DIRECT_TERMINATION), &at))
    }

    /// Returns the result for theta; `at` contains the sum of squares and `psi' psi` at theta.
    fn assemble(
        &self,
        criterion: &Criterion<'_>,
        sample_time: SampleTime,
        (theta, termination): (Vec<f64>, Termination),
        at: &Linearisation,
    ) -> SeveralInputsFit {
        let n = criterion.residual_count();
        let innovation_variance = at.sum_of_squares / (n - theta.len() - criterion.state_count()) as f64;
        let power: f64 = (criterion.data.iter()).map(|d| spread(&d.u[criterion.first..])).sum();
        SeveralInputsFit {
            model: self.clone(),
            covariance: at.covariance(innovation_variance),
            loss: at.sum_of_squares / n as f64,
            innovation_variance,
            residuals: n,
            termination,
            vaf_prediction: if power > 0.0 {
                100.0 * (1.0 - at.sum_of_squares / power).max(0.0)
            } else {
                0.0
            },
            theta,
            sample_time,
        }
    }

    /// Solves the normal equations, with two refinement steps that recompute the residuals.
    fn solve_refined(
        &self,
        criterion: &Criterion<'_>,
        gram: &[f64],
        descent: &[f64],
        workspace: &mut Workspace,
    ) -> Result<Vec<f64>, IdentError> {
        let singular = || IdentError::SingularRegressors {
            columns: self.names().join(", "),
        };
        let mut theta = solve_symmetric(gram, descent).ok_or_else(singular)?;
        for _ in 0..2 {
            let left = criterion.linearise(&theta, workspace).descent;
            let step = solve_symmetric(gram, &left).ok_or_else(singular)?;
            add_scaled(&mut theta, 1.0, &step);
        }
        Ok(theta)
    }

    fn parameter_count(&self) -> usize {
        let of_inputs: usize = self.inputs.iter().map(|(_, o)| o.nb + o.nf).sum();
        self.na + self.nc + self.nd + of_inputs
    }

    /// Returns the names of the coefficients in the order of theta: A, B, C, D and F with B and F of the first input,
    /// then B and F of each further input.
    fn names(&self) -> Vec<String> {
        let own = self.orders().parameter_names();
        let first = self.inputs.first().map_or("", |(name, _)| name.as_str());
        let mut all: Vec<String> = (own.into_iter())
            .map(|coefficient| match coefficient.chars().next() {
                Some('b' | 'f') => format!("{coefficient}[{first}]"),
                _ => coefficient,
            })
            .collect();
        for (name, orders) in self.inputs.iter().skip(1) {
            all.extend((0..orders.nb).map(|i| format!("b{i}[{name}]")));
            all.extend((1..=orders.nf).map(|i| format!("f{i}[{name}]")));
        }
        all
    }

    /// Returns the criterion for these orders of A, B, C, D and F; `of` returns the orders of each further input.
    fn criterion<'a>(
        &self,
        records: &'a [Record],
        orders: Orders,
        of: impl Fn(&(String, InputOrders)) -> InputOrders,
    ) -> Result<Criterion<'a>, IdentError> {
        let mut further = Vec::with_capacity(self.inputs.len());
        for input in self.inputs.iter().skip(1) {
            let values = records
                .iter()
                .map(|record| channel(record, &input.0))
                .collect::<Result<_, _>>()?;
            further.push(FurtherInput {
                orders: of(input),
                values,
            });
        }
        let late = further
            .iter()
            .map(|f| f.orders.first_regressed_sample())
            .max()
            .unwrap_or(0);
        let level = self.level && self.initial_state != InitialState::Zero;
        let data = Data::of(records).into_iter().map(|d| Data { level, ..d });
        let criterion = Criterion {
            first: match self.initial_state {
                InitialState::Zero => 0,
                _ => orders.first_regressed_sample().max(late) + orders.nd,
            },
            further,
            data: data.collect(),
            initial: self.initial_state,
            orders,
            weights: None,
        };
        match records.iter().find(|record| record.len() <= criterion.first) {
            None => Ok(criterion),
            Some(short) => Err(IdentError::TooFewSamples {
                label: short.label().to_owned(),
                samples: short.len(),
                orders: orders.to_string(),
                needed: criterion.first,
            }),
        }
    }

    /// Returns starting values of theta. In the first start, B and F of each input are fitted to the response to this
    /// input in a high-order ARX model, which is nearly free of noise. In the second start, they are fitted to the part
    /// of u that the responses to the other inputs do not explain. C and D are then fitted to the remainder of u. A
    /// structure with A and no F has the single start of `start_with_a`.
    fn starts(&self, records: &[Record], workspace: &mut Workspace) -> Result<Vec<Vec<f64>>, IdentError> {
        if self.na > 0 && self.inputs.iter().all(|(_, o)| o.nf == 0) {
            return Ok(vec![self.start_with_a(records, workspace)?]);
        }
        let responses = self.responses(records, workspace)?;
        let [mut of_responses, mut of_rest] = [Vec::new(), Vec::new()];
        for (k, (name, o)) in self.inputs.iter().enumerate() {
            let structure = if o.nf == 0 {
                Structure::Fir
            } else {
                Structure::OutputError
            };
            let alone = Orders {
                nb: o.nb,
                nf: o.nf,
                nk: o.nk,
                ..Orders::default()
            };
            let fitted = |output: &dyn Fn(usize) -> Vec<f64>| -> Result<(Vec<f64>, Vec<f64>), IdentError> {
                let mut pairs = Vec::with_capacity(records.len());
                for (i, record) in records.iter().enumerate() {
                    let x = channel_or_input(record, name, &self.inputs[0].0)?.to_vec();
                    let (x, w) = (Channel::new("x", "", x), Channel::new("w", "", output(i)));
                    pairs.push(Record::new(record.sample_time(), x, w)?);
                }
                let estimator = Estimator {
                    level: self.level,
                    ..Estimator::new(structure, alone)
                };
                let fit = estimator.fit(&pairs)?;
                let (b, f) = fit.model().theta().split_at(o.nb);
                Ok((b.to_vec(), f.to_vec()))
            };
            of_responses.push(fitted(&|i| responses[k][i].clone())?);
            of_rest.push(fitted(&|i| {
                let mut left = records[i].output().to_vec();
                let others = responses.iter().enumerate().filter(|(other, _)| *other != k);
                others.for_each(|(_, response)| add_scaled(&mut left, -1.0, &response[i]));
                left
            })?);
        }
        let mut starts = Vec::new();
        for systems in [of_responses, of_rest] {
            let mut left = Vec::with_capacity(records.len());
            for record in records {
                let mut series = record.output().to_vec();
                for ((name, o), (b, f)) in self.inputs.iter().zip(&systems) {
                    let x = channel_or_input(record, name, &self.inputs[0].0)?;
                    let mut w = vec![0.0; x.len()];
                    fir(b, o.nk, x, &mut w);
                    divide_in_place(f, &mut w);
                    add_scaled(&mut series, -1.0, &w);
                }
                let mean = series.iter().sum::<f64>() / series.len() as f64;
                series.iter_mut().for_each(|v| *v -= mean);
                left.push(series);
            }
            starts.push(self.assemble_theta(&vec![0.0; self.na], &systems, &self.noise_coefficients(&left)));
        }
        Ok(starts)
    }

    /// Returns the response to each input in each record, computed with a high-order ARX model.
    fn responses(&self, records: &[Record], workspace: &mut Workspace) -> Result<Vec<Vec<Vec<f64>>>, IdentError> {
        let shortest = records.iter().map(Record::len).min().unwrap_or(0);
        let high = MAX_ADDITIONAL_ORDER
            .min(shortest / (4 * (self.inputs.len() + 1)))
            .max(2);
        let own = |(_, o): &(String, InputOrders)| InputOrders {
            nb: o.nb + high,
            nf: 0,
            nk: o.nk,
        };
        let poles = self.na.max(self.inputs.iter().map(|(_, o)| o.nf).max().unwrap_or(0));
        let first = own(&self.inputs[0]);
        let orders = Orders {
            na: poles + high,
            nb: first.nb,
            nk: first.nk,
            ..Orders::default()
        };
        let criterion = self.criterion(records, orders, own)?;
        let counts: Vec<usize> = self.inputs.iter().map(|input| own(input).nb).collect();
        let mut at = criterion.linearise(&vec![0.0; criterion.parameter_count()], workspace);
        let theta = at.solution(RIDGE_FACTOR).ok_or(IdentError::NoFiniteLoss)?;
        let a = polynomial::reflect_roots_inside(&theta[..orders.na]).ok_or(IdentError::NoFiniteLoss)?;
        let mut from = orders.na;
        let mut all = Vec::with_capacity(self.inputs.len());
        for ((name, o), count) in self.inputs.iter().zip(counts) {
            let b = &theta[from..from + count];
            from += count;
            let mut each = Vec::with_capacity(records.len());
            for record in records {
                let x = channel_or_input(record, name, &self.inputs[0].0)?;
                let mut w = vec![0.0; x.len()];
                fir(b, o.nk, x, &mut w);
                divide_in_place(&a, &mut w);
                each.push(w);
            }
            all.push(each);
        }
        Ok(all)
    }

    /// Returns the start of a structure with A and no F: an ARX model, with the coefficients of C and D set to zero.
    fn start_with_a(&self, records: &[Record], workspace: &mut Workspace) -> Result<Vec<f64>, IdentError> {
        let arx = Orders {
            nc: 0,
            nd: 0,
            ..self.orders()
        };
        let criterion = self.criterion(records, arx, |(_, o)| *o)?;
        let mut at = criterion.linearise(&vec![0.0; criterion.parameter_count()], workspace);
        let theta = at.solution(0.0).ok_or(IdentError::NoFiniteLoss)?;
        let (a, mut rest) = theta.split_at(self.na);
        let mut systems = Vec::new();
        for (_, o) in &self.inputs {
            let (b, others) = rest.split_at(o.nb);
            systems.push((b.to_vec(), Vec::new()));
            rest = others;
        }
        Ok(self.assemble_theta(a, &systems, &vec![0.0; self.nc + self.nd]))
    }

    /// Returns the coefficients of C and D for the part `left` of u that the inputs do not explain; zero if they cannot
    /// be estimated.
    fn noise_coefficients(&self, left: &[Vec<f64>]) -> Vec<f64> {
        let none = || vec![0.0; self.nc + self.nd];
        if self.nc == 0 {
            let products = NoiseProducts::new(left, self.nd);
            return products.fit_up_to(self.nd).map_or_else(none, |found| found.d);
        }
        hannan_rissanen(left, (self.nc, self.nd), LONG_AR_ORDER).unwrap_or_else(none)
    }

    fn assemble_theta(&self, a: &[f64], systems: &[(Vec<f64>, Vec<f64>)], noise: &[f64]) -> Vec<f64> {
        let mut theta = a.to_vec();
        theta.extend(&systems[0].0);
        theta.extend(noise);
        theta.extend(&systems[0].1);
        for (b, f) in &systems[1..] {
            theta.extend(b);
            theta.extend(f);
        }
        theta
    }
}

fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    values.iter().map(|v| (v - mean) * (v - mean)).sum()
}

fn channel<'r>(record: &'r Record, name: &str) -> Result<&'r [f64], IdentError> {
    record.channel(name).ok_or_else(|| IdentError::BadOption {
        option: "the inputs".to_owned(),
        found: format!("no channel {name} in {}", record.label()),
        expected: record
            .channels()
            .map(|c| c.name.as_str())
            .collect::<Vec<_>>()
            .join(", "),
    })
}

/// Returns the input of the record if `name` is the name of the first input, otherwise the channel with this name.
fn channel_or_input<'r>(record: &'r Record, name: &str, first: &str) -> Result<&'r [f64], IdentError> {
    if name == first {
        Ok(record.input())
    } else {
        channel(record, name)
    }
}

impl SeveralInputsFit {
    /// Returns the names and estimates of all coefficients, for example `a1`, `b0[e]`, `f1[r]`, `c1`, `d1`.
    pub fn parameters(&self) -> Vec<(String, Estimate)> {
        let p = self.theta.len();
        let estimate = |i: usize| match &self.covariance {
            Some(c) => Estimate::with_variance(self.theta[i], c[i * p + i]),
            None => Estimate::fixed(self.theta[i]),
        };
        let names = self.model.names().into_iter().enumerate();
        names.map(|(i, name)| (name, estimate(i))).collect()
    }

    /// Returns the covariance of the coefficients by rows.
    pub fn covariance(&self) -> Option<&[f64]> {
        self.covariance.as_deref()
    }

    /// Akaike's criterion `n ln V + 2 p`.
    pub fn aic(&self) -> f64 {
        self.residuals as f64 * self.loss.ln() + 2.0 * self.theta.len() as f64
    }

    /// Returns the indices in theta of the coefficients of A, and of B and F of an input.
    fn coefficient_ranges(&self, input: usize) -> [std::ops::Range<usize>; 3] {
        let o = self.model.orders();
        let a = 0..o.na;
        if input == 0 {
            let f = o.na + o.nb + o.nc + o.nd;
            return [a, o.na..o.na + o.nb, f..f + o.nf];
        }
        let mut from = o.parameter_count();
        for (_, orders) in &self.model.inputs[1..input] {
            from += orders.nb + orders.nf;
        }
        let own = self.model.inputs[input].1;
        [a, from..from + own.nb, from + own.nb..from + own.nb + own.nf]
    }

    /// Returns the gain and phase of `B_i/(A F_i) q^-nk_i`, the response of u to the input with this index, at
    /// frequencies in rad/s.
    pub fn frequency_response(&self, input: usize, omega_rad_s: &[f64]) -> Vec<ResponsePoint> {
        let [a, b, f] = self.coefficient_ranges(input);
        let nk = self.model.inputs[input].1.nk;
        let p = self.theta.len();
        let point = |&omega: &f64| {
            let back = |k: usize| Complex64::from_polar(1.0, -omega * self.sample_time.s() * k as f64);
            let one = Complex64::new(1.0, 0.0);
            let sum = |places: &std::ops::Range<usize>| -> Complex64 {
                (1..).zip(places.clone()).map(|(k, i)| self.theta[i] * back(k)).sum()
            };
            let (of_a, of_f) = (one + sum(&a), one + sum(&f));
            let of_b: Complex64 = b.clone().map(|i| self.theta[i] * back(nk + i - b.start)).sum();
            let response = of_b / (of_a * of_f);
            // Derivatives of ln H with respect to theta.
            let mut slopes = vec![Complex64::new(0.0, 0.0); p];
            a.clone().for_each(|i| slopes[i] = -back(i - a.start + 1) / of_a);
            f.clone().for_each(|i| slopes[i] = -back(i - f.start + 1) / of_f);
            b.clone().for_each(|i| slopes[i] = back(nk + i - b.start) / of_b);
            let error = |part: fn(&Complex64) -> f64| {
                let gradient: Vec<f64> = slopes.iter().map(part).collect();
                self.covariance
                    .as_ref()
                    .map(|c| variance_along(&gradient, c).max(0.0).sqrt())
            };
            ResponsePoint {
                omega_rad_s: omega,
                magnitude_db: Estimate {
                    value: 20.0 * response.norm().log10(),
                    standard_error: error(|z| z.re).map(|e| e * 20.0 / std::f64::consts::LN_10),
                },
                phase_deg: Estimate {
                    value: response.arg().to_degrees(),
                    standard_error: error(|z| z.im).map(f64::to_degrees),
                },
            }
        };
        omega_rad_s.iter().map(point).collect()
    }
}

#[cfg(test)]
mod tests;
