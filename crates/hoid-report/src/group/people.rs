//! The verdict on a group, the runs that could not be read, and the operator of each person in each condition with its
//! errors.
//!
//! A parameter that the data determine is given with its standard error; any other value is in parentheses. If the
//! interval has no upper limit, `> x` gives its lower end.

use hoid_ident::family::Parameter;
use hoid_model::{Form, Verdict, VerdictLevel, uncertainty::Estimate};
use hoid_study::group::{GroupSummary, Person};
use minijinja::{Value, context};

use super::report::GroupReport;
use crate::numbers;

/// Names and headings of the parameters, in the order of the table. Quantities that scale with u/e have no unit,
/// because the runs of a group have no units of e and u.
const COLUMNS: [(&str, &str); 13] = [
    ("K_over_T_I", "K/T_I"),
    ("K_I", "K_I"),
    ("K_e", "K_e"),
    ("K", "K"),
    ("T_L", "T_L (s)"),
    ("K_e_dot", "K_e_dot"),
    ("T_I", "T_I (s)"),
    ("c_1", "c_1 (s)"),
    ("c_2", "c_2 (s^2)"),
    ("alpha", "alpha (rad/s)"),
    ("tau_e", "tau_e (s)"),
    ("omega_nm", "omega_nm (rad/s)"),
    ("zeta_nm", "zeta_nm"),
];

/// The main table of a group as text: one row for each person and condition.
#[derive(Debug, Clone, PartialEq)]
pub struct PeopleTable {
    /// Headings of the columns.
    pub headings: Vec<String>,
    /// Cells of the rows.
    pub rows: Vec<Vec<String>>,
    /// Index of the first column of parameters. The columns of parameters end before the last column, which contains
    /// the verdict.
    pub parameters: usize,
}

/// Creates the table of the people with results; only parameters that at least one person has get a column.
pub fn people_table<'a>(people: impl Iterator<Item = &'a Person>) -> PeopleTable {
    let people: Vec<&Person> = people.filter(|p| p.verdict.is_some()).collect();
    let columns: Vec<(&str, &str)> = COLUMNS
        .into_iter()
        .filter(|(name, _)| people.iter().any(|p| p.parameter(name).is_some()))
        .collect();
    let in_loop = people.iter().any(|p| p.crossover_rad_s.is_some());
    let mut headings: Vec<String> = ["subject", "condition", "runs", "form"].map(str::to_owned).to_vec();
    if in_loop {
        headings.extend(["crossover (rad/s)", "phase margin (deg)"].map(str::to_owned));
    }
    let parameters = headings.len();
    headings.extend(columns.iter().map(|(_, heading)| (*heading).to_owned()));
    let further = further_columns(&people);
    headings.extend(further.iter().map(|(_, _, heading)| heading.clone()));
    headings.push("verdict".to_owned());
    let row = |p: &&Person| {
        let runs = match p.run.as_str() {
            "all" => p.runs.to_string(),
            run => format!("run {run}"),
        };
        let mut cells = vec![p.subject.clone(), p.condition.clone(), runs, p.form.clone()];
        if in_loop {
            let measures = [
                (p.crossover_rad_s, p.crossover_interval),
                (p.phase_margin_deg, p.phase_margin_interval),
            ];
            cells.extend(
                measures.map(|(e, interval)| e.map_or_else(dash, |e| format_estimate_with_interval(&e, interval))),
            );
        }
        cells.extend(
            columns
                .iter()
                .map(|(name, _)| p.parameter(name).map_or_else(dash, format_parameter)),
        );
        cells.extend(further.iter().map(|(input, name, _)| response_cell(p, input, name)));
        cells.push(p.level().map_or("", VerdictLevel::name).to_owned());
        cells
    };
    PeopleTable {
        headings,
        rows: people.iter().map(row).collect(),
        parameters,
    }
}

/// Name of the column with the form of the response to a further input.
const FORM_COLUMN: &str = "form";
/// Names and headings of the parameters that occur only in the response to a further input, not in the operator.
const FURTHER_INPUT_PARAMETERS: [(&str, &str); 2] = [("K_d", "K_d (s)"), ("tau_f", "tau_f (s)")];

/// Input, name and heading of each column of the responses to further inputs.
fn further_columns<'a>(people: &[&'a Person]) -> Vec<(&'a str, &'static str, String)> {
    let mut all: Vec<(&str, &str, String)> = Vec::new();
    for channel in people.iter().flat_map(|p| &p.channels) {
        let input = channel.name.as_str();
        if all.iter().any(|(known, ..)| *known == input) {
            continue;
        }
        all.push((input, FORM_COLUMN, format!("response to {input}")));
        let has = |name: &str| {
            let mut own = people.iter().flat_map(|p| &p.channels).filter(|c| c.name == input);
            own.any(|c| c.parameter(name).is_some())
        };
        let used = COLUMNS
            .into_iter()
            .chain(FURTHER_INPUT_PARAMETERS)
            .filter(|(name, _)| has(name));
        all.extend(used.map(|(name, heading)| (input, name, format!("{input}: {heading}"))));
    }
    all
}

