//! The default tracker compared with earlier methods in the conditions of the thesis: errors, coverage and changes of
//! each cell, and the ratio of its errors to those of the best other method.
//!
//! `cargo run --release -p hoid-evidence --example conditions_evidence -- [RUNS] [M,..] [LEVEL,..] [METHOD,..]
//! [CONDITION,..]`
//!
//! Methods: `adaptive` gets no prior information; `multiple-model`, `rls` and `rpem` are given the delay and start from
//! a fit of the first 30.72 s (RLS and RPEM with the settings of the thesis). Their first rows are therefore not
//! causal: the ratios use the rows from 30.72 s on, and ratios from 10 s on are given as well.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid_evidence::given_delay::{options, thesis_settings};
use hoid_evidence::task::{CHANGE_S, START_S, median, on_all_cores, scenario};
use hoid_model::{
    Record,
    scenario::{Condition, Realisation},
};
use hoid_sim::{RunSeed, Simulator};
use hoid_track::{Sample, TrackOptions, Tracker};

/// A seed that was not used for tuning.
const SEED: u64 = 46_000;
const COLUMNS: [&str; 5] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"];
/// Spans of the coverage (s): before the change, within 5 s after it, and later.
const SPANS: [(f64, f64); 3] = [(20.0, CHANGE_S), (CHANGE_S, CHANGE_S + 5.0), (CHANGE_S + 5.0, 82.0)];

struct Cell {
    condition: Condition,
    order: usize,
    level: f64,
    realisation: Realisation,
}

impl Cell {
    fn changes(&self) -> bool {
        !matches!(self.condition, Condition::C1 | Condition::C2)
    }

    /// Returns the start of the change: 1.8 % of a sigmoid are completed 4/G before its middle.
    fn change_time_s(&self) -> f64 {
        match self.condition {
            Condition::C3 | Condition::C5 => CHANGE_S - 8.0,
            _ => CHANGE_S - 0.04,
        }
    }
}

/// Result of a run of a method: RMS relative errors from 30.72 s and from 10 s on in percent, coverage of 1.96 standard
/// errors in each span, false alarms, and the detection delay, from the middle of the change to the first alarm between
/// its start and 10 s after its middle.
struct RunResult {
    errors: [[f64; 5]; 2],
    covered: [[f64; 5]; 3],
    alarms: f64,
    delay_s: f64,
}

fn tracker(name: &str, record: &Record) -> Tracker {
    let method = hoid_survey::method(name).unwrap();
    if method.is_self_starting() {
        let options = TrackOptions::without_prior(method, record.sample_time());
        return Tracker::new(&options, None, record.sample_time()).unwrap();
    }
    let options = match name {
        "rls" | "rpem" => thesis_settings(method),
        _ => options(method),
    };
    Tracker::new(
        &options,
        Some(&record.span(0.0, START_S).unwrap()),
        record.sample_time(),
    )
    .unwrap()
}

fn follow(name: &str, cell: &Cell, record: &Record) -> RunResult {
    let truth = COLUMNS.map(|c| record.channel(c).unwrap());
    let mut tracker = tracker(name, record);
    let moves_from = if name == "multiple-model" { START_S - 0.005 } else { 0.0 };
    let (mut squares, mut rows) = ([[0.0; 5]; 2], [0.0; 2]);
    let (mut covered, mut counts) = ([[0.0; 5]; 3], [0.0; 3]);
    let (mut alarms, mut delay_s) = (0.0, f64::NAN);
    for k in 0..record.len() {
        let t = record.time_s(k);
        let sample = Sample {
            e: record.input()[k],
            u: record.output()[k],
            reference: None,
        };
        tracker.update(sample, t >= moves_from);
        if tracker.change().is_some() && t > START_S {
            let after = cell.changes() && (cell.change_time_s()..CHANGE_S + 10.0).contains(&t);
            if after && delay_s.is_nan() {
                delay_s = t - CHANGE_S;
            }
            alarms += f64::from(!after);
        }
        let Ok(operator) = tracker.operator() else { continue };
        let estimates: [_; 5] = core::array::from_fn(|i| operator.rows()[i].2);
        let errors: [f64; 5] = core::array::from_fn(|i| estimates[i].value - truth[i][k]);
        for (from, from_s) in [START_S, 10.0].into_iter().enumerate() {
            if t >= from_s - 1e-9 {
                rows[from] += 1.0;
                for i in 0..5 {
                    squares[from][i] += (errors[i] / truth[i][k]).powi(2);
                }
            }
        }
        for (span, (from, to)) in SPANS.iter().enumerate() {
            if (*from..*to).contains(&t) {
                counts[span] += 1.0;
                for i in 0..5 {
                    let error = estimates[i].standard_error.unwrap_or(f64::NAN);
                    covered[span][i] += f64::from(errors[i].abs() <= 1.96 * error);
                }
            }
        }
    }
    RunResult {
        errors: core::array::from_fn(|f| squares[f].map(|s: f64| 100.0 * (s / rows[f]).sqrt())),
        covered: core::array::from_fn(|s| covered[s].map(|c| c / counts[s])),
        alarms,
        delay_s,
    }
}

