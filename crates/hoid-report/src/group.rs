//! The page about a group of recorded runs: chosen delays, averages, estimates over time by condition and subject.

use hoid_io::{ColumnValues, OutputTable};
use hoid_model::{Complex64, uncertainty::Estimate};
use hoid_study::group::Manifest;
use minijinja::{Value, context};

use crate::{
    ReportError,
    figures::{
        BodeColumn, BodeCurve, BodeGrid, BodePoints, CurveKind, LineKind, Ordinate, Shade, TraceCurve, TraceGrid,
        TracePanel, bode_grid, trace_panels,
    },
    numbers, page,
};

/// The tables of a finished group.
#[derive(Debug, Clone, Copy)]
pub struct GroupTables<'a> {
    /// All estimates in long form.
    pub estimates: &'a OutputTable,
    /// Averages over runs.
    pub averages: &'a OutputTable,
    /// Delays and T_n that were chosen beforehand.
    pub delays: &'a OutputTable,
    /// Averages of traces.
    pub traces: &'a OutputTable,
    /// Lines of the describing functions and what follows from them, where the manifest names an excitation.
    pub frequencies: Option<(&'a OutputTable, &'a OutputTable)>,
}

/// The page.
#[derive(Debug)]
pub struct GroupReport<'a> {
    /// What was analysed.
    pub manifest: &'a Manifest,
    /// What came out.
    pub tables: GroupTables<'a>,
    /// What was done and with what, as name and value.
    pub settings: Vec<(String, String)>,
    /// One subject alone, or all.
    pub subject: Option<&'a str>,
}

/// Columns of the table of averages: parameter and heading.
const AVERAGED: [(&str, &str); 7] = [
    ("K_e", "K_e"),
    ("T_L", "T_L (s)"),
    ("K_e_dot", "K_e_dot (s)"),
    ("omega_nm", "omega_nm (rad/s)"),
    ("zeta_nm", "zeta_nm"),
    ("tau_e", "tau_e (s)"),
    ("vaf", "VAF (%)"),
];

/// Recursions in the order of the colours: as everywhere, RLS blue and RPEM vermillion.
const METHODS: [(&str, &str); 3] = [("RLS", "ARX (RLS)"), ("RPEM", "BJ (RPEM)"), ("PHYSICAL", "physical")];

/// A figure: panels by name and unit, and the columns of RLS and of the others.
type Row = (&'static str, &'static str, &'static str, &'static str);

const OPERATOR: [Row; 5] = [
    ("K_e", "deg/deg", "K_e", "K_e"),
    ("T_L", "s", "T_L", "T_L"),
    ("K_e_dot", "s", "K_e_dot", "K_e_dot"),
    ("omega_nm", "rad/s", "omega_nm", "omega_nm"),
    ("zeta_nm", "", "zeta_nm", "zeta_nm"),
];
const DISCRETE: [Row; 4] = [
    ("a1", "", "a1", "f1"),
    ("a2", "", "a2", "f2"),
    ("b0", "", "b0", "b0"),
    ("b1", "", "b1", "b1"),
];

fn texts<'a>(table: &'a OutputTable, name: &str) -> &'a [String] {
    match table.column(name) {
        Some(ColumnValues::Text(values)) => values,
        _ => &[],
    }
}

fn reals<'a>(table: &'a OutputTable, name: &str) -> &'a [f64] {
    match table.column(name) {
        Some(ColumnValues::Real(values)) => values,
        _ => &[],
    }
}

