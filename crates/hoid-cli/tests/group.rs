//! A virtual experiment and its analysis from the command line.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use tempfile::TempDir;

use common::{failure_of, hoid, json, stdout_of};

/// Simulates two people in C1 and C3 with two runs each.
fn experiment() -> TempDir {
    let directory = TempDir::new().unwrap();
    let arguments = [
        "simulate-group",
        "--subjects",
        "2",
        "--conditions",
        "C1,C3",
        "--runs",
        "2",
        "--noise-level",
        "0.05",
        "--out",
        "people",
    ];
    let printed = stdout_of(directory.path(), &arguments);
    assert!(printed.contains("8 runs") && printed.contains("truth.csv"), "{printed}");
    // A narrow range of delays makes the test fast.
    let manifest = directory.path().join("people/group.toml");
    let text = fs::read_to_string(&manifest).unwrap();
    assert!(text.contains("[analysis]\n"), "{text}");
    let lines = text
        .lines()
        .filter(|line| !line.starts_with("trace_every"))
        .collect::<Vec<_>>()
        .join("\n");
    let shorter = lines.replace(
        "[analysis]\n",
        "[analysis]\ntrace_every = 64\nresponse_at_rad_s = [3.0]\n",
    );
    fs::write(&manifest, shorter).unwrap();
    directory
}

fn files(directory: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found: Vec<_> = fs::read_dir(directory)
        .unwrap()
        .map(|entry| entry.unwrap())
        .filter(|entry| entry.path().is_file())
        .map(|entry| {
            (
                entry.file_name().to_string_lossy().into_owned(),
                fs::read(entry.path()).unwrap(),
            )
        })
        .collect();
    found.sort();
    found
}

