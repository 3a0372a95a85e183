//! The numbers of `research/notes/multiple-model-evidence.md` that take too long for a test.
//!
//! `cargo run --release -p hoid-evidence --example multiple_model_evidence -- detection|tune|set|cost [RUNS]`
//! or `-- joined FIRST.csv SECOND.csv ..`, pairs of recordings with the columns t, r, u and y that
//! are joined in the middle
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid_evidence::given_delay::{options, thesis_settings};
use hoid_evidence::task::{CHANGE_S, START_S, median, on_all_cores, scenario};
use hoid_model::{
    Channel, Record, SampleTime,
    scenario::{Condition, Scenario},
    schedule::Schedule,
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{ErrorThreshold, Method, Sample, TrackOptions, Tracker};

const COLUMNS: [&str; 5] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"];
const LEVELS: [f64; 4] = [0.01, 0.1, 0.2, 0.3];
/// End of the search for a change, s.
const SEARCH_END_S: f64 = CHANGE_S + 5.0;
/// Further alarms within this time belong to the same event and are not counted, s.
const EVENT_DURATION_S: f64 = 4.0;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let runs = arguments.get(1).and_then(|n| n.parse().ok()).unwrap_or(100);
    match arguments.first().map(String::as_str) {
        Some("detection") => print_detection(runs),
        Some("tune") => print_tuning_errors(runs),
        Some("joined") => print_junction_changes(&arguments[1..]),
        Some("set") => print_tuning_cells(runs),
        Some("cost") => print_step_time(runs),
        _ => println!("detection, tune, set or cost, and a number of runs; joined and pairs of files"),
    }
}

fn simulator(condition: Condition, remnant_order: usize, level: f64) -> Simulator {
    Simulator::new(&scenario(condition, remnant_order, level)).unwrap()
}

/// Returns a run with seed 7000; the method was tuned on seed 9000 and examined on seed 5000.
fn run(simulator: &Simulator, condition: Condition, order: usize, level: usize, replication: u64) -> Record {
    let run_seed = RunSeed {
        seed: 7000,
        cell: condition as u64 * 16 + order as u64 * 4 + level as u64,
        replication,
    };
    simulator.run(run_seed, false).unwrap()
}

/// Result of one run of one method.
struct RunResult {
    /// RMS of the relative error over t in [10, 81.92] s, per cent.
    errors: [f64; 5],
    /// Share of samples after the start fit, and within 5 s after the change, in which 1.96
    /// standard errors cover the truth.
    covered: [f64; 5],
    covered_through: [f64; 5],
    /// Number of changes declared before and after t_M, and whether one was declared within 5 s after it.
    declared: [f64; 3],
    /// Time after the change at which K_e_dot has covered half, and nine tenths, of its step, s.
    settling_s: [f64; 2],
}

fn follow(record: &Record, options: &TrackOptions) -> RunResult {
    let truth = COLUMNS.map(|c| record.channel(c).unwrap());
    let span = record.span(0.0, START_S).unwrap();
    let mut tracker = Tracker::new(options, Some(&span), record.sample_time()).unwrap();
    let from = if options.method.initial_covariance().is_none() {
        START_S - 0.005
    } else {
        -1.0
    };
    let (mut squares, mut rows) = ([0.0; 5], 0.0);
    let (mut covered, mut through, mut counts) = ([0.0; 5], [0.0; 5], [0.0; 2]);
    let (mut settling_s, mut declared) = ([f64::INFINITY; 2], [0.0_f64; 3]);
    let (first, last) = (truth[2][0], truth[2][record.len() - 1]);
    for k in 0..record.len() {
        let t = record.time_s(k);
        let sample = Sample {
            e: record.input()[k],
            u: record.output()[k],
            reference: None,
        };
        tracker.update(sample, t >= from);
        if tracker.change().is_some() {
            declared[usize::from(t >= CHANGE_S)] += 1.0;
            if (CHANGE_S..SEARCH_END_S).contains(&t) {
                declared[2] = 1.0;
            }
        }
        if t < 10.0 - 1e-9 {
            continue;
        }
        let Ok(operator) = tracker.operator() else { continue };
        rows += 1.0;
        let after_start = t > START_S;
        let changing = (CHANGE_S..SEARCH_END_S).contains(&t);
        counts[0] += f64::from(after_start);
        counts[1] += f64::from(changing);
        for (i, (_, _, e)) in operator.rows()[..5].iter().enumerate() {
            let error = e.value - truth[i][k];
            squares[i] += (error / truth[i][k]).powi(2);
            let inside = f64::from(error.abs() <= 1.96 * e.standard_error.unwrap_or(f64::NAN));
            covered[i] += if after_start { inside } else { 0.0 };
            through[i] += if changing { inside } else { 0.0 };
        }
        if t >= CHANGE_S {
            let part = (operator.k_e_dot.value - first) / (last - first);
            for (settled, share) in settling_s.iter_mut().zip([0.5, 0.9]) {
                if part >= share && settled.is_infinite() {
                    *settled = t - CHANGE_S;
                }
            }
        }
    }
    RunResult {
        errors: squares.map(|s: f64| 100.0 * (s / rows).sqrt()),
        covered: covered.map(|c| c / counts[0]),
        covered_through: through.map(|c| c / counts[1]),
        declared,
        settling_s,
    }
}

