use super::*;
use crate::{RunOptions, run};

impl Results {
    /// Results of a plan without running it. `data` gives the relative error of what has a truth, else the value; traces step when the truth
    /// does, have the relative error of replication 0 in whole % and quartiles 1 % of the true value away.
    pub(crate) fn synthetic(plan: Plan, data: &dyn Fn(&Cell, &EstimatorCell, &str, u64) -> f64) -> Self {
        const WITH_TRUTH: [&str; 14] = [
            "a1",
            "a2",
            "f1",
            "f2",
            "b0",
            "b1",
            "K_e",
            "T_L",
            "K_e_dot",
            "omega_nm",
            "zeta_nm",
            "T_n_backward_euler",
            "K_n_backward_euler",
            "T_n",
        ];
        const OTHERS: [&str; 13] = [
            "K_n",
            "vaf",
            "response_error",
            "innovation_variance",
            "d1",
            "converged",
            "diverged",
            "noise_level_obtained",
            "rms_K_e",
            "rms_T_L",
            "rms_K_e_dot",
            "rms_omega_nm",
            "rms_zeta_nm",
        ];
        let mut results = Self::without_tables(plan);
        let mut fits: BTreeMap<String, Vec<f64>> = BTreeMap::new();
        fits.insert("share_not_convertible".to_owned(), Vec::new());
        let mut row = 0;
        for pair in &mut results.pairs {
            let (cell, estimator) = (&results.plan.cells[pair.cell], &results.plan.estimators[pair.estimator]);
            for replication in 0..cell.replications {
                for name in WITH_TRUTH.into_iter().chain(OTHERS).chain(["share_not_convertible"]) {
                    let truth = true_value(cell, estimator, name);
                    let found = data(cell, estimator, name, replication);
                    let value = if truth.is_finite() {
                        truth * (1.0 + found)
                    } else {
                        found
                    };
                    fits.entry(name.to_owned()).or_default().push(value);
                }
                pair.fits.push(row);
                row += 1;
            }
            let (Task::Track(_), Some(every)) = (&estimator.task, results.plan.trace_every) else {
                continue;
            };
            let scenario = cell.resolved.scenario();
            let change_s = scenario.schedule.change_s().unwrap_or(0.0);
            let step = every as f64 * scenario.sample_time.s();
            let times_s: Vec<f64> = (1..)
                .map(|k| f64::from(k) * step - 0.01)
                .take_while(|t| *t < scenario.measurement_s)
                .collect();
            let mut parameters = BTreeMap::new();
            for (i, name) in WITH_TRUTH[..11].iter().enumerate() {
                let of = |state: &crate::TrueState| match i {
                    0..2 => state.discrete[i],
                    2..6 => state.discrete[i - 2],
                    _ => state.operator[i - 6],
                };
                let [before, after] = cell.truth().map(|state| of(&state));
                let off = 1.0 + (100.0 * data(cell, estimator, name, 0)).round() / 100.0;
                let at = |factor: f64| -> Vec<f64> {
                    times_s
                        .iter()
                        .map(|t| factor * if *t < change_s { before } else { after })
                        .collect()
                };
                let bands = Bands {
                    mean: at(off),
                    sd: at(0.01),
                    lower_quartile: at(off - 0.01 * after.signum()),
                    median: at(off),
                    upper_quartile: at(off + 0.01 * after.signum()),
                };
                parameters.insert((*name).to_owned(), bands);
            }
            results.traces.insert(
                (cell.index, estimator.label.clone()),
                TraceSummary { times_s, parameters },
            );
        }
        results.fits = fits;
        results
    }
}

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
fn rows_are_found_by_what_describes_them() {
    let (_directory, results) = study(false);
    let arx = Query::of("bias_b0").name("ARX");
    assert_eq!(results.find(&arx).len(), 8);
    assert!(results.one(&arx).is_none());
    let one = arx.clone().remnant_order(2).noise_level(0.1).nk(29);
    let row = results.one(&one).unwrap();
    assert_eq!((row.cell, row.nd, row.nk, row.decimate), (3, Some(0), Some(29), 1));
    assert_eq!(
        (row.condition.as_str(), row.t_n_s, row.statistics.count),
        ("C1", 0.06, 6)
    );
    assert_eq!(row.axes["remnant_order"], "2");
    assert!(results.one(&one.clone().condition("C2")).is_none());
    assert!(results.one(&one.quantity_of("bias_nothing")).is_none());
    let rls = results.one(&Query::of("rms_K_e").axis("memory", "1s")).unwrap();
    assert_eq!(
        (rls.name.as_str(), rls.scenario.as_str(), rls.cell),
        ("RLS", "abrupt", 4)
    );
    let record = results.one(&Query::of("noise_level_obtained").cell(1)).unwrap();
    assert_eq!((record.nk, record.name.as_str()), (None, "record"));
    let cells = results.cells(&Query::default().name("ARX").noise_level(0.1));
    assert_eq!(cells.iter().map(|cell| cell.index).collect::<Vec<_>>(), [1, 3]);
    // All quantities, in the order of the table.
    let all = results.find(&Query::default().cell(4).axis("memory", "1s"));
    assert!(all.len() > 20 && all.iter().any(|row| row.quantity == "diverged"));
    assert_eq!(all[0].quantity, "innovation_variance");
}

