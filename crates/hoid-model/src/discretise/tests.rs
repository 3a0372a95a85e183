use num_complex::Complex64;

use super::*;
use crate::{ContinuousTransferFunction, DiscreteTransferFunction, SampleTime, polynomial};

fn ts(s: f64) -> SampleTime {
    SampleTime::new(s).unwrap()
}

fn tf(num: &[f64], den: &[f64]) -> ContinuousTransferFunction {
    ContinuousTransferFunction::new(num, den).unwrap()
}

struct Case {
    name: String,
    method: Method,
    h: ContinuousTransferFunction,
    sample_time: SampleTime,
    num: Vec<f64>,
    den: Vec<f64>,
    scipy_num: Vec<f64>,
    scipy_den: Vec<f64>,
}

/// Values from fixtures/discretise/make.py: exact values with 60 digits (mpmath), and the values of
/// scipy.signal.cont2discrete.
fn cases() -> Vec<Case> {
    let numbers = |text: &str| -> Vec<f64> { text.split_whitespace().map(|v| v.parse().unwrap()).collect() };
    include_str!("../../../../fixtures/discretise/discretise.csv")
        .lines()
        .skip(1)
        .map(|line| {
            let field: Vec<&str> = line.split(';').collect();
            Case {
                name: format!("{} {}", field[0], field[1]),
                method: match field[1] {
                    "zoh" => Method::ZeroOrderHold,
                    "foh" => Method::FirstOrderHold,
                    "bilinear" => Method::Tustin,
                    "euler" => Method::ForwardEuler,
                    "backward_diff" => Method::BackwardEuler,
                    other => panic!("{other}"),
                },
                sample_time: ts(field[2].parse().unwrap()),
                h: tf(&numbers(field[3]), &numbers(field[4])),
                num: numbers(field[5]),
                den: numbers(field[6]),
                scipy_num: numbers(field[7]),
                scipy_den: numbers(field[8]),
            }
        })
        .collect()
}

fn max_magnitude(p: &[f64]) -> f64 {
    p.iter().fold(0.0, |m, c| m.max(c.abs()))
}

fn assert_close(name: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{name}: {found:?} and {expected:?}");
    for (a, b) in found.iter().zip(expected) {
        assert!(
            (a - b).abs() <= tolerance * max_magnitude(expected),
            "{name}: {found:?} and {expected:?}, off by {:e}",
            (a - b).abs() / max_magnitude(expected)
        );
    }
}

#[test]
fn discretisation_agrees_with_exact_values() {
    let cases = cases();
    assert!(cases.len() >= 40);
    for case in &cases {
        let d = discretise(&case.h, case.sample_time, case.method).unwrap();
        // Orders 1 to 6 at Ts = 0.01 s: the tolerance is a few rounding errors, although the numerators of order 6 are
        // as small as 1e-8 to 1e-12.
        assert_close(&case.name, d.num(), &case.num, 1e-14);
        assert_close(&case.name, d.den(), &case.den, 2e-15);
    }
}

#[test]
fn discretisation_agrees_with_scipy() {
    for case in cases() {
        let d = discretise(&case.h, case.sample_time, case.method).unwrap();
        // ss2tf computes a numerator as the difference of two characteristic polynomials, so its absolute errors are
        // 1e-15 times binomial coefficients.
        let size = max_magnitude(&case.scipy_den) + max_magnitude(&case.scipy_num);
        for (ours, theirs) in [(d.num(), &case.scipy_num), (d.den(), &case.scipy_den)] {
            assert_eq!(ours.len(), theirs.len());
            for (a, b) in ours.iter().zip(theirs) {
                assert!((a - b).abs() < 1e-12 * size, "{}: {ours:?} and {theirs:?}", case.name);
            }
        }
    }
}

