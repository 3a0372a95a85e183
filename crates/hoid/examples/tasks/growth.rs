//! Cost of one task at one problem size, in a separate process, so that its peak memory is measured separately.
//!
//! | name | N is |
//! |---|---|
//! | `arx`, `bj`, `rls`, `rpem` | samples of the record; the recursions use `track` with one row per sample |
//! | `arx parameters`, `rls parameters` | parameters, half of them in A, with 8192 samples |
//! | `bj parameters` | parameters, all except four of them in D, with 8192 samples |
//!
//! Prints `{"seconds", "data_bytes", "before_bytes", "peak_bytes"}`: the time of one run (after a warm-up run, if runs
//! are short), the size of e and u, and the largest resident memory before and after the run (Linux).

use std::{hint::black_box, time::Instant};

use hoid::{
    prelude::*,
    track::{Method, StartSource, TrackOptions, track},
};

use super::{data::NK, track_options};

/// Number of samples in the tables over parameters.
const SAMPLE_COUNT: usize = 8192;
/// A run shorter than this time is repeated, s.
const MIN_DURATION_S: f64 = 0.3;

pub fn measure(name: &str, n: usize, further: &[String]) {
    let (samples, parameters) = match name.split_once(' ') {
        Some((_, "parameters")) => (SAMPLE_COUNT, Some(n)),
        _ => (n, None),
    };
    let record = record(samples);
    if let [file] = further {
        return write_record(&record, file);
    }
    let work = task_closure(name, parameters);
    let before = peak_memory();
    let start_time = Instant::now();
    work(&record);
    let mut seconds = start_time.elapsed().as_secs_f64();
    let peak = peak_memory();
    if seconds < MIN_DURATION_S {
        let mut times: Vec<f64> = (0..(MIN_DURATION_S / seconds).clamp(3.0, 200.0) as usize)
            .map(|_| {
                let start_time = Instant::now();
                work(&record);
                start_time.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        seconds = times[times.len() / 2];
    }
    println!(
        "{}",
        serde_json::json!({"seconds": seconds, "data_bytes": 16 * samples, "before_bytes": before, "peak_bytes": peak})
    );
}

fn task_closure(name: &str, parameters: Option<usize>) -> Box<dyn Fn(&Record)> {
    let (method, _) = name.split_once(' ').unwrap_or((name, ""));
    let half = |p: usize| Orders {
        na: p / 2,
        nb: p - p / 2,
        ..Structure::Arx.operator_orders(NK)
    };
    match method {
        "arx" | "bj" => {
            let structure = if method == "arx" {
                Structure::Arx
            } else {
                Structure::BoxJenkins
            };
            let mut orders = structure.operator_orders(NK);
            if let Some(p) = parameters {
                orders = if method == "arx" {
                    half(p)
                } else {
                    Orders { nd: p - 4, ..orders }
                };
            }
            let estimator = Estimator::new(structure, orders);
            Box::new(move |record| {
                black_box(estimator.fit(std::slice::from_ref(record)).unwrap());
            })
        }
        "rls" | "rpem" => {
            let mut options = track_options(if method == "rls" { Method::rls() } else { Method::rpem() });
            if let Some(p) = parameters {
                options = TrackOptions {
                    start: StartSource::Theta(vec![0.0; p]),
                    orders: half(p),
                    ..options
                };
            }
            Box::new(move |record| {
                black_box(track(record, &options, 1).unwrap());
            })
        }
        _ => panic!("unknown {name}"),
    }
}

/// Returns a record of the operator in an open loop: slow noise passed through the held operator, with autoregressive
/// noise added to the output. It is made without additional memory, because the memory of the estimators is measured.
fn record(samples: usize) -> Record {
    let mut state = 1_u64;
    let mut uniform = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let (mut e, mut u) = (Vec::with_capacity(samples), Vec::with_capacity(samples));
    let (mut slow, mut w, mut noise) = ([0.0; 2], [0.0; 2], 0.0);
    for t in 0..samples {
        slow[0] = 0.97 * slow[0] + uniform();
        slow[1] = 0.9 * slow[1] + 0.1 * slow[0];
        e.push(slow[1]);
        let at = |lag: usize| t.checked_sub(lag).map_or(0.0, |t| e[t]);
        let response = 0.0443 * at(NK) - 0.0432 * at(NK + 1) + 1.9121 * w[0] - 0.9243 * w[1];
        w = [response, w[0]];
        noise = 0.85 * noise + 0.02 * uniform();
        u.push(response + noise);
    }
    let (e, u) = (Channel::new("e", "deg", e), Channel::new("u", "deg", u));
    Record::new(SampleTime::AT_100_HZ, e, u).unwrap()
}

/// Writes the record for the command-line program instead.
fn write_record(record: &Record, file: &str) {
    hoid::io::write_record(std::path::Path::new(file), record).unwrap();
}

/// Returns the largest resident memory so far, bytes; zero if the system does not report it.
fn peak_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib = line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok());
    kib.unwrap_or(0) * 1024
}
