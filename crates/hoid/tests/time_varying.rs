//! The fit of an operator that changes once: exact results without noise; bias, spread and coverage over simulated
//! runs; and the report if nothing changes.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::collections::BTreeMap;

use hoid::{
    ident::{Constraint, IdentError, NoiseLevel, Reason, Remark, SigmoidChange, SigmoidFit},
    model::scenario::RemnantStrength,
    prelude::*,
};

const SPAN_S: f64 = 81.92;

fn runs(condition: Condition, n: u64) -> Vec<Record> {
    let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
    let run_seed = |replication| RunSeed {
        seed: 78,
        cell: 0,
        replication,
    };
    (0..n).map(|r| simulator.run(run_seed(r), false).unwrap()).collect()
}

fn noise_free_record(condition: Condition) -> Record {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.strength = RemnantStrength::Gain {
        initial: 0.0,
        last: 0.0,
    };
    Simulator::new(&scenario)
        .unwrap()
        .run(RunSeed::default(), false)
        .unwrap()
}

/// Returns the name and the true value of each parameter.
fn truth(condition: Condition) -> Vec<(&'static str, f64)> {
    let (s1, s2) = ([0.09, 0.4], [0.07, 1.2]);
    let (first, last) = match condition {
        Condition::C1 => (s1, s1),
        Condition::C2 => (s2, s2),
        Condition::C3 | Condition::C4 => (s1, s2),
        Condition::C5 | Condition::C6 => (s2, s1),
    };
    let rate = match condition {
        Condition::C3 | Condition::C5 => 0.5,
        _ => 100.0,
    };
    vec![
        ("K_e1", first[0]),
        ("K_e2", last[0]),
        ("T_L1", first[1]),
        ("T_L2", last[1]),
        ("t_M", SPAN_S / 2.0),
        ("G", rate),
        ("omega_nm", 11.25),
        ("zeta_nm", 0.35),
        ("tau_e", 0.28),
        ("d1", -(-0.01_f64 / 0.06).exp()),
    ]
}

fn value(fit: &SigmoidFit, name: &str) -> Estimate {
    fit.parameter(name).unwrap().estimate
}

/// Returns an estimator without likelihood intervals for t_M and G.
fn quick_estimator() -> SigmoidChange {
    SigmoidChange {
        likelihood_intervals: false,
        ..SigmoidChange::default()
    }
}

fn single_record(record: &Record) -> &[Record] {
    std::slice::from_ref(record)
}

#[test]
fn noise_free_change_is_recovered() {
    for condition in [Condition::C3, Condition::C4, Condition::C5, Condition::C6] {
        let record = noise_free_record(condition);
        let fit = SigmoidChange::default().fit(single_record(&record)).unwrap();
        let worst = truth(condition)
            .into_iter()
            .filter(|(name, _)| *name != "d1")
            .map(|(name, true_value)| (value(&fit, name).value / true_value - 1.0).abs())
            .fold(0.0, f64::max);
        println!(
            "{condition}: largest relative error {worst:.1e}, loss {:.1e}, {} steps from: {}",
            fit.loss(),
            fit.termination().iterations,
            fit.start()
        );
        assert_eq!(fit.termination().reason, Reason::ExactFit);
        // The residuals are 1e-15 of the output, and the condition number of the information matrix is at most 1e4.
        assert!(worst < 1e-10 && fit.has_change());
        // Nothing can be reported about the noise: no standard errors, no intervals.
        assert!(fit.covariance().is_none() && fit.midpoint_interval().is_none());
        let here = fit.gains_at(30.0);
        let gain = |name: &str| here.get(name).unwrap().value;
        assert!((gain("K_e") - record.channel("K_e").unwrap()[3000]).abs() < 1e-11);
        assert!((gain("T_L") - record.channel("T_L").unwrap()[3000]).abs() < 1e-10);
    }
}

