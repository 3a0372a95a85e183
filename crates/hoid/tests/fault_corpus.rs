//! Tests with part of the corpus of faults; `cargo xtask slow faults` runs the whole corpus.
#![allow(clippy::unwrap_used)]

// The study uses the other parts of this module.
#[allow(dead_code)]
#[path = "common/fault_corpus/mod.rs"]
mod fault_corpus;

use fault_corpus::{
    bases::{OperatorKind, Truth, base},
    inject::inject,
    judge::{CaseOutcome, CaseTruth, Row, judge_fit, judge_trace},
    kinds::{Change, Channels, Fault, FaultPosition, Kind, WHOLE_LENGTH_S, faults},
    program::{EvaluationMethod, evaluate_case, parse_rows},
    summary::{Numbers, median, table_by_method},
    table::{Table, standard_deviation},
};
use serde_json::json;

/// Seed that differs from the seed of the numbers in `research/notes/faults.md`.
const SEED: u64 = 77;

fn two_runs() -> (Table, Table) {
    let base = base(OperatorKind::C1, SEED, 1).unwrap();
    (base.runs[0].clone(), base.second)
}

fn fault(what: Change, on: Channels, size: f64, place: FaultPosition) -> Fault {
    Fault {
        kind: Kind { what, on },
        size,
        place,
    }
}

#[test]
fn corpus_has_hundreds_of_distinct_faults() {
    let all = faults();
    assert!(all.len() > 250, "{}", all.len());
    for (i, one) in all.iter().enumerate() {
        assert!(!all[..i].contains(one), "{one:?} is duplicated");
        assert!(one.kind.name() != "none");
    }
}

#[test]
fn runs_and_faults_are_reproducible() {
    let (clean, second) = two_runs();
    assert_eq!((clean.clone(), second.clone()), two_runs());
    for (case, fault) in (0..).zip(faults()).step_by(7) {
        let text = |seed: u64| inject(&fault, &clean, &second, seed, case).table.to_csv();
        assert_eq!(text(3), text(3), "{fault:?}");
    }
    let spike = fault(Change::Spike, Channels::E, 10.0, FaultPosition::Middle);
    let at = |seed| inject(&spike, &clean, &second, seed, 5).from_s;
    assert_ne!(at(3), at(4));
    let person = |case| base(OperatorKind::Person, SEED, case).unwrap();
    assert_eq!(person(3).truth, person(3).truth);
    assert_ne!(person(3).truth, person(4).truth);
}

/// A fault changes the recording only in its own rows and channels.
#[test]
fn faults_change_only_their_rows_and_channels() {
    let (clean, second) = two_runs();
    for (case, fault) in (0..).zip(faults()) {
        let found = inject(&fault, &clean, &second, SEED, case);
        let (from, to) = found.rows;
        let (on, table) = (fault.kind.on, &found.table);
        let added = table.len() as isize - clean.len() as isize;
        let end_row = table.len() - (clean.len() - to);
        assert!(
            found.from_s <= found.to_s && found.to_s <= table.duration_s() + 1e-9,
            "{fault:?}"
        );
        assert_eq!(table.e.len(), table.t.len());
        assert_eq!(table.u.len(), table.t.len());
        for (own, was, touched) in [(&table.e, &clean.e, on.e()), (&table.u, &clean.u, on.u())] {
            assert_eq!(own[..from], was[..from], "{fault:?}");
            if fault.kind.what != Change::Short {
                assert_eq!(own[end_row..], was[to..], "{fault:?}");
            }
            let inside = |k: usize| own[k].to_bits() != was[k].to_bits();
            let others = (from..to.min(own.len())).filter(|&k| inside(k)).count();
            if !touched {
                assert_eq!(others, 0, "{fault:?}");
            } else if added == 0 && fault.kind.what != Change::Milliseconds {
                // A frozen, held or rounded value may be unchanged.
                assert!(others * 50 > to - from, "{fault:?}: {others} of {}", to - from);
            }
        }
        let expected = match fault.kind.what {
            Change::Idle | Change::IdleNoisy | Change::Duplicated => (fault.size / clean.h).round() as isize,
            Change::Lost => -((fault.size / clean.h).round() as isize),
            Change::Short => fault.size as isize - clean.len() as isize,
            _ => 0,
        };
        assert_eq!(added, expected, "{fault:?}");
        let share = found.from_s / table.duration_s();
        match fault.place {
            FaultPosition::Start => assert!(share < 0.08, "{fault:?}: {share}"),
            FaultPosition::Middle => assert!((0.3..0.6).contains(&share), "{fault:?}: {share}"),
            FaultPosition::End => assert!((0.7..1.0).contains(&share), "{fault:?}: {share}"),
            FaultPosition::Whole => {}
        }
    }
}

