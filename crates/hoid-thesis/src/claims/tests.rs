use std::collections::BTreeSet;

use super::{settings::*, *};
use crate::plans::TEXT_PLANS;
use hoid_study::{
    Plan, Results, RunOptions,
    plan::{Cell, EstimatorCell},
    run,
};

/// Value of a replication of an estimator for a column: the relative error if there is a true
/// value, otherwise the value.
type SyntheticData = dyn Fn(&Cell, &EstimatorCell, &str, u64) -> f64;

const REPLICATIONS: u64 = 20;

fn synthetic_results(name: &str, data: &SyntheticData) -> Results {
    let plan = TEXT_PLANS.iter().find(|plan| plan.name == name).unwrap();
    let plan = Plan::parse(plan.text, name)
        .unwrap()
        .with_replications(REPLICATIONS)
        .unwrap();
    Results::synthetic(plan, data)
}

/// Small symmetric errors that differ slightly between columns.
fn small_error(column: &str, replication: u64) -> f64 {
    let phase = column.bytes().map(f64::from).sum::<f64>();
    1e-3 * (phase + 2.4 * replication as f64).sin()
}

fn verdict_of(id: &str, results: &[Results]) -> Verdict {
    let mut evidence = Evidence::new();
    results.iter().for_each(|results| evidence.add(results));
    claims()
        .iter()
        .find(|claim| claim.id == id)
        .unwrap()
        .evaluate(&evidence)
        .verdict
}

#[test]
fn claim_ids_are_unique_and_statements_short() {
    let all = claims();
    let ids: BTreeSet<&str> = all.iter().map(|claim| claim.id).collect();
    assert_eq!(ids.len(), all.len());
    assert!(all.len() >= 40);
    assert!(all.is_sorted_by_key(|claim| claim.theme));
    for claim in &all {
        assert!(claim.statement.len() <= 200, "{}: {}", claim.id, claim.statement.len());
        assert!(!claim.reference.is_empty() && !claim.measure.is_empty(), "{}", claim.id);
        assert!(
            claim
                .plans
                .iter()
                .all(|name| TEXT_PLANS.iter().any(|plan| plan.name == *name)),
            "{}",
            claim.id
        );
    }
}

/// A query that selects nothing, or several estimators, would give a reason but no parts.
#[test]
fn each_claim_finds_its_cells_in_its_plans() {
    let data: &SyntheticData = &|_, _, column, replication| 0.01 + small_error(column, replication);
    let all: Vec<Results> = TEXT_PLANS
        .iter()
        .map(|plan| synthetic_results(plan.name, data))
        .collect();
    for claim in claims().iter().filter(|claim| !claim.plans.is_empty()) {
        let mut evidence = Evidence::new();
        all.iter()
            .filter(|results| claim.plans.contains(&results.plan.name.as_str()))
            .for_each(|results| evidence.add(results));
        let finding = claim.evaluate(&evidence);
        assert!(!finding.parts.is_empty(), "{}: {}", claim.id, finding.verdict);
        assert!(finding.parts.iter().all(|part| !part.tests.is_empty()), "{}", claim.id);
        assert!(!finding.measured_numbers.is_empty() && !finding.text.is_empty());
        let without = claim.evaluate(&Evidence::new());
        assert!(
            matches!(&without.verdict, Verdict::CannotBeTested(reason) if reason.contains("was not run")),
            "{}",
            claim.id
        );
        assert_eq!((without.cell_count, without.measured_numbers.len()), (0, 0));
    }
}

