//! All structures of Table 5.1 find the true values from their own starts, and each option works as documented.
#![allow(clippy::unwrap_used)]

#[path = "common/textbook.rs"]
mod textbook;

use hoid::{
    ident::{Constraint, Focus, IdentError, Loss, Prior, SearchMethod},
    prelude::*,
};
use textbook::{Draw, Truth};

fn estimator(structure: Structure) -> Estimator {
    Estimator::new(structure, Truth::of(structure).orders())
}

/// Returns the distance of each coefficient from the true value in standard errors.
fn errors_in_standard_errors(fit: &Fit, truth: &[f64]) -> Vec<f64> {
    let parameters = fit.parameters();
    parameters
        .iter()
        .zip(truth)
        .filter_map(|((_, e), t)| Some((e.value - t) / e.standard_error?))
        .collect()
}

#[test]
fn every_structure_finds_the_truth_with_any_initial_state() {
    for structure in Structure::ALL {
        let truth = Truth::of(structure);
        let cut_out = truth.record(4000, 0.5, 7);
        let from_rest = truth.record_after_run_in(0, 4000, 0.5, 7);
        for rule in [
            None,
            Some(InitialState::Zero),
            Some(InitialState::Estimate),
            Some(InitialState::Backcast),
        ] {
            // The rule of zero initial states is correct for a record that starts at rest.
            let record = if rule == Some(InitialState::Zero) {
                &from_rest
            } else {
                &cut_out
            };
            let fit = Estimator {
                initial_state: rule,
                ..estimator(structure)
            }
            .fit(std::slice::from_ref(record))
            .unwrap();
            assert!(fit.termination().converged(), "{structure} {rule:?}");
            let far = errors_in_standard_errors(&fit, &truth.theta());
            assert_eq!(far.len(), truth.theta().len());
            assert!(far.iter().all(|d| d.abs() < 4.0), "{structure} {rule:?}: {far:.1?}");
            let variance = fit.innovation_variance();
            // With 4000 samples the standard error of the variance is 2 %.
            assert!((variance / 0.25 - 1.0).abs() < 0.09, "{structure} {rule:?}: {variance}");
        }
    }
}

#[test]
fn standard_errors_of_every_structure_cover_the_truth() {
    let runs = 200;
    for structure in Structure::ALL {
        let truth = Truth::of(structure);
        let mut inside = vec![0; truth.theta().len()];
        for seed in 0..runs {
            let record = truth.record(400, 0.5, 1000 + seed);
            let fit = estimator(structure).fit(&[record]).unwrap();
            for (count, d) in inside.iter_mut().zip(errors_in_standard_errors(&fit, &truth.theta())) {
                *count += u32::from(d.abs() < 1.96);
            }
        }
        let shares: Vec<f64> = inside.iter().map(|c| f64::from(*c) / runs as f64).collect();
        println!("{structure}: {shares:.3?}");
        // With 200 runs the standard error is 1.5 %; the tolerance is four standard errors.
        assert!(shares.iter().all(|s| *s > 0.89), "{structure}: {shares:.3?}");
    }
}

#[test]
fn search_methods_end_in_the_same_minimum() {
    let record = Truth::of(Structure::BoxJenkins).record(1000, 0.5, 3);
    let loss = |method| {
        let mut e = estimator(Structure::BoxJenkins);
        e.search.method = method;
        e.search.max_iterations = 3000;
        let fit = e.fit(std::slice::from_ref(&record)).unwrap();
        assert!(fit.termination().converged(), "{method:?}: {:?}", fit.termination());
        fit.loss()
    };
    let reference = loss(SearchMethod::LevenbergMarquardt);
    for method in [
        SearchMethod::Automatic,
        SearchMethod::GaussNewton,
        SearchMethod::SteepestDescent,
    ] {
        assert!((loss(method) / reference - 1.0).abs() < 1e-9, "{method:?}");
    }
}

