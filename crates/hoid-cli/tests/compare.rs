//! Comparison of conditions from the output of `hoid group --json`.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;

use common::{failure_of, hoid, stdout_of};
use tempfile::TempDir;

/// Writes the results of three people in two conditions; one person has no crossover in the second condition.
fn results() -> TempDir {
    let directory = TempDir::new().unwrap();
    let mut people = Vec::new();
    for (subject, fo, so) in [
        ("P03", 2.0, 1.2),
        ("P05", 4.0, 3.3),
        ("P09", 3.0, 2.6),
        ("P11", 3.5, f64::NAN),
    ] {
        for (condition, crossover) in [("fo", fo), ("so", so)] {
            people.push(serde_json::json!({
                "subject": subject, "condition": condition, "run": "all", "runs": 10, "status": "ok", "form": "lead",
                "parameters": {"tau_e": {"value": 0.6 / fo, "standard_error": 0.01, "determined": true, "prior_share": 0.0}},
                "open_loop": {"crossover_rad_s": {"value": crossover, "standard_error": 0.1}},
                "verdict": {"level": "trustworthy", "reasons": [], "notes": []},
            }));
        }
    }
    let object = serde_json::json!({"group": "pilots", "people": people});
    fs::write(directory.path().join("results.json"), object.to_string()).unwrap();
    directory
}

#[test]
fn conditions_are_compared() {
    let directory = results();
    let at = directory.path();
    let output_text = stdout_of(at, &["compare", "results.json", "--of", "crossover", "-v"]);
    assert!(output_text.starts_with("Verdict: doubtful"), "{output_text}");
    assert!(
        output_text.contains("P11 in so is left out: it has no crossover"),
        "{output_text}"
    );
    let sentence =
        "crossover fell by 0.63 rad/s from fo to so (95 % 0.12 to 1.15, t(2) = -5.3, p = 0.034, d_z = -3, n = 3)";
    assert!(output_text.contains(sentence), "{output_text}");
    assert!(
        output_text.contains("Means over people") && output_text.contains("Settings given: of: crossover"),
        "{output_text}"
    );

    let arguments = [
        "compare",
        "results.json",
        "--of",
        "crossover",
        "--out",
        "all",
        "--table",
        "t.tex",
        "--figure",
        "f.svg",
        "--json",
    ];
    let printed = stdout_of(at, &arguments);
    let object: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert_eq!(object["kind"], "comparison");
    assert_eq!(object["left_out"][0]["subject"], "P11");
    assert_eq!(
        fs::read_to_string(at.join("all/comparison.json")).unwrap().trim(),
        printed.trim()
    );
    assert_eq!(
        fs::read_to_string(at.join("all/sentences.txt")).unwrap().trim(),
        sentence
    );
    assert_eq!(
        fs::read(at.join("all/differences.tex")).unwrap(),
        fs::read(at.join("t.tex")).unwrap()
    );
    let table = fs::read_to_string(at.join("t.tex")).unwrap();
    assert!(
        table.starts_with("% hoid") && table.contains("comparison pilots, doubtful"),
        "{table}"
    );
    assert!(table.contains("so - fo & $-0.63 \\pm 0.12$"), "{table}");
    assert!(fs::read_to_string(at.join("f.svg")).unwrap().contains(">P09</text>"));
}

#[test]
fn mistakes_are_explained_with_a_remedy() {
    let directory = results();
    let at = directory.path();
    for (arguments, code, word) in [
        (&["--of", "speed"][..], 2, "expected crossover"),
        (&["--of", "rms_e"], 2, "give the directory"),
        (&["--factor", "display"], 2, "the conditions fo, so"),
        (&["--between"], 2, "varies within people"),
        (&["--within", "--between"], 2, "cannot be used with"),
    ] {
        let all = [&["compare", "results.json"], arguments].concat();
        let (found, output_text) = failure_of(at, &all);
        assert!(
            found == code && output_text.contains(word),
            "{arguments:?}: {found}, {output_text}"
        );
    }
    let (code, output_text) = failure_of(at, &["compare", "."]);
    assert!(
        code == 1 && output_text.contains("there is no group.toml"),
        "{output_text}"
    );
    // No person has a margin, so nothing is determined, and the message reports this.
    let output = hoid(at, &["compare", "results.json", "--of", "phase_margin"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .contains("P03 in fo is left out")
    );
}

/// People have different forms with the two elements, so their parameters are compared in a common form.
#[test]
fn recordings_are_compared_in_a_common_form() {
    let directory = TempDir::new().unwrap();
    let at = directory.path();
    let people = "simulate-group --people --subjects 3 --runs 1 --plants integrator,double-integrator --remnants lag \
                  --remnant-share 0.05..0.1 --out runs";
    stdout_of(at, &people.split_whitespace().collect::<Vec<_>>());
    let compared = ["compare", "runs", "--of", "crossover,T_L", "--out", "found", "--json"];
    let printed = stdout_of(at, &compared);
    let object: serde_json::Value = serde_json::from_str(&printed).unwrap();
    let form = object["verdict"]["notes"].to_string();
    assert!(
        form.contains("the parameters of all people are compared in the form lead-lag"),
        "{form}"
    );
    let compared_of = |quantity: &str| {
        let differences = object["differences"].as_array().unwrap();
        differences.iter().any(|d| d["quantity"] == quantity)
    };
    assert!(compared_of("T_L") && compared_of("crossover"), "{printed}");
    // The crossover is computed with the best form for each element.
    let of_results: serde_json::Value = serde_json::from_str(&stdout_of(
        at,
        &["compare", "found/group", "--of", "crossover", "--json"],
    ))
    .unwrap();
    assert_eq!(of_results["differences"][0]["value"], object["differences"][0]["value"]);
    // The results are kept and used again.
    let same = stdout_of(at, &compared);
    assert_eq!(same, printed);
    let of_group = hoid(at, &["compare", "found/group", "--of", "T_L"]);
    let message = String::from_utf8(of_group.stderr).unwrap();
    assert!(message.contains("form = \"lead-lag\""), "{message}");
    // Without --out no files remain.
    let before = fs::read_dir(at).unwrap().count();
    stdout_of(at, &["compare", "runs/group.toml", "--of", "crossover"]);
    assert_eq!(fs::read_dir(at).unwrap().count(), before);
}
