//! Result of a recursion over a record, and its trace as a table.

use std::collections::BTreeMap;

use hoid_ident::{Choice, Fit};
use hoid_io::{ColumnValues, OutputColumn, OutputTable};
use hoid_model::{NotConvertible, Record, Verdict, uncertainty::OperatorEstimate};
use hoid_track::{CovarianceChoice, NoCrossover, Trace};

use super::errors::relative_errors;
use crate::{
    recordings::{Account, Recordings},
    settings::Setting,
};

/// Use of a second run for the covariance, with the label of that run.
#[derive(Debug, Clone)]
pub enum CovarianceSource {
    /// The second run determined the initial covariance.
    Chosen(String, CovarianceChoice),
    /// The second run controlled the covariance during the run.
    Updated(String),
}

/// Result of a recursion over a record.
#[derive(Debug, Clone)]
pub struct TrackingResult {
    /// Estimates over the record.
    pub trace: Trace,
    /// Final verdict on the trace.
    pub verdict: Verdict,
    /// The tracked recording and its processing.
    pub data: Recordings,
    /// Record over the span of the start fit, if there was a start fit.
    pub span: Option<Record>,
    /// The operator in each row.
    pub operators: Vec<Result<OperatorEstimate, NotConvertible>>,
    /// Result of the search for the orders, if there was one.
    pub choice: Option<Choice>,
    /// Covariance obtained from a second run, if there was one.
    pub covariance: Option<CovarianceSource>,
    /// Settings used in the recursion.
    pub settings: Vec<Setting>,
}

/// Number of rows without an operator, and the most frequent reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnconvertedRows {
    /// Number of rows without an operator.
    pub rows: usize,
    /// Most frequent reason; `None` if all rows have an operator.
    pub reason: Option<String>,
}

impl TrackingResult {
    /// Returns the tracked record.
    pub fn record(&self) -> &Record {
        &self.data.records[0]
    }

    /// Returns the processing of the record.
    pub fn account(&self) -> &Account {
        &self.data.accounts[0]
    }

    /// Returns the name of the recording.
    pub fn name(&self) -> &str {
        &self.data.names[0]
    }

    /// Returns the initial covariance determined by a second run, and the label of that run.
    pub fn chosen_covariance(&self) -> Option<(&str, &CovarianceChoice)> {
        match &self.covariance {
            Some(CovarianceSource::Chosen(file, choice)) => Some((file, choice)),
            _ => None,
        }
    }

    /// Returns the columns of the trace.
    pub fn table(&self) -> OutputTable {
        let trace = &self.trace;
        let mut columns = Vec::new();
        let mut add = |name: String, values: ColumnValues| columns.push(OutputColumn { name, values });
        for (name, values) in trace.estimate_columns(&self.operators) {
            add(name, ColumnValues::Real(values));
        }
        for (name, values) in trace.determined_columns(&self.operators) {
            add(name, ColumnValues::Whole(values));
        }
        let convertible = self.operators.iter().map(|o| u64::from(o.is_ok())).collect();
        add("convertible".to_owned(), ColumnValues::Whole(convertible));
        add("innovation".to_owned(), ColumnValues::Real(trace.innovation().to_vec()));
        if !trace.change_odds().is_empty() {
            add(
                "change_log_odds".to_owned(),
                ColumnValues::Real(trace.change_odds().to_vec()),
            );
        }
        if trace.is_guarded() {
            add("held".to_owned(), ColumnValues::Whole(trace.held_counts().to_vec()));
        }
        add(
            "steps_shortened".to_owned(),
            ColumnValues::Whole(trace.steps_shortened().to_vec()),
        );
        let mut comments = vec![
            format!("hoid {} track {}", env!("CARGO_PKG_VERSION"), self.name()),
            "units: t s, T_L s, omega_nm rad/s; gains are in u/e; gain_db@W dB and phase_deg@W deg at W rad/s; _se are standard errors"
                .to_owned(),
        ];
        comments.extend(self.settings.iter().map(|one| format!("{}: {}", one.name, one.value)));
        comments.extend(
            self.account()
                .quality_issues
                .iter()
                .map(|one| format!("sampling problems: {one}")),
        );
        comments.extend(self.account().steps.iter().map(|step| format!("preparation: {step}")));
        comments.extend(trace.faults().iter().map(|fault| {
            format!(
                "fault: {} in {}, {} to {} s, {}",
                fault.kind, fault.channel, fault.from_s, fault.to_s, fault.action
            )
        }));
        if let Some(fit) = trace.start() {
            comments.push(format!("start fit: {}", coefficients_text(fit)));
        }
        OutputTable { comments, columns }
    }

