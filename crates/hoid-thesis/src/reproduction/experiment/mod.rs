//! The experiment with virtual people: Table 3, Figs. 13, 14 and I.1 to I.18.
//!
//! All of them show the same runs, which are made once, before the first is drawn.

use std::sync::{Arc, OnceLock};

use hoid_model::scenario::Condition;
use hoid_numerics::statistics::mean;
use hoid_study::statistics::median;

use super::{
    item::{Item, ItemOutput, SharedRuns},
    table_builder::TableBuilder,
};
use crate::experiment::{
    EXPERIMENT, EvaluatedRun, ExperimentPlan, experiment,
    procedure::{Course, SPANS_S, State},
};
use hoid_report::figures::{CurveKind, Ordinate, TraceCurve, TraceGrid, TracePanel, trace_panels};

const CAPTION: &str = "Three virtual subjects, mean (dark) and median (light) over the last five of seven runs at each time; the text has the mean. Dashed \
                       in colour: batch fits of [0, 30.72] and [51.20, 81.92] s, the mean; dashed black: the simulated operator, the mean over the runs.";

/// Runs of the experiment, made once.
type Runs = Arc<OnceLock<Result<Vec<EvaluatedRun>, String>>>;

/// Quantities of a panel.
#[derive(Debug, Clone, Copy)]
enum Shown {
    Discrete(usize),
    Operator(usize),
    Variance(usize),
}

/// A row of panels: quantity, name, unit.
type Row = (Shown, &'static str, &'static str);

const DISCRETE: [Row; 4] = [
    (Shown::Discrete(0), "a1", ""),
    (Shown::Discrete(1), "a2", ""),
    (Shown::Discrete(2), "b0", ""),
    (Shown::Discrete(3), "b1", ""),
];
const OPERATOR: [Row; 5] = [
    (Shown::Operator(0), "K_e", "deg/deg"),
    (Shown::Operator(1), "T_L", "s"),
    (Shown::Operator(2), "K_e_dot", "s"),
    (Shown::Operator(3), "omega_nm", "rad/s"),
    (Shown::Operator(4), "zeta_nm", ""),
];
const VARIANCES: [Row; 5] = [
    (Shown::Variance(0), "variance of a1", ""),
    (Shown::Variance(1), "variance of a2", ""),
    (Shown::Variance(2), "variance of b0", ""),
    (Shown::Variance(3), "variance of b1", ""),
    (Shown::Variance(4), "variance of d1", ""),
];

impl Shown {
    fn of_state(self, state: &State) -> f64 {
        match self {
            Self::Discrete(i) => state.discrete[i],
            Self::Operator(i) => state.operator[i],
            Self::Variance(_) => f64::NAN,
        }
    }

    fn of_course(self, course: &Course, row: usize) -> f64 {
        match self {
            Self::Variance(i) => course.variances[row][i],
            _ => self.of_state(&course.states[row]),
        }
    }
}

pub(super) fn items() -> Vec<Item> {
    let runs: Runs = Arc::default();
    let shared = SharedRuns {
        name: "experiment",
        title: "The experiment with virtual people",
        estimates: ExperimentPlan::parse(EXPERIMENT).map_or(0, |plan| plan.estimates()),
        make: {
            let runs = Arc::clone(&runs);
            Arc::new(move || {
                runs.get_or_init(made);
            })
        },
    };
    let mut all = vec![Item::new(
        "table-3",
        "Model parameters n_k* and T_n* used in each run and model structure (virtual people)",
        "Mean of those of the best fits of [0, 30.72] and [51.20, 81.92] s, condition C4; the true n_k of the subject alongside.",
        None,
        with(&runs, table),
    )
    .sharing(&shared)];
    let mut figure = |name: String, condition: Condition, rows: &'static [Row], what: &str| {
        let title = format!("{what}, condition {condition} (virtual people)");
        let make = move |item: &Item, runs: &[EvaluatedRun]| draw(item, runs, condition, rows);
        all.push(Item::new(name, title, CAPTION, None, with(&runs, make)).sharing(&shared));
    };
    let [discrete, operator, variances] = [
        "Recursive ARX and Box-Jenkins (m* = 1) estimates, discrete parameters",
        "Recursive ARX and Box-Jenkins (m* = 1) estimates, operator parameters",
        "Covariance of RPEM, Box-Jenkins (m* = 1)",
    ];
    figure("fig-13".to_owned(), Condition::C4, &DISCRETE, discrete);
    figure("fig-14".to_owned(), Condition::C4, &OPERATOR, operator);
    for (i, condition) in ExperimentPlan::CONDITIONS.into_iter().enumerate() {
        figure(format!("I.{}", 3 * i + 1), condition, &DISCRETE, discrete);
        figure(format!("I.{}", 3 * i + 2), condition, &OPERATOR, operator);
        figure(format!("I.{}", 3 * i + 3), condition, &VARIANCES, variances);
    }
    all
}