#[test]
fn whole_sample_delay_adds_leading_zeros() {
    let h = tf(&[4.0, 11.0], &[1.0, 7.9, 126.0]);
    for method in [
        Method::ForwardEuler,
        Method::BackwardEuler,
        Method::Tustin,
        Method::TustinPrewarped { omega_rad_s: 4.0 },
        Method::ZeroOrderHold,
        Method::FirstOrderHold,
        Method::Matched,
    ] {
        let plain = discretise(&h, ts(0.01), method).unwrap();
        let late = discretise(&h.clone().with_delay(0.28).unwrap(), ts(0.01), method).unwrap();
        assert_eq!(late.den(), plain.den());
        assert!(late.num()[..28].iter().all(|&b| b == 0.0));
        assert_eq!(&late.num()[28..], plain.num());
        let odd = discretise(&h.clone().with_delay(0.285).unwrap(), ts(0.01), method);
        let held = matches!(method, Method::ZeroOrderHold | Method::FirstOrderHold);
        assert_eq!(odd.is_ok(), held, "{method:?}");
    }
}

/// Response at the samples to a unit step (zero-order hold) or a unit ramp (first-order hold).
fn response_to(h: &DiscreteTransferFunction, input: impl Fn(usize) -> f64, samples: usize) -> Vec<f64> {
    let mut y: Vec<f64> = Vec::new();
    for k in 0..samples {
        let forced: f64 = h
            .num()
            .iter()
            .enumerate()
            .filter(|(i, _)| *i <= k)
            .map(|(i, b)| b * input(k - i))
            .sum();
        let free: f64 = h
            .den()
            .iter()
            .enumerate()
            .skip(1)
            .filter(|(i, _)| *i <= k)
            .map(|(i, a)| a * y[k - i])
            .sum();
        y.push(forced - free);
    }
    y
}

#[test]
fn holds_are_exact_with_fractional_delay() {
    // 0.7 + 2/(s + 3) with a delay of 2.3 samples, computed by hand. The step and the ramp start at t = 0, so the holds
    // are exact.
    let sample_time = ts(0.1);
    let delay = 0.23;
    let h = tf(&[0.7, 4.1], &[1.0, 3.0]).with_delay(delay).unwrap();
    let step = response_to(
        &discretise(&h, sample_time, Method::ZeroOrderHold).unwrap(),
        |_| 1.0,
        30,
    );
    // The triangle hold interpolates linearly from u(-1) = 0 to u(0); for the ramp, u(0) = 0.
    let ramp = response_to(
        &discretise(&h, sample_time, Method::FirstOrderHold).unwrap(),
        |k| 0.1 * k as f64,
        30,
    );
    for k in 0..30 {
        let t = 0.1 * k as f64 - delay;
        let (s, r) = if t < 0.0 {
            (0.0, 0.0)
        } else {
            let lag = 1.0 - (-3.0 * t).exp();
            (0.7 + 2.0 / 3.0 * lag, 0.7 * t + 2.0 / 3.0 * (t - lag / 3.0))
        };
        // The tolerance allows for the accumulated rounding of 30 recursion steps.
        assert!((step[k] - s).abs() < 1e-13, "{k}: {} and {s}", step[k]);
        assert!((ramp[k] - r).abs() < 1e-13, "{k}: {} and {r}", ramp[k]);
    }
}

#[test]
fn prewarped_tustin_is_exact_at_its_frequency() {
    let systems = [
        tf(&[4.5, 11.4], &[1.0, 7.875, 126.5625]),
        tf(&[1.0], &[1.0, 0.0, 0.0]),
        tf(&[2.0, 1.0], &[1.0, 3.0]),
    ];
    for h in &systems {
        for omega in [0.5, 11.25, 150.0] {
            let d = discretise(h, ts(0.01), Method::TustinPrewarped { omega_rad_s: omega }).unwrap();
            let error = (d.response(omega) - h.response(omega)).norm() / h.response(omega).norm();
            // The rounding errors of the coefficients are divided by (z - 1)^2 at z = e^{0.005j}.
            assert!(error < 1e-10, "{h:?} at {omega}: {error:e}");
            let plain = discretise(h, ts(0.01), Method::Tustin).unwrap();
            assert!((plain.response(omega) - h.response(omega)).norm() / h.response(omega).norm() > error);
        }
    }
    for omega in [0.0, -1.0, 100.0 * std::f64::consts::PI, f64::NAN] {
        assert!(discretise(&systems[0], ts(0.01), Method::TustinPrewarped { omega_rad_s: omega }).is_err());
    }
}

