//! The tasks for the comparison of hoid with other programs, as performed by hoid. `cargo xtask bench` runs this
//! example together with the peer programs in `crates/hoid/benches/peers` and makes the table of the book.
//!
//! `cargo run --release -p hoid --example tasks -- DIRECTORY [--task NAME,...] [--seconds S | --times K] [--reproduce
//! M]`
//!
//! The data that all programs share ([`data`]) are written to DIRECTORY. Each task prints one line of JSON,
//! `{"task", "peer", "seconds", "answer"}`, with the median time of as many runs as fit into S seconds (at least five),
//! or of K runs. All tasks except `reproduce` run on one thread (`RAYON_NUM_THREADS=1`).
//!
//! | task | computation |
//! |---|---|
//! | `arx` | ARX, na = 2, nb = 2, nk = 29, with covariance |
//! | `bj` | Box-Jenkins, nb = 2, nd = 1, nf = 2, nk = 29, no start given, initial states estimated, with covariance |
//! | `rls`, `rpem` | only theta after each sample, lambda = 1 - 1/256, P = 0.1 |
//! | `rls trace`, `rpem trace` | `hoid track`: theta, its covariance, innovation and its variance after each sample |
//! | `loop` | one run of C1 with its run-in and given noise, written to existing memory |
//! | `loop with noise` | the same, including the generation of the normal deviates |
//! | `cell` | 100 runs of C1, simulated and fitted by ARX and Box-Jenkins, several runs at a time |
//! | `delays` | Box-Jenkins for nk = 20 to 40: the losses on common samples, and a final fit with the best delay |
//! | `reproduce` | `hoid reproduce` with M replications, on all cores |
//!
//! `-- DIRECTORY --growth NAME N` measures the cost at one problem size ([`growth`]).
#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod data;
mod growth;

use std::{hint::black_box, path::Path, time::Instant};

use data::{NK, TaskData};
use hoid::{
    core::{
        adaptation::Forgetting, covariance::Covariance, delay::DelayLine, error_bars::NoErrorBars,
        predictor::Regressor, recursion::StablePolynomials, rls::Rls, rpem::Rpem, shape::FixedShape,
        ud_covariance::UdCovariance,
    },
    ident::order_selection::Criterion,
    lanes::InstructionSet,
    prelude::*,
    sim::Signals,
    thesis::reproduction::{Reproduction, reproduce},
    track::{Method, StartSource, TrackOptions, track},
};

/// Start of the recursive prediction-error method: b0, b1, d1, f1, f2.
const RPEM_START: [f64; 5] = [0.04, -0.04, -0.8, -1.9, 0.92];
const MEMORY_SAMPLES: f64 = 256.0;
const RUNS_PER_CELL: u64 = 100;
const TASKS: [&str; 10] = [
    "arx",
    "bj",
    "rls",
    "rpem",
    "rls trace",
    "rpem trace",
    "loop",
    "loop with noise",
    "cell",
    "delays",
];

fn main() {
    let mut arguments = std::env::args().skip(1);
    let directory = arguments.next().unwrap();
    let directory = Path::new(&directory);
    let (mut only, mut effort, mut replications) = (Vec::new(), Effort::default(), None);
    while let Some(option) = arguments.next() {
        let mut value = || arguments.next().unwrap();
        match option.as_str() {
            "--task" => only = value().split(',').map(str::to_owned).collect(),
            "--seconds" => effort.seconds = value().parse().unwrap(),
            "--times" => {
                effort = Effort {
                    seconds: 0.0,
                    times: value().parse().unwrap(),
                }
            }
            "--reproduce" => replications = Some(value().parse().unwrap()),
            "--growth" => return growth::measure(&value(), value().parse().unwrap(), &arguments.collect::<Vec<_>>()),
            _ => panic!("unknown option {option}"),
        }
    }
    let shared = TaskData::new();
    shared.write(directory);
    for task in TASKS {
        if only.is_empty() || only.iter().any(|name| name == task) {
            let (seconds, answer) = run(task, &shared, effort);
            print_task(task, seconds, &answer);
        }
    }
    if let Some(replications) = replications {
        let (seconds, answer) = run_reproduction(directory, replications);
        print_task("reproduce", seconds, &answer);
    }
}