fn join_values(values: impl Iterator<Item = f64>, digits: usize) -> String {
    values.map(|v| format!("{v:.digits$}")).collect::<Vec<_>>().join("/")
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let of = |i: usize, default: &str| arguments.get(i).map_or(default, String::as_str).to_owned();
    let runs: usize = of(0, "20").parse().unwrap();
    let numbers = |text: String| text.split(',').map(|n| n.parse().unwrap()).collect::<Vec<f64>>();
    let (orders, levels, methods) = (
        numbers(of(1, "1,2")),
        numbers(of(2, "0.1")),
        of(3, "multiple-model,rls,rpem,adaptive"),
    );
    let conditions: Vec<Condition> = match arguments.get(4) {
        Some(list) => list.split(',').map(|name| name.parse().unwrap()).collect(),
        None => Condition::ALL.to_vec(),
    };
    let mut cells = Vec::new();
    for level in levels {
        for condition in conditions.clone() {
            for order in &orders {
                for realisation in [Realisation::Output, Realisation::Input] {
                    cells.push(Cell {
                        condition,
                        order: *order as usize,
                        level,
                        realisation,
                    });
                    // Without a change the realisations are the same.
                    if !cells[cells.len() - 1].changes() {
                        break;
                    }
                }
            }
        }
    }
    let mut medians: Vec<(String, Vec<[[f64; 5]; 2]>)> = Vec::new();
    for name in methods.split(',') {
        println!("{name}: error % from 30.72 s; covered before, within 5 s, after; alarms an hour; delay s; missed");
        let mut of_cells = Vec::new();
        for (number, cell) in cells.iter().enumerate() {
            let mut scenario = scenario(cell.condition, cell.order, cell.level);
            scenario.realisation = cell.realisation;
            let simulator = Simulator::new(&scenario).unwrap();
            let found = on_all_cores(runs, |replication| {
                let seed = RunSeed {
                    seed: SEED,
                    cell: number as u64,
                    replication,
                };
                follow(name, cell, &simulator.run(seed, false).unwrap())
            });
            let error = |from: usize, i: usize| median(found.iter().map(|f| f.errors[from][i]));
            let errors: [[f64; 5]; 2] = core::array::from_fn(|f| core::array::from_fn(|i| error(f, i)));
            let mean = |of: &dyn Fn(&RunResult) -> f64| found.iter().map(of).sum::<f64>() / runs as f64;
            let covered: Vec<String> = (0..3)
                .map(|s| join_values((0..5).map(|i| mean(&|f| f.covered[s][i])), 2))
                .collect();
            let hours = if cell.changes() { 41.2 } else { 51.2 } / 3600.0;
            println!(
                "{:?} m {} P_n {} {:?}: {}; {}; {:.1}; {:.2}; {:.2}",
                cell.condition,
                cell.order,
                cell.level,
                cell.realisation,
                join_values(errors[0].into_iter(), 1),
                covered.join(", "),
                mean(&|f| f.alarms) / hours,
                median(found.iter().map(|f| f.delay_s)),
                if cell.changes() {
                    mean(&|f| f64::from(f.delay_s.is_nan()))
                } else {
                    0.0
                }
            );
            of_cells.push(errors);
        }
        medians.push((name.to_owned(), of_cells));
    }
    let Some((name, last)) = medians.pop() else { return };
    for (from, since) in ["30.72", "10"].into_iter().enumerate() {
        println!("{name} over the best of the others, rows from {since} s on: median cell (worst)");
        for (i, column) in COLUMNS.iter().enumerate() {
            let ratios: Vec<f64> = (0..cells.len())
                .map(|cell| {
                    let others = medians.iter().map(|(_, errors)| errors[cell][from][i]);
                    last[cell][from][i] / others.fold(f64::INFINITY, f64::min)
                })
                .collect();
            let worst = ratios.iter().copied().fold(0.0, f64::max);
            println!("  {column}: {:.2} ({worst:.2})", median(ratios.into_iter()));
        }
    }
}
