#![allow(clippy::unwrap_used)]
use hoid_model::{
    Channel, Orders, Severity, Structure, VerdictLevel,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

use super::*;
use crate::{Method, TrackOptions, Tracker, track};
use hoid_model::uncertainty::OperatorEstimate;

fn simulated_record(condition: Condition) -> Record {
    let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
    simulator.run(RunSeed::default(), false).unwrap()
}

fn finding_kinds(verdict: &Verdict) -> Vec<&'static str> {
    verdict.findings().iter().map(|f| f.kind).collect()
}

fn tracked_verdict(record: &Record, options: &TrackOptions) -> Verdict {
    track(record, options, 10).unwrap().verdict(record, None).unwrap()
}

/// While both signals are constant, a recursion without a guard reports errors that are far too small (such as 11.3293
/// ± .0096 rad/s), so the verdict contains a warning.
#[test]
fn update_at_rest_is_a_warning() {
    let record = simulated_record(Condition::C1);
    let stopped = |name: &str, values: &[f64]| {
        let values = (0..values.len()).map(|k| values[k.min(4100)]).collect();
        Channel::new(name, "", values)
    };
    let (e, u) = (stopped("e", record.input()), stopped("u", record.output()));
    let gone = Record::new(record.sample_time(), e, u).unwrap();
    for (record, guard, told) in [(&gone, "no", true), (&gone, "yes", false), (&record, "no", false)] {
        let options = TrackOptions::default_for(Method::rpem(), 29)
            .with(&[("guard", guard)])
            .unwrap();
        let verdict = tracked_verdict(record, &options);
        assert_eq!(
            finding_kinds(&verdict).contains(&"learnt-at-rest"),
            told,
            "{guard}: {verdict}"
        );
    }
}

#[test]
fn prior_values_of_a_short_run_are_reported() {
    let record = simulated_record(Condition::C1);
    let options = TrackOptions::default_for(Method::adaptive(), 29);
    let short = tracked_verdict(&record.span(0.0, 3.0).unwrap(), &options);
    assert!(finding_kinds(&short).contains(&"supposed"), "{short}");
    assert!(!finding_kinds(&short).contains(&"not-convertible"), "{short}");
    let mut tracker = Tracker::new(&options, None, record.sample_time()).unwrap();
    assert_eq!(tracker.verdict_level(&tracker.operator()), VerdictLevel::NotDetermined);
    for (e, u) in record.input().iter().zip(record.output()) {
        tracker.step(*e, *u);
    }
    assert_eq!(tracker.verdict_level(&tracker.operator()), VerdictLevel::Trustworthy);
}

/// Returns a change in which no parameter differs.
fn change() -> crate::Change {
    let same = [Estimate::fixed(1.0); 2];
    crate::Change {
        seconds_ago: 1.0,
        odds: 10.0,
        k_e: same,
        k_e_dot: same,
        omega_nm_rad_s: same,
        zeta_nm: same,
        tau_e_s: same,
        t_l_s: [1.0; 2],
        innovation_variance: [1.0; 2],
        z: [0.0; 6],
        of_operator: true,
        further: None,
    }
}

/// With an output of zero there is no operator, so the verdict is that nothing is determined, not that the operator is
/// doubtful.
#[test]
fn zero_output_is_not_determined() {
    let record = simulated_record(Condition::C1);
    let input = Channel::new("e", "", record.input().to_vec());
    let silent = Channel::new("u", "", vec![0.0; record.len()]);
    let other = Record::new(record.sample_time(), input, silent).unwrap();
    let trace = track(&other, &TrackOptions::default_for(Method::adaptive(), 29), 10).unwrap();
    let verdict = trace.verdict(&other, None).unwrap();
    assert_eq!(verdict.level, VerdictLevel::NotDetermined, "{verdict}");
}

/// Returns a trace with an operator in each row, as from a recursion in physical parameters.
fn physical_trace(record: &Record, every: usize) -> Trace {
    let options = TrackOptions::default_for(Method::rpem(), 29)
        .with(&[("memory", "20s")])
        .unwrap();
    let mut trace = track(record, &options, every).unwrap();
    trace.operator = (0..trace.len()).map(|row| trace.operator(row).unwrap()).collect();
    trace
}

