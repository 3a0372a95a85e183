//! What a recursion over a record found, in its three forms: the trace as a table, a page for people, JSON.

use std::collections::BTreeMap;

use hoid_ident::{Choice, Fit};
use hoid_io::{ColumnValues, OutputColumn, OutputTable};
use hoid_model::{
    NotConvertible, Record,
    remnant::RemnantDiscretisation,
    uncertainty::{Estimate, OperatorEstimate},
};
use hoid_report::numbers;
use hoid_track::{Trace, value_of};
use serde_json::{Map, Value, json};

use crate::{
    commands::reading::Account,
    error::CliError,
    json::{self, Identified, number},
    text,
};

/// Rows of the trace that are printed.
const ROWS_SHOWN: usize = 8;
/// Coefficients that are printed where there is no operator.
const COEFFICIENTS_SHOWN: usize = 6;

/// Everything that was found.
pub struct Tracked<'a> {
    pub file: String,
    pub record: &'a Record,
    pub account: &'a Account,
    /// The span of the start fit, where there was one.
    pub span: Option<Record>,
    pub trace: &'a Trace,
    /// The operator in each row.
    pub operators: Vec<Result<OperatorEstimate, NotConvertible>>,
    pub choice: Option<&'a Choice>,
    /// The file of the trace.
    pub out: String,
    pub settings: &'a [(String, String)],
}

/// Rows without an operator and their most frequent reason.
struct NotConverted {
    rows: usize,
    reason: Option<String>,
}

