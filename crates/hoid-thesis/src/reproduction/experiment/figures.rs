//! Figs. 13, 14 and I.1 to I.18: quantities over time, with one column for each subject.

use hoid_model::scenario::{Condition, Scenario};
use hoid_report::figures::{CurveKind, Ordinate, TraceCurve, TraceGrid, TracePanel, trace_panels};

use super::run_selection::{mean_and_median, select, subjects};
use crate::{
    experiment::{
        EvaluatedRun,
        procedure::{RecursiveTrace, State},
    },
    reproduction::{
        item::{Item, ItemOutput},
        table_builder::TableBuilder,
    },
};

/// Quantity shown in a panel.
#[derive(Debug, Clone, Copy)]
pub(super) enum PanelQuantity {
    Discrete(usize),
    Operator(usize),
    Variance(usize),
}

/// A row of panels: quantity, name, unit.
pub(super) type Row = (PanelQuantity, &'static str, &'static str);

pub(super) const DISCRETE: [Row; 4] = [
    (PanelQuantity::Discrete(0), "a1", ""),
    (PanelQuantity::Discrete(1), "a2", ""),
    (PanelQuantity::Discrete(2), "b0", ""),
    (PanelQuantity::Discrete(3), "b1", ""),
];
pub(super) const OPERATOR: [Row; 5] = [
    (PanelQuantity::Operator(0), "K_e", "deg/deg"),
    (PanelQuantity::Operator(1), "T_L", "s"),
    (PanelQuantity::Operator(2), "K_e_dot", "s"),
    (PanelQuantity::Operator(3), "omega_nm", "rad/s"),
    (PanelQuantity::Operator(4), "zeta_nm", ""),
];
pub(super) const VARIANCES: [Row; 5] = [
    (PanelQuantity::Variance(0), "variance of a1", ""),
    (PanelQuantity::Variance(1), "variance of a2", ""),
    (PanelQuantity::Variance(2), "variance of b0", ""),
    (PanelQuantity::Variance(3), "variance of b1", ""),
    (PanelQuantity::Variance(4), "variance of d1", ""),
];

const RECURSIONS: [&str; 2] = ["RLS", "RPEM"];
const BATCH: [&str; 2] = ["OLS", "PEM"];

impl PanelQuantity {
    fn is_variance(self) -> bool {
        matches!(self, Self::Variance(_))
    }

    fn value_in_state(self, state: &State) -> f64 {
        match self {
            Self::Discrete(i) => state.discrete[i],
            Self::Operator(i) => state.operator[i],
            Self::Variance(_) => f64::NAN,
        }
    }

    /// Value of the quantity in a row of a recursive estimate; NaN beyond its last row.
    fn value_in_trace(self, course: &RecursiveTrace, row: usize) -> f64 {
        let found = match self {
            Self::Variance(i) => course.variances.get(row).map(|variances| variances[i]),
            _ => course.states.get(row).map(|state| self.value_in_state(state)),
        };
        found.unwrap_or(f64::NAN)
    }
}

/// Draws quantities over time for the people in a condition.
pub(super) fn draw(
    item: &Item,
    runs: &[EvaluatedRun],
    (condition, of_text): (&str, Condition),
    rows: &[Row],
) -> ItemOutput {
    let mut data = TableBuilder::new(&["parameter", "estimator", "subject"], &["t", "mean", "median"]);
    let people: Vec<(&str, Vec<&EvaluatedRun>)> = subjects(runs, condition)
        .into_iter()
        .map(|subject| (subject, select(runs, subject, condition)))
        .collect();
    let simulated = runs.iter().any(|run| run.outcome.truth.is_some());
    let mut panels = Vec::new();
    for (shown, name, unit) in rows {
        for (subject, own) in &people {
            let mut curves = Vec::new();
            for method in 0..RECURSIONS.len() {
                if shown.is_variance() && method == 0 {
                    continue;
                }
                curves.extend(recursive_curves(*shown, own, method, (name, subject), &mut data));
                if !shown.is_variance() {
                    curves.extend(batch_curves(*shown, own, method, (name, subject), &mut data));
                }
            }
            if !shown.is_variance() {
                curves.extend(truth(*shown, own, of_text));
            }
            panels.push(TracePanel {
                name: (*name).to_owned(),
                // The gains of recorded people are in the units of their recordings.
                unit: if simulated || !matches!(shown, PanelQuantity::Operator(0 | 2)) {
                    (*unit).to_owned()
                } else {
                    String::new()
                },
                ordinate: if shown.is_variance() {
                    Ordinate::Logarithmic
                } else {
                    Ordinate::Robust
                },
                curves,
            });
        }
    }
    let title = |subject: &str| match subject.parse::<u64>() {
        Ok(number) => format!("subject {number}"),
        Err(_) => subject.to_owned(),
    };
    let mut changes = people.iter().flat_map(|(_, own)| own).filter_map(|run| run.change_s);
    let grid = TraceGrid {
        panels,
        columns: people.len(),
        titles: people.iter().map(|(subject, _)| title(subject)).collect(),
        methods: ["ARX (RLS)", "BJ (RPEM)"].map(str::to_owned).to_vec(),
        levels: ["median", "mean"].map(str::to_owned).to_vec(),
        marks_s: changes.next().into_iter().collect(),
        ..TraceGrid::default()
    };
    item.draw(trace_panels, &grid, data)
}

