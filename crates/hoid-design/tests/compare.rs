//! Comparisons of groups, from the JSON that `hoid group` prints to sentences and back.
#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use hoid_design::compare::{
    Adjustment, CompareError, Comparison, ComparisonOptions, Factor, GroupEstimates, Quantity, Variation,
};
use hoid_model::VerdictLevel;
use serde_json::{Value, json};

/// A person in a condition: crossover, its error, the delay, the form.
type Row<'a> = (&'a str, &'a str, f64, f64, f64, &'a str);

fn group(rows: &[Row<'_>]) -> GroupEstimates {
    let person = |(subject, condition, crossover, error, tau, form): &Row<'_>| {
        json!({
            "subject": subject, "condition": condition, "run": "all", "runs": 5, "status": "ok", "form": form,
            "parameters": {
                "tau_e": {"value": tau, "standard_error": 0.01, "unit": "s", "determined": true, "prior_share": 0.1},
                "K": {"value": 3.0 + tau, "standard_error": 0.2, "unit": "", "determined": true, "prior_share": 0.0},
            },
            "open_loop": {
                "crossover_rad_s": {"value": crossover, "standard_error": error},
                "phase_margin_deg": {"value": 30.0 + 10.0 * crossover, "standard_error": 2.0},
            },
            "verdict": {"level": "trustworthy", "reasons": [], "notes": []},
        })
    };
    let people: Vec<Value> = rows.iter().map(person).collect();
    parse_group(&json!({"group": "pilots", "people": people}).to_string()).unwrap()
}

fn parse_group(text: &str) -> Result<GroupEstimates, CompareError> {
    let file = tempfile::Builder::new().suffix(".json").tempfile().unwrap();
    std::fs::write(file.path(), text).unwrap();
    GroupEstimates::read(file.path())
}

const THREE_PEOPLE: [Row<'static>; 6] = [
    ("P03", "fo", 2.0, 0.05, 0.25, "lead"),
    ("P03", "so", 1.2, 0.05, 0.40, "lead"),
    ("P05", "fo", 4.0, 0.05, 0.22, "lead"),
    ("P05", "so", 3.3, 0.05, 0.30, "lead"),
    ("P09", "fo", 3.0, 0.05, 0.23, "lead"),
    ("P09", "so", 2.6, 0.05, 0.32, "lead"),
];

fn crossover_quantity() -> Vec<Quantity> {
    vec![Quantity::Crossover]
}

#[test]
fn conditions_are_compared_within_people() {
    let found = ComparisonOptions::default().run(&group(&THREE_PEOPLE)).unwrap();
    assert_eq!(found.verdict.level, VerdictLevel::Trustworthy, "{}", found.verdict);
    let names: Vec<String> = found.differences.iter().map(|d| d.quantity.to_string()).collect();
    assert_eq!(names, ["crossover", "phase_margin", "tau_e"]);
    let d = &found.differences[0];
    // Differences -.8, -.7, -.4: mean -.6333, SD .2082, t = -5.27; three people have equal weights.
    assert!(
        (d.estimate.value + 0.63333).abs() < 1e-4 && (d.estimate.t + 5.27).abs() < 0.01,
        "{d:?}"
    );
    assert!((d.unweighted.value + 19.0 / 30.0).abs() < 1e-12);
    assert_eq!(
        (d.variation, d.degrees_of_freedom, d.people.len()),
        (Variation::Within, 2, 3)
    );
    let size = d.effect_size.as_ref().unwrap();
    assert!(size.name == "d_z" && (size.value + 3.04).abs() < 0.01);
    let p: Vec<f64> = found.differences.iter().map(|d| d.estimate.p).collect();
    let least = p.iter().copied().fold(1.0, f64::min);
    let adjusted = found.differences.iter().map(|d| d.p_adjusted).fold(1.0, f64::min);
    assert!((adjusted - 3.0 * least).abs() < 1e-12);
    let unadjusted = ComparisonOptions {
        quantities: crossover_quantity(),
        ..ComparisonOptions::default()
    };
    let found = unadjusted.run(&group(&THREE_PEOPLE)).unwrap();
    assert_eq!(
        found.differences[0].sentence,
        "crossover fell by 0.63 rad/s from fo to so (95 % 0.12 to 1.15, t(2) = -5.3, p = 0.034, d_z = -3, n = 3)"
    );
}

#[test]
fn missing_results_are_reported() {
    let mut rows = THREE_PEOPLE.to_vec();
    rows.push(("P11", "fo", 2.5, 0.1, 0.2, "lead"));
    rows[1].2 = f64::NAN; // null in JSON
    let found = ComparisonOptions {
        quantities: crossover_quantity(),
        ..ComparisonOptions::default()
    }
    .run(&group(&rows))
    .unwrap();
    assert_eq!(found.differences[0].people.len(), 2);
    let reasons: Vec<&str> = found.verdict.reasons().collect();
    assert!(
        reasons
            .iter()
            .any(|r| r.starts_with("P03 in so is left out: it has no crossover")),
        "{reasons:?}"
    );
    assert!(
        reasons
            .iter()
            .any(|r| r.starts_with("P11 in so is left out: there is no run")),
        "{reasons:?}"
    );
    assert!(
        reasons.iter().any(|r| r.contains("one degree of freedom")),
        "{reasons:?}"
    );
    // No one is left.
    let found = ComparisonOptions {
        quantities: crossover_quantity(),
        ..ComparisonOptions::default()
    }
    .run(&group(&rows[..4]))
    .unwrap();
    assert_eq!(
        (found.differences.len(), found.verdict.level),
        (0, VerdictLevel::NotDetermined)
    );
}