    /// True if the structure of the tracked model can represent an operator.
    pub fn has_operator(&self) -> bool {
        self.operators.iter().any(|o| {
            !matches!(
                o,
                Err(NotConvertible::OtherOrders { .. } | NotConvertible::PolesInBoth { .. })
            )
        })
    }

    /// Returns the first row in which the estimate has been updated.
    pub fn first_updated_row(&self) -> usize {
        // Half a sample of tolerance removes the effect of rounding in the times.
        let from = self.trace.updated_from_s() - self.record().sample_time().s() / 2.0;
        let first = self.trace.times_s().partition_point(|t| *t < from);
        let first = first
            + (first..self.trace.len())
                .take_while(|row| self.trace.is_before_first_estimate(*row))
                .count();
        first.min(self.trace.len().saturating_sub(1))
    }

    /// Returns the number of rows without an operator, and the most frequent reason.
    pub fn unconverted_rows(&self) -> UnconvertedRows {
        let mut kinds: BTreeMap<&'static str, (usize, String)> = BTreeMap::new();
        let rows = self.operators.iter().enumerate();
        for (row, reason) in rows.filter_map(|(row, o)| Some((row, o.as_ref().err()?))) {
            let (kind, example) = match reason {
                _ if self.trace.is_before_first_estimate(row) => ("none yet", "there is no estimate yet".to_owned()),
                NotConvertible::NegativeRealPole { .. } => (
                    "pole",
                    "a pole lies on the closed negative real axis, so no real continuous-time system corresponds to \
                     the model"
                        .to_owned(),
                ),
                NotConvertible::NoNaturalFrequency { .. } => (
                    "frequency",
                    "the continuous-time denominator gives no positive omega_nm^2".to_owned(),
                ),
                other => ("other", other.to_string()),
            };
            kinds.entry(kind).or_insert((0, example)).0 += 1;
        }
        UnconvertedRows {
            rows: kinds.values().map(|(n, _)| n).sum(),
            reason: kinds.into_values().max_by_key(|(n, _)| *n).map(|(_, text)| text),
        }
    }

    /// Returns the number of rows without a crossover and the most frequent reason; `None` if the controlled element is
    /// unknown.
    pub fn rows_without_crossover(&self) -> Option<(usize, Option<NoCrossover>)> {
        self.trace.options().controlled_element.as_ref()?;
        let mut kinds: BTreeMap<NoCrossover, usize> = BTreeMap::new();
        for reason in (0..self.trace.len()).filter_map(|row| self.trace.open_loop(row)?.err()) {
            *kinds.entry(reason).or_default() += 1;
        }
        let most = kinds.iter().max_by_key(|(_, rows)| **rows).map(|(reason, _)| *reason);
        Some((kinds.values().sum(), most))
    }

    /// Returns the errors relative to the true values in the record; see [`relative_errors`].
    pub fn relative_errors(&self) -> Vec<(&'static str, f64)> {
        relative_errors(
            self.record(),
            &self.trace,
            &self.operators,
            self.first_updated_row(),
            &self.trace.operator_columns(),
        )
    }
}

fn coefficients_text(fit: &Fit) -> String {
    let each: Vec<String> = fit
        .parameters()
        .iter()
        .map(|(name, e)| format!("{name}={}", e.value))
        .collect();
    each.join(", ")
}
