//! Error measures of an estimate whose true value is known.
//!
//! - `vaf`, %: `100 (1 - sum (u - u_s)^2 / sum u^2)` with the simulated output u_s; the mean is not removed.
//! - `delta_vaf`, %: `vaf` of this estimator minus `vaf` of another one with the same nk on the same run.
//! - `response_error`, %: root mean square of `|H - H0| / |H0|` over the lines of the forcing function, where H0 is the
//!   simulated operator with a hold at the sample time of the simulation. The model need not be converted to operator
//!   parameters, so models of any order can be compared.
//! - `rms_<p>`, %: root mean square of the relative error of a trace, from 10 s after its start, over the rows that can
//!   be converted to operator parameters.
//! - `settle50_<p>`, `settle90_<p>`, s: time from t_M until the trace first covers 50 or 90 % of the step of a
//!   parameter.
//! - `before_<p>`, `after_<p>`, %: mean relative error of a trace from 10 s after its start to t_M, and over its last
//!   10 s; the summary gives the spread over the replications. `covered_<p>`, `covered_through_<p>`, %: share of the
//!   points of a trace at which the true value is within 1.96 standard errors of the estimate, after the start fit and
//!   within 5 s after a change, respectively.
//! - `false_alarms`: number of changes declared more than 5 s after a true change or before the first one; `hours`:
//!   time in which false alarms could occur. `found`, %: share of the true changes after the start fit that were
//!   declared within 5 s; `lag`, s: mean time from these changes to their declaration.
//! - `diverged`: true if a coefficient is not finite or its magnitude exceeds 10.
//! - `noise_level_obtained`: `(var u - var u0) / var u`, where u0 is the output of the run without remnant;
//!   `noise_level_response`: `var(u - u0) / var u`, which excludes the chance correlation between u0 and u - u0;
//!   `noise_level_remnant`: `var n / var u`.

use hoid_ident::Fit;
use hoid_model::{Complex64, Orders, PolynomialModel, Record, Structure, uncertainty::OperatorEstimate};
use hoid_numerics::statistics::mean;
use hoid_track::{StartSource, Trace};

use crate::{columns::TRACED_QUANTITIES, plan::Cell};

/// Time after which the errors of a trace are evaluated, s.
const ERROR_START_S: f64 = 10.0;
/// Magnitude of a coefficient above which a recursion has diverged.
const DIVERGENCE_LIMIT: f64 = 10.0;

/// True response of the operator at the lines of the forcing function.
pub(crate) struct TrueResponse {
    omega_rad_s: Vec<f64>,
    response: Vec<Complex64>,
}

impl TrueResponse {
    pub fn of(cell: &Cell) -> Option<Self> {
        let scenario = cell.resolved.scenario();
        let operator = scenario.initial.operator.discretise(scenario.sample_time).ok()?;
        let orders = Orders {
            nb: 2,
            nf: 2,
            nk: operator.nk,
            ..Orders::default()
        };
        let held = operator.zoh;
        let theta = vec![held.b0, held.b1, held.f1, held.f2];
        let model = PolynomialModel::new(Structure::OutputError, orders, scenario.sample_time, theta).ok()?;
        let omega_rad_s: Vec<f64> = scenario.forcing.sinusoids().iter().map(|s| s.omega_rad_s).collect();
        let response = omega_rad_s.iter().map(|omega| model.response(*omega)).collect();
        Some(Self { omega_rad_s, response })
    }

    pub fn error_percent(&self, fit: &Fit) -> f64 {
        let found = self.omega_rad_s.iter().map(|omega| fit.model().response(*omega));
        let squares: f64 = found
            .zip(&self.response)
            .map(|(h, h0)| (h - h0).norm_sqr() / h0.norm_sqr())
            .sum();
        100.0 * (squares / self.response.len() as f64).sqrt()
    }
}

/// Errors of a trace relative to the true parameters of its record.
pub(crate) struct TraceErrors {
    pub rms_percent: [f64; TRACED_QUANTITIES.len()],
    /// Times from the change until 50 and 90 % of the step are covered, s.
    pub settling_times_s: [[f64; TRACED_QUANTITIES.len()]; 2],
    pub diverged: bool,
    pub share_not_convertible: f64,
}

impl TraceErrors {
    pub fn of(trace: &Trace, record: &Record, cell: &Cell) -> Self {
        let scenario = cell.resolved.scenario();
        let truth = TRACED_QUANTITIES.map(|name| record.channel(name).unwrap_or_default());
        let values = |state: &hoid_model::scenario::OperatingState| {
            let o = OperatorEstimate::from(state.operator).rows();
            [0, 1, 2, 3, 4, 5].map(|i| o[i].2.value)
        };
        let (from, to) = (values(&scenario.initial), values(&scenario.last));
        let change_s = scenario.schedule.change_s().unwrap_or(f64::INFINITY);
        let (mut sums, mut converted, mut counted) = ([0.0; TRACED_QUANTITIES.len()], 0usize, 0usize);
        let mut settled_s = [[f64::NAN; TRACED_QUANTITIES.len()]; 2];
        let mut diverged = false;
        for (row, t) in trace.times_s().iter().enumerate() {
            let bad = |v: &f64| !v.is_finite() || v.abs() > DIVERGENCE_LIMIT;
            diverged |= trace.theta(row).iter().any(bad);
            if *t < ERROR_START_S - 1e-9 {
                continue;
            }
            counted += 1;
            let Ok(found) = trace.operator_values(row) else {
                continue;
            };
            converted += 1;
            let k = ((t - record.time_s(0)) / record.sample_time().s()).round() as usize;
            for (i, (_, _, estimate)) in found.rows().iter().enumerate() {
                let true_value = truth[i].get(k).copied().unwrap_or(f64::NAN);
                sums[i] += ((estimate.value - true_value) / true_value).powi(2);
                if *t <= change_s || (to[i] - from[i]).abs() <= 1e-3 * from[i].abs() {
                    continue;
                }
                let covered = (estimate.value - from[i]) / (to[i] - from[i]);
                for (settled, share) in settled_s.iter_mut().zip([0.5, 0.9]) {
                    if settled[i].is_nan() && covered >= share {
                        settled[i] = t - change_s;
                    }
                }
            }
        }
        Self {
            rms_percent: sums.map(|s| 100.0 * (s / converted as f64).sqrt()),
            settling_times_s: settled_s,
            diverged,
            share_not_convertible: 1.0 - converted as f64 / counted.max(1) as f64,
        }
    }
}