/// Returns the kinds of the findings about a trace of C1 with changed rows.
fn finding_kinds_after(change: impl FnOnce(&mut Trace)) -> Vec<&'static str> {
    let record = simulated_record(Condition::C1);
    let mut trace = physical_trace(&record, 100);
    change(&mut trace);
    finding_kinds(&trace.verdict(&record, None).unwrap())
}

#[test]
fn each_defect_of_a_trace_has_its_finding() {
    assert!(finding_kinds_after(|_| ()).is_empty());
    let counted = finding_kinds_after(|trace| (trace.counts.shortened, trace.counts.skipped) = (1000, 1000));
    assert_eq!(counted, ["faults", "steps-shortened"]);
    let open = |e: &mut Estimate| e.standard_error = Some(e.value.abs());
    let one = finding_kinds_after(|trace| trace.operator.iter_mut().for_each(|o| open(&mut o.k_e)));
    assert_eq!(one, ["undetermined-parameter"]);
    let both = finding_kinds_after(|trace| {
        for o in &mut trace.operator {
            open(&mut o.k_e);
            open(&mut o.k_e_dot);
        }
    });
    assert_eq!(both, ["gain"]);
    let lag = finding_kinds_after(|trace| trace.operator.iter_mut().for_each(|o| o.zeta_nm.value = 4.0));
    assert_eq!(lag, ["neuromuscular-lag"]);
    let none = finding_kinds_after(|trace| trace.operator.iter_mut().for_each(|o| o.t_l_s.value = f64::NAN));
    assert_eq!(none, ["not-convertible"]);
    let grown = finding_kinds_after(|trace| {
        let last = trace.covariance.len() - 1;
        trace.covariance[last] *= 1e4;
    });
    assert_eq!(grown, ["covariance-blown-up"]);
    let at_the_end = finding_kinds_after(|trace| {
        let last = trace.operator.last_mut().unwrap();
        open(&mut last.k_e);
        open(&mut last.k_e_dot);
    });
    assert_eq!(at_the_end, ["last-row"]);
    // The record is 81.92 s long: three changes are many, two are not.
    for (count, expected) in [(2, vec![]), (3, vec!["many-changes"])] {
        let often = finding_kinds_after(|trace| trace.changes = vec![(40.0, change()); count]);
        assert_eq!(often, expected);
    }
    let broken = finding_kinds_after(|trace| *trace.theta.last_mut().unwrap() = f64::NAN);
    assert_eq!(broken, ["not-finite"]);
}

#[test]
fn unconvertible_orders_are_judged_by_their_coefficients() {
    let record = simulated_record(Condition::C1);
    let orders = Orders {
        na: 3,
        nb: 3,
        nk: 29,
        ..Orders::default()
    };
    let options = TrackOptions::new(Method::rls(), Structure::Arx, orders);
    let tracker = Tracker::new(&options, Some(&record), record.sample_time()).unwrap();
    assert_eq!(tracker.verdict_level(&tracker.operator()), VerdictLevel::Trustworthy);
    let verdict = tracked_verdict(&record, &options);
    assert!(!finding_kinds(&verdict).contains(&"not-convertible"), "{verdict}");
}

fn with_signals(record: &Record, e: Vec<f64>, u: Vec<f64>) -> Record {
    let (e, u) = (Channel::new("e", "", e), Channel::new("u", "", u));
    Record::new(record.sample_time(), e, u).unwrap()
}

fn typical_options() -> TrackOptions {
    TrackOptions::default_for(Method::adaptive(), 29)
}

