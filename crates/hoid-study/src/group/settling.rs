//! Settling times and noise of the recursions after a change at a known time, by subject, condition and parameter.
//!
//! For a recorded person the true values are not known, so the levels before and after the change are taken from the
//! recursion itself. Each level is a median over time of the median over the runs: over the second half of the rows
//! before the change, and over the second half of the rows after it. The settling times are the times at which the
//! median over the runs first covers 50 and 90 % of the step, as in the studies. The noise of a run is its deviation
//! around its own level after the change, `1.4826` times the median absolute deviation; the table gives the median over
//! the runs. There is no settling time if the step is smaller than the noise, or if the estimate had already covered
//! this share of the step when the task changed, since it then changed for another reason.

use std::collections::BTreeMap;

use hoid_io::{OutputTable, TableSchema};

use super::{
    averages::TraceAverages,
    tables::{numbers, real_columns, schema, text_columns, texts},
};
use crate::{columns::Rows, statistics::median};

/// Ratio of the standard deviation to the median absolute deviation for a normal distribution.
const SD_PER_MAD: f64 = 1.4826;

const KEY_COLUMNS: [&str; 4] = ["subject", "condition", "estimator", "parameter"];
const STATISTIC_COLUMNS: [&str; 7] = [
    "runs",
    "change_s",
    "before",
    "after",
    "settle50_s",
    "settle90_s",
    "noise",
];

/// Results of single runs: times of the change, and noise of each parameter.
#[derive(Debug, Clone, Default)]
struct RunResults {
    change_s: Vec<f64>,
    noise: BTreeMap<String, Vec<f64>>,
}

/// Results of the runs with a change, by subject, condition and estimator.
#[derive(Debug, Clone, Default)]
pub(super) struct Settling(BTreeMap<[String; 3], RunResults>);

/// Returns the rows in the second half of a time interval.
fn rows_in_second_half(times: &[f64], from_s: f64, to_s: f64) -> Vec<usize> {
    let inside: Vec<usize> = (0..times.len())
        .filter(|i| times[*i] > from_s && times[*i] <= to_s)
        .collect();
    inside[inside.len() / 2..].to_vec()
}

impl Settling {
    /// Adds the traces of a run whose task changes at `change_s`.
    pub fn add(&mut self, traces: &OutputTable, names: &[String], change_s: f64) {
        let keys = ["subject", "condition", "estimator"].map(|name| texts(traces, name));
        let times = numbers(traces, "t");
        let mut estimators: Vec<&String> = keys[2].iter().collect();
        estimators.dedup();
        for estimator in estimators {
            let of_estimator: Vec<usize> = (0..times.len()).filter(|i| keys[2][*i] == *estimator).collect();
            let Some(first) = of_estimator.first() else { continue };
            let at: Vec<f64> = of_estimator.iter().map(|i| times[*i]).collect();
            let after = rows_in_second_half(&at, change_s, f64::INFINITY);
            let of_runs = self.0.entry(keys.map(|column| column[*first].clone())).or_default();
            of_runs.change_s.push(change_s);
            for name in names {
                let column = numbers(traces, name);
                let values: Vec<f64> = after.iter().map(|i| column[of_estimator[*i]]).collect();
                let level = median(&values);
                let deviations: Vec<f64> = values.iter().map(|v| (v - level).abs()).collect();
                let noise = SD_PER_MAD * median(&deviations);
                if noise.is_finite() {
                    of_runs.noise.entry(name.clone()).or_default().push(noise);
                }
            }
        }
    }

    /// Returns the columns of the table.
    pub fn schema() -> TableSchema {
        schema(text_columns(&KEY_COLUMNS).chain(real_columns(&STATISTIC_COLUMNS)))
    }

    /// Returns the table with a row for each estimator and parameter.
    pub fn table(&self, traces: &TraceAverages) -> OutputTable {
        let mut rows = Rows::new(&Self::schema());
        for (key, of_runs) in &self.0 {
            let change_s = median(&of_runs.change_s);
            for (name, noises) in &of_runs.noise {
                let (times, medians) = traces.medians(key, name);
                let noise = median(noises);
                let step = Step::of(&times, &medians, change_s);
                rows.start_row();
                for (column, value) in KEY_COLUMNS.iter().zip(key.iter().chain([name])) {
                    rows.set_text(column, value);
                }
                let settled = |share: f64| {
                    let moves = (step.after - step.before).abs() > noise;
                    moves
                        .then(|| step.settling_time_s(&times, &medians, change_s, share))
                        .flatten()
                };
                let figures = [
                    noises.len() as f64,
                    change_s,
                    step.before,
                    step.after,
                    settled(0.5).unwrap_or(f64::NAN),
                    settled(0.9).unwrap_or(f64::NAN),
                    noise,
                ];
                for (column, value) in STATISTIC_COLUMNS.iter().zip(figures) {
                    rows.set_real(column, value);
                }
            }
        }
        rows.into_table(Vec::new())
    }
}

