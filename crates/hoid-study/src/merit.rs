//! Figures of merit of an estimate whose truth is known.
//!
//! - `vaf`, %: eq. 39 of the simulated output, no mean removed.
//! - `delta_vaf`, %: `vaf` less that of another estimator with the same nk on the same run (eq. 40).
//! - `response_error`, %: root of the mean over the lines of the forcing function of `|H - H0|^2 / |H0|^2`, where H0 is the simulated operator
//!   as it is held at the sample time of the simulation. It needs no conversion, so that models of any order can be compared.
//! - `rms_<p>`, %: root mean square of the relative error of a trace from 10 s after the start on, over what converts.
//! - `settle50_<p>`, `settle90_<p>`, s: time after t_M at which the trace has first covered 50 or 90 % of the step of a parameter.
//! - `diverged`: a coefficient is no number, or its magnitude is beyond 10.
//! - `noise_level_obtained`: `(var u - var u0) / var u` with u0 of the run without remnant (A.4), `noise_level_response`:
//!   `var(u - u0) / var u`, which lacks the chance correlation of the two, and `noise_level_remnant`: `var n / var u`.

use hoid_ident::{Fit, tracking::Trace};
use hoid_model::{
    Complex64, Orders, PolynomialModel, Record, Structure, schedule::Schedule, uncertainty::OperatorEstimate,
};

use crate::{columns::OPERATOR, plan::Cell};

/// Time from which the errors of a trace count, s.
const ERRORS_FROM_S: f64 = 10.0;
/// Magnitude of a coefficient beyond which a recursion has diverged.
const DIVERGED: f64 = 10.0;

/// The true response at the lines of the forcing function.
pub(crate) struct Truth {
    omega_rad_s: Vec<f64>,
    response: Vec<Complex64>,
}

impl Truth {
    pub fn of(cell: &Cell) -> Option<Self> {
        let scenario = cell.resolved.scenario();
        let operator = scenario.initial.operator.discretise(scenario.sample_time).ok()?;
        let orders = Orders {
            nb: 2,
            nf: 2,
            nk: operator.nk,
            ..Orders::default()
        };
        let held = operator.held;
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

/// The errors of a trace against the true parameters of its record.
pub(crate) struct TraceErrors {
    pub rms_percent: [f64; 5],
    /// 50 and 90 % of the step.
    pub settled_s: [[f64; 5]; 2],
    pub diverged: bool,
    pub share_not_convertible: f64,
}

impl TraceErrors {
    pub fn of(trace: &Trace, record: &Record, cell: &Cell) -> Self {
        let scenario = cell.resolved.scenario();
        let truth = OPERATOR.map(|name| record.channel(name).unwrap_or_default());
        let values = |state: &hoid_model::scenario::OperatingState| {
            let o = OperatorEstimate::from(state.operator).rows();
            [0, 1, 2, 3, 4].map(|i| o[i].2.value)
        };
        let (from, to) = (values(&scenario.initial), values(&scenario.last));
        let change_s = match scenario.schedule {
            Schedule::Constant => f64::INFINITY,
            Schedule::Sigmoid { midpoint_s, .. } => midpoint_s,
        };
        let (mut sums, mut converted, mut counted) = ([0.0; 5], 0usize, 0usize);
        let mut settled_s = [[f64::NAN; 5]; 2];
        let mut diverged = false;
        for (row, t) in trace.times_s().iter().enumerate() {
            let bad = |v: &f64| !v.is_finite() || v.abs() > DIVERGED;
            diverged |= trace.theta(row).iter().any(bad);
            if *t < ERRORS_FROM_S - 1e-9 {
                continue;
            }
            counted += 1;
            let Ok(found) = trace.operator(row) else { continue };
            converted += 1;
            let k = ((t - record.time_s(0)) / record.sample_time().s()).round() as usize;
            for (i, (_, _, estimate)) in found.rows()[..5].iter().enumerate() {
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
            settled_s,
            diverged,
            share_not_convertible: 1.0 - converted as f64 / counted.max(1) as f64,
        }
    }
}

/// Variance around the mean.
pub(crate) fn variance(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n
}
