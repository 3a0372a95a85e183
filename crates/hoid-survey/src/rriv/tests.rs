mod closed_loop;

use hoid_core::filter::{divide_in_place, fir};
use hoid_model::{Channel, Record, SampleTime};
use hoid_sim::RunSeed;

use super::*;
use hoid_ident::{Fit, InstrumentalVariable, IvMethod};

const B: [f64; 2] = [1.0, 0.5];
const F: [f64; 2] = [-1.5, 0.7];
const D: [f64; 1] = [-0.8];
const TRUTH: [f64; 5] = [1.0, 0.5, -0.8, -1.5, 0.7];

fn textbook_orders() -> Orders {
    Orders {
        nb: 2,
        nd: 1,
        nf: 2,
        nk: 2,
        ..Orders::default()
    }
}

/// `u = (B/F) q^-2 e + (1/D) eps` with white e and eps of unit variance; from the middle of the record on, B is
/// multiplied by `gain`.
fn open_loop(n: usize, replication: u64, d: &[f64], gain: f64) -> (Vec<f64>, Vec<f64>) {
    let white = |cell| {
        RunSeed {
            seed: 9,
            cell,
            replication,
        }
        .white_noise(n)
    };
    let (e, mut v) = (white(0), white(1));
    let mut w = vec![0.0; n];
    fir(&B, 2, &e, &mut w);
    w[n / 2..].iter_mut().for_each(|w| *w *= gain);
    divide_in_place(&F, &mut w);
    divide_in_place(d, &mut v);
    let u = w.iter().zip(&v).map(|(w, v)| w + v).collect();
    (e, u)
}

fn record(e: &[f64], u: &[f64]) -> Record {
    Record::new(
        SampleTime::AT_100_HZ,
        Channel::new("e", "", e.to_vec()),
        Channel::new("u", "", u.to_vec()),
    )
    .unwrap()
}

fn fit_riv(record: &Record, orders: Orders) -> Fit {
    let method = if orders.nd > 0 { IvMethod::RivBj } else { IvMethod::Sriv };
    InstrumentalVariable::new(method, orders)
        .fit(std::slice::from_ref(record))
        .unwrap()
}

/// Starts from a fit, with filters warmed up on its samples.
fn recursion_from_fit(fit: &Fit, warm: &Record, lambda: &[f64], external: bool) -> RefinedRecursion {
    let start = RefinedStart {
        theta: fit.model().theta(),
        covariance: fit.covariance().unwrap(),
        innovation_variance: fit.innovation_variance(),
        samples: warm.len(),
    };
    let mut recursion = RefinedRecursion::new(fit.orders(), start, lambda, external).unwrap();
    samples(warm).for_each(|s| {
        recursion.step_without_update(s);
    });
    recursion
}

fn samples(record: &Record) -> impl Iterator<Item = Sample> {
    let reference = record.channel("f_t");
    (0..record.len()).map(move |t| Sample {
        e: record.input()[t],
        u: record.output()[t],
        reference: reference.map(|f| f[t]),
    })
}

fn errors(recursion: &RefinedRecursion) -> Vec<f64> {
    let p = recursion.theta().len();
    let mut covariance = vec![0.0; p * p];
    assert!(recursion.covariance(&mut covariance));
    (0..p).map(|i| covariance[i * (p + 1)].sqrt()).collect()
}

#[test]
fn estimate_without_forgetting_converges_to_the_batch_estimate() {
    for (orders, d) in [
        (textbook_orders(), &D[..]),
        (
            Orders {
                nd: 0,
                ..textbook_orders()
            },
            &[],
        ),
    ] {
        let mut worst = 0.0_f64;
        for replication in 0..4 {
            let (e, u) = open_loop(20_000, replication, d, 1.0);
            let first = 1000;
            let warm = record(&e[..first], &u[..first]);
            let mut recursion = recursion_from_fit(
                &fit_riv(&warm, orders),
                &warm,
                &vec![1.0; orders.parameter_count()],
                false,
            );
            samples(&record(&e[first..], &u[first..])).for_each(|s| {
                recursion.step(s);
            });
            let batch = fit_riv(&record(&e, &u), orders);
            for (i, found) in errors(&recursion).into_iter().enumerate() {
                let error = batch.parameters()[i].1.standard_error.unwrap();
                worst = worst.max((recursion.theta()[i] - batch.model().theta()[i]).abs() / error);
                // The start has a weight of 5 % of the samples.
                assert!((found / error - 1.0).abs() < 0.02, "{orders}, {i}: {}", found / error);
            }
            assert!((recursion.innovation_variance() / batch.innovation_variance() - 1.0).abs() < 2e-3);
        }
        println!("{orders}: farthest {worst:.3} standard errors");
        // The difference is a second-order effect: past samples were filtered with past estimates.
        assert!(worst < 0.15, "{orders}: {worst}");
    }
}

