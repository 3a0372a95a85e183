//! Recursive identification: comparison with the batch methods, Monte Carlo simulation, and faulty samples.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use hoid::{
    model::{remnant_gain::NoiseDefinition, scenario::RemnantStrength},
    prelude::*,
    track::{Method, StartSource, TrackOptions, Tracker, track},
};

const NK: usize = 29;
const OPERATOR_PARAMETERS: [&str; 5] = ["K_e", "T_L", "K_e_dot", "omega_nm", "zeta_nm"];

fn scenario(condition: Condition, remnant_order: usize, noise_level: f64) -> Scenario {
    let mut scenario = Scenario::condition(condition);
    scenario.remnant.order = remnant_order;
    scenario.remnant.strength = RemnantStrength::Level {
        level: noise_level,
        definition: NoiseDefinition::Response,
    };
    scenario
}

fn run(simulator: &Simulator, replication: u64) -> Record {
    let run_seed = RunSeed {
        seed: 71,
        cell: 1,
        replication,
    };
    simulator.run(run_seed, false).unwrap()
}

fn options(method: Method) -> TrackOptions {
    let structure = method.default_structure();
    TrackOptions {
        start: StartSource::Span(Some((0.0, 30.72))),
        ..TrackOptions::new(method, structure, structure.operator_orders(NK))
    }
}

/// Computes the results of the runs on all cores and returns them in order.
fn run_on_all_cores<T: Send>(runs: u64, one: impl Fn(u64) -> T + Sync) -> Vec<T> {
    let cores = std::thread::available_parallelism().map_or(1, |n| n.get() as u64);
    let mut results: Vec<(u64, T)> = std::thread::scope(|scope| {
        let one = &one;
        let threads: Vec<_> = (0..cores)
            .map(|c| {
                let mine = (c..runs).step_by(cores as usize);
                scope.spawn(move || mine.map(|r| (r, one(r))).collect::<Vec<_>>())
            })
            .collect();
        threads.into_iter().flat_map(|t| t.join().unwrap()).collect()
    });
    results.sort_by_key(|(r, _)| *r);
    results.into_iter().map(|(_, t)| t).collect()
}

/// Returns the standard deviations of the z-scores of the operator at the end of runs of C1 with m = 1 and P_n = .1.
fn z_scores(options: &TrackOptions, runs: u64) -> [f64; 5] {
    let simulator = Simulator::new(&scenario(Condition::C1, 1, 0.1)).unwrap();
    let squares = run_on_all_cores(runs, |r| {
        let record = run(&simulator, r);
        let trace = track(&record, options, record.len()).unwrap();
        let operator = trace.operator(trace.len() - 1).unwrap();
        std::array::from_fn::<f64, 5, _>(|i| {
            let (_, _, estimate) = operator.rows()[i];
            let truth = record.channel(OPERATOR_PARAMETERS[i]).unwrap()[0];
            ((estimate.value - truth) / estimate.standard_error.unwrap()).powi(2)
        })
    });
    let deviations = std::array::from_fn(|i| (squares.iter().map(|s| s[i]).sum::<f64>() / runs as f64).sqrt());
    println!("{:?}: {deviations:.3?}", options.method);
    deviations
}

fn options_with_memory(method: Method, memory: &str) -> TrackOptions {
    options(method.clone()).with(&[("memory", memory)]).unwrap()
}

#[test]
fn error_bars_are_correct_with_infinite_memory() {
    for method in [Method::rpem(), hoid::survey::physical()] {
        // The start fit uses half of the record, so its errors are nearly normal. The standard error of a standard
        // deviation from 6000 runs is 1/sqrt(12000) = .009.
        let half = TrackOptions {
            start: StartSource::Span(Some((0.0, 40.96))),
            ..options_with_memory(method.clone(), "inf")
        };
        for deviation in z_scores(&half, 6000) {
            assert!((0.95..=1.05).contains(&deviation), "{method:?}: {deviation}");
        }
    }
}

#[test]
fn error_bars_are_correct_with_256_samples_of_memory() {
    for method in [Method::rpem(), hoid::survey::physical()] {
        for deviation in z_scores(&options_with_memory(method.clone(), "256"), 2000) {
            assert!((0.9..=1.1).contains(&deviation), "{method:?}: {deviation}");
        }
    }
}

#[test]
fn error_bars_are_correct_with_a_memory_per_parameter() {
    for method in [Method::rpem(), hoid::survey::physical()] {
        for deviation in z_scores(&options(method.clone()), 2000) {
            assert!((0.9..=1.1).contains(&deviation), "{method:?}: {deviation}");
        }
    }
}

/// Returns a long record of C1 with many periods of the forcing function.
fn long_record() -> Record {
    let mut long = scenario(Condition::C1, 1, 0.1);
    long.measurement_s = 10_000.0;
    run(&Simulator::new(&long).unwrap(), 0)
}