fn row(values: [f64; 5], digits: usize) -> String {
    values
        .map(|v| {
            if v > 999.0 {
                ">999".to_owned()
            } else {
                format!("{v:.digits$}")
            }
        })
        .join(" / ")
}

/// A statistic over time, from the end of the start fit on.
type Statistic = Vec<(f64, f64)>;

/// Returns the first crossing within 5 s after the change, and the number of events outside these 5 s.
fn alarms(statistic: &Statistic, threshold: f64, changes: bool) -> (Option<f64>, usize) {
    let (mut lag, mut events, mut quiet_from) = (None, 0, 0.0);
    for &(t, s) in statistic {
        if s <= threshold {
            continue;
        }
        let fresh = t >= quiet_from;
        if changes && (CHANGE_S..SEARCH_END_S).contains(&t) {
            if lag.is_none() {
                lag = Some(t - CHANGE_S);
            }
        } else if fresh && !(changes && t >= SEARCH_END_S) {
            events += 1;
        }
        quiet_from = t + EVENT_DURATION_S;
    }
    (lag, events)
}

/// Prints the detections in C4 and C6 against the false alarms in C1 and C2, for the odds and for the baseline.
fn print_detection(runs: usize) {
    let statistics = |record: &Record| -> [Statistic; 2] {
        let span = record.span(0.0, START_S).unwrap();
        let options = options(hoid_survey::multiple_model());
        let mut tracker = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
        let mut baseline = ErrorThreshold::new(span.input(), record.sample_time()).unwrap();
        let mut both = [Vec::new(), Vec::new()];
        for k in 0..record.len() {
            let (t, e) = (record.time_s(k), record.input()[k]);
            let sample = Sample {
                e,
                u: record.output()[k],
                reference: None,
            };
            let after_start = t >= START_S - 0.005;
            tracker.update(sample, after_start);
            let distance = baseline.step(e);
            if after_start {
                both[0].push((t, tracker.change_odds().unwrap()));
                both[1].push((t, distance));
            }
        }
        both
    };
    // For each method and threshold: lags and misses per condition, false alarms and hours.
    let thresholds: [Vec<f64>; 2] = [
        vec![-1.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0],
        vec![2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0, 7.0, 8.0, 10.0, 15.0],
    ];
    let mut lags = [0, 1].map(|m: usize| vec![[Vec::new(), Vec::new()]; thresholds[m].len()]);
    let mut events = [0, 1].map(|m: usize| vec![0; thresholds[m].len()]);
    let mut hours = 0.0;
    for condition in [Condition::C1, Condition::C2, Condition::C4, Condition::C6] {
        let changes = matches!(condition, Condition::C4 | Condition::C6);
        for order in 1..=4 {
            for (l, level) in LEVELS.into_iter().enumerate().take(3) {
                let simulator = simulator(condition, order, level);
                let found = on_all_cores(runs, |r| {
                    let both = statistics(&run(&simulator, condition, order, l, r));
                    [0, 1].map(|m: usize| {
                        let of = |k: &f64| alarms(&both[m], *k, changes);
                        thresholds[m].iter().map(of).collect::<Vec<_>>()
                    })
                });
                for each in &found {
                    for m in 0..2 {
                        for (k, (lag, count)) in each[m].iter().enumerate() {
                            if changes {
                                lags[m][k][usize::from(condition == Condition::C6)].push(lag.unwrap_or(f64::INFINITY));
                            } else {
                                events[m][k] += count;
                            }
                        }
                    }
                    hours += if changes { 0.0 } else { 51.2 / 3600.0 };
                }
            }
        }
    }
    println!("P_n = .01, .1, .2; m0 = 1 to 4; {runs} runs a cell; {hours:.1} hours of steady tracking in C1 and C2");
    println!(
        "| statistic | threshold | false alarms an hour | C4 found, % | median lag, s | C6 found, % | median lag, s |"
    );
    println!("|---|---|---|---|---|---|---|");
    for (m, name) in ["log odds", "k sigma of e and its rate"].into_iter().enumerate() {
        for (k, threshold) in thresholds[m].iter().enumerate() {
            let cells = lags[m][k].each_ref().map(|lags| {
                let hits = lags.iter().filter(|l| l.is_finite()).count();
                let share = 100.0 * hits as f64 / lags.len() as f64;
                format!("{share:.1} | {:.2}", median(lags.iter().copied()))
            });
            println!(
                "| {name} | {threshold} | {:.2} | {} |",
                events[m][k] as f64 / hours,
                cells.join(" | ")
            );
        }
    }
}