#[test]
fn standard_errors_are_correct_with_any_forgetting() {
    let runs = 200;
    let (short, middle) = (1.0 - 1.0 / 256.0, 1.0 - 1.0 / 1000.0);
    for lambda in [[1.0; 5], [short; 5], [short, short, 1.0, middle, middle]] {
        let (mut sums, mut squares) = ([0.0; 5], [0.0; 5]);
        for replication in 0..runs {
            let (e, u) = open_loop(3000, 100 + replication, &D, 1.0);
            let warm = record(&e[..1000], &u[..1000]);
            let mut recursion = recursion_from_fit(&fit_riv(&warm, textbook_orders()), &warm, &lambda, false);
            samples(&record(&e[1000..], &u[1000..])).for_each(|s| {
                recursion.step(s);
            });
            for (i, error) in errors(&recursion).into_iter().enumerate() {
                let z = (recursion.theta()[i] - TRUTH[i]) / error;
                sums[i] += z / runs as f64;
                squares[i] += z * z / runs as f64;
            }
        }
        println!(
            "{lambda:.4?}: mean {sums:+.2?}, deviation {:.2?}",
            squares.map(f64::sqrt)
        );
        for (mean, square) in sums.into_iter().zip(squares) {
            // Over 200 runs, the standard error of the mean is 0.07 and that of the standard deviation 5 %.
            assert!(mean.abs() < 0.2, "{lambda:?}: {mean}");
            assert!((0.85..1.15).contains(&square.sqrt()), "{lambda:?}: {}", square.sqrt());
        }
    }
}

#[test]
fn jump_of_the_gain_is_tracked() {
    let short = 1.0 - 1.0 / 256.0;
    for lambda in [[short; 5], [short, short, 1.0, 1.0, 1.0]] {
        let (e, u) = open_loop(6000, 7, &D, 2.0);
        let warm = record(&e[..1000], &u[..1000]);
        let mut recursion = recursion_from_fit(&fit_riv(&warm, textbook_orders()), &warm, &lambda, false);
        for (t, s) in samples(&record(&e, &u)).enumerate().skip(1000) {
            recursion.step(s);
            // The samples are before the jump and six memory lengths after it.
            if t == 2999 || t == 4500 {
                let gain = if t < 3000 { 1.0 } else { 2.0 };
                for (i, error) in errors(&recursion).into_iter().enumerate() {
                    let truth = TRUTH[i] * if i < 2 { gain } else { 1.0 };
                    let distance = (recursion.theta()[i] - truth).abs();
                    assert!(
                        distance < 3.5 * error + 0.02 * truth.abs(),
                        "{t} {i}: {distance} {error}"
                    );
                }
            }
        }
    }
}

/// Function that returns e and u of sample t, computed from white noise.
type SignalShape = fn(usize, f64) -> (f64, f64);

#[test]
fn estimates_stay_finite_for_any_data() {
    let noise = RunSeed::default().white_noise(100_000);
    let (e, u) = open_loop(1000, 3, &D, 1.0);
    let warm = record(&e, &u);
    let fit = fit_riv(&warm, textbook_orders());
    let shapes: [(&str, SignalShape); 7] = [
        ("silence", |_, _| (0.0, 0.0)),
        ("constant", |_, _| (1.0, -3.0)),
        ("saturation", |t, x| (x, if (t / 37) % 2 == 0 { 1.0 } else { -1.0 })),
        ("jumps of scale", |t, x| {
            let scale = if (t / 5000) % 2 == 0 { 1.0 } else { 1e6 };
            (scale * x, scale * x.sin())
        }),
        ("huge", |_, x| (1e300 * x, -1e300 * x)),
        ("tiny", |_, x| (1e-300 * x, 1e-300 * x.cos())),
        ("output alone", |_, x| (0.0, x)),
    ];
    let short = 1.0 - 1.0 / 64.0;
    for lambda in [[1.0; 5], [short; 5], [short, 1.0, 0.9, 1.0, short]] {
        for (name, shape) in shapes {
            for external in [true, false] {
                let mut recursion = recursion_from_fit(&fit, &warm, &lambda, external);
                for (t, x) in noise.iter().enumerate() {
                    let (e, u) = shape(t, *x);
                    let reference = (t % 3 == 0).then_some(0.5 * e);
                    let taken = recursion.step(Sample { e, u, reference });
                    assert!(taken.innovation.is_finite(), "{name} {t}");
                    if t % 1000 == 0 {
                        let numbers = recursion.theta().iter().copied().chain(errors(&recursion));
                        assert!(
                            numbers.chain([recursion.innovation_variance()]).all(f64::is_finite),
                            "{name} {t}"
                        );
                    }
                }
                if name == "silence" {
                    assert!(errors(&recursion).iter().all(|s| *s < 1.0), "{:?}", errors(&recursion));
                }
            }
        }
    }
}

