//! Runs of a survey, and the results of each method.

use std::time::Instant;

use hoid_model::{PolynomialModel, Record};
use hoid_sim::{RunSeed, Simulator};
use hoid_study::plan::{Cell, EstimatorCell, Task as StudyTask};
use hoid_track::{Trace, track};
use num_complex::Complex64;
use rayon::prelude::*;

use super::{
    measure::{Errors, LINE_INDICES, errors},
    plan::SurveyPlan,
};
use crate::{
    ThesisError,
    comparators::{Task, TrackingResult},
};

/// Number of samples between stored estimates.
const STORED_SAMPLE_INTERVAL: usize = 32;
/// Number of the first replication used as a validation set; it is larger than the number of any evaluated run.
const VALIDATION_REPLICATION: u64 = 1 << 40;

/// Errors of one method over the runs of one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodErrors {
    /// Number of the cell.
    pub cell: u64,
    /// Name of the method in the plan.
    pub name: String,
    /// Information that the method needs in addition to e, u and the delay; empty if there is none.
    pub extra_information: &'static str,
    /// Errors in each run, or the reason why the method failed.
    pub runs: Vec<Result<Errors, String>>,
    /// Median elapsed time for one run, s.
    pub seconds: f64,
}

/// Applies all methods of a plan to all its runs. The results are ordered by cell; in each cell the estimators precede
/// the comparators. `each` is called after every run.
///
/// # Errors
/// [`ThesisError`] if a scenario cannot be simulated. If a method fails on a run, the reason is part of its results.
pub fn survey(plan: &SurveyPlan, each: &(dyn Fn(&str) + Sync)) -> Result<Vec<MethodErrors>, ThesisError> {
    let mut all = Vec::new();
    for cell in &plan.study.cells {
        let simulator = Simulator::new(cell.resolved.scenario())?;
        let one = |replication: u64| {
            let run = |replication: u64| {
                let seed = RunSeed {
                    seed: plan.study.seed,
                    cell: cell.index,
                    replication,
                };
                simulator.run(seed, false)
            };
            let found = method_results(
                plan,
                cell,
                &run(replication)?,
                &run(VALIDATION_REPLICATION + replication)?,
            );
            each(&format!("cell {}, run {replication}", cell.index));
            Ok::<_, ThesisError>(found)
        };
        let runs: Vec<Vec<MethodResult>> = (0..cell.replications)
            .into_par_iter()
            .map(one)
            .collect::<Result<_, _>>()?;
        for (i, first) in runs[0].iter().enumerate() {
            let mut seconds: Vec<f64> = runs.iter().map(|run| run[i].seconds).collect();
            seconds.sort_by(f64::total_cmp);
            all.push(MethodErrors {
                cell: cell.index,
                name: first.name.clone(),
                extra_information: first.extra_information,
                runs: runs.iter().map(|run| run[i].errors.clone()).collect(),
                seconds: seconds[seconds.len() / 2],
            });
        }
    }
    Ok(all)
}

/// Result of one method in one run.
struct MethodResult {
    name: String,
    extra_information: &'static str,
    errors: Result<Errors, String>,
    seconds: f64,
}

fn method_results(plan: &SurveyPlan, cell: &Cell, record: &Record, validation: &Record) -> Vec<MethodResult> {
    let scenario = cell.resolved.scenario();
    let lines: Vec<f64> = scenario.forcing.sinusoids().iter().map(|s| s.omega_rad_s).collect();
    let omega = &lines[LINE_INDICES.start.min(lines.len())..LINE_INDICES.end.min(lines.len())];
    let at: Vec<usize> = (STORED_SAMPLE_INTERVAL - 1..record.len())
        .step_by(STORED_SAMPLE_INTERVAL)
        .collect();
    let task = Task {
        record,
        requested_samples: &at,
        lines_rad_s: &lines,
        omega_rad_s: omega,
        start_s: (0.0, 0.375 * scenario.measurement_s),
        nk: (scenario.initial.operator.tau_e_s / scenario.sample_time.s()).round() as usize + 1,
        validation: Some(validation),
        change: scenario.schedule.change_s().zip(scenario.schedule.rate_per_s()),
    };
    let measured =
        |name: &str, extra_information: &'static str, follow: &dyn Fn() -> Result<TrackingResult, ThesisError>| {
            let start_time = Instant::now();
            let followed = follow();
            let seconds = start_time.elapsed().as_secs_f64();
            let errors = followed.and_then(|found| errors(record, &at, omega, &found));
            MethodResult {
                name: name.to_owned(),
                extra_information,
                errors: errors.map_err(|error| error.to_string()),
                seconds,
            }
        };
    let estimators = plan.study.estimators_of(cell).map(|(_, estimator)| {
        let follow = || estimator_result(estimator, cell, &task);
        measured(&estimator.label, "", &follow)
    });
    let comparators = plan.comparators.iter().map(|(name, of)| {
        let follow = || of.track(&task);
        measured(name, of.description().extra_information, &follow)
    });
    estimators.chain(comparators).collect()
}

