//! Inspection of a file: `hoid info`, `hoid group init`, `identify`, `describe` and `track` find the same columns and
//! the same span, and show the arguments to use.
#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path};

use tempfile::TempDir;

use common::{failure_of, hoid, json, stdout_of, wave, write_samples};

/// An operator with an integrator, recorded as time, r, y and u. The recording has two periods of 20 s; it starts 3 s
/// before the first period and stops 1 s after the last.
fn recording_folder() -> TempDir {
    let directory = TempDir::new().unwrap();
    let people = "simulate-group --people --subjects 1 --runs 1 --plants integrator --out people";
    stdout_of(directory.path(), &people.split(' ').collect::<Vec<_>>());
    let text = fs::read_to_string(directory.path().join("people/S1_integrator_1.csv")).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter(|line| line.starts_with(|c: char| c.is_ascii_digit()))
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 2400);
    let mut csv = "time,r,y,u\n".to_owned();
    for k in 0..2640_usize {
        // The columns are t, e, u, d, y; the last rows are repeated at the start.
        let row = &rows[(k + 2400 - 180) % 2400];
        // There is no target before the first and after the last period.
        let (r, e) = (if !(180..2580).contains(&k) { 0.0 } else { row[3] }, row[1]);
        csv.push_str(&format!("{},{r},{},{}\n", k as f64 / 60.0, r - e, row[2]));
    }
    fs::create_dir(directory.path().join("runs")).unwrap();
    fs::write(directory.path().join("runs/A_so_1.csv"), csv).unwrap();
    directory
}

fn words(line: &str) -> Vec<&str> {
    line.split(' ').collect()
}

/// Returns the arguments of a displayed command.
fn displayed_arguments<'a>(text: &'a str, verb: &str) -> Vec<&'a str> {
    let at = text.find(&format!("hoid {verb} ")).unwrap();
    words(text[at..].lines().next().unwrap()).split_off(1)
}

#[test]
fn info_and_identify_read_the_file_alike() {
    let directory = recording_folder();
    let at = directory.path();
    let file = "runs/A_so_1.csv";
    let printed = stdout_of(at, &["info", file]);
    let next = displayed_arguments(&printed, "identify");
    assert_eq!(
        next,
        words("identify runs/A_so_1.csv --input r-y --output u --from 3 --to 43"),
        "{printed}"
    );
    let look = json(at, &["info", file, "--json"])["look"].clone();
    assert_eq!(look["next"], format!("hoid {}", next.join(" ")));
    assert_eq!(look["input"]["column"], "r-y");
    assert_eq!(look["excitation"]["column"], "r");
    assert_eq!(
        (&look["excitation"]["from_s"], &look["excitation"]["to_s"]),
        (&3.0.into(), &43.0.into())
    );
    assert!((look["excitation"]["period_s"].as_f64().unwrap() - 20.0).abs() < 1e-6);

    stdout_of(at, &["group", "init", "runs"]);
    let manifest: toml::Table = toml::from_str(&fs::read_to_string(at.join("runs/group.toml")).unwrap()).unwrap();
    let read = &manifest["read"];
    assert_eq!(
        (read["input"].as_str(), read["output"].as_str()),
        (Some("r-y"), Some("u"))
    );
    assert_eq!(
        (read["from_s"].as_float(), read["to_s"].as_float()),
        (Some(3.0), Some(43.0))
    );
    assert_eq!(manifest["conditions"]["so"]["excitation"].as_str(), Some("r"));

    // If the columns are not given, each command reports them, with arguments that can be used.
    for (verb, more) in [
        ("identify", &[][..]),
        ("describe", &[]),
        ("track", &["--out", "trace.csv"]),
    ] {
        let typed = [&[verb, file][..], more].concat();
        let (code, message) = failure_of(at, &typed);
        let expected =
            "there is no column e in runs/A_so_1.csv (columns: t, r, y, u). It looks like e = r-y and u = u: ";
        assert!(code == 1 && message.contains(expected), "{message}");
        let command = displayed_arguments(&message, verb);
        assert_eq!(command, [&typed[..], &["--input", "r-y", "--output", "u"]].concat());
        let found = json(at, &[&command[..], &["--from", "3", "--to", "43", "--json"]].concat());
        assert_eq!(found["records"][0]["samples"], 2400, "{verb}");
    }
    // Given values are replaced; for an unknown name a similar one is searched for.
    let (_, message) = failure_of(at, &["identify", file, "--input", "R"]);
    assert!(message.contains("did you mean \"r\"?"), "{message}");
    let (_, message) = failure_of(at, &["identify", file, "--input=e", "--output", "u"]);
    assert_eq!(
        displayed_arguments(&message, "identify"),
        words("identify runs/A_so_1.csv --input r-y --output u")
    );
}