#[test]
fn silence_has_no_lasting_effect() {
    let lambda = [1.0 - 1.0 / 256.0; 5];
    let (e, u) = open_loop(6000, 4, &D, 1.0);
    let warm = record(&e[..2000], &u[..2000]);
    for still in [(0.0, 0.0), (1.0, 5.0)] {
        let mut recursion = recursion_from_fit(&fit_riv(&warm, textbook_orders()), &warm, &lambda, false);
        for _ in 0..100_000 {
            recursion.step(Sample {
                e: still.0,
                u: still.1,
                reference: None,
            });
        }
        samples(&record(&e[2000..], &u[2000..])).for_each(|s| {
            recursion.step(s);
        });
        let mut default = recursion_from_fit(&fit_riv(&warm, textbook_orders()), &warm, &lambda, false);
        samples(&record(&e[2000..], &u[2000..])).for_each(|s| {
            default.step(s);
        });
        for (i, (a, b)) in errors(&recursion).into_iter().zip(errors(&default)).enumerate() {
            println!(
                "{still:?} {i}: {:.4} {:.4}, errors {a:.4} {b:.4}",
                recursion.theta()[i],
                default.theta()[i]
            );
            // 4000 samples are 16 memory lengths.
            assert!((recursion.theta()[i] - default.theta()[i]).abs() < b, "{still:?} {i}");
            assert!((a / b - 1.0).abs() < 0.3, "{still:?} {i}: {a} {b}");
        }
    }
}

#[test]
fn pole_near_the_unit_circle_shortens_the_step() {
    let orders = Orders {
        nb: 1,
        nf: 1,
        nk: 1,
        ..Orders::default()
    };
    let start = RefinedStart {
        theta: &[1.0, -0.99],
        covariance: &[0.1, 0.0, 0.0, 0.1],
        innovation_variance: 1.0,
        samples: 1,
    };
    let mut recursion = RefinedRecursion::new(orders, start, &[1.0; 2], false).unwrap();
    // An unstable system: `u(t) = 1.01 u(t-1) + e(t-1)`.
    let (mut u, mut shortened) = (0.0, 0);
    for e in RunSeed::default().white_noise(500) {
        shortened += usize::from(recursion.step(Sample { e, u, reference: None }).shortened);
        u = 1.01 * u + e;
        assert!(recursion.theta()[1].abs() < MAX_POLE_RADIUS);
    }
    assert!(shortened > 0);
    assert_eq!(recursion.shortened_step_count(), shortened);
}

#[test]
fn invalid_arguments_are_refused() {
    let (theta, covariance) = (TRUTH, [0.0; 25]);
    let start = RefinedStart {
        theta: &theta,
        covariance: &covariance,
        innovation_variance: 1.0,
        samples: 100,
    };
    let make = |orders, start, lambda: &[f64]| RefinedRecursion::new(orders, start, lambda, false).map(drop);
    assert_eq!(make(textbook_orders(), start, &[1.0; 5]), Ok(()));
    for orders in [
        Orders {
            na: 1,
            ..textbook_orders()
        },
        Orders {
            nc: 1,
            ..textbook_orders()
        },
        Orders {
            nb: 0,
            ..textbook_orders()
        },
    ] {
        assert!(matches!(
            make(orders, start, &[1.0; 5]),
            Err(IdentError::BadOption { .. })
        ));
    }
    for lambda in [&[1.0; 4][..], &[0.0; 5], &[1.1; 5], &[f64::NAN; 5]] {
        assert!(matches!(
            make(textbook_orders(), start, lambda),
            Err(IdentError::BadOption { .. })
        ));
    }
    let unstable = [1.0, 0.5, -0.8, -2.5, 1.0];
    for bad in [
        RefinedStart {
            theta: &theta[..4],
            ..start
        },
        RefinedStart {
            theta: &unstable,
            ..start
        },
        RefinedStart {
            theta: &[f64::NAN; 5],
            ..start
        },
        RefinedStart {
            covariance: &[-1.0; 25],
            ..start
        },
        RefinedStart {
            innovation_variance: 0.0,
            ..start
        },
    ] {
        assert!(matches!(
            make(textbook_orders(), bad, &[1.0; 5]),
            Err(IdentError::BadStart { .. })
        ));
    }
}

#[test]
fn missing_output_is_replaced_by_its_prediction() {
    let (e, u) = open_loop(2000, 5, &D, 1.0);
    let warm = record(&e[..1000], &u[..1000]);
    let mut recursion = recursion_from_fit(&fit_riv(&warm, textbook_orders()), &warm, &[1.0; 5], false);
    let theta = recursion.theta().to_vec();
    let (mut squares, mut count) = (0.0, 0.0);
    for (t, s) in samples(&record(&e[1000..], &u[1000..])).enumerate() {
        if t % 50 < 3 {
            recursion.bridge(Sample { u: f64::NAN, ..s });
        } else {
            let innovation = recursion.step_without_update(s).innovation;
            if t % 50 > 10 {
                squares += innovation * innovation;
                count += 1.0;
            }
        }
    }
    assert_eq!(recursion.theta(), theta);
    // The mean of 780 squares has a relative standard error of 5 %; the noise model forgets the gap in about five
    // samples.
    assert!((squares / count - 1.0_f64).abs() < 0.2, "{}", squares / count);
}
