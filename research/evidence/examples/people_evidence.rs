//! Tracking of recorded people: two joined trials of a person, with the same or with different controlled elements.
//!
//! `HOID_HUMAN_DATA=DIR cargo run --release -p hoid-evidence --example people_evidence -- [METHOD...]`
//!
//! The error is the mean of `|dH|/|H|` over seven lines of the disturbance, relative to the describing function of the
//! person's ten trials with that element, `mean(U/D)/mean(E/D)`. The start span of methods that have one is 5 to 30 s.
//! The jump at a seam does not come from the person: there the filters process the ramp before the second trial,
//! without an update. At a seam without a change, alarms within 12 s are not counted as false alarms. A change is
//! certain if the logarithm of the likelihood ratio for known operators before and after it exceeds 12 within 8 s
//! ([`oracle`]).
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::{env, f64::consts::PI, fs, path::PathBuf};

use hoid_evidence::oracle::{self, TrialRows};
use hoid_evidence::task::{median, on_all_cores};
use hoid_model::{Channel, Record, SampleTime};
use hoid_track::{StartSource, TrackOptions, Tracker};

const PEOPLE: [&str; 3] = ["P03", "P05", "P09"];
const ELEMENTS: [&str; 2] = ["fo", "so"];
/// Harmonics of 1/20 Hz in the disturbance of both elements.
const LINES: [f64; 7] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0];
/// Analysed rows of a trial: whole periods.
const FIRST_ROW: usize = 300;
const ROW_COUNT: usize = 2400;
const RATE_HZ: f64 = 60.0;
const EVALUATION_TIMES_S: [usize; 6] = [2, 4, 8, 13, 18, 28];
const NK: usize = 13;
const SETTLING_S: f64 = 12.0;
const MAX_DETECTION_TIME_S: f64 = 8.0;
const CERTAIN_LOG_RATIO: f64 = 12.0;

/// The error, the output and the disturbance of a trial, and the error and the output of the ramp before it.
struct Trial {
    signals: [Vec<f64>; 3],
    ramp: [Vec<f64>; 2],
}

fn read(folder: &PathBuf, person: &str, element: &str) -> Vec<Trial> {
    let start = format!("{person}_{element}_");
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path())
        .filter(|path| path.file_name().unwrap().to_string_lossy().starts_with(&start))
        .collect();
    files.sort();
    let of = |path: &PathBuf| {
        let text = fs::read_to_string(path).unwrap();
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next().unwrap().split(',').collect();
        let index = |name: &str| header.iter().position(|h| *h == name).unwrap();
        let places = ["r", "y", "u", "d"].map(index);
        let mut all: [Vec<f64>; 3] = Default::default();
        for line in lines {
            let cells: Vec<&str> = line.split(',').collect();
            let [r, y, u, d] = places.map(|p| cells[p].parse::<f64>().unwrap());
            all[0].push(r - y);
            all[1].push(u);
            all[2].push(d);
        }
        // u of a row was read one sample earlier.
        let later = [0, 1, 0];
        let of = |c: usize, from: usize, rows: usize| all[c][from + later[c]..from + later[c] + rows].to_vec();
        Trial {
            signals: [0, 1, 2].map(|c| of(c, FIRST_ROW, ROW_COUNT)),
            ramp: [0, 1].map(|c| of(c, 0, FIRST_ROW)),
        }
    };
    files.iter().map(of).collect()
}

fn omega(line: f64) -> f64 {
    2.0 * PI * line / 20.0
}

fn coefficient(values: &[f64], line: f64) -> [f64; 2] {
    values.iter().enumerate().fold([0.0; 2], |[re, im], (k, v)| {
        let (sin, cos) = (omega(line) * k as f64 / RATE_HZ).sin_cos();
        [re + v * cos, im - v * sin]
    })
}

fn quotient(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let square = b[0] * b[0] + b[1] * b[1];
    [
        (a[0] * b[0] + a[1] * b[1]) / square,
        (a[1] * b[0] - a[0] * b[1]) / square,
    ]
}

