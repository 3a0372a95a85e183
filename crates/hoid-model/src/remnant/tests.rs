use super::zoh_numerator::zoh_numerator;
use super::*;
use crate::{
    ContinuousTransferFunction, DiscreteTransferFunction, NotConvertible, SampleTime,
    discretise::{Method, discretise},
    polynomial,
};

const DISCRETISATIONS: [RemnantDiscretisation; 2] = [
    RemnantDiscretisation::ZeroOrderHold,
    RemnantDiscretisation::BackwardEuler,
];

fn ts() -> SampleTime {
    SampleTime::new(0.01).unwrap()
}

fn filters() -> Vec<RemnantFilter> {
    let constants = [0.06, 0.003, 0.012, 0.5, 20.0];
    (1..=4)
        .flat_map(|m| constants.map(|t| RemnantFilter::new(0.3, t, m).unwrap()))
        .collect()
}

/// Variance of the output for white noise of unit variance: the sum of the squared impulse
/// response.
fn variance(h: &DiscreteTransferFunction, samples: usize) -> f64 {
    let mut y: Vec<f64> = Vec::with_capacity(samples);
    for k in 0..samples {
        let forced = h.num().get(k).copied().unwrap_or(0.0);
        let free: f64 = (1..h.den().len().min(k + 1)).map(|i| h.den()[i] * y[k - i]).sum();
        y.push(forced - free);
    }
    y.iter().map(|v| v * v).sum()
}

#[test]
fn hold_agrees_with_the_general_discretisation() {
    for filter in filters() {
        let h = filter.discretise(ts(), RemnantDiscretisation::ZeroOrderHold).unwrap();
        let pole = [filter.time_constant_s, 1.0];
        let den = (1..filter.order).fold(pole.to_vec(), |p, _| polynomial::product(&p, &pole));
        let continuous = ContinuousTransferFunction::new(&[filter.gain], &den).unwrap();
        let general = discretise(&continuous, ts(), Method::ZeroOrderHold).unwrap();
        let largest = h.num().iter().fold(0.0, |m: f64, b| m.max(b.abs()));
        for (a, b) in h.num().iter().zip(general.num()) {
            // The general discretisation is accurate to 14 digits of the largest coefficient.
            assert!((a - b).abs() < 2e-14 * largest, "{filter:?}: {h:?} and {general:?}");
        }
        for (a, b) in h.den().iter().zip(general.den()) {
            assert!((a - b).abs() < 1e-13, "{filter:?}");
        }
    }
}

#[test]
fn backward_euler_agrees_with_the_general_discretisation() {
    for filter in filters() {
        let h = filter.discretise(ts(), RemnantDiscretisation::BackwardEuler).unwrap();
        let pole = [filter.time_constant_s, 1.0];
        let den = (1..filter.order).fold(pole.to_vec(), |p, _| polynomial::product(&p, &pole));
        let continuous = ContinuousTransferFunction::new(&[filter.gain], &den).unwrap();
        let general = discretise(&continuous, ts(), Method::BackwardEuler).unwrap();
        assert!((h.num()[0] / general.num()[0] - 1.0).abs() < 1e-13);
        assert!(general.num()[1..].iter().all(|&b| b == 0.0));
    }
}

#[test]
fn first_order_filter_is_an_autoregression() {
    // The expected values are d1 = -0.8465 (exact) and d1 = -0.8571 (backward Euler).
    let filter = RemnantFilter::new(1.0, 0.06, 1).unwrap();
    let exact = filter.noise_model(ts(), RemnantDiscretisation::default()).unwrap();
    assert_eq!(exact.c, vec![1.0]);
    assert!((exact.d[1] + (-1.0f64 / 6.0).exp()).abs() < 1e-15 && (exact.d[1] + 0.8465).abs() < 5e-5);
    let euler = filter.noise_model(ts(), RemnantDiscretisation::BackwardEuler).unwrap();
    assert!((euler.d[1] + 0.8571).abs() < 5e-5);
    // In closed form, a first-order process has the variance (1 - alpha)^2/(1 - alpha^2).
    let alpha: f64 = (-1.0f64 / 6.0).exp();
    let h = filter.discretise(ts(), RemnantDiscretisation::ZeroOrderHold).unwrap();
    assert!((variance(&h, 400) - (1.0 - alpha) / (1.0 + alpha)).abs() < 1e-14);
}

