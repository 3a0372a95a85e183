//! The estimate at the samples of a run.

use hoid_model::{
    Finding, NotConvertible, Orders, PolynomialModel, SampleTime, Structure,
    uncertainty::{Estimate, OperatorEstimate, operator_estimate},
};

use crate::{
    Change, Counts, TrackFault,
    further_input::FurtherOperator,
    open_loop::{NoCrossover, OpenLoop},
    options::TrackOptions,
    recursion::Delay,
    response::Response,
    two_sided::TwoSidedEstimate,
};
use hoid_ident::{Fit, IdentError, family::LoopShape};

/// The estimate at each sample that was kept, with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    pub(crate) options: TrackOptions,
    pub(crate) sample_time: SampleTime,
    /// Time of each row, s.
    pub(crate) times_s: Vec<f64>,
    /// theta of each row, row after row.
    pub(crate) theta: Vec<f64>,
    /// Upper triangle, by rows, of the covariance of theta in each row of the trace; NaN if there is none.
    pub(crate) covariance: Vec<f64>,
    /// Operator of each row, for a recursion in physical parameters.
    pub(crate) operator: Vec<OperatorEstimate>,
    /// Delay of each row, if it is tracked.
    pub(crate) delays: Vec<Delay>,
    /// Responses of each row at the frequencies of the options, for methods whose response differs from the response of
    /// the polynomials.
    pub(crate) responses: Vec<f64>,
    /// Response to the further input of each row, for methods that estimate it in parameters, and at the frequencies
    /// [`TrackOptions::further_rad_s`].
    pub(crate) further_operator: Vec<FurtherOperator>,
    pub(crate) further_responses: Vec<f64>,
    /// Crossover and margin of each row, for methods whose response differs from the response of the polynomials, and
    /// the reason in rows without a crossover.
    pub(crate) open_loops: Vec<f64>,
    pub(crate) no_crossover: Vec<Option<NoCrossover>>,
    pub(crate) innovation: Vec<f64>,
    pub(crate) innovation_variance: Vec<f64>,
    pub(crate) shortened: Vec<u64>,
    /// Evidence of a recent change in each row, as [`Change::odds`], for methods that compute it.
    pub(crate) change_odds: Vec<f64>,
    /// Times of declaration in s, with the declared changes.
    pub(crate) changes: Vec<(f64, Change)>,
    pub(crate) counts: Counts,
    /// Events found by the guard.
    pub(crate) faults: Vec<TrackFault>,
    /// Number of held-back samples up to each row.
    pub(crate) held: Vec<u64>,
    /// True if the recursion had a guard.
    pub(crate) guarded: bool,
    /// Length of the idle head of the record, s.
    pub(crate) idle_s: f64,
    /// The batch fit of the start span.
    pub(crate) start: Option<Fit>,
    pub(crate) failures: Option<(usize, String)>,
    /// Finding that the response at the end is implausible for a person.
    pub(crate) response_finding: Option<Finding>,
    /// Responses at the end at the frequencies at which the lag of the basis is tested.
    pub(crate) low_responses: Vec<Response>,
    /// Every crossing of the open loop of the last row with the controlled element of the options.
    pub(crate) loop_shape: Option<LoopShape>,
    /// True if the response at the end is determined at some frequency, whether or not gain and lead are.
    pub(crate) response_is_known: bool,
    /// Number of samples between two rows.
    pub(crate) every: usize,
    /// Length of the moving average in rows; 1 if there is no moving average.
    pub(crate) averaged: usize,
    /// Time from which the estimate was updated, s.
    pub(crate) updated_from_s: f64,
}

/// Names of the operator's columns.
pub const OPERATOR_COLUMNS: [&str; 5] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"];

