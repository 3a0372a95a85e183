#![allow(clippy::unwrap_used)]
use super::*;
use std::vec::Vec;

fn point() -> Point {
    Point {
        tau: 0.213,
        omega: 11.0,
        zeta: 0.25,
        lag: 3.0,
    }
}

/// Returns the sums of the products of the six signals with a cosine and a sine after settling, which give their
/// responses to a sine.
fn responses_of_signals(basis: &mut Basis, omega: f64, ts: f64, of: &mut dyn FnMut(&Signals, f64, f64)) {
    let e = |k: i64| libm::sin(omega * k as f64 * ts);
    let delay = basis.delay() as i64;
    for k in 1..20_000_i64 {
        let z = basis.step(core::array::from_fn(|j| e(k - delay - j as i64)));
        if k > 15_000 {
            let (sin, cos) = libm::sincos(omega * k as f64 * ts);
            of(&z, sin, cos);
        }
    }
}

#[test]
fn filter_output_matches_the_frequency_response() {
    let ts = 0.01;
    let mut basis = Basis::new(point(), ts).unwrap();
    let omega = 3.0;
    let h = basis.response(omega, point());
    let twin = basis.clone();
    let mut largest: f64 = 0.0;
    responses_of_signals(&mut basis, omega, ts, &mut |z, sin, cos| {
        let x = twin.regressors(z).x;
        for i in 0..GAIN_COUNT {
            largest = largest.max((x[i] - (h[i][0] * sin + h[i][1] * cos)).abs());
        }
    });
    // The nearest aliases are at 2 pi/Ts -+ omega: each has (omega Ts/2 pi)^2 = 2.3e-5 of the response of the hold, of
    // which the poles transmit .07 for s^2 at 3 rad/s. These two contribute 3.2e-6, the others a fifth of this.
    assert!(largest < 4e-6, "{largest}");
}

#[test]
fn derivatives_agree_with_finite_differences() {
    let (ts, omega, step) = (0.01, 4.0, 1e-5);
    let mut basis = Basis::new(point(), ts).unwrap();
    let twin = basis.clone();
    let by: Vec<[Complex; GAIN_COUNT]> = [[step, 0.0, 0.0], [0.0, step, 0.0], [0.0, 0.0, step]]
        .map(|c| {
            let [up, down] = [1.0, -1.0].map(|sign| twin.response(omega, point().moved(c.map(|c| sign * c))));
            core::array::from_fn(|i| core::array::from_fn(|k| (up[i][k] - down[i][k]) / (2.0 * step)))
        })
        .to_vec();
    let mut largest: f64 = 0.0;
    responses_of_signals(&mut basis, omega, ts, &mut |z, sin, cos| {
        let r = twin.regressors(z);
        for (found, expected) in r.by.iter().zip(&by) {
            for i in 0..GAIN_COUNT {
                let size = libm::hypot(expected[i][0], expected[i][1]);
                largest = largest.max((found[i] - (expected[i][0] * sin + expected[i][1] * cos)).abs() / size);
            }
        }
    });
    // z_5 uses the delayed error interpolated linearly between samples, with an error of at most (omega Ts)^2/8 = 2e-4;
    // the other signals that are subtracted from it contribute as much again.
    assert!(largest < 4e-4, "{largest}");
}

#[test]
fn weights_match_the_regressors() {
    let basis = Basis::new(point(), 0.01).unwrap();
    let (gains, corrections) = ([1.2, -0.7, 0.4], [1.5, -0.04, 0.02]);
    let z: Signals = [0.3, -1.1, 0.7, 2.0, -5.0, 11.0];
    let r = basis.regressors(&z);
    let expected: f64 = (0..GAIN_COUNT)
        .map(|i| {
            let corrected: f64 = (0..DYNAMICS_COUNT).map(|j| corrections[j] * r.by[j][i]).sum();
            gains[i] * (r.x[i] + corrected)
        })
        .sum();
    let found: f64 = basis
        .weights(&gains, &corrections)
        .iter()
        .zip(z)
        .map(|(w, z)| w * z)
        .sum();
    assert!((found - expected).abs() < 1e-9 * expected.abs(), "{found} {expected}");
}