#[test]
fn noise_model_has_the_spectrum_of_the_filter() {
    for filter in filters() {
        for how in DISCRETISATIONS {
            let h = filter.discretise(ts(), how).unwrap();
            let model = filter.noise_model(ts(), how).unwrap();
            let monic = DiscreteTransferFunction::new(&model.c, &model.d, ts()).unwrap();
            assert_eq!((model.c[0], model.d[0]), (1.0, 1.0));
            assert!(polynomial::roots(&model.c).unwrap().iter().all(|z| z.norm() <= 1.0));
            for omega in [0.0, 1.0, 30.0, 150.0, 300.0] {
                let (a, b) = (
                    h.response(omega).norm(),
                    monic.response(omega).norm() * model.innovation_sd,
                );
                // Near pi/Ts the numerator nearly vanishes, so the tolerance is also relative to its largest values.
                assert!(
                    (a - b).abs() < 1e-11 * (a + 1e-6),
                    "{filter:?} {how:?} {omega}: {a} {b}"
                );
            }
            if filter.time_constant_s < 0.1 {
                let of_monic = variance(&monic, 4000) * model.innovation_sd.powi(2);
                assert!((variance(&h, 4000) / of_monic - 1.0).abs() < 1e-9, "{filter:?} {how:?}");
            }
        }
    }
}

#[test]
fn zeros_approach_the_euler_frobenius_zeros() {
    for (m, expected) in [
        (2, vec![-1.0]),
        (3, vec![-2.0 - 3f64.sqrt(), -2.0 + 3f64.sqrt()]),
        (4, vec![-5.0 - 24f64.sqrt(), -1.0, -5.0 + 24f64.sqrt()]),
    ] {
        let zeros = polynomial::roots(&zoh_numerator(m, 1e-7)).unwrap();
        for (zero, expected) in zeros.iter().zip(expected) {
            // The distance of the zeros from their limits is about a.
            assert!(
                (zero - expected).norm() < 1e-6 * expected.abs(),
                "{m}: {zero} and {expected}"
            );
        }
    }
}

#[test]
fn numerator_sums_to_the_static_gain_for_any_sampling() {
    for m in 1..=4 {
        for a in [1e-9, 1e-3, 0.16, 1.0, 7.999, 8.0, 40.0, 800.0] {
            let sum: f64 = zoh_numerator(m, a).iter().sum();
            let expected = (-(-a).exp_m1()).powi(m as i32);
            assert!((sum / expected - 1.0).abs() < 2e-14, "{m} {a}: {sum} and {expected}");
        }
    }
}

#[test]
fn retrieve_inverts_noise_model() {
    for filter in filters() {
        for how in DISCRETISATIONS {
            let model = filter.noise_model(ts(), how).unwrap();
            let found = retrieve(&model.d[1..], model.innovation_sd, ts(), how).unwrap();
            // With T_n of 2000 samples, 1 - alpha has 12 correct digits, and K_n depends on its m-th power.
            let tolerance = 1e-14 * filter.time_constant_s.max(0.01) / 0.01 * 20.0;
            assert!(
                (found.t_n_s / filter.time_constant_s - 1.0).abs() < tolerance,
                "{filter:?} {how:?} {found:?}"
            );
            assert!(
                (found.k_n / filter.gain - 1.0).abs() < 5.0 * tolerance,
                "{filter:?} {how:?} {found:?}"
            );
        }
    }
}

#[test]
fn perturbed_coefficients_give_the_mean_time_constant() {
    // Computed by hand for m = 2 and backward Euler: d1 = -1.7 gives alpha = 0.85, d2 = 0.7396 gives alpha = 0.86.
    let found = retrieve(&[-1.7, 0.7396], 0.02, ts(), RemnantDiscretisation::BackwardEuler).unwrap();
    let expected = 0.5 * 0.01 * (0.85 / 0.15 + 0.86 / 0.14);
    assert!((found.t_n_s - expected).abs() < 1e-15);
    assert!((found.k_n - 0.02 * ((expected + 0.01) / 0.01f64).powi(2)).abs() < 1e-13);
}