#[test]
fn infinite_memory_converges_to_the_batch_fit() {
    let record = long_record();
    let structure = Structure::BoxJenkins;
    let orders = structure.operator_orders(NK);
    let batch = Estimator::new(structure, orders)
        .fit(std::slice::from_ref(&record))
        .unwrap();
    let from = |start, update_from_s| TrackOptions {
        start,
        update_from_s,
        ..options_with_memory(Method::rpem(), "inf")
    };
    let span = |to: f64| from(StartSource::Span(Some((0.0, to))), None);
    // The filters have settled. The memory length grows at the start, so the initial steps are forgotten. The
    // covariance is ten times the value of the thesis. With a covariance of 10 the first steps move the estimate to the
    // limit of stability, and two of these starts still differ by .6 standard errors at the end.
    let theta = |theta: Vec<f64>| {
        let from = from(StartSource::Theta(theta), Some(4.0));
        from.with(&[("covariance", "1")]).unwrap()
    };
    let starts = [
        ("batch fit of 20 s", span(20.0)),
        ("batch fit of 60 s", span(60.0)),
        ("a slower operator", theta(vec![0.03, -0.029, -0.7, -1.93, 0.938])),
        ("a faster operator", theta(vec![0.06, -0.058, -0.8, -1.88, 0.9])),
        (
            "a faster operator with less remnant",
            theta(vec![0.06, -0.058, -0.7, -1.88, 0.9]),
        ),
        ("an operator nearby", theta(vec![0.05, -0.049, -0.8, -1.9, 0.913])),
        (
            "a slower operator with more remnant",
            theta(vec![0.03, -0.029, -0.9, -1.93, 0.938]),
        ),
        (
            "an operator with hardly a noise model",
            theta(vec![0.04, -0.039, -0.5, -1.92, 0.93]),
        ),
    ];
    for (name, options) in starts {
        let trace = track(&record, &options, record.len()).unwrap();
        for (found, (parameter, expected)) in trace.parameters(trace.len() - 1).iter().zip(batch.parameters()) {
            let distance = (found.value - expected.value) / expected.standard_error.unwrap();
            println!("{name}, {parameter}: {distance:.3} standard errors from the batch fit");
            assert!(distance.abs() < 0.1, "{name}, {parameter}: {distance}");
        }
    }
}

#[test]
fn rls_with_infinite_memory_is_the_batch_fit() {
    let record = run(&Simulator::new(&scenario(Condition::C1, 3, 0.1)).unwrap(), 5);
    let structure = Structure::Arx;
    let batch = Estimator {
        initial_state: Some(InitialState::Zero),
        ..Estimator::new(structure, structure.operator_orders(NK))
    };
    let batch = batch.fit(std::slice::from_ref(&record)).unwrap();
    let recursive = TrackOptions {
        start: StartSource::Nothing,
        ..options(Method::rls())
    };
    let recursive = recursive.with(&[("covariance", "1e12"), ("memory", "inf")]).unwrap();
    let trace = track(&record, &recursive, record.len()).unwrap();
    for (found, (name, expected)) in trace.parameters(trace.len() - 1).iter().zip(batch.parameters()) {
        assert!(
            (found.value - expected.value).abs() < 1e-8 * expected.value.abs(),
            "{name}"
        );
        // The innovation variances differ: the recursion averages normalised squares, whereas the batch fit divides the
        // sum by N - p.
        let ratio = found.standard_error.unwrap() / expected.standard_error.unwrap();
        assert!((ratio - 1.0).abs() < 1e-3, "{name}: {ratio}");
    }
}

/// Signals that change every few thousand samples: the loop, zeros, constants, saturation.
fn alternating_sample(k: usize, record: &Record) -> (f64, f64) {
    let (e, u) = (record.input()[k % record.len()], record.output()[k % record.len()]);
    match (k / 20_000) % 5 {
        0 | 2 => (e, u),
        1 => (0.0, 0.0),
        3 => (0.7, -0.3),
        _ => (e.clamp(-0.01, 0.01).signum(), u.clamp(-0.02, 0.02)),
    }
}