#[test]
fn constrained_coefficients_stay_in_their_bounds() {
    let truth = Truth::of(Structure::BoxJenkins);
    let record = truth.record(2000, 0.5, 4);
    let mut e = estimator(Structure::BoxJenkins);
    let free = e.fit(std::slice::from_ref(&record)).unwrap();
    e.constraints.insert("d1".into(), Constraint::Fixed(-0.8));
    e.constraints.insert("f2".into(), Constraint::Between(0.5, 0.65));
    let fit = e.fit(std::slice::from_ref(&record)).unwrap();
    let parameters = fit.parameters();
    let of = |name: &str| parameters.iter().find(|(n, _)| n == name).unwrap().1;
    assert_eq!((of("d1").value, of("d1").standard_error), (-0.8, None));
    assert_eq!((of("f2").value, of("f2").standard_error), (0.65, None));
    assert!(of("f1").standard_error.is_some() && fit.loss() > free.loss());
    assert_eq!(fit.free_count(), truth.theta().len() - 2);
    // A bound that is not active changes nothing.
    e.constraints.clear();
    e.constraints.insert("f2".into(), Constraint::Between(0.0, 0.99));
    let loose = e.fit(std::slice::from_ref(&record)).unwrap();
    for (a, b) in loose.model().theta().iter().zip(free.model().theta()) {
        assert!((a - b).abs() < 1e-6);
    }
    // Linear structures also respect bounds.
    let mut arx = estimator(Structure::Arx);
    arx.constraints.insert("b1".into(), Constraint::Fixed(0.0));
    let fit = arx.fit(&[Truth::of(Structure::Arx).record(500, 0.5, 5)]).unwrap();
    assert_eq!(fit.model().b()[1], 0.0);
    for (name, bad) in [
        ("x9", Constraint::Fixed(0.0)),
        ("f1", Constraint::Between(1.0, 0.0)),
        ("f1", Constraint::Fixed(f64::NAN)),
    ] {
        let mut e = estimator(Structure::BoxJenkins);
        e.constraints.insert(name.into(), bad);
        assert!(e.fit(std::slice::from_ref(&record)).is_err());
    }
}

#[test]
fn prior_pulls_according_to_its_weight() {
    let record = Truth::of(Structure::OutputError).record(500, 0.5, 6);
    let at = |weight: f64| {
        let mut e = estimator(Structure::OutputError);
        e.priors.insert("f2".into(), Prior { value: 0.5, weight });
        e.fit(std::slice::from_ref(&record)).unwrap()
    };
    let (none, some, strong) = (at(0.0), at(1.0), at(1e6));
    let f2 = |fit: &Fit| fit.model().f()[1];
    let plain = estimator(Structure::OutputError)
        .fit(std::slice::from_ref(&record))
        .unwrap();
    assert!((f2(&none) - f2(&plain)).abs() < 1e-9);
    assert!(f2(&none) > f2(&some) && f2(&some) > f2(&strong));
    assert!((f2(&strong) - 0.5).abs() < 1e-3);
    // The loss is the loss of the residuals, without the penalty.
    assert!(strong.loss() > plain.loss() && strong.loss() < 100.0 * plain.loss());
    // Three parameters have a prior of equal weight at the true values; the posterior mean of this linear problem is
    // computed by hand.
    let record = Truth::of(Structure::Fir).record(300, 0.5, 8);
    let mut fir = estimator(Structure::Fir);
    for name in ["b0", "b1"] {
        fir.priors.insert(
            name.into(),
            Prior {
                value: 0.0,
                weight: 0.3,
            },
        );
    }
    let fit = fir.fit(std::slice::from_ref(&record)).unwrap();
    let (e, u) = (record.input(), record.output());
    let rows: Vec<usize> = (2..300).collect();
    let sum = |f: &dyn Fn(usize) -> f64| rows.iter().map(|&t| f(t)).sum::<f64>();
    let ridge = 0.3 * rows.len() as f64;
    let (g00, g11) = (
        sum(&|t| e[t - 1] * e[t - 1]) + ridge,
        sum(&|t| e[t - 2] * e[t - 2]) + ridge,
    );
    let (g01, r0, r1) = (
        sum(&|t| e[t - 1] * e[t - 2]),
        sum(&|t| e[t - 1] * u[t]),
        sum(&|t| e[t - 2] * u[t]),
    );
    let det = g00 * g11 - g01 * g01;
    assert!((fit.model().b()[0] - (g11 * r0 - g01 * r1) / det).abs() < 1e-9);
    assert!((fit.model().b()[1] - (g00 * r1 - g01 * r0) / det).abs() < 1e-9);
}

