//! The numbers of `research/notes/multiple-model-evidence.md` on tracked delays.
//!
//! `cargo run --release -p hoid-evidence --example delay_evidence -- [RUNS] [tune]`
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid_evidence::task::{CHANGE_S, START_S, median, on_all_cores, scenario};
use hoid_model::{
    Record,
    scenario::{Condition, Scenario},
    schedule::Schedule,
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Method, StartSource, TrackOptions, track};

const COLUMNS: [&str; 6] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm", "tau_e"];
const LEVELS: [f64; 3] = [0.01, 0.1, 0.2];
const MAX_DETECTION_TIME_S: f64 = 5.0;
/// nk of the start fit, and the tracked delays, s.
const NK: usize = 29;
const RANGE_S: (f64, f64) = (0.2, 0.4);

/// Name, conditions, and the delay before and after.
type Case = (&'static str, [Condition; 2], [f64; 2]);

fn main() {
    let mut arguments = std::env::args().skip(1);
    let runs: usize = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(20);
    let tune = arguments.next().is_some_and(|word| word == "tune");
    let cases: Vec<Case> = if tune {
        vec![
            ("C3, C5", [Condition::C3, Condition::C5], [0.28, 0.28]),
            ("C3, C5, delay to .24", [Condition::C3, Condition::C5], [0.28, 0.24]),
            ("C3, C5, delay to .32", [Condition::C3, Condition::C5], [0.28, 0.32]),
            ("C3, C5, delay .26", [Condition::C3, Condition::C5], [0.26, 0.26]),
        ]
    } else {
        vec![
            ("C1, C2", [Condition::C1, Condition::C2], [0.28, 0.28]),
            ("C4, C6", [Condition::C4, Condition::C6], [0.28, 0.28]),
            ("C1, C2, delay to .34", [Condition::C1, Condition::C2], [0.28, 0.34]),
            ("C4, C6, delay to .34", [Condition::C4, Condition::C6], [0.28, 0.34]),
            ("C4, C6, delay .25", [Condition::C4, Condition::C6], [0.25, 0.25]),
            ("C4, C6, delay .31", [Condition::C4, Condition::C6], [0.31, 0.31]),
        ]
    };
    let methods = [
        ("rpem, nk = 29", options(Method::rpem(), None)),
        ("rpem, tracked", options(Method::rpem(), Some(RANGE_S))),
        ("multiple-model, nk = 29", options(hoid_survey::multiple_model(), None)),
        (
            "multiple-model, tracked",
            options(hoid_survey::multiple_model(), Some(RANGE_S)),
        ),
        ("physical, tracked", options(hoid_survey::physical(), Some(RANGE_S))),
    ];
    let orders: &[usize] = if tune { &[2, 3] } else { &[2] };
    println!(
        "RMS relative error in % over t in [30.72, 81.92] s, {}, median of all runs; covered: mean",
        COLUMNS.join(" / ")
    );
    println!(
        "| case | method | error | covered, % | within 5 s of the change, % | found within 5 s, % | lag, s | tau_e named, % | false alarms an hour |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (name, conditions, delays) in cases {
        let mut found: Vec<Vec<RunResult>> = methods.iter().map(|_| Vec::new()).collect();
        for condition in conditions {
            for &order in orders {
                for (l, level) in LEVELS.into_iter().enumerate() {
                    let simulator = Simulator::new(&scenario_with_delay(condition, order, level, delays)).unwrap();
                    let changes = simulator.scenario().scenario().schedule != Schedule::Constant;
                    let each = on_all_cores(runs, |replication| {
                        let run_seed = RunSeed {
                            seed: if tune { 9000 } else { 7000 },
                            cell: condition as u64 * 16 + order as u64 * 4 + l as u64,
                            replication,
                        };
                        let record = simulator.run(run_seed, false).unwrap();
                        methods.each_ref().map(|(_, options)| follow(&record, options, changes))
                    });
                    for of_methods in each {
                        for (all, one) in found.iter_mut().zip(of_methods) {
                            all.push(one);
                        }
                    }
                }
            }
        }
        for ((method, _), found) in methods.iter().zip(&found) {
            let mean = |of: &dyn Fn(&RunResult) -> f64| {
                let values = found.iter().map(of).filter(|v| !v.is_nan());
                let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v, n + 1.0));
                sum / count
            };
            let row = |of: &dyn Fn(&RunResult, usize) -> f64, digits: usize| {
                let text = |i: usize| format!("{:.digits$}", median_over_runs(found, &|f| of(f, i)));
                (0..6).map(text).collect::<Vec<_>>().join(" / ")
            };
            let means = |of: &dyn Fn(&RunResult, usize) -> f64| {
                let text = |i: usize| format!("{:.0}", mean(&|f| of(f, i)));
                (0..6).map(text).collect::<Vec<_>>().join(" / ")
            };
            println!(
                "| {name} | {method} | {} | {} | {} | {:.0} | {:.2} | {:.0} | {:.1} |",
                row(&|f, i| f.errors[i], 1),
                means(&|f, i| f.covered[i]),
                means(&|f, i| f.through[i]),
                mean(&|f| f.found),
                median_over_runs(found, &|f| f.lag_s),
                mean(&|f| f.named),
                mean(&|f| f.false_alarms) / mean(&|f| f.hours),
            );
        }
    }
}