/// Returns the result of an estimator of a study. A recursive method gives an estimate at each time, a batch fit the
/// same estimate at all times.
fn estimator_result(estimator: &EstimatorCell, cell: &Cell, task: &Task<'_>) -> Result<TrackingResult, ThesisError> {
    match estimator.task_for(&cell.resolved) {
        StudyTask::Track(options) => trace_result(&track(task.record, &options, STORED_SAMPLE_INTERVAL)?, task),
        StudyTask::Fit(options) => {
            let (from_s, to_s) = estimator.span_s.unwrap_or((task.record.time_s(0), f64::INFINITY));
            let span = task
                .record
                .span(from_s, to_s.min(task.record.time_s(task.record.len())))?;
            let fit = options.fit(std::slice::from_ref(&span))?;
            let operator = fit.operator().ok().map(|found| found.parameters());
            let response = responses(fit.model(), task.omega_rad_s);
            Ok(TrackingResult {
                response: vec![response; task.requested_samples.len()],
                operator: vec![operator; task.requested_samples.len()],
            })
        }
        StudyTask::Describe | StudyTask::GreyBox(_) | StudyTask::Analysis(_) => Err(ThesisError::Unsuited {
            method: "a survey",
            quantity: "an estimator".to_owned(),
            found: estimator.method().to_owned(),
            expected: "a recursive method or \"fit\"".to_owned(),
        }),
    }
}

fn trace_result(trace: &Trace, task: &Task<'_>) -> Result<TrackingResult, ThesisError> {
    let (options, mut found) = (trace.options(), TrackingResult::default());
    for row in 0..task.requested_samples.len().min(trace.len()) {
        let theta = trace.theta(row).to_vec();
        let model = PolynomialModel::new(options.structure, options.orders, trace.sample_time(), theta)?;
        found.response.push(responses(&model, task.omega_rad_s));
        found
            .operator
            .push(trace.operator_values(row).ok().map(|of| of.parameters()));
    }
    Ok(found)
}

fn responses(model: &PolynomialModel, omega_rad_s: &[f64]) -> Vec<Complex64> {
    omega_rad_s.iter().map(|omega| model.response(*omega)).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const SMALL_PLAN: &str = r#"
name = "small"
seed = 5
replications = 2
[[scenarios]]
condition = "C4"
remnant = { order = 1, noise_level = 0.01 }
[[estimators]]
name = "RLS"
method = "rls"
orders.nk = 29
[[estimators]]
name = "BJ"
method = "fit"
structure = "bj"
orders.nk = 29
span_s = [51.2, 81.92]
[[estimators]]
name = "network"
method = "linear-network"
orders.nk = 29
"#;
    const FOURIER_COMPARATOR: &str = r#"
[[comparators]]
name = "lines"
method = "fourier"
"#;

    #[test]
    fn estimators_and_comparators_share_the_runs() {
        let plan = SurveyPlan::parse(SMALL_PLAN, FOURIER_COMPARATOR, "small.toml").unwrap();
        let found = survey(&plan, &|_| ()).unwrap();
        let names: Vec<&str> = found.iter().map(|of| of.name.as_str()).collect();
        assert_eq!(names, ["RLS", "BJ", "network", "lines"]);
        let of = |name: &str, run: usize| {
            let own = found.iter().find(|of| of.name == name).unwrap();
            own.runs[run].clone().unwrap()
        };
        for run in 0..2 {
            // The batch fit to the last 30.72 s is accurate after the change, but wrong before it.
            let [before, _, after] = of("BJ", run).response;
            assert!(after < 10.0 && before > 30.0, "{before} {after}");
            // Fourier coefficients give no parameters.
            assert!(of("lines", run).operator[0].is_nan() && of("lines", run).response[0] < 60.0);
        }
        // The runs differ from each other, but the same plan gives the same numbers.
        assert_ne!(of("network", 0), of("network", 1));
        let again = survey(&plan, &|_| ()).unwrap();
        assert_eq!(again[2].runs, found[2].runs);
    }
}
