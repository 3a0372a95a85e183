//! Disks of 64 kB to 4 MB that become full at any time during a session: data reported as logged are present, verified
//! runs remain verified, and the session opens.
//!
//! A disk is a `tmpfs` of that size, which an administrator can mount on Linux; elsewhere the test reports that it is
//! skipped.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used)]

#[path = "common/disk.rs"]
mod disk;
#[path = "common/person.rs"]
mod person;
#[path = "common/run.rs"]
mod run;

use std::{collections::BTreeMap, fs, path::Path};

use disk::{Disk, copy_folder, fill};
use hoid_lab::{
    config::{Condition, Config, Signal},
    plant::InputMap,
    session::{Batch, Event, Frame, LoggedRun, RunEnd, RunLog, Session, Stem},
    task::{Task, held_inputs},
    verify::check,
};
use person::Person;
use serde_json::Value;

const ROUND_COUNT: usize = 200;
const MIN_DISK_KB: f64 = 64.0;
const MAX_DISK_KB: f64 = 4096.0;
const RUN_COUNT: usize = 3;

const INPUT_MAP: InputMap = InputMap {
    centre: 512.0,
    span: 300.0,
    dead: 0.0,
    gain: 1.0,
};

fn config() -> Config {
    Config {
        condition: vec![Condition {
            target: Some(Signal::default()),
            controlled_element: "4/(s(0.2s+1))".to_owned(),
            measurement_s: 3.0,
            run_in_s: 1.0,
            runs: RUN_COUNT,
            ..Condition::default()
        }],
        ..Config::default()
    }
}

fn batches(task: &Task) -> Vec<Batch> {
    let events: Vec<Event> = (0..task.ticks / 8)
        .map(|k| {
            let stamp = 8.0 * k as f64 + 0.3;
            let raw = 512.0 + 250.0 * ((k % 97) as f64 / 97.0 - 0.5);
            Event::from((stamp.ceil(), stamp, stamp + 0.4, raw))
        })
        .collect();
    let inputs: Vec<(usize, f64)> = events.iter().map(|v| (v.tick as usize, INPUT_MAP.u(v.raw))).collect();
    let u = held_inputs(&inputs, task.ticks);
    let signals = task.run(&u);
    let frames: Vec<Frame> = (0..)
        .map(|k| 16.7 * f64::from(k) + 1.0)
        .take_while(|drawn| *drawn < task.ticks as f64)
        .map(|drawn| Frame::from((drawn - 0.5, drawn, drawn.floor(), signals.e[drawn as usize])))
        .collect();
    let within = |ms: f64, first: usize| (first as f64..(first + 50) as f64).contains(&ms);
    (0..task.ticks)
        .step_by(50)
        .map(|first| {
            let end = (first + 50).min(task.ticks);
            Batch {
                first,
                u: u[first..end].to_vec(),
                e: signals.e[first..end].to_vec(),
                events: events.iter().filter(|v| within(v.tick, first)).copied().collect(),
                frames: frames.iter().filter(|f| within(f.drawn_ms, first)).copied().collect(),
            }
        })
        .collect()
}

/// Data reported before the disk was full.
#[derive(Default)]
struct ConfirmedData {
    /// Number of logged ticks of each run.
    ticks: Vec<(Stem, usize)>,
    verified: Vec<Stem>,
}

/// Runs a session whose disk is full from batch `full` until batch `until`.
fn run_session(out: &Path, full: usize, until: usize, told: &mut ConfirmedData) -> Option<Session> {
    let ballast = out.join("ballast");
    let mut session = Session::create(out, &config(), "P01", false).ok()?;
    let mut instant = 0_usize;
    for _ in 0..RUN_COUNT {
        let Ok(number) = session.next_run_number() else { break };
        let Some((run_start, task)) = run::start_run(&session, number, INPUT_MAP) else {
            break;
        };
        let stem = session.stem(&run_start.condition.name, number);
        let log = run_start
            .write(&stem, &task)
            .and_then(|()| RunLog::create(&stem, task.ticks));
        let mut how = RunEnd::Finished;
        if let Ok(mut log) = log {
            told.ticks.push((stem.clone(), 0));
            for batch in batches(&task) {
                if instant == full {
                    fill(&ballast);
                }
                if instant == until {
                    let _ = fs::remove_file(&ballast);
                }
                instant += 1;
                if log.append(&batch).is_err() {
                    how = RunEnd::Interrupted;
                    break;
                }
                told.ticks.last_mut().unwrap().1 = batch.first + batch.u.len();
            }
            let _ = log.sync();
        }
        if session
            .end_run(&stem, how, BTreeMap::new())
            .is_ok_and(|checked| checked.is_verified())
        {
            told.verified.push(stem);
        }
    }
    Some(session)
}

