#![allow(clippy::unwrap_used)]

use super::{run_selection::mean_and_median, *};
use crate::experiment::{
    RunKey,
    procedure::{RecursiveTrace, RunOutcome, State, Truth},
};

fn run(subject: &str, number: u64, value: f64) -> EvaluatedRun {
    let state = State {
        discrete: [value; 4],
        operator: [value; 5],
    };
    let course = RecursiveTrace {
        times_s: vec![0.0, 20.0, 80.0],
        states: vec![state; 3],
        variances: vec![[value * value; 5]; 3],
    };
    EvaluatedRun {
        key: RunKey {
            subject: subject.to_owned(),
            condition: "C4".to_owned(),
            run: number.to_string(),
        },
        change_s: None,
        outcome: RunOutcome {
            spans_s: [(0.0, 30.72), (51.2, 81.92)],
            nk: [24, 29],
            nk_by_span: [[23, 25], [28, 30]],
            t_n_s: 0.06,
            batch: [[state; 2]; 2],
            traces: [course.clone(), course],
            truth: Some(Truth {
                nk: 29,
                states: [state; 2],
            }),
        },
    }
}

fn item() -> Item {
    items().into_iter().find(|item| item.name == "fig-14").unwrap()
}

fn column(made: &ItemOutput, name: &str) -> Vec<f64> {
    match &made.data.column(name).unwrap() {
        hoid_io::ColumnValues::Real(values) => values.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn figures_show_average_and_median_of_the_runs() {
    let runs = [run("1", 3, 1.0), run("1", 4, 2.0), run("1", 5, 6.0), run("2", 3, 1.0)];
    for rows in [&DISCRETE[..], &OPERATOR, &VARIANCES] {
        let made = figures::draw(&item(), &runs, ("C4", Condition::C4), rows);
        assert!(made.svg.as_ref().unwrap().contains("subject 2"));
        let expected = if rows.len() == 5 && rows[0].1.starts_with("variance") {
            41.0 / 3.0
        } else {
            3.0
        };
        let mean = column(&made, "mean");
        assert!((mean[0] - expected).abs() < 1e-12, "{mean:?}");
    }
    assert_eq!(mean_and_median([1.0, f64::NAN, 2.0, 6.0].into_iter()), [3.0, 2.0]);
    assert!(mean_and_median([f64::NAN].into_iter())[0].is_nan());
    let made = tables::delays(&item(), &runs, &["C4".to_owned()]);
    assert_eq!((column(&made, "nk_true")[0], column(&made, "nk_BJ")[0]), (29.0, 29.0));
}

#[test]
fn recorded_runs_may_differ_in_length_and_have_no_truth() {
    let mut runs = [run("anna", 3, 1.0), run("anna", 4, 2.0)];
    for run in &mut runs {
        run.outcome.truth = None;
        run.change_s = Some(41.92);
    }
    for course in &mut runs[0].outcome.traces {
        course.times_s.pop();
        course.states.pop();
        course.variances.pop();
    }
    let made = figures::draw(&item(), &runs, ("C4", Condition::C4), &OPERATOR);
    let svg = made.svg.as_ref().unwrap();
    assert!(
        svg.contains("anna") && !svg.contains("deg/deg"),
        "gains are in units of the recordings"
    );
    // K_e by RLS, where only the longer run contributes at the end, followed by K_e by OLS.
    assert_eq!(column(&made, "mean")[..3], [1.5, 1.5, 2.0]);
    let made = tables::delays(&item(), &runs, &["C4".to_owned()]);
    assert_eq!(
        (column(&made, "nk_ARX_first")[1], column(&made, "nk_BJ_last")[1]),
        (23.0, 30.0)
    );
    runs[0].outcome.batch[0][0].operator = [f64::NAN; 5];
    let made = tables::operators(&item(), &runs, &["C4".to_owned()]);
    // The rows are OLS, PEM, RLS and RPEM in both spans.
    assert_eq!(column(&made, "K_e"), [2.0, 1.5, 1.5, 1.5, 1.5, 2.0, 1.5, 2.0]);
    assert_eq!(column(&made, "determined")[..2], [0.5, 1.0]);
}

#[test]
fn figures_are_named_by_number_and_condition() {
    let names: Vec<String> = items().into_iter().map(|item| item.name).collect();
    for i in 1..=18 {
        assert!(names.contains(&format!("I.{i}")));
    }
    assert_eq!(names.len(), 21);
    let condition = |name: &str| ExperimentCondition {
        name: name.to_owned(),
        thesis_condition: Condition::C4,
    };
    assert_eq!(figure_name_and_title("I.10", "x", &condition("C4"), "p").0, "I.10");
    let (name, title) = figure_name_and_title("I.10", "x", &condition("C7 pitch"), "p");
    assert_eq!(name, "I.10-C7-pitch");
    assert!(title.contains("C7 pitch") && title.contains("C4"), "{title}");
}
