use std::f64::consts::PI;

use num_complex::Complex64;

use super::closed_loop::CharacteristicFunction;
use super::*;
use crate::{ContinuousTransferFunction, DiscreteTransferFunction, SampleTime, polynomial, scenario::OperatingState};

fn tf(num: &[f64], den: &[f64]) -> ContinuousTransferFunction {
    ContinuousTransferFunction::new(num, den).unwrap()
}

fn delayed_transfer_function(num: &[f64], den: &[f64], delay_s: f64) -> ContinuousTransferFunction {
    tf(num, den).with_delay(delay_s).unwrap()
}

fn scaled(h: &ContinuousTransferFunction, gain: f64) -> ContinuousTransferFunction {
    h.series(&tf(&[gain], &[1.0]))
}

fn open_loop(state: OperatingState) -> ContinuousTransferFunction {
    let element = state.controlled_element.transfer_function().unwrap();
    state.operator.transfer_function().unwrap().series(&element)
}

fn s1() -> ContinuousTransferFunction {
    open_loop(OperatingState::s1())
}

fn s2() -> ContinuousTransferFunction {
    open_loop(OperatingState::s2())
}

fn continuous_margins(h: &ContinuousTransferFunction) -> Margins {
    margins(|w| h.response(w), MANUAL_CONTROL_RANGE_RAD_S)
}

fn assert_margins(found: Margins, expected: [(f64, f64); 4]) {
    let found = [
        found.crossover_rad_s,
        found.phase_margin_deg,
        found.phase_crossover_rad_s,
        found.gain_margin_db,
    ];
    for (found, (expected, tolerance)) in found.iter().zip(expected) {
        let found = found.unwrap();
        assert!((found - expected).abs() <= tolerance, "{found} and {expected}");
    }
}

#[test]
fn reference_states_match_scipy() {
    // Computed by scipy.optimize.brentq on |L| - 1 and on Im L. The printed expected values agree, with fewer digits
    // (their 5.52 rad/s is 5.525, truncated).
    let tolerance = 1e-9;
    let expected = |values: [f64; 4]| values.map(|v| (v, tolerance));
    let first = [
        1.5634851408630523,
        76.66834431239965,
        5.525188773275959,
        5.623557013781441,
    ];
    let second = [
        2.7479645785248255,
        22.901743526385303,
        4.0542340213785195,
        3.1031729189944683,
    ];
    assert_margins(continuous_margins(&s1()), expected(first));
    assert_margins(continuous_margins(&s2()), expected(second));
}

#[test]
fn crossover_model_margins_match_closed_form() {
    // K e^{-s tau}/s has omega_c = K, the phase margin 90 deg - K tau and the phase crossover pi/(2 tau).
    for (k, tau) in [(1.0, 0.3), (3.0, 0.2), (0.05, 12.0), (2.0, 0.785)] {
        let h = delayed_transfer_function(&[k], &[1.0, 0.0], tau);
        let phase_crossover = PI / (2.0 * tau);
        assert_margins(
            continuous_margins(&h),
            [
                (k, 1e-12 * k),
                (90.0 - (k * tau).to_degrees(), 1e-9),
                (phase_crossover, 1e-12 * phase_crossover),
                (20.0 * (phase_crossover / k).log10(), 1e-9),
            ],
        );
    }
}

#[test]
fn margins_nearest_to_zero_are_selected() {
    // e^{-0.1 s}/s with a lightly damped mode at 9 rad/s crosses gain one at 1.013, 8.482 and 9.428 rad/s with phase
    // margins of 83.94, 22.75 and -120.7 deg, and the negative real axis at 8.786 and 47.2 rad/s with -5.392 and 61.95
    // dB. These values were computed with numpy at two million frequencies; `stability_margins` of python-control
    // 0.10.2 selects the same two margins.
    let h = delayed_transfer_function(&[1.0], &[1.0, 0.0], 0.1).series(&tf(&[81.0], &[1.0, 0.36, 81.0]));
    assert_margins(
        continuous_margins(&h),
        [(8.48246, 3e-5), (22.749, 1e-3), (8.78549, 3e-5), (-5.3923, 1e-3)],
    );
    assert!(!closed_loop_is_stable(&h));
}