/// The cell of a person in a column of the responses to further inputs.
fn response_cell(p: &Person, input: &str, name: &str) -> String {
    let Some(channel) = p.channels.iter().find(|channel| channel.name == input) else {
        return dash();
    };
    match (name, channel.form) {
        (FORM_COLUMN, form) => form.map_or("none found", Form::name).to_owned(),
        _ => channel.parameter(name).map_or_else(dash, format_parameter),
    }
}

fn dash() -> String {
    numbers::DASH.to_owned()
}

fn format_estimate(e: &Estimate) -> String {
    match e.standard_error.filter(|s| s.is_finite() && *s > 0.0) {
        None => numbers::format_significant(e.value, 3),
        Some(error) => {
            let (value, error) = numbers::with_uncertainty(e.value, Some(error));
            format!("{value} \u{b1} {error}")
        }
    }
}

/// Value and standard error, followed by the interval in brackets.
fn format_estimate_with_interval(e: &Estimate, interval: Option<(f64, f64)>) -> String {
    let ends = interval.map(|(low, high)| {
        format!(
            " [{} to {}]",
            numbers::format_significant(low, 3),
            numbers::format_significant(high, 3)
        )
    });
    format!("{}{}", format_estimate(e), ends.unwrap_or_default())
}

fn format_parameter(p: &Parameter) -> String {
    let known = Estimate {
        value: p.value,
        standard_error: p.standard_error,
    };
    match p.interval {
        _ if p.determined => format_estimate(&known),
        Some((low, high)) if high.is_infinite() && low.is_finite() => {
            format!("> {}", numbers::format_significant(low, 2))
        }
        _ if !p.value.is_finite() => dash(),
        _ => format!("({})", numbers::format_significant(p.value, 2)),
    }
}

impl GroupReport<'_> {
    /// The people shown on the page.
    fn shown_people(&self) -> impl Iterator<Item = &Person> {
        let GroupSummary { people, .. } = self.summary;
        people.iter().filter(|p| self.shows(&p.subject))
    }

    /// The verdict on the group: level, reasons, notes. The verdict is undefined on the page of a single subject, where
    /// the operators list the reasons.
    pub(super) fn verdict(&self) -> Value {
        if self.subject.is_some() {
            return Value::UNDEFINED;
        }
        let verdict = &self.summary.verdict;
        context! {
            level => verdict.level.name(),
            reasons => verdict.reasons().map(str::to_owned).collect::<Vec<_>>(),
            notes => verdict.notes().map(str::to_owned).collect::<Vec<_>>(),
        }
    }

    pub(super) fn unreadable_runs(&self) -> Vec<Value> {
        let failures = self.summary.failures.iter().filter(|f| self.shows(&f.subject));
        failures
            .map(|f| context! { subject => &f.subject, condition => &f.condition, run => &f.run, reason => &f.reason })
            .collect()
    }

    pub(super) fn people_headings(&self) -> Vec<String> {
        people_table(self.shown_people()).headings
    }

    pub(super) fn people(&self) -> Vec<Value> {
        let rows = people_table(self.shown_people()).rows;
        let people = self.shown_people().filter(|p| p.verdict.is_some());
        rows.into_iter()
            .zip(people)
            .map(|(cells, p)| {
                let verdict = p.verdict.iter();
                let reasons: Vec<String> = verdict.clone().flat_map(Verdict::reasons).map(str::to_owned).collect();
                let notes: Vec<String> = verdict.flat_map(Verdict::notes).map(str::to_owned).collect();
                context! { cells, reasons, notes, name => p.name() }
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undetermined_values_have_no_standard_error() {
        let of = |value, standard_error, interval, determined| {
            format_parameter(&Parameter {
                name: "T_I".to_owned(),
                unit: "s",
                value,
                standard_error,
                standard_error_person: standard_error,
                interval,
                prior_share: 0.0,
                determined,
                averaged_over: Vec::new(),
            })
        };
        assert_eq!(of(2.0, Some(0.128), Some((1.7, 2.4)), true), "2.00 \u{b1} 0.13");
        assert_eq!(of(20.0, Some(90.0), Some((4.13, f64::INFINITY)), false), "> 4.1");
        assert_eq!(of(f64::INFINITY, None, None, false), numbers::DASH);
        assert_eq!(of(0.314, Some(0.2), Some((0.1, 0.8)), false), "(0.31)");
    }

    #[test]
    fn crossover_is_printed_with_its_interval() {
        let crossover = Estimate {
            value: 3.05,
            standard_error: Some(0.12),
        };
        let with = format_estimate_with_interval(&crossover, Some((2.7778, 3.3222)));
        assert_eq!(with, "3.05 \u{b1} 0.12 [2.78 to 3.32]");
        assert_eq!(format_estimate_with_interval(&crossover, None), "3.05 \u{b1} 0.12");
    }
}