#[test]
fn uncertain_columns_are_not_guessed() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    common::write_samples(at, "two.csv", "t,r,target,y,u", 300, |k| {
        format!(
            "{},{},{},{},{}",
            k as f64 / 100.0,
            (k as f64).sin(),
            k % 7,
            k % 5,
            k % 3
        )
    });
    common::write_samples(at, "none.csv", "a,b", 9, |k| format!("{k},{}", k * k));
    common::write_samples(at, "empty.csv", "t,e,u", 0, |_| String::new());
    let (_, message) = failure_of(at, &["identify", "two.csv"]);
    assert!(
        message.contains("has no column \"e\"") && !message.contains("looks like"),
        "{message}"
    );
    for file in ["two.csv", "none.csv"] {
        let look = json(at, &["info", file, "--json"])["look"].clone();
        assert!(look["next"].is_null(), "{look}");
        assert!(stdout_of(at, &["info", file]).contains("--input COLUMN --output COLUMN"));
        // If the columns are given, they are read.
        let columns = ["info", file, "--input", "y", "--output", "b"];
        assert!(!stdout_of(at, &columns).contains("not found"));
    }
    let named = ["info", "two.csv", "--input", "r-y", "--excitation", "none"];
    let printed = stdout_of(at, &named);
    assert!(
        printed.contains("excitation  as requested") && printed.contains("Next: hoid identify two.csv --input r-y")
    );
    let (code, _) = failure_of(at, &["info", "empty.csv"]);
    assert_eq!(code, 1);
}

/// Returns the number of samples (at 60 Hz) in the longest fitted span of a group, and the estimates of its first
/// person with their standard errors.
fn group_estimates(at: &Path, manifest: &str) -> (f64, Vec<(f64, f64)>) {
    fs::write(at.join("runs/group.toml"), manifest).unwrap();
    let _ = fs::remove_dir_all(at.join("out"));
    let found = json(at, &["group", "runs", "--out", "out", "--csv", "--json"]);
    let estimates = fs::read_to_string(at.join("out/estimates.csv")).unwrap();
    let head: Vec<&str> = estimates.lines().next().unwrap().split(',').collect();
    let column = |name: &str| head.iter().position(|known| *known == name).unwrap();
    let (from, to) = (column("from_s"), column("to_s"));
    let spans = estimates.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        cells[to].parse::<f64>().unwrap_or(0.0) - cells[from].parse::<f64>().unwrap_or(0.0)
    });
    let longest = spans.fold(0.0, f64::max);
    ((longest * 60.0).round(), pairs(&found["people"][0]["parameters"]))
}

fn pairs(parameters: &serde_json::Value) -> Vec<(f64, f64)> {
    let of = |name: &str| {
        let one = &parameters[name];
        (one["value"].as_f64().unwrap(), one["standard_error"].as_f64().unwrap())
    };
    ["T_L", "omega_nm", "zeta_nm", "tau_e"].map(of).to_vec()
}