/// Prints the errors relative to the better of RLS and RPEM on the cells used for tuning: C3 and C5, m0 = 2 and 3,
/// seed 9000.
fn print_tuning_errors(runs: usize) {
    let methods = [
        thesis_settings(Method::rls()),
        thesis_settings(Method::rpem()),
        options(hoid_survey::fused()),
        options(hoid_survey::ekf()),
        options(hoid_survey::ukf()),
    ];
    let mut ratios: Vec<Vec<[f64; 5]>> = vec![Vec::new(); methods.len()];
    let mut covered: Vec<Vec<[f64; 5]>> = vec![Vec::new(); methods.len()];
    for condition in [Condition::C3, Condition::C5] {
        for order in [2, 3] {
            for level in LEVELS {
                let simulator = simulator(condition, order, level);
                let found = on_all_cores(runs, |r| {
                    let run_seed = RunSeed {
                        seed: 9000,
                        cell: condition as u64 * 16 + order as u64 * 4,
                        replication: r,
                    };
                    let record = simulator.run(run_seed, false).unwrap();
                    methods.each_ref().map(|options| follow(&record, options))
                });
                let errors = [0, 1, 2, 3, 4]
                    .map(|m: usize| [0, 1, 2, 3, 4].map(|i: usize| median(found.iter().map(|f| f[m].errors[i]))));
                for m in 0..methods.len() {
                    ratios[m].push([0, 1, 2, 3, 4].map(|i| errors[m][i] / errors[0][i].min(errors[1][i])));
                    covered[m].push(
                        [0, 1, 2, 3, 4]
                            .map(|i| 100.0 * found.iter().map(|f| f[m].covered[i]).sum::<f64>() / runs as f64),
                    );
                }
            }
        }
    }
    for m in 2..methods.len() {
        let all = |i: usize| ratios[m].iter().map(move |r| r[i]);
        println!(
            "{}: median {}, worst {}; covered {}",
            methods[m].method.name(),
            row([0, 1, 2, 3, 4].map(|i| median(all(i))), 2),
            row([0, 1, 2, 3, 4].map(|i| all(i).fold(0.0, f64::max)), 2),
            row([0, 1, 2, 3, 4].map(|i| median(covered[m].iter().map(|c| c[i]))), 0),
        );
    }
}

