//! Recursive estimates by condition and subject, and their response to a change.

use minijinja::{Value, context};

use super::{
    report::{GroupReport, id_of},
    tables::{reals, rows_of, texts},
};
use crate::{
    figures::{CurveKind, Ordinate, TraceCurve, TraceGrid, TracePanel, trace_panels},
    numbers,
};

/// Recursions in the order of the colours: as in all figures, RLS is blue and RPEM vermillion.
const METHODS: [(&str, &str); 3] = [("RLS", "ARX (RLS)"), ("RPEM", "BJ (RPEM)"), ("PHYSICAL", "physical")];

/// One row of panels: name and unit, the column of the table for RLS, and the column for the other recursions. Gains
/// have no unit, because the runs of a group have no units of e and u.
type Row = (&'static str, &'static str, &'static str, &'static str);

const OPERATOR: [Row; 5] = [
    ("K_e", "", "K_e", "K_e"),
    ("T_L", "s", "T_L", "T_L"),
    ("K_e_dot", "", "K_e_dot", "K_e_dot"),
    ("omega_nm", "rad/s", "omega_nm", "omega_nm"),
    ("zeta_nm", "", "zeta_nm", "zeta_nm"),
];
const DISCRETE: [Row; 4] = [
    ("a1", "", "a1", "f1"),
    ("a2", "", "a2", "f2"),
    ("b0", "", "b0", "b0"),
    ("b1", "", "b1", "b1"),
];

/// Statistics that a figure shows over time.
#[derive(Clone, Copy, PartialEq)]
enum ShownStatistic {
    /// Medians and quartiles over the runs, for all recursions.
    Estimates,
    /// Variances of the RPEM estimates.
    Variances,
    /// Correlations of the RPEM estimates.
    Correlations,
}

/// One row of panels.
struct PanelRow {
    name: String,
    unit: &'static str,
    rls_column: String,
    other_column: String,
}

impl PanelRow {
    fn of((name, unit, of_rls, of_others): Row) -> Self {
        Self {
            name: name.to_owned(),
            unit,
            rls_column: of_rls.to_owned(),
            other_column: of_others.to_owned(),
        }
    }
}

/// Names of the recursions.
pub(super) fn methods() -> Vec<&'static str> {
    METHODS.iter().map(|(_, name)| *name).collect()
}

fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() {
        name.to_owned()
    } else {
        format!("{name} ({unit})")
    }
}

/// Formats a number with three significant digits.
fn format_short(value: f64) -> String {
    numbers::format_significant(value, 3)
}