#[test]
fn virtual_experiment_is_analysed_and_reported() {
    let directory = experiment();
    let at = directory.path();
    let printed = stdout_of(at, &["group", "people", "--out", "out", "--csv", "-v"]);
    assert!(printed.starts_with("Verdict: "), "{printed}");
    // Failures and doubtful results precede the numbers.
    let at_operators = printed.find("Operators").unwrap();
    assert!(
        printed.find("C3 has no operator for the whole run").unwrap() < at_operators,
        "{printed}"
    );
    for name in [
        "people.csv",
        "estimates.parquet",
        "averages.csv",
        "delays.csv",
        "settling.csv",
        "response-averages.csv",
        "report.html",
    ] {
        assert!(printed.contains(name), "{name}: {printed}");
    }
    let page = fs::read_to_string(at.join("out/report.html")).unwrap();
    for part in [
        "How fast the recursions follow",
        "|H(3j)|",
        "<h2>Operators</h2>",
        "variance of a1",
        "ARX (RLS)",
        "subject ",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let subjects: Vec<String> = files(&at.join("out"))
        .into_iter()
        .map(|(name, _)| name)
        .filter(|name| name.starts_with("subject-"))
        .collect();
    assert_eq!(subjects.len(), 2);
    // K_e_dot of C3 changes, and the table contains its settling time; in C1 nothing changes.
    let settling = fs::read_to_string(at.join("out/settling.csv")).unwrap();
    let of = |condition: &str| {
        settling
            .lines()
            .filter(|line| line.contains(&format!(",{condition},")))
            .count()
    };
    assert!(of("C3") > 0 && of("C1") == 0, "{settling}");
    // A second run is rejected, and with --resume nothing is computed twice.
    let (code, message) = failure_of(at, &["group", "people", "--out", "out"]);
    assert!(code == 1 && message.contains("--resume"), "{message}");
    let resumed = ["group", "people", "--out", "out", "--csv", "--resume"];
    let found = json(
        at,
        &[&resumed[..], &["--json", "--figure", "narrow.svg", "--width", "85mm"]].concat(),
    );
    assert_eq!(found["runs"], 8);
    assert_eq!(
        (&found["kind"], &found["hoid"]),
        (&"group".into(), &env!("CARGO_PKG_VERSION").into())
    );
    let record = &found["records"][0];
    assert_eq!(found["records"].as_array().map(Vec::len), Some(8));
    assert!(record["file"].is_string() && record["subject"] == "S1", "{record}");
    assert!(found["data"]["faults"].is_array() && found["data"]["warnings"].is_array());
    let settings = found["settings"].as_array().unwrap();
    let given = |name: &str| &settings.iter().find(|one| one["name"] == name).unwrap()["given"];
    assert!(
        given("analysis.trace_every") == true && given("read.faults") == false,
        "{settings:?}"
    );
    assert_eq!(found["failures"].as_array().map(Vec::len), Some(0));
    let people = found["people"].as_array().unwrap();
    let of = |condition: &str| {
        people
            .iter()
            .filter(|p| p["condition"] == condition)
            .collect::<Vec<_>>()
    };
    assert!(of("C3").iter().all(|p| p["status"] == "changes") && of("C3").len() == 2);
    for person in of("C1") {
        let tau = &person["parameters"]["tau_e"];
        let (value, error) = (tau["value"].as_f64().unwrap(), tau["standard_error"].as_f64().unwrap());
        assert!((value - 0.28).abs() < 0.05 && error > 0.0 && error < 0.05, "{tau}");
        for name in ["crossover_rad_s", "phase_margin_deg"] {
            let measure = &person["open_loop"][name];
            let (value, error) = (
                measure["value"].as_f64().unwrap(),
                measure["standard_error"].as_f64().unwrap(),
            );
            let end = |i: usize| measure["interval"][i].as_f64().unwrap();
            // The posterior is a mixture over forms, so it need not be symmetric.
            assert!(error > 0.0 && end(0) < value && value < end(1), "{measure}");
            assert!(end(1) - end(0) > 2.0 * 1.96 * error, "{measure}");
        }
        assert!(person["verdict"]["level"].is_string());
    }
    // In a column of 85 mm each subject has a separate figure, whose text of 13 px in 420 px has 7.5 pt; on a page the
    // subjects are next to each other.
    stdout_of(
        at,
        &[&resumed[..], &["--figure", "wide.svg", "--width", "170mm"]].concat(),
    );
    let figures: Vec<(String, String)> = files(at)
        .into_iter()
        .filter(|(name, _)| name.ends_with(".svg"))
        .map(|(name, bytes)| (name, String::from_utf8(bytes).unwrap()))
        .collect();
    let names: Vec<&str> = figures.iter().map(|(name, _)| name.as_str()).collect();
    let narrow = ["C1-S1", "C1-S2", "C3-S1", "C3-S2"].map(|of| format!("narrow-{of}.svg"));
    assert_eq!(
        names,
        [
            &narrow.each_ref().map(String::as_str)[..],
            &["wide-C1.svg", "wide-C3.svg"]
        ]
        .concat()
    );
    for (name, svg) in &figures {
        let (width, box_width) = if name.starts_with("narrow") {
            (85, 420)
        } else {
            (170, 840)
        };
        assert!(svg.contains(&format!("width=\"{width}mm\"")), "{name}");
        assert!(svg.contains(&format!("viewBox=\"0 0 {box_width} ")), "{name}");
    }
    // A modified file makes a different group.
    fs::write(
        at.join("people/group.toml"),
        fs::read_to_string(at.join("people/group.toml")).unwrap() + "\n# looked through\n",
    )
    .unwrap();
    stdout_of(at, &["group", "people", "--out", "out", "--resume"]);
    let text = fs::read_to_string(at.join("people/group.toml"))
        .unwrap()
        .replace("trace_every = 64", "trace_every = 32");
    fs::write(at.join("people/group.toml"), text).unwrap();
    let (code, message) = failure_of(at, &["group", "people", "--out", "out", "--resume"]);
    assert!(code == 1 && message.contains("holds another"), "{message}");
}

#[test]
fn killed_group_resumes_to_identical_files() {
    let directory = experiment();
    let at = directory.path();
    stdout_of(at, &["group", "people", "--out", "whole"]);
    for wait_ms in [150, 400] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_hoid"))
            .args(["group", "people", "--out", "pieces", "--resume", "--jobs", "1"])
            .current_dir(at)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(wait_ms));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    stdout_of(at, &["group", "people", "--out", "pieces", "--resume"]);
    assert!(files(&at.join("whole")) == files(&at.join("pieces")));
}

#[test]
fn init_inspects_the_files_and_reports_findings() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let people = [
        "simulate-group",
        "--people",
        "--subjects",
        "1",
        "--runs",
        "1",
        "--plants",
        "integrator",
    ];
    stdout_of(at, &[&people[..], &["--out", "people"]].concat());
    fs::remove_file(at.join("people/group.toml")).unwrap();
    let printed = stdout_of(at, &["group", "init", "people", "--controlled-element", "1/s"]);
    assert!(printed.contains("1 runs") && printed.contains("d has"), "{printed}");
    let text = fs::read_to_string(at.join("people/group.toml")).unwrap();
    let manifest: toml::Table = toml::from_str(&text).unwrap();
    let condition = &manifest["conditions"]["integrator"];
    assert_eq!(condition["excitation"].as_str(), Some("d"));
    assert!(
        (condition["period_s"].as_float().unwrap() - 20.0).abs() < 1e-6,
        "{text}"
    );
    assert_eq!(condition["controlled_element"].as_str(), Some("1/s"));
    assert_eq!(condition["offset_samples"].as_float(), Some(0.0));
    assert_eq!(manifest["read"]["input"].as_str(), Some("e"));
    // Each line follows its evidence.
    for (evidence, line) in [
        ("# the tracking error, by name", "input = "),
        ("# d has", "excitation = "),
        ("# e follows from u through the controlled element", "offset_samples = "),
        ("# for the first run BIC chooses nd", "nd = "),
        ("# for the first run alone the form is", "form = "),
    ] {
        let at_evidence = text.find(evidence).unwrap_or_else(|| panic!("{evidence}: {text}"));
        let next = text[at_evidence..].lines().nth(1).unwrap();
        assert!(next.starts_with(line), "{next}: {text}");
    }
    // Known settings are used unchanged.
    let known = [
        "--input",
        "-e",
        "--excitation",
        "none",
        "--from",
        "5",
        "--offset",
        "1",
        "--out",
        "-",
    ];
    let other = stdout_of(at, &[&["group", "init", "people"][..], &known].concat());
    let manifest: toml::Table = toml::from_str(&other).unwrap();
    assert_eq!(manifest["read"]["input"].as_str(), Some("-e"));
    assert_eq!(manifest["read"]["from_s"].as_float(), Some(5.0));
    assert_eq!(
        manifest["conditions"]["integrator"]["offset_samples"].as_float(),
        Some(1.0)
    );
    assert!(
        manifest["conditions"]["integrator"].get("excitation").is_none(),
        "{other}"
    );
}