#[test]
fn fast_phase_rotation_is_tracked() {
    // |L| rises towards 0.9, so the phase crossover nearest to the end of the range determines the gain margin. Over
    // the last step of the grid, from 977.2 to 1000 rad/s, the delay turns the phase by exactly four revolutions, which
    // the phases at the ends of the step do not show.
    let tau = 4.0 * 2.0 * PI / (1000.0 * -(-0.01 * 10f64.ln()).exp_m1());
    let h = delayed_transfer_function(&[0.9, 0.0], &[1.0, 500.0], tau);
    let found = continuous_margins(&h);
    let omega = found.phase_crossover_rad_s.unwrap();
    assert!(omega > 1000.0 - 2.0 * PI / tau, "{omega}");
    assert!(h.response(omega).im.abs() < 1e-12 && h.response(omega).re < 0.0);
    assert_eq!(found.crossover_rad_s, None);
}

#[test]
fn discrete_phase_crossover_at_nyquist_is_found() {
    // L = k/(z + 0.5): at z = -1, L = -2 k; with k = 0.2 the gain margin is 1/0.4.
    let sample_time = SampleTime::new(0.1).unwrap();
    let h = DiscreteTransferFunction::new(&[0.0, 0.2], &[1.0, 0.5], sample_time).unwrap();
    let found = margins(|w| h.response(w), (1e-3, sample_time.nyquist_rad_s()));
    assert_eq!((found.crossover_rad_s, found.phase_margin_deg), (None, None));
    assert!((found.gain_margin_db.unwrap() + 20.0 * 0.4f64.log10()).abs() < 1e-9);
    assert!((found.phase_crossover_rad_s.unwrap() - sample_time.nyquist_rad_s()).abs() < 1e-6);
}

#[test]
fn invalid_range_has_no_margins() {
    let none = Margins {
        crossover_rad_s: None,
        phase_margin_deg: None,
        phase_crossover_rad_s: None,
        gain_margin_db: None,
    };
    let h = s1();
    for range in [
        (0.0, 1.0),
        (1.0, 1.0),
        (2.0, 1.0),
        (f64::NAN, 1.0),
        (1.0, f64::INFINITY),
    ] {
        assert_eq!(margins(|w| h.response(w), range), none);
    }
    assert_eq!(margins(|_| Complex64::new(f64::NAN, 0.0), (0.1, 10.0)), none);
    // The response of a double integrator lies on the negative real axis: it has no phase crossover, and its phase
    // margin is zero.
    let double = continuous_margins(&tf(&[4.0], &[1.0, 0.0, 0.0]));
    assert_eq!(double.phase_crossover_rad_s, None);
    assert!((double.crossover_rad_s.unwrap() - 2.0).abs() < 1e-12 && double.phase_margin_deg.unwrap().abs() < 1e-9);
}

#[test]
fn stability_changes_at_the_gain_margin() {
    for h in [s1(), s2()] {
        let gain = 10f64.powf(continuous_margins(&h).gain_margin_db.unwrap() / 20.0);
        assert!(closed_loop_is_stable(&h));
        for (factor, stable) in [
            (1e-6, true),
            (0.999_999, true),
            (1.000_001, false),
            (10.0, false),
            (1e4, false),
        ] {
            assert_eq!(closed_loop_is_stable(&scaled(&h, gain * factor)), stable, "{factor}");
        }
        assert!(!closed_loop_is_stable(&scaled(&h, -1.0)));
    }
}