#[test]
fn robust_loss_limits_the_effect_of_outliers() {
    let truth = Truth::of(Structure::OutputError);
    let runs = 40;
    let (mut plain_error, mut robust_error, mut inside) = (0.0, 0.0, 0);
    for seed in 0..runs {
        let clean = truth.record(1500, 0.5, 50 + seed);
        let with_outliers: Vec<f64> = clean
            .output()
            .iter()
            .enumerate()
            .map(|(t, u)| if t % 97 == 13 { u + 20.0 } else { *u })
            .collect();
        let record = Record::new(
            clean.sample_time(),
            clean.input_channel().unwrap().clone(),
            Channel::new("u", "deg", with_outliers),
        )
        .unwrap();
        let error = |fit: &Fit| (fit.model().f()[0] + 1.5).abs() + (fit.model().b()[0] - 1.0).abs();
        let mut e = estimator(Structure::OutputError);
        plain_error += error(&e.fit(std::slice::from_ref(&record)).unwrap());
        e.loss = Loss::Huber { threshold: 1.345 };
        let fit = e.fit(std::slice::from_ref(&record)).unwrap();
        assert!(fit.termination().converged(), "{:?}", fit.termination());
        robust_error += error(&fit);
        // With white noise and no outliers, the robust error bars also have the nominal coverage.
        let white = Truth::of(Structure::OutputError).record(600, 0.5, 500 + seed);
        let fit = e.fit(&[white]).unwrap();
        inside += errors_in_standard_errors(&fit, &Truth::of(Structure::OutputError).theta())
            .iter()
            .filter(|d| d.abs() < 1.96)
            .count();
    }
    println!("mean error: squares {plain_error:.4}, Huber {robust_error:.4} (sum over {runs} runs)");
    assert!(robust_error < 0.5 * plain_error);
    let share = inside as f64 / (4 * runs) as f64;
    // With 160 intervals the standard error is 1.7 %.
    assert!(share > 0.88, "{share}");
    let mut bad = estimator(Structure::Arx);
    bad.loss = Loss::Huber { threshold: 0.0 };
    let record = truth.record(100, 0.5, 1);
    assert!(matches!(bad.fit(&[record]), Err(IdentError::BadOption { .. })));
}

#[test]
fn simulation_focus_minimises_the_simulation_error() {
    // For an ARX model of an output-error system, the fit by equation error is biased; the fit by simulation error is
    // not.
    let truth = Truth::of(Structure::OutputError);
    let record = truth.record(2000, 2.0, 11);
    let arx = Orders {
        na: 2,
        nb: 2,
        nk: 1,
        ..Orders::default()
    };
    let mut e = Estimator::new(Structure::Arx, arx);
    let prediction = e.fit(std::slice::from_ref(&record)).unwrap();
    e.focus = Focus::Simulation;
    let simulation = e.fit(std::slice::from_ref(&record)).unwrap();
    let vaf = |fit: &Fit| fit.quality(std::slice::from_ref(&record)).unwrap().vaf_simulation;
    assert!((prediction.model().a()[0] + 1.5).abs() > 0.3);
    assert!((simulation.model().a()[0] + 1.5).abs() < 0.05);
    assert!(vaf(&simulation) > vaf(&prediction));
    // With coloured noise, the coverage of the system's coefficients is tested.
    let truth = Truth::of(Structure::BoxJenkins);
    let runs = 200;
    let mut inside = vec![0; truth.theta().len()];
    for seed in 0..runs {
        let mut e = estimator(Structure::BoxJenkins);
        e.focus = Focus::Simulation;
        let fit = e.fit(&[truth.record(600, 0.5, 3000 + seed)]).unwrap();
        for (count, d) in inside.iter_mut().zip(errors_in_standard_errors(&fit, &truth.theta())) {
            *count += u32::from(d.abs() < 1.96);
        }
    }
    let shares: Vec<f64> = inside.iter().map(|c| f64::from(*c) / runs as f64).collect();
    println!("focus on simulation: {shares:.3?}");
    assert!(shares.iter().all(|s| *s > 0.89), "{shares:.3?}");
    let mut both = estimator(Structure::General);
    both.focus = Focus::Simulation;
    assert!(matches!(
        both.fit(&[Truth::of(Structure::General).record(300, 0.5, 1)]),
        Err(IdentError::BadOption { .. })
    ));
}