#[test]
fn faults_have_the_stated_size() {
    let (clean, second) = two_runs();
    let with = |what, on, size| inject(&fault(what, on, size, FaultPosition::Middle), &clean, &second, SEED, 9);
    let (of_e, of_u) = (standard_deviation(&clean.e), standard_deviation(&clean.u));

    let spike = with(Change::Spike, Channels::Both, 30.0);
    let k = spike.rows.0;
    assert!(((spike.table.e[k] - clean.e[k]).abs() / of_e - 30.0).abs() < 1e-9);
    assert!(((spike.table.u[k] - clean.u[k]).abs() / of_u - 30.0).abs() < 1e-9);

    let step = with(Change::Step, Channels::U, 50.0);
    let off: Vec<f64> = (step.rows.0..clean.len())
        .map(|k| step.table.u[k] - clean.u[k])
        .collect();
    assert!(off.iter().all(|d| (d.abs() / of_u - 0.5).abs() < 1e-9));
    assert_eq!(step.from_s, step.to_s);

    let wrap = with(Change::Wrap, Channels::E, 2.0);
    assert_eq!(wrap.rows.1 - wrap.rows.0, 200);
    assert!((wrap.table.e[wrap.rows.0] - clean.e[wrap.rows.0] - 360.0).abs() < 1e-9);

    let missing = with(Change::Missing, Channels::E, 10.0);
    assert_eq!(missing.table.e.iter().filter(|x| x.is_nan()).count(), 10);
    assert_eq!(
        missing
            .table
            .to_csv()
            .lines()
            .filter(|line| line.contains(",,"))
            .count(),
        10
    );

    let late = with(Change::Late, Channels::U, 5.0);
    let last = clean.len() - 1;
    assert_eq!(late.table.u[last], clean.u[last - 5]);
    let lost = with(Change::Lost, Channels::Both, 1.0);
    assert_eq!(lost.table.e[lost.rows.0], clean.e[lost.rows.0 + 100]);
    assert_eq!(lost.table.t, clean.t[..clean.len() - 100]);

    let swapped = inject(
        &fault(Change::Swapped, Channels::Both, WHOLE_LENGTH_S, FaultPosition::Whole),
        &clean,
        &second,
        SEED,
        9,
    );
    assert_eq!((&swapped.table.e, &swapped.table.u), (&clean.u, &clean.e));
    let held = with(Change::Frozen, Channels::U, 1.0);
    assert!((held.rows.0..held.rows.1).all(|k| held.table.u[k] == clean.u[held.rows.0]));
    let coarse = fault(Change::Quantised, Channels::U, 1.0, FaultPosition::Whole);
    let coarse = inject(&coarse, &clean, &second, SEED, 9);
    assert!(
        coarse
            .table
            .u
            .iter()
            .all(|x| (x / of_u - (x / of_u).round()).abs() < 1e-9)
    );
}

fn known_case(span_s: Option<(f64, f64)>) -> CaseTruth {
    let truth: Truth = vec![("K_e".to_owned(), 1.0), ("tau_e".to_owned(), 0.2)];
    CaseTruth {
        truth,
        then: None,
        span_s,
        file: "faulty.csv".to_owned(),
        sample_time: 0.01,
    }
}

fn fit(value: f64, error: Option<f64>, level: &str) -> serde_json::Value {
    json!({
        "verdict": {"level": level, "findings": []},
        "operator": {"K_e": {"value": value, "standard_error": error}, "tau_e": {"value": 0.21, "standard_error": null}},
    })
}

#[test]
fn wrong_fits_are_detected() {
    let judged = |json: &serde_json::Value| judge_fit(json, &known_case(Some((10.0, 11.0))));
    let silent = judged(&fit(1.5, Some(0.1), "trustworthy"));
    assert!(silent.wrong && !silent.is_flagged() && silent.is_silently_wrong());
    assert!(matches!(&silent.worst, Some((name, z)) if name == "K_e" && (z - 5.0).abs() < 1e-9));
    let flagged = judged(&fit(1.5, Some(0.1), "doubtful"));
    assert!(flagged.wrong && flagged.is_flagged() && !flagged.is_silently_wrong());
    assert!(!judged(&fit(1.39, Some(0.1), "trustworthy")).wrong);
    // A value without a standard error is not assessed, except for a delay in whole samples.
    let open = judged(&fit(9.0, None, "trustworthy"));
    assert!(!open.wrong && matches!(&open.worst, Some((name, z)) if name == "tau_e" && (z - 1.0).abs() < 1e-9));
    let mut late = fit(1.0, Some(0.1), "trustworthy");
    late["operator"]["tau_e"]["value"] = json!(0.05);
    assert!(judged(&late).is_silently_wrong());
    let mut undetermined = fit(9.0, Some(0.1), "trustworthy");
    undetermined["operator"]["K_e"]["determined"] = json!(false);
    assert!(!judged(&undetermined).wrong);
    let refused = CaseOutcome::refused();
    assert!(refused.is_flagged() && !refused.wrong);
}