#[test]
fn stability_with_delay_matches_closed_form() {
    // The loop with K e^{-s tau}/s is stable for K tau < pi/2.
    for tau in [1e-3, 0.28, 40.0] {
        for (product, stable) in [(1e-4, true), (1.57, true), (1.5709, false), (4.0, false), (60.0, false)] {
            assert_eq!(
                closed_loop_is_stable(&delayed_transfer_function(&[product / tau], &[1.0, 0.0], tau)),
                stable
            );
        }
    }
    // A pair of zeros enters the right half plane at each K tau = pi/2 + 2 pi k. For K tau = 5000 the phase makes many
    // revolutions within each step of the grid.
    for product in [1.5, 1.6, 60.0, 5000.0] {
        let h = delayed_transfer_function(&[product / 0.28], &[1.0, 0.0], 0.28);
        let pairs = ((product - PI / 2.0) / (2.0 * PI)).ceil().max(0.0) as usize;
        let found = CharacteristicFunction::new(&h).unwrap().zeros_in_right_half_plane();
        assert_eq!(found, Some(2 * pairs), "{product}");
    }
    // The loop with k e^{-s tau}/(s - 1) and tau = 0.5 is stable for 1 < k < sqrt(1 + w^2) with atan w = w/2 (w =
    // 2.331122370414423).
    let limit = (1.0 + 2.331122370414423f64.powi(2)).sqrt();
    for (k, stable) in [(0.9, false), (1.001, true), (limit - 1e-3, true), (limit + 1e-3, false)] {
        assert_eq!(
            closed_loop_is_stable(&delayed_transfer_function(&[k], &[1.0, -1.0], 0.5)),
            stable,
            "{k}"
        );
    }
    // With a delay in the wrong unit, the test of stability still terminates.
    assert!(!closed_loop_is_stable(&delayed_transfer_function(
        &[5.0],
        &[1.0, 0.0],
        1e9
    )));
    // With any delay, the gain at infinite frequency must be less than one.
    assert!(closed_loop_is_stable(&delayed_transfer_function(&[0.5], &[1.0], 1.0)));
    assert!(!closed_loop_is_stable(&delayed_transfer_function(&[1.5], &[1.0], 1.0)));
    assert!(closed_loop_is_stable(&delayed_transfer_function(
        &[0.6, 0.2],
        &[1.0, 2.0],
        0.7
    )));
    assert!(!closed_loop_is_stable(&delayed_transfer_function(
        &[-0.6, -2.1],
        &[1.0, 2.0],
        0.7
    )));
}

#[test]
fn stability_without_delay_agrees_with_the_roots() {
    // Pseudo-random loops of order 1 to 5. Some are biproper, some have poles at the origin.
    let mut state = 1u64;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let (mut stable, mut unstable) = (0, 0);
    for case in 0..400 {
        let order = 1 + case % 5;
        let den: Vec<f64> = (0..=order)
            .map(|k| match k {
                0 => 1.0,
                k if k == order && case % 3 == 0 => 0.0,
                k => 4.0 * (random() - 0.2) * (order - k + 1) as f64 * 3f64.powi(k as i32),
            })
            .collect();
        let degree = if case % 4 == 0 { order } else { order - 1 };
        let num: Vec<f64> = (0..=degree)
            .map(|k| 3.0 * (random() - 0.25) * 2f64.powi(k as i32))
            .collect();
        let mut sum = den.clone();
        for (k, b) in num.iter().enumerate() {
            sum[order - degree + k] += b;
        }
        let expected = polynomial::roots(&sum).unwrap().iter().all(|s| s.re < 0.0);
        assert_eq!(closed_loop_is_stable(&tf(&num, &den)), expected, "{num:?} / {den:?}");
        if expected { stable += 1 } else { unstable += 1 }
    }
    assert!(stable > 50 && unstable > 50, "{stable} {unstable}");
}

#[test]
fn marginal_and_hidden_modes_are_not_stable() {
    assert!(!closed_loop_is_stable(&tf(&[1.0], &[1.0, 0.0, 0.0])));
    assert!(closed_loop_is_stable(&tf(&[1.0, 1.0], &[1.0, 0.0, 0.0])));
    assert!(!closed_loop_is_stable(&tf(&[1.0, -1.0], &[1.0, 0.0, 0.0])));
    assert!(!closed_loop_is_stable(&tf(&[0.0], &[1.0, 0.0])));
    assert!(closed_loop_is_stable(&tf(&[0.0], &[1.0, 2.0])));
    assert!(!closed_loop_is_stable(&tf(&[-1.0], &[1.0])));
    // (s - 1)/((s - 1)(s + 2)): the unstable mode is in the loop, although it cancels in the transfer function.
    assert!(!closed_loop_is_stable(&tf(&[1.0, -1.0], &[1.0, 1.0, -2.0])));
    // Two modes within one step of the grid are detected, although together they turn the phase by whole revolutions.
    for (damping, stable) in [(1e-6, true), (-1e-6, false)] {
        let modes = polynomial::product(&[1.0, damping, 7.3], &[1.0, damping, 7.4]);
        assert_eq!(closed_loop_is_stable(&tf(&[1e-12], &modes)), stable);
    }
    // A mode with the damping coefficient 1e-6 or -1e-6 in 1/s is detected at a frequency that is not on the grid.
    for (damping, stable) in [(1e-6, true), (-1e-6, false)] {
        assert_eq!(closed_loop_is_stable(&tf(&[1e-12], &[1.0, damping, 7.3])), stable);
    }
}