/// Levels before and after a change.
struct Step {
    before: f64,
    after: f64,
}

impl Step {
    fn of(times: &[f64], values: &[f64], change_s: f64) -> Self {
        let level = |from_s: f64, to_s: f64| {
            let inside: Vec<f64> = rows_in_second_half(times, from_s, to_s)
                .iter()
                .map(|i| values[*i])
                .collect();
            median(&inside)
        };
        Self {
            before: level(f64::NEG_INFINITY, change_s),
            after: level(change_s, f64::INFINITY),
        }
    }

    /// Returns the time from the change until the given share of the step is covered; `None` if it was covered before
    /// the change or is never covered.
    fn settling_time_s(&self, times: &[f64], values: &[f64], change_s: f64, share: f64) -> Option<f64> {
        let covered = |v: f64| (v - self.before) / (self.after - self.before) >= share;
        let (before, after): (Vec<_>, Vec<_>) = times.iter().zip(values).partition(|(t, _)| **t <= change_s);
        if before.last().is_some_and(|(_, v)| covered(**v)) {
            return None;
        }
        let reached = after.into_iter().find(|(_, v)| covered(**v));
        reached.map(|(t, _)| t - change_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the trace of a run: a first-order step from 1 to 3 at 10 s, with a ripple of known deviation.
    fn traces(run: usize) -> OutputTable {
        let mut rows = Rows::new(&schema(
            text_columns(&["subject", "condition", "run", "estimator"]).chain(real_columns(&["t", "K_e", "flat"])),
        ));
        for k in 0..400 {
            let t = 0.1 * f64::from(k);
            let covered = if t > 10.0 { 1.0 - (-(t - 10.0) / 2.0).exp() } else { 0.0 };
            // The absolute deviations 0, 0.1, 0.1 and 0.2 occur in turn; their median is 0.1.
            let ripple = [0.0, 0.1, -0.1, 0.2][(k as usize + run) % 4];
            rows.start_row();
            for (name, value) in [("subject", "A"), ("condition", "C"), ("estimator", "RLS")] {
                rows.set_text(name, value);
            }
            rows.set_text("run", &run.to_string());
            rows.set_real("t", t);
            rows.set_real("K_e", 1.0 + 2.0 * covered + ripple);
            rows.set_real("flat", 5.0 + ripple);
        }
        rows.into_table(Vec::new())
    }

    #[test]
    fn first_order_step_has_the_expected_settling_time() {
        let names = ["K_e".to_owned(), "flat".to_owned()];
        let (mut settling, mut averages) = (Settling::default(), TraceAverages::new(names.to_vec()));
        // The runs cover all phases of the ripple, so the median over the runs is smooth.
        for run in 0..4 {
            averages.add(&traces(run));
            settling.add(&traces(run), &names, 10.0);
        }
        let table = settling.table(&averages);
        let of = |name: &str| numbers(&table, name);
        assert_eq!(texts(&table, "parameter"), ["K_e", "flat"]);
        assert!((of("before")[0] - 1.05).abs() < 1e-9 && (of("after")[0] - 3.05).abs() < 1e-3);
        // The settling times are 2 s ln 2 and 2 s ln 10, or up to one row later.
        for (name, exact) in [("settle50_s", 2.0 * 2f64.ln()), ("settle90_s", 2.0 * 10f64.ln())] {
            let found = of(name)[0];
            assert!(
                found >= exact - 1e-3 && found < exact + 0.1 + 1e-3,
                "{name}: {found}, {exact}"
            );
        }
        assert!(
            (of("noise")[1] - SD_PER_MAD * 0.1).abs() < 0.1 * SD_PER_MAD * 0.51,
            "{:?}",
            of("noise")
        );
        assert!(
            of("settle90_s")[1].is_nan(),
            "a parameter that does not change has no settling time"
        );
    }
}