impl GroupReport<'_> {
    fn shows(&self, subject: &str) -> bool {
        self.subject.is_none_or(|only| only == subject)
    }

    /// Subjects, and conditions, in the order of the manifest.
    fn names(&self) -> (Vec<&str>, Vec<&str>) {
        let (mut subjects, mut conditions): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
        for run in self
            .manifest
            .runs
            .iter()
            .filter(|run| run.counts && self.shows(&run.subject))
        {
            if !subjects.contains(&run.subject.as_str()) {
                subjects.push(&run.subject);
            }
            if !conditions.contains(&run.condition.as_str()) {
                conditions.push(&run.condition);
            }
        }
        (subjects, conditions)
    }

    /// The page as HTML text, with all styles and figures inside it. The same data give the same bytes.
    ///
    /// # Errors
    /// [`ReportError::Template`] for a defect of this crate.
    pub fn html(&self) -> Result<String, ReportError> {
        let (_, conditions) = self.names();
        let figures: Vec<Value> = conditions
            .iter()
            .map(|condition| {
                let figure = |rows: &'static [Row], what: &str, variance: bool| {
                    let id = format!(
                        "{what}-{}",
                        condition.replace(|c: char| !c.is_ascii_alphanumeric(), "-")
                    );
                    self.figure(&id, condition, rows, variance)
                };
                context! {
                    condition => if condition.is_empty() { "all runs" } else { condition },
                    operator => figure(&OPERATOR, "operator", false),
                    discrete => figure(&DISCRETE, "discrete", false),
                    variances => figure(&DISCRETE, "variance", true),
                }
            })
            .collect();
        let title = match self.subject {
            Some(subject) => format!("{}: subject {subject}", self.manifest.name),
            None => self.manifest.name.clone(),
        };
        page::render(
            "group.html",
            context! {
                title,
                settings => page::facts(&self.settings),
                notes => self.notes(),
                headings => AVERAGED.map(|(_, heading)| heading),
                averages => self.averages(),
                delays => self.delays(),
                failures => self.failures(),
                margins => self.margins(),
                describing => self.describing(),
                figures,
            },
        )
    }

    fn notes(&self) -> Vec<String> {
        let left_out = self.manifest.runs.iter().filter(|run| !run.counts).count();
        if left_out == 0 {
            return Vec::new();
        }
        vec![format!("{left_out} runs do not count and were left out.")]
    }

    /// A row for each subject, condition and estimator: the median over runs of each parameter of the whole run.
    fn averages(&self) -> Vec<Value> {
        let table = self.tables.averages;
        let [subject, condition, window, estimator, parameter] =
            ["subject", "condition", "window", "estimator", "parameter"].map(|name| texts(table, name));
        let (median, runs) = (reals(table, "median"), reals(table, "runs"));
        let mut rows: Vec<(String, String, String, Vec<String>, f64)> = Vec::new();
        for i in 0..median.len() {
            let at = AVERAGED.iter().position(|(name, _)| *name == parameter[i]);
            let Some(at) = at.filter(|_| window[i] == "whole" && self.shows(&subject[i])) else {
                continue;
            };
            let key = |row: &(String, String, String, Vec<String>, f64)| {
                row.0 == subject[i] && row.1 == condition[i] && row.2 == estimator[i]
            };
            let place = rows.iter().position(key).unwrap_or_else(|| {
                rows.push((
                    subject[i].clone(),
                    condition[i].clone(),
                    estimator[i].clone(),
                    vec!["\u{2013}".to_owned(); AVERAGED.len()],
                    0.0,
                ));
                rows.len() - 1
            });
            rows[place].3[at] = numbers::plain(median[i]);
            rows[place].4 = rows[place].4.max(runs[i]);
        }
        rows.into_iter()
            .map(|(subject, condition, estimator, cells, runs)| context! { subject, condition, estimator, cells, runs => numbers::plain(runs) })
            .collect()
    }

    fn delays(&self) -> Vec<Value> {
        let table = self.tables.delays;
        let [subject, condition, run] = ["subject", "condition", "run"].map(|name| texts(table, name));
        let columns = ["ARX_nk", "BJ_nk", "BJ_nd", "BJ_T_n"].map(|name| reals(table, name));
        (0..subject.len())
            .filter(|i| self.shows(&subject[*i]))
            .map(|i| {
                let cells = columns.map(|column| match column.get(i) {
                    Some(value) if value.is_finite() => numbers::plain(*value),
                    _ => "\u{2013}".to_owned(),
                });
                context! { subject => &subject[i], condition => &condition[i], run => &run[i], cells => cells.to_vec() }
            })
            .collect()
    }

    /// What the describing functions say, with standard errors, a row for each subject and condition.
    fn margins(&self) -> Vec<Value> {
        let Some((_, table)) = self.tables.frequencies else {
            return Vec::new();
        };
        let [subject, condition, reason] = ["subject", "condition", "reason"].map(|name| texts(table, name));
        let cell = |name: &str, i: usize| {
            let value = reals(table, name).get(i).copied().filter(|v| v.is_finite());
            let error = reals(table, &format!("{name}_se"))
                .get(i)
                .copied()
                .filter(|v| v.is_finite());
            match (value, error) {
                (None, _) => "\u{2013}".to_owned(),
                (Some(value), None) => numbers::fixed(value, 3),
                (Some(value), error) => {
                    let (value, error) = numbers::with_uncertainty(value, error);
                    format!("{value} \u{b1} {error}")
                }
            }
        };
        (0..subject.len())
            .filter(|i| self.shows(&subject[*i]))
            .map(|i| {
                let names = [
                    "crossover_rad_s",
                    "phase_margin_deg",
                    "gain",
                    "lead_s",
                    "delay_s",
                    "coherence",
                    "off_line_share",
                ];
                let cells = names.map(|name| cell(name, i)).to_vec();
                context! { subject => &subject[i], condition => &condition[i], reason => &reason[i], cells }
            })
            .collect()
    }

    /// Bode points of the describing functions, a figure for each condition with a column for each subject.
    fn describing(&self) -> Vec<Value> {
        let Some((lines, margins)) = self.tables.frequencies else {
            return Vec::new();
        };
        let (subjects, conditions) = self.names();
        let column = |condition: &str, subject: &str| {
            let at = |table: &OutputTable| {
                let (s, c) = (texts(table, "subject"), texts(table, "condition"));
                (0..s.len())
                    .filter(|i| s[*i] == subject && c[*i] == condition)
                    .collect::<Vec<usize>>()
            };
            let rows = at(lines);
            let pick = |name: &str| rows.iter().map(|i| reals(lines, name)[*i]).collect::<Vec<f64>>();
            let omega = pick("omega_rad_s");
            let mut curves = Vec::new();
            let first = at(margins).first().copied();
            let fit = first.map(|i| ["gain", "lead_s", "delay_s"].map(|name| reals(margins, name)[i]));
            if let (Some([gain, lead_s, delay_s]), Some(low), Some(high)) = (fit, omega.first(), omega.last()) {
                let w: Vec<f64> = (0..=80).map(|k| low * (high / low).powf(f64::from(k) / 80.0)).collect();
                let response: Vec<Complex64> = w
                    .iter()
                    .map(|w| gain * Complex64::new(1.0, lead_s * w) * Complex64::from_polar(1.0, -delay_s * w))
                    .collect();
                let shade = Shade::of_method(2);
                curves.push(BodeCurve::of_response(
                    "gain, lead and delay",
                    LineKind::Line,
                    shade,
                    &w,
                    &response,
                    delay_s,
                ));
            }
            let estimates = |name: &str| {
                let errors = pick(&format!("{name}_se"));
                let estimate = |(value, error): (f64, f64)| Estimate {
                    value,
                    standard_error: Some(error).filter(|e| e.is_finite()),
                };
                pick(name)
                    .into_iter()
                    .zip(errors)
                    .map(estimate)
                    .collect::<Vec<Estimate>>()
            };
            let points = BodePoints {
                name: "describing function".to_owned(),
                magnitude_db: estimates("magnitude_db"),
                phase_deg: estimates("phase_deg"),
                delay_s: fit.map_or(0.0, |[_, _, delay_s]| delay_s),
                omega_rad_s: omega,
            };
            curves.push(BodeCurve::of_points(&points, Shade::of_method(5)));
            BodeColumn {
                title: format!("subject {subject}"),
                curves,
            }
        };
        let shown = |condition: &&&str| texts(lines, "condition").iter().any(|c| c == **condition);
        conditions
            .iter()
            .filter(shown)
            .map(|condition| {
                let id = format!(
                    "describing-{}",
                    condition.replace(|c: char| !c.is_ascii_alphanumeric(), "-")
                );
                let columns = subjects.iter().map(|subject| column(condition, subject)).collect();
                let figure = bode_grid(
                    &id,
                    &format!("Describing functions, condition {condition}"),
                    &BodeGrid { columns },
                );
                context! { condition => *condition, figure }
            })
            .collect()
    }

    /// What could not be estimated, and how often.
    fn failures(&self) -> Vec<Value> {
        let table = self.tables.estimates;
        let [subject, condition, estimator, status, reason] =
            ["subject", "condition", "estimator", "status", "reason"].map(|name| texts(table, name));
        let mut found: Vec<([&str; 4], usize, &str)> = Vec::new();
        for i in (0..status.len()).filter(|i| status[*i] != "ok" && self.shows(&subject[*i])) {
            let key = [&subject[i], &condition[i], &estimator[i], &status[i]].map(String::as_str);
            match found.iter_mut().find(|(known, _, _)| *known == key) {
                Some(entry) => entry.1 += 1,
                None => found.push((key, 1, &reason[i])),
            }
        }
        found
            .into_iter()
            .map(|([subject, condition, estimator, status], times, reason)| context! { subject, condition, estimator, status, times, reason })
            .collect()
    }

    /// Median and quartiles over the runs at each time, a column for each subject; or the variances of the RPEM coefficients.
    fn figure(&self, id: &str, condition: &str, rows: &[Row], variance: bool) -> String {
        let (subjects, _) = self.names();
        let table = self.tables.traces;
        let keys = ["subject", "condition", "estimator"].map(|name| texts(table, name));
        let times = reals(table, "t");
        let mut panels = Vec::new();
        let methods: &[(&str, &str)] = if variance { &METHODS[1..2] } else { &METHODS };
        for (name, unit, of_rls, of_others) in rows {
            for subject in &subjects {
                let mut curves = Vec::new();
                for (number, (method, _)) in METHODS.iter().enumerate().filter(|(_, m)| methods.contains(m)) {
                    let parameter = if *method == "RLS" { of_rls } else { of_others };
                    let at: Vec<usize> = (0..times.len())
                        .filter(|i| keys[0][*i] == *subject && keys[1][*i] == *condition && keys[2][*i] == *method)
                        .collect();
                    let figure = |what: &str| {
                        let column = reals(table, &format!("{parameter}_{what}"));
                        at.iter()
                            .map(|i| column.get(*i).copied().unwrap_or(f64::NAN))
                            .collect::<Vec<f64>>()
                    };
                    let values = figure(if variance { "variance" } else { "median" });
                    if values.iter().all(|v| !v.is_finite()) {
                        continue;
                    }
                    let band = if variance {
                        Vec::new()
                    } else {
                        figure("lower_quartile")
                            .into_iter()
                            .zip(figure("upper_quartile"))
                            .collect()
                    };
                    curves.push(TraceCurve {
                        kind: CurveKind::Estimate,
                        method: number,
                        level: 0,
                        times_s: at.iter().map(|i| times[*i]).collect(),
                        values,
                        band,
                    });
                }
                panels.push(TracePanel {
                    name: if variance {
                        format!("variance of {name}")
                    } else {
                        (*name).to_owned()
                    },
                    unit: (*unit).to_owned(),
                    curves,
                    ordinate: if variance {
                        Ordinate::Logarithmic
                    } else {
                        Ordinate::Robust
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
            shaded_s: self.manifest.analysis.windows_s.iter().flatten().copied().collect(),
            marks_s: self
                .manifest
                .conditions
                .get(condition)
                .and_then(|facts| facts.change_s)
                .into_iter()
                .collect(),
            shared_ordinates: false,
        };
        trace_panels(id, &format!("Estimates over time, condition {condition}"), &grid)
    }
}
