//! Output on the screen: at any width, the result is first and fits on one page, details are shown on request, and each
//! remark follows once. Also help, completions and manual pages.

#![allow(clippy::unwrap_used)]

mod common;

use std::{fs, path::Path, process::Command};

use common::{BOX_JENKINS_OPTIONS, failure_of, stdout_of};
use tempfile::TempDir;

fn simulated_runs() -> TempDir {
    let directory = TempDir::new().unwrap();
    for name in ["1.csv", "2.csv"] {
        stdout_of(directory.path(), &["simulate", "--condition", "C1", "--out", name]);
    }
    directory
}

/// Returns the arguments of a fit.
fn fit_arguments() -> Vec<&'static str> {
    [&["identify", "1.csv"][..], &BOX_JENKINS_OPTIONS].concat()
}

/// Returns the standard output on a screen of the given width.
fn output_at_width(directory: &Path, columns: &str, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(arguments)
        .current_dir(directory)
        .env("COLUMNS", columns)
        .output()
        .unwrap();
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn answer_comes_first_and_fits_on_a_screen() {
    let directory = simulated_runs();
    let d = directory.path();
    let page = stdout_of(d, &fit_arguments());
    assert!(page.starts_with("Verdict: "), "{page}");
    let lines = page.lines().count();
    assert!(lines <= 24, "{lines} lines:\n{page}");
    for part in [
        "K_e",
        "95 % from",
        "deg/deg",
        "VAF of the prediction",
        "1.csv: 8192 samples",
    ] {
        assert!(page.contains(part), "{part}: {page}");
    }
    assert!(
        !page.contains("Settings given:") && !page.contains("Ljung-Box"),
        "{page}"
    );
    let all = stdout_of(d, &[&fit_arguments()[..], &["-v"]].concat());
    for part in [
        "Settings given: ",
        "By default: ",
        "Ljung-Box",
        "noise pole (D)",
        "coefficient",
    ] {
        assert!(all.contains(part), "{part}: {all}");
    }
    // The result is the same.
    let answer = page.split("More with -v").next().unwrap();
    assert!(all.starts_with(answer), "{all}");
}

#[test]
fn pages_fit_the_screen_width() {
    let directory = simulated_runs();
    for columns in [60_usize, 80] {
        let text = output_at_width(
            directory.path(),
            &columns.to_string(),
            &[&fit_arguments()[..], &["-v"]].concat(),
        );
        let widest = text.lines().map(|line| line.chars().count()).max().unwrap();
        assert!(widest <= columns, "{widest} columns on a screen of {columns}:\n{text}");
    }
    for arguments in [
        &["info", "1.csv"][..],
        &["study", "plans"],
        &["study", "check", "bias"],
        &["margins", "--condition", "C1"],
        &[
            "convert",
            "--operator",
            "K_e=.09,T_L=.4,omega_nm=11.25,zeta_nm=.35,tau_e=.28",
        ],
    ] {
        let text = output_at_width(directory.path(), "60", arguments);
        let widest = text.lines().map(|line| line.chars().count()).max().unwrap();
        assert!(widest <= 60, "{arguments:?}, {widest} columns:\n{text}");
    }
}

#[test]
fn common_notes_of_several_files_appear_once() {
    let directory = simulated_runs();
    let d = directory.path();
    // The same row is duplicated in both files.
    for name in ["1.csv", "2.csv"] {
        let text = fs::read_to_string(d.join(name)).unwrap();
        let row = text.lines().nth(4000).unwrap();
        fs::write(d.join(name), text.replace(row, &format!("{row}\n{row}"))).unwrap();
    }
    let all = [
        "identify",
        "1.csv",
        "2.csv",
        "--structure",
        "arx",
        "--nk",
        "29",
        "--drop-repeated",
    ];
    let output = Command::new(env!("CARGO_BIN_EXE_hoid"))
        .args(all)
        .current_dir(d)
        .output()
        .unwrap();
    let printed = String::from_utf8(output.stderr).unwrap();
    let of_rows: Vec<&str> = printed
        .lines()
        .filter(|line| line.contains("duplicated") || line.contains("repeated"))
        .collect();
    assert!(
        of_rows.iter().all(|line| line.contains("1.csv and 1 more: ")),
        "{printed}"
    );
    assert_eq!(of_rows.len(), 1, "{printed}");
}

#[test]
fn mistakes_are_answered_with_suggestions() {
    let directory = simulated_runs();
    let d = directory.path();
    let (code, message) = failure_of(d, &["identify", "1.csv", "--input", "F_T"]);
    assert!(code == 1 && message.contains("did you mean \"f_t\"?"), "{message}");
    let (code, message) = failure_of(d, &["simulate", "--condition", "C1", "--out", "none/x.csv"]);
    assert!(code == 1 && !message.contains(".part"), "{message}");
    // The error is reported before any work, and no output files are written.
    fs::write(d.join("file"), "").unwrap();
    for arguments in [
        &["demo", "--out", "file/x"][..],
        &["reproduce", "--only", "fig-5", "--out", "file/x"],
        &["man", "file/x"],
    ] {
        let (code, message) = failure_of(d, arguments);
        assert!(
            code == 1 && message.contains("cannot be written"),
            "{arguments:?}: {message}"
        );
    }
}

/// Typical files of users (with other names, decimal commas, no units, or t in ms) are read or refused with advice.
#[test]
fn unprepared_files_are_read_or_refused_with_advice() {
    let directory = simulated_runs();
    let d = directory.path();
    let simulated = fs::read_to_string(d.join("1.csv")).unwrap();
    let rows: Vec<Vec<&str>> = simulated
        .lines()
        .filter(|line| !line.starts_with('#'))
        .map(|line| line.split(',').collect())
        .collect();
    let header = &rows[0];
    let at = |name: &str| header.iter().position(|known| *known == name).unwrap();
    let (t, f_t, e, u) = (at("t"), at("f_t"), at("e"), at("u"));
    let written = |file: &str, names: &str, row: &dyn Fn(&[&str]) -> String| {
        let lines: Vec<String> = rows[1..].iter().map(|cells| row(cells)).collect();
        fs::write(d.join(file), format!("{names}\n{}\n", lines.join("\n"))).unwrap();
    };
    let plain = |cells: &[&str]| [cells[t], cells[f_t], cells[u], cells[e]].join(",");
    written("mine.csv", "Time (s),Disturbance,Stick,Tracking error", &plain);
    written("comma.csv", "Time (s);Disturbance;Stick;Tracking error", &|cells| {
        plain(cells).replace(',', ";").replace('.', ",")
    });
    written("ms.csv", "t,e,u", &|cells| {
        format!(
            "{},{},{}",
            1000.0 * cells[t].parse::<f64>().unwrap(),
            cells[e],
            cells[u]
        )
    });

    let (_, message) = failure_of(d, &["identify", "mine.csv"]);
    let command = "hoid identify mine.csv --input 'Tracking error' --output Stick";
    assert!(message.contains(command), "{message}");
    let own = [
        "--input",
        "Tracking error",
        "--output",
        "Stick",
        "--structure",
        "arx",
        "--nk",
        "29",
    ];
    let page = |file: &str, more: &[&str]| {
        let page = stdout_of(d, &[&["identify", file], &own[..], more].concat());
        page.replace(file, "FILE")
    };
    let default = page("mine.csv", &[]);
    assert_eq!(page("comma.csv", &[]), default);
    assert!(!default.contains("deg"), "no file states a unit: {default}");
    assert_eq!(
        page("mine.csv", &["--unit", "e=degrees,u=radians"]),
        page("mine.csv", &["--unit", "e=deg,u=rad"])
    );
    // The columns have names other than e and u, and there are no units; six table columns fit into 80 characters.
    let info = output_at_width(d, "80", &["info", "mine.csv"]);
    assert!(info.contains(" column") && !info.contains("unit"), "{info}");
    assert!(info.lines().all(|line| line.chars().count() <= 80), "{info}");

    let reasons = output_at_width(d, "110", &["identify", "ms.csv"]);
    let first = reasons.lines().nth(1).unwrap();
    assert!(first.contains("the sample time of 10 s"), "{reasons}");
    assert!(!reasons.contains("all channels are idle"), "{reasons}");
}

#[test]
fn choices_and_delays_are_parsed_leniently() {
    let directory = simulated_runs();
    let d = directory.path();
    let page = |arguments: &[&str]| stdout_of(d, &[&["identify", "1.csv", "--orders", "nd=1"], arguments].concat());
    let default = page(&["--structure", "bj", "--nk", "29"]);
    assert_eq!(page(&["--structure", "BJ", "--nk", "0.28s"]), default);
    assert!(page(&["--nk", "0.27s..0.29s"]).contains("BJ(nb=2, nd=1, nf=2, nk=29)"));
}

#[test]
fn help_is_plain_and_completions_exist() {
    let directory = TempDir::new().unwrap();
    let d = directory.path();
    let help = stdout_of(d, &["-h"]);
    assert!(help.contains("Recordings:") && !help.contains('\u{1b}'), "{help}");
    let short = stdout_of(d, &["identify", "-h"]);
    let long = stdout_of(d, &["identify", "--help"]);
    assert!(!short.contains("--search-method") && long.contains("--search-method"));
    assert!(
        short.contains("Examples:") && short.contains("Data:") && short.contains("Results:"),
        "{short}"
    );
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let text = stdout_of(d, &["completions", shell]);
        assert!(text.contains("controlled-element"), "{shell}");
    }
    let printed = stdout_of(d, &["man", "pages"]);
    let page = fs::read_to_string(d.join("pages/hoid-identify.1")).unwrap();
    assert!(
        page.contains(".TH") && page.contains("controlled\\-element"),
        "{printed}"
    );
}
