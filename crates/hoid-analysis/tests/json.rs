//! Conversion of results to JSON and back.
#![allow(clippy::unwrap_used)]

use hoid_analysis::{
    BatchEstimator, Identification, IdentifiedModel, Polynomials, Recordings,
    json::{BatchResult, JsonFit},
};
use hoid_ident::{GreyBox, SigmoidChange, family::FamilyEstimator};
use hoid_model::{
    Form, Record, Structure,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use serde_json::Value;

fn run(seed: u64) -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    let run = RunSeed {
        seed,
        ..RunSeed::default()
    };
    simulator.run(run, false).unwrap().span(0.0, 50.0).unwrap()
}

/// Returns the result and the result restored from its JSON, after checking that they are equal.
fn json_round_trip<E: BatchEstimator>(with: Identification<E>) -> (IdentifiedModel<E::Fit>, IdentifiedModel<E::Fit>)
where
    E::Fit: JsonFit,
{
    let found = with.run(Recordings::from_records([run(1)])).unwrap();
    let text = found.to_json().unwrap();
    let again = IdentifiedModel::<E::Fit>::from_json(&text).unwrap();
    assert!(again == found);
    assert_eq!(again.to_json().unwrap(), text);
    assert_eq!(again.verdict, found.verdict);
    assert_eq!(again.settings, found.settings);
    assert!(again.data.records.is_empty());
    // The printed text contains only JSON numbers, so a program that writes the JSON again does not change the state.
    let value: Value = serde_json::from_str(&text).unwrap();
    assert!(IdentifiedModel::<E::Fit>::from_json(&value.to_string()).unwrap() == found);
    let other = IdentifiedModel::<E::Fit>::from_json(&text.replacen("\"state\": \"", "\"state\": \"0", 1));
    assert!(other.is_err());
    (found, again)
}

fn quick_estimator() -> FamilyEstimator {
    FamilyEstimator {
        forms: vec![Form::Lead, Form::Gain],
        nd: Some(0..=4),
        ..FamilyEstimator::default()
    }
}

#[test]
fn json_round_trip_keeps_predictions() {
    let other = run(2);
    let (one, two) = json_round_trip(Identification::of(quick_estimator()));
    let models = [&one, &two].map(|found| &found.fit.operator(0).polynomial_fit);
    assert_eq!(models[0].predict(&other).unwrap(), models[1].predict(&other).unwrap());
    let (one, two) = json_round_trip(Identification::of(GreyBox::new(1..=2)));
    assert_eq!(
        one.fit.polynomial_fit(0).simulate(&other).unwrap(),
        two.fit.polynomial_fit(0).simulate(&other).unwrap()
    );
    let (one, two) = json_round_trip(Identification::of(SigmoidChange::default()));
    assert_eq!(one.fit.residuals(&other).unwrap(), two.fit.residuals(&other).unwrap());
    let (one, two) = json_round_trip(Identification::of(Polynomials {
        orders: [("nd".to_owned(), 1..=2), ("nk".to_owned(), 28..=30)].into(),
        ..Polynomials::new(Structure::BoxJenkins)
    }));
    assert_eq!(one.fit.fit, two.fit.fit);
    assert_eq!(one.fit.choice, two.fit.choice);
}

#[test]
fn result_kind_is_detected_and_checked() {
    let found = Identification::of(quick_estimator())
        .run(Recordings::from_records([run(1)]))
        .unwrap();
    let text = found.to_json().unwrap();
    assert!(matches!(BatchResult::from_json(&text), Ok(BatchResult::Operator(again)) if again == found));
    let words = IdentifiedModel::<hoid_ident::SigmoidFit>::from_json(&text)
        .unwrap_err()
        .to_string();
    assert!(words.contains("operator change=sigmoid"), "{words}");
    for wrong in [
        "",
        "null",
        "{}",
        "{\"estimator\": \"operator\"}",
        "{\"estimator\": \"operator\", \"state\": \"\"}",
    ] {
        let words = BatchResult::from_json(wrong).unwrap_err().to_string();
        assert!(words.contains("not a result of a fit"), "{words}");
    }
}

#[test]
fn non_default_settings_are_marked_as_given() {
    let with = Identification {
        controlled_element: Some("1/s".parse().unwrap()),
        ..Identification::of(quick_estimator())
    };
    let found = with.run(Recordings::from_records([run(1)])).unwrap();
    let given = |name: &str| {
        let one = found.settings.iter().find(|one| one.name == name);
        one.unwrap().is_given
    };
    for (name, expected) in [
        ("structure", false),
        ("form", true),
        ("noise orders", true),
        ("prior", false),
        ("search", false),
        ("controlled element", true),
        ("faults", false),
    ] {
        assert_eq!(given(name), expected, "{name}");
    }
}