#[test]
fn whole_periods_are_kept_with_an_offset() {
    let directory = recording_folder();
    let at = directory.path();
    let span = words("--input r-y --from 3 --to 43 --offset u=1 --json");
    let found = json(at, &[&["identify", "runs/A_so_1.csv"][..], &span].concat());
    assert_eq!(found["records"][0]["samples"], 2400);
    let of_identify = pairs(&found["operator"]);
    let head = "name = \"a\"\n[read]\ninput = \"r-y\"\noutput = \"u\"\nfrom_s = 3.0\nto_s = 43.0\n";
    let run = "[[runs]]\nsubject = \"A\"\ncondition = \"so\"\nrun = \"1\"\nfile = \"A_so_1.csv\"\n";
    let of_condition = "[conditions.so]\nexcitation = \"r\"\noffset_samples = 1.0\n";
    let prepared = "[prepare]\noffset = { u = 1 }\n[conditions.so]\nexcitation = \"r\"\n";
    for offset in [of_condition, prepared] {
        let (samples, of_group) = group_estimates(at, &format!("{head}{offset}{run}"));
        assert_eq!(samples, 2400.0);
        for (one, other) in of_identify.iter().zip(&of_group) {
            assert!(
                (one.0 - other.0).abs() <= 1e-9 * one.0.abs(),
                "{of_identify:?} {of_group:?}"
            );
            assert!((one.1 - other.1).abs() <= 1e-6 * one.1, "{of_identify:?} {of_group:?}");
        }
    }
    // If the file ends with the span, no additional rows are available.
    let whole = words("--input r-y --offset u=1 --json");
    let found = json(at, &[&["identify", "runs/A_so_1.csv"][..], &whole].concat());
    assert_eq!(found["records"][0]["samples"], 2639);
}

#[test]
fn delay_in_seconds_equals_nk() {
    let directory = common::simulated_run();
    let at = directory.path();
    let fit = |delay: &[&str]| {
        let typed = words("identify c1.csv --structure bj --orders nd=1 --json");
        json(at, &[&typed[..], delay].concat())
    };
    let (samples, seconds) = (fit(&["--nk", "29"]), fit(&["--delay", ".28"]));
    assert_eq!(seconds["orders"]["nk"], 29);
    assert_eq!(samples["parameters"], seconds["parameters"]);
    let setting = |found: &serde_json::Value| {
        let all = found["settings"].to_string();
        all.contains("0.28 s")
    };
    assert!(setting(&seconds) && !setting(&samples), "{}", seconds["settings"]);
    assert_eq!(fit(&["--delay", "0.27..0.29"])["orders"]["nk"], 29);
    let track = |delay: &[&str]| {
        let typed = words("track c1.csv --method rpem --orders nd=1 --out trace.csv --json");
        let found = json(at, &[&typed[..], delay].concat());
        fs::remove_file(at.join("trace.csv")).unwrap();
        found["last"].clone()
    };
    assert_eq!(track(&["--nk", "29"]), track(&["--delay", ".28"]));
    for (wrong, expected) in [
        (&["--delay", ".28", "--nk", "29"][..], "give only one of them"),
        (&["--delay", "-1"], "expected"),
        (&["--delay", ".4...3"], "as 0.1..0.4"),
        (&["--delay", "inf"], "as 0.1..0.4"),
    ] {
        let (code, message) = failure_of(at, &[&["identify", "c1.csv"][..], wrong].concat());
        assert!(
            code == 2 && (message.contains(expected) || message.contains("unexpected")),
            "{message}"
        );
    }
}

/// `info` interprets a cell in the same way as the reader.
#[test]
fn info_interprets_cells_like_the_reader() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    for (cell, is_missing) in [
        ("-", true),
        ("None", true),
        ("#N/A", true),
        ("abc", false),
        ("Inf", false),
    ] {
        write_samples(d, "cells.csv", "t,e,u", 3000, |k| {
            let (t, e, u) = wave(k);
            match k {
                700 => format!("{t},{cell},{u}"),
                _ => format!("{t},{e},{u}"),
            }
        });
        let info = stdout_of(d, &["info", "cells.csv"]);
        let fill = [
            "identify",
            "cells.csv",
            "--structure",
            "arx",
            "--nk",
            "5",
            "--fill",
            "--json",
        ];
        let found = hoid(d, &fill);
        let error = String::from_utf8_lossy(&found.stderr).into_owned();
        assert_eq!(error.contains("line 702, column e"), !is_missing, "{cell}: {error}");
        if !is_missing {
            let printed = error.lines().find_map(|line| line.strip_prefix("error: ")).unwrap();
            assert!(info.contains(printed), "{cell}: {printed} not in {info}");
        }
    }
}