/// Fits runs of one condition and prints every parameter; the assertions allow for the Monte Carlo error.
fn check_condition(condition: Condition, n: u64) {
    let truth = truth(condition);
    let mut errors = vec![Vec::new(); truth.len()];
    let mut standard_errors = vec![Vec::new(); truth.len()];
    let mut inside = vec![0; truth.len()];
    let (mut midpoints, mut rates, mut change_points) = (0, 0, 0);
    let mut widths = Vec::new();
    for record in runs(condition, n) {
        let fit = SigmoidChange::default().fit(single_record(&record)).unwrap();
        assert!(fit.termination().converged(), "{}", fit.termination().reason);
        assert!(fit.has_change());
        for (i, (name, true_value)) in truth.iter().enumerate() {
            let parameter = fit.parameter(name).unwrap();
            let error = parameter.estimate.value - true_value;
            errors[i].push(error);
            // There is a standard error, or a reason why there is none.
            assert!(
                parameter.estimate.standard_error.is_some() == parameter.remark.is_none(),
                "{name}"
            );
            if let Some(s) = parameter.estimate.standard_error {
                standard_errors[i].push(s);
                inside[i] += usize::from(error.abs() < 1.96 * s);
            }
        }
        let (low, high) = fit.midpoint_interval().unwrap();
        widths.push(high - low);
        midpoints += u64::from((low..=high).contains(&(SPAN_S / 2.0)));
        let (low, high) = fit.rate_interval().unwrap();
        rates += u64::from((low..=high).contains(&truth[5].1));
        change_points += u64::from(fit.is_change_point());
    }
    let median = |values: &mut Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
    };
    println!(
        "{condition}, {n} runs, all converged, all with a change: 95 % likelihood intervals cover t_M {midpoints}, G {rates} times; \
         median width for t_M {:.2} s; {change_points} change points",
        median(&mut widths)
    );
    let (mut regular, mut covered) = (0, 0);
    for (i, (name, true_value)) in truth.iter().enumerate() {
        let mean = errors[i].iter().sum::<f64>() / n as f64;
        let spread = (errors[i].iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (n - 1) as f64).sqrt();
        let with = standard_errors[i].len();
        println!(
            "  {name:9}{true_value:9.4}  bias {mean:+.5} ({:+.1} s.e.)  spread {spread:.5}  median error {:.5}  median s.e. {:.5}  \
             95 % covers {} of {with}",
            mean / spread * (n as f64).sqrt(),
            median(&mut errors[i].iter().map(|e| e.abs()).collect()),
            median(&mut standard_errors[i]),
            inside[i],
        );
        if !["t_M", "G"].contains(name) {
            regular += with;
            covered += inside[i];
            // d1 is biased towards zero by 0.0019, a third of its standard error, because the operator's parameters fit
            // part of the slow noise.
            let allowed = 4.0 / (n as f64).sqrt() + if *name == "d1" { 0.4 } else { 0.0 };
            assert!(mean.abs() < allowed * spread, "{name}");
        }
    }
    let share = covered as f64 / regular as f64;
    println!("  all but t_M and G: {:.1} % covered", 100.0 * share);
    // There are 8 n intervals, in which gains and lead times are correlated in pairs; for n = 25 the standard error is
    // 2.2 %, and the tolerance is four standard errors.
    assert!(share > 0.86);
    // A share of 25 intervals has a standard error of 4.4 %; the limit is four standard errors below 95 %.
    assert!(midpoints as f64 > 0.77 * n as f64 && rates as f64 > 0.77 * n as f64);
}

#[test]
fn slow_change_to_double_integrator_is_unbiased() {
    check_condition(Condition::C3, 25);
}

#[test]
fn abrupt_change_to_double_integrator_is_unbiased() {
    check_condition(Condition::C4, 25);
}

#[test]
fn slow_change_to_single_integrator_is_unbiased() {
    check_condition(Condition::C5, 25);
}

#[test]
fn abrupt_change_to_single_integrator_is_unbiased() {
    check_condition(Condition::C6, 25);
}