impl GroupReport<'_> {
    /// Returns the figures of the recursive estimates over time, for each condition.
    pub(super) fn figures_over_time(&self) -> Vec<Value> {
        let (_, conditions) = self.subjects_and_conditions();
        let rows = |rows: &[Row]| rows.iter().map(|row| PanelRow::of(*row)).collect::<Vec<_>>();
        conditions
            .iter()
            .map(|condition| {
                let figure =
                    |rows: &[PanelRow], what: &str, shown| self.figure(&id_of(what, condition), condition, rows, shown);
                let responses = self.response_rows();
                context! {
                    condition => if condition.is_empty() { "all runs" } else { condition },
                    operator => figure(&rows(&OPERATOR), "operator", ShownStatistic::Estimates),
                    discrete => figure(&rows(&DISCRETE), "discrete", ShownStatistic::Estimates),
                    response => (!responses.is_empty()).then(|| figure(&responses, "response", ShownStatistic::Estimates)),
                    variances => figure(&rows(&DISCRETE), "variance", ShownStatistic::Variances),
                    correlations => figure(&self.correlation_rows(), "correlation", ShownStatistic::Correlations),
                }
            })
            .collect()
    }

    /// Names of the columns of the trace averages that start with this prefix, without the suffix for the statistic.
    fn columns(&self, prefix: &str) -> Vec<&str> {
        let names = self.tables.traces.columns.iter().map(|column| column.name.as_str());
        names
            .filter(|name| name.starts_with(prefix))
            .filter_map(|name| name.strip_suffix("_median"))
            .collect()
    }

    fn response_rows(&self) -> Vec<PanelRow> {
        let of = |prefix: &str, (left, right): (&str, &str), unit| {
            let row = |column: &str| PanelRow {
                name: column.replace(prefix, left) + right,
                unit,
                rls_column: column.to_owned(),
                other_column: column.to_owned(),
            };
            self.columns(prefix).into_iter().map(row).collect::<Vec<_>>()
        };
        let mut rows = of("magnitude_db_at_", ("|H(", "j)|"), "dB");
        rows.extend(of("phase_deg_at_", ("arg H(", "j)"), "deg"));
        rows
    }

    fn correlation_rows(&self) -> Vec<PanelRow> {
        let columns = self.columns("correlation_").into_iter();
        let row = |column: &str| PanelRow {
            name: column.replace("correlation_", "").replace('_', ", "),
            unit: "",
            rls_column: column.to_owned(),
            other_column: column.to_owned(),
        };
        columns.map(row).collect()
    }

    /// Settling times and noise of the recursions after a change: one row for each subject, condition and parameter,
    /// with three cells for each recursion.
    pub(super) fn settling_rows(&self) -> Vec<Value> {
        let table = self.tables.settling;
        let [subject, condition, estimator, parameter] =
            ["subject", "condition", "estimator", "parameter"].map(|name| texts(table, name));
        let [before, after, settled, noise] = ["before", "after", "settle90_s", "noise"].map(|name| reals(table, name));
        let mut names: Vec<(String, String)> = OPERATOR
            .iter()
            .map(|(name, unit, ..)| (with_unit(name, unit), (*name).to_owned()))
            .collect();
        names.extend(
            self.response_rows()
                .into_iter()
                .map(|row| (with_unit(&row.name, row.unit), row.rls_column)),
        );
        let (subjects, conditions) = self.subjects_and_conditions();
        let mut rows = Vec::new();
        for (condition_of, subject_of) in conditions.iter().flat_map(|c| subjects.iter().map(move |s| (c, s))) {
            for (shown, name) in &names {
                let row_of = |method: &str| {
                    (0..subject.len()).find(|i| {
                        subject[*i] == *subject_of
                            && condition[*i] == *condition_of
                            && parameter[*i] == *name
                            && estimator[*i] == method
                    })
                };
                let found = METHODS.map(|(method, _)| row_of(method));
                if found.iter().all(Option::is_none) {
                    continue;
                }
                let cells: Vec<String> = found
                    .into_iter()
                    .flat_map(|row| match row {
                        Some(i) => [
                            format!("{} \u{2192} {}", format_short(before[i]), format_short(after[i])),
                            format_short(settled[i]),
                            format_short(noise[i]),
                        ],
                        None => std::array::from_fn(|_| format_short(f64::NAN)),
                    })
                    .collect();
                rows.push(context! { subject => *subject_of, condition => *condition_of, parameter => shown, cells });
            }
        }
        rows
    }

    /// Time (s) of the task change in a condition, from the manifest or, if joined runs were used, from the table of
    /// settling times.
    fn change_s(&self, condition: &str) -> Option<f64> {
        let known = self
            .manifest
            .conditions
            .get(condition)
            .and_then(|settings| settings.change_s);
        let table = self.tables.settling;
        let seam = || {
            let row = texts(table, "condition").iter().position(|c| c == condition)?;
            reals(table, "change_s").get(row).copied()
        };
        known.or_else(seam)
    }

    /// Draws one figure with a column of panels for each subject.
    fn figure(&self, id: &str, condition: &str, rows: &[PanelRow], shown: ShownStatistic) -> String {
        let (subjects, _) = self.subjects_and_conditions();
        let methods = if shown == ShownStatistic::Estimates {
            &METHODS[..]
        } else {
            &METHODS[1..2]
        };
        let mut panels = Vec::new();
        for row in rows {
            for subject in &subjects {
                let curves = METHODS
                    .iter()
                    .enumerate()
                    .filter(|(_, method)| methods.contains(method));
                panels.push(TracePanel {
                    name: match shown {
                        ShownStatistic::Variances => format!("variance of {}", row.name),
                        _ => row.name.clone(),
                    },
                    unit: row.unit.to_owned(),
                    curves: curves
                        .filter_map(|(number, (method, _))| {
                            let parameter = if *method == "RLS" {
                                &row.rls_column
                            } else {
                                &row.other_column
                            };
                            self.curve((subject, condition, method), number, parameter, shown)
                        })
                        .collect(),
                    ordinate: match shown {
                        ShownStatistic::Variances => Ordinate::Logarithmic,
                        _ => Ordinate::Robust,
                    },
                });
            }
        }
        let grid = TraceGrid {
            panels,
            columns: subjects.len(),
            titles: subjects.iter().map(|subject| format!("subject {subject}")).collect(),
            methods: METHODS.iter().map(|(_, name)| (*name).to_owned()).collect(),
            levels: Vec::new(),
            shaded_spans_s: self.manifest.analysis.windows_s.iter().flatten().copied().collect(),
            marks_s: self.change_s(condition).into_iter().collect(),
            changes: Vec::new(),
            shared_ordinates: false,
        };
        trace_panels(id, &format!("Estimates over time, condition {condition}"), &grid)
    }

    /// Curve of one recursion for a subject and condition; `None` if there are no values.
    fn curve(
        &self,
        (subject, condition, method): (&str, &str, &str),
        number: usize,
        parameter: &str,
        shown: ShownStatistic,
    ) -> Option<TraceCurve> {
        let table = self.tables.traces;
        let estimators = texts(table, "estimator");
        let at: Vec<usize> = rows_of(table, subject, condition)
            .into_iter()
            .filter(|i| estimators[*i] == method)
            .collect();
        let figure = |what: &str| {
            let column = reals(table, &format!("{parameter}_{what}"));
            at.iter()
                .map(|i| column.get(*i).copied().unwrap_or(f64::NAN))
                .collect::<Vec<f64>>()
        };
        let variances = shown == ShownStatistic::Variances;
        let values = figure(if variances { "variance" } else { "median" });
        values.iter().any(|v| v.is_finite()).then(|| TraceCurve {
            kind: CurveKind::Estimate,
            method: number,
            level: 0,
            times_s: at.iter().map(|i| reals(table, "t")[*i]).collect(),
            band: if variances {
                Vec::new()
            } else {
                figure("lower_quartile")
                    .into_iter()
                    .zip(figure("upper_quartile"))
                    .collect()
            },
            values,
        })
    }
}
