use std::time::Instant;

use hoid_model::{
    Orders, Structure,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

use super::*;

fn run(condition: Condition, replication: u64) -> Record {
    let run_seed = RunSeed {
        seed: 4,
        cell: 1,
        replication,
    };
    Simulator::new(&Scenario::condition(condition))
        .unwrap()
        .run(run_seed, false)
        .unwrap()
}

fn operator() -> Estimator {
    Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29))
}

fn samples(record: &Record) -> impl Iterator<Item = Sample> {
    record.input().iter().zip(record.output()).map(|(e, u)| Sample {
        e: *e,
        u: *u,
        reference: None,
    })
}

fn record_part(record: &Record, from: usize, to: usize) -> Record {
    let cut = |x: &[f64]| x[from..to].to_vec();
    Record::new(
        record.sample_time(),
        Channel::new("e", "", cut(record.input())),
        Channel::new("u", "", cut(record.output())),
    )
    .unwrap()
}

#[test]
fn every_fit_matches_the_batch_fit_of_its_window() {
    for condition in [Condition::C1, Condition::C4] {
        let record = run(condition, 0);
        let (window, every) = (2000, 100);
        let mut recursion = WindowRecursion::new(operator(), record.sample_time(), window, every, None).unwrap();
        let (mut slow, mut farthest) = (0.0, 0.0_f64);
        let mut fits = 0;
        for (t, sample) in samples(&record).enumerate() {
            let before = recursion.fit_count();
            let clock = Instant::now();
            recursion.step(sample);
            let took = clock.elapsed().as_secs_f64();
            if recursion.fit_count() == before {
                continue;
            }
            (slow, fits) = (slow + took, fits + 1);
            if fits % 5 != 0 {
                continue;
            }
            let batch = operator()
                .fit(&[record_part(&record, (t + 1).saturating_sub(window), t + 1)])
                .unwrap();
            let mut covariance = vec![0.0; 25];
            assert!(recursion.covariance(&mut covariance));
            for i in 0..5 {
                let error = batch.covariance().unwrap()[i * 6].sqrt();
                farthest = farthest.max((recursion.theta()[i] - batch.model().theta()[i]).abs() / error);
                assert!((covariance[i * 6].sqrt() / error - 1.0).abs() < 0.01);
            }
            assert!((recursion.innovation_variance() / batch.innovation_variance() - 1.0).abs() < 1e-6);
        }
        println!(
            "{condition:?}: {fits} fits, {} failures, farthest {farthest:.1e} standard errors, {:.3} ms a fit",
            recursion.failures,
            1e3 * slow / f64::from(fits)
        );
        assert_eq!(recursion.failures, 0);
        // The last step of a search is accurate to sqrt(1e-12 N) standard errors.
        assert!(farthest < 1e-3, "{farthest}");
    }
}

#[test]
#[ignore = "prints times"]
fn time_of_a_fit() {
    let record = run(Condition::C4, 1);
    let mut recursion = WindowRecursion::new(operator(), record.sample_time(), 2000, 10, None).unwrap();
    let (mut warm, mut compared) = (Vec::new(), Vec::new());
    for sample in samples(&record) {
        let before = recursion.fit_count();
        let clock = Instant::now();
        recursion.step(sample);
        let took = 1e3 * clock.elapsed().as_secs_f64();
        if recursion.fit_count() > before && recursion.u.len() == 2000 {
            if recursion.fits_since_comparison == 0 {
                compared.push(took);
            } else {
                warm.push(took);
            }
        }
    }
    for (name, mut times) in [("warm", warm), ("compared", compared)] {
        times.sort_by(f64::total_cmp);
        println!(
            "{name}: {} fits, median {:.3} ms, largest {:.3} ms",
            times.len(),
            times[times.len() / 2],
            times[times.len() - 1]
        );
    }
}

#[test]
fn last_theta_is_kept_without_excitation() {
    let record = run(Condition::C1, 2);
    let mut recursion = WindowRecursion::new(operator(), record.sample_time(), 800, 50, None).unwrap();
    samples(&record).take(2000).for_each(|s| {
        recursion.step(s);
    });
    assert!(recursion.fit_count() > 10);
    let still = Sample {
        e: 0.0,
        u: 0.0,
        reference: None,
    };
    (0..2000).for_each(|_| {
        recursion.step(still);
    });
    let theta = recursion.theta().to_vec();
    assert!(recursion.failures > 10);
    assert!(matches!(
        recursion.last_failure.as_ref(),
        Some(IdentError::NoExcitation { .. })
    ));
    assert!(recursion.covariance(&mut [0.0; 25]));
    (0..500).for_each(|_| {
        recursion.step(still);
    });
    assert_eq!(recursion.theta(), theta);
    // The estimate is then updated again.
    samples(&record).skip(2000).take(1000).for_each(|s| {
        recursion.step(s);
    });
    let batch = operator().fit(&[record_part(&record, 2200, 3000)]).unwrap();
    for i in 0..5 {
        let error = batch.covariance().unwrap()[i * 6].sqrt();
        assert!((recursion.theta()[i] - batch.model().theta()[i]).abs() < 1e-3 * error);
    }
}

