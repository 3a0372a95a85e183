//! The prediction error criterion as a function of the physical parameters.
//!
//! For each record the polynomials follow from eta, `theta = theta(eta)` with `J = d theta/d eta`. Then
//! `psi_eta = psi J`, so `psi_eta' eps = J' psi' eps` and `psi_eta' psi_eta = J' psi' psi J`, each summed over the
//! records. nk changes with tau_e, but the first residual that counts does not change, so the loss is a function of eta
//! only.

use std::{fmt, ops::Range, sync::Arc};

use crate::{
    IdentError, InitialState,
    criterion::{
        Criterion, Data, Workspace,
        further_input::{FurtherInput, InputOrders},
    },
    linalg::vectors::dot,
    optimize::Linearisation,
    optimize::{Minimum, Objective, SearchOptions, minimise},
};

use super::parametrisation::{DelayIntervals, MappedPolynomials, Parametrisation};

/// Criterion for one or several records.
#[derive(Debug, Clone)]
pub(crate) struct PhysicalCriterion<'a, P> {
    pub layout: P,
    pub data: Vec<Data<'a>>,
    /// Values of each further input in each record.
    pub further: Vec<Vec<&'a [f64]>>,
    pub initial: InitialState,
    pub first: usize,
    /// Sampling interval to which each delay of [`Parametrisation::delay_indices`] is restricted; `None` if the delay
    /// itself determines its interval.
    pub samples: Option<Vec<usize>>,
    pub limits: Vec<(f64, f64)>,
    /// Prior knowledge, in units of squared residuals; empty if there is none.
    pub penalty: Vec<Penalty>,
    /// Additional measurements of the operator, which apply to all records.
    pub additional: Option<AdditionalTerm<'a>>,
}

/// Another criterion, which depends on the first elements of eta and is added to the sum of squares with a weight.
#[derive(Clone)]
pub(crate) struct AdditionalTerm<'a> {
    pub criterion: Arc<dyn Objective + Send + Sync + 'a>,
    /// Number of elements of eta on which the criterion depends.
    pub elements: usize,
    pub weight: f64,
}

impl fmt::Debug for AdditionalTerm<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Additional {{ weight: {} }}", self.weight)
    }
}

impl AdditionalTerm<'_> {
    /// Adds the contribution of the additional criterion at eta to a linearisation.
    pub fn add_to(&self, eta: &[f64], total: &mut Linearisation, workspace: &mut Workspace) {
        let (p, q) = (eta.len(), self.elements);
        let own = self.criterion.linearise(&eta[..q], workspace);
        total.sum_of_squares += self.weight * own.sum_of_squares;
        for i in 0..q {
            total.descent[i] += self.weight * own.descent[i];
            for j in 0..q {
                total.gram[i * p + j] += self.weight * own.gram[i * q + j];
            }
        }
    }
}

/// Penalty `v (g(eta_i) - mean)^2/s^2`, which is added to the sum of squares. It is a normal prior for g with the
/// standard deviation s; v is the innovation variance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Penalty {
    /// Index i in eta.
    pub index: usize,
    /// True for `g = ln eta_i` of a positive element, false for `g = eta_i`.
    pub logarithmic: bool,
    pub mean: f64,
    /// Precision `1/s^2`.
    pub precision: f64,
    /// Innovation variance v.
    pub variance: f64,
}

impl Penalty {
    /// Returns the same penalty for another innovation variance.
    pub fn weighted(self, variance: f64) -> Self {
        Self { variance, ..self }
    }

    /// Returns `g(eta_i)` and its derivative.
    fn value_and_slope(&self, eta: &[f64]) -> (f64, f64) {
        let x = eta[self.index];
        if self.logarithmic {
            let x = x.max(f64::MIN_POSITIVE);
            (x.ln(), 1.0 / x)
        } else {
            (x, 1.0)
        }
    }

    /// Returns the weight `v/s^2`.
    fn weight(&self) -> f64 {
        self.variance * self.precision
    }

    /// Returns the contribution of the penalty to the sum of squares.
    pub fn at(&self, eta: &[f64]) -> f64 {
        let (value, _) = self.value_and_slope(eta);
        self.weight() * (self.mean - value).powi(2)
    }

    /// Returns `v g'(eta_i)^2/s^2`, the element of the matrix P that is added to `psi' psi`.
    pub fn curvature(&self, eta: &[f64]) -> f64 {
        let (_, slope) = self.value_and_slope(eta);
        self.weight() * slope * slope
    }

    /// Adds the value and the derivatives of the penalty to the linearisation.
    pub fn add_to(&self, eta: &[f64], total: &mut Linearisation) {
        let i = self.index;
        let (value, slope) = self.value_and_slope(eta);
        total.sum_of_squares += self.at(eta);
        total.descent[i] += self.weight() * (self.mean - value) * slope;
        total.gram[i * eta.len() + i] += self.curvature(eta);
    }
}