#[test]
fn only_faults_at_their_place_count_as_flagged() {
    let with = |from: f64, to: f64, record: &str| {
        let mut json = fit(1.5, Some(0.1), "trustworthy");
        json["faults"] = json!([{"kind": "spike", "from": from, "to": to, "record": record}]);
        judge_fit(&json, &known_case(Some((10.0, 11.0))))
    };
    assert!(with(11.9, 12.0, "/a/faulty.csv").is_flagged());
    assert!(with(2.0, 9.1, "faulty.csv").placed);
    assert!(!with(12.1, 13.0, "faulty.csv").is_flagged());
    assert!(!with(10.0, 11.0, "run0.csv").is_flagged());
    let mut json = fit(1.0, Some(0.1), "doubtful");
    json["verdict"]["findings"] = json!([{"kind": "faults", "severity": "doubt", "words": ""}]);
    let clean = judge_fit(&json, &known_case(None));
    assert!(clean.of_faults && !clean.placed && clean.kinds == ["faults"]);
    json["verdict"]["findings"][0]["severity"] = json!("note");
    assert!(!judge_fit(&json, &known_case(None)).of_faults);
}

#[test]
fn traces_are_judged_at_the_end_and_during_recovery() {
    let json = json!({"verdict": {"level": "trustworthy", "findings": []}});
    // The trace is wrong by ten standard errors for 8 s after a fault of 1 s, and then near the true value.
    let off_until = |end: f64| -> Vec<Row> {
        let row = |i: u32| {
            let t = f64::from(i) * 0.1;
            let value = if (10.0..end).contains(&t) { 2.0 } else { 1.1 };
            Row {
                t,
                claims: vec![("K_e".to_owned(), value, 0.1)],
            }
        };
        (0..600).map(row).collect()
    };
    let known = known_case(Some((10.0, 11.0)));
    let back = judge_trace(&json, &off_until(19.0), &known);
    assert!(!back.wrong);
    assert!((back.recovery_s.unwrap() - 7.9).abs() < 0.11, "{back:?}");
    assert!((back.lasting.unwrap() - 10.0).abs() < 1e-6);
    let slow = judge_trace(&json, &off_until(40.0), &known);
    assert!(slow.is_silently_wrong() && slow.recovery_s.unwrap() > 28.0);
    let never = judge_trace(&json, &off_until(100.0), &known);
    assert!(never.wrong && never.recovery_s.unwrap().is_infinite());
    let short = judge_trace(&json, &off_until(13.0), &known);
    assert!(short.lasting.unwrap() < 2.0, "{short:?}");
    // Another person acts from 10 s on, and a trace that tracks this person is correct.
    let other = CaseTruth {
        then: Some(vec![("K_e".to_owned(), 2.0)]),
        span_s: Some((10.0, 10.0)),
        ..known
    };
    assert!(!judge_trace(&json, &off_until(100.0), &other).wrong);
    assert!(judge_trace(&json, &off_until(12.0), &other).wrong);
}

#[test]
fn trace_rows_are_parsed() {
    let text = "# of hoid\nt,b0,b0_se,K_e,K_e_se,convertible\n0.1,1,0.5,2,0.25,1\n0.2,1,0.5,,,0\n";
    let found = parse_rows(text);
    assert_eq!(found.len(), 2);
    assert_eq!(found[0].t, 0.1);
    assert_eq!(found[0].claims[1], ("K_e".to_owned(), 2.0, 0.25));
    assert_eq!(found[1].claims.len(), 1);
}

#[test]
fn tables_count_the_results() {
    assert_eq!(median(vec![3.0, f64::INFINITY, 1.0]), Some(3.0));
    assert_eq!(median(Vec::new()), None);
    assert_eq!(Numbers::of(&[]), Numbers::default());
    assert!(table_by_method(&[]).contains("| C1, C2 | grey-box | 0 | – |"));
}

/// Acceptance test: every wrong result is flagged.
#[test]
#[ignore = "not all faults are found yet; it runs the program `hoid`, which must be built next to this test"]
fn every_wrong_result_is_flagged() {
    let here = std::env::current_exe().unwrap();
    let folder = here.parent().unwrap().parent().unwrap();
    let program = folder.join("hoid").with_extension(std::env::consts::EXE_EXTENSION);
    let all: Vec<_> = (0..)
        .zip(faults())
        .step_by(29)
        .flat_map(|(case, fault)| {
            let who = OperatorKind::ALL[case as usize % 3];
            evaluate_case(&program, SEED, case, fault, who, &EvaluationMethod::ALL).unwrap()
        })
        .collect();
    let silent: Vec<String> = all
        .iter()
        // Methods that are also wrong on clean runs are excluded, because the fault is not the cause: rls has its own
        // noise model, and trackers with a start span of 13 s are wrong on some clean runs of people
        // (`research/notes/faults.md` gives the frequency).
        .filter(|o| o.way != EvaluationMethod::Rls && (o.who != OperatorKind::Person || !o.way.is_tracker()))
        .filter(|o| o.judged.is_silently_wrong())
        .map(|o| {
            let (kind, size, way) = (o.fault.kind.name(), o.fault.size_text(), o.way.name());
            format!("{kind} {size} in {}, {way}: {:?}", o.label, o.judged.worst)
        })
        .collect();
    assert!(silent.is_empty(), "{} of {}: {silent:#?}", silent.len(), all.len());
}