impl Trace {
    /// Returns an empty trace, with capacity for `rows` rows.
    pub(crate) fn empty(options: TrackOptions, sample_time: SampleTime, rows: usize, every: usize) -> Self {
        let p = options.coefficient_count();
        Self {
            options,
            sample_time,
            times_s: Vec::with_capacity(rows),
            theta: Vec::with_capacity(rows * p),
            covariance: Vec::with_capacity(rows * packed_len(p)),
            operator: Vec::new(),
            delays: Vec::new(),
            responses: Vec::new(),
            further_operator: Vec::new(),
            further_responses: Vec::new(),
            open_loops: Vec::new(),
            no_crossover: Vec::new(),
            innovation: Vec::with_capacity(rows),
            innovation_variance: Vec::with_capacity(rows),
            shortened: Vec::with_capacity(rows),
            change_odds: Vec::new(),
            changes: Vec::new(),
            counts: Counts::default(),
            faults: Vec::new(),
            held: Vec::with_capacity(rows),
            guarded: false,
            idle_s: 0.0,
            start: None,
            failures: None,
            response_finding: None,
            low_responses: Vec::new(),
            loop_shape: None,
            response_is_known: false,
            every,
            averaged: 1,
            updated_from_s: f64::NEG_INFINITY,
        }
    }

    /// Replaces the estimate of each row by a two-sided estimate.
    pub(crate) fn replace_rows(&mut self, rows: Vec<TwoSidedEstimate>) {
        let p = self.options.coefficient_count();
        self.theta.clear();
        self.covariance.clear();
        self.covariance.reserve(rows.len() * packed_len(p));
        self.operator.clear();
        self.innovation_variance.clear();
        for row in rows {
            self.theta.extend(row.theta);
            pack(&row.covariance, p, &mut self.covariance);
            self.operator.push(row.operator);
            self.innovation_variance.push(row.innovation_variance);
        }
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.times_s.len()
    }

    /// True for a trace without rows.
    pub fn is_empty(&self) -> bool {
        self.times_s.is_empty()
    }

    /// Returns the options of the trace.
    pub fn options(&self) -> &TrackOptions {
        &self.options
    }

    /// Returns the sample time of the record.
    pub fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    /// Returns the times of the rows, s.
    pub fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// Returns the names of the coefficients. If the delay is a parameter, B has three coefficients, the first at the
    /// smallest tracked delay.
    pub fn parameter_names(&self) -> Vec<String> {
        self.options.coefficient_names()
    }

    fn width(&self) -> usize {
        self.options.coefficient_count()
    }

    /// Returns theta of a row.
    ///
    /// # Panics
    /// This method and the following methods of a row panic beyond the last row.
    pub fn theta(&self, row: usize) -> &[f64] {
        let p = self.width();
        &self.theta[row * p..(row + 1) * p]
    }

    /// Returns the covariance of theta in a row, by rows; `None` while there is none.
    pub fn covariance(&self, row: usize) -> Option<Vec<f64>> {
        let p = self.width();
        let packed = &self.covariance[row * packed_len(p)..(row + 1) * packed_len(p)];
        let whole = unpack(packed, p);
        whole.iter().all(|c| c.is_finite()).then_some(whole)
    }

    /// True for a row before the first estimate of a method that needs no start fit; such a row contains no estimate.
    pub fn is_before_first_estimate(&self, row: usize) -> bool {
        self.options.method.is_self_starting() && self.covariance(row).is_none()
    }

    /// Returns each coefficient of a row with its standard error.
    pub fn parameters(&self, row: usize) -> Vec<Estimate> {
        let p = self.width();
        let packed = &self.covariance[row * packed_len(p)..(row + 1) * packed_len(p)];
        let mut at = 0;
        self.theta(row)
            .iter()
            .enumerate()
            .map(|(i, &value)| {
                let variance = packed[at];
                at += p - i;
                Estimate::with_variance(value, variance)
            })
            .collect()
    }

