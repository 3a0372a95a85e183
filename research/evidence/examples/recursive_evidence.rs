//! The numbers of recursive identification in `research/notes/evidence-tables.md` that take too long
//! for a test.
//!
//! `cargo run --release -p hoid-evidence --example recursive_evidence -- table|divergence [RUNS]`
//!
//! `cargo run --release -p hoid-evidence --example recursive_evidence -- endurance [SAMPLES]`
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::collections::BTreeMap;

use hoid::{
    model::{
        remnant_gain::NoiseDefinition,
        scenario::{Realisation, RemnantStrength},
    },
    prelude::*,
    track::{Method, StartSource, Trace, TrackOptions, Tracker, track},
};
use rayon::prelude::*;

const NK: usize = 29;
const COLUMNS: [&str; 5] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let runs = arguments.get(1).map(|n| n.parse().unwrap());
    match arguments.first().map(String::as_str) {
        Some("table") => print_errors(runs.unwrap_or(30)),
        Some("divergence") => print_divergence(runs.unwrap_or(100)),
        Some("endurance") => print_endurance(runs.unwrap_or(100_000_000)),
        _ => println!("table or divergence and a number of runs, endurance and a number of samples"),
    }
}

fn simulator(condition: Condition, remnant_order: usize, noise_level: f64) -> Simulator {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.order = remnant_order;
    scenario.remnant.strength = RemnantStrength::Level {
        level: noise_level,
        definition: NoiseDefinition::Response,
    };
    scenario.realisation = Realisation::Output;
    Simulator::new(&scenario).unwrap()
}

fn run(simulator: &Simulator, cell: u64, replication: u64) -> Record {
    let run_seed = RunSeed {
        seed: 3000,
        cell,
        replication,
    };
    simulator.run(run_seed, false).unwrap()
}

/// Returns the results of the runs in order, computed on all cores.
fn on_all_cores<T: Send>(runs: usize, one: impl Fn(u64) -> T + Sync) -> Vec<T> {
    (0..runs).into_par_iter().map(|r| one(r as u64)).collect()
}

fn options(method: Method) -> TrackOptions {
    let structure = method.default_structure();
    TrackOptions {
        start: StartSource::Span(Some((0.0, 30.72))),
        ..TrackOptions::new(method, structure, structure.operator_orders(NK))
    }
}

/// Returns RLS or RPEM with the settings of the thesis.
fn thesis_settings(method: Method) -> TrackOptions {
    let mut settings = vec![("memory", "256"), ("covariance", "0.1"), ("limit", "inf")];
    settings.extend((method != Method::rls()).then_some(("stable", "noise")));
    options(method.clone()).with(&settings).unwrap()
}

