//! Outputs: they never overwrite their inputs, are never partial, and never fail silently.
#![allow(clippy::unwrap_used)]

mod common;

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
};

use tempfile::TempDir;

use hoid::model::numbers::with_uncertainty;

use common::{BOX_JENKINS_OPTIONS, failure_of, hoid, json, simulated_run, stdout_of};

/// Returns a folder with a simulated run `in.csv`, a group `g` of two runs, and a plan.
fn workplace() -> TempDir {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    stdout_of(d, &["simulate", "--condition", "C1", "--seed", "1", "--out", "in.csv"]);
    stdout_of(
        d,
        &[
            "simulate-group",
            "--out",
            "g",
            "--subjects",
            "1",
            "--conditions",
            "C1",
            "--runs",
            "1",
        ],
    );
    directory
}

#[test]
fn output_that_is_an_input_is_refused() {
    let directory = workplace();
    let d = directory.path();
    let kept = fs::read(d.join("in.csv")).unwrap();
    fs::hard_link(d.join("in.csv"), d.join("hard.csv")).unwrap();
    let mut names = vec!["in.csv", "g/../in.csv", "hard.csv"];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(d.join("in.csv"), d.join("soft.csv")).unwrap();
        names.push("soft.csv");
    }
    for name in names {
        let (code, message) = failure_of(d, &["track", "in.csv", "--method", "rls", "--nk", "29", "--out", name]);
        assert_eq!(code, 2, "{message}");
        assert!(
            message.contains("of this command and would be overwritten"),
            "{message}"
        );
    }
    fs::write(d.join("page.csv"), "").unwrap();
    let mut all: Vec<Vec<&str>> = vec![vec!["simulate", "--scenario", "page.csv", "--out", "page.csv"]];
    let figure = ["describe", "in.svg", "--excitation", "f_t", "--figure", "in.svg"];
    fs::copy(d.join("in.csv"), d.join("in.svg")).unwrap();
    all.push(figure.to_vec());
    fs::create_dir(d.join("pages")).unwrap();
    fs::copy(d.join("in.csv"), d.join("pages/report.html")).unwrap();
    let mut report = vec![
        "identify",
        "pages/report.html",
        "--report",
        "pages",
        "--initial-state",
        "zero",
    ];
    report.extend(BOX_JENKINS_OPTIONS);
    all.push(report);
    all.push(vec!["group", "g", "--out", "g"]);
    all.push(vec!["group", "g/group.toml", "--out", "g"]);
    for arguments in all {
        let (code, message) = failure_of(d, &arguments);
        assert_eq!(code, 2, "{arguments:?}: {message}");
        assert!(message.contains("of this command"), "{arguments:?}: {message}");
    }
    assert_eq!(fs::read(d.join("in.csv")).unwrap(), kept);
    assert_eq!(fs::read(d.join("pages/report.html")).unwrap(), kept);
}

#[test]
fn unwritable_outputs_are_refused_before_the_work() {
    let directory = workplace();
    let d = directory.path();
    for arguments in [
        &["track", "in.csv", "--out", "no/such/trace.csv"][..],
        &["identify", "in.csv", "--report", "in.csv/below"],
        &["simulate", "--condition", "C1", "--out", "no/run.csv"],
    ] {
        let (code, message) = failure_of(d, arguments);
        assert_eq!(code, 1, "{message}");
        assert!(message.contains("cannot be written"), "{message}");
    }
}