    /// Returns the operator of a row with standard errors.
    ///
    /// # Errors
    /// [`NotConvertible`] with the reason.
    pub fn operator(&self, row: usize) -> Result<OperatorEstimate, NotConvertible> {
        if let Some(operator) = self.operator.get(row) {
            return if operator.t_l_s.value.is_finite() {
                Ok(*operator)
            } else {
                Err(NotConvertible::ZeroGain)
            };
        }
        let covariance = self.covariance(row);
        self.operator_of_polynomials(row, covariance.as_deref())
    }

    fn operator_of_polynomials(
        &self,
        row: usize,
        covariance: Option<&[f64]>,
    ) -> Result<OperatorEstimate, NotConvertible> {
        let (theta, covariance) = self.options.first_input_part(self.theta(row), covariance);
        operator_from_theta(
            self.options.structure,
            self.options.orders,
            self.delays.get(row),
            self.sample_time,
            theta,
            covariance.as_deref(),
        )
    }

    /// Returns the orders of the polynomials of a row, with the delay of the row.
    fn orders_at(&self, row: usize) -> Orders {
        let orders = self.options.polynomial_orders();
        self.delays
            .get(row)
            .map_or(orders, |delay| Orders { nk: delay.nk, ..orders })
    }

    /// Returns the operator of a row without standard errors, which take most of the time of
    /// [`Trace::operator`].
    ///
    /// # Errors
    /// [`NotConvertible`] with the reason.
    pub fn operator_values(&self, row: usize) -> Result<OperatorEstimate, NotConvertible> {
        if self.operator.is_empty() {
            self.operator_of_polynomials(row, None)
        } else {
            self.operator(row)
        }
    }

    /// Returns the response of a row at the frequency with this index in [`TrackOptions::at_rad_s`]; `None` while
    /// there is no estimate, and for an index without a frequency.
    pub fn response(&self, row: usize, place: usize) -> Option<Response> {
        let count = self.options.at_rad_s.len();
        let omega_rad_s = *self.options.at_rad_s.get(place)?;
        if self.responses.is_empty() {
            return Some(self.response_at(row, omega_rad_s));
        }
        let from = (row * count + place) * Response::PACKED_LEN;
        Response::unpack(&self.responses[from..from + Response::PACKED_LEN])
    }

    /// Returns the response of the polynomials of a row at a frequency in rad/s, for methods that have no other
    /// response.
    pub fn response_at(&self, row: usize, omega_rad_s: f64) -> Response {
        let covariance = self.covariance(row);
        let (theta, whole) = self.options.first_input_part(self.theta(row), covariance.as_deref());
        Response::from_polynomials(
            &self.orders_at(row),
            theta,
            whole.as_deref(),
            omega_rad_s,
            self.sample_time,
        )
    }

    /// Returns the response to the further input in a row, for methods that estimate it in parameters; `None` without a
    /// further input, and while there is no estimate.
    pub fn further_operator(&self, row: usize) -> Option<FurtherOperator> {
        self.further_operator
            .get(row)
            .copied()
            .filter(|_| !self.is_before_first_estimate(row))
    }

    /// Returns the response to the further input in a row, at a frequency in rad/s; `None` without a further input. For
    /// a method that starts itself, the frequency must be one of those of the options or of
    /// [`crate::FURTHER_RESPONSES_RAD_S`].
    pub fn further_response(&self, row: usize, omega_rad_s: f64) -> Option<Response> {
        let further = self.options.further.as_ref()?;
        if self.options.method.is_self_starting() {
            let all = self.options.further_rad_s();
            let place = all.iter().position(|omega| *omega == omega_rad_s)?;
            let from = (row * all.len() + place) * Response::PACKED_LEN;
            return Response::unpack(&self.further_responses[from..from + Response::PACKED_LEN]);
        }
        let (orders, covariance) = (self.orders_at(row), self.covariance(row));
        let (theta, ts) = (self.theta(row), self.sample_time);
        Some(further.response(&orders, theta, covariance.as_deref(), omega_rad_s, ts))
    }