/// Returns the RMS of the relative error over t in [10, 81.92] s in percent, and the share of rows that can be
/// converted.
fn relative_errors(trace: &Trace, record: &Record) -> ([f64; 5], f64) {
    let truth = COLUMNS.map(|c| record.channel(c).unwrap());
    let (mut sums, mut rows, mut all) = ([0.0; 5], 0, 0);
    for (k, t) in trace.times_s().iter().enumerate() {
        if *t < 10.0 - 1e-9 {
            continue;
        }
        all += 1;
        let Ok(o) = trace.operator(k) else { continue };
        rows += 1;
        for (i, (_, _, estimate)) in o.rows()[..5].iter().enumerate() {
            let true_value = truth[i][k];
            sums[i] += ((estimate.value - true_value) / true_value).powi(2);
        }
    }
    (
        sums.map(|s| 100.0 * (s / f64::from(rows)).sqrt()),
        f64::from(rows) / f64::from(all),
    )
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Returns the standard error of the median of sorted values, from the order statistics one binomial standard deviation
/// to each side.
fn error_of_median(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    let away = (0.5 * (n as f64).sqrt()).round() as usize;
    let middle = n / 2;
    (sorted[(middle + away).min(n - 1)] - sorted[middle.saturating_sub(away)]) / 2.0
}

/// Returns the time after the change at 40.96 s at which the median trace has covered 90 % of the step from .036 to
/// .084 s.
fn settling_time_s(traces: &[&[f64]]) -> f64 {
    for k in 4096..traces[0].len() {
        let mut values: Vec<f64> = traces.iter().map(|t| t[k]).filter(|v| v.is_finite()).collect();
        if !values.is_empty() && median(&mut values) > 0.036 + 0.9 * (0.084 - 0.036) {
            return (k - 4096) as f64 * 0.01;
        }
    }
    f64::INFINITY
}

fn print_errors(runs: usize) {
    println!("C4, RMS relative error in %, K_e / T_L / K_e_dot / omega_nm / zeta_nm, median of {runs} runs");
    let cells = [
        (1, 0.01),
        (1, 0.1),
        (1, 0.2),
        (2, 0.1),
        (2, 0.2),
        (3, 0.1),
        (3, 0.2),
        (4, 0.1),
        (4, 0.2),
    ];
    // Effect of the order of the filters of the gradient.
    let cascade = thesis_settings(Method::rpem())
        .with(&[("regressor", "cascade")])
        .unwrap();
    let methods: [(&str, TrackOptions); 5] = [
        ("RLS, text", thesis_settings(Method::rls())),
        ("RPEM, text", thesis_settings(Method::rpem())),
        ("cascade", cascade),
        ("RPEM", options(Method::rpem())),
        ("physical", options(hoid_survey::physical())),
    ];
    for (cell, (m, level)) in cells.into_iter().enumerate() {
        let simulator = simulator(Condition::C4, m, level);
        for (name, options) in &methods {
            let found = on_all_cores(runs, |r| {
                let record = run(&simulator, cell as u64, r);
                let trace = track(&record, options, 1).unwrap();
                let k_e_dot: Vec<f64> = (0..trace.len())
                    .map(|k| trace.operator(k).map_or(f64::NAN, |o| o.k_e_dot.value))
                    .collect();
                (relative_errors(&trace, &record), k_e_dot)
            });
            let settled = settling_time_s(&found.iter().map(|(_, k)| k.as_slice()).collect::<Vec<_>>());
            let found: Vec<([f64; 5], f64)> = found.into_iter().map(|(e, _)| e).collect();
            let medians: Vec<String> = (0..5)
                .map(|i| {
                    let mut values: Vec<f64> = found.iter().map(|(e, _)| e[i]).collect();
                    format!("{:6.1} ({:.1})", median(&mut values), error_of_median(&values))
                })
                .collect();
            let convert = found.iter().map(|(_, c)| c).sum::<f64>() / found.len() as f64;
            println!(
                "m0={m} P_n={level:4}  {name:10} {}   converts {convert:.3}, 90 % of the step of K_e_dot in {settled:.1} s",
                medians.join(" /"),
            );
        }
    }
}

fn print_divergence(runs: usize) {
    let mut diverged: BTreeMap<&str, usize> = BTreeMap::new();
    let mut total = 0;
    for (c, condition) in Condition::ALL.into_iter().enumerate() {
        for m in 1..=4 {
            for (l, level) in [0.01, 0.1, 0.2].into_iter().enumerate() {
                let simulator = simulator(condition, m, level);
                let cell = 100 + (c * 12 + (m - 1) * 3 + l) as u64;
                total += runs;
                let found = on_all_cores(runs, |r| {
                    let record = run(&simulator, cell, r);
                    let diverges = |method: Method| {
                        let trace = track(&record, &options(method.clone()), 1);
                        trace.map_or(true, |trace| {
                            let bad = |v: &f64| !v.is_finite() || v.abs() > 10.0;
                            (0..trace.len()).any(|k| trace.theta(k).iter().any(bad))
                        })
                    };
                    hoid_survey::methods().into_iter().map(diverges).collect::<Vec<bool>>()
                });
                for (i, method) in hoid_survey::methods().into_iter().enumerate() {
                    let n = found.iter().filter(|f| f[i]).count();
                    *diverged.entry(method.name()).or_default() += n;
                    if n > 0 {
                        println!(
                            "{condition:?} m0={m} P_n={level}: {} diverged in {n} of {runs}",
                            method.name()
                        );
                    }
                }
            }
        }
    }
    println!("of {total} runs diverged: {diverged:?}");
}

/// Returns alternating signals: the loop, silence, constants, saturation.
fn alternating_signals(k: usize, record: &Record) -> (f64, f64) {
    let (e, u) = (record.input()[k % record.len()], record.output()[k % record.len()]);
    match (k / 20_000) % 5 {
        0 | 2 => (e, u),
        1 => (0.0, 0.0),
        3 => (0.7, -0.3),
        _ => (e.clamp(-0.01, 0.01).signum(), u.clamp(-0.02, 0.02)),
    }
}

fn print_endurance(samples: usize) {
    let record = run(&simulator(Condition::C1, 1, 0.1), 0, 0);
    let span = record.span(0.0, 30.72).unwrap();
    let methods = [
        Method::rls(),
        Method::rpem(),
        hoid_survey::physical(),
        hoid_survey::rriv(),
    ];
    let lines = on_all_cores(methods.len(), |i| {
        let options = options(methods[i as usize].clone());
        let mut tracker = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
        let begin = std::time::Instant::now();
        let (mut largest, mut largest_variance) = (0.0_f64, 0.0_f64);
        for k in 0..samples {
            let (e, u) = alternating_signals(k, &record);
            tracker.step(e, u);
            if k % 1000 == 999 {
                largest = tracker
                    .theta()
                    .iter()
                    .fold(largest, |m, t| if t.is_finite() { m.max(t.abs()) } else { f64::NAN });
                for (i, c) in tracker.covariance().unwrap().iter().enumerate() {
                    assert!(c.is_finite() && largest.is_finite(), "sample {k}, element {i}");
                    largest_variance = largest_variance.max(c.abs());
                }
            }
        }
        let nanoseconds = begin.elapsed().as_secs_f64() * 1e9 / samples as f64;
        // Finally, another run of the task.
        let next = run(&simulator(Condition::C1, 1, 0.1), 0, 1);
        for k in 0..next.len() {
            tracker.step(next.input()[k], next.output()[k]);
        }
        let after = tracker.operator().map_or("not convertible".to_owned(), |o| {
            format!("K_e {:.4} +- {:.4}", o.k_e.value, o.k_e.standard_error.unwrap())
        });
        format!(
            "{:9} {samples} samples, {nanoseconds:.0} ns each: largest coefficient {largest:.3}, largest variance {largest_variance:.3e}; after a \
             run of 82 s {after}",
            options.method.name()
        )
    });
    lines.iter().for_each(|line| println!("{line}"));
}