impl<'a, P: Parametrisation> PhysicalCriterion<'a, P> {
    pub fn new(layout: P, data: Vec<Data<'a>>, initial: InitialState, first: usize) -> Self {
        let limits = layout.limits().to_vec();
        Self {
            layout,
            data,
            further: Vec::new(),
            initial,
            first,
            samples: None,
            limits,
            penalty: Vec::new(),
            additional: None,
        }
    }

    /// Returns the contribution of the additional measurements to the criterion at eta; zero if there are none.
    pub fn linearise_additional(&self, eta: &[f64], workspace: &mut Workspace) -> Linearisation {
        let mut own = Linearisation::empty(eta.len());
        if let Some(additional) = &self.additional {
            additional.add_to(eta, &mut own, workspace);
        }
        own
    }

    pub fn residual_count(&self) -> usize {
        self.data.iter().map(|d| d.u.len().saturating_sub(self.first)).sum()
    }

    /// Returns the number of initial states of all records.
    pub fn state_count(&self) -> usize {
        let further = self.layout.further_input_orders();
        let of_record = |record: usize| {
            self.with_data((self.layout.orders(1), &further), record, self.data[record])
                .state_count()
        };
        (0..self.data.len()).map(of_record).sum()
    }

    /// Returns the criterion of one record as a function of theta.
    pub fn record_criterion(&self, mapped: &MappedPolynomials, record: usize) -> Criterion<'a> {
        self.with_data((mapped.orders, &mapped.further), record, self.data[record])
    }

    /// Returns the criterion of one record with other samples of e and u, such as a part of the record.
    pub fn with_data<'b>(
        &self,
        (orders, further): (hoid_model::Orders, &[InputOrders]),
        record: usize,
        data: Data<'b>,
    ) -> Criterion<'b>
    where
        'a: 'b,
    {
        let input = |(orders, values): (&InputOrders, &Vec<&'a [f64]>)| FurtherInput {
            orders: *orders,
            values: vec![values[record]],
        };
        Criterion {
            further: further.iter().zip(&self.further).map(input).collect(),
            ..Criterion::for_record(orders, data, self.initial, self.first)
        }
    }

    fn polynomials(&self, eta: &[f64], record: usize) -> Option<MappedPolynomials> {
        let delays = self.layout.delay_indices();
        let held = match &self.samples {
            Some(samples) => DelayIntervals {
                delays: &delays,
                samples,
            },
            None => DelayIntervals::default(),
        };
        self.layout.map(eta, record, held).ok()
    }

    /// Returns ranges of successive records whose parameters have the same indices in eta. All records of a range have
    /// the same polynomials.
    fn ranges_with_equal_positions(&self) -> impl Iterator<Item = Range<usize>> {
        let records = 0..self.data.len();
        let mut next = records.start;
        std::iter::from_fn(move || {
            let start = next;
            let places = (start < records.end).then(|| self.layout.positions(start))?;
            next = (start + 1..records.end)
                .find(|record| self.layout.positions(*record) != places)
                .unwrap_or(records.end);
            Some(start..next)
        })
    }

    /// Sets K_e and K_e_dot to their optimum for the other parameters in eta and returns the sum of squares; the
    /// residual is affine in these gains. All records must have the same parameters, with K_e_dot as a coordinate.
    pub fn optimise_gains(&self, eta: &mut [f64], workspace: &mut Workspace) -> Option<f64> {
        eta[..2].fill(0.0);
        if !self.is_feasible(eta) {
            return None;
        }
        let p = eta.len();
        let at = self.linearise(eta, workspace);
        let (a, b, c) = (at.gram[0], at.gram[1], at.gram[p + 1]);
        let (g, h) = (at.descent[0], at.descent[1]);
        let determinant = a * c - b * b;
        if determinant <= 1e-14 * a * c {
            return None;
        }
        eta[0] = (c * g - b * h) / determinant;
        eta[1] = (a * h - b * g) / determinant;
        let value = at.sum_of_squares - eta[0] * g - eta[1] * h;
        (value.is_finite() && eta.iter().all(|v| v.is_finite())).then_some(value)
    }

    /// Searches for a minimum, starting from eta. The loss has kinks where a delay is an integer number of samples. If
    /// the search does not converge, it continues within single sampling intervals.
    pub fn search(
        &self,
        eta: Vec<f64>,
        options: &SearchOptions,
        rival: Option<f64>,
        workspace: &mut Workspace,
    ) -> Option<Minimum> {
        let minimum = minimise(self, eta, options, rival, workspace)?;
        if minimum.termination.converged() {
            return Some(minimum);
        }
        Some(self.search_in_intervals(minimum, options, workspace))
    }

    /// Searches within single sampling intervals of the delays, and moves to a neighbouring interval as long as the
    /// loss decreases.
    fn search_in_intervals(&self, minimum: Minimum, options: &SearchOptions, workspace: &mut Workspace) -> Minimum {
        let (delays, ts) = (self.layout.delay_indices(), self.layout.sample_time().s());
        let interval_start = self.layout.first_interval_start();
        let slot = |delay_s: f64| delay_s / ts - interval_start;
        let border = |n: usize| (n as f64 + interval_start) * ts;
        let mut samples: Vec<usize> = delays
            .iter()
            .map(|&i| slot(minimum.theta[i]).floor().max(0.0) as usize)
            .collect();
        let inside = |samples: &[usize], start: &Minimum, workspace: &mut Workspace| {
            let mut within = Self {
                samples: Some(samples.to_vec()),
                ..self.clone()
            };
            let mut eta = start.theta.clone();
            for (&i, &sample) in delays.iter().zip(samples) {
                let (low, high) = self.limits[i];
                within.limits[i] = (border(sample).clamp(low, high), border(sample + 1).clamp(low, high));
                eta[i] = eta[i].clamp(within.limits[i].0, within.limits[i].1);
            }
            minimise(&within, eta, options, None, workspace)
        };
        let mut best = inside(&samples, &minimum, workspace).unwrap_or(minimum);
        // Each change of interval decreases the loss; the limit on the number of changes only guards against rounding.
        for _ in 0..100 {
            let mut moved = false;
            for (k, &i) in delays.iter().enumerate() {
                let position = slot(best.theta[i]);
                let neighbours = [
                    (position <= samples[k] as f64 + BORDER_DISTANCE_SAMPLES)
                        .then(|| samples[k].checked_sub(1))
                        .flatten(),
                    (position >= (samples[k] + 1) as f64 - BORDER_DISTANCE_SAMPLES).then_some(samples[k] + 1),
                ];
                for neighbour in neighbours.into_iter().flatten() {
                    let mut there = samples.clone();
                    there[k] = neighbour;
                    let (low, high) = self.limits[i];
                    if border(neighbour + 1) <= low || border(neighbour) >= high {
                        continue;
                    }
                    if let Some(found) = inside(&there, &best, workspace)
                        && found.linearisation.sum_of_squares
                            < best.linearisation.sum_of_squares * (1.0 - options.tolerance)
                    {
                        (best, samples, moved) = (found, there, true);
                        break;
                    }
                }
            }
            if !moved {
                break;
            }
        }
        best
    }

    /// Returns the elements of eta that have a variance, i.e. that are not fixed and not at a bound set by the user. A
    /// kink of the loss is not a bound.
    pub fn free_elements(&self, eta: &[f64], descent: &[f64]) -> Vec<usize> {
        crate::optimize::free_parameters(self, eta, descent)
    }

    /// Returns the polynomials of a record for a given eta.
    pub fn model_of(&self, eta: &[f64], record: usize) -> Result<MappedPolynomials, IdentError> {
        Ok(self.layout.map(eta, record, DelayIntervals::default())?)
    }
}