#[test]
fn start_is_kept_until_the_first_fit_even_if_wrong() {
    let record = run(Condition::C1, 3);
    let wrong = [0.5, -0.4, 0.9, 0.9, 0.8];
    let start = Some((&wrong[..], None));
    let mut recursion = WindowRecursion::new(operator(), record.sample_time(), 2000, 100, start).unwrap();
    for (t, sample) in samples(&record).take(2000).enumerate() {
        let taken = recursion.step(sample);
        assert!(!taken.shortened);
        if t < 498 {
            assert_eq!(recursion.theta(), wrong);
            assert!(!recursion.covariance(&mut [0.0; 25]));
        }
    }
    let batch = operator().fit(&[record_part(&record, 0, 2000)]).unwrap();
    for i in 0..5 {
        let error = batch.covariance().unwrap()[i * 6].sqrt();
        assert!((recursion.theta()[i] - batch.model().theta()[i]).abs() < 1e-3 * error);
    }
}

#[test]
fn window_collects_samples_without_fitting() {
    let record = run(Condition::C1, 4);
    let mut recursion = WindowRecursion::new(operator(), record.sample_time(), 1000, 100, None).unwrap();
    samples(&record).take(1500).for_each(|s| {
        recursion.step_without_update(s);
    });
    assert_eq!((recursion.fit_count(), recursion.theta()), (0, &[0.0; 5][..]));
    samples(&record).skip(1500).take(1).for_each(|s| {
        recursion.step(s);
    });
    assert_eq!(recursion.fit_count(), 1);
    // The innovations of the following samples have the variance of the fit.
    let squares: f64 = samples(&record)
        .skip(1501)
        .take(90)
        .map(|s| recursion.step(s).innovation.powi(2))
        .sum();
    let ratio = squares / 90.0 / recursion.innovation_variance();
    // The mean of 90 squares has a relative standard error of sqrt(2/90) = 0.15.
    assert!((0.5..1.6).contains(&ratio), "{ratio}");
}

/// Function that returns e and u of sample t, computed from white noise.
type SignalShape = fn(usize, f64) -> (f64, f64);

#[test]
fn estimates_stay_finite_for_any_data() {
    let noise = RunSeed::default().white_noise(4000);
    let shapes: [(&str, SignalShape); 7] = [
        ("silence", |_, _| (0.0, 0.0)),
        ("constant", |_, _| (1.0, -3.0)),
        ("saturation", |t, x| (x, if (t / 37) % 2 == 0 { 1.0 } else { -1.0 })),
        ("jumps of scale", |t, x| {
            let scale = if (t / 500) % 2 == 0 { 1.0 } else { 1e6 };
            (scale * x, scale * x.sin())
        }),
        ("huge", |_, x| (1e300 * x, -1e300 * x)),
        ("tiny", |_, x| (1e-300 * x, 1e-300 * x.cos())),
        ("one pulse", |t, _| {
            (f64::from(u8::from(t == 700)), f64::from(u8::from(t == 730)))
        }),
    ];
    for structure in Structure::ALL {
        let nk = if structure.has_input() { 5 } else { 0 };
        let estimator = Estimator::new(structure, structure.operator_orders(nk));
        for (name, shape) in shapes {
            let mut recursion = WindowRecursion::new(estimator.clone(), SampleTime::AT_100_HZ, 300, 75, None).unwrap();
            for (t, x) in noise.iter().enumerate() {
                let (e, u) = shape(t, *x);
                let taken = recursion.step(Sample { e, u, reference: None });
                assert!(taken.innovation.is_finite(), "{structure} {name} {t}");
                assert!(recursion.innovation_variance().is_finite(), "{structure} {name} {t}");
            }
            let p = recursion.theta().len();
            let mut covariance = vec![0.0; p * p];
            recursion.covariance(&mut covariance);
            assert!(
                recursion.theta().iter().chain(&covariance).all(|v| v.is_finite()),
                "{structure} {name}"
            );
        }
    }
}

#[test]
fn invalid_arguments_are_refused() {
    let make = |window, every, start: Option<(&[f64], Option<&[f64]>)>| {
        WindowRecursion::new(operator(), SampleTime::AT_100_HZ, window, every, start)
    };
    assert!(matches!(make(50, 1, None), Err(IdentError::BadOption { .. })));
    assert!(matches!(make(2000, 0, None), Err(IdentError::BadOption { .. })));
    let short = [1.0];
    assert!(matches!(
        make(2000, 1, Some((&short, None))),
        Err(IdentError::BadStart { .. })
    ));
    let (theta, covariance) = ([0.1; 5], [f64::NAN; 25]);
    assert!(matches!(
        make(2000, 1, Some((&theta, Some(&covariance)))),
        Err(IdentError::BadStart { .. })
    ));
    let bad = Estimator::new(Structure::Arx, Orders::default());
    assert!(WindowRecursion::new(bad, SampleTime::AT_100_HZ, 2000, 10, None).is_err());
}
