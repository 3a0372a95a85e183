use super::*;
use crate::{Plan, Query, RunOptions, Statistics, StudyError, directory::PLAN_FILE, run};

const PLAN_TEXT: &str = r#"
name = "tiny"
seed = 7
replications = 6
block = 4

[keep]
trace_every = 64
standard_errors = false

[[scenarios]]
name = "constant"
condition = "C1"
measurement_s = 20.48
remnant.order = [1, 2]
remnant.noise_level = [0.0, 0.1]

[[scenarios]]
name = "abrupt"
condition = "C4"
remnant = { order = 2, noise_level = 0.1 }

[[estimators]]
name = "ARX"
method = "fit"
structure = "arx"
orders.nk = [28, 29]
scenarios = ["constant"]

[[estimators]]
name = "RLS"
method = "rls"
memory = ["1s", "2.56s"]
scenarios = ["abrupt"]

[[estimators]]
name = "record"
method = "record"
scenarios = ["constant"]
"#;

fn study(csv: bool) -> (tempfile::TempDir, Results) {
    let directory = tempfile::tempdir().unwrap();
    let plan = Plan::parse(PLAN_TEXT, "tiny.toml").unwrap();
    let options = RunOptions {
        csv,
        ..RunOptions::default()
    };
    assert!(
        run(&plan, directory.path(), &options, &|_| (), &|| true)
            .unwrap()
            .finished
    );
    let results = Results::read(directory.path()).unwrap();
    (directory, results)
}

#[test]
fn queries_find_their_rows() {
    let (_directory, results) = study(false);
    let arx = Query::of("bias_b0").name("ARX");
    assert_eq!(results.find(&arx).len(), 8);
    assert!(results.find_one(&arx).is_none());
    let one = arx.clone().remnant_order(2).noise_level(0.1).nk(29);
    let row = results.find_one(&one).unwrap();
    assert_eq!((row.cell, row.nd, row.nk, row.decimate), (3, Some(0), Some(29), 1));
    assert_eq!(
        (row.condition.as_str(), row.t_n_s, row.statistics.count),
        ("C1", 0.06, 6)
    );
    assert_eq!(row.axes["remnant_order"], "2");
    assert!(results.find_one(&one.clone().condition("C2")).is_none());
    assert!(results.find_one(&one.with_quantity("bias_nothing")).is_none());
    let rls = results.find_one(&Query::of("rms_K_e").axis("memory", "1s")).unwrap();
    assert_eq!(
        (rls.name.as_str(), rls.scenario.as_str(), rls.cell),
        ("RLS", "abrupt", 4)
    );
    let record = results.find_one(&Query::of("noise_level_obtained").cell(1)).unwrap();
    assert_eq!((record.nk, record.name.as_str()), (None, "record"));
    let cells = results.cells(&Query::default().name("ARX").noise_level(0.1));
    assert_eq!(cells.iter().map(|cell| cell.index).collect::<Vec<_>>(), [1, 3]);
    // The query selects all quantities, in the order of the table.
    let all = results.find(&Query::default().cell(4).axis("memory", "1s"));
    assert!(all.len() > 20 && all.iter().any(|row| row.quantity == "diverged"));
    assert_eq!(all[0].quantity, "innovation_variance");
}

#[test]
fn values_agree_with_the_summary() {
    let (_directory, results) = study(false);
    for quantity in ["bias_b0", "b0", "vaf", "response_error", "bias_K_e"] {
        let query = Query::of(quantity).name("ARX").remnant_order(2).noise_level(0.1).nk(29);
        let values = results.values(&query);
        let statistics = Statistics::of(&values);
        let row = results.find_one(&query).unwrap();
        assert_eq!(values.len(), 6);
        // The numbers are the same, except for the order of additions.
        assert!(
            (statistics.median - row.statistics.median).abs() <= 1e-12 * row.statistics.median.abs(),
            "{quantity}"
        );
        assert_eq!(
            (statistics.count, statistics.missing),
            (row.statistics.count, row.statistics.missing)
        );
    }
    // There is one replication without remnant, whose coefficients OLS determines exactly.
    let silent = results.values(&Query::of("bias_b0").name("ARX").noise_level(0.0).nk(29));
    assert!(
        silent.len() == 2 && silent.iter().all(|bias| bias.abs() < 1e-6),
        "{silent:?}"
    );
    let rate = Query::of("not_convertible")
        .name("ARX")
        .remnant_order(1)
        .noise_level(0.1)
        .nk(29);
    let mean = results.values(&rate).iter().sum::<f64>() / 6.0;
    assert!((mean - results.find_one(&rate).unwrap().statistics.mean).abs() < 1e-15);
    assert!(results.values(&Query::default()).is_empty());
    assert!(results.values(&Query::of("nothing")).is_empty());
}

#[test]
fn traces_are_read_by_cell_and_label() {
    let (_directory, results) = study(false);
    let label = &results
        .find_one(&Query::of("rms_K_e").axis("memory", "2.56s"))
        .unwrap()
        .estimator;
    let traces = results.traces(4, label).unwrap();
    assert_eq!(traces.times_s.len(), 128);
    let bands = &traces.parameters["b0"];
    assert_eq!(bands.median.len(), 128);
    let k = 100;
    assert!(
        bands.lower_quartile[k] <= bands.median[k] && bands.median[k] <= bands.upper_quartile[k] && bands.sd[k] > 0.0
    );
    assert!(results.traces(0, label).is_none());
}

#[test]
fn csv_results_match_parquet_results() {
    let (_one, parquet) = study(false);
    let (_other, csv) = study(true);
    for quantity in [
        "bias_b0",
        "vaf",
        "not_convertible",
        "noise_level_obtained",
        "rms_T_L",
        "diverged",
    ] {
        let query = Query::of(quantity);
        let medians = |results: &Results| -> Vec<String> {
            results
                .find(&query)
                .iter()
                .map(|row| format!("{} {:e}", row.estimator, row.statistics.median))
                .collect()
        };
        assert_eq!(medians(&parquet), medians(&csv), "{quantity}");
        assert!(!medians(&csv).is_empty());
        let bits = |results: &Results| results.values(&query).iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&parquet), bits(&csv), "{quantity}");
    }
    let label = &csv
        .find_one(&Query::of("rms_K_e").axis("memory", "1s"))
        .unwrap()
        .estimator;
    assert_eq!(
        parquet.traces(4, label).unwrap().times_s,
        csv.traces(4, label).unwrap().times_s
    );
}

#[test]
fn missing_and_unfinished_studies_are_refused() {
    let empty = tempfile::tempdir().unwrap();
    assert!(matches!(Results::read(empty.path()), Err(StudyError::NoStudy { .. })));
    let plan = Plan::parse(PLAN_TEXT, "tiny.toml").unwrap();
    run(&plan, empty.path(), &RunOptions::default(), &|_| (), &|| false).unwrap();
    assert!(matches!(
        Results::read(empty.path()),
        Err(StudyError::Unfinished { .. })
    ));
    let (directory, _) = study(false);
    let path = directory.path().join(PLAN_FILE);
    let text = std::fs::read_to_string(&path).unwrap().replace("seed = 7", "seed = 8");
    std::fs::write(&path, text).unwrap();
    assert!(matches!(
        Results::read(directory.path()),
        Err(StudyError::OtherStudy { .. })
    ));
}
