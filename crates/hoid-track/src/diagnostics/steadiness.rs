//! Tests whether the response is constant where the trace reports no change.
//!
//! The gains of the basis and the delay are fitted to each stretch between two declared changes and are tested for
//! steps, drifts and slow oscillations, and all stretches together for a drift that they share: the method may declare
//! a change somewhere within a long drift ([`hoid_ident::diagnostics::response_changes`]).

use std::ops::Range;

use hoid_core::adaptive::{DYNAMICS_COUNT, GAIN_COUNT};
use hoid_ident::diagnostics::{ResponseBasis, ResponseChange, TimeCourse, response_changes};
use hoid_model::{Finding, Record};

use super::structure::transpose;
use crate::trace::Trace;

/// p-values below which the response is considered to vary within a stretch: by a step, a drift or an oscillation. The
/// p-values count all frequencies and phases of an oscillation as independent, and take the larger of two variances for
/// a step; for about 1 % of simulated people who do not change, the p-value is below each of these limits.
const STEP_P_VALUE: f64 = 0.03;
const DRIFT_P_VALUE: f64 = 0.01;
const OSCILLATION_P_VALUE: f64 = 0.05;
/// Lag of a second basis (in s), for people with a long lag, who respond like an integrator. The basis that explains u
/// better is used.
const LONG_LAG_S: f64 = 10.0;
/// Time excluded at the start of the record and after a faulty span (in s): the fast modes of the basis start at rest.
/// The transient of its lag is estimated.
const SETTLING_S: f64 = 3.0;
/// Time excluded from the stretches before and after a declared change, s.
const EXCLUSION_S: f64 = 5.0;

/// Signals and terms of a basis.
struct BasisSignals {
    columns: Vec<Vec<f64>>,
    terms: Vec<Vec<f64>>,
    lag_s: f64,
}

impl BasisSignals {
    fn basis(&self) -> ResponseBasis<'_> {
        ResponseBasis {
            columns: &self.columns,
            terms: &self.terms,
            lag_s: self.lag_s,
        }
    }
}

impl Trace {
    /// Returns the stretches without a declared change, as ranges of samples of the record.
    fn stretches(&self, record: &Record) -> Vec<Range<usize>> {
        let ts = self.sample_time().s();
        let sample = |t: f64| ((t - record.time_s(0)) / ts).round().clamp(0.0, record.len() as f64) as usize;
        let mut from = sample(self.settled_from_s(record, SETTLING_S));
        let mut all = Vec::new();
        let mut times: Vec<f64> = self
            .changes()
            .iter()
            .map(|(t, change)| t - change.seconds_ago)
            .collect();
        times.sort_by(f64::total_cmp);
        for at in times {
            all.push(from..sample(at - EXCLUSION_S));
            from = from.max(sample(at + EXCLUSION_S));
        }
        all.push(from..record.len());
        all.retain(|stretch| stretch.start < stretch.end);
        all
    }

    /// Returns the test results of all stretches, the most significant first; the p-values account for the number of
    /// stretches.
    pub(super) fn response_changes(&self, record: &Record) -> Vec<ResponseChange> {
        let spanned: Vec<BasisSignals> = [self.lag_s(), LONG_LAG_S]
            .into_iter()
            .filter_map(|lag_s| self.basis_signals(record, lag_s))
            .collect();
        let bases: Vec<ResponseBasis<'_>> = spanned.iter().map(BasisSignals::basis).collect();
        let mut all = response_changes(&bases, record.output(), &self.stretches(record), self.sample_time().s());
        all.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
        all
    }

    fn basis_signals(&self, record: &Record, lag_s: f64) -> Option<BasisSignals> {
        let (basis, signals) = self.signals(record, lag_s)?;
        let term = |i: usize| {
            let mut gains = [0.0; GAIN_COUNT];
            gains[i] = 1.0;
            basis.weights(&gains, &[0.0; DYNAMICS_COUNT]).to_vec()
        };
        Some(BasisSignals {
            columns: transpose(&signals),
            terms: (0..GAIN_COUNT).map(term).collect(),
            lag_s,
        })
    }

    /// Finding that the response varies in a way that the trace does not report. The test is limited to methods with a
    /// basis; other methods forget, or model how people drift, and do not assume that a person is constant between
    /// changes.
    pub(super) fn response_change_finding(&self, record: &Record) -> Option<Finding> {
        self.options().basis_lag_of_one_input_s()?;
        let unlikely = |found: &ResponseChange| match found.time_course {
            TimeCourse::Oscillation(_) => found.p_value / OSCILLATION_P_VALUE,
            TimeCourse::Step => found.p_value / STEP_P_VALUE,
            TimeCourse::Drift => found.p_value / DRIFT_P_VALUE,
        };
        let found = self
            .response_changes(record)
            .into_iter()
            .filter(|found| unlikely(found) < 1.0);
        let found = found.min_by(|a, b| unlikely(a).total_cmp(&unlikely(b)))?;
        let [by, error] = found.size;
        let size = match found.name {
            "gain" => format!("{:+.0} ± {:.0} %", 100.0 * by, 100.0 * error),
            _ => format!("{by:+.3} ± {error:.3} s"),
        };
        let (name, p) = (found.name, found.p_value);
        let (kind, words) = match found.time_course {
            TimeCourse::Step => (
                "undeclared-change",
                format!(
                    "the {name} of the person changes by {size} about {:.0} s after the start (p = {p:.0e}), where the \
                     trace declares no change",
                    record.time_s(found.first_sample) - record.time_s(0)
                ),
            ),
            TimeCourse::Drift => (
                "drifting",
                format!("the {name} of the person drifts by {size} where the trace declares no change (p = {p:.0e})"),
            ),
            TimeCourse::Oscillation(period) => (
                "swaying",
                format!(
                    "the {name} of the person oscillates by {size} with a period of about {period:.0} s (p = \
                         {p:.0e})"
                ),
            ),
        };
        let finding = Finding::warning(
            kind,
            format!("{words}; the bands assume a person who does not change, and are too narrow here"),
        );
        let at_s = record.time_s(found.first_sample);
        Some(match found.time_course {
            TimeCourse::Step => finding.over(at_s, at_s),
            TimeCourse::Drift | TimeCourse::Oscillation(_) => finding,
        })
    }
}
