//! `hoid stream` through real pipes.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    fmt::Write as _,
    io::{BufRead, BufReader, Read, Write},
    path::Path,
    process::{Child, ChildStdin, Command, ExitStatus, Stdio},
    sync::mpsc::{Receiver, channel},
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;
use tempfile::TempDir;

use common::{failure_of, json, stdout_of, with_physical_method};

/// Timeout for a line: much longer than its latency, so that no test fails on a slow machine, and a missing line does
/// not block a test.
const LINE_TIMEOUT: Duration = Duration::from_secs(60);
const NO_WARM_UP_OPTIONS: [&str; 8] = [
    "--method", "rpem", "--nk", "29", "--orders", "nd=1", "--start", "nothing",
];

/// A running stream.
struct Stream {
    child: Child,
    input: Option<ChildStdin>,
    lines: Receiver<String>,
}

impl Stream {
    fn new(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_hoid"))
            .args(["stream", "--fs", "100"])
            .args(with_physical_method(arguments))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, lines) = channel();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        thread::spawn(move || {
            loop {
                let mut line = String::new();
                match out.read_line(&mut line) {
                    Ok(n) if n > 0 => {}
                    _ => return,
                }
                if sender.send(line).is_err() {
                    return;
                }
            }
        });
        Self {
            input: child.stdin.take(),
            child,
            lines,
        }
    }

    fn write(&mut self, text: &str) {
        let input = self.input.as_mut().unwrap();
        input.write_all(text.as_bytes()).unwrap();
        input.flush().unwrap();
    }

    fn next_line(&self) -> Value {
        let line = self.lines.recv_timeout(LINE_TIMEOUT).unwrap();
        assert!(line.ends_with('\n'), "{line}");
        serde_json::from_str(&line).unwrap()
    }

    fn request(&mut self, line: &str) -> Value {
        self.write(&format!("{line}\n"));
        self.next_line()
    }

    fn interrupt(&self) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    }

    /// Waits for the end of the stream; returns the exit status, the remaining lines, and the messages.
    fn end(mut self) -> (ExitStatus, Vec<String>, String) {
        drop(self.input.take());
        let start_time = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(start_time.elapsed() < LINE_TIMEOUT, "the stream does not end");
            thread::sleep(Duration::from_millis(2));
        };
        let mut said = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
        assert!(!said.contains("panicked"), "{said}");
        (status, self.lines.iter().collect(), said)
    }
}

fn wave(k: usize) -> (f64, f64) {
    let t = k as f64 / 100.0;
    (
        (1.7 * t).sin() + 0.5 * (9.1 * t).sin(),
        0.1 * (1.7 * t - 0.8).sin() + 0.03 * (23.0 * t).cos(),
    )
}

/// Sends a whole text and collects the answers.
fn collect_answers(arguments: &[&str], text: &str) -> (Vec<Value>, String) {
    let mut stream = Stream::new(arguments);
    let mut input = stream.input.take().unwrap();
    let text = text.to_owned();
    let writer = thread::spawn(move || input.write_all(text.as_bytes()).unwrap());
    writer.join().unwrap();
    let (status, lines, said) = stream.end();
    let lines: Vec<Value> = lines.iter().map(|l| serde_json::from_str(l).unwrap()).collect();
    // A stream that ends within the warm-up has no estimate.
    let without = lines.last().is_some_and(|line| line.get("warm_up").is_some());
    assert_eq!(status.code(), Some(i32::from(without)), "{said}");
    (lines, said)
}

/// Returns a simulated run as text, and writes it to `c.csv`.
fn simulated_run_text(directory: &Path, seed: &str) -> String {
    let text = stdout_of(
        directory,
        &["simulate", "--condition", "C4", "--seed", seed, "--out", "-"],
    );
    stdout_of(
        directory,
        &["simulate", "--condition", "C4", "--seed", seed, "--out", "c.csv"],
    );
    assert_eq!(text, std::fs::read_to_string(directory.join("c.csv")).unwrap());
    text
}