fn print_task(task: &str, seconds: f64, answer: &[f64]) {
    let peer = concat!("hoid ", env!("CARGO_PKG_VERSION"));
    println!(
        "{}",
        serde_json::json!({"task": task, "peer": peer, "seconds": seconds, "answer": answer})
    );
}

fn run(task: &str, shared: &TaskData, effort: Effort) -> (f64, Vec<f64>) {
    let record = shared.record.clone();
    let one = std::slice::from_ref(&record);
    let estimator = |structure: Structure| Estimator::new(structure, structure.operator_orders(NK));
    let theta = |fit: &Fit| fit.model().theta().to_vec();
    let (arx, bj) = (estimator(Structure::Arx), estimator(Structure::BoxJenkins));
    match task {
        "arx" => measure_median(effort, || theta(&arx.fit(one).unwrap())),
        "bj" => measure_median(effort, || theta(&bj.fit(one).unwrap())),
        "rls" => {
            let mut history = Vec::with_capacity(record.len());
            measure_median(effort, || rls(record.input(), record.output(), &mut history).to_vec())
        }
        "rpem" => {
            let mut history = Vec::with_capacity(record.len());
            measure_median(effort, || rpem(record.input(), record.output(), &mut history).to_vec())
        }
        "rls trace" | "rpem trace" => {
            let method = if task == "rls trace" {
                Method::rls()
            } else {
                Method::rpem()
            };
            let options = track_options(method);
            measure_median(effort, || {
                let trace = track(&record, &options, 1).unwrap();
                trace.theta(trace.len() - 1).to_vec()
            })
        }
        "loop" => {
            let mut signals = Signals::default();
            measure_median(effort, || {
                shared.simulator.signals_into(&shared.noise, &mut signals).unwrap();
                vec![*signals.e.last().unwrap(), *signals.u.last().unwrap()]
            })
        }
        "loop with noise" => {
            let (mut noise, mut signals) = (shared.noise.clone(), Signals::default());
            let mut replication = 0;
            measure_median(effort, || {
                replication += 1;
                data::run_seed(replication).white_noise_into(&mut noise);
                shared.simulator.signals_into(&noise, &mut signals).unwrap();
            })
            .map_result(|()| Vec::new())
        }
        "cell" => {
            // One run per lane is computed at a time, in existing memory.
            let batch_size = InstructionSet::Best.lane_count().unwrap();
            let (mut noises, mut runs) = (vec![shared.noise.clone(); batch_size], Vec::new());
            measure_median(effort, || {
                let mut records = Vec::with_capacity(RUNS_PER_CELL as usize + batch_size);
                for first_run in (0..RUNS_PER_CELL).step_by(batch_size) {
                    for (noise, replication) in noises.iter_mut().zip(first_run..RUNS_PER_CELL) {
                        data::run_seed(replication).white_noise_into(noise);
                    }
                    let simulator = &shared.simulator;
                    simulator
                        .batched_signals_into(&noises, InstructionSet::Best, &mut runs)
                        .unwrap();
                    let count = (RUNS_PER_CELL - first_run) as usize;
                    records.extend(runs.iter().take(count).map(|run| shared.measured_record(run)));
                }
                let records: Vec<&Record> = records.iter().collect();
                let mut sums = [0.0; 9];
                for (arx, bj) in arx.fit_each(&records).into_iter().zip(bj.fit_each(&records)) {
                    let both = [theta(&arx.unwrap()), theta(&bj.unwrap())].concat();
                    sums.iter_mut().zip(both).for_each(|(sum, value)| *sum += value);
                }
                sums.iter().map(|sum| sum / RUNS_PER_CELL as f64).collect()
            })
        }
        "delays" => {
            let mut ranges = OrderRanges::from(bj.orders);
            ranges.nk = 20..=40;
            measure_median(effort, || choose_orders(&bj, &ranges, Criterion::Loss, one).unwrap()).map_result(|choice| {
                let losses = choice.candidates.iter().map(|c| c.outcome.as_ref().unwrap().loss);
                losses.collect()
            })
        }
        _ => panic!("unknown task {task}"),
    }
}