/// Makes the runs.
fn made() -> Result<Vec<EvaluatedRun>, String> {
    let plan = ExperimentPlan::parse(EXPERIMENT).map_err(|error| error.to_string())?;
    experiment(&plan).map_err(|error| error.to_string())
}

/// Makes an item from the runs; the reason if there are none.
fn with(
    runs: &Runs,
    make: impl Fn(&Item, &[EvaluatedRun]) -> ItemOutput + Send + Sync + 'static,
) -> impl Fn(&Item, Option<&hoid_study::Results>) -> ItemOutput + Send + Sync + 'static {
    let runs = Arc::clone(runs);
    move |item, _| match runs.get_or_init(made) {
        Ok(runs) => make(item, runs),
        Err(reason) => TableBuilder::new(&[], &[]).table(reason).into(),
    }
}

/// Runs of a subject in a condition.
fn of(runs: &[EvaluatedRun], subject: u64, condition: Condition) -> Vec<&EvaluatedRun> {
    let own = runs
        .iter()
        .filter(|run| (run.subject, run.condition) == (subject, condition));
    own.collect()
}

fn subjects(runs: &[EvaluatedRun]) -> u64 {
    runs.iter().map(|run| run.subject).max().unwrap_or(0)
}

fn table(item: &Item, runs: &[EvaluatedRun]) -> ItemOutput {
    let mut data = TableBuilder::new(&[], &["subject", "run", "nk_true", "nk_ARX", "nk_BJ", "T_n_BJ"]);
    for subject in 1..=subjects(runs) {
        for run in of(runs, subject, Condition::C4) {
            let found = &run.outcome;
            data.row(
                &[],
                &[
                    subject as f64,
                    run.run as f64,
                    found.true_nk as f64,
                    found.nk[0] as f64,
                    found.nk[1] as f64,
                    found.t_n_s,
                ],
            );
        }
    }
    data.table(&item.title).into()
}