/// Prints the results for the cells for tuning `multiple-model`: C3 and C5, C1 and C2, and changes in the neuromuscular
/// system other than those of the plan. The errors are geometric means over the cells of the median run.
fn print_tuning_cells(runs: usize) {
    let options = options(hoid_survey::multiple_model());
    let neuromuscular = |omega: f64, zeta: f64| {
        move |scenario: &mut Scenario| {
            scenario.last.operator.omega_nm_rad_s = omega;
            scenario.last.operator.zeta_nm = zeta;
            scenario.schedule = Schedule::Sigmoid {
                rate_per_s: 100.0,
                midpoint_s: CHANGE_S,
            };
        }
    };
    type Group = (&'static str, [Condition; 2], Box<dyn Fn(&mut Scenario)>);
    let sudden = |back: bool| {
        move |scenario: &mut Scenario| {
            for (state, [k_e, t_l_s, k_c, omega_b_rad_s]) in [
                (&mut scenario.initial, [0.1, 0.5, 75.0, 4.0]),
                (&mut scenario.last, [0.075, 1.0, 40.0, 0.5]),
            ] {
                (state.operator.k_e, state.operator.t_l_s) = (k_e, t_l_s);
                (state.controlled_element.k_c, state.controlled_element.omega_b_rad_s) = (k_c, omega_b_rad_s);
            }
            if back {
                std::mem::swap(&mut scenario.initial, &mut scenario.last);
            }
        }
    };
    let groups: [Group; 7] = [
        ("C1, C2", [Condition::C1, Condition::C2], Box::new(|_| ())),
        ("C3", [Condition::C3; 2], Box::new(|_| ())),
        ("C5", [Condition::C5; 2], Box::new(|_| ())),
        (
            "to 8.5 rad/s, .45",
            [Condition::C1, Condition::C2],
            Box::new(neuromuscular(8.5, 0.45)),
        ),
        (
            "to 14 rad/s, .25",
            [Condition::C1, Condition::C2],
            Box::new(neuromuscular(14.0, 0.25)),
        ),
        ("sudden", [Condition::C4; 2], Box::new(sudden(false))),
        ("sudden, back", [Condition::C4; 2], Box::new(sudden(true))),
    ];
    println!("{runs} runs a cell, seed 9000; {}", COLUMNS.join(" / "));
    println!(
        "| cells | RMS relative error, % | covered, % | within 5 s after t_M, %: median cell | least cell | declared before, after t_M, an hour | within 5 s, % | 50, 90 % of K_e_dot, s |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (name, conditions, change) in &groups {
        let mut found: Vec<Vec<RunResult>> = Vec::new();
        for (c, condition) in conditions.iter().enumerate() {
            let order = match (name.starts_with("sudden"), conditions[0] == conditions[1]) {
                (true, _) => [1, 4][c],
                (false, true) => 2 + c,
                (false, false) => 2,
            };
            for level in LEVELS {
                let mut scenario = scenario(*condition, order, level);
                change(&mut scenario);
                let simulator = Simulator::new(&scenario).unwrap();
                found.push(on_all_cores(runs, |replication| {
                    let run_seed = RunSeed {
                        seed: 9000,
                        cell: *condition as u64 * 16 + order as u64 * 4,
                        replication,
                    };
                    follow(&simulator.run(run_seed, false).unwrap(), &options)
                }));
            }
        }
        let columns = [0, 1, 2, 3, 4];
        let means = |i: usize, of: fn(&RunResult) -> [f64; 5]| {
            let mean = |cell: &Vec<RunResult>| 100.0 * cell.iter().map(|f| of(f)[i]).sum::<f64>() / runs as f64;
            found.iter().map(mean).collect::<Vec<f64>>()
        };
        let errors = columns.map(|i| {
            let logs = found.iter().map(|cell| median(cell.iter().map(|f| f.errors[i])).ln());
            (logs.sum::<f64>() / found.len() as f64).exp()
        });
        let all = || found.iter().flatten();
        let each_hour =
            |k: usize, hours: f64| all().map(|f| f.declared[k]).sum::<f64>() / (all().count() as f64 * hours);
        println!(
            "| {name} | {} | {} | {} | {} | {:.1}, {:.1} | {:.0} | {:.2}, {:.2} |",
            row(errors, 2),
            row(columns.map(|i| median(means(i, |f| f.covered).into_iter())), 0),
            row(columns.map(|i| median(means(i, |f| f.covered_through).into_iter())), 0),
            row(
                columns.map(|i| means(i, |f| f.covered_through).into_iter().fold(100.0, f64::min)),
                0
            ),
            each_hour(0, (CHANGE_S - START_S) / 3600.0),
            each_hour(1, (81.92 - CHANGE_S) / 3600.0),
            100.0 * each_hour(2, 1.0),
            median(all().map(|f| f.settling_s[0])),
            median(all().map(|f| f.settling_s[1])),
        );
    }
}

/// Reads the error and the control for t in [5, 45) s.
fn read_recording(path: &str) -> [Vec<f64>; 2] {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| names.iter().position(|n| *n == name).unwrap();
    let (t, r, u, y) = (at("t"), at("r"), at("u"), at("y"));
    let (mut e, mut control) = (Vec::new(), Vec::new());
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|v| v.parse().unwrap_or(f64::NAN)).collect();
        if (5.0..45.0).contains(&row[t]) {
            e.push(row[r] - row[y]);
            control.push(row[u]);
        }
    }
    [e, control]
}

