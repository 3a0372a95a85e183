//! Tests whether the operator of the last row has the structure of the person.
//!
//! With the basis for people, the numerator, corrections of the poles and of the delay, and a level can be estimated;
//! together they span the six signals of the filter of the basis. One of these signals, passed through the lag once
//! more, gives a correction of the lag, in case only the lag is wrong. The test examines whether earlier errors, since
//! the last change, carry more information about u ([`hoid_ident::diagnostics::residual_response()`]).

use std::ops::Range;

use hoid_core::adaptive::basis::{Basis, Point, Signals};
use hoid_ident::diagnostics::{ResidualResponse, residual_response};
use hoid_model::{Finding, Record};

use crate::{
    guard::{GuardKind, TrackFault},
    trace::Trace,
};

/// p-value of the test below which the operator is considered to lack part of the person's structure.
const P_VALUE_LIMIT: f64 = 1e-3;
/// p-value above which a corrected lag is considered to explain the residual.
const LAG_P_VALUE: f64 = 0.02;
/// Longest span that is examined, and the time excluded at its start because the filters start at rest (both in s).
const MAX_SPAN_S: f64 = 120.0;
const SETTLING_S: f64 = 10.0;
/// Lag of the basis for methods without one, s.
const LAG_S: f64 = 3.0;

impl Trace {
    /// Finding that the record contradicts the structure of the operator.
    pub(super) fn missed_structure_finding(&self, record: &Record) -> Option<Finding> {
        let found = self.residual_response(record)?;
        (found.p_value < P_VALUE_LIMIT).then(|| {
            Finding::warning(
                "structure",
                format!(
                    "past errors explain more of u than the final operator can, with any gains and with corrections of \
                     its poles, delay and lag (p = {:.1e}, {:.1} % of the innovations); the estimate is the nearest \
                     operator that the method can represent",
                    found.p_value,
                    100.0 * found.share
                ),
            )
        })
    }

    /// Returns the result of the test; `None` for methods without a basis.
    pub(super) fn residual_response(&self, record: &Record) -> Option<ResidualResponse> {
        self.options().basis_lag_of_one_input_s()?;
        let ts = self.sample_time().s();
        let end = self.times_s().last()? + ts;
        let changed = self.changes().last().map(|(t, change)| t - change.seconds_ago);
        let from = self
            .settled_from_s(record, SETTLING_S)
            .max(changed.unwrap_or(f64::MIN))
            .max(end - MAX_SPAN_S);
        let first = ((from - record.time_s(0)) / ts).round().max(0.0) as usize;
        let (basis, signals) = self.signals(record, self.lag_s())?;
        let mut columns = transpose(&signals);
        columns.push(apply_lag(&columns[0], basis.point().lag, ts));
        let of = |columns: &[Vec<f64>]| residual_response(columns, record.input(), record.output(), first, ts);
        let corrected = of(&columns)?;
        if corrected.p_value > LAG_P_VALUE {
            return Some(corrected);
        }
        columns.pop();
        of(&columns)
    }

    /// Returns the time from which the filters of the basis have settled (in s): a settling time after the start of the
    /// record or after the last faulty span that is neither an outlier nor a step.
    pub(super) fn settled_from_s(&self, record: &Record, settling_s: f64) -> f64 {
        self.hostile_spans()
            .fold(record.time_s(0), |last, fault| last.max(fault.to_s))
            + settling_s
    }

    /// Returns the faulty spans that are neither outliers nor steps.
    fn hostile_spans(&self) -> impl Iterator<Item = &TrackFault> {
        let outliers = [GuardKind::Outlier, GuardKind::Step];
        self.faults()
            .iter()
            .filter(move |fault| !outliers.contains(&fault.kind))
    }

    /// Returns the longest range of samples between two hostile spans.
    pub(super) fn longest_span_without_faults(&self, record: &Record) -> Range<usize> {
        let ts = self.sample_time().s();
        let sample = |t: f64| ((t - record.time_s(0)) / ts).round().clamp(0.0, record.len() as f64) as usize;
        let mut from = 0;
        let mut longest = 0..0;
        let ends = self
            .hostile_spans()
            .map(|fault| [sample(fault.from_s), sample(fault.to_s)]);
        for [end, next] in ends.chain([[record.len(); 2]]) {
            if end.saturating_sub(from) > longest.len() {
                longest = from..end;
            }
            from = next;
        }
        longest
    }

    /// Returns the lag of the basis of the method, s.
    pub(super) fn lag_s(&self) -> f64 {
        self.options().method.basis_lag_s().unwrap_or(LAG_S)
    }

