//! The bank of hypotheses with an unknown delay: one delay compared with a delay line, wrong or changing delays, and
//! signals that overflow.
#![allow(clippy::unwrap_used)]

#[path = "../../hoid-core/tests/common/mod.rs"]
mod common;
#[path = "common/operator.rs"]
mod operator;

use common::Noise;
use hoid_core::innovation_variance::InnovationVariance;
use hoid_survey::kernel::multiple_model::{
    MultipleModelFilter,
    hypothesis::Hypothesis,
    prior::{ChangePrior, DelayPrior},
    response::{Response, Signals},
};
use operator::{S1, TS, diagonal, prior_with_delay};

/// Number of candidate delays.
const DELAY_COUNT: usize = 16;
const D: [f64; 1] = [-0.85];
const NOISE_DEVIATION: f64 = 0.02;

type Bank = MultipleModelFilter<48, 4, Vec<Signals>>;

const OPEN_DELAY: DelayPrior = DelayPrior {
    count: DELAY_COUNT,
    propose_every: 4,
    change_odds: 0.5,
    proposals: 8,
    jump: 5.0,
    neighbour_probability: 0.05,
    error_per_sample: [0.01, 0.03, 0.04, 0.08],
};

const INITIAL_COVARIANCE: [f64; 4] = [1e-5, 1e-5, 0.05, 1e-4];

fn first_hypothesis(spread: [f64; 4]) -> Hypothesis {
    let level = InnovationVariance::new(NOISE_DEVIATION * NOISE_DEVIATION, 2000.0, 1.0 - 1.0 / 2000.0);
    Hypothesis::new(S1, &diagonal(spread), level).unwrap()
}

fn bank(later: usize, delay: DelayPrior) -> Bank {
    MultipleModelFilter::with_delays(
        first_hypothesis(INITIAL_COVARIANCE).with_extra_delay(later),
        &D,
        prior_with_delay(delay),
        vec![[0.0; 6]; delay.count],
    )
    .unwrap()
}

/// Error and control of an operator whose delay is given at each sample, in samples, with AR(1)
/// noise.
fn simulate_operator(samples: usize, seed: u64, delay: impl Fn(usize) -> usize) -> Vec<(f64, f64)> {
    let mut noise = Noise(seed);
    let mut response = Response::new([S1[2], S1[3]], TS);
    let (mut slow, mut fast, mut n, mut w) = (0.0, 0.0, 0.0, Vec::new());
    (0..samples)
        .map(|k| {
            slow = 0.98 * slow + 0.3 * noise.next();
            fast = 0.9 * fast + 0.3 * noise.next();
            let x = slow + fast;
            let signals = response.step(x);
            w.push(S1[0] * signals[0] + S1[1] * signals[1]);
            n = -D[0] * n + NOISE_DEVIATION * noise.next();
            (x, n + k.checked_sub(delay(k)).map_or(0.0, |past| w[past]))
        })
        .collect()
}

#[test]
fn known_delay_acts_as_a_delay_line() {
    // omega_nm and zeta_nm are known, so the linearisation point stays constant. When this point moves, signals that
    // are still in the delay line differ to second order.
    let prior_of = |delay| ChangePrior {
        neuromuscular_every: 0,
        ..prior_with_delay(delay)
    };
    let first = first_hypothesis([1e-5, 1e-5, 0.0, 0.0]);
    let silent = DelayPrior {
        propose_every: u32::MAX,
        neighbour_probability: 0.0,
        ..OPEN_DELAY
    };
    let memory = vec![[0.0; 6]; DELAY_COUNT];
    let mut one: Bank =
        MultipleModelFilter::with_delays(first.with_extra_delay(5), &D, prior_of(silent), memory).unwrap();
    let mut other: MultipleModelFilter<48, 4> =
        MultipleModelFilter::new(first, &D, prior_of(DelayPrior::KNOWN_DELAY)).unwrap();
    let data = simulate_operator(4000, 3, |k| if k < 2000 { 5 } else { 6 });
    for (k, &(x, u)) in data.iter().enumerate() {
        let delayed = k.checked_sub(5).map_or(0.0, |past| data[past].0);
        // Rounding errors may differ, because the two filters are compiled separately.
        let (a, b) = (one.step(x, u).innovation, other.step(delayed, u).innovation);
        assert!((a - b).abs() < 1e-9, "{k}: {a} {b}");
    }
    for (a, b) in one.bank().mixture().eta.iter().zip(other.bank().mixture().eta) {
        assert!((a / b - 1.0).abs() < 1e-6);
    }
    assert_eq!(one.bank().delay(), [5.0, 1.0 / 12.0]);
}