#[test]
fn verdicts_depend_on_the_data() {
    let with_arx_bias = |of_b: f64| {
        synthetic_results("bias", &move |_, estimator, column, replication| {
            let is_b = estimator.name == "ARX" && column.starts_with('b');
            if is_b {
                of_b + small_error(column, replication)
            } else {
                small_error(column, replication)
            }
        })
    };
    assert_eq!(verdict_of("arx-b-around-50", &[with_arx_bias(-0.5)]), Verdict::Holds);
    assert_eq!(
        verdict_of("arx-b-around-50", &[with_arx_bias(2.0)]),
        Verdict::DoesNotHold
    );
    let with_bj_bias = |of_fourth: f64| {
        synthetic_results("bias", &move |cell, estimator, column, replication| {
            let fourth =
                estimator.name == "BJ" && cell.resolved.scenario().remnant.order == 4 && column.starts_with('b');
            if fourth {
                of_fourth + small_error(column, replication)
            } else {
                small_error(column, replication)
            }
        })
    };
    assert_eq!(
        verdict_of("bj-same-for-all-orders", &[with_bj_bias(0.01)]),
        Verdict::Holds
    );
    assert_eq!(
        verdict_of("bj-same-for-all-orders", &[with_bj_bias(0.2)]),
        Verdict::HoldsInPart
    );
    let with_level = |off: f64| {
        synthetic_results("noise-level", &move |cell, _, column, replication| match cell
            .resolved
            .scenario()
            .remnant
            .strength
        {
            hoid_model::scenario::RemnantStrength::Level { level, .. } => {
                level + off + small_error(column, replication)
            }
            hoid_model::scenario::RemnantStrength::Gain { .. } => f64::NAN,
        })
    };
    assert_eq!(verdict_of("noise-level-mean", &[with_level(0.01)]), Verdict::Holds);
    assert_eq!(
        verdict_of("noise-level-mean", &[with_level(-0.03)]),
        Verdict::DoesNotHold
    );
    let nothing = synthetic_results("noise-level", &|_, _, _, _| f64::NAN);
    assert!(matches!(
        verdict_of("noise-level-mean", &[nothing]),
        Verdict::CannotBeTested(_)
    ));
}

#[test]
fn traces_give_bias_and_settling() {
    // RPEM has an error of 3 %, and RLS has an error of 40 % if the remnant is of first order.
    let results = synthetic_results("recursive", &|cell, estimator, column, replication| {
        let off = match (estimator.name.as_str(), cell.resolved.scenario().remnant.order) {
            ("RLS", 1) => 0.4,
            _ => 0.03,
        };
        off + small_error(column, replication)
    });
    assert_eq!(
        verdict_of("rls-large-at-m1", std::slice::from_ref(&results)),
        Verdict::Holds
    );
    let mut evidence = Evidence::new();
    evidence.add(&results);
    let study = evidence.study("recursive").unwrap();
    let at = Setting {
        condition: "C4",
        m0: 1,
        level: 0.1,
    };
    let bias = study.trace_bias(&at.rls(""), "b0").unwrap();
    assert!((bias.value - 40.0).abs() < 1e-9 && bias.error > 0.0, "{bias:?}");
    // Synthetic traces step instantly.
    let settled = study.settling(&at.rpem(""), "K_e_dot").unwrap();
    assert!(settled.value <= 0.32 && settled.error >= 0.16 - 1e-9, "{settled:?}");
    assert!(
        study
            .settling(&Setting { condition: "C1", ..at }.rpem(""), "K_e_dot")
            .is_err()
    );
    assert!(study.trace_bias(&at.rpem(""), "no_parameter").is_err());
    assert!(study.sample(&at.rls("rms_K_e").nk(30)).is_err());
    assert!(study.sample(&at.rls("rms_nothing")).is_err());
    assert!(study.sample(&at.query("rms_K_e")).is_err());
}

#[test]
fn missing_cells_give_no_evidence() {
    let text = r#"
name = "bias"
replications = 3
[[scenarios]]
condition = "C1"
measurement_s = 20.48
remnant = { order = 2, noise_level = 0.1 }
[[estimators]]
name = "ARX"
method = "fit"
structure = "arx"
orders.nk = 29
"#;
    let directory = tempfile::tempdir().unwrap();
    let plan = Plan::parse(text, "bias.toml").unwrap();
    run(&plan, directory.path(), &RunOptions::default(), &|_| (), &|| true).unwrap();
    let results = Results::read(directory.path()).unwrap();
    let mut evidence = Evidence::new();
    evidence.add(&results);
    let findings = findings(&evidence);
    for (claim, finding) in &findings {
        let Verdict::CannotBeTested(reason) = &finding.verdict else {
            panic!("{}: {}", claim.id, finding.verdict);
        };
        let of_bias = claim.plans.contains(&"bias");
        assert!(
            !of_bias || reason.contains("the study bias has"),
            "{}: {reason}",
            claim.id
        );
    }
    let table = claims_table(&findings);
    let path = directory.path().join("claims.csv");
    hoid_io::write_table(&path, &table).unwrap();
    let back = hoid_io::read_table(&path).unwrap();
    assert_eq!(back.columns.len(), table.columns.len());
    assert_eq!(back.column("id"), table.column("id"));
}
