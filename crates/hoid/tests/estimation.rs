//! Properties of the estimators that require simulated records: coverage of the error bars, several records, other
//! orders, and rejected input.
#![allow(clippy::unwrap_used)]

use hoid::{
    ident::{IdentError, Reason},
    prelude::*,
};

const NK: usize = 29;

fn runs(condition: Condition, n: u64) -> Vec<Record> {
    let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
    (0..n)
        .map(|replication| {
            simulator
                .run(
                    RunSeed {
                        seed: 77,
                        cell: 0,
                        replication,
                    },
                    false,
                )
                .unwrap()
        })
        .collect()
}

fn bj() -> Estimator {
    Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(NK))
}

#[test]
fn error_bars_cover_the_truth() {
    let n = 300;
    let d1 = -(-0.01_f64 / 0.06).exp();
    let mut inside = [0; 12];
    for record in runs(Condition::C1, n) {
        let truth = Scenario::condition(Condition::C1)
            .initial
            .operator
            .discretise(SampleTime::AT_100_HZ)
            .unwrap()
            .zoh;
        let fit = bj().fit(std::slice::from_ref(&record)).unwrap();
        let mut pairs: Vec<(Estimate, f64)> = fit
            .parameters()
            .into_iter()
            .map(|(_, e)| e)
            .zip([truth.b0, truth.b1, d1, truth.f1, truth.f2])
            .collect();
        let o = fit.operator().unwrap();
        pairs.extend([
            (o.k_e, 0.09),
            (o.t_l_s, 0.4),
            (o.k_e_dot, 0.036),
            (o.omega_nm_rad_s, 11.25),
            (o.zeta_nm, 0.35),
        ]);
        let r = fit
            .remnant(hoid::model::remnant::RemnantDiscretisation::ZeroOrderHold)
            .unwrap();
        pairs.extend([(r.t_n_s, 0.06), (r.k_n, record.channel("K_n").unwrap()[0])]);
        for (count, (e, truth)) in inside.iter_mut().zip(pairs) {
            *count += u64::from((e.value - truth).abs() < 1.96 * e.standard_error.unwrap());
        }
    }
    let shares: Vec<f64> = inside.iter().map(|c| *c as f64 / n as f64).collect();
    println!("coverage of nominal 95 % intervals: {shares:.3?}");
    // With 300 runs the standard error is 1.3 %; the tolerance is four standard errors.
    assert!(shares.iter().all(|s| (0.90..=0.999).contains(s)), "{shares:?}");
}

#[test]
fn several_records_share_theta_with_smaller_errors() {
    let records = runs(Condition::C1, 4);
    let one = bj().fit(&records[..1]).unwrap();
    let four = bj().fit(&records).unwrap();
    assert_eq!((one.state_count(), four.state_count()), (2, 8));
    assert_eq!(four.residual_count(), 4 * one.residual_count());
    for ((name, a), (_, b)) in one.parameters().into_iter().zip(four.parameters()) {
        let ratio = a.standard_error.unwrap() / b.standard_error.unwrap();
        // Four times the data halve the standard error; the estimates of the standard error scatter by a few per cent.
        assert!((1.7..2.3).contains(&ratio), "{name}: {ratio}");
    }
    // The order of the records does not matter, and the same record twice gives the same minimum.
    let twice = bj().fit(&[records[0].clone(), records[0].clone()]).unwrap();
    for (a, b) in one.model().theta().iter().zip(twice.model().theta()) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn records_of_different_lengths_fit_together() {
    let records = runs(Condition::C1, 2);
    let parts = [records[0].span(0.0, 20.0).unwrap(), records[1].span(5.0, 65.5).unwrap()];
    let fit = bj().fit(&parts).unwrap();
    assert!(fit.termination().converged());
    assert!((fit.operator().unwrap().omega_nm_rad_s.value - 11.25).abs() < 1.5);
    assert_eq!(fit.residual_count(), parts.iter().map(|p| p.len() - 31).sum::<usize>());
}

/// Simulates `u = (B/F) q^-2 e + (C/D) eps` in open loop with any orders.
fn open_loop(b: &[f64], c: &[f64], d: &[f64], f: &[f64], n: usize) -> Record {
    let noise = |cell| {
        RunSeed {
            seed: 9,
            cell,
            replication: 0,
        }
        .white_noise(n)
    };
    let (e, eps) = (noise(0), noise(1));
    let filtered = |num: &[f64], den: &[f64], x: &[f64], lag: usize| {
        let mut y: Vec<f64> = Vec::with_capacity(n);
        for t in 0..n {
            let mut value: f64 = num
                .iter()
                .enumerate()
                .filter(|(j, _)| t >= lag + j)
                .map(|(j, k)| k * x[t - lag - j])
                .sum();
            value -= den
                .iter()
                .enumerate()
                .filter(|(i, _)| t > *i)
                .map(|(i, k)| k * y[t - 1 - i])
                .sum::<f64>();
            y.push(value);
        }
        y
    };
    let with_one = |p: &[f64]| std::iter::once(1.0).chain(p.iter().copied()).collect::<Vec<f64>>();
    let w = filtered(b, f, &e, 2);
    let v = filtered(&with_one(c), d, &eps, 0);
    let u = w.iter().zip(&v).map(|(w, v)| w + 0.3 * v).collect();
    Record::new(
        SampleTime::new(0.05).unwrap(),
        Channel::new("e", "", e),
        Channel::new("u", "", u),
    )
    .unwrap()
}

#[test]
fn other_orders_find_the_truth_from_default_starts() {
    type Polynomials<'a> = [&'a [f64]; 4];
    let cases: [Polynomials; 6] = [
        [&[1.0, 0.5], &[], &[-0.8], &[-1.5, 0.7]],
        [&[1.0], &[0.5], &[-0.9], &[-0.7]],
        [&[1.0, 0.5], &[-0.4, 0.2], &[-1.2, 0.5], &[-1.5, 0.7]],
        [&[1.0, -0.4, 0.2], &[], &[-0.5, 0.2, -0.1], &[-1.9, 1.3, -0.3]],
        [&[0.7, 0.3, 0.1], &[], &[-0.6], &[]],
        [&[1.0, 0.5], &[0.3], &[], &[-0.9, 0.5]],
    ];
    for [b, c, d, f] in cases {
        let orders = Orders {
            na: 0,
            nb: b.len(),
            nc: c.len(),
            nd: d.len(),
            nf: f.len(),
            nk: 2,
        };
        let record = open_loop(b, c, d, f, 6000);
        for initial_state in [InitialState::Estimate, InitialState::Zero] {
            let fit = Estimator {
                initial_state: Some(initial_state),
                ..Estimator::new(Structure::BoxJenkins, orders)
            }
            .fit(std::slice::from_ref(&record))
            .unwrap();
            assert!(fit.termination().converged(), "{orders}: {:?}", fit.termination());
            let truth: Vec<f64> = [b, c, d, f].concat();
            for ((name, e), truth) in fit.parameters().into_iter().zip(truth) {
                let distance = (e.value - truth) / e.standard_error.unwrap();
                // About 50 numbers are checked; the probability that any of them exceeds 4.5 standard errors is 3e-4.
                assert!(distance.abs() < 4.5, "{orders} {initial_state:?} {name}: {distance}");
            }
            assert!(
                (fit.innovation_variance() / 0.09 - 1.0).abs() < 0.09,
                "{orders}: {}",
                fit.innovation_variance()
            );
        }
    }
}