    /// Returns the basis of the operator of the last row with this lag, and the signals of the basis at each sample of
    /// the record.
    pub(super) fn signals(&self, record: &Record, lag_s: f64) -> Option<(Basis, Vec<Signals>)> {
        let operator = self.operator(self.len().checked_sub(1)?).ok()?;
        let ts = record.sample_time().s();
        let point = Point {
            tau: operator.tau_e_s.value + 0.5 * ts,
            omega: operator.omega_nm_rad_s.value,
            zeta: operator.zeta_nm.value,
            lag: lag_s,
        };
        let mut basis = Basis::new(point, ts)?;
        let (e, delay) = (record.input(), basis.delay());
        let error = |k: usize, ago: usize| k.checked_sub(ago).map_or(0.0, |k| e[k]);
        let rows = (0..e.len())
            .map(|k| basis.step([0, 1, 2].map(|j| error(k, delay + j))))
            .collect();
        Some((basis, rows))
    }
}

/// Passes a signal through the lag once more. The result serves to correct the lag, as the other columns correct poles
/// and delay.
fn apply_lag(signal: &[f64], lag_s: f64, sample_time_s: f64) -> Vec<f64> {
    let pole = (-sample_time_s / lag_s).exp();
    let step = |state: &mut f64, z: &f64| {
        *state = pole * *state + (1.0 - pole) * z;
        Some(*state)
    };
    signal.iter().scan(0.0, step).collect()
}

/// Transposes rows to columns.
pub(super) fn transpose<const N: usize>(rows: &[[f64; N]]) -> Vec<Vec<f64>> {
    (0..N).map(|j| rows.iter().map(|row| row[j]).collect()).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::{
        Channel,
        scenario::{Condition, Scenario},
    };
    use hoid_sim::{RunSeed, Simulator};

    use super::*;
    use crate::{Method, TrackOptions, track};

    fn simulated_record(replication: u64) -> Record {
        let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
        let seed = RunSeed {
            seed: 4400,
            replication,
            ..RunSeed::default()
        };
        simulator.run(seed, false).unwrap()
    }

    /// Returns the record with an additional response to the error in u: `share` times K_e, `later` samples after the
    /// error.
    fn with_echo(record: &Record, share: f64, later: usize) -> Record {
        let e = record.input();
        let echo = |k: usize| k.checked_sub(later).map_or(0.0, |k| share * 0.09 * e[k]);
        let u = (0..e.len()).map(|k| record.output()[k] + echo(k)).collect();
        let channel = |name: &str, values| Channel::new(name, "deg", values);
        Record::new(record.sample_time(), channel("e", e.to_vec()), channel("u", u)).unwrap()
    }

    fn residual_response_of(record: &Record) -> ResidualResponse {
        let options = TrackOptions::default_for(Method::adaptive(), 29);
        track(record, &options, 50).unwrap().residual_response(record).unwrap()
    }

    #[test]
    fn missed_response_is_found_without_false_alarms() {
        // Of 30 people of the right form, 1.5 are expected to have a p-value below .05 by chance, with a standard
        // deviation of 1.2.
        let clean: Vec<f64> = (0..30)
            .map(|i| residual_response_of(&simulated_record(i)).p_value)
            .collect();
        assert!(clean.iter().filter(|p| **p < 0.05).count() <= 6, "{clean:?}");
        assert!(clean.iter().all(|p| *p > P_VALUE_LIMIT), "{clean:?}");
        // An additional third of the gain .85 s after the error: far beyond the delay and its corrections.
        let echoes: Vec<ResidualResponse> = (0..6)
            .map(|i| residual_response_of(&with_echo(&simulated_record(i), 0.33, 85)))
            .collect();
        let seen = echoes.iter().filter(|f| f.p_value < P_VALUE_LIMIT);
        assert!(seen.count() >= 5, "{echoes:?}");
    }

    #[test]
    fn short_records_and_other_methods_give_no_result() {
        let record = simulated_record(0).span(0.0, 25.0).unwrap();
        let trace = track(&record, &TrackOptions::default_for(Method::adaptive(), 29), 50).unwrap();
        assert_eq!(trace.residual_response(&record), None);
        // A method without a basis is not tested.
        let record = simulated_record(0);
        let trace = track(&record, &TrackOptions::default_for(Method::rls(), 29), 50).unwrap();
        assert_eq!(trace.missed_structure_finding(&record), None);
    }
}
