//! Events of the guard on unmodified recordings, and on recordings with inserted faults.
//!
//! `HOID_PILOT_DATA=DIR cargo run --release -p hoid-evidence --example recorded_faults --
//! [RUNS|all] [METHOD]`
//!
//! The folder is the same as for the example `pilots_evidence`. For the unmodified recordings, the first line counts
//! the reported events by kind. Each fault of the study `tracker-faults` that is short enough for a recording, and also
//! steps and ramps of a target, is inserted at two places. The column *told* counts the faults with an event between
//! their first sample and 3 s after their last sample that the unmodified recording does not have there.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../../../crates/hoid/tests/common/tracker_faults/faults.rs"]
mod faults;

use std::{collections::BTreeMap, env};

use faults::{Fault, Signal, faults};
use hoid::model::SampleTime;
use hoid_evidence::pilots;
use hoid_track::{GuardEvent, Sample, TrackOptions, Tracker};
use rayon::prelude::*;

/// Places of the inserted faults, s after the start, and the largest length of a fault.
const FAULT_TIMES_S: [f64; 2] = [33.3, 47.77];
const MAX_LENGTH_S: f64 = 20.0;
/// Time after a fault in which it may be reported, s.
const REPORT_WINDOW_S: f64 = 3.0;

struct Recording {
    e: Vec<f64>,
    u: Vec<f64>,
    sample_time: SampleTime,
}

fn guard_events(recording: &Recording, e: &[f64], u: &[f64], method: &str) -> Vec<(usize, GuardEvent)> {
    let method = hoid_survey::method(method).unwrap();
    let options = TrackOptions::without_prior(method, recording.sample_time);
    let mut tracker = Tracker::new(&options, None, recording.sample_time).unwrap();
    let mut all = Vec::new();
    for (k, (e, u)) in e.iter().zip(u).enumerate() {
        let sample = Sample {
            e: *e,
            u: *u,
            reference: None,
        };
        tracker.update(sample, true);
        all.extend(tracker.event().map(|event| (k, event)));
    }
    all
}

/// Returns the faults of the study that are short enough for a recording, and others.
fn all_faults() -> Vec<Fault> {
    let short = |fault: &Fault| match *fault {
        Fault::Scaled { factor, .. } => Fault::Scaled {
            factor,
            seconds: MAX_LENGTH_S,
        },
        Fault::ScaledOne { signal, factor, .. } => Fault::ScaledOne {
            signal,
            factor,
            seconds: MAX_LENGTH_S,
        },
        Fault::Swapped { .. } => Fault::Swapped { seconds: MAX_LENGTH_S },
        Fault::Silence { .. } => Fault::Silence { seconds: MAX_LENGTH_S },
        Fault::NoisySilence { .. } => Fault::NoisySilence { seconds: MAX_LENGTH_S },
        Fault::FrozenBoth { .. } => Fault::FrozenBoth { seconds: MAX_LENGTH_S },
        Fault::MissingBoth { .. } => Fault::MissingBoth { seconds: MAX_LENGTH_S },
        Fault::Saturated { signal, at, .. } => Fault::Saturated {
            signal,
            at,
            seconds: MAX_LENGTH_S,
        },
        Fault::Flipped { .. } => Fault::Flipped { seconds: MAX_LENGTH_S },
        other => other,
    };
    let mut all: Vec<Fault> = Vec::new();
    for fault in faults().iter().map(short) {
        if !all.contains(&fault) && !matches!(fault, Fault::Innovations { .. }) {
            all.push(fault);
        }
    }
    for signal in [Signal::E, Signal::U] {
        all.push(Fault::Frozen { signal, seconds: 5.0 });
        for size in [2.0, 3.0] {
            all.push(Fault::Outlier {
                signal,
                size,
                seconds: 0.0,
            });
        }
    }
    all.push(Fault::FrozenBoth { seconds: 2.5 });
    all.push(Fault::Outlier {
        signal: Signal::E,
        size: 2.0,
        seconds: 1e3,
    });
    all.push(Fault::Outlier {
        signal: Signal::E,
        size: 6.0,
        seconds: 1e3,
    });
    all
}

fn main() {
    let Some(folder) = pilots::folder() else { return };
    let folder = folder.as_path();
    let mut arguments = env::args().skip(1);
    let runs = arguments.next().unwrap_or_else(|| "all".to_owned());
    let method = arguments.next().unwrap_or_else(|| "adaptive".to_owned());
    let names = pilots::recording_names(folder, &runs);
    let recordings: Vec<Recording> = names
        .iter()
        .map(|name| {
            let (record, first) = pilots::read(folder, name);
            Recording {
                e: record.input()[first..].to_vec(),
                u: record.output()[first..].to_vec(),
                sample_time: record.sample_time(),
            }
        })
        .collect();
    let clean: Vec<Vec<(usize, GuardEvent)>> = recordings
        .par_iter()
        .map(|r| guard_events(r, &r.e, &r.u, &method))
        .collect();
    let mut kinds = BTreeMap::<&str, usize>::new();
    for (name, (_, event)) in names
        .iter()
        .zip(&clean)
        .flat_map(|(n, all)| all.iter().map(move |e| (n, e)))
    {
        *kinds.entry(event.kind.name()).or_default() += 1;
        if env::var_os("HOID_EACH").is_some() {
            println!("{name} {event:?}");
        }
    }
    let some = clean.iter().filter(|events| !events.is_empty()).count();
    println!(
        "Without a fault, {} recordings, {method}: {kinds:?}, in {some} recordings.\n",
        names.len()
    );
    println!("| fault | told |\n|---|---|");
    for fault in all_faults() {
        let found: Vec<bool> = recordings
            .par_iter()
            .zip(&clean)
            .flat_map_iter(|(r, clean)| {
                let (fault, method) = (&fault, &method);
                FAULT_TIMES_S.map(move |at_s| {
                    let per_second = 1.0 / r.sample_time.s();
                    let at = (at_s * per_second) as usize;
                    let (mut e, mut u) = (r.e.clone(), r.u.clone());
                    let end = fault.insert(&mut e, &mut u, at, per_second, 0.0);
                    let until = end.min(e.len()) + (REPORT_WINDOW_S * per_second) as usize;
                    let within = |k: usize| k >= at && k < until;
                    let without: Vec<_> = clean.iter().filter(|(k, _)| within(*k)).collect();
                    let with = guard_events(r, &e, &u, method);
                    let mut with = with.iter().filter(|(k, _)| within(*k));
                    with.any(|event| !without.contains(&event))
                })
            })
            .collect();
        let count = found.iter().filter(|told| **told).count();
        println!("| {fault} | {count} of {} |", found.len());
    }
}
