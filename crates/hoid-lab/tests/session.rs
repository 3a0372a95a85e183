//! A session without a page: batches in the form in which a page sends them, their processing, and the findings after
//! modifications.
#![allow(clippy::unwrap_used)]

#[path = "common/run.rs"]
mod run;

use std::{collections::BTreeMap, fs, path::Path};

use hoid_lab::{
    config::{Condition, Config, Signal},
    plant::InputMap,
    session::{Batch, Event, Frame, RunEnd, RunLog, RunStart, Session, Stem},
    task::{Task, held_inputs},
    verify::{Verification, check},
};
use hoid_model::family_scenario::{Display, Interleaved};

fn config() -> Config {
    Config {
        condition: vec![Condition {
            target: Some(Signal::default()),
            disturbance: Some(Signal {
                rms: 0.2,
                ..Signal::default()
            }),
            controlled_element: "4/(s(0.2s+1))".to_owned(),
            measurement_s: 3.0,
            run_in_s: 1.0,
            runs: 2,
            ..Condition::default()
        }],
        ..Config::default()
    }
}

const INPUT_MAP: InputMap = InputMap {
    centre: 512.25,
    span: 300.0,
    dead: 0.02,
    gain: 3.0,
};

fn start_run(session: &Session, number: usize) -> (RunStart, Task) {
    run::start_run(session, number, INPUT_MAP).unwrap()
}