fn describing_function(trials: &[Trial]) -> [[f64; 2]; 7] {
    LINES.map(|line| {
        let mean = |channel: usize| {
            trials.iter().fold([0.0; 2], |[re, im], t| {
                let [a, b] = quotient(coefficient(&t.signals[channel], line), coefficient(&t.signals[2], line));
                [re + a, im + b]
            })
        };
        quotient(mean(1), mean(0))
    })
}

fn error(tracker: &Tracker, truth: &[[f64; 2]; 7]) -> f64 {
    let each = LINES
        .iter()
        .zip(truth)
        .map(|(line, t)| match tracker.response(omega(*line)) {
            Some(h) => (h.value[0] - t[0]).hypot(h.value[1] - t[1]) / t[0].hypot(t[1]),
            None => f64::NAN,
        });
    each.sum::<f64>() / LINES.len() as f64
}

struct Run {
    before: f64,
    after: [f64; 6],
    alarms_s: Vec<f64>,
    change: bool,
    certain: bool,
}

/// True if the change from a trial of one cell to a trial of another is certain for known operators.
fn is_certain(before: &[Trial], joined: usize, after: &[Trial], second: usize) -> bool {
    let rows = |trial: &Trial| {
        let of = |c: usize| [trial.ramp[c].as_slice(), &trial.signals[c]].concat();
        TrialRows::new(&of(0), &of(1), FIRST_ROW, 1.0 / RATE_HZ)
    };
    let [before, after] = [before, after].map(|trials| trials.iter().map(rows).collect::<Vec<TrialRows>>());
    let others: Vec<&TrialRows> = (0..after.len()).filter(|i| *i != second).map(|i| &after[i]).collect();
    let before: Vec<&TrialRows> = before.iter().collect();
    let samples = (MAX_DETECTION_TIME_S * RATE_HZ) as usize;
    oracle::log_ratio(&before, joined, &others, &after[second], samples) > CERTAIN_LOG_RATIO
}

fn run(method: &str, first: &Trial, second: &Trial, truths: [&[[f64; 2]; 7]; 2], change: bool) -> Option<Run> {
    let (name, option) = method
        .split_once(':')
        .map_or((method, None), |(name, option)| (name, Some(option)));
    let mut method = hoid_survey::method(name).unwrap();
    if let Some((key, value)) = option.and_then(|o| o.split_once('=')) {
        method.set(key, value).unwrap();
    }
    let ts = SampleTime::new(1.0 / RATE_HZ).unwrap();
    let mut options = TrackOptions::default_for(method, NK);
    options.start = StartSource::Span(Some((5.0, 30.0)));
    let joined = |c: usize| [first.signals[c].clone(), second.signals[c].clone()].concat();
    let record = Record::new(ts, Channel::new("e", "", joined(0)), Channel::new("u", "", joined(1))).unwrap();
    let starts_itself = options.method.is_self_starting();
    let span = record.span(5.0, 30.0).unwrap();
    let mut tracker = Tracker::new(&options, (!starts_itself).then_some(&span), ts).ok()?;
    let mut run = Run {
        before: f64::NAN,
        after: [f64::NAN; 6],
        alarms_s: Vec::new(),
        change,
        certain: false,
    };
    for k in 0..record.len() {
        let t = k as f64 / RATE_HZ;
        let sample = hoid_track::Sample {
            e: record.input()[k],
            u: record.output()[k],
            reference: None,
        };
        if k == ROW_COUNT {
            for (e, u) in second.ramp[0].iter().zip(&second.ramp[1]) {
                let sample = hoid_track::Sample {
                    e: *e,
                    u: *u,
                    reference: None,
                };
                tracker.update(sample, false);
            }
        }
        tracker.update(sample, starts_itself || t >= 30.0);
        if tracker.change().is_some() {
            run.alarms_s.push(t);
        }
        if k + 1 == ROW_COUNT {
            run.before = error(&tracker, truths[0]);
        }
        for (index, at) in run.after.iter_mut().zip(EVALUATION_TIMES_S) {
            if k == ROW_COUNT + at * RATE_HZ as usize {
                *index = error(&tracker, truths[1]);
            }
        }
    }
    Some(run)
}