#[test]
fn covariance_stays_bounded_for_a_million_samples() {
    let record = run(&Simulator::new(&scenario(Condition::C1, 1, 0.1)).unwrap(), 6);
    let span = record.span(0.0, 30.72).unwrap();
    let rules: [&[(&str, &str)]; 6] = [
        &[("forgetting", "exponential")],
        &[("forgetting", "directional")],
        &[("forgetting", "variable")],
        &[("forgetting", "window"), ("memory", "500")],
        &[("forgetting", "gradient"), ("rate", "0.5")],
        &[("forgetting", "random-walk"), ("drift", "d1=0.01")],
    ];
    let mut all: Vec<TrackOptions> = rules
        .into_iter()
        .map(|rule| options(Method::rpem()).with(rule).unwrap())
        .collect();
    all.extend([
        options(Method::rls()),
        options(hoid::survey::physical()),
        options(hoid::survey::rriv()),
    ]);
    run_on_all_cores(all.len() as u64, |i| {
        let options = &all[i as usize];
        let mut tracker = Tracker::new(options, Some(&span), record.sample_time()).unwrap();
        let name = format!("{:?}", options.method);
        for k in 0..1_000_000 {
            let (e, u) = alternating_sample(k, &record);
            tracker.step(e, u);
            if k % 1000 == 0 {
                assert!(
                    tracker.theta().iter().all(|t| t.is_finite()),
                    "{name} at {k}: {:?}",
                    tracker.theta()
                );
                assert!(tracker.innovation_variance().is_finite(), "{name} at {k}");
                let covariance = tracker.covariance().unwrap_or_default();
                // A window without signals has no covariance, and a window with little excitation has a large one. For
                // other methods the limit corresponds to a thousand times the standard error of the start.
                let window = options.method.settings().get("forgetting").as_deref() == Some("window");
                let bound = if window { f64::MAX } else { 1e12 };
                assert!(
                    covariance.iter().all(|c| c.is_finite() && c.abs() < bound),
                    "{name} at {k}: {covariance:?}"
                );
            }
        }
    });
}

#[test]
fn recovery_after_silence_is_as_fast_as_at_the_start() {
    let simulator = Simulator::new(&scenario(Condition::C1, 1, 0.1)).unwrap();
    let (first, second) = (run(&simulator, 7), run(&simulator, 8));
    let span = first.span(0.0, 30.72).unwrap();
    for method in [Method::rls(), Method::rpem(), hoid::survey::physical()] {
        let mut fresh = Tracker::new(&options(method.clone()), Some(&span), first.sample_time()).unwrap();
        let mut silent = Tracker::new(&options(method.clone()), Some(&span), first.sample_time()).unwrap();
        for k in 0..first.len() {
            silent.step(first.input()[k], first.output()[k]);
        }
        for _ in 0..100_000 {
            silent.step(0.0, 0.0);
        }
        let truth: Vec<f64> = OPERATOR_PARAMETERS
            .iter()
            .map(|name| second.channel(name).unwrap()[0])
            .collect();
        let mut errors = [[0.0; 5]; 2];
        for k in 0..second.len() {
            for (tracker, errors) in [&mut fresh, &mut silent].into_iter().zip(&mut errors) {
                tracker.step(second.input()[k], second.output()[k]);
                if k >= 1000
                    && let Ok(operator) = tracker.operator()
                {
                    for (i, (_, _, estimate)) in operator.rows()[..5].iter().enumerate() {
                        errors[i] += ((estimate.value - truth[i]) / truth[i]).powi(2);
                    }
                }
            }
        }
        // The errors are RMS values over 8192 samples from 10 s on. A start from the batch fit has a smaller
        // covariance, and its errors are smaller by up to a half.
        println!("{method:?} fresh and after silence: {errors:?}");
        if method != Method::rpem() {
            for (fresh, silent) in errors[0].iter().zip(errors[1]) {
                let limit = (0.05_f64.powi(2) * second.len() as f64).max(1.5 * fresh);
                assert!(silent < limit, "{method:?}: {errors:?}");
            }
        }
    }
}

#[test]
fn invalid_samples_are_skipped_and_counted() {
    let record = run(&Simulator::new(&scenario(Condition::C1, 1, 0.1)).unwrap(), 9);
    let span = record.span(0.0, 30.72).unwrap();
    let hostile = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e7];
    for method in hoid::survey::methods() {
        let options = options(method.clone());
        let mut clean = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
        let mut tracker = Tracker::new(&options, Some(&span), record.sample_time()).unwrap();
        let mut faults = 0;
        for k in 0..record.len() {
            let (e, u) = (record.input()[k], record.output()[k]);
            clean.step(e, u);
            let outcome = match k % 97 {
                3 => tracker.step(e, hostile[k % 5]),
                50 => tracker.step(hostile[k % 5], u),
                51 if k % 194 == 51 => tracker.step(hostile[k % 5], hostile[(k + 1) % 5]),
                _ => tracker.step(e, u),
            };
            let bad = matches!(k % 97, 3 | 50) || k % 194 == 51;
            faults += u64::from(bad);
            assert_eq!((outcome.skipped, outcome.innovation.is_none()), (bad, bad));
            assert!(tracker.theta().iter().all(|t| t.is_finite()));
        }
        assert_eq!(tracker.counts().skipped, faults);
        assert_eq!(tracker.counts().samples, record.len() as u64);
        // Two per cent of the samples are missing: the estimate differs, but is consistent with its error bars.
        for (a, b) in clean.parameters().iter().zip(tracker.parameters()) {
            // The learning rule of this method gives no covariance.
            if method.name() == "linear-network" {
                assert_eq!(a.standard_error, None);
                continue;
            }
            // Parameters that a method keeps fixed are equal.
            let distance = (a.value - b.value).abs() / a.standard_error.unwrap();
            assert!(distance < 3.0 || a.value == b.value, "{method:?}: {distance}");
        }
    }
}