#[test]
fn parameters_are_compared_only_for_one_form() {
    let of = vec!["K".parse().unwrap(), "tau_e".parse().unwrap()];
    let comparing = ComparisonOptions {
        quantities: of,
        ..ComparisonOptions::default()
    };
    assert_eq!(comparing.run(&group(&THREE_PEOPLE)).unwrap().differences.len(), 2);
    let mut rows = THREE_PEOPLE;
    rows[3].5 = "lead2-lag";
    let found = comparing.run(&group(&rows)).unwrap();
    let names: Vec<String> = found.differences.iter().map(|d| d.quantity.to_string()).collect();
    assert_eq!(names, ["tau_e"]);
    let reason = found.verdict.reasons().next().unwrap().to_owned();
    assert!(
        reason.contains("lead2-lag: P05 in so") && reason.contains("form = \"lead\""),
        "{reason}"
    );
    assert!(found.verdict.notes().any(|note| note.contains("different forms")));
}

#[test]
fn groups_and_interactions_are_compared() {
    let rows: Vec<Row<'_>> = [("A", 2.0), ("B", 2.4), ("C", 2.2), ("D", 3.0), ("E", 3.5), ("F", 3.1)]
        .iter()
        .flat_map(|(who, w)| {
            [
                (*who, "fo", *w, 0.1, 0.2, "lead"),
                (*who, "so", 0.5 * w, 0.1, 0.3, "lead"),
            ]
        })
        .collect();
    let factors: Vec<Factor> = vec![
        "condition".parse().unwrap(),
        "training:no=A,B,C;yes=D,E,F".parse().unwrap(),
    ];
    let comparing = ComparisonOptions {
        factors,
        quantities: crossover_quantity(),
        adjustment: Adjustment::None,
        ..ComparisonOptions::default()
    };
    let found = comparing.run(&group(&rows)).unwrap();
    let of = |factor: &str| found.differences.iter().find(|d| d.factor == factor).unwrap();
    // Means over both conditions: .75 w; 3.2 - 2.2 = 1 of w.
    let training = of("training");
    assert_eq!(
        (training.variation, training.degrees_of_freedom),
        (Variation::Between, 4)
    );
    assert!((training.estimate.value - 0.75).abs() < 0.01, "{training:?}");
    assert!(
        training
            .sentence
            .starts_with("crossover was 0.75 rad/s higher in yes than in no"),
        "{}",
        training.sentence
    );
    assert!(training.sentence.ends_with("n = 3 and 3)"));
    let both = of("condition × training");
    assert!((both.estimate.value + 0.5).abs() < 0.01);
    assert!(
        both.sentence
            .starts_with("the effect of condition on crossover (so - fo)"),
        "{}",
        both.sentence
    );
    assert_eq!(found.means.len(), 4);
    assert!((of("condition").estimate.value + 1.35).abs() < 0.01);
}

#[test]
fn result_round_trips_through_json() {
    let found = ComparisonOptions::default().run(&group(&THREE_PEOPLE)).unwrap();
    let text = found.to_json();
    assert_eq!(Comparison::from_json(&text).unwrap(), found);
    let object: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(object["kind"], "comparison");
    let d = &object["differences"][0];
    assert!(d["quantity"] == "crossover" && d["unit"] == "rad/s" && d["interval"][0].is_number() && d["p"].is_number());
    assert_eq!(object["settings"][0]["value"], "condition, within people: fo, so");
    for bad in [
        "",
        "{}",
        "{\"kind\": \"comparison\"}",
        &text.replace("crossover", "margin"),
    ] {
        assert!(Comparison::from_json(bad).is_err(), "{bad:.40}");
    }
}

#[test]
fn error_messages_contain_advice() {
    let all = group(&THREE_PEOPLE);
    let of = |names: &[&str]| names.iter().map(|n| n.parse().unwrap()).collect::<Vec<Quantity>>();
    let run = |comparing: ComparisonOptions| comparing.run(&all).unwrap_err().to_string();
    let from_runs = run(ComparisonOptions {
        quantities: of(&["gain_db@2"]),
        ..ComparisonOptions::default()
    });
    assert!(
        from_runs.contains("gain at 2 rad/s") && from_runs.contains("give the directory"),
        "{from_runs}"
    );
    let factors = vec!["display".parse().unwrap()];
    let unknown = run(ComparisonOptions {
        factors,
        ..ComparisonOptions::default()
    });
    assert!(
        unknown.contains("fo, so") && unknown.contains("P03, P05, P09"),
        "{unknown}"
    );
    let between = run(ComparisonOptions {
        variation: Some(Variation::Between),
        ..ComparisonOptions::default()
    });
    assert!(between.contains("varies within people"), "{between}");
    for (text, word) in [
        ("[1", "not JSON"),
        ("{}", "no people"),
        ("{\"people\": [{}]}", "no subject"),
    ] {
        let error = parse_group(text).unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("hoid group"), "{error}");
    }
    let empty = tempfile::tempdir().unwrap();
    let error = GroupEstimates::read(empty.path()).unwrap_err().to_string();
    assert!(error.contains("group.toml"), "{error}");
    assert!(GroupEstimates::read(&PathBuf::from("nowhere.json")).is_err());
}