#[test]
fn stability_can_be_required() {
    // The output grows: least squares reports an unstable model, and with `stable` the best stable model is returned.
    let ts = SampleTime::AT_100_HZ;
    let mut draw = Draw(5);
    let e: Vec<f64> = (0..120).map(|_| draw.normal()).collect();
    let mut u = vec![0.0];
    for t in 1..120 {
        u.push(1.03 * u[t - 1] + e[t - 1] + 0.1 * draw.normal());
    }
    let record = Record::new(ts, Channel::new("e", "", e), Channel::new("u", "", u)).unwrap();
    let orders = Orders {
        na: 1,
        nb: 1,
        nk: 1,
        ..Orders::default()
    };
    let mut arx = Estimator::new(Structure::Arx, orders);
    assert!(!arx.fit(std::slice::from_ref(&record)).unwrap().model().is_stable());
    arx.stable = true;
    let fit = arx.fit(std::slice::from_ref(&record)).unwrap();
    assert!(fit.model().is_stable());
}

#[test]
fn records_without_input_need_a_noise_model() {
    let alone = Truth::of(Structure::Arma).record(200, 1.0, 2);
    assert!(matches!(
        estimator(Structure::Arx).fit(std::slice::from_ref(&alone)),
        Err(IdentError::NoInput { .. })
    ));
    let fit = estimator(Structure::Arma).fit(std::slice::from_ref(&alone)).unwrap();
    let v = fit.validate(&alone).unwrap();
    assert!(v.cross_correlation.lags.is_empty() && v.quality.vaf_simulation == 0.0);
    assert!(v.quality.vaf_prediction > 50.0);
    assert!(fit.operator().is_err());
    // A record with an input is also accepted; the input is not examined.
    let with = Truth::of(Structure::Arx).record(200, 1.0, 2);
    assert!(estimator(Structure::Ar).fit(&[with]).is_ok());
}

#[test]
fn roots_of_c_near_the_circle_do_not_stop_the_search() {
    let cases: [(Structure, Truth<'_>); 3] = [
        (
            Structure::Ma,
            Truth {
                c: &[1.819, 0.827],
                ..Truth::default()
            },
        ),
        (
            Structure::Armax,
            Truth {
                a: &[-1.5, 0.7],
                b: &[1.0, 0.5],
                c: &[1.847, 0.853],
                ..Truth::default()
            },
        ),
        (
            Structure::Arma,
            Truth {
                a: &[-1.2, 0.5],
                c: &[-1.7, 0.72],
                ..Truth::default()
            },
        ),
    ];
    let (mut all_higher, mut all_stuck) = (0, 0);
    for (structure, truth) in cases {
        for rule in [InitialState::Estimate, InitialState::Backcast] {
            let (mut higher, mut stuck) = (0, 0);
            for seed in 0..60 {
                let record = [truth.record(300, 1.0, 900 + seed)];
                let mut estimator = Estimator {
                    initial_state: Some(rule),
                    ..Estimator::new(structure, truth.orders())
                };
                let own = estimator.fit(&record).unwrap();
                estimator.start = Some(truth.theta());
                let from_truth = estimator.fit(&record).unwrap();
                higher += u32::from(own.loss() > from_truth.loss() * (1.0 + 1e-6));
                stuck += u32::from(!own.termination().converged());
            }
            println!("{structure} {rule:?}: {higher} of 60 above the search from the truth, {stuck} not converged");
            (all_higher, all_stuck) = (all_higher + higher, all_stuck + stuck);
        }
    }
    // A search that does not follow the stability limit stops there in 180 of these 360 fits. Some minima are on the
    // limit.
    assert!(all_higher <= 12 && all_stuck <= 12, "{all_higher} {all_stuck}");
}
