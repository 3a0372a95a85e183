//! Excessive numbers are reported at once, with the limit.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use tempfile::TempDir;

use common::{BOX_JENKINS_OPTIONS, failure_of, stdout_of};

const HUGE_NUMBER: &str = "18446744073709551615";

#[test]
fn exceeded_limits_are_refused_at_once() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    stdout_of(d, &["simulate", "--condition", "C1", "--out", "c1.csv"]);
    let (delays, all) = (
        format!("0..{HUGE_NUMBER}"),
        "na=0..64,nb=1..64,nc=0..64,nd=0..64,nf=0..64".to_owned(),
    );
    let identify = ["identify", "c1.csv", "--structure", "bj"];
    let track = ["track", "c1.csv", "--out", "t.csv"];
    for (command, options, expected) in [
        (&identify[..], vec!["--nk", &delays], "at most 1000000;"),
        (&identify, vec!["--nk", HUGE_NUMBER], "at most 1000000;"),
        (&identify, vec!["--nk", "0..1000000"], "at most 100000"),
        (&identify, vec!["--orders", "nd=0..65"], "at most 64;"),
        (
            &identify,
            vec!["--nk", "29", "--horizon", HUGE_NUMBER],
            "from 1 to 1000000",
        ),
        (&identify, vec!["--nk", "29", "--horizon", "0"], "from 1 to 1000000"),
        (
            &[
                "identify",
                "c1.csv",
                "--structure",
                "general",
                "--nk",
                "0..64",
                "--orders",
            ],
            vec![&all],
            "at most 100000 candidates: narrow --nk and --orders",
        ),
        (&track, vec!["--method", "rls", "--nk", &delays], "at most 1000000;"),
    ] {
        let arguments: Vec<&str> = command.iter().copied().chain(options).collect();
        let (code, message) = failure_of(d, &arguments);
        assert_eq!(code, 2, "{arguments:?}: {message}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
    // A horizon beyond the record is limited to the record.
    let identify = [&["identify", "c1.csv", "--horizon", "1000"][..], &BOX_JENKINS_OPTIONS];
    stdout_of(d, &identify.concat());
    for options in [
        ["--subjects", "100000000"],
        ["--runs", HUGE_NUMBER],
        ["--subjects", HUGE_NUMBER],
    ] {
        for kind in [&["--conditions", "C1"][..], &["--people"]] {
            let mut arguments = vec!["simulate-group", "--out", "g"];
            arguments.extend(options);
            arguments.extend(kind);
            let (_, message) = failure_of(d, &arguments);
            assert!(message.contains("at most 100000 runs"), "{message}");
        }
    }
}

#[test]
fn out_of_range_scenarios_name_the_key_and_its_limits() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    for (line, expected) in [
        ("initial.omega_b_rad_s = 1e300", "initial.omega_b_rad_s is 1e300"),
        ("initial.K_e = -1e300", "initial.K_e is -1e300"),
        ("initial.T_L_s = 1e9", "initial.T_L_s"),
        ("initial.zeta_nm = 1e-300", "initial.zeta_nm"),
        ("initial.omega_nm_rad_s = 1e9", "initial.omega_nm_rad_s"),
        ("sample_time_s = 1e-300", "sample_time_s"),
        ("measurement_s = 1e300", "measurement_s"),
        ("run_in_s = 1e9", "run_in_s"),
        ("tau_e_s = 1e300", "tau_e_s"),
        ("remnant.noise_level = 1e300", "remnant.noise_level"),
        ("remnant.T_n_s = 1e300", "remnant.T_n_s"),
    ] {
        fs::write(d.join("s.toml"), format!("condition = \"C1\"\n{line}\n")).unwrap();
        for command in [
            &["simulate", "--scenario", "s.toml", "--out", "s.csv"][..],
            &["margins", "--scenario", "s.toml"],
        ] {
            let (code, message) = failure_of(d, command);
            assert_eq!(code, 1, "{message}");
            assert!(
                message.contains(expected) && message.contains(" to 1"),
                "{line}: {message}"
            );
        }
    }
}

#[test]
fn table_with_a_million_columns_is_refused() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let names: Vec<String> = (0..1_000_000).map(|k| format!("c{k}")).collect();
    fs::write(
        d.join("wide.csv"),
        format!("{}\n{}\n", names.join(","), "1,".repeat(999_999) + "1"),
    )
    .unwrap();
    for command in [&["info", "wide.csv"][..], &["identify", "wide.csv"]] {
        let (code, message) = failure_of(d, command);
        assert_eq!(code, 1, "{message}");
        assert!(
            message.contains("has 1000000 columns, expected at most 10000"),
            "{message}"
        );
    }
}
