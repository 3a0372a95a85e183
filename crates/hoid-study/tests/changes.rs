//! Measures of a study for an operator with changing gains.
#![allow(clippy::unwrap_used)]

use hoid_study::{PLANS, Plan, Query, Results, RunOptions, run};

const PLAN_TEXT: &str = r#"
name = "changes"
seed = 5
replications = 2

[keep]
changes = true
standard_errors = false

[[scenarios]]
name = "back"
condition = "C4"
schedule.midpoint_s = 40.96
schedule.interval_s = 20.48
remnant.noise_level = 0.05

[[estimators]]
name = "RLS"
method = "rls"
orders.nk = 29
start_span_s = [0.0, 30.72]

[[estimators]]
name = "multiple-model"
method = "multiple-model"
orders.nk = 29
orders.nd = 6
start_span_s = [0.0, 30.72]
"#;

#[test]
fn alternating_changes_are_found_and_measured() {
    let directory = tempfile::tempdir().unwrap();
    let plan = Plan::parse(PLAN_TEXT, "changes.toml").unwrap();
    let finished = run(&plan, directory.path(), &RunOptions::default(), &|_| (), &|| true).unwrap();
    assert!(finished.finished);
    let results = Results::read(directory.path()).unwrap();
    let mean = |quantity: &str, name: &str| {
        let row = results.find_one(&Query::of(quantity).name(name)).unwrap();
        row.statistics.mean
    };
    // There are changes at 40.96 and 61.44 s; the change at 81.92 s is after the last sample.
    assert_eq!(mean("found", "multiple-model"), 100.0);
    assert!((0.4..3.0).contains(&mean("lag", "multiple-model")));
    // False alarms can occur in the 51.2 s after the start fit, except for 5 s after each change.
    assert!((mean("hours", "multiple-model") - 41.2 / 3600.0).abs() < 1e-6);
    for p in ["K_e", "T_L", "K_e_dot"] {
        let (all, through) = (
            mean(&format!("covered_{p}"), "multiple-model"),
            mean(&format!("covered_through_{p}"), "multiple-model"),
        );
        assert!(
            (50.0..=100.0).contains(&all) && (0.0..=100.0).contains(&through),
            "{p}: {all} {through}"
        );
        assert!(mean(&format!("before_{p}"), "multiple-model").abs() < 20.0);
    }
    // A recursion that declares nothing has neither hits nor false alarms.
    let silent = results.find_one(&Query::of("found").name("RLS"));
    assert!(silent.is_none_or(|row| row.statistics.count == 0));
}

#[test]
fn adaptation_plan_has_eleven_estimators() {
    let plan = PLANS
        .iter()
        .find(|plan| plan.name == "adaptation")
        .unwrap()
        .plan()
        .unwrap();
    // Two of the methods are also applied with a tracked delay.
    assert_eq!((plan.cells.len(), plan.estimators.len()), (133, 11));
}
