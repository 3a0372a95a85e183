//! Verdict on a trace, and the reliability of the estimate of one sample.
//!
//! A trace depends on its start and on its rows. Findings of [`hoid_ident::diagnostics`] about the start fit are
//! included, at most as warnings, because the recursion may move away from the start. A change inside the start span is
//! a note for methods that forget and a warning for the others. Of the rows in which the estimate is updated, at most
//! [`MAX_ROWS`] are examined, evenly spaced:
//!
//! | kind | observation |
//! |---|---|
//! | `start-explains-little` | the simulated start fit has a VAF below 20 % on its span |
//! | `not-convertible` | more than 5 % of the rows do not correspond to any operator |
//! | `gain` | K_e and K_e_dot are both undetermined (within two standard errors of zero) in most rows |
//! | `undetermined-parameter` | K_e alone is undetermined in most rows; if K_e_dot alone is, the person responds like a gain (a note) |
//! | `neuromuscular-lag` | the poles are implausible for a person, or omega_nm is at its bound, in a quarter of the rows |
//! | `delay-at-bound` | the tracked delay is at an end of its range in a quarter of the rows |
//! | `covariance-blown-up` | a standard error rises to 30 times its median: the data carry too little information for the rate of forgetting |
//! | `steps-shortened` | stability or a bound shortened more than 5 % of the steps |
//! | `faults` | more than 10 % of the samples were faulty |
//! | `held-back` | the guard held back outliers (a note), or more than 1 % of the samples (a warning) |
//! | `hostile-span` | the estimate was kept constant in spans that cannot come from tracking |
//! | `learnt-at-rest` | e and u stay constant for a second while the estimate is updated, because the guard was turned off |
//! | `restarted` | the guard restarted the estimate |
//! | `steps-in-signals` | lasting jumps of e or u (a note) |
//! | `gain-sign` | K_e is significantly positive in some rows and negative in others |
//! | `negative-lead` | K_e and K_e_dot have significantly opposite signs in more than a tenth of the rows |
//! | `idle-head` | neither e nor u moves at the start of the record, which is excluded from the start span (a note) or part of it (a warning) |
//! | `many-changes` | three or more declared changes, on average at least one per half minute |
//! | `supposed` | the record does not determine omega_nm, zeta_nm or tau_e of the last row: its value comes from the prior, or is one of several that predict u equally well (a note) |
//! | `last-row` | neither K_e nor K_e_dot is determined in the last row, regardless of the other rows |
//! | `not-followed` | the last 16 or 30 s of the record disagree with the last row |
//! | `structure` | past errors explain more of u than the operator of the last row does |
//! | `held-lag` | the phase of a lag fitted to the last minute differs at low frequencies from that of the last row |
//! | `sign` | without a given controlled element: the response at 0.5 rad/s would increase the error |
//! | `unstable-loop`, `no-crossover` | with the controlled element, a person could not have kept the loop of the last row stable |
//! | `undeclared-change`, `drifting`, `swaying` | the response varies between declared changes |
//! | `changed-input` | for a model with two inputs, the input whose response changed (a note) |
//! | `no-answer` | e does not respond to u beyond chance |
//! | `no-estimate` | no row has an estimate yet |
//! | `not-finite` | an estimate is not a finite number |
//!
//! `operators` examines the operators of the rows, `recording` the actions of the guard and the start and end of the
//! record, `structure` the form of the operator, `steadiness` its constancy, `closed_loop` the response of e to u,
//! `lag` the lag that is kept constant, and `moment` a single sample. If the
//! response is known at the end, an undetermined gain or lead, or a negative lead, gives only a note: gain and lead are
//! only one description of the response, which may have another form. `inputs` examines the responses to two inputs.

mod closed_loop;
mod inputs;
mod lag;
mod moment;
mod operators;
mod recording;
mod steadiness;
mod structure;
#[cfg(test)]
mod tests;

use hoid_ident::{Choice, IdentError};
use hoid_model::{Finding, Record, Severity, Verdict, uncertainty::Estimate};
use hoid_numerics::statistics::upper_median;

pub(crate) use self::lag::COMPARED_RAD_S;
use self::operators::{Operator, operator_findings};
use crate::trace::Trace;