#[test]
fn values_say_what_the_summary_says() {
    let (_directory, results) = study(false);
    for quantity in ["bias_b0", "b0", "vaf", "response_error", "bias_K_e"] {
        let query = Query::of(quantity).name("ARX").remnant_order(2).noise_level(0.1).nk(29);
        let values = results.values(&query);
        let statistics = Statistics::of(&values);
        let row = results.one(&query).unwrap();
        assert_eq!(values.len(), 6);
        // The same numbers, but for the order of additions.
        assert!(
            (statistics.median - row.statistics.median).abs() <= 1e-12 * row.statistics.median.abs(),
            "{quantity}"
        );
        assert_eq!(
            (statistics.count, statistics.missing),
            (row.statistics.count, row.statistics.missing)
        );
    }
    // One replication without remnant, which OLS returns exactly.
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
    assert!((mean - results.one(&rate).unwrap().statistics.mean).abs() < 1e-15);
    assert!(results.values(&Query::default()).is_empty());
    assert!(results.values(&Query::of("nothing")).is_empty());
}

#[test]
fn traces_are_read_by_cell_and_label() {
    let (_directory, results) = study(false);
    let label = &results
        .one(&Query::of("rms_K_e").axis("memory", "2.56s"))
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
fn csv_is_read_like_parquet() {
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
    let label = &csv.one(&Query::of("rms_K_e").axis("memory", "1s")).unwrap().estimator;
    assert_eq!(
        parquet.traces(4, label).unwrap().times_s,
        csv.traces(4, label).unwrap().times_s
    );
}

#[test]
fn what_is_no_finished_study_is_refused() {
    let empty = tempfile::tempdir().unwrap();
    assert!(matches!(Results::read(empty.path()), Err(StudyError::NoStudy { .. })));
    let plan = Plan::parse(PLAN_TEXT, "tiny.toml").unwrap();
    run(&plan, empty.path(), &RunOptions::default(), &|_| (), &|| false).unwrap();
    assert!(matches!(
        Results::read(empty.path()),
        Err(StudyError::Unfinished { .. })
    ));
    let (directory, _) = study(false);
    let path = directory.path().join(PLAN);
    let text = std::fs::read_to_string(&path).unwrap().replace("seed = 7", "seed = 8");
    std::fs::write(&path, text).unwrap();
    assert!(matches!(
        Results::read(directory.path()),
        Err(StudyError::OtherStudy { .. })
    ));
}