#[test]
fn no_change_is_reported_without_one() {
    for condition in [Condition::C1, Condition::C2] {
        let (mut inside, mut largest) = (0, 0.0_f64);
        let n = 10;
        for record in runs(condition, n) {
            let fit = SigmoidChange::default().fit(single_record(&record)).unwrap();
            assert!(fit.termination().converged(), "{}", fit.termination().reason);
            assert!(!fit.has_change() && fit.comparison().extra_parameters == 4);
            largest = largest.max(fit.comparison().likelihood_ratio);
            for name in ["t_M", "G", "K_e2"] {
                let parameter = fit.parameter(name).unwrap();
                assert_eq!(parameter.remark, Some(Remark::NoChange), "{name}");
                assert_eq!(parameter.estimate.standard_error, None, "{name}");
            }
            assert!(fit.midpoint_interval().is_none() && fit.rate_interval().is_none());
            // The gains and their standard errors equal those of a stationary fit.
            let here = fit.gains_at(20.0);
            let truth = truth(condition);
            for (name, true_value) in [("K_e", truth[0].1), ("T_L", truth[2].1)] {
                let estimate = here.get(name).unwrap();
                inside += u64::from((estimate.value - true_value).abs() < 1.96 * estimate.standard_error.unwrap());
            }
            assert_eq!(fit.gains_at(70.0).gains, here.gains);
        }
        println!(
            "{condition}: gains covered {inside} of {}, largest likelihood ratio {largest:.1}",
            2 * n
        );
        // With 20 intervals, correlated in pairs, the standard error is 7 %; the tolerance is four standard errors.
        assert!(inside >= 13);
    }
    let exact = SigmoidChange::default()
        .fit(&[noise_free_record(Condition::C1)])
        .unwrap();
    assert!(!exact.has_change());
    assert!((exact.constant_operator().get("K_e").unwrap().value - 0.09).abs() < 1e-9);
}

#[test]
fn record_without_a_change_agrees_with_box_jenkins() {
    let record = &runs(Condition::C1, 1)[0];
    let ours = SigmoidChange {
        delay_range_s: (0.28, 0.28),
        noise_level: NoiseLevel::Constant,
        ..quick_estimator()
    }
    .fit(single_record(record))
    .unwrap()
    .constant_operator()
    .operator_estimate()
    .unwrap();
    let theirs = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29))
        .fit(single_record(record))
        .unwrap()
        .operator()
        .unwrap();
    for ((name, _, a), (_, _, b)) in ours.rows().into_iter().zip(theirs.rows()) {
        let Some(s) = b.standard_error else { continue };
        // The residuals of Box-Jenkins start one sample earlier or later, which is 1/8000 of the information.
        assert!(
            (a.value - b.value).abs() < 0.05 * s,
            "{name}: {} and {}",
            a.value,
            b.value
        );
        assert!((a.standard_error.unwrap() / s - 1.0).abs() < 0.01, "{name}");
    }
    assert_eq!(ours.tau_e_s.standard_error, None);
}

#[test]
fn several_records_reduce_the_errors_of_the_change() {
    let records = runs(Condition::C5, 4);
    let single = quick_estimator().fit(&records[..1]).unwrap();
    let all = quick_estimator().fit(&records).unwrap();
    assert_eq!((single.state_count(), all.state_count()), (2, 8));
    for name in ["K_e1", "K_e2", "T_L1", "T_L2", "t_M", "omega_nm", "tau_e"] {
        let ratio = value(&single, name).standard_error.unwrap() / value(&all, name).standard_error.unwrap();
        // Four times the data halve the standard error; the standard error of t_M depends on the error signal near the
        // change.
        assert!((1.3..3.2).contains(&ratio), "{name}: {ratio}");
    }
}

#[test]
fn parameters_can_be_fixed_and_times_shifted() {
    let record = &runs(Condition::C3, 1)[0];
    let constraints = BTreeMap::from([
        ("G".to_owned(), Constraint::Fixed(0.5)),
        ("tau_e".to_owned(), Constraint::Fixed(0.28)),
    ]);
    let held = SigmoidChange {
        constraints,
        ..SigmoidChange::default()
    };
    let fit = held.fit(single_record(record)).unwrap();
    for (name, fixed) in [("G", 0.5), ("tau_e", 0.28)] {
        let parameter = fit.parameter(name).unwrap();
        assert!((parameter.estimate.value - fixed).abs() < 1e-12);
        assert_eq!(
            (parameter.remark, parameter.estimate.standard_error),
            (Some(Remark::Fixed), None)
        );
    }
    assert_eq!(fit.rate_interval(), None);
    assert!(fit.midpoint_interval().is_some());

    let moved = record.clone().starting_at(100.0);
    let later = held.fit(single_record(&moved)).unwrap();
    let shift = value(&later, "t_M").value - value(&fit, "t_M").value;
    // The standard error is half a second, and the search stops within 1e-4 of it.
    assert!((shift - 100.0).abs() < 1e-3, "{shift}");

    let trace = fit.trace(record);
    assert_eq!(trace.len(), record.len());
    assert!((trace[0].get("K_e").unwrap().value - value(&fit, "K_e1").value).abs() < 1e-6);
    assert!(
        trace
            .iter()
            .all(|g| g.get("T_L").unwrap().standard_error.unwrap() > 0.0)
    );
}