/// Largest number of rows that are examined.
const MAX_ROWS: usize = 400;
/// VAF in % below which the simulated start fit explains little.
const MIN_START_VAF: f64 = 20.0;
/// Share of shortened steps, and share of faulty samples, beyond which a finding is reported.
const MAX_SHORTENED_SHARE: f64 = 0.05;
const MAX_FAULT_SHARE: f64 = 0.1;
/// Ratio of a standard error to its median beyond which the covariance has blown up.
const EXCESSIVE_ERROR_RATIO: f64 = 30.0;

impl Trace {
    /// Returns the verdict on the trace, for the record from which it was made and the search that chose its orders,
    /// if there was one.
    ///
    /// # Errors
    /// The errors of the residuals of the start fit.
    pub fn verdict(&self, record: &Record, choice: Option<&Choice>) -> Result<Verdict, IdentError> {
        let mut all = self.start_findings(record, choice)?;
        let rows = self.judged_rows();
        if rows.iter().any(|row| self.theta(*row).iter().any(|v| !v.is_finite())) {
            all.push(Finding::undetermined(
                "not-finite",
                "the estimate is not a number in some rows",
            ));
            return Ok(Verdict::of(all));
        }
        if rows.iter().all(|row| self.is_before_first_estimate(*row)) {
            all.push(Finding::undetermined(
                "no-estimate",
                self.missing_estimate_message(record),
            ));
            return Ok(Verdict::of(all));
        }
        let operators: Vec<Operator> = rows.iter().map(|row| self.operator(*row)).collect();
        all.extend(operator_findings(self, &operators));
        all.extend(self.covariance_finding(&rows));
        all.extend(self.count_findings());
        all.extend(self.guard_findings());
        all.extend(self.update_at_rest_finding(record));
        all.extend(self.idle_finding(record));
        all.extend(self.prior_value_finding());
        let record = &*self.with_bridged_samples(record)?;
        all.extend(self.outdated_last_row_finding(record));
        all.extend(self.changed_input_finding(&rows));
        if !all.iter().any(|finding| finding.kind == "gain") {
            all.extend(self.last_row_finding());
        }
        all.extend(self.many_changes_finding());
        all.extend(self.missed_structure_finding(record));
        all.extend(self.held_lag_finding(record));
        all.extend(self.response_finding.clone());
        all.extend(self.response_change_finding(record));
        all.extend(self.loop_response_finding(record));
        Ok(Verdict::of(all))
    }

    /// Returns the findings about the start fit, none of them more severe than a warning.
    fn start_findings(&self, record: &Record, choice: Option<&Choice>) -> Result<Vec<Finding>, IdentError> {
        let (Some(fit), Some((from, to))) = (self.start(), self.options().start_span(record)) else {
            return Ok(Vec::new());
        };
        let span = [record.span(from, to)?];
        let of_start = |finding: &Finding| Finding {
            severity: match finding.kind {
                // A method that forgets follows a change within the start span. A method that weights the start against
                // all later samples starts from a mean of the operators before and after this change.
                "not-constant" if !self.options().method.models_change() => Severity::Note,
                _ => finding.severity.min(Severity::Doubt),
            },
            message: format!("start fit: {}", finding.message),
            ..finding.clone()
        };
        let mut all: Vec<Finding> = fit.verdict(&span, choice)?.findings().iter().map(of_start).collect();
        if fit.model().structure().has_input() {
            let vaf = fit.quality(&span)?.vaf_simulation;
            if vaf < MIN_START_VAF {
                all.push(Finding::warning(
                    "start-explains-little",
                    format!(
                        "the start fit explains {vaf:.0} % of u (VAF of the simulation, expected {MIN_START_VAF:.0} \
                         % or more); use a longer span, or another span"
                    ),
                ));
            }
        }
        Ok(all)
    }

    /// Returns the finding that the record does not determine omega_nm, zeta_nm or tau_e of the last row.
    fn prior_value_finding(&self) -> Option<Finding> {
        let row = self.len().checked_sub(1)?;
        let operator = self
            .operator(row)
            .ok()
            .filter(|_| self.options().method.is_self_starting())?;
        let open: Vec<&str> = (self.determinations(&operator).into_iter())
            .filter(|(name, yes)| !yes && ["omega_nm", "zeta_nm", "tau_e"].contains(name))
            .map(|(name, _)| name)
            .collect();
        (!open.is_empty()).then(|| {
            Finding::note(
                "supposed",
                format!(
                    "{} at the end: not determined by the record; the value comes from the prior, or is one of several \
                     that predict u equally well",
                    open.join(", ")
                ),
            )
        })
    }