/// Mean and median of the finite values.
fn middle(values: impl Iterator<Item = f64>) -> [f64; 2] {
    let finite: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    if finite.is_empty() {
        return [f64::NAN; 2];
    }
    [mean(&finite), median(&finite)]
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

fn draw(item: &Item, runs: &[EvaluatedRun], condition: Condition, rows: &[Row]) -> ItemOutput {
    let mut data = TableBuilder::new(&["parameter", "estimator"], &["subject", "t", "mean", "median"]);
    let mut panels = Vec::new();
    let is_variance = matches!(rows[0].0, Shown::Variance(_));
    for (shown, name, unit) in rows {
        for subject in 1..=subjects(runs) {
            let own = of(runs, subject, condition);
            let mut curves = Vec::new();
            for (method, estimator) in ["RLS", "RPEM"].into_iter().enumerate() {
                if is_variance && method == 0 {
                    continue;
                }
                let times_s = own
                    .first()
                    .map_or(Vec::new(), |run| run.outcome.courses[method].times_s.clone());
                let at = |row: usize| middle(own.iter().map(|run| shown.of_course(&run.outcome.courses[method], row)));
                let both: Vec<[f64; 2]> = (0..times_s.len()).map(at).collect();
                for (t, [mean, median]) in times_s.iter().zip(&both) {
                    data.row(&[name, estimator], &[subject as f64, *t, *mean, *median]);
                }
                // Higher levels are darker: the median first, the mean over it.
                for (level, which) in [1, 0].into_iter().enumerate() {
                    let values = both.iter().map(|of| of[which]).collect();
                    curves.push(curve(CurveKind::Estimate, method, level, times_s.clone(), values));
                }
                if is_variance {
                    continue;
                }
                for (span, (from_s, to_s)) in SPANS_S.into_iter().enumerate() {
                    let fitted = middle(own.iter().map(|run| shown.of_state(&run.outcome.batch[method][span])));
                    for t in [from_s, to_s] {
                        let fit = ["OLS", "PEM"][method];
                        data.row(&[name, fit], &[subject as f64, t, fitted[0], fitted[1]]);
                    }
                    curves.push(curve(
                        CurveKind::Batch,
                        method,
                        1,
                        vec![from_s, to_s],
                        vec![fitted[0]; 2],
                    ));
                }
            }
            if !is_variance {
                curves.push(truth(*shown, &own, condition));
            }
            panels.push(TracePanel {
                name: (*name).to_owned(),
                unit: (*unit).to_owned(),
                ordinate: if is_variance {
                    Ordinate::Logarithmic
                } else {
                    Ordinate::Robust
                },
                curves,
            });
        }
    }
    let methods = ["ARX (RLS)", "BJ (RPEM)"];
    let grid = TraceGrid {
        panels,
        columns: subjects(runs) as usize,
        titles: (1..=subjects(runs))
            .map(|subject| format!("subject {subject}"))
            .collect(),
        methods: methods.map(str::to_owned).to_vec(),
        levels: ["median", "mean"].map(str::to_owned).to_vec(),
        ..TraceGrid::default()
    };
    item.drawn(trace_panels, &grid, data)
}

/// The mean of the simulated operators: the value at the start, then that at the end.
fn truth(shown: Shown, own: &[&EvaluatedRun], condition: Condition) -> TraceCurve {
    let [first, last] = [0, 1].map(|end| middle(own.iter().map(|run| shown.of_state(&run.outcome.truth[end])))[0]);
    let schedule = hoid_model::scenario::Scenario::condition(condition).schedule;
    let times_s: Vec<f64> = (0..=512).map(|k| 81.92 * f64::from(k) / 512.0).collect();
    let share = |t: &f64| match (schedule.change_s(), schedule.rate_per_s()) {
        (Some(at_s), Some(rate)) => 1.0 / (1.0 + (-rate * (t - at_s)).exp()),
        _ => 0.0,
    };
    let values = times_s.iter().map(|t| first + (last - first) * share(t)).collect();
    curve(CurveKind::Truth, 0, 0, times_s, values)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::experiment::procedure::RunOutcome;

    fn run(subject: u64, number: u64, value: f64) -> EvaluatedRun {
        let state = State {
            discrete: [value; 4],
            operator: [value; 5],
        };
        let course = Course {
            times_s: vec![0.0, 40.0, 80.0],
            states: vec![state; 3],
            variances: vec![[value * value; 5]; 3],
        };
        EvaluatedRun {
            subject,
            condition: Condition::C4,
            run: number,
            outcome: RunOutcome {
                nk: [24, 29],
                t_n_s: 0.06,
                true_nk: 29,
                batch: [[state; 2]; 2],
                courses: [course.clone(), course],
                truth: [state; 2],
            },
        }
    }

    #[test]
    fn figures_show_the_average_and_the_median_of_the_runs() {
        let runs = [run(1, 3, 1.0), run(1, 4, 2.0), run(1, 5, 6.0), run(2, 3, 1.0)];
        let item = items().into_iter().find(|item| item.name == "fig-14").unwrap();
        for rows in [&DISCRETE[..], &OPERATOR, &VARIANCES] {
            let made = draw(&item, &runs, Condition::C4, rows);
            assert!(made.svg.unwrap().contains("subject 2"));
            let mean = made.data.columns.iter().find(|column| column.name == "mean").unwrap();
            let hoid_io::ColumnValues::Real(mean) = &mean.values else {
                panic!()
            };
            let expected = if matches!(rows[0].0, Shown::Variance(_)) {
                41.0 / 3.0
            } else {
                3.0
            };
            assert!((mean[0] - expected).abs() < 1e-12, "{mean:?}");
        }
        assert_eq!(middle([1.0, f64::NAN, 2.0, 6.0].into_iter()), [3.0, 2.0]);
        assert!(middle([f64::NAN].into_iter())[0].is_nan());
        let made = table(&item, &runs);
        assert_eq!(made.data.columns[4].name, "nk_BJ");
    }

    #[test]
    fn every_figure_of_the_appendix_has_its_number() {
        let names: Vec<String> = items().into_iter().map(|item| item.name).collect();
        for i in 1..=18 {
            assert!(names.contains(&format!("I.{i}")));
        }
        assert_eq!(names.len(), 21);
    }
}