/// Distance from the border of a sampling interval, in samples, below which the next interval is tried.
const BORDER_DISTANCE_SAMPLES: f64 = 1e-6;

impl<P: Parametrisation> Objective for PhysicalCriterion<'_, P> {
    fn is_feasible(&self, eta: &[f64]) -> bool {
        eta.iter().all(|v| v.is_finite())
            && self.ranges_with_equal_positions().all(|records| {
                self.polynomials(eta, records.start)
                    .is_some_and(|p| self.record_criterion(&p, records.start).is_feasible(&p.theta))
            })
    }

    fn linearise(&self, eta: &[f64], workspace: &mut Workspace) -> Linearisation {
        let p = eta.len();
        let mut total = Linearisation::empty(p);
        for records in self.ranges_with_equal_positions() {
            let Some(polynomials) = self.polynomials(eta, records.start) else {
                // The polynomials are missing only if eta is not feasible.
                total.sum_of_squares = f64::NAN;
                return total;
            };
            let n = polynomials.theta.len();
            let positions = self.layout.positions(records.start);
            let columns = &polynomials.columns;
            for record in records {
                let of_theta = self
                    .record_criterion(&polynomials, record)
                    .linearise(&polynomials.theta, workspace);
                total.sum_of_squares += of_theta.sum_of_squares;
                for (i, &slot) in positions.iter().enumerate() {
                    total.descent[slot] += dot(&columns[i], &of_theta.descent);
                    let product: Vec<f64> = (0..n)
                        .map(|k| dot(&of_theta.gram[k * n..(k + 1) * n], &columns[i]))
                        .collect();
                    for (j, &other) in positions.iter().enumerate() {
                        total.gram[other * p + slot] += dot(&columns[j], &product);
                    }
                }
            }
        }
        for penalty in &self.penalty {
            penalty.add_to(eta, &mut total);
        }
        if let Some(additional) = &self.additional {
            additional.add_to(eta, &mut total, workspace);
        }
        total
    }

    fn stable_blocks(&self) -> Vec<std::ops::Range<usize>> {
        self.layout.stable_blocks()
    }

    fn output_power(&self) -> f64 {
        self.data.iter().map(|d| dot(d.u, d.u)).sum()
    }

    fn limits(&self) -> Option<&[(f64, f64)]> {
        Some(&self.limits)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use hoid_model::SampleTime;

    use super::*;
    use crate::{Constraint, criterion::first_residual, grey_box::layout::Layout};

    fn signals(n: usize) -> Vec<(Vec<f64>, Vec<f64>)> {
        let mut state = 7_u64;
        let mut draw = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..2)
            .map(|_| {
                let (mut slow, mut e, mut u) = (0.0, Vec::new(), Vec::new());
                for t in 0..n {
                    slow = 0.9 * slow + draw();
                    e.push(slow);
                    u.push(if t >= 30 { e[t - 30] } else { 0.0 } + 0.3 * draw());
                }
                (e, u)
            })
            .collect()
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let signals = signals(600);
        let lead_time = [("T_L".to_owned(), Constraint::Between(-9.0, 9.0))];
        for (order, individual, constraints) in [
            (1, vec![], BTreeMap::new()),
            (3, vec!["tau_e".to_owned(), "K_e".to_owned()], BTreeMap::new()),
            (2, vec!["T_n".to_owned()], BTreeMap::from(lead_time)),
        ] {
            for initial in [InitialState::Zero, InitialState::Estimate, InitialState::Backcast] {
                let layout =
                    Layout::new(order, 2, (0.05, 0.6), &constraints, &individual, SampleTime::AT_100_HZ).unwrap();
                let first = first_residual(
                    &super::super::layout::orders(order, layout.longest_nk().unwrap()),
                    initial,
                );
                let data = signals.iter().map(|(e, u)| Data::new(e, u)).collect();
                let criterion = PhysicalCriterion::new(layout, data, initial, first);
                let mut eta = criterion.layout.common_eta(&[0.3, 0.05, 12.0, 0.4, 0.2837, 0.05]);
                // The individual parameters differ from record to record.
                for (i, value) in eta.iter_mut().enumerate() {
                    *value *= 1.0 + 0.01 * i as f64;
                }
                let mut ws = Workspace::borrow_from_thread();
                let at = criterion.linearise(&eta, &mut ws);
                for i in 0..eta.len() {
                    let h = 1e-5 * eta[i];
                    let mut value = |sign: f64| {
                        let mut moved = eta.clone();
                        moved[i] += sign * h;
                        criterion.linearise(&moved, &mut ws).sum_of_squares
                    };
                    let difference = -(value(1.0) - value(-1.0)) / (4.0 * h);
                    let scale = (at.gram[i * eta.len() + i] * at.sum_of_squares).sqrt();
                    // The difference has a truncation error of order h^2 and a rounding error of 1e-16/1e-5, relative
                    // to the scale of the gradient.
                    assert!(
                        (at.descent[i] - difference).abs() < 1e-7 * scale,
                        "m {order} {initial:?} {}: {} and {difference}",
                        criterion.layout.names[i],
                        at.descent[i]
                    );
                }
            }
        }
    }

    #[test]
    fn loss_is_continuous_in_the_delay() {
        let signals = signals(600);
        let layout = Layout::new(2, 2, (0.05, 0.6), &BTreeMap::new(), &[], SampleTime::AT_100_HZ).unwrap();
        let first = first_residual(&super::super::layout::orders(2, 61), InitialState::Estimate);
        let data = signals.iter().map(|(e, u)| Data::new(e, u)).collect();
        let criterion = PhysicalCriterion::new(layout, data, InitialState::Estimate, first);
        let mut ws = Workspace::borrow_from_thread();
        let mut loss = |tau: f64| {
            criterion
                .linearise(&[0.3, 0.05, 12.0, 0.4, tau, 0.05], &mut ws)
                .sum_of_squares
        };
        let (before, there, after) = (loss(0.3 - 1e-9), loss(0.3), loss(0.3 + 1e-9));
        // The relative change in the loss is 1e-9 s times a slope of about 10/s.
        assert!(
            (before / there - 1.0).abs() < 1e-7 && (after / there - 1.0).abs() < 1e-7,
            "{before} {there} {after}"
        );
    }
}