/// Prints the changes declared around the junction of two recordings of a person: the first 30 s are the start span,
/// and nothing changes until 40 s.
fn print_junction_changes(files: &[String]) {
    let (start_s, seam_s) = (30.0, 40.0);
    let sample_time = SampleTime::new(1.0 / 60.0).unwrap();
    let thresholds = [[3.0, 6.0, 10.0, 20.0], [2.5, 3.0, 4.0, 5.0]];
    let mut lags = [0, 1].map(|_| [0, 1, 2, 3].map(|_| Vec::new()));
    let mut events = [[0; 4]; 2];
    let (mut pairs, mut failed) = (0, 0);
    for pair in files.chunks_exact(2) {
        let [[mut e, mut u], [e2, u2]] = [&pair[0], &pair[1]].map(|path| read_recording(path));
        e.extend(e2);
        u.extend(u2);
        let record = Record::new(sample_time, Channel::new("e", "1", e), Channel::new("u", "1", u)).unwrap();
        let span = record.span(0.0, start_s).unwrap();
        // The delay with the smallest innovation variance of the start fit.
        let fits = (8..=26).filter_map(|nk| {
            let m = hoid_survey::multiple_model();
            let options = TrackOptions::new(m.clone(), m.default_structure(), m.default_orders(nk));
            Tracker::new(&options, Some(&span), sample_time).ok()
        });
        let Some(mut tracker) = fits.min_by(|a, b| a.innovation_variance().total_cmp(&b.innovation_variance())) else {
            failed += 1;
            continue;
        };
        pairs += 1;
        let mut baseline = ErrorThreshold::new(span.input(), sample_time).unwrap();
        let mut both = [Vec::new(), Vec::new()];
        for k in 0..record.len() {
            let (t, e) = (record.time_s(k), record.input()[k]);
            let sample = Sample {
                e,
                u: record.output()[k],
                reference: None,
            };
            tracker.update(sample, t >= start_s);
            let distance = baseline.step(e);
            if t >= start_s {
                // The times are shifted as if the seam were at the change of the conditions.
                both[0].push((t + CHANGE_S - seam_s, tracker.change_odds().unwrap()));
                both[1].push((t + CHANGE_S - seam_s, distance));
            }
        }
        for m in 0..2 {
            for (k, threshold) in thresholds[m].iter().enumerate() {
                let (lag, count) = alarms(&both[m], *threshold, true);
                lags[m][k].push(lag.unwrap_or(f64::INFINITY));
                events[m][k] += count;
            }
        }
    }
    println!(
        "{pairs} joined pairs, {failed} without a start fit; {:.2} h before the seam",
        pairs as f64 * 10.0 / 3600.0
    );
    println!("| statistic | threshold | alarms in the 10 s before the seam | found within 5 s, % | median lag, s |");
    println!("|---|---|---|---|---|");
    for (m, name) in ["log odds", "k sigma of e and its rate"].into_iter().enumerate() {
        for (k, threshold) in thresholds[m].iter().enumerate() {
            let hits = lags[m][k].iter().filter(|l: &&f64| l.is_finite()).count();
            println!(
                "| {name} | {threshold} | {} | {:.0} | {:.2} |",
                events[m][k],
                100.0 * hits as f64 / pairs as f64,
                median(lags[m][k].iter().copied())
            );
        }
    }
}

/// Prints the time of a step with its estimate, ns: the smallest mean of a given number of runs.
fn print_step_time(runs: usize) {
    let simulator = simulator(Condition::C4, 2, 0.1);
    let record = run(&simulator, Condition::C4, 2, 1, 0);
    let span = record.span(0.0, START_S).unwrap();
    let tracked = options(hoid_survey::multiple_model())
        .with(&[("track_delay", "0.2..0.4")])
        .unwrap();
    let methods = [
        Method::rls(),
        Method::rpem(),
        hoid_survey::fused(),
        hoid_survey::physical(),
        hoid_survey::ekf(),
        hoid_survey::ukf(),
        hoid_survey::multiple_model(),
    ];
    for options in methods.map(options).into_iter().chain([tracked]) {
        let mut least = f64::INFINITY;
        for _ in 0..runs {
            let mut tracker = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
            let begin = std::time::Instant::now();
            for (e, u) in record.input().iter().zip(record.output()) {
                tracker.step(*e, *u);
            }
            least = least.min(begin.elapsed().as_secs_f64() / record.len() as f64);
        }
        let delays = options.method.track_delay_s().map_or("", |_| ", delays of .2 to .4 s");
        println!("{}{delays}: {:.0} ns", options.method.name(), 1e9 * least);
    }
}
