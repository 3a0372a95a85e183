//! The experiment of section VI with virtual people: prints the tables of `research/notes/virtual-experiment.md` and
//! writes its figures into a directory.
//!
//! `cargo run --release -p hoid-evidence --example experiment -- experiment > experiment.md`
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::path::Path;

use hoid_model::scenario::Condition;
use hoid_study::statistics::median;
use hoid_thesis::{
    experiment::{EXPERIMENT_PLAN, EvaluatedRun, ExperimentPlan, experiment, procedure::Truth},
    reproduction::{Studies, items},
};

/// Spans before the change and at the end, s.
const SPAN_BEFORE_S: (f64, f64) = (30.72, 40.96);
const SPAN_AFTER_S: (f64, f64) = (61.44, 81.93);

fn main() {
    let directory = std::env::args().nth(1).unwrap_or_else(|| "experiment".to_owned());
    std::fs::create_dir_all(&directory).unwrap();
    let is_own = |name: &str| name.starts_with("I.") || ["fig-13", "fig-14"].contains(&name);
    for item in items().iter().filter(|item| is_own(&item.name)) {
        let made = item.make(&Studies::new());
        std::fs::write(
            Path::new(&directory).join(format!("{}.svg", item.name)),
            made.svg.unwrap(),
        )
        .unwrap();
    }
    // Another plan can be given, such as one with another remnant.
    let text = std::env::args()
        .nth(2)
        .map(|path| std::fs::read_to_string(path).unwrap());
    let plan = ExperimentPlan::parse(text.as_deref().unwrap_or(EXPERIMENT_PLAN)).unwrap();
    let found = experiment(&plan, &|| (), &|| true);
    assert!(found.failed.is_empty(), "{:?}", found.failed);
    let runs = found.runs;
    println!("## Table 3\n\n| subject | | N1 | N2 | N3 | N4 | N5 |\n|---|---|---|---|---|---|---|");
    for subject in 1..=plan.subjects {
        let own = of(&runs, subject, Condition::C4);
        let row = |name: &str, value: &dyn Fn(&EvaluatedRun) -> String| {
            let cells: Vec<String> = own.iter().map(|run| value(run)).collect();
            println!("| {subject} | {name} | {} |", cells.join(" | "));
        };
        row("true n_k", &|run| truth(run).nk.to_string());
        row("ARX: n_k*", &|run| run.outcome.nk[0].to_string());
        row("BJ: n_k*", &|run| run.outcome.nk[1].to_string());
        row("BJ: T_n*, s", &|run| format!("{:.2}", run.outcome.t_n_s));
    }
    println!("\n## Before and after the change, C4\n");
    println!("| subject | | simulated | RLS | RPEM |\n|---|---|---|---|---|");
    for subject in 1..=plan.subjects {
        let own = of(&runs, subject, Condition::C4);
        let true_of = |i: usize, end: usize| mean(own.iter().map(|run| truth(run).states[end].operator[i]));
        let of_method = |method: usize, i: usize, span: (f64, f64)| {
            median(
                &own.iter()
                    .map(|run| mean_within(run, method, i, span))
                    .collect::<Vec<_>>(),
            )
        };
        let ratio = |a: f64, b: f64| format!("{:.2}", a / b);
        let simulated = ratio(true_of(2, 1), true_of(2, 0));
        let found = [0, 1].map(|m| ratio(of_method(m, 2, SPAN_AFTER_S), of_method(m, 2, SPAN_BEFORE_S)));
        println!(
            "| {subject} | K_ė after over before | {simulated} | {} | {} |",
            found[0], found[1]
        );
        let level = [0, 1].map(|m| format!("{:.1}", of_method(m, 3, SPAN_AFTER_S)));
        println!(
            "| {subject} | ω_nm, rad/s | {:.1} | {} | {} |",
            true_of(3, 1),
            level[0],
            level[1]
        );
        for (i, name) in [(1, "T_L"), (3, "ω_nm")] {
            let found = [0, 1].map(|m| {
                let all: Vec<f64> = own.iter().map(|run| fluctuation(run, m, i)).collect();
                format!("{:.0} %", 100.0 * median(&all))
            });
            println!(
                "| {subject} | fluctuation of {name} at the end | 0 | {} | {} |",
                found[0], found[1]
            );
        }
        let growth: Vec<f64> = own.iter().map(|run| variance_growth(run)).collect();
        println!(
            "| {subject} | variance of b0, after over before | | | {:.1} |",
            median(&growth)
        );
    }
    println!("\n## Errors, all conditions\n");
    println!("Median over subjects and runs of the error of the mean over the last 20.48 s, % (sign kept).\n");
    println!("| condition | method | K_e | T_L | K_ė | ω_nm | ζ_nm |\n|---|---|---|---|---|---|---|");
    for condition in ExperimentPlan::CONDITIONS {
        let own: Vec<&EvaluatedRun> = runs
            .iter()
            .filter(|run| run.key.condition == condition.to_string())
            .collect();
        for (method, name) in ["RLS", "RPEM"].into_iter().enumerate() {
            let cell = |i: usize| {
                let error = |run: &&EvaluatedRun| {
                    100.0 * (mean_within(run, method, i, SPAN_AFTER_S) / truth(run).states[1].operator[i] - 1.0)
                };
                let all: Vec<f64> = own.iter().map(error).filter(|x| x.is_finite()).collect();
                // Avoids -0.
                format!("{:.0}", median(&all).round() + 0.0)
            };
            let cells: Vec<String> = (0..5).map(cell).collect();
            println!("| {condition} | {name} | {} |", cells.join(" | "));
        }
    }
}

fn of(runs: &[EvaluatedRun], subject: u64, condition: Condition) -> Vec<&EvaluatedRun> {
    let (subject, condition) = (subject.to_string(), condition.to_string());
    runs.iter()
        .filter(|run| run.key.subject == subject && run.key.condition == condition)
        .collect()
}

fn truth(run: &EvaluatedRun) -> &Truth {
    run.outcome.truth.as_ref().unwrap()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let all: Vec<f64> = values.collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// Returns the values of an operator parameter within a span.
fn values_within(run: &EvaluatedRun, method: usize, i: usize, (from_s, to_s): (f64, f64)) -> Vec<f64> {
    let course = &run.outcome.traces[method];
    let all = course.times_s.iter().zip(&course.states);
    all.filter(|(t, _)| (from_s..to_s).contains(*t))
        .map(|(_, state)| state.operator[i])
        .filter(|value| value.is_finite())
        .collect()
}

fn mean_within(run: &EvaluatedRun, method: usize, i: usize, span_s: (f64, f64)) -> f64 {
    mean(values_within(run, method, i, span_s).into_iter())
}

/// Returns the standard deviation over time at the end, relative to the true value.
fn fluctuation(run: &EvaluatedRun, method: usize, i: usize) -> f64 {
    let values = values_within(run, method, i, SPAN_AFTER_S);
    let middle = mean(values.iter().copied());
    mean(values.iter().map(|value| (value - middle).powi(2))).sqrt() / truth(run).states[1].operator[i].abs()
}

fn variance_growth(run: &EvaluatedRun) -> f64 {
    let course = &run.outcome.traces[1];
    let of = |(from_s, to_s): (f64, f64)| {
        let all = course.times_s.iter().zip(&course.variances);
        mean(
            all.filter(|(t, _)| (from_s..to_s).contains(*t))
                .map(|(_, variances)| variances[2]),
        )
    };
    of(SPAN_AFTER_S) / of(SPAN_BEFORE_S)
}