#[test]
fn each_line_is_answered_at_once() {
    let mut stream = Stream::new(&NO_WARM_UP_OPTIONS);
    for k in 0..200 {
        let (e, u) = wave(k);
        let line = stream.request(&format!("{e},{u}"));
        assert!((line["t"].as_f64().unwrap() - k as f64 / 100.0).abs() < 1e-9);
        let names: Vec<&String> = line["parameters"].as_object().unwrap().keys().collect();
        assert_eq!(names, ["b0", "b1", "d1", "f1", "f2"]);
        assert!(line["innovation"].is_f64() && line["operator"]["convertible"].is_boolean());
        assert_eq!((&line["skipped"], &line["dropped"]), (&0.into(), &0.into()));
        assert!(line["shortened"].is_u64() && line.get("fault").is_none() && line.get("warm_up").is_none());
    }
    let (status, rest, said) = stream.end();
    assert!(
        status.success() && rest.is_empty() && said.contains("200 samples"),
        "{said}"
    );
}

#[test]
fn stream_of_a_simulation_matches_track() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let mut simulate = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(["simulate", "--condition", "C4", "--seed", "3", "--out", "-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(["stream", "--fs", "100", "--method", "physical"])
        .stdin(simulate.stdout.take().unwrap())
        .output()
        .unwrap();
    assert!(simulate.wait().unwrap().success() && output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    let lines: Vec<Value> = text.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    assert_eq!(lines.len(), 8192);
    assert_eq!(lines[0]["warm_up"], serde_json::json!({"collected": 1, "needed": 2000}));
    assert!(lines[1998]["parameters"].is_null() && lines[1999]["parameters"]["b0"]["value"].is_f64());
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("method: physical") && said.contains("nk=29"), "{said}");
    // With the same fit of the first 20 s and the same samples, the numbers are the same.
    simulated_run_text(d, "3");
    let tracked = json(
        d,
        &[
            "track",
            "c.csv",
            "--method",
            "physical",
            "--start-span",
            "0..20",
            "--out",
            "trace.csv",
            "--json",
        ],
    );
    let last = lines.last().unwrap();
    assert_eq!(last["parameters"], tracked["last"]["parameters"]);
    assert_eq!(last["operator"], tracked["last"]["operator"]);
    assert_eq!(last["innovation"], tracked["last"]["innovation"]);
}

#[test]
fn default_method_answers_from_the_second_second() {
    let directory = TempDir::new().unwrap();
    let text = simulated_run_text(directory.path(), "7");
    let rows = text.lines().filter(|l| !l.starts_with(['#', 't']));
    let run: Vec<String> = rows
        .map(|row| row.split(',').skip(2).take(2).collect::<Vec<_>>().join(","))
        .collect();
    let arguments = [
        "--method",
        "adaptive",
        "--at",
        "2.5",
        "--controlled-element",
        "90/(s(s+6))",
    ];
    let (lines, said) = collect_answers(&arguments, &(run.join("\n") + "\n"));
    assert!(
        said.contains("started at once") && said.contains("method: adaptive"),
        "{said}"
    );
    assert!(lines.iter().all(|line| line.get("warm_up").is_none()));
    assert!(lines[50]["response"][0]["gain_db"].is_null());
    assert_eq!(lines[50]["open_loop"]["reason"], "there is no estimate yet");
    let error = |k: usize| lines[k]["response"][0]["gain_db"]["standard_error"].as_f64().unwrap();
    assert!(error(105) > error(1000) && error(1000) > error(8000));
    assert_eq!(lines[105]["operator"]["omega_nm"]["determined"], false);
    let last = lines.last().unwrap();
    assert!(
        last["open_loop"]["crossover_rad_s"]["standard_error"].is_f64(),
        "{last}"
    );
    assert!(last["open_loop"]["phase_margin_deg"]["value"].is_f64(), "{last}");
}

#[test]
fn hostile_lines_are_counted_and_have_no_effect() {
    let mut stream = Stream::new(&NO_WARM_UP_OPTIONS);
    let sound = |stream: &mut Stream, from: usize| {
        let mut last = Value::Null;
        for k in from..from + 300 {
            let (e, u) = wave(k);
            last = stream.request(&format!("{e},{u}"));
        }
        last
    };
    let before = sound(&mut stream, 0);
    assert_eq!(before["skipped"], 0);
    let long = "7".repeat(200_000);
    let hostile = [
        ("NaN,0.1", "e is NaN"),
        ("0.1,inf", "u is inf"),
        ("1e300,0.1", "e is 1e300"),
        ("0.1,-1e300", "u is -1e300"),
        (",", "e is missing; u is missing"),
        ("0.1,", "u is missing"),
        ("abc,0.1", "e is \"abc\", not a number"),
        ("complete garbage", "1 cells, expected 2"),
        ("1,2,3", "3 cells, expected 2"),
        (long.as_str(), "longer"),
        ("e,u", "not a number"),
        ("\u{1}\u{2}", "cells"),
    ];
    let mut skipped = 0;
    for (text, fault) in hostile {
        let line = stream.request(text);
        skipped += 1;
        assert!(line["fault"].as_str().unwrap().contains(fault), "{line}");
        assert_eq!(line["skipped"], skipped, "{line}");
        assert!(line["innovation"].is_null());
        // The estimate stays constant.
        assert_eq!(line["parameters"], before["parameters"]);
    }
    // Blank lines and comments are ignored.
    stream.write("\n   \n# a comment\n\r\n");
    let after = sound(&mut stream, 300);
    assert_eq!(after["skipped"], skipped);
    for (name, p) in after["parameters"].as_object().unwrap() {
        assert!(p["value"].as_f64().unwrap().abs() < 10.0, "{name}: {p}");
    }
    let (status, rest, said) = stream.end();
    assert!(status.success() && rest.is_empty(), "{rest:?}");
    assert!(said.contains("612 samples: 12 skipped"), "{said}");
}

#[test]
fn outliers_and_faulty_spans_are_reported_in_their_lines() {
    let directory = TempDir::new().unwrap();
    let text = simulated_run_text(directory.path(), "5");
    let mut lines: Vec<String> = Vec::new();
    for (k, row) in text.lines().filter(|l| !l.starts_with(['#', 't'])).enumerate() {
        let cells: Vec<f64> = row.split(',').map(|c| c.parse().unwrap()).collect();
        let (e, u) = (cells[2], cells[3]);
        let (e, u) = match k {
            2500 => (100.0, u),
            3000..4000 => (1e6 * e, 1e6 * u),
            _ => (e, u),
        };
        lines.push(format!("{e},{u}"));
    }
    let arguments = ["--nk", "29", "--orders", "nd=1", "--largest", "1e300"];
    let (answers, said) = collect_answers(&arguments, &(lines.join("\n") + "\n"));
    let events: Vec<(usize, &Value)> = answers
        .iter()
        .enumerate()
        .filter_map(|(k, a)| Some((k, a.get("event")?)))
        .collect();
    let of = |kind: &str, action: &str| {
        let found = events.iter().find(|(_, e)| e["kind"] == kind && e["action"] == action);
        found.unwrap_or_else(|| panic!("{kind} {action}: {events:?}"))
    };
    let (at, held) = of("spike", "held");
    assert_eq!(
        (*at, &held["from"], &held["channel"]),
        (2501, &25.0.into(), &"e".into())
    );
    let (paused, _) = of("scale", "paused");
    let (restarted, span) = of("scale", "restarted");
    assert!(
        (3000..3030).contains(paused) && (4200..4500).contains(restarted),
        "{events:?}"
    );
    assert!((span["from"].as_f64().unwrap() - 30.0).abs() < 0.2, "{span}");
    // During the pause the estimate is constant, and the verdict is never trustworthy.
    assert!((paused + 1..*restarted).all(|k| answers[k]["level"] != "trustworthy"));
    assert_eq!(answers[paused + 1]["parameters"], answers[restarted - 1]["parameters"]);
    let last = answers.last().unwrap();
    assert_eq!(
        (&last["restarts"], &last["level"]),
        (&1.into(), &"trustworthy".into()),
        "{last}"
    );
    assert!(said.contains("restarted 1 time."), "{said}");
}

#[test]
fn idle_start_prolongs_the_warm_up() {
    let directory = TempDir::new().unwrap();
    let text = simulated_run_text(directory.path(), "6");
    let rows = text.lines().filter(|l| !l.starts_with(['#', 't']));
    let run: Vec<String> = rows
        .map(|row| row.split(',').skip(2).take(2).collect::<Vec<_>>().join(","))
        .collect();
    let (_, without) = collect_answers(&["--orders", "nd=1"], &(run.join("\n") + "\n"));
    let all = vec!["0,0".to_owned(); 1500]
        .into_iter()
        .chain(run)
        .collect::<Vec<_>>()
        .join("\n")
        + "\n";
    let (answers, said) = collect_answers(&["--orders", "nd=1"], &all);
    // The delay agrees to within a sample with the delay for the run alone, because the warm-up ends some samples
    // later.
    let nk = |said: &str| {
        said.split("nk=")
            .nth(1)
            .unwrap()
            .split(' ')
            .next()
            .unwrap()
            .parse::<i32>()
            .unwrap()
    };
    assert!(
        (nk(&said) - nk(&without)).abs() <= 1 && (28..=30).contains(&nk(&said)),
        "{said}{without}"
    );
    let reason = answers[2100]["warm_up"]["reason"].as_str().unwrap();
    assert!(reason.contains("neither e nor u moved for 15."), "{reason}");
    let began = answers.iter().position(|a| a.get("warm_up").is_none()).unwrap();
    assert!((3490..3560).contains(&began), "{began}");
}

#[test]
fn missing_lines_are_bridged_and_late_lines_dropped() {
    let mut stream = Stream::new(&NO_WARM_UP_OPTIONS);
    stream.write("t;e;u;f_t\n");
    let row = |k: usize| {
        let (e, u) = wave(k);
        format!("{};{e};{u};0.5", k as f64 / 100.0)
    };
    for k in 0..50 {
        assert!(stream.request(&row(k)).get("fault").is_none());
    }
    let line = stream.request(&row(53));
    assert!(line["fault"].as_str().unwrap().contains("3 samples missing"), "{line}");
    assert_eq!((&line["skipped"], &line["dropped"]), (&3.into(), &0.into()));
    assert!(line["innovation"].is_f64());
    let line = stream.request(&row(53));
    assert!(line["fault"].as_str().unwrap().contains("not later"), "{line}");
    assert_eq!((&line["skipped"], &line["dropped"]), (&3.into(), &1.into()));
    let line = stream.request("x;1;2;3");
    assert!(line["fault"].as_str().unwrap().contains("t is \"x\""), "{line}");
    assert_eq!((&line["skipped"], &line["dropped"]), (&3.into(), &2.into()));
    assert!(stream.request(&row(54)).get("fault").is_none());
    // Ten seconds of a pause of one minute are filled.
    let line = stream.request(&row(6054));
    assert!(line["fault"].as_str().unwrap().contains("10 s are bridged"), "{line}");
    assert_eq!(line["skipped"], 1003);
    assert!(stream.request(&row(6055)).get("fault").is_none());
    let (status, _, said) = stream.end();
    assert!(status.success() && said.contains("2 lines dropped"), "{said}");
}

#[test]
fn stream_without_samples_exits_with_one() {
    let mut stream = Stream::new(&NO_WARM_UP_OPTIONS);
    stream.write("t;e;u\n");
    for k in 0..5 {
        let line = stream.request(&format!("0,0{k};0,{k};-0,{k}"));
        assert!(line["fault"].as_str().unwrap().contains("dropped"), "{line}");
    }
    let (status, _, said) = stream.end();
    assert_eq!(status.code(), Some(1), "{said}");
    assert!(
        said.contains("no line of the stream contained a sample (5 lines dropped)"),
        "{said}"
    );
}

#[test]
fn stream_without_estimate_exits_with_one() {
    let rows = |row: &dyn Fn(usize) -> String, n: usize| (0..n).map(row).collect::<String>();
    let short = rows(&|k| format!("{},{}\n", wave(k).0, wave(k).1), 50);
    let texts = format!("t,e,u\n{}", rows(&|k| format!("{},abc,def\n", k as f64 / 100.0), 2999));
    let zeros = rows(&|_| "0,0\n".to_owned(), 3000);
    let methods: [&[&str]; 2] = [&["--method", "adaptive"], &NO_WARM_UP_OPTIONS];
    for (text, reason, methods) in [
        ("", "contained no samples", &methods[..]),
        ("t,e,u\n", "contained no samples", &methods[..]),
        (&short, "after 50 samples", &methods[..1]),
        (&texts, "2999 with a fault", &methods[..1]),
        (&zeros, "in which e and u move", &methods[..1]),
    ] {
        for method in methods {
            let mut stream = Stream::new(&[*method, &["--every", "100"]].concat());
            stream.write(text);
            let (status, _, said) = stream.end();
            assert_eq!(status.code(), Some(1), "{said}");
            assert!(said.contains("error: ") && said.contains(reason), "{reason}: {said}");
        }
    }
}

#[test]
fn failed_warm_up_is_extended() {
    let directory = TempDir::new().unwrap();
    let text = simulated_run_text(directory.path(), "1");
    let mut input = String::new();
    // Constant signals precede the run; they are excluded, and the warm-up extends over the run.
    for _ in 0..600 {
        input.push_str("0,0\n");
    }
    let rows = text.lines().filter(|l| l.starts_with(|c: char| c.is_ascii_digit()));
    for row in rows.take(3000) {
        let cells: Vec<&str> = row.split(',').collect();
        writeln!(input, "{},{}", cells[2], cells[3]).unwrap();
    }
    let arguments = ["--warm-up", "6", "--nk", "29", "--orders", "nd=1"];
    let (lines, said) = collect_answers(&arguments, &input);
    assert_eq!(lines.len(), 3600);
    let tried = &lines[599]["warm_up"];
    assert!(
        tried["reason"]
            .as_str()
            .unwrap()
            .contains("neither e nor u moved for 6.0 s"),
        "{tried}"
    );
    assert_eq!((&tried["collected"], &tried["needed"]), (&600.into(), &1200.into()));
    let last = lines.last().unwrap();
    assert_eq!(last["operator"]["convertible"], true, "{last}");
    assert!(said.contains("started after"), "{said}");
    // A stream that ends during the warm-up reports this.
    let (lines, said) = collect_answers(&arguments, "0.1,0.2\n0.2,0.1\n");
    assert_eq!(lines.len(), 2);
    assert!(said.contains("The warm-up did not end: 2 of 600"), "{said}");
    // A short fault within the warm-up is filled; a long fault restarts the warm-up.
    let mut input: String = (0..50).map(|k| format!("{},{}\n", wave(k).0, wave(k).1)).collect();
    input.push_str("nan,0\n0.1,0.2\n");
    let (lines, _) = collect_answers(&arguments, &input);
    assert_eq!(lines.last().unwrap()["warm_up"]["collected"], 52);
    let (lines, _) = collect_answers(&arguments, &(input + &",\n".repeat(101) + "0.1,0.2\n"));
    let last = &lines.last().unwrap()["warm_up"];
    assert!(
        last["collected"] == 1 && last["reason"].as_str().unwrap().contains("was restarted"),
        "{last}"
    );
}

#[test]
fn every_nth_line_reports_faults_in_between() {
    let mut arguments = NO_WARM_UP_OPTIONS.to_vec();
    arguments.extend(["--every", "10"]);
    let mut input: String = (0..40).map(|k| format!("{},{}\n", wave(k).0, wave(k).1)).collect();
    input = input.replacen(&format!("{},{}\n", wave(14).0, wave(14).1), "nan,1\n", 1);
    let (lines, _) = collect_answers(&arguments, &input);
    assert_eq!(lines.len(), 4);
    assert!(lines[1]["fault"] == "e is NaN" && lines[2].get("fault").is_none());
    assert!((lines[3]["t"].as_f64().unwrap() - 0.39).abs() < 1e-9);
}

#[test]
fn closed_output_pipe_ends_the_stream_quietly() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(["stream", "--fs", "100"])
        .args(NO_WARM_UP_OPTIONS)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut input = child.stdin.take().unwrap();
    // The program may have ended before the second line.
    let _ = input.write_all(b"0.1,0.2\n0.1,0.2\n");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    // Only the settings are printed.
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.starts_with("started at once") && said.lines().count() == 1,
        "{said}"
    );
    let mut child = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(["simulate", "--condition", "C1", "--out", "-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[cfg(unix)]
#[test]
fn interrupt_exits_with_zero_and_complete_lines() {
    // The stream is interrupted while it waits for input.
    let mut stream = Stream::new(&NO_WARM_UP_OPTIONS);
    stream.request("0.1,0.2");
    stream.interrupt();
    let start_time = Instant::now();
    while stream.child.try_wait().unwrap().is_none() {
        assert!(start_time.elapsed() < LINE_TIMEOUT);
        thread::sleep(Duration::from_millis(2));
    }
    let (status, rest, said) = stream.end();
    assert_eq!(status.code(), Some(0));
    assert!(rest.is_empty() && said.contains("1 samples"), "{said}");
    // The stream is interrupted during a computation.
    let mut stream = Stream::new(&NO_WARM_UP_OPTIONS);
    let mut input = stream.input.take().unwrap();
    let writer = thread::spawn(move || {
        let text: String = (0..1000).map(|k| format!("{},{}\n", wave(k).0, wave(k).1)).collect();
        while input.write_all(text.as_bytes()).is_ok() {}
    });
    stream.next_line();
    thread::sleep(Duration::from_millis(100));
    stream.interrupt();
    let (status, rest, _) = stream.end();
    writer.join().unwrap();
    assert_eq!(status.code(), Some(0));
    assert!(rest.len() > 10);
    for line in rest {
        assert!(
            line.ends_with('\n') && serde_json::from_str::<Value>(&line).is_ok(),
            "{line}"
        );
    }
}

#[test]
fn wrong_usage_and_headers_are_errors() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    for arguments in [
        &["stream"][..],
        &["stream", "--fs", "0"],
        &["stream", "--fs", "100", "--start", "nothing"],
        &["stream", "--fs", "100", "--start", "nothing", "--nk", "29"],
        &["stream", "--fs", "100", "--start", "nothing", "--warm-up", "5"],
        &["stream", "--fs", "100", "--warm-up", "0"],
        &["stream", "--fs", "100", "--every", "0"],
        &["stream", "--fs", "100", "--method", "rls", "--structure", "bj"],
        &["stream", "--fs", "100", "--memory-of", "x=1000"],
        &["stream", "--fs", "100", "--memory", "0.001s"],
    ] {
        let arguments = if arguments.len() > 3 {
            with_physical_method(arguments)
        } else {
            arguments.to_vec()
        };
        let (code, message) = failure_of(d, &arguments);
        assert_eq!(code, 2, "{arguments:?}: {message}");
    }
    for (more, expected) in [
        (&["--warm-up", "5"][..], "estimates from the first sample"),
        (&["--start", "nothing", "--nk", "29"], "a prior instead"),
        (&["--prior", "omega_nm=1"], "CENTRE:SPREAD"),
    ] {
        let arguments: Vec<&str> = ["stream", "--fs", "100"].iter().chain(more).copied().collect();
        let (code, message) = failure_of(d, &arguments);
        assert!(code == 2 && message.contains(expected), "{arguments:?}: {message}");
    }
    let mut stream = Stream::new(&[]);
    stream.write("t,x,y\n0,1,2\n");
    let (status, lines, said) = stream.end();
    assert_eq!(status.code(), Some(1));
    assert!(
        lines.is_empty() && said.contains("t, x, y") && said.contains("--input"),
        "{said}"
    );
}