#[test]
fn matched_method_maps_poles_and_zeros() {
    let sample_time = ts(0.1);
    // 3 (s + 2) / ((s + 1) (s^2 + 2 s + 26)) has one finite zero and two zeros at infinity.
    let h = tf(&[3.0, 6.0], &polynomial::product(&[1.0, 1.0], &[1.0, 2.0, 26.0]));
    let d = discretise(&h, sample_time, Method::Matched).unwrap();
    for s in [Complex64::new(-1.0, 0.0), Complex64::new(-1.0, 5.0)] {
        let backward = (-s * 0.1).exp();
        assert!(polynomial::value(d.den(), backward).norm() < 1e-13);
    }
    // The discrete zeros are at e^{-0.2} and -1, and there is one sample of delay.
    assert_eq!(d.num()[0], 0.0);
    assert!(polynomial::value(d.num(), Complex64::new(0.2f64.exp(), 0.0)).norm() < 1e-15);
    assert!(polynomial::value(d.num(), Complex64::new(-1.0, 0.0)).norm() < 1e-15);
    assert!((d.response(0.0) - h.response(0.0)).norm() < 1e-13);

    // Biproper: no delay is added. Pole at s = 0: the velocity constant lim s H(s) = 5/4 is kept.
    let lead = discretise(&tf(&[2.0, 1.0], &[1.0, 3.0]), sample_time, Method::Matched).unwrap();
    assert!(lead.num()[0] != 0.0);
    assert!((lead.response(0.0).re - 1.0 / 3.0).abs() < 1e-14);
    let servo = discretise(&tf(&[5.0], &[1.0, 4.0, 0.0]), sample_time, Method::Matched).unwrap();
    let near = Complex64::from_polar(1.0, -1e-6);
    let velocity =
        (1.0 / near - 1.0) / 0.1 * polynomial::value(servo.num(), near) / polynomial::value(servo.den(), near);
    assert!((velocity - 1.25).norm() < 1e-5);
    // The matched integrators are Ts/(z - 1) and Ts^2 (z + 1) / (2 (z - 1)^2).
    let double = discretise(&tf(&[1.0], &[1.0, 0.0, 0.0]), sample_time, Method::Matched).unwrap();
    assert_close("double integrator", double.num(), &[0.0, 0.005, 0.005], 1e-14);
    assert_close("double integrator", double.den(), &[1.0, -2.0, 1.0], 1e-14);
    let zero = discretise(&tf(&[0.0], &[1.0, 1.0]), sample_time, Method::Matched).unwrap();
    assert_eq!(zero.num(), &[0.0]);
}

#[test]
fn degenerate_systems_keep_their_static_gain() {
    for method in [
        Method::ForwardEuler,
        Method::Tustin,
        Method::ZeroOrderHold,
        Method::FirstOrderHold,
        Method::Matched,
    ] {
        let gain = discretise(&tf(&[3.0], &[2.0]), ts(0.01), method).unwrap();
        assert_eq!((gain.num(), gain.den()), (&[1.5][..], &[1.0][..]), "{method:?}");
        let stable = discretise(&tf(&[4.5, 11.4], &[1.0, 7.875, 126.5625]), ts(0.01), method).unwrap();
        assert!((stable.response(0.0).re - 11.4 / 126.5625).abs() < 1e-12, "{method:?}");
    }
    // Poles at 1/Ts and 2/Ts have no image under backward Euler and Tustin, respectively.
    let fast = |p: f64| tf(&[1.0], &[1.0, -p]);
    assert!(discretise(&fast(100.0), ts(0.01), Method::BackwardEuler).is_err());
    assert!(discretise(&fast(200.0), ts(0.01), Method::Tustin).is_err());
    assert!(discretise(&fast(100.0), ts(0.01), Method::Tustin).is_ok());
    // e^{1e6} overflows, whereas the exponential of a fast stable pole does not.
    for method in [Method::ZeroOrderHold, Method::FirstOrderHold, Method::Matched] {
        assert!(discretise(&fast(1e8), ts(0.01), method).is_err(), "{method:?}");
        assert!(discretise(&fast(-1e6), ts(0.01), method).is_ok(), "{method:?}");
    }
    let late = tf(&[1.0], &[1.0, 1.0]).with_delay(1e12).unwrap();
    assert!(discretise(&late, ts(0.01), Method::ZeroOrderHold).is_err());
}
