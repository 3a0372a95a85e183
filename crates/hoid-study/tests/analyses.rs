//! Estimators of a study that run as in `hoid identify` and give a verdict: the operator of a person, an operator with
//! changing gains, and instrumental variables.
#![allow(clippy::unwrap_used)]

use hoid_analysis::{Identification, IdentifiedModel, Polynomials, Recordings};
use hoid_ident::{
    IvMethod, SigmoidChange,
    family::{FamilyEstimator, OperatorPrior},
};
use hoid_io::{ColumnValues, OutputTable, read_table};
use hoid_model::{
    NamedChoice, Record, Structure, Verdict,
    remnant_gain::NoiseDefinition,
    scenario::{Condition, RemnantStrength, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_study::{Plan, Query, Results, RunOptions, run};

const PLAN_TEXT: &str = r#"
name = "people"
seed = 3
replications = 2

[[scenarios]]
name = "steady"
condition = "C1"
remnant.noise_level = 0.1

[[scenarios]]
name = "change"
condition = "C4"
remnant.noise_level = 0.1

[[estimators]]
name = "operator"
method = "operator"

[[estimators]]
name = "lead"
method = "operator"
form = "lead"
orders = { nc = "0..1", nd = "true" }
delay_s = [0.1, 0.5]
excitation = "none"

[[estimators]]
name = "change"
method = "operator"
change = "sigmoid"
scenarios = ["change"]

[[estimators]]
name = "SRIV"
method = "sriv"
"#;

/// Runs the study of a plan in a directory; returns the directory and the table of fits.
fn fits(text: &str) -> (tempfile::TempDir, OutputTable) {
    let directory = tempfile::tempdir().unwrap();
    let plan = Plan::parse(text, "people.toml").unwrap();
    let outcome = run(&plan, directory.path(), &RunOptions::default(), &|_| (), &|| true).unwrap();
    assert!(outcome.finished);
    let fits = read_table(&directory.path().join("fits.parquet")).unwrap();
    (directory, fits)
}

fn real(table: &OutputTable, column: &str, row: usize) -> f64 {
    match table.column(column) {
        Some(ColumnValues::Real(values)) => values[row],
        other => panic!("{column}: {other:?}"),
    }
}

fn text<'a>(table: &'a OutputTable, column: &str, row: usize) -> &'a str {
    match table.column(column) {
        Some(ColumnValues::Text(values)) => &values[row],
        other => panic!("{column}: {other:?}"),
    }
}

fn row_count(table: &OutputTable) -> usize {
    match table.column("name") {
        Some(ColumnValues::Text(values)) => values.len(),
        other => panic!("{other:?}"),
    }
}

/// Returns the row of an estimator for the first replication of a scenario.
fn row(table: &OutputTable, scenario: &str, name: &str) -> usize {
    let is = |row: &usize| text(table, "scenario", *row) == scenario && text(table, "name", *row) == name;
    (0..row_count(table)).find(is).unwrap()
}

fn record(condition: Condition, cell: u64) -> Record {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.strength = RemnantStrength::Level {
        level: 0.1,
        definition: NoiseDefinition::Response,
    };
    let seed = RunSeed {
        seed: 3,
        cell,
        replication: 0,
    };
    Simulator::new(&scenario).unwrap().run(seed, false).unwrap()
}

fn assert_verdict(table: &OutputTable, row: usize, verdict: &Verdict) {
    assert_eq!(text(table, "status", row), "ok");
    assert_eq!(text(table, "verdict", row), verdict.level.choice_name());
    let against = verdict
        .findings()
        .iter()
        .filter(|f| f.severity > hoid_model::Severity::Note);
    let kinds: Vec<&str> = against.map(|f| f.kind).collect();
    assert_eq!(text(table, "findings", row), kinds.join(", "));
}

fn assert_operator(table: &OutputTable, row: usize, found: &IdentifiedModel) {
    assert_verdict(table, row, &found.verdict);
    assert_eq!(text(table, "form", row), found.fit.form.name());
    assert_eq!(real(table, "nd", row), found.fit.noise_orders.1 as f64);
    for p in &found.fit.operator(0).parameters {
        assert_eq!(real(table, &p.name, row), p.value, "{}", p.name);
        assert_eq!(
            real(table, &format!("{}_se", p.name), row),
            p.standard_error.unwrap(),
            "{}",
            p.name
        );
    }
}