impl Tracked<'_> {
    /// The columns of the trace.
    pub fn table(&self) -> OutputTable {
        let trace = self.trace;
        let mut columns = Vec::new();
        let mut add = |name: String, values: ColumnValues| columns.push(OutputColumn { name, values });
        for (name, values) in trace.estimate_columns(&self.operators) {
            add(name, ColumnValues::Real(values));
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
        add(
            "steps_shortened".to_owned(),
            ColumnValues::Whole(trace.steps_shortened().to_vec()),
        );
        let mut comments = vec![
            format!("hoid {} track {}", env!("CARGO_PKG_VERSION"), self.file),
            "units: t s, K_e deg/deg, T_L s, K_e_dot s, omega_nm rad/s; _se are standard errors".to_owned(),
        ];
        comments.extend(self.settings.iter().map(|(k, v)| format!("{k}: {v}")));
        comments.extend(
            self.account
                .quality_issues
                .iter()
                .map(|one| format!("sampling trouble: {one}")),
        );
        comments.extend(self.account.steps.iter().map(|step| format!("preparation: {step}")));
        if let Some(fit) = trace.start() {
            comments.push(format!("start fit: {}", coefficients_text(fit)));
        }
        OutputTable { comments, columns }
    }

    /// True where the coefficients stand for an operator at all.
    fn has_operator(&self) -> bool {
        self.operators.iter().any(|o| {
            !matches!(
                o,
                Err(NotConvertible::OtherOrders { .. } | NotConvertible::PolesInBoth { .. })
            )
        })
    }

    fn first_moved_row(&self) -> usize {
        // Half a sample, so that rounding of the times does not decide.
        let from = self.trace.updated_from_s() - self.record.sample_time().s() / 2.0;
        let first = self.trace.times_s().partition_point(|t| *t < from);
        first.min(self.trace.len().saturating_sub(1))
    }

    fn not_converted(&self) -> NotConverted {
        let mut kinds: BTreeMap<&'static str, (usize, String)> = BTreeMap::new();
        for reason in self.operators.iter().filter_map(|o| o.as_ref().err()) {
            let (kind, example) = match reason {
                NotConvertible::NegativeRealPole { .. } => (
                    "pole",
                    "a pole lies on the closed negative real axis, so that no real continuous system has it".to_owned(),
                ),
                NotConvertible::NoNaturalFrequency { .. } => (
                    "frequency",
                    "the continuous denominator has no positive omega_nm^2".to_owned(),
                ),
                other => ("other", other.to_string()),
            };
            kinds.entry(kind).or_insert((0, example)).0 += 1;
        }
        NotConverted {
            rows: kinds.values().map(|(n, _)| n).sum(),
            reason: kinds.into_values().max_by_key(|(n, _)| *n).map(|(_, text)| text),
        }
    }

    fn relative_errors(&self) -> Vec<(&'static str, f64)> {
        relative_errors(
            self.record,
            self.trace,
            &self.operators,
            self.first_moved_row(),
            &self.trace.operator_columns(),
        )
    }

    /// A summary for people.
    ///
    /// # Errors
    /// Those of the quality of the start fit.
    pub fn page(&self) -> Result<String, CliError> {
        let mut page = text::records(
            std::slice::from_ref(&self.file),
            std::slice::from_ref(self.record),
            std::slice::from_ref(self.account),
        );
        if let Some(choice) = self.choice {
            page.push('\n');
            page.push_str(&text::candidates(choice));
        }
        if let (Some(fit), Some(span)) = (self.trace.start(), &self.span) {
            let q = fit.quality(std::slice::from_ref(span))?;
            page.push_str(&format!(
                "\nStart: batch fit of {:.2} to {:.2} s, {}; VAF simulation {:.2} %, prediction {:.2} %.\n",
                span.time_s(0),
                span.time_s(span.len()),
                fit.title(),
                q.vaf_simulation,
                q.vaf_prediction
            ));
        }
        page.push_str(&self.rows_shown());
        let errors = self.relative_errors();
        if !errors.is_empty() {
            let each: Vec<String> = errors
                .iter()
                .map(|(name, e)| format!("{name} {:.1} %", 100.0 * e))
                .collect();
            page.push_str(&format!(
                "RMS relative error against the truth in the record, from {:.2} s on: {}.\n",
                self.trace.times_s()[self.first_moved_row()],
                each.join(", ")
            ));
        }
        page.push_str(&self.changes());
        page.push_str(&self.counts());
        page.push_str(&text::settings(self.settings));
        page.push_str(&format!("Trace: {}\n", self.out));
        Ok(page)
    }

    /// The estimate at a handful of times.
    fn rows_shown(&self) -> String {
        let trace = self.trace;
        if trace.is_empty() {
            return String::new();
        }
        let (first, last) = (self.first_moved_row(), trace.len() - 1);
        let shown = ROWS_SHOWN.min(last - first + 1);
        let mut picked: Vec<usize> = (0..shown)
            .map(|i| first + (last - first) * i / (shown - 1).max(1))
            .collect();
        picked.dedup();
        let with_operator = self.has_operator();
        let units = ["deg/deg", "s", "s", "rad/s", "", "s"];
        let mut header = vec!["t in s".to_owned()];
        if with_operator {
            let named = self.trace.operator_columns().into_iter().zip(units);
            header.extend(named.map(|(n, u)| {
                if u.is_empty() {
                    n.to_owned()
                } else {
                    format!("{n} ({u})")
                }
            }));
        } else {
            header.extend(trace.parameter_names().into_iter().take(COEFFICIENTS_SHOWN));
        }
        let mut rows = text::table(&header.iter().map(String::as_str).collect::<Vec<_>>());
        for row in picked {
            let mut cells = vec![format!("{:.2}", trace.times_s()[row])];
            if with_operator {
                let of = |name| value_of(&self.operators[row], name);
                cells.extend(self.trace.operator_columns().into_iter().map(|n| plus_minus(of(n))));
            } else {
                let all = trace.parameters(row);
                cells.extend(all.into_iter().take(COEFFICIENTS_SHOWN).map(|e| plus_minus(Some(e))));
            }
            rows.add_row(cells);
        }
        format!(
            "\nEstimate by {} with one standard error; the trace has all {} rows.\n{rows}\n",
            trace.options().method.name(),
            trace.len()
        )
    }

    /// The changes that were declared.
    fn changes(&self) -> String {
        let trace = self.trace;
        if trace.change_odds().is_empty() {
            return String::new();
        }
        if trace.changes().is_empty() {
            return "No change was declared.\n".to_owned();
        }
        let mut lines = String::new();
        for (t, c) in trace.changes() {
            let changed = c.changed();
            lines.push_str(&format!(
                "Change declared at {t:.2} s, of {:.2} s before: {}; log odds {:.1}.\n",
                c.seconds_ago,
                if changed.is_empty() {
                    "no single quantity by two standard errors".to_owned()
                } else {
                    changed.join(", ")
                },
                c.odds
            ));
        }
        lines
    }

    fn counts(&self) -> String {
        let c = self.trace.counts();
        let mut text = format!(
            "{} samples; {} skipped for a fault in e or u; {} made shorter to stay stable or within bounds.\n",
            c.samples,
            c.skipped,
            text::steps(usize::try_from(c.shortened).unwrap_or(usize::MAX))
        );
        if self.has_operator() {
            let none = self.not_converted();
            text.push_str(&format!("{} of {} rows have no operator", none.rows, self.trace.len()));
            text.push_str(&match none.reason {
                Some(reason) => format!("; most often {reason}.\n"),
                None => ".\n".to_owned(),
            });
        }
        text
    }

    /// The object of the contract.
    ///
    /// # Errors
    /// Those of the quality of the start fit.
    pub fn to_json(&self) -> Result<Value, CliError> {
        let trace = self.trace;
        let counts = trace.counts();
        let mut map = Map::new();
        let mut set = |key: &str, value: Value| map.insert(key.to_owned(), value);
        set("hoid", json!(env!("CARGO_PKG_VERSION")));
        set(
            "records",
            json::records(
                std::slice::from_ref(&self.file),
                std::slice::from_ref(self.record),
                std::slice::from_ref(self.account),
            ),
        );
        set(
            "warnings",
            json::warnings(std::slice::from_ref(&self.file), std::slice::from_ref(self.account)),
        );
        set("method", json!(trace.options().method.name()));
        set("structure", json!(trace.options().structure.name()));
        set("orders", json::orders(&trace.options().orders));
        let start = match (trace.start(), &self.span) {
            (Some(fit), Some(span)) => self.start_json(fit, span)?,
            _ => Value::Null,
        };
        set("start", start);
        set("updated_from", number(trace.updated_from_s()));
        set("last", self.last_json());
        set("samples", json!(counts.samples));
        set("skipped", json!(counts.skipped));
        set("steps_shortened", json!(counts.shortened));
        if !trace.change_odds().is_empty() {
            let each = trace.changes().iter().map(|(t, c)| json::change(Some(*t), c));
            set("changes", Value::Array(each.collect()));
        }
        set("rows", json!(trace.len()));
        let none = self.not_converted();
        set("rows_not_convertible", json!(none.rows));
        set("not_convertible_reason", json!(none.reason));
        let errors: Map<String, Value> = self
            .relative_errors()
            .into_iter()
            .map(|(name, e)| (name.to_owned(), number(e)))
            .collect();
        set("rms_relative_error", Value::Object(errors));
        set("trace", json!(self.out));
        let settings: Map<String, Value> = self.settings.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
        set("settings", Value::Object(settings));
        Ok(Value::Object(map))
    }

    /// The start fit as `identify` gives it.
    fn start_json(&self, fit: &Fit, span: &Record) -> Result<Value, CliError> {
        let records = std::slice::from_ref(span);
        let validation = fit.validate(span)?;
        let operator = fit.operator();
        let remnant = (fit.orders().nd > 0).then(|| fit.remnant(RemnantDiscretisation::ZeroOrderHold));
        Ok(Identified {
            files: std::slice::from_ref(&self.file),
            records,
            accounts: std::slice::from_ref(self.account),
            fit,
            choice: self.choice,
            grey_box: None,
            quality: validation.quality,
            operator: &operator,
            remnant: remnant.as_ref(),
            margins: None,
            validations: std::slice::from_ref(&validation),
            ahead: None,
            validation: None,
            settings: &[(
                "span in s".to_owned(),
                format!("{} to {}", span.time_s(0), span.time_s(span.len())),
            )],
        }
        .to_json())
    }

    fn last_json(&self) -> Value {
        let trace = self.trace;
        let Some(row) = trace.len().checked_sub(1) else {
            return Value::Null;
        };
        let names = trace.parameter_names();
        let parameters: Map<String, Value> = names
            .into_iter()
            .zip(trace.parameters(row))
            .map(|(name, e)| (name, json::estimate(&e)))
            .collect();
        json!({
            "t": number(trace.times_s()[row]),
            "parameters": parameters,
            "operator": json::operator(&self.operators[row]),
            "innovation": number(trace.innovation()[row]),
            "innovation_variance": number(trace.innovation_variance()[row]),
        })
    }
}