/// Returns each command that prints, with arguments for which it is fast.
fn printing_commands() -> Vec<Vec<&'static str>> {
    let mut identify = vec!["identify", "in.csv", "--initial-state", "zero"];
    identify.extend(BOX_JENKINS_OPTIONS);
    let mut as_json = identify.clone();
    as_json.push("--json");
    vec![
        identify,
        as_json,
        vec![
            "identify",
            "in.csv",
            "--structure",
            "time-varying",
            "--delay",
            "0.28..0.3",
        ],
        vec!["identify", "in.csv", "--form", "lead-lag"],
        vec!["describe", "in.csv", "--excitation", "f_t"],
        vec!["track", "in.csv", "--method", "rls", "--nk", "29", "--out", "trace.csv"],
        vec![
            "track",
            "in.csv",
            "--method",
            "rls",
            "--nk",
            "29",
            "--out",
            "trace.csv",
            "--json",
        ],
        vec!["info", "in.csv"],
        vec!["info", "in.csv", "--json"],
        vec!["convert", "--f=-1.9,.92", "--b", ".04,-.04", "--nk", "29"],
        vec!["convert", "--transfer-function", "90/(s(s+6))", "--json"],
        vec!["margins", "--condition", "C1"],
        vec!["simulate", "--condition", "C1", "--out", "run.csv"],
        vec!["simulate", "--condition", "C1", "--out", "-"],
        vec![
            "simulate-group",
            "--out",
            "h",
            "--subjects",
            "1",
            "--conditions",
            "C1",
            "--runs",
            "1",
        ],
        vec![
            "group",
            "init",
            "g",
            "--pattern",
            "{subject}_{condition}_{run}.csv",
            "--out",
            "-",
        ],
        vec!["study", "plans"],
        vec!["study", "schema"],
        vec!["reproduce", "--list"],
        vec!["--help"],
        vec!["--version"],
        vec!["identify", "--help"],
    ]
}

/// Returns the exit code and standard error of a command with redirected output.
fn run_redirected(directory: &Path, arguments: &[&str], out: Stdio) -> (Option<i32>, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(arguments)
        .current_dir(directory)
        .stdin(Stdio::null())
        .stdout(out)
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

#[cfg(target_os = "linux")]
#[test]
fn full_output_is_an_error_of_every_command() {
    let directory = workplace();
    for arguments in printing_commands() {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let (code, message) = run_redirected(directory.path(), &arguments, full.into());
        assert_eq!(code, Some(1), "{arguments:?}: {message}");
        assert!(
            message.contains("standard output cannot be written: No space left"),
            "{arguments:?}: {message}"
        );
        let _ = fs::remove_dir_all(directory.path().join("h"));
    }
    std::os::unix::fs::symlink("/dev/full", directory.path().join("full.csv")).unwrap();
    let to_file = hoid(
        directory.path(),
        &["simulate", "--condition", "C1", "--out", "full.csv"],
    );
    assert_eq!(to_file.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&to_file.stderr).contains("free space"));
}

#[cfg(unix)]
#[test]
fn closed_output_pipe_does_not_abort_the_work() {
    let directory = workplace();
    for arguments in printing_commands() {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let (code, message) = run_redirected(directory.path(), &arguments, writer.into());
        assert!(
            !message.contains("panicked") && !message.contains("pipe"),
            "{arguments:?}: {message}"
        );
        assert!(matches!(code, Some(0 | 1)), "{arguments:?}: {code:?} {message}");
        assert!(
            code == Some(0) || message.contains("not determine"),
            "{arguments:?}: {message}"
        );
        let _ = fs::remove_dir_all(directory.path().join("h"));
    }
    // The trace is complete, although the page was not read.
    let rows = fs::read_to_string(directory.path().join("trace.csv")).unwrap();
    assert!(rows.lines().count() > 8192);
}