/// Each row is bit-identical to the result of analysing that run with the options of the plan.
#[test]
fn rows_match_single_run_analyses() {
    let (directory, fits) = fits(PLAN_TEXT);
    let steady = || Recordings::from_records([record(Condition::C1, 0)]);
    let changed = || Recordings::from_records([record(Condition::C4, 1)]);
    let operator = FamilyEstimator {
        prior: OperatorPrior::none(),
        ..FamilyEstimator::default()
    };
    let found = Identification::of(operator.clone()).run(steady()).unwrap();
    assert_operator(&fits, row(&fits, "steady", "operator"), &found);

    let lead = Identification {
        excitation: hoid_analysis::Excitation::Nothing,
        ..Identification::of(FamilyEstimator {
            forms: vec![hoid_model::Form::Lead],
            nc: 0..=1,
            nd: Some(1..=1),
            delay_range_s: (0.1, 0.5),
            ..operator
        })
    };
    assert_operator(&fits, row(&fits, "change", "lead"), &lead.run(changed()).unwrap());

    let found = Identification::of(SigmoidChange::default()).run(changed()).unwrap();
    let at = row(&fits, "change", "change");
    assert_verdict(&fits, at, &found.verdict);
    for p in found.fit.parameters() {
        assert_eq!(real(&fits, &p.name, at), p.estimate.value, "{}", p.name);
    }
    assert_eq!(
        real(&fits, "K_e_dot2", at),
        found.fit.last_operator().get("K_e_dot").unwrap().value
    );
    assert_eq!(real(&fits, "change_found", at), 1.0);

    let sriv = Polynomials {
        orders: [("nk".to_owned(), 29..=29)].into(),
        method: Some(IvMethod::Sriv),
        ..Polynomials::new(Structure::OutputError)
    };
    let found = Identification::of(sriv).run(steady()).unwrap();
    let at = row(&fits, "steady", "SRIV");
    assert_verdict(&fits, at, &found.verdict);
    for (name, estimate) in found.fit.fit.parameters() {
        assert_eq!(real(&fits, &name, at), estimate.value, "{name}");
    }

    // The summary counts the verdicts, and errors are relative to the simulated scenario.
    let results = Results::read(directory.path()).unwrap();
    let one = |quantity: &str, scenario: &str, name: &str| {
        let query = Query::of(quantity).scenario(scenario).name(name);
        results.find_one(&query).unwrap().statistics.mean
    };
    for (scenario, name) in [("steady", "operator"), ("change", "change"), ("steady", "SRIV")] {
        let levels = ["trustworthy", "doubtful", "not_determined"].map(|level| one(level, scenario, name));
        assert!((levels.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{name}: {levels:?}");
    }
    // No operator with changing gains is identified as a constant operator with a trustworthy verdict.
    assert_eq!(one("trustworthy", "change", "lead"), 0.0);
    assert!(one("bias_t_M", "change", "change").abs() < 2.0);
    assert!(one("bias_K_e2", "change", "change").abs() < 30.0);
}

/// The lead of a form with a lag is not an estimate of the simulated lead.
#[test]
fn bias_is_not_computed_for_lead_of_another_form() {
    let text = PLAN_TEXT.replace("form = \"lead\"", "form = \"lead-lag\"");
    let (directory, fits) = fits(&text);
    let at = row(&fits, "steady", "lead");
    assert!(real(&fits, "T_L", at).is_finite() && real(&fits, "K_over_T_I", at).is_finite());
    let results = Results::read(directory.path()).unwrap();
    let of = |quantity: &str| results.find_one(&Query::of(quantity).scenario("steady").name("lead"));
    assert!(of("bias_T_L").is_none());
    assert!(of("bias_K").unwrap().statistics.mean.abs() < 30.0);
}

/// A failed fit is a row with its reason, and has no verdict.
#[test]
fn failed_fits_are_rows_with_a_reason() {
    let text = PLAN_TEXT.replace("method = ", "span_s = [0.0, 0.05]\nmethod = ");
    let (directory, fits) = fits(&text);
    assert_eq!(row_count(&fits), 2 * (3 + 4));
    for row in 0..row_count(&fits) {
        let name = row_text(&fits, row);
        assert_eq!(self::text(&fits, "status", row), "failed", "{name}");
        assert!(!self::text(&fits, "reason", row).is_empty(), "{name}");
        assert_eq!(self::text(&fits, "verdict", row), "", "{name}");
        assert!(real(&fits, "K_e", row).is_nan(), "{name}");
    }
    let results = Results::read(directory.path()).unwrap();
    let of = |quantity: &str| results.find_one(&Query::of(quantity).scenario("steady").name("operator"));
    assert_eq!(of("failed").unwrap().statistics.mean, 1.0);
    assert_eq!(of("trustworthy").unwrap().statistics.mean, 0.0);
}

fn row_text(table: &OutputTable, row: usize) -> String {
    format!("{} {}", text(table, "scenario", row), text(table, "name", row))
}
