//! `hoid identify` for an operator who sees a target in addition to the error.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use common::{failure_of, json, stdout_of};
use serde_json::Value;
use tempfile::TempDir;

const PURSUIT: &str = include_str!("../../../fixtures/scenario/pursuit.toml");

/// Simulates runs of the scenario with a displayed target f_t.
fn simulate_runs(at: &Path, scenario: &str, n: usize) -> Vec<String> {
    fs::write(at.join("task.toml"), scenario).unwrap();
    let of = |seed: usize| {
        let name = format!("run{seed}.csv");
        let seed = seed.to_string();
        stdout_of(
            at,
            &["simulate", "--scenario", "task.toml", "--seed", &seed, "--out", &name],
        );
        name
    };
    (1..=n).map(of).collect()
}

fn of<'v>(parameters: &'v Value, name: &str) -> &'v Value {
    let all = parameters.as_array().unwrap();
    all.iter().find(|p| p["name"] == name).unwrap()
}

/// Returns the deviation of an estimate from the true value, in standard errors.
fn deviation(estimate: &Value, truth: f64) -> f64 {
    (estimate["value"].as_f64().unwrap() - truth) / estimate["standard_error"].as_f64().unwrap()
}

fn finding_kinds(found: &Value) -> Vec<String> {
    let all = found["verdict"]["findings"].as_array().cloned().unwrap_or_default();
    all.iter()
        .filter_map(|f| Some(f["kind"].as_str()?.to_owned()))
        .collect()
}