/// Runs `hoid reproduce`; returns the time and the number of items.
fn run_reproduction(directory: &Path, replications: u64) -> (f64, Vec<f64>) {
    let out = directory.join("reproduction");
    let _ = std::fs::remove_dir_all(&out);
    let wanted = Reproduction {
        replications,
        ..Reproduction::default()
    };
    let start_time = Instant::now();
    let made = reproduce(&wanted, &out, &|_| {}, &|| true).unwrap().unwrap();
    (start_time.elapsed().as_secs_f64(), vec![made.items as f64])
}

fn forgetting_covariance<const N: usize>() -> Covariance<N> {
    let lambda = [1.0 - 1.0 / MEMORY_SAMPLES; N];
    Covariance::new(
        UdCovariance::diagonal([0.1; N]),
        Forgetting::Exponential { lambda },
        [f64::INFINITY; N],
    )
}

/// Recursive least squares from theta = 0; writes theta after each sample.
pub fn rls(e: &[f64], u: &[f64], history: &mut Vec<[f64; 4]>) -> [f64; 4] {
    history.clear();
    let mut recursion = Rls::new(
        FixedShape::<2, 2, 0, 0, 0>,
        [0.0; 4],
        forgetting_covariance::<4>(),
        NoErrorBars,
    )
    .unwrap();
    let mut memory = [0.0; NK];
    let mut delay = DelayLine::new(&mut memory[..]);
    for (&e, &u) in e.iter().zip(u) {
        recursion.step(delay.step(e), u);
        history.push(*recursion.theta());
    }
    *recursion.theta()
}

/// The recursive prediction-error method for Box-Jenkins; writes theta after each sample.
pub fn rpem(e: &[f64], u: &[f64], history: &mut Vec<[f64; 5]>) -> [f64; 5] {
    history.clear();
    let mut recursion = Rpem::<_, 5, 0, _, _>::new(
        FixedShape::<0, 2, 0, 1, 2>,
        Regressor::Gradient,
        StablePolynomials::Predictor,
        RPEM_START,
        forgetting_covariance::<5>(),
        NoErrorBars,
    )
    .unwrap();
    let mut memory = [0.0; NK];
    let mut delay = DelayLine::new(&mut memory[..]);
    for (&e, &u) in e.iter().zip(u) {
        recursion.step(delay.step(e), u);
        history.push(*recursion.theta());
    }
    *recursion.theta()
}

/// Returns the options of `track` with the same start and memory length.
pub fn track_options(method: Method) -> TrackOptions {
    let structure = method.default_structure();
    let start = StartSource::Theta(match method == Method::rls() {
        true => vec![0.0; 4],
        false => RPEM_START.to_vec(),
    });
    let options = TrackOptions {
        start,
        ..TrackOptions::new(method, structure, structure.operator_orders(NK))
    };
    options
        .with(&[("memory", &MEMORY_SAMPLES.to_string()), ("covariance", "0.1")])
        .unwrap()
}

/// Result of a measurement: median time in s, and the last answer.
trait Measurement<T> {
    fn map_result<U>(self, map: impl FnOnce(T) -> U) -> (f64, U);
}

impl<T> Measurement<T> for (f64, T) {
    fn map_result<U>(self, map: impl FnOnce(T) -> U) -> (f64, U) {
        (self.0, map(self.1))
    }
}

/// Duration and number of the runs of a task.
#[derive(Clone, Copy)]
struct Effort {
    seconds: f64,
    times: usize,
}

impl Default for Effort {
    fn default() -> Self {
        Self { seconds: 1.0, times: 5 }
    }
}

/// Runs the work once to warm up, and then at least as long and as often as the effort requires.
fn measure_median<T>(effort: Effort, mut work: impl FnMut() -> T) -> (f64, T) {
    let start_time = Instant::now();
    let mut answer = black_box(work());
    let mut times = Vec::new();
    while times.len() < effort.times || start_time.elapsed().as_secs_f64() < effort.seconds {
        let start_time = Instant::now();
        answer = black_box(work());
        times.push(start_time.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    (times[times.len() / 2], answer)
}