/// Curves of the median and the mean over the runs of a recursive estimate.
fn recursive_curves(
    shown: PanelQuantity,
    own: &[&EvaluatedRun],
    method: usize,
    (name, subject): (&str, &str),
    data: &mut TableBuilder,
) -> Vec<TraceCurve> {
    let courses = || own.iter().map(|run| &run.outcome.traces[method]);
    let longest = courses().max_by_key(|course| course.times_s.len());
    let times_s = longest.map_or(Vec::new(), |course| course.times_s.clone());
    let at = |row: usize| mean_and_median(courses().map(|course| shown.value_in_trace(course, row)));
    let both: Vec<[f64; 2]> = (0..times_s.len()).map(at).collect();
    for (t, [mean, median]) in times_s.iter().zip(&both) {
        data.add_row(&[name, RECURSIONS[method], subject], &[*t, *mean, *median]);
    }
    // Higher levels are darker; the median is drawn first, and the mean over it.
    [1, 0]
        .into_iter()
        .enumerate()
        .map(|(level, which)| {
            let values = both.iter().map(|of| of[which]).collect();
            curve(CurveKind::Estimate, method, level, times_s.clone(), values)
        })
        .collect()
}

/// Curves of the means over the runs of the batch fits to the two spans.
fn batch_curves(
    shown: PanelQuantity,
    own: &[&EvaluatedRun],
    method: usize,
    (name, subject): (&str, &str),
    data: &mut TableBuilder,
) -> Vec<TraceCurve> {
    let Some(first) = own.first() else {
        return Vec::new();
    };
    let mut curves = Vec::new();
    for (span, (from_s, to_s)) in first.outcome.spans_s.into_iter().enumerate() {
        let fitted = mean_and_median(
            own.iter()
                .map(|run| shown.value_in_state(&run.outcome.batch[method][span])),
        );
        for t in [from_s, to_s] {
            data.add_row(&[name, BATCH[method], subject], &[t, fitted[0], fitted[1]]);
        }
        curves.push(curve(
            CurveKind::Batch,
            method,
            1,
            vec![from_s, to_s],
            vec![fitted[0]; 2],
        ));
    }
    curves
}

fn curve(kind: CurveKind, method: usize, level: usize, times_s: Vec<f64>, values: Vec<f64>) -> TraceCurve {
    TraceCurve {
        kind,
        method,
        level,
        times_s,
        values,
        band: Vec::new(),
    }
}

/// Curve of the mean over the simulated operators, which changes from its value at the start to its value at the end;
/// `None` for recorded people.
fn truth(shown: PanelQuantity, own: &[&EvaluatedRun], condition: Condition) -> Option<TraceCurve> {
    let states: Vec<[State; 2]> = (own.iter()).filter_map(|run| Some(run.outcome.truth?.states)).collect();
    if states.is_empty() {
        return None;
    }
    let [first, last] =
        [0, 1].map(|end| mean_and_median(states.iter().map(|state| shown.value_in_state(&state[end])))[0]);
    let schedule = Scenario::condition(condition).schedule;
    let times_s: Vec<f64> = (0..=512).map(|k| 81.92 * f64::from(k) / 512.0).collect();
    let share = |t: &f64| match (schedule.change_s(), schedule.rate_per_s()) {
        (Some(at_s), Some(rate)) => 1.0 / (1.0 + (-rate * (t - at_s)).exp()),
        _ => 0.0,
    };
    let values = times_s.iter().map(|t| first + (last - first) * share(t)).collect();
    Some(curve(CurveKind::Truth, 0, 0, times_s, values))
}