#[test]
fn both_responses_are_found_and_one_input_is_doubtful() {
    let at = TempDir::new().unwrap();
    let runs = simulate_runs(at.path(), PURSUIT, 3);
    let files: Vec<&str> = runs.iter().map(String::as_str).collect();
    let element = ["--controlled-element", "1/s", "--intersample", "zoh", "--json"];
    let two = [
        &["identify"][..],
        &files,
        &["--input", "e", "--input", "f_t", "--role", "f_t=feedforward:0.25"],
        &element,
    ];
    let two = json(at.path(), &two.concat());
    let channels = two["channels"].as_array().unwrap();
    assert_eq!(
        (channels[0]["role"].as_str(), channels[1]["role"].as_str()),
        (Some("feedback"), Some("feedforward"))
    );
    assert_eq!(channels[1]["form"], "derivative", "{:?}", channels[1]);
    for (parameters, name, truth) in [
        (&channels[0]["parameters"], "K", 2.2),
        (&channels[0]["parameters"], "tau_e", 0.2),
        (&channels[1]["parameters"], "K_d", 0.7),
        (&channels[1]["parameters"], "tau_f", -0.05),
    ] {
        let off = deviation(of(parameters, name), truth);
        assert!(off.abs() < 3.5, "{name} is off by {off} errors");
    }
    // Computed by hand: |2.2/omega| = 1, except for the effect of the neuromuscular system.
    let crossover = &two["open_loop"]["crossover_rad_s"];
    assert!(deviation(crossover, 2.236).abs() < 3.5, "{crossover}");

    let one = json(at.path(), &[&["identify"][..], &files, &element].concat());
    assert_eq!(one["verdict"]["level"], "doubtful");
    assert!(
        one["verdict"]["reasons"].to_string().contains("responds to f_t"),
        "{:?}",
        one["verdict"]
    );
    assert!(one.get("channels").is_none());

    let text = stdout_of(
        at.path(),
        &[
            &["identify"][..],
            &files,
            &["--role", "f_t=feedforward:0.25", "--controlled-element", "1/s"],
        ]
        .concat(),
    );
    for words in [
        "Response to f_t (feedforward): derivative",
        "K_d (s)",
        "tau_f (s)",
        "F·M of f_t",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn hidden_target_has_no_response() {
    let at = TempDir::new().unwrap();
    let start = PURSUIT.find("[feedforward]").unwrap();
    let end = PURSUIT.find("[disturbance]").unwrap();
    let compensatory = format!("{}{}", &PURSUIT[..start], &PURSUIT[end..]);
    let runs = simulate_runs(at.path(), &compensatory, 2);
    let files: Vec<&str> = runs.iter().map(String::as_str).collect();
    let one = json(at.path(), &[&["identify"][..], &files, &["--json"]].concat());
    assert!(
        !finding_kinds(&one).contains(&"other-input".to_owned()),
        "{:?}",
        one["verdict"]
    );
    let text = stdout_of(
        at.path(),
        &[&["identify"][..], &files, &["--input", "e", "--input", "f_t"]].concat(),
    );
    assert!(text.contains("No response to f_t (feedforward) was found"), "{text}");
}

#[test]
fn target_without_disturbance_is_doubtful() {
    let at = TempDir::new().unwrap();
    let alone = PURSUIT.replace("interleaved = \"odd\"", "interleaved = \"odd\"\nrms = 0");
    let runs = simulate_runs(at.path(), &alone, 1);
    let two = json(
        at.path(),
        &["identify", &runs[0], "--role", "f_t=feedforward:0.25", "--json"],
    );
    let found = two["channels"][1]["form"].is_string();
    assert!(
        !found || two["verdict"]["level"] != "trustworthy",
        "{:?}",
        two["verdict"]
    );
}

#[test]
fn invalid_inputs_are_refused_with_a_remedy() {
    let at = TempDir::new().unwrap();
    let runs = simulate_runs(at.path(), PURSUIT, 1);
    let run = runs[0].as_str();
    for (options, expected) in [
        (&["identify", run, "--input", "e", "--input", "q"][..], "no channel q"),
        (&["identify", run, "--role", "y=output,f_t=feedforward"], "drop one of"),
        (&["identify", run, "--role", "f_t=sight"], "feedforward"),
        (
            &["identify", run, "--input", "e", "--role", "f_t=feedback"],
            "the first --input is the feedback",
        ),
        (
            &["identify", run, "--structure", "bj", "--role", "f_t=feedforward"],
            "--role applies only to",
        ),
        (
            &["track", run, "--input", "e", "--input", "f_t", "--method", "window"],
            "use adaptive, rls or rpem for f_t",
        ),
    ] {
        let (_, message) = failure_of(at.path(), options);
        assert!(message.contains(expected), "{options:?}: {message}");
    }
}

#[test]
fn polynomials_with_two_inputs_are_identified() {
    let at = TempDir::new().unwrap();
    let runs = simulate_runs(at.path(), PURSUIT, 1);
    let run = runs[0].as_str();
    let orders = ["--orders", "na=2,nb=2,3", "--nk", "13,1"];
    let arx = [
        &["identify", run, "--structure", "arx", "--input", "e", "--input", "f_t"][..],
        &orders,
    ]
    .concat();
    let found = json(at.path(), &[&arx[..], &["--json"]].concat());
    assert_eq!(found["orders"]["nb"], serde_json::json!([2, 3]));
    assert_eq!(found["orders"]["nk"], serde_json::json!([13, 1]));
    let names: Vec<&str> = found["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| p["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["a1", "a2", "b0[e]", "b1[e]", "b0[f_t]", "b1[f_t]", "b2[f_t]"]);
    let channels = found["channels"].as_array().unwrap();
    assert_eq!((channels.len(), channels[1]["input"].as_str()), (2, Some("f_t")));
    assert_eq!(channels[1]["parameters"].as_array().unwrap().len(), 3);
    assert!(found["fit"]["vaf_prediction"].as_f64().unwrap() > 90.0);
    assert_eq!(channels[1]["role"], "feedforward");
    let moved = json(
        at.path(),
        &[&arx[..], &["--role", "e=feedback,f_t=motion", "--json"]].concat(),
    );
    assert_eq!(
        (&moved["channels"][0]["role"], &moved["channels"][1]["role"]),
        (&"feedback".into(), &"motion".into())
    );
    let text = stdout_of(at.path(), &arx);
    assert!(
        text.contains("ARX with the inputs e, f_t") && text.contains("b2[f_t]"),
        "{text}"
    );
    let bj = [
        "identify",
        run,
        "--structure",
        "bj",
        "--input",
        "e",
        "--input",
        "f_t",
        "--nk",
        "12,1",
        "--json",
    ];
    let bj = json(at.path(), &[&bj[..], &["--orders", "nb=2,2,nf=2,2,nd=4"]].concat());
    assert_eq!(bj["parameters"].as_array().unwrap().len(), 12);
    for (options, expected) in [
        (&["--orders", "nb=1,2,3"][..], "3 numbers for 2 inputs"),
        (&["--orders", "nq=1"], "no order nq"),
        (&["--orders", "nb=two"], "expected a number for each input"),
        (&["--stable"], "--stable does not apply"),
        (&["--role", "y=output"], "y is not one of the further inputs f_t"),
        (&["--role", "f_t=feedforward:0.25"], "neither a preview nor a form"),
        (&["--role", "f_t=feedback"], "the first --input is the feedback"),
        (&["--figure", "x.svg"], "one input"),
    ] {
        let call = [
            &["identify", run, "--structure", "arx", "--input", "e", "--input", "f_t"][..],
            options,
        ]
        .concat();
        let (_, message) = failure_of(at.path(), &call);
        assert!(message.contains(expected), "{options:?}: {message}");
    }
}

#[test]
fn group_reports_responses_to_further_inputs() {
    let at = TempDir::new().unwrap();
    let data = at.path().join("data");
    fs::create_dir(&data).unwrap();
    for (n, name) in simulate_runs(&data, PURSUIT, 3).iter().enumerate() {
        fs::rename(data.join(name), data.join(format!("P_seen_{n}.csv"))).unwrap();
    }
    let look = ["--excitation", "d", "--controlled-element", "1/s"];
    let role = ["--role", "f_t=feedforward:0.25"];
    let (_, printed) = failure_of(
        at.path(),
        &[&["group", "init", "data"][..], &look, &["--role", "f_t=guess"]].concat(),
    );
    assert!(
        printed.contains("--role: roles: found \"f_t=guess\"") && printed.contains("feedforward"),
        "{printed}"
    );
    stdout_of(at.path(), &[&["group", "init", "data"][..], &look, &role].concat());
    let manifest = fs::read_to_string(data.join("group.toml")).unwrap();
    assert!(manifest.contains("roles = [\"f_t=feedforward:0.25\"]"), "{manifest}");
    let group = json(at.path(), &["group", "data", "--out", "results", "--json"]);
    let person = &group["people"][0];
    let channel = &person["channels"][0];
    assert_eq!(
        (&channel["input"], &channel["role"], &channel["form"]),
        (&"f_t".into(), &"feedforward".into(), &"derivative".into())
    );
    for (name, truth) in [("K_d", 0.7), ("tau_f", -0.05)] {
        assert!(
            deviation(&channel["parameters"][name], truth).abs() < 3.0,
            "{name}: {channel}"
        );
    }
    let crossover = &person["open_loop"]["crossover_rad_s"];
    assert!(deviation(crossover, 2.2).abs() < 3.0, "{person}");
    // Models with one input would be wrong and are omitted, which does not count as a failure.
    let kinds = finding_kinds(&group);
    assert!(kinds.contains(&"one-input-models".to_owned()), "{kinds:?}");
    assert!(!kinds.contains(&"fits-failed".to_owned()), "{kinds:?}");
    let page = fs::read_to_string(at.path().join("results/report.html")).unwrap();
    assert!(page.contains("response to f_t") && page.contains("f_t: tau_f (s)"));
}

#[test]
fn omitted_displayed_target_is_reported() {
    let at = TempDir::new().unwrap();
    let run = simulate_runs(at.path(), PURSUIT, 1).remove(0);
    let text = fs::read_to_string(at.path().join(&run)).unwrap();
    fs::write(
        at.path().join("seen.csv"),
        format!("# roles: f_t feedforward:0.25\n{text}"),
    )
    .unwrap();
    let role = "--input e --input f_t --role f_t=feedforward:0.25";
    for command in ["identify", "describe", "track"] {
        let mut call = vec![command, "seen.csv", "--json"];
        if command == "track" {
            call.extend(["--out", "trace.csv"]);
        }
        let found = json(at.path(), &call);
        assert!(finding_kinds(&found).contains(&"displayed".to_owned()), "{command}");
        assert_ne!(found["verdict"]["level"], "trustworthy", "{command}");
        assert!(
            found["verdict"].to_string().contains(role),
            "{command}: {}",
            found["verdict"]
        );
    }
    let two: Vec<&str> = ["identify", "seen.csv", "--json"]
        .into_iter()
        .chain(role.split(' '))
        .collect();
    assert!(!finding_kinds(&json(at.path(), &two)).contains(&"displayed".to_owned()));
}

#[test]
fn recursion_tracks_both_responses() {
    let at = TempDir::new().unwrap();
    let run = simulate_runs(at.path(), PURSUIT, 1).remove(0);
    let two = ["track", &run, "--input", "e", "--input", "f_t", "--at", "2,4"];
    let model = ["--method", "rpem", "--orders", "nb=2,2,nf=2,nd=1", "--nk", "14,1"];
    let role = ["--role", "f_t=feedforward"];
    let out = ["--out", "trace.csv", "--every", "60", "--json"];
    let found = json(at.path(), &[&two[..], &role, &model, &out].concat());
    let channels = found["channels"].as_array().unwrap();
    let names: Vec<&str> = channels.iter().map(|c| c["input"].as_str().unwrap()).collect();
    let roles: Vec<&str> = channels.iter().map(|c| c["role"].as_str().unwrap()).collect();
    assert_eq!((names, roles), (vec!["e", "f_t"], vec!["feedback", "feedforward"]));
    assert!(
        of(&channels[1]["parameters"], "b0[f_t]")["standard_error"]
            .as_f64()
            .unwrap()
            > 0.0
    );
    // The person responds to the target with K_d s: the gain increases by 6 dB per octave, and the phase is 90 deg.
    let response = channels[1]["response"].as_array().unwrap();
    let gain = |k: usize| &response[k]["gain_db"];
    let truth = 20.0 * (0.7 * 4.0_f64).log10();
    assert!(deviation(gain(1), truth).abs() < 3.0, "{} {truth}", gain(1));
    assert!((gain(1)["value"].as_f64().unwrap() - gain(0)["value"].as_f64().unwrap() - 6.0).abs() < 1.5);
    let table = fs::read_to_string(at.path().join("trace.csv")).unwrap();
    let header = table.lines().find(|line| !line.starts_with('#')).unwrap();
    for name in [
        "b0[f_t]",
        "b0[f_t]_se",
        "f2[f_t]",
        "gain_db[f_t]@2",
        "phase_deg[f_t]@4_se",
        "gain_db@2",
    ] {
        assert!(header.split(',').any(|column| column == name), "{name}: {header}");
    }
    assert!(!finding_kinds(&found).contains(&"displayed".to_owned()));

    for (options, words) in [
        (&["--method", "rpem"][..], "give nk for each in samples"),
        (&["--orders", "nb=3"], "nb = 2 and nf = 2"),
        (&["--role", "f_t=feedforward/derivative"], "drop /derivative"),
        (&["--method", "rpem", "--nk", "14,1,3"], "3 numbers for 2 inputs"),
        (&["--method", "rpem", "--nk", "0.2s,0.1s"], "one number of samples"),
        (&["--method", "rpem", "--nk", "14,1", "--validate", &run], "--validate"),
    ] {
        let (_, message) = failure_of(at.path(), &[&two[..], options].concat());
        assert!(message.contains(words), "{options:?}: {message}");
    }
    let (_, message) = failure_of(at.path(), &["track", &run, "--role", "f_t=feedforward"]);
    assert!(message.contains("add it with --input"), "{message}");

    // The default tracker needs neither orders nor delays, and knows the preview.
    let role = ["--role", "f_t=feedforward:0.25"];
    let found = json(at.path(), &[&two[..], &role, &out].concat());
    let channels = found["channels"].as_array().unwrap();
    let parameter = |name: &str| of(&channels[1]["parameters"], name).clone();
    for (name, truth) in [("K_f", 0.0), ("K_f_dot", 0.7), ("tau_f", -0.05)] {
        let found = parameter(name);
        assert!(deviation(&found, truth).abs() < 3.0, "{name}: {found} {truth}");
    }
    let gain = &channels[1]["response"][1]["gain_db"];
    assert!(deviation(gain, truth).abs() < 3.0, "{gain} {truth}");
    let table = fs::read_to_string(at.path().join("trace.csv")).unwrap();
    let header = table.lines().find(|line| !line.starts_with('#')).unwrap();
    for name in ["K_f[f_t]", "K_f_dot[f_t]_se", "tau_f[f_t]", "b0[f_t]", "gain_db[f_t]@2"] {
        assert!(header.split(',').any(|column| column == name), "{name}: {header}");
    }
}