/// Time after a change within which a method should declare it, and during which bands are evaluated separately, s.
const DECLARATION_TIME_S: f64 = 5.0;
/// Length of the final part of a trace whose mean error is evaluated, s.
const FINAL_SPAN_S: f64 = 10.0;
/// Half width of a 95 % band, in standard errors.
const BAND_STANDARD_ERRORS: f64 = 1.96;

/// Measures of how a trace responds to a change: its bias, its bands and its declared changes.
pub(crate) struct ChangeMeasures {
    /// Mean relative error before the change and, in `after_percent`, at the end, %.
    pub before_percent: [f64; TRACED_QUANTITIES.len()],
    pub after_percent: [f64; TRACED_QUANTITIES.len()],
    /// Coverage of the bands after the start fit and, in `covered_through_percent`, within 5 s after a change, %.
    pub covered_percent: [f64; TRACED_QUANTITIES.len()],
    pub covered_through_percent: [f64; TRACED_QUANTITIES.len()],
    pub false_alarms: f64,
    pub hours: f64,
    pub found_percent: f64,
    pub lag_s: f64,
}

/// Sum and number of values, from which the mean is computed.
#[derive(Clone, Copy, Default)]
struct Mean(f64, f64);

impl Mean {
    fn update(&mut self, value: f64) {
        self.0 += value;
        self.1 += 1.0;
    }

    fn percent(self) -> f64 {
        100.0 * self.0 / self.1
    }
}

impl ChangeMeasures {
    pub fn of(trace: &Trace, record: &Record, cell: &Cell) -> Self {
        let scenario = cell.resolved.scenario();
        let truth = TRACED_QUANTITIES.map(|name| record.channel(name).unwrap_or_default());
        let end_s = record.time_s(record.len());
        let changes_s = scenario.schedule.change_times_s(end_s);
        let first_s = changes_s.first().copied().unwrap_or(f64::INFINITY);
        // Bands and declared changes are evaluated only after the start fit, also for a two-sided estimate, whose
        // changes are declared by the causal estimate.
        let fitted_s = match trace.options().start {
            StartSource::Span(Some((_, to))) => to,
            _ => trace.updated_from_s(),
        };
        let within = |t: f64| changes_s.iter().any(|c| (*c..*c + DECLARATION_TIME_S).contains(&t));
        let [mut before, mut after, mut covered, mut through] = [[Mean::default(); TRACED_QUANTITIES.len()]; 4];
        for (row, t) in trace.times_s().iter().enumerate() {
            let Ok(found) = trace.operator(row) else { continue };
            let k = ((t - record.time_s(0)) / record.sample_time().s()).round() as usize;
            for (i, (_, _, estimate)) in found.rows().iter().enumerate() {
                let true_value = truth[i].get(k).copied().unwrap_or(f64::NAN);
                let error = estimate.value - true_value;
                let inside = estimate
                    .standard_error
                    .map(|se| f64::from(u8::from(error.abs() <= BAND_STANDARD_ERRORS * se)));
                if (ERROR_START_S - 1e-9..first_s).contains(t) {
                    before[i].update(error / true_value);
                } else if *t >= end_s - FINAL_SPAN_S {
                    after[i].update(error / true_value);
                }
                if let Some(inside) = inside.filter(|_| *t > fitted_s) {
                    covered[i].update(inside);
                    if within(*t) {
                        through[i].update(inside);
                    }
                }
            }
        }
        let declared: Vec<f64> = trace.changes().iter().map(|(t, _)| *t).collect();
        let to_be_found: Vec<f64> = changes_s.iter().copied().filter(|c| *c > fitted_s).collect();
        let lag = |change: &f64| {
            let first = declared
                .iter()
                .find(|t| (*change..change + DECLARATION_TIME_S).contains(*t));
            first.map(|t| t - change)
        };
        let lags: Vec<f64> = to_be_found.iter().filter_map(lag).collect();
        let has_alarms = !trace.change_odds().is_empty();
        let known = |value: f64| if has_alarms { value } else { f64::NAN };
        Self {
            before_percent: before.map(Mean::percent),
            after_percent: after.map(Mean::percent),
            covered_percent: covered.map(Mean::percent),
            covered_through_percent: through.map(Mean::percent),
            false_alarms: known(declared.iter().filter(|t| !within(**t)).count() as f64),
            hours: known((end_s - fitted_s - DECLARATION_TIME_S * to_be_found.len() as f64).max(0.0) / 3600.0),
            found_percent: known(100.0 * lags.len() as f64 / to_be_found.len() as f64),
            lag_s: known(mean(&lags)),
        }
    }
}