#[test]
fn undetermined_models_are_refused_by_name() {
    // One sine excites two parameters of a noise-free ARX model, not four.
    let n = 500;
    let sine = |t: usize| (0.2 * t as f64).sin();
    let lagged = |t: usize| (0.2 * t as f64 - 0.9).sin();
    let record = Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "", (0..n).map(sine).collect()),
        Channel::new("u", "", (0..n).map(lagged).collect()),
    )
    .unwrap();
    let orders = Structure::Arx.operator_orders(3);
    match Estimator::new(Structure::Arx, orders).fit(&[record]) {
        Err(IdentError::SingularRegressors { columns }) => {
            assert!(columns.contains("is a combination of"), "{columns}");
        }
        other => panic!("expected singular regressors, found {other:?}"),
    }
}

#[test]
fn one_sample_too_few_is_an_error() {
    let record = runs(Condition::C1, 1).remove(0);
    // There are 31 samples before the first residual, 5 parameters and 2 states.
    let enough = record.span(0.0, 0.39).unwrap();
    let short = record.span(0.0, 0.38).unwrap();
    assert_eq!((enough.len(), short.len()), (39, 38));
    assert!(matches!(
        bj().fit(&[short]),
        Err(IdentError::TooFewSamples { samples: 38, .. })
    ));
    // With one residual more than unknowns, the result is a fit or a refusal with a reason, never a panic.
    match bj().fit(&[enough]) {
        Ok(fit) => assert!(fit.loss().is_finite()),
        Err(error) => assert!(matches!(
            error,
            IdentError::SingularInformation { .. } | IdentError::NoFiniteLoss
        )),
    }
}

#[test]
fn no_length_or_order_panics() {
    let whole = runs(Condition::C1, 1).remove(0);
    let mut fitted = 0;
    for samples in [1, 2, 3, 5, 8, 13, 30, 31, 32, 33, 40, 60, 120] {
        let record = [whole.span(0.0, 0.01 * f64::from(samples)).unwrap()];
        for structure in [Structure::Arx, Structure::BoxJenkins] {
            for initial_state in [InitialState::Zero, InitialState::Estimate] {
                for nk in [0, 1, 28, 29, 31, 45, 1000] {
                    for (nc, nd, nf) in [(0, 1, 2), (2, 3, 2), (1, 0, 1), (0, 0, 0), (0, 6, 5)] {
                        let bj = structure == Structure::BoxJenkins;
                        let orders = if bj {
                            Orders {
                                na: 0,
                                nb: 2,
                                nc,
                                nd,
                                nf,
                                nk,
                            }
                        } else {
                            Orders {
                                na: nf,
                                nb: 1 + nd,
                                nk,
                                ..Orders::default()
                            }
                        };
                        let estimator = Estimator {
                            initial_state: Some(initial_state),
                            ..Estimator::new(structure, orders)
                        };
                        if let Ok(fit) = estimator.fit(&record) {
                            assert!(fit.loss().is_finite() && fit.model().theta().iter().all(|t| t.is_finite()));
                            fitted += 1;
                        }
                    }
                }
            }
        }
    }
    assert!(fitted > 100, "{fitted}");
}

#[test]
fn iteration_limit_is_reported() {
    let record = runs(Condition::C1, 1);
    let mut cut = bj();
    cut.search.max_iterations = 1;
    let fit = cut.fit(&record).unwrap();
    assert_eq!(fit.termination().reason, Reason::IterationLimit);
    assert!(!fit.termination().converged());
}