/// Returns the batches of a run up to a tick, with an event every 8 ms and a frame every 16.7 ms.
fn batches(task: &Task, until: usize) -> Vec<Batch> {
    let events: Vec<Event> = (0..until / 8)
        .map(|k| {
            let stamp = 8.0 * k as f64 + 0.3;
            let raw = 512.0 + 250.0 * ((k % 97) as f64 / 97.0 - 0.5);
            Event::from((stamp.ceil(), stamp, stamp + 0.4, raw))
        })
        .collect();
    let inputs: Vec<(usize, f64)> = events.iter().map(|v| (v.tick as usize, INPUT_MAP.u(v.raw))).collect();
    let u = held_inputs(&inputs, until);
    let signals = task.run(&u);
    let frames: Vec<Frame> = (0..)
        .map(|k| 16.7 * f64::from(k) + 1.0)
        .take_while(|drawn| *drawn < until as f64)
        .map(|drawn| Frame::from((drawn - 0.5, drawn, drawn.floor(), signals.e[drawn as usize])))
        .collect();
    let within = |ms: f64, first: usize| (first as f64..(first + 50) as f64).contains(&ms);
    (0..until)
        .step_by(50)
        .map(|first| {
            let end = (first + 50).min(until);
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

fn log_run(session: &mut Session, until: usize) -> (Stem, RunLog) {
    let number = session.next_run_number().unwrap();
    let (run_start, task) = start_run(session, number);
    let stem = session.stem(&run_start.condition.name, number);
    run_start.write(&stem, &task).unwrap();
    let mut log = RunLog::create(&stem, task.ticks).unwrap();
    for batch in batches(&task, until.min(task.ticks)) {
        log.append(&batch).unwrap();
    }
    (stem, log)
}

fn finished_run(out: &Path) -> (Session, Stem, Verification) {
    let mut session = Session::create(out, &config(), "P01", false).unwrap();
    let (stem, log) = log_run(&mut session, usize::MAX);
    drop(log);
    let checked = session.end_run(&stem, RunEnd::Finished, BTreeMap::new()).unwrap();
    (session, stem, checked)
}

#[test]
fn complete_run_is_verified_and_readable() {
    let dir = tempfile::tempdir().unwrap();
    let (session, stem, checked) = finished_run(dir.path());
    assert!(checked.is_verified(), "{}", checked.reasons());
    assert_eq!(session.finished_runs.len(), 1);
    assert_eq!(session.next_run(), Some(1));
    assert_eq!(checked.measures.ticks, 4000);
    assert!((checked.measures.input_hz - 125.0).abs() < 1.0);
    let run_start = RunStart::read(&stem).unwrap();
    let logged = hoid_lab::session::LoggedRun::read(&stem).unwrap();
    let record = hoid_lab::record::record(&run_start, &run_start.task(&stem).unwrap(), &logged).unwrap();
    let path = stem.file("beh.parquet");
    hoid_io::write_record(&path, &record).unwrap();
    let read = hoid_io::read(&path).unwrap();
    assert_eq!((read.len(), read.time_s(0)), (400, -1.0));
    assert_eq!(read.input(), record.input());
    for name in ["f_t", "d", "y", "e_shown"] {
        assert!(read.channel(name).is_some(), "{name}");
    }
}

/// If the display shows the target, the target has a role in the recording.
#[test]
fn displayed_target_has_a_role_in_the_recording() {
    for (display, role) in [
        (Display::Compensatory, None),
        (Display::Pursuit, Some("feedforward")),
        (Display::Preview, Some("feedforward:0.5")),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let mut config = config();
        let condition = &mut config.condition[0];
        (condition.display, condition.preview_s) = (display, 0.5);
        for (signal, interleaved) in [
            (&mut condition.target, Interleaved::Even),
            (&mut condition.disturbance, Interleaved::Odd),
        ] {
            signal.as_mut().unwrap().interleaved = interleaved;
        }
        let mut session = Session::create(dir.path(), &config, "P01", false).unwrap();
        let (stem, log) = log_run(&mut session, usize::MAX);
        drop(log);
        session.end_run(&stem, RunEnd::Finished, BTreeMap::new()).unwrap();
        let run_start = RunStart::read(&stem).unwrap();
        let logged = hoid_lab::session::LoggedRun::read(&stem).unwrap();
        let record = hoid_lab::record::record(&run_start, &run_start.task(&stem).unwrap(), &logged).unwrap();
        hoid_io::write_record(&stem.file("beh.parquet"), &record).unwrap();
        let read = hoid_io::read(stem.file("beh.parquet")).unwrap();
        let shown = read.channels().find(|channel| channel.name == "f_t").unwrap();
        assert_eq!(shown.role, role.unwrap_or_default());
    }
}

/// Replaces a cell of a line of a file of the run.
fn corrupt(stem: &Stem, end: &str, line: usize, cell: usize, with: impl Fn(f64) -> f64) {
    let path = stem.file(end);
    let text = fs::read_to_string(&path).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[line].split(',').map(str::to_owned).collect();
    cells[cell] = format!("{:?}", with(cells[cell].parse().unwrap()));
    lines[line] = cells.join(",");
    fs::write(&path, lines.join("\n") + "\n").unwrap();
}

/// A modification of a number.
type Change<'a> = &'a dyn Fn(f64) -> f64;

#[test]
fn each_change_gives_its_own_finding() {
    let last_bit = |v: f64| f64::from_bits(v.to_bits() ^ 1);
    let cases: [(&str, usize, Change<'_>, &str); 8] = [
        ("events.csv", 3, &|raw| raw + 1.0, "lab-input"),
        ("events.csv", 1, &|stamp| stamp + 5.0, "lab-event"),
        ("events.csv", 1, &|stamp| stamp - 200.0, "lab-event"),
        ("ticks.csv", 2, &last_bit, "lab-tick"),
        ("ticks.csv", 0, &|tick| tick + 1.0, "lab-ticks"),
        ("frames.csv", 1, &|drawn| drawn + 2.0, "lab-frame"),
        ("frames.csv", 0, &|time| time - 150.0, "lab-frame"),
        ("frames.csv", 3, &last_bit, "lab-frame"),
    ];
    for (file, cell, with, kind) in cases {
        let dir = tempfile::tempdir().unwrap();
        let (_, stem, _) = finished_run(dir.path());
        corrupt(&stem, file, 150, cell, with);
        let checked = check(&stem).unwrap();
        let kinds: Vec<&str> = checked.verdict.findings().iter().map(|finding| finding.kind).collect();
        assert!(kinds.contains(&kind), "{file} {cell}: {kinds:?} lacks {kind}");
        assert!(kinds.contains(&"lab-changed"));
        // The verdict has the reason for this modification, and no other reason.
        let others = ["lab-input", "lab-event", "lab-tick", "lab-ticks", "lab-frame"];
        let own = |other: &&str| *other != kind && kinds.contains(other);
        assert_eq!(others.iter().find(|other| own(other)), None, "{file} {cell}: {kinds:?}");
    }
}

#[test]
fn changed_target_or_element_is_detected() {
    for change in [
        |run_start: &mut RunStart| run_start.replication += 1,
        |run_start: &mut RunStart| run_start.phases[0].plant.b[0] *= 1.001,
    ] {
        let dir = tempfile::tempdir().unwrap();
        let (_, stem, _) = finished_run(dir.path());
        let mut run_start = RunStart::read(&stem).unwrap();
        let task = run_start.task(&stem).unwrap();
        change(&mut run_start);
        run_start.write(&stem, &task).unwrap();
        let checked = check(&stem).unwrap();
        assert!(
            checked.verdict.findings().iter().any(|f| f.kind == "lab-task"),
            "{}",
            checked.reasons()
        );
    }
}

#[test]
fn session_continues_after_the_server_was_killed() {
    let dir = tempfile::tempdir().unwrap();
    let mut session = Session::create(dir.path(), &config(), "P01", true).unwrap();
    let (stem, log) = log_run(&mut session, 1234);
    drop((log, session));
    // The last line is truncated, as if the process was killed while writing it.
    let path = stem.file("ticks.csv");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, &text[..text.len() - 7]).unwrap();
    let folder = Session::folders(dir.path()).unwrap();
    let mut session = Session::open(&folder[0]).unwrap();
    assert_eq!((session.finished_runs.len(), session.next_run()), (1, Some(0)));
    let lost = &session.finished_runs[0];
    assert_eq!((lost.how, lost.verdict.as_str()), (RunEnd::Interrupted, "unverified"));
    assert!(
        lost.reasons.contains("ended after 1233 of 4000 ticks"),
        "{}",
        lost.reasons
    );
    // Two runs with different numbers are made.
    for _ in 0..2 {
        let (stem, log) = log_run(&mut session, usize::MAX);
        drop(log);
        assert!(
            session
                .end_run(&stem, RunEnd::Finished, BTreeMap::new())
                .unwrap()
                .is_verified()
        );
    }
    assert!(session.plan.finished && session.next_run().is_none());
    assert_eq!(Session::read(&folder[0]).unwrap().finished_runs, session.finished_runs);
    assert_eq!(
        session.finished_runs.iter().map(|done| done.number).collect::<Vec<_>>(),
        [1, 2, 3]
    );
}

#[test]
fn non_contiguous_batches_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let mut session = Session::create(dir.path(), &config(), "P01", false).unwrap();
    let (_, mut log) = log_run(&mut session, 100);
    for (first, u, e) in [
        (99, 1, 1),
        (101, 1, 1),
        (100, 2, 1),
        (100, 4000, 4000),
        (usize::MAX, 1, 1),
    ] {
        let batch = Batch {
            first,
            u: vec![0.0; u],
            e: vec![0.0; e],
            ..Batch::default()
        };
        assert!(log.append(&batch).is_err(), "{first}");
    }
    assert_eq!(log.tick_count(), 100);
}

#[test]
fn subjects_are_numbered_and_pseudonyms_checked() {
    let dir = tempfile::tempdir().unwrap();
    let row = |subject: &str| Session::create(dir.path(), &config(), subject, false).unwrap().plan.row;
    assert_eq!(["A", "B", "A", "C"].map(row), [0, 1, 0, 2]);
    for bad in ["", "../x", "P 1", "ü", &"x".repeat(21)] {
        assert!(Session::create(dir.path(), &config(), bad, false).is_err(), "{bad}");
    }
}

/// Files are truncated at any byte, have flipped bits or are deleted, as after power cuts and on full disks: the
/// session opens, its damaged runs are unverified, and it can continue.
#[test]
fn damaged_sessions_still_open() {
    let dir = tempfile::tempdir().unwrap();
    let (mut session, ..) = finished_run(dir.path());
    drop(log_run(&mut session, 777));
    let folder = session.folder.clone();
    let copy = tempfile::tempdir().unwrap();
    let files = hoid_io::file_names(&folder).unwrap();
    let mut state = 7_u64;
    let mut random = move |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % below.max(1)
    };
    for round in 0..1000 {
        for name in hoid_io::file_names(&folder).unwrap() {
            fs::copy(folder.join(&name), copy.path().join(&name)).unwrap();
        }
        let name = &files[random(files.len())];
        let path = copy.path().join(name);
        let mut bytes = fs::read(&path).unwrap();
        let what = random(4);
        match what {
            0 => fs::remove_file(&path).unwrap(),
            1 => {
                let at = random(bytes.len());
                bytes[at] ^= 1 << random(8);
                fs::write(&path, &bytes).unwrap();
            }
            _ => fs::write(&path, &bytes[..random(bytes.len())]).unwrap(),
        }
        let mut opened = Session::open(copy.path()).unwrap_or_else(|error| panic!("{round}, {name}, {what}: {error}"));
        for (_, stem) in Stem::find_all(copy.path()).unwrap() {
            let checked = check(&stem);
            let damaged = name.starts_with(stem.text()) && name.ends_with(".csv") && what != 1;
            assert!(
                !(damaged && checked.is_ok_and(|checked| checked.is_verified())),
                "{round}, {name}, {what}"
            );
        }
        if round % 100 == 0 {
            let (stem, log) = log_run(&mut opened, usize::MAX);
            drop(log);
            assert!(
                opened
                    .end_run(&stem, RunEnd::Finished, BTreeMap::new())
                    .unwrap()
                    .is_verified()
            );
        }
        for name in hoid_io::file_names(copy.path()).unwrap() {
            fs::remove_file(copy.path().join(name)).unwrap();
        }
    }
}

/// Duplicated log entries, matrices of wrong dimensions and a plan of another experiment give findings or errors.
#[test]
fn inconsistent_files_give_findings_or_errors() {
    let dir = tempfile::tempdir().unwrap();
    let (session, stem, _) = finished_run(dir.path());
    let ticks = stem.file("ticks.csv");
    let text = fs::read_to_string(&ticks).unwrap();
    let last = text.lines().last().unwrap().to_owned();
    fs::write(&ticks, format!("{text}{last}\n{last}\n")).unwrap();
    let checked = check(&stem).unwrap();
    assert!(
        checked
            .reasons()
            .contains("found tick 3999 where tick 4000 was expected"),
        "{}",
        checked.reasons()
    );
    let json = stem.file("run.json");
    let run_start = fs::read_to_string(&json).unwrap();
    let mut value: serde_json::Value = serde_json::from_str(&run_start).unwrap();
    value["phases"][0]["a"] = serde_json::json!([]);
    fs::write(&json, value.to_string()).unwrap();
    let message = check(&stem).unwrap().reasons();
    assert!(message.contains("inconsistent sizes"), "{message}");
    // With a preview of eleven days, no memory of this length is allocated.
    let mut value: serde_json::Value = serde_json::from_str(&run_start).unwrap();
    value["condition"]["preview_s"] = serde_json::json!(1e6);
    fs::write(&json, value.to_string()).unwrap();
    let message = check(&stem).unwrap().reasons();
    assert!(
        message.contains("the task cannot be built from its condition"),
        "{message}"
    );
    let toml = session.folder.join("lab.toml");
    let facts = fs::read_to_string(&toml).unwrap();
    let other = facts.replacen("condition = 0", "condition = 9", 1);
    assert_ne!(facts, other);
    fs::write(&toml, &other).unwrap();
    // The session opens if the copy contains the plan.
    assert_eq!(Session::open(&session.folder).unwrap().plan, session.plan);
    fs::write(session.folder.join("lab.copy.toml"), other).unwrap();
    let message = Session::open(&session.folder).unwrap_err().to_string();
    assert!(message.contains("condition index 9, expected below 1"), "{message}");
}

/// `--replay` only reads and does not write.
#[test]
fn reading_a_session_changes_no_file() {
    let dir = tempfile::tempdir().unwrap();
    let (session, ..) = finished_run(dir.path());
    let runs = session.folder.join("runs.csv");
    let cut = fs::read_to_string(&runs).unwrap() + "2,1,half a li";
    fs::write(&runs, &cut).unwrap();
    assert_eq!(Session::read(&session.folder).unwrap().finished_runs.len(), 1);
    assert_eq!(fs::read_to_string(&runs).unwrap(), cut);
    // The next line is written after the last complete line.
    let mut session = Session::open(&session.folder).unwrap();
    let (stem, log) = log_run(&mut session, usize::MAX);
    drop(log);
    session.end_run(&stem, RunEnd::Finished, BTreeMap::new()).unwrap();
    let text = fs::read_to_string(&runs).unwrap();
    assert!(text.lines().count() == 3 && !text.contains("half"), "{text}");
}