#[test]
fn manifest_is_made_from_file_names() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    stdout_of(at, &["simulate", "--condition", "C1", "--out", "anna_C1_1.csv"]);
    fs::write(at.join("notes.txt"), "nothing").unwrap();
    let by_name = ["group", "init", ".", "--pattern", "{subject}_{condition}_{run}.csv"];
    let printed = stdout_of(at, &[&by_name[..], &["--excitation", "none"]].concat());
    assert!(printed.contains("1 runs") && printed.contains("notes.txt"), "{printed}");
    let (code, message) = failure_of(
        at,
        &["group", "init", ".", "--pattern", "{subject}_{condition}_{run}.csv"],
    );
    assert!(code == 2 && message.contains("already present"), "{message}");
    let (code, message) = failure_of(at, &["group", "init", ".", "--pattern", "{who}.csv", "--out", "x.toml"]);
    assert!(code == 2 && message.contains("{subject}"), "{message}");
    let (code, message) = failure_of(at, &["group", "nowhere", "--out", "x"]);
    assert!(code == 2 && message.contains("hoid group init"), "{message}");
    let text = fs::read_to_string(at.join("group.toml")).unwrap();
    for (wrong, expected) in [
        ("[conditions.C9]\nchange_s = 4.0\n", "no run has this condition"),
        ("[conditions.C1]\ncontrolled_element = \"1/(s\"\n", "at character 5"),
        ("[conditions.C1]\nmystery = 1\n", "mystery"),
    ] {
        fs::write(at.join("wrong.toml"), format!("{text}\n{wrong}")).unwrap();
        let (code, message) = failure_of(at, &["group", "wrong.toml", "--out", "x"]);
        assert!(
            code == 2 && message.contains(expected) && message.contains("wrong.toml"),
            "{expected}: {message}"
        );
    }
    let joined = text.replace("subject = \"anna\"", "then = \"nothing.csv\"\nsubject = \"anna\"");
    fs::write(at.join("joined.toml"), joined).unwrap();
    // If all runs fail, there is no result, but the available information is written.
    let output = hoid(at, &["group", "joined.toml", "--out", "joined", "--csv"]);
    let message = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        output.status.code() == Some(1)
            && message.contains("none of the 1 runs could be read")
            && message.contains("nothing.csv"),
        "{message}"
    );
    let estimates = fs::read_to_string(at.join("joined/estimates.csv")).unwrap();
    assert!(
        estimates.contains("nothing.csv") && estimates.contains("failed"),
        "{estimates}"
    );
}

#[test]
fn people_are_simulated_with_their_own_options() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let default = [
        "simulate-group",
        "--people",
        "--subjects",
        "1",
        "--runs",
        "1",
        "--out",
        "people",
    ];
    let more = [
        "--plants",
        "integrator",
        "--remnants",
        "pulsed",
        "--remnant-share",
        "0.1..0.2",
        "--sample-time",
        "0.01",
    ];
    let printed = stdout_of(at, &[&default[..], &more].concat());
    assert!(printed.contains("1 runs") && printed.contains("truth.csv"), "{printed}");
    let run = fs::read_to_string(at.join("people/S1_integrator_1.csv")).unwrap();
    assert!(run.starts_with("t,e,u,d,y\n") && run.lines().count() == 4001);
    let truth = fs::read_to_string(at.join("people/truth.csv")).unwrap();
    assert!(truth.contains(",lead-lag,pulsed,"), "{truth}");
    let manifest = fs::read_to_string(at.join("people/group.toml")).unwrap();
    assert!(manifest.contains("controlled_element = \"1/1,0\"") && manifest.contains("excitation = \"d\""));
    for wrong in [
        &["simulate-group", "--people", "--noise-level", "0.2", "--out", "x"][..],
        &["simulate-group", "--plants", "integrator", "--out", "x"],
        &["simulate-group", "--people", "--plants", "1/s", "--out", "x"],
        &["simulate-group", "--people", "--sample-time", "0", "--out", "x"],
    ] {
        failure_of(at, wrong);
    }
}