/// The shell of the test limits the size of files; no file is left incomplete.
#[cfg(target_os = "linux")]
#[test]
fn file_size_limit_leaves_complete_files() {
    let directory = workplace();
    let d = directory.path();
    let limited = |command: &str| {
        let script = format!("ulimit -f 8; exec \"{}\" {command}", env!("CARGO_BIN_EXE_hoid"));
        let output = Command::new("bash")
            .args(["-c", &script])
            .current_dir(d)
            .output()
            .unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let kept = fs::read(d.join("in.csv")).unwrap();
    let before = fs::read_dir(d).unwrap().count();
    for command in [
        "simulate --condition C1 --out in.csv",
        "simulate --condition C1 --out - > in2.csv",
    ] {
        let (code, message) = limited(command);
        assert_eq!(code, Some(1), "{command}: {message}");
        assert!(message.contains("File too large"), "{command}: {message}");
    }
    assert_eq!(fs::read(d.join("in.csv")).unwrap(), kept);
    // Only the file created by the shell is new; there is no partial file.
    assert_eq!(fs::read_dir(d).unwrap().count(), before + 1);
}

#[test]
fn stale_temporary_files_are_removed() {
    let directory = workplace();
    let d = directory.path();
    fs::write(d.join(".hoid-Xy12ab.part"), "half a file").unwrap();
    stdout_of(d, &["simulate", "--condition", "C1", "--out", "run.csv"]);
    assert!(!d.join(".hoid-Xy12ab.part").exists());
}

#[cfg(unix)]
const LONG_PLAN: &str = r#"
name = "long"
seed = 1
replications = 100000
block = 2

[[scenarios]]
name = "short"
condition = "C1"
measurement_s = 10.24
remnant.noise_level = 0.1

[[estimators]]
name = "ARX"
method = "fit"
structure = "arx"
orders.nk = 29
"#;

/// True if programs started by this test continue after the terminal is closed (`nohup`).
#[cfg(unix)]
fn hang_up_signal_is_ignored() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    ignored.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask & 1 == 1))
}

/// After each signal that ends a program while it writes, no partial output remains.
#[cfg(unix)]
#[test]
fn signals_exit_with_their_code_and_leave_no_files() {
    let directory = workplace();
    let d = directory.path();
    fs::write(d.join("long.toml"), LONG_PLAN).unwrap();
    for (name, number) in [("INT", 2), ("TERM", 15), ("HUP", 1)] {
        if name == "HUP" && hang_up_signal_is_ignored() {
            continue;
        }
        let mut child = Command::new(env!("CARGO_BIN_EXE_hoid"))
            .args(["study", "run", "long.toml", "--jobs", "1", "--out"])
            .arg(format!("s-{name}"))
            .current_dir(d)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        // The plan is written before the first block.
        for _ in 0..2000 {
            if d.join(format!("s-{name}/study.json")).exists() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        let sent = Command::new("kill")
            .args([&format!("-{name}"), &child.id().to_string()])
            .status()
            .unwrap();
        assert!(sent.success());
        assert_eq!(child.wait().unwrap().code(), Some(128 + number), "{name}");
        let parts = fs::read_dir(d.join(format!("s-{name}/parts"))).unwrap();
        assert!(
            parts
                .flatten()
                .all(|p| !p.file_name().to_string_lossy().ends_with(".part"))
        );
    }
}

/// A table for a paper contains the same estimates, standard errors and intervals as the JSON.
#[test]
fn table_for_a_paper_matches_the_json() {
    let directory = simulated_run();
    let d = directory.path();
    let identify = ["identify", "c1.csv", "--controlled-element", "90/(s(s+6))", "--json"];
    let found = json(d, &[&identify, ["--table", "c1.tex"].as_slice()].concat());
    let latex = fs::read_to_string(d.join("c1.tex")).unwrap();
    let k_e = &found["parameters"][0];
    let written = with_uncertainty(k_e["value"].as_f64().unwrap(), k_e["standard_error"].as_f64());
    assert!(
        latex.contains(&format!("$K_\\mathrm{{e}}$ & ${} \\pm {}$ &", written.0, written.1)),
        "{latex}"
    );
    assert!(latex.contains("$\\omega_\\mathrm{c}$") && latex.ends_with("\\bottomrule\n\\end{tabular}\n"));
    stdout_of(d, &["describe", "c1.csv", "--excitation", "f_t", "--table", "lines.md"]);
    let lines = fs::read_to_string(d.join("lines.md")).unwrap();
    assert!(
        lines.contains("| omega_rad_s | gain_db | phase_deg |") && lines.lines().count() == 13,
        "{lines}"
    );
    stdout_of(d, &["track", "c1.csv", "--out", "trace.csv", "--table", "last.csv"]);
    let last = fs::read_to_string(d.join("last.csv")).unwrap();
    assert!(
        last.contains("quantity,value,standard_error,low,high,unit,verdict\nK_e,"),
        "{last}"
    );
    let (_, refused) = failure_of(d, &["identify", "c1.csv", "--table", "c1.docx"]);
    assert!(refused.contains(".tex, .md, .csv"), "{refused}");
}