    /// Returns every crossing of the open loop of the last row with the controlled element of the options, and the
    /// stability of the closed loop; `None` without a controlled element.
    pub fn loop_shape(&self) -> Option<&LoopShape> {
        self.loop_shape.as_ref()
    }

    /// Returns the crossover and phase margin of a row with the controlled element of the options; `None` without a
    /// controlled element.
    pub fn open_loop(&self, row: usize) -> Option<Result<OpenLoop, NoCrossover>> {
        let element = self.options.controlled_element.as_ref()?;
        if !self.open_loops.is_empty() {
            let from = row * OpenLoop::PACKED_LEN;
            let found = OpenLoop::unpack(&self.open_loops[from..from + OpenLoop::PACKED_LEN]);
            return Some(found.ok_or(self.no_crossover[row].unwrap_or(NoCrossover::NotDetermined)));
        }
        let (orders, ts) = (self.orders_at(row), self.sample_time);
        let value = |omega: f64| Some(Response::polynomial_response_value(&orders, self.theta(row), omega, ts));
        let whole = |omega: f64| Some(self.response_at(row, omega));
        Some(OpenLoop::of(value, whole, element, ts))
    }

    /// Returns the a-priori innovation of each row.
    pub fn innovation(&self) -> &[f64] {
        &self.innovation
    }

    /// Returns the tracked innovation variance of each row.
    pub fn innovation_variance(&self) -> &[f64] {
        &self.innovation_variance
    }

    /// Returns the number of steps up to each row that stability or a bound shortened.
    pub fn steps_shortened(&self) -> &[u64] {
        &self.shortened
    }

    /// Returns the evidence of a recent change in each row: -ln p of the change test for `adaptive`, the logarithm of
    /// the odds of a change within the last four seconds for `multiple-model`; empty for other methods.
    pub fn change_odds(&self) -> &[f64] {
        &self.change_odds
    }

    /// Returns the declared changes, each with its time of declaration in s, including those at rows that are not
    /// kept.
    pub fn changes(&self) -> &[(f64, Change)] {
        &self.changes
    }

    /// Returns the counts of faulty samples.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Returns the faulty spans that the guard found, each with the action of the guard.
    pub fn faults(&self) -> &[TrackFault] {
        &self.faults
    }

    /// Returns the number of samples up to each row that the guard held back, or during which it kept the estimate
    /// constant.
    pub fn held_counts(&self) -> &[u64] {
        &self.held
    }

    /// True if the recursion had a guard.
    pub fn is_guarded(&self) -> bool {
        self.guarded
    }

    /// Returns the length of the idle head of the record, which the default start span omits, s.
    pub fn idle_s(&self) -> f64 {
        self.idle_s
    }

    /// Returns the batch fit of the start span.
    pub fn start(&self) -> Option<&Fit> {
        self.start.as_ref()
    }

    /// Returns the number of failed fits and the reason for the last failure, for the method `window`.
    pub fn failures(&self) -> Option<&(usize, String)> {
        self.failures.as_ref()
    }

    /// Returns the time from which the estimate was updated, s.
    pub fn updated_from_s(&self) -> f64 {
        self.updated_from_s
    }

    /// Returns the number of samples between two rows.
    pub fn row_interval(&self) -> usize {
        self.every
    }

    /// Returns the length of the moving average in rows; 1 if there is no moving average.
    pub fn averaging_rows(&self) -> usize {
        self.averaged
    }

    /// Returns the delay of the rows due to the moving average (in s): half its length.
    pub fn averaging_delay_s(&self) -> f64 {
        (self.averaged - 1) as f64 / 2.0 * self.every as f64 * self.sample_time.s()
    }