/// 2.5/s after an operator with a neuromuscular resonance that lifts |L| above one again: there are three crossings,
/// and the margin nearest to zero is not at the lowest of them.
#[test]
fn all_crossings_are_found() {
    let resonance = delayed_transfer_function(&[81.0], &[1.0, 1.0, 81.0], 0.15);
    let l = resonance.series(&tf(&[2.5], &[1.0, 0.0]));
    let found = crossings(|w| l.response(w), MANUAL_CONTROL_RANGE_RAD_S);
    assert_eq!(found.gain.len(), 3, "{found:?}");
    for c in &found.gain {
        assert!((l.response(c.omega_rad_s).norm() - 1.0).abs() < 1e-9);
        assert!((-l.response(c.omega_rad_s)).arg().to_degrees() == c.margin);
    }
    assert!(found.gain[0].margin > 0.0 && found.gain[2].margin < 0.0);
    let margins = found.margins();
    let nearest = (found.gain.iter().map(|c| c.margin.abs())).fold(f64::INFINITY, f64::min);
    assert_eq!(margins.phase_margin_deg.unwrap().abs(), nearest);
    assert_eq!(
        crossings(|_| Complex64::new(f64::NAN, 0.0), MANUAL_CONTROL_RANGE_RAD_S),
        Crossings::default()
    );
}

#[test]
fn unstable_pole_counts_match_the_transfer_function() {
    let operators = [
        delayed_transfer_function(&[1.0], &[1.0], 0.2),
        delayed_transfer_function(&[81.0], &[1.0, 1.0, 81.0], 0.15),
        delayed_transfer_function(&[60.0, 81.0], &[1.0, 6.0, 81.0], 0.3),
    ];
    let elements = [
        tf(&[1.0], &[1.0, 0.0]),
        tf(&[90.0], &[1.0, 6.0, 0.0]),
        tf(&[1.0], &[1.0, 0.0, 0.0]),
        tf(&[1.0], &[1.0, -0.5]),
        tf(&[1.0, 0.3], &[1.0, 1.0, 4.0]),
    ];
    let mut counts = [0; 2];
    for operator in &operators {
        for element in &elements {
            for gain in [0.003, 0.02, 0.3, 0.8, 1.7, 4.0, 9.0, -0.4] {
                let scaled = scaled(operator, gain);
                let l = scaled.series(element);
                let Some(found) = unstable_poles(|w| scaled.response(w), element, 300.0) else {
                    // A result is missing only if |L| is still near or above 1 at 300 rad/s, as for a pure gain with a
                    // first-order element of high gain.
                    assert!(l.response(300.0).norm() > 0.5, "{gain} {operator:?} {element:?}");
                    continue;
                };
                let exact = CharacteristicFunction::new(&l)
                    .and_then(|f| f.zeros_in_right_half_plane())
                    .unwrap();
                assert_eq!(found, exact, "{gain} {operator:?} {element:?}");
                counts[usize::from(found > 0)] += 1;
            }
        }
    }
    assert!(counts[0] > 20 && counts[1] > 20, "{counts:?}");
    let integrator = &elements[0];
    assert_eq!(
        unstable_poles(|_| Complex64::new(f64::NAN, 0.0), integrator, 300.0),
        None
    );
    assert_eq!(unstable_poles(|_| Complex64::new(1e4, 0.0), integrator, 300.0), None);
    assert_eq!(unstable_poles(|_| Complex64::new(1.0, 0.0), integrator, f64::NAN), None);
}