#[test]
fn residuals_and_simulation_match_the_fit() {
    let record = &runs(Condition::C6, 1)[0];
    let fit = SigmoidChange {
        noise_level: NoiseLevel::Constant,
        ..quick_estimator()
    }
    .fit(single_record(record))
    .unwrap();
    let residuals = fit.residuals(record).unwrap();
    assert_eq!(residuals.values.len(), fit.residual_count());
    let mean = residuals.values.iter().map(|e| e * e).sum::<f64>() / residuals.values.len() as f64;
    assert!((mean / fit.loss() - 1.0).abs() < 1e-9);
    // u minus the simulated output is the remnant.
    let simulated = fit.simulate(record).unwrap();
    let (u, n) = (
        &record.output()[simulated.first..],
        &record.channel("n").unwrap()[simulated.first..],
    );
    let left: f64 = u
        .iter()
        .zip(&simulated.values)
        .zip(n)
        .map(|((u, w), n)| (u - w - n).powi(2))
        .sum();
    let noise: f64 = n.iter().map(|n| n * n).sum();
    // The 9 parameters fit part of the slow noise, which has a few hundred independent values.
    assert!(left < 0.1 * noise, "{left} {noise}");
    let levels = quick_estimator()
        .fit(single_record(record))
        .unwrap()
        .noise_levels()
        .unwrap();
    let k_n = record.channel("K_n").unwrap();
    let ratio = levels[1] / levels[0] / (k_n[8000] / k_n[0]);
    // With 4000 values on either side, the standard error of each level is 1.1 %.
    assert!((ratio - 1.0).abs() < 0.06, "{ratio}");
}

#[test]
fn invalid_data_and_options_are_errors() {
    let record = runs(Condition::C4, 1).remove(0);
    let error = |estimator: SigmoidChange, records: &[Record]| estimator.fit(records).unwrap_err();
    assert!(matches!(error(quick_estimator(), &[]), IdentError::NoRecords));
    let short = record.span(0.0, 0.65).unwrap();
    assert!(matches!(
        error(quick_estimator(), single_record(&short)),
        IdentError::TooFewSamples { .. }
    ));
    let shorter = record.span(0.0, 0.3).unwrap();
    assert!(matches!(
        error(quick_estimator(), single_record(&shorter)),
        IdentError::DelayTooLong { .. }
    ));
    let apart = [record.span(0.0, 20.0).unwrap(), record.span(30.0, 50.0).unwrap()];
    assert!(
        error(quick_estimator(), &apart)
            .to_string()
            .contains("no time in common")
    );
    for range in [(0.3, 0.2), (-0.1, 0.2), (f64::NAN, 0.3), (0.1, f64::INFINITY)] {
        let estimator = SigmoidChange {
            delay_range_s: range,
            ..quick_estimator()
        };
        assert!(
            error(estimator, single_record(&record)).to_string().contains("tau_e"),
            "{range:?}"
        );
    }
    let start = |start: Vec<f64>| SigmoidChange {
        start: Some(start),
        ..quick_estimator()
    };
    let good = vec![0.09, 0.07, 0.4, 1.2, 41.0, 10.0, 11.0, 0.4, 0.28, -0.8];
    assert!(start(good.clone()).fit(single_record(&record)).is_ok());
    assert!(matches!(
        error(start(good[..9].to_vec()), single_record(&record)),
        IdentError::BadStart { .. }
    ));
    for (i, wrong) in [(5, 0.0), (6, -1.0), (0, f64::NAN)] {
        let mut bad = good.clone();
        bad[i] = wrong;
        assert!(
            matches!(error(start(bad), single_record(&record)), IdentError::BadStart { .. }),
            "{i}"
        );
    }
    let silent = Record::new(
        record.sample_time(),
        Channel::new("e", "deg", vec![0.0; 500]),
        Channel::new("u", "deg", record.output()[..500].to_vec()),
    )
    .unwrap();
    assert!(matches!(
        error(quick_estimator(), single_record(&silent)),
        IdentError::NoExcitation { .. }
    ));
    // The record has only a few seconds, but there is a result.
    let brief = record.span(39.0, 44.0).unwrap();
    if let Ok(fit) = SigmoidChange::default().fit(single_record(&brief)) {
        assert!(fit.parameters().iter().all(|p| p.estimate.value.is_finite()));
    }
}