    /// Replaces each row by the mean of the last `rows` rows: theta, operator, delay, responses, crossover and margin,
    /// with their variances and covariances.
    ///
    /// The mean lags by `(rows - 1)/2` rows. Estimates of neighbouring samples have nearly the same error, so the mean
    /// of the covariances is close to, and never below, the covariance of the mean.
    #[must_use]
    pub fn moving_average(mut self, rows: usize) -> Self {
        let p = self.width();
        if rows <= 1 || self.averaged > 1 {
            return self;
        }
        self.theta = causal_mean(&self.theta, p, rows);
        self.covariance = causal_mean(&self.covariance, packed_len(p), rows);
        let width = Response::PACKED_LEN * self.options.at_rad_s.len();
        if !self.responses.is_empty() {
            self.responses = causal_mean(&self.responses, width, rows);
        }
        if !self.further_responses.is_empty() {
            let width = Response::PACKED_LEN * self.options.further_rad_s().len();
            self.further_responses = causal_mean(&self.further_responses, width, rows);
        }
        let packed = |e: Estimate| [e.value, e.standard_error.map_or(f64::NAN, |s| s * s)];
        let of_further = self
            .further_operator
            .iter()
            .flat_map(FurtherOperator::parameters)
            .flat_map(packed);
        let means = causal_mean(&of_further.collect::<Vec<_>>(), 6, rows);
        for (operator, mean) in self.further_operator.iter_mut().zip(means.chunks_exact(6)) {
            let of = |i: usize| Estimate::with_variance(mean[i], mean[i + 1]);
            *operator = FurtherOperator {
                k_f: of(0),
                k_f_dot: of(2),
                tau_f_s: of(4),
            };
        }
        if !self.open_loops.is_empty() {
            self.open_loops = causal_mean(&self.open_loops, OpenLoop::PACKED_LEN, rows);
        }
        let taus: Vec<f64> = (self.delays.iter())
            .flat_map(|delay| {
                let error = delay.tau_e_s.standard_error.unwrap_or(f64::NAN);
                [delay.tau_e_s.value, error * error]
            })
            .collect();
        for (delay, mean) in self.delays.iter_mut().zip(causal_mean(&taus, 2, rows).chunks_exact(2)) {
            delay.tau_e_s = Estimate::with_variance(mean[0], mean[1]);
        }
        let numbers: Vec<f64> = self
            .operator
            .iter()
            .flat_map(|o| {
                o.rows()
                    .map(|(_, _, e)| [e.value, e.standard_error.map_or(f64::NAN, |s| s * s)])
            })
            .flatten()
            .collect();
        let means = causal_mean(&numbers, 12, rows);
        let of = |pair: &[f64]| Estimate::with_variance(pair[0], pair[1]);
        self.operator = means
            .chunks_exact(12)
            .map(|m| OperatorEstimate {
                k_e: of(&m[0..2]),
                t_l_s: of(&m[2..4]),
                k_e_dot: of(&m[4..6]),
                omega_nm_rad_s: of(&m[6..8]),
                zeta_nm: of(&m[8..10]),
                tau_e_s: of(&m[10..12]),
            })
            .collect();
        self.averaged = rows;
        self
    }
}

/// Returns the operator with the coefficients theta, with standard errors if there is a covariance.
pub(crate) fn operator_from_theta(
    structure: Structure,
    orders: Orders,
    delay: Option<&Delay>,
    sample_time: SampleTime,
    theta: &[f64],
    covariance: Option<&[f64]>,
) -> Result<OperatorEstimate, NotConvertible> {
    let orders = delay.map_or(orders, |delay| Orders { nk: delay.nk, ..orders });
    let model = PolynomialModel::new(structure, orders, sample_time, theta.to_vec()).map_err(|_| {
        NotConvertible::OtherOrders {
            nb: orders.nb,
            poles: orders.na + orders.nf,
        }
    })?;
    let found = match covariance {
        Some(covariance) => operator_estimate(&model, covariance)?,
        None => OperatorEstimate::from(model.discrete_operator()?.parameters()?),
    };
    Ok(OperatorEstimate {
        tau_e_s: delay.map_or(found.tau_e_s, |delay| delay.tau_e_s),
        ..found
    })
}