    /// Returns the rows that are examined: rows in which the estimate is updated, evenly spaced, including the last
    /// row. For a method that needs no start fit, rows before its first estimate are excluded.
    fn judged_rows(&self) -> Vec<usize> {
        let from = self.updated_from_s() - self.sample_time().s() / 2.0;
        let mut first = self.times_s().partition_point(|t| *t < from);
        while self.options().method.is_self_starting() && first + 1 < self.len() && self.covariance(first).is_none() {
            first += 1;
        }
        let count = self.len().saturating_sub(first);
        let step = count.div_ceil(MAX_ROWS).max(1);
        let mut rows: Vec<usize> = (first..self.len()).rev().step_by(step).collect();
        rows.reverse();
        rows
    }

    /// Finding about a coefficient whose standard error grew far above its median.
    fn covariance_finding(&self, rows: &[usize]) -> Option<Finding> {
        // Only the second half of the rows is examined: after a start without knowledge, standard errors are large at
        // first.
        let rows = &rows[rows.len() / 2..];
        let names = self.parameter_names();
        let estimates: Vec<Vec<Estimate>> = rows.iter().map(|row| self.parameters(*row)).collect();
        let grown = |i: usize| {
            let mut errors: Vec<f64> = estimates.iter().filter_map(|e| e[i].standard_error).collect();
            let median = upper_median(&mut errors)?;
            let largest = errors.into_iter().max_by(f64::total_cmp)?;
            (median > 0.0 && largest > EXCESSIVE_ERROR_RATIO * median).then_some(largest / median)
        };
        let (name, ratio) = names
            .iter()
            .enumerate()
            .filter_map(|(i, name)| Some((name, grown(i)?)))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let remedy = match self.options().method.memories() {
            Some(_) => " for the memory in use; use a longer memory",
            None => "",
        };
        Some(Finding::warning(
            "covariance-blown-up",
            format!(
                "the standard error of {name} grows to {ratio:.0} times its median: for a while the data carry too little information{remedy}"
            ),
        ))
    }

    /// Returns the reason why there is no estimate in the whole record, with its remedy.
    fn missing_estimate_message(&self, record: &Record) -> String {
        let duration_s = record.time_s(record.len()) - record.time_s(0);
        let start = format!("there is no estimate in the {duration_s:.2} s of the record");
        let is_constant = |values: &[f64]| values.iter().all(|v| *v == values[0]);
        let (skipped, samples) = (self.counts().skipped, self.counts().samples);
        if let Some(constant) = record.channels().take(2).find(|channel| is_constant(&channel.values)) {
            format!("{start}: {} is constant; check --input and --output", constant.name)
        } else if 2 * skipped > samples {
            format!(
                "{start}: {skipped} of {samples} samples were skipped for a fault in e or u; inspect the recording, \
                 or raise --largest if its values are correct"
            )
        } else {
            format!("{start} (the first one comes after about 1 s); give a longer record")
        }
    }

    fn count_findings(&self) -> Vec<Finding> {
        let counts = self.counts();
        let mut all = Vec::new();
        let samples = counts.samples.max(1) as f64;
        if counts.skipped as f64 > MAX_FAULT_SHARE * samples {
            let share = 100.0 * counts.skipped as f64 / samples;
            all.push(Finding::warning(
                "faults",
                format!("{share:.0} % of the samples are faulty in e or u; the estimate is kept constant there"),
            ));
        }
        let last = self.times_s().last().copied().unwrap_or(f64::NAN);
        let before = (last - self.updated_from_s()) / self.sample_time().s();
        let moved = if before.is_finite() {
            before.max(1.0).min(samples)
        } else {
            samples
        };
        if counts.shortened as f64 > MAX_SHORTENED_SHARE * moved {
            all.push(Finding::warning(
                "steps-shortened",
                format!(
                    "{:.0} % of the steps were shortened to stay stable or within bounds: the estimate differs from \
                     the value that the data would give",
                    100.0 * counts.shortened as f64 / moved
                ),
            ));
        }
        all
    }
}