fn median_over_runs(found: &[RunResult], of: &dyn Fn(&RunResult) -> f64) -> f64 {
    median(found.iter().map(of))
}

fn options(method: Method, track_delay_s: Option<(f64, f64)>) -> TrackOptions {
    let method = match track_delay_s {
        Some((low, high)) => method.with("track_delay", &format!("{low}..{high}")).unwrap(),
        None => method,
    };
    TrackOptions {
        start: StartSource::Span(Some((0.0, START_S))),
        ..TrackOptions::new(method.clone(), method.default_structure(), method.default_orders(NK))
    }
}

fn scenario_with_delay(condition: Condition, order: usize, level: f64, [before, after]: [f64; 2]) -> Scenario {
    let mut scenario = scenario(condition, order, level);
    scenario.initial.operator.tau_e_s = before;
    scenario.last.operator.tau_e_s = after;
    if before != after && scenario.schedule == Schedule::Constant {
        scenario.schedule = Schedule::Sigmoid {
            rate_per_s: 100.0,
            midpoint_s: CHANGE_S,
        };
    }
    scenario
}

/// Result of one run of one method, over t in [30.72, 81.92] s.
struct RunResult {
    errors: [f64; 6],
    covered: [f64; 6],
    through: [f64; 6],
    found: f64,
    named: f64,
    lag_s: f64,
    false_alarms: f64,
    hours: f64,
}

fn follow(record: &Record, options: &TrackOptions, changes: bool) -> RunResult {
    let truth = COLUMNS.map(|c| record.channel(c).unwrap());
    let trace = track(record, options, 4).unwrap();
    let soon = |t: f64| changes && (CHANGE_S..CHANGE_S + MAX_DETECTION_TIME_S).contains(&t);
    let (mut squares, mut covered, mut through, mut counts) = ([0.0; 6], [0.0; 6], [0.0; 6], [0.0; 2]);
    for (row, t) in trace.times_s().iter().enumerate().filter(|(_, t)| **t > START_S) {
        let k = 4 * row + 3;
        let Ok(operator) = trace.operator(row) else { continue };
        counts[0] += 1.0;
        counts[1] += f64::from(soon(*t));
        for (i, (_, _, e)) in operator.rows().iter().enumerate() {
            let error = e.value - truth[i][k];
            squares[i] += (error / truth[i][k]).powi(2);
            // A fixed delay has no error bar.
            let inside = e
                .standard_error
                .map_or(f64::NAN, |se| f64::from(error.abs() <= 1.96 * se));
            covered[i] += inside;
            through[i] += if soon(*t) { inside } else { 0.0 };
        }
    }
    let first = trace.changes().iter().find(|(t, _)| soon(*t));
    let named = trace
        .changes()
        .iter()
        .any(|(t, c)| soon(*t) && c.changed_quantities().contains(&"tau_e"));
    let share = |hit: bool| if changes { 100.0 * f64::from(hit) } else { f64::NAN };
    RunResult {
        errors: squares.map(|s: f64| 100.0 * (s / counts[0]).sqrt()),
        covered: covered.map(|c| 100.0 * c / counts[0]),
        through: through.map(|c| 100.0 * c / counts[1]),
        found: share(first.is_some()),
        named: share(named),
        lag_s: first.map_or(f64::NAN, |(t, _)| t - CHANGE_S),
        false_alarms: trace.changes().iter().filter(|(t, _)| !soon(*t)).count() as f64,
        hours: (51.2 - if changes { MAX_DETECTION_TIME_S } else { 0.0 }) / 3600.0,
    }
}