#[test]
fn wrong_sign_is_reported_with_and_without_element() {
    let scenario = Scenario::condition(Condition::C1);
    let record = simulated_record(Condition::C1);
    let turned = record.input().iter().map(|e| -e).collect();
    let turned = with_signals(&record, turned, record.output().to_vec());
    let element = scenario.initial.controlled_element.transfer_function().unwrap();
    let with_element = TrackOptions {
        controlled_element: Some(element),
        ..typical_options()
    };
    for (options, kinds_expected) in [
        (typical_options(), ["sign"; 2]),
        (with_element, ["unstable-loop", "no-crossover"]),
    ] {
        let clean = tracked_verdict(&record, &options);
        assert_eq!(clean.level, VerdictLevel::Trustworthy, "{clean}");
        let told = tracked_verdict(&turned, &options);
        assert!(
            finding_kinds(&told).iter().any(|kind| kinds_expected.contains(kind)),
            "{told}"
        );
    }
}

#[test]
fn output_of_another_run_is_reported() {
    let record = simulated_record(Condition::C1);
    let simulator = Simulator::new(&Scenario::condition(Condition::C1)).unwrap();
    let seed = RunSeed {
        replication: 1,
        ..RunSeed::default()
    };
    let other = simulator.run(seed, false).unwrap();
    let exchanged = with_signals(&record, record.input().to_vec(), other.output().to_vec());
    let told = tracked_verdict(&exchanged, &typical_options());
    assert!(finding_kinds(&told).contains(&"no-answer"), "{told}");
    assert!(!finding_kinds(&tracked_verdict(&record, &typical_options())).contains(&"no-answer"));
}

/// u is scaled after the simulation, so the loop does not respond to the change in the gain.
#[test]
fn drifting_and_oscillating_gains_are_reported() {
    let record = simulated_record(Condition::C1);
    let scaled = |gain: &dyn Fn(f64) -> f64| {
        let u = (0..record.len())
            .map(|k| gain(record.time_s(k)) * record.output()[k])
            .collect();
        tracked_verdict(&with_signals(&record, record.input().to_vec(), u), &typical_options())
    };
    let drifts = scaled(&|t| 1.0 - 0.5 * t / 82.0);
    assert!(finding_kinds(&drifts).contains(&"drifting"), "{drifts}");
    let sways = scaled(&|t| 1.0 + 0.4 * (t * 2.0 * std::f64::consts::PI / 20.0).sin());
    assert!(finding_kinds(&sways).contains(&"swaying"), "{sways}");
}

#[test]
fn pure_gain_is_trustworthy_and_remedies_are_valid_options() {
    let record = simulated_record(Condition::C1);
    let lead_is_open = |mut trace: Trace| {
        for o in &mut trace.operator {
            o.k_e_dot.standard_error = Some(o.k_e_dot.value.abs());
        }
        trace.verdict(&record, None).unwrap()
    };
    let verdict = lead_is_open(physical_trace(&record, 10));
    let found = verdict.findings().iter().find(|f| f.kind == "undetermined-parameter");
    assert_eq!(found.map(|f| f.severity), Some(Severity::Note), "{verdict}");
    // For a method without a memory length, a longer one is not recommended.
    assert!(
        !lead_is_open(track(&record, &typical_options(), 10).unwrap())
            .to_string()
            .contains("memory")
    );
    let operator = |k_e_dot: f64| OperatorEstimate {
        k_e: Estimate::with_variance(1.0, 0.01),
        t_l_s: Estimate::with_variance(k_e_dot, 0.01),
        k_e_dot: Estimate::with_variance(k_e_dot, 0.01),
        omega_nm_rad_s: Estimate::with_variance(11.0, 1.0),
        zeta_nm: Estimate::with_variance(0.3, 0.001),
        tau_e_s: Estimate::with_variance(0.2, 0.001),
    };
    let record = simulated_record(Condition::C1);
    let mut tracker = Tracker::new(&typical_options(), None, record.sample_time()).unwrap();
    for (e, u) in record.input().iter().zip(record.output()) {
        tracker.step(*e, *u);
    }
    for k_e_dot in [0.0, 1.0] {
        assert_eq!(
            tracker.verdict_level(&Ok(operator(k_e_dot))),
            VerdictLevel::Trustworthy,
            "{k_e_dot}"
        );
    }
}