/// Returns the number of elements in the upper triangle of a p x p matrix.
pub(crate) fn packed_len(p: usize) -> usize {
    p * (p + 1) / 2
}

/// Appends the upper triangle of a p x p matrix by rows.
pub(crate) fn pack(whole: &[f64], p: usize, into: &mut Vec<f64>) {
    for i in 0..p {
        into.extend_from_slice(&whole[i * p + i..(i + 1) * p]);
    }
}

fn unpack(packed: &[f64], p: usize) -> Vec<f64> {
    let mut whole = vec![0.0; p * p];
    let mut at = 0;
    for i in 0..p {
        for j in i..p {
            whole[i * p + j] = packed[at];
            whole[j * p + i] = packed[at];
            at += 1;
        }
    }
    whole
}

/// Returns the mean of each column over the last `rows` rows, or over fewer rows at the start. Only the means over a
/// row with NaN are NaN.
fn causal_mean(values: &[f64], width: usize, rows: usize) -> Vec<f64> {
    if width == 0 {
        return Vec::new();
    }
    let n = values.len() / width;
    let mut means = vec![0.0; values.len()];
    for column in 0..width {
        let (mut sum, mut unknown) = (0.0, 0usize);
        for t in 0..n {
            // The sum restarts with each window, so rounding errors do not accumulate.
            if t % rows == 0 {
                let window = t.saturating_sub(rows - 1)..t;
                let known = window.map(|s| values[s * width + column]).filter(|v| !v.is_nan());
                sum = known.sum();
                unknown = (t.saturating_sub(rows - 1)..t)
                    .filter(|s| values[s * width + column].is_nan())
                    .count();
            } else if t >= rows {
                match values[(t - rows) * width + column] {
                    v if v.is_nan() => unknown -= 1,
                    v => sum -= v,
                }
            }
            match values[t * width + column] {
                v if v.is_nan() => unknown += 1,
                v => sum += v,
            }
            let count = rows.min(t + 1);
            means[t * width + column] = if unknown > 0 { f64::NAN } else { sum / count as f64 };
        }
    }
    means
}

/// Checks that the number of samples between two rows is at least one.
pub(crate) fn check_row_interval(every: usize) -> Result<(), IdentError> {
    if every > 0 {
        return Ok(());
    }
    Err(IdentError::BadOption {
        option: "the rows of the trace".to_owned(),
        found: "every 0 samples".to_owned(),
        expected: "1 or more".to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn causal_mean_is_the_mean_of_the_last_rows() {
        let values: Vec<f64> = (0..40).map(|t| f64::from(t * t % 17)).collect();
        for rows in 1..9 {
            let means = causal_mean(&values, 2, rows);
            for t in 0..20 {
                let from = (t + 1usize).saturating_sub(rows);
                for column in 0..2 {
                    let direct: f64 = (from..=t).map(|s| values[s * 2 + column]).sum::<f64>() / (t + 1 - from) as f64;
                    assert!((means[t * 2 + column] - direct).abs() < 1e-12, "{rows} {t}");
                }
            }
        }
    }

    #[test]
    fn nan_rows_spread_only_over_the_averaging_length() {
        let mut values = vec![1.0; 12];
        values[4] = f64::NAN;
        let means = causal_mean(&values, 1, 3);
        let unknown: Vec<usize> = (0..12).filter(|t| means[*t].is_nan()).collect();
        assert_eq!(unknown, [4, 5, 6]);
        assert!((0..12).filter(|t| !means[*t].is_nan()).all(|t| means[t] == 1.0));
    }

    #[test]
    fn packed_triangles_round_trip() {
        let whole = [1.0, 2.0, 3.0, 2.0, 4.0, 5.0, 3.0, 5.0, 6.0];
        let mut packed = Vec::new();
        pack(&whole, 3, &mut packed);
        assert_eq!(packed.len(), packed_len(3));
        assert_eq!(unpack(&packed, 3), whole);
    }
}