#[test]
fn defaults_do_not_diverge_in_the_reference_conditions() {
    let methods = [
        Method::rls(),
        Method::rpem(),
        hoid::survey::physical(),
        hoid::survey::rriv(),
    ];
    for condition in Condition::ALL {
        for m in [1, 4] {
            let simulator = Simulator::new(&scenario(condition, m, 0.2)).unwrap();
            run_on_all_cores(4, |r| {
                let record = run(&simulator, r);
                for method in methods.clone() {
                    let trace = track(&record, &options(method.clone()), 1).unwrap();
                    for k in 0..trace.len() {
                        let sound = trace.theta(k).iter().all(|t| t.abs() < 10.0);
                        assert!(sound, "{condition:?} m = {m} run {r} {method:?}: {:?}", trace.theta(k));
                    }
                }
            });
        }
    }
}

#[test]
fn thesis_settings_are_available() {
    let record = run(&Simulator::new(&scenario(Condition::C4, 1, 0.1)).unwrap(), 10);
    let settings = [
        ("memory", "256"),
        ("covariance", "0.1"),
        ("stable", "noise"),
        ("limit", "inf"),
    ];
    let text = options(Method::rpem()).with(&settings).unwrap();
    let trace = track(&record, &text, 1).unwrap();
    assert_eq!((trace.len(), trace.updated_from_s()), (8192, 0.0));
    let (before, after) = (trace.operator(4000).unwrap(), trace.operator(8191).unwrap());
    // K_e_dot rises from .036 to .084 s.
    assert!((before.k_e_dot.value - 0.036).abs() < 0.012, "{:?}", before.k_e_dot);
    assert!((after.k_e_dot.value - 0.084).abs() < 0.02, "{:?}", after.k_e_dot);
    // By default no sample counts twice: the estimate stays constant until the end of the span of its fit.
    let default = track(&record, &options(Method::rpem()), 1).unwrap();
    assert_eq!(default.theta(0), default.theta(3071));
    assert_ne!(default.theta(3071), default.theta(3200));
}

#[test]
fn delay_is_tracked_with_its_error() {
    let mut inside = scenario(Condition::C1, 1, 0.1);
    inside.initial.operator.tau_e_s = 0.3;
    inside.last.operator.tau_e_s = 0.3;
    let record = run(&Simulator::new(&inside).unwrap(), 11);
    let tracked = options(hoid::survey::physical())
        .with(&[("track_delay", "0.1..0.5")])
        .unwrap();
    let trace = track(&record, &tracked, 1).unwrap();
    let tau = trace.operator(trace.len() - 1).unwrap().tau_e_s;
    let error = tau.standard_error.unwrap();
    assert!(error < 0.006 && (tau.value - 0.3).abs() < 4.0 * error, "{tau:?}");
    assert_eq!(trace.parameter_names(), ["b0", "b1", "b2", "d1", "f1", "f2"]);
}

#[test]
fn contradictory_options_are_refused() {
    let record = run(&Simulator::new(&scenario(Condition::C1, 1, 0.1)).unwrap(), 12);
    let refused = |options: TrackOptions| track(&record, &options, 1).unwrap_err().to_string();
    let bj = Structure::BoxJenkins;
    let message = refused(TrackOptions::new(Method::rls(), bj, bj.operator_orders(NK)));
    assert!(message.contains("arx or fir"), "{message}");
    let message = refused(options(Method::rpem()).with(&[("memory_of", "q7=inf")]).unwrap());
    assert!(message.contains("q7") && message.contains("f2"), "{message}");
    let message = refused(options_with_memory(Method::rpem(), "0.001s"));
    assert!(message.contains("more than one sample"), "{message}");
    let message = refused(TrackOptions {
        start: StartSource::Theta(vec![0.1, 0.1, -0.5, -2.5, 1.6]),
        ..options(Method::rpem())
    });
    assert!(message.contains("stable"), "{message}");
    let message = refused(TrackOptions {
        start: StartSource::Span(Some((90.0, 95.0))),
        ..options(Method::rpem())
    });
    assert!(message.contains("90"), "{message}");
    assert!(track(&record, &options(Method::rls()), 0).is_err());
}