fn main() {
    let Some(folder) = env::var_os("HOID_HUMAN_DATA") else {
        println!("HOID_HUMAN_DATA does not name the folder of the recorded people");
        return;
    };
    let folder = PathBuf::from(folder);
    let mut methods: Vec<String> = env::args().skip(1).collect();
    if methods.is_empty() {
        methods = ["adaptive", "rls", "multiple-model", "physical", "rpem"]
            .map(str::to_owned)
            .to_vec();
    }
    let mut pairs = Vec::new();
    let cells: Vec<Vec<Trial>> = PEOPLE
        .iter()
        .flat_map(|p| ELEMENTS.map(|e| read(&folder, p, e)))
        .collect();
    let truths: Vec<[[f64; 2]; 7]> = cells.iter().map(|c| describing_function(c)).collect();
    for person in 0..PEOPLE.len() {
        for [a, b] in [[0, 1], [1, 0], [0, 0], [1, 1]] {
            for trial in 0..10 {
                let next = if a == b { (trial + 1) % 10 } else { trial };
                pairs.push(([2 * person + a, trial], [2 * person + b, next]));
            }
        }
    }
    let certain = on_all_cores(pairs.len(), |i| {
        let ([a, i0], [b, i1]) = pairs[i as usize];
        a != b && is_certain(&cells[a], i0, &cells[b], i1)
    });
    println!(
        "{} of {} changes are certain within {MAX_DETECTION_TIME_S} s\n",
        certain.iter().filter(|c| **c).count(),
        pairs.iter().filter(|([a, _], [b, _])| a != b).count()
    );
    println!(
        "| method | before | +2 | +4 | +8 | +13 | +18 | +28 s | mean from +8 | no change, +2 to +28 | found in 5 s | in 8 s | of the certain | seams | alarms/h |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for method in &methods {
        let runs: Vec<Run> = on_all_cores(pairs.len(), |i| {
            let ([a, i0], [b, i1]) = pairs[i as usize];
            let run = run(method, &cells[a][i0], &cells[b][i1], [&truths[a], &truths[b]], a != b)?;
            Some(Run {
                certain: certain[i as usize],
                ..run
            })
        })
        .into_iter()
        .flatten()
        .collect();
        let of = |change: bool, at: usize| median(runs.iter().filter(|r| r.change == change).map(|r| r.after[at]));
        let curve: Vec<f64> = (0..6).map(|at| of(true, at)).collect();
        let still: Vec<String> = (0..6).map(|at| format!("{:.2}", of(false, at))).collect();
        let seam = ROW_COUNT as f64 / RATE_HZ;
        let found = |of: &dyn Fn(&Run) -> bool, within: f64| {
            let these: Vec<&Run> = runs.iter().filter(|r| of(r)).collect();
            let hit = |r: &&&Run| r.alarms_s.iter().any(|t| (seam..seam + within).contains(t));
            these.iter().filter(hit).count() as f64 / these.len() as f64
        };
        let away = |t: &&f64| **t < seam || **t > seam + SETTLING_S;
        let alarms: usize = runs.iter().map(|r| r.alarms_s.iter().filter(away).count()).sum();
        let hours = runs.len() as f64 * (2.0 * seam - SETTLING_S) / 3600.0;
        let figures: Vec<String> = curve.iter().map(|c| format!("{c:.3}")).collect();
        println!(
            "| {method} ({}) | {:.3} | {} | {:.3} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {:.1} |",
            runs.len(),
            median(runs.iter().map(|r| r.before)),
            figures.join(" | "),
            curve[2..].iter().sum::<f64>() / 4.0,
            still.join(" "),
            found(&|r| r.change, 5.0),
            found(&|r| r.change, MAX_DETECTION_TIME_S),
            found(&|r| r.certain, MAX_DETECTION_TIME_S),
            found(&|r| !r.change, MAX_DETECTION_TIME_S),
            alarms as f64 / hours
        );
    }
}