#[test]
fn change_of_delay_is_found_and_named() {
    for (seed, from, to) in [(11, 4, 10), (12, 10, 5), (13, 2, 4)] {
        let data = simulate_operator(10_000, seed, |k| if k < 6000 { from } else { to });
        let mut bank = bank(from, OPEN_DELAY);
        let mut declared = Vec::new();
        for (k, &(x, u)) in data.iter().enumerate() {
            bank.step(x, u);
            let total: f64 = bank.bank().hypotheses().map(|h| h.probability).sum();
            assert!((total - 1.0).abs() < 1e-12);
            declared.extend(bank.bank().change().map(|c| (k, c)));
        }
        // The change is declared after two births of other delays; a second declaration may identify the changed
        // parameters better.
        let (k, change) = declared[0];
        assert!((6000..6300).contains(&k), "{seed}: {k} {change:?}");
        let last = declared[declared.len() - 1].1;
        assert!(last.z[5].abs() > 2.0, "{seed}: {last:?}");
        let [mean, variance] = bank.bank().delay();
        assert!(
            (mean - to as f64).abs() < 0.5 && variance < 0.3,
            "{seed}: {mean} {variance}"
        );
        let covariance = bank.bank().covariance();
        for i in 0..4 {
            let error = bank.bank().mixture().eta[i] - S1[i];
            assert!(error.abs() < 4.0 * covariance[i][i].sqrt(), "{seed} {i}: {error}");
        }
    }
}

#[test]
fn wrong_initial_delay_is_corrected_without_an_alarm() {
    for (seed, wrong) in [(5, 7), (6, 9)] {
        let data = simulate_operator(6000, seed, |_| 8);
        let mut bank = bank(wrong, OPEN_DELAY);
        for (k, &(x, u)) in data.iter().enumerate() {
            bank.step(x, u);
            assert!(bank.bank().change().is_none(), "{seed}: {k}");
        }
        assert!((bank.bank().delay()[0] - 8.0).abs() < 0.5);
    }
}

#[test]
fn a_steady_operator_raises_no_alarm() {
    // The run lasts ten minutes.
    let data = simulate_operator(60_000, 34, |_| 8);
    let mut bank = bank(8, OPEN_DELAY);
    for &(x, u) in &data {
        bank.step(x, u);
        assert!(bank.bank().change().is_none());
    }
    assert!(
        bank.bank()
            .hypotheses()
            .any(|h| h.birth_sample == 0 && h.extra_delay == 8 && h.probability > 0.5)
    );
}

#[test]
fn extreme_signals_stay_finite_and_bad_memory_is_refused() {
    let mut bank = bank(8, OPEN_DELAY);
    for (k, (x, u)) in simulate_operator(3000, 7, |_| 8).into_iter().enumerate() {
        match k {
            500 => _ = bank.step(1e200, u),
            800 => _ = bank.step(x, -1e200),
            1000..2000 => _ = bank.step(0.0, 0.0),
            2100..2200 => bank.bridge(x),
            2200..2300 => _ = bank.step_without_update(x, u),
            _ => _ = bank.step(x, u),
        }
        assert!(bank.bank().hypotheses().all(Hypothesis::is_valid), "{k}");
        assert!(bank.bank().delay().iter().all(|d| d.is_finite()));
    }
    let with = |delay: DelayPrior, memory: usize| {
        Bank::with_delays(
            first_hypothesis(INITIAL_COVARIANCE),
            &D,
            prior_with_delay(delay),
            vec![[0.0; 6]; memory],
        )
        .is_some()
    };
    assert!(with(OPEN_DELAY, DELAY_COUNT));
    assert!(!with(OPEN_DELAY, DELAY_COUNT - 1) && !with(OPEN_DELAY, 0));
    assert!(!with(DelayPrior { count: 0, ..OPEN_DELAY }, 0));
    assert!(
        !with(
            DelayPrior {
                proposals: 0,
                ..OPEN_DELAY
            },
            DELAY_COUNT
        ) && !with(
            DelayPrior {
                propose_every: 0,
                ..OPEN_DELAY
            },
            DELAY_COUNT
        )
    );
    assert!(!with(
        DelayPrior {
            neighbour_probability: f64::NAN,
            ..OPEN_DELAY
        },
        DELAY_COUNT
    ));
}