/// Root of the mean square of the relative error, of the rows from `first` on that converted, for each parameter whose truth the record
/// holds.
pub fn relative_errors(
    record: &Record,
    trace: &Trace,
    operators: &[Result<OperatorEstimate, NotConvertible>],
    first: usize,
    columns: &[&'static str],
) -> Vec<(&'static str, f64)> {
    let (begin, ts) = (record.time_s(0), record.sample_time().s());
    let of = |name: &'static str| {
        let truth = record.channel(name)?;
        let squares: Vec<f64> = (first..trace.len())
            .filter_map(|row| {
                let found = value_of(&operators[row], name)?.value;
                let k = ((trace.times_s()[row] - begin) / ts).round() as usize;
                let truth = truth.get(k).copied().filter(|v| *v != 0.0)?;
                Some((found / truth - 1.0).powi(2))
            })
            .collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        (!squares.is_empty()).then(|| (name, mean.sqrt()))
    };
    columns.iter().copied().filter_map(of).collect()
}

fn plus_minus(e: Option<Estimate>) -> String {
    match e {
        None => numbers::DASH.to_owned(),
        Some(e) => match text::with_uncertainty(&e) {
            (value, error) if error == numbers::DASH => value,
            (value, error) => format!("{value} ± {error}"),
        },
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