#[test]
fn jacobian_agrees_with_finite_differences() {
    for how in DISCRETISATIONS {
        for m in 1..=4 {
            for t in [0.004, 0.06, 0.3] {
                let model = RemnantFilter::new(0.3, t, m).unwrap().noise_model(ts(), how).unwrap();
                // The coefficients are changed so that they imply different time constants.
                let mut p: Vec<f64> = model.d[1..]
                    .iter()
                    .enumerate()
                    .map(|(i, d)| d * (1.0 - 3e-3 * i as f64))
                    .collect();
                p.push(model.innovation_sd);
                let exact = retrieval_jacobian(&p[..m], p[m], ts(), how).unwrap();
                for j in 0..=m {
                    let h = 1e-5 * p[j].abs();
                    let at = |sign: f64| {
                        let mut q = p.clone();
                        q[j] += sign * h;
                        let r = retrieve(&q[..m], q[m], ts(), how).unwrap();
                        [r.t_n_s, r.k_n]
                    };
                    let (up, down) = (at(1.0), at(-1.0));
                    for i in 0..2 {
                        let difference = (up[i] - down[i]) / (2.0 * h);
                        // The error of the difference consists of a truncation error of order (h/(1 - alpha))^2, where
                        // 1 - alpha is at least 0.03, and a rounding error of order eps/h.
                        assert!(
                            (exact[i][j] - difference).abs() <= 2e-6 * difference.abs(),
                            "{how:?} m {m} T_n {t} row {i} column {j}: {} and {difference}",
                            exact[i][j]
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn non_convertible_filters_give_the_reason() {
    let reason = |d: &[f64], sd: f64| {
        let error = retrieve(d, sd, ts(), RemnantDiscretisation::ZeroOrderHold).unwrap_err();
        // The errors are compared as text, because NaN is not equal to itself.
        let same = retrieval_jacobian(d, sd, ts(), RemnantDiscretisation::ZeroOrderHold).unwrap_err();
        assert_eq!(same.to_string(), error.to_string());
        error
    };
    for (d, word) in [
        (vec![0.3], "d1 = 0.300000, expected a negative number"),
        (vec![0.0], "expected a negative"),
        (vec![-1.0], "pole at z = 1.000000"),
        (vec![-1.2], "pole at z = 1.2"),
        (vec![-1.7, -0.7], "d2 = -0.700000, expected a positive number"),
        (vec![], "order must be"),
        (vec![-0.1; 5], "order must be"),
    ] {
        let error = reason(&d, 1.0);
        assert!(
            matches!(&error, NotConvertible::NotARemnantFilter { reason, .. } if reason.contains(word)),
            "{error}"
        );
    }
    assert!(matches!(reason(&[f64::NAN], 1.0), NotConvertible::NotFinite { name, .. } if name == "d1"));
    assert!(matches!(reason(&[-0.8], f64::NAN), NotConvertible::NotFinite { .. }));
    assert!(matches!(
        reason(&[-0.8], -1.0),
        NotConvertible::NotARemnantFilter { .. }
    ));
    let white = retrieve(&[-1e-320], 1.0, ts(), RemnantDiscretisation::BackwardEuler).unwrap_err();
    assert!(white.to_string().contains("white"), "{white}");
    // A noise-free record gives a gain of zero, which is a valid value.
    let silent = retrieve(&[-0.8], 0.0, ts(), RemnantDiscretisation::ZeroOrderHold).unwrap();
    assert_eq!(silent.k_n, 0.0);
}

#[test]
fn bad_filters_are_refused() {
    for (gain, time, order) in [
        (f64::NAN, 0.06, 1),
        (-0.1, 0.06, 1),
        (0.1, 0.0, 1),
        (0.1, f64::INFINITY, 1),
        (0.1, 0.06, 0),
        (0.1, 0.06, 5),
    ] {
        assert!(RemnantFilter::new(gain, time, order).is_err());
        let literal = RemnantFilter {
            gain,
            time_constant_s: time,
            order,
        };
        assert!(literal.discretise(ts(), RemnantDiscretisation::ZeroOrderHold).is_err());
        assert!(literal.noise_model(ts(), RemnantDiscretisation::BackwardEuler).is_err());
    }
    for time in [1e-100, 1e100] {
        let absurd = RemnantFilter::new(0.1, time, 4).unwrap();
        assert!(absurd.discretise(ts(), RemnantDiscretisation::ZeroOrderHold).is_err());
        assert!(absurd.noise_model(ts(), RemnantDiscretisation::ZeroOrderHold).is_err());
    }
}