#[test]
fn full_disk_loses_no_confirmed_data() {
    let at = tempfile::tempdir().unwrap();
    let mut state = 54_u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let (mut opened, mut verified, mut broken) = (0, 0, 0);
    for round in 0..ROUND_COUNT {
        let kilobytes = MIN_DISK_KB * (MAX_DISK_KB / MIN_DISK_KB).powf(random());
        let full = (random() * 80.0 * RUN_COUNT as f64) as usize;
        let until = full + (random() * 120.0) as usize;
        let Some(disk) = Disk::mount(at.path(), kilobytes as usize) else {
            eprintln!("skipped: no disk of its own can be mounted here");
            return;
        };
        let mut told = ConfirmedData::default();
        let session = run_session(at.path(), full, until, &mut told);
        let elsewhere = tempfile::tempdir().unwrap();
        let _ = fs::remove_file(at.path().join("ballast"));
        copy_folder(at.path(), elsewhere.path());
        drop(disk);
        let moved = |path: &Path| elsewhere.path().join(path.strip_prefix(at.path()).unwrap());
        let Some(session) = session else {
            assert!(told.ticks.is_empty());
            continue;
        };
        let folder = moved(&session.folder);
        let again = Session::open(&folder).unwrap_or_else(|error| panic!("{round}, {kilobytes:.0} kB: {error}"));
        opened += 1;
        for (number, stem) in Stem::find_all(&folder).unwrap() {
            let same = |other: &&Stem| other.text() == stem.text();
            let ticks = told
                .ticks
                .iter()
                .find(|(other, _)| same(&other))
                .map_or(0, |(_, ticks)| *ticks);
            let logged = LoggedRun::read(&stem).unwrap();
            assert!(
                logged.numbers.len() >= ticks,
                "{round}, run {number}: {} of {ticks}",
                logged.numbers.len()
            );
            if told.verified.iter().any(|other| same(&other)) {
                assert!(check(&stem).unwrap().is_verified(), "{round}, run {number}");
                assert!(
                    again
                        .finished_runs
                        .iter()
                        .any(|done| done.number == number && done.verdict == "verified")
                );
                verified += 1;
            } else if ticks < 4000 {
                broken += 1;
            }
        }
        // The session can be continued.
        assert!(again.next_run_number().is_ok());
        again.save().unwrap();
    }
    assert!(
        opened > ROUND_COUNT / 2 && verified > ROUND_COUNT / 4 && broken > ROUND_COUNT / 4,
        "{opened} {verified} {broken}"
    );
}

/// If the disk becomes full while a person tracks, the page is notified at once, the run does not count, and the
/// session continues.
#[test]
fn full_disk_ends_the_run_and_notifies_the_page() {
    let at = tempfile::tempdir().unwrap();
    let Some(_disk) = Disk::mount(at.path(), 2048) else {
        eprintln!("skipped: no disk of its own can be mounted here");
        return;
    };
    let mut person = Person::start_session(at.path(), config());
    let ballast = at.path().join("ballast");
    person.start_next_run(1).unwrap();
    person.track(1, 0..500).unwrap();
    fill(&ballast);
    let message = person.track(1, 500..4000).unwrap_err();
    let told =
        "run-01_ticks.csv: No space left on device (os error 28). The run was ended and does not count; free space";
    assert!(message.contains(told), "{message}");
    // Messages of the page in the meantime are ignored, and the pages see that no run is in progress.
    person.track(1, 3000..3100).unwrap();
    assert_eq!(person.state()["running"], Value::Null);
    // No run starts while the disk is full.
    let message = person.start_next_run(2).unwrap_err();
    assert!(
        message.contains("No space left") && message.contains("free space"),
        "{message}"
    );
    fs::remove_file(&ballast).unwrap();
    let folder = at.path().join("sub-P01/ses-01");
    let number = 1 + Stem::find_all(&folder).unwrap().last().unwrap().0;
    person.start_next_run(number).unwrap();
    person.track(number, 0..4000).unwrap();
    // A run that cannot be closed is not verified.
    fill(&ballast);
    let message = person.finish(number).unwrap_err();
    assert!(
        message.contains("free space on the disk and start the run again"),
        "{message}"
    );
    assert_eq!(person.state()["next"], 0);
    fs::remove_file(&ballast).unwrap();
    person.start_next_run(number + 1).unwrap();
    person.track(number + 1, 0..4000).unwrap();
    person.finish(number + 1).unwrap();
    assert_eq!(person.state()["next"], 1);
    drop(person);
    let session = Session::open(&folder).unwrap();
    let verdict = |number: usize| {
        let done = session.finished_runs.iter().find(|done| done.number == number);
        done.map(|done| done.verdict.as_str())
    };
    for number in [1, number] {
        assert_eq!(verdict(number), Some("unverified"), "run {number}");
    }
    assert_eq!(session.next_run(), Some(1));
}
