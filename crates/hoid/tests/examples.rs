//! The examples of this crate run, and are short enough to be read in a minute.
#![allow(clippy::unwrap_used)]

use std::process::Command;

/// Returns the output of an example; cargo has built it next to this test.
fn example_output(name: &str) -> String {
    let here = std::env::current_exe().unwrap();
    let built = here.parent().unwrap().parent().unwrap().join("examples").join(name);
    let output = Command::new(built.with_extension(std::env::consts::EXE_EXTENSION))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn identify_file_example_runs() {
    let text = example_output("identify_file");
    assert!(text.contains("omega_nm") && text.contains("report.html"), "{text}");
}

#[test]
fn track_live_example_runs() {
    let text = example_output("track_live");
    assert!(
        text.contains("80.0 s") && text.contains("8192 samples, 0 skipped"),
        "{text}"
    );
}

#[test]
fn study_example_runs() {
    let text = example_output("simulate_and_study");
    assert!(text.contains("finished: true") && text.contains("median"), "{text}");
}

#[test]
fn each_example_has_less_than_forty_lines() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/examples");
    for name in ["identify_file", "simulate_and_study", "track_live"] {
        let text = std::fs::read_to_string(format!("{folder}/{name}.rs")).unwrap();
        assert!(text.lines().count() < 40, "{name}: {}", text.lines().count());
    }
}