#[test]
fn moved_basis_converges_to_a_basis_at_the_new_point() {
    let ts = 0.01;
    let there = Point {
        tau: 0.231,
        omega: 13.0,
        zeta: 0.3,
        ..point()
    };
    let (mut here, mut always) = (Basis::new(point(), ts).unwrap(), Basis::new(point(), ts).unwrap());
    always.point = there;
    always.discretise();
    let e = |k: i64| libm::sin(0.013 * k as f64) + libm::sin(0.031 * k as f64) + 0.2;
    let errors = |basis: &Basis, k: i64| core::array::from_fn(|j| e(k - basis.delay() as i64 - j as i64));
    let mut moved = None;
    let (mut largest, mut size): (f64, f64) = (0.0, 0.0);
    for k in 0..4000_i64 {
        let of_here = errors(&here, k);
        here.step(of_here);
        if k == 3000 {
            moved = here.moved(there, here.delayed([of_here[0], of_here[1]]));
        }
        let expected = always.step(errors(&always, k));
        if let Some(moved) = moved.as_mut().filter(|_| k > 3000) {
            let z = moved.step(errors(moved, k));
            if k > 3400 {
                let (a, b) = (always.regressors(&z), always.regressors(&expected));
                for i in 0..GAIN_COUNT {
                    largest = largest.max((a.x[i] - b.x[i]).abs());
                    size = size.max(b.x[i].abs());
                }
            }
        }
    }
    // The remaining difference is the second-order effect of the change in the delay on the slow mode.
    assert!(largest < 1e-4 * size, "{largest} of {size}");
    assert!(here.moved(Point { omega: -1.0, ..there }, 0.0).is_none());
    assert!(here.moved(Point { lag: 2.0, ..there }, 0.0).is_none());
}

#[test]
fn gain_with_lead_is_in_the_span() {
    let basis = Basis::new(point(), 0.01).unwrap();
    // (K_e + K_e_dot s)(s + a).
    let (k_e, k_e_dot) = (0.09, 0.07);
    let raw = [k_e / 3.0, k_e_dot / 3.0 + k_e, k_e_dot];
    let map = basis.gain_and_lead_matrix(&[1.0, 2.0, 4.0]);
    for (row, expected) in map.iter().zip([k_e, k_e_dot]) {
        let found: f64 = (0..GAIN_COUNT)
            .map(|i| row[i] * raw[i] / basis.scale_factors()[i])
            .sum();
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
}

#[test]
fn basis_is_continuous_in_the_delay_and_refuses_invalid_points() {
    let run = |tau: f64| {
        let mut basis = Basis::new(Point { tau, ..point() }, 0.01).unwrap();
        let e = |k: i64| libm::sin(0.07 * k as f64);
        let mut last = [0.0; SIGNAL_COUNT];
        for k in 0..500_i64 {
            let delay = basis.delay() as i64;
            last = basis.step(core::array::from_fn(|j| e(k - delay - j as i64)));
        }
        basis.regressors(&last).x
    };
    for (a, b) in run(0.21 - 1e-10).iter().zip(run(0.21 + 1e-10)) {
        assert!((a - b).abs() < 1e-7);
    }
    let bad: Vec<Point> = [
        Point { tau: -0.1, ..point() },
        Point { omega: 0.0, ..point() },
        Point {
            zeta: f64::NAN,
            ..point()
        },
        Point {
            lag: f64::INFINITY,
            ..point()
        },
    ]
    .to_vec();
    assert!(bad.into_iter().all(|p| Basis::new(p, 0.01).is_none()));
    assert!(Basis::new(point(), 0.0).is_none());
    let mut still = Basis::new(point(), 0.01).unwrap();
    assert_eq!(still.step([0.0; 3]), [0.0; SIGNAL_COUNT]);
}
