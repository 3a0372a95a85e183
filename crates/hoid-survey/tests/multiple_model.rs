//! The bank of hypotheses: its filters, one hypothesis compared with least squares, changes, faulty signals.
#![allow(clippy::unwrap_used)]

#[path = "../../hoid-core/tests/common/mod.rs"]
mod common;
#[path = "common/operator.rs"]
mod operator;

use common::Noise;
use hoid_core::{innovation_variance::InnovationVariance, zoh_operator::zoh_operator};
use hoid_survey::kernel::multiple_model::{
    MultipleModelFilter,
    hypothesis::Hypothesis,
    prior::{ChangePrior, DelayPrior},
    response::Response,
};
use operator::{S1, TS, diagonal};

const S2: [f64; 4] = [0.07, 0.084, 11.25, 0.35];

fn known_delay_prior() -> ChangePrior {
    operator::prior_with_delay(DelayPrior::KNOWN_DELAY)
}

/// A prior of an operator that never changes.
fn steady_prior() -> ChangePrior {
    ChangePrior {
        birth_interval: u32::MAX,
        hazard: 1e-12,
        gain_drift: 0.0,
        outlier_limit: f64::INFINITY,
        ..known_delay_prior()
    }
}

const WIDE_COVARIANCE: [f64; 4] = [1e-4, 1e-4, 0.5, 1e-3];

fn bank(
    eta: [f64; 4],
    spread: [f64; 4],
    level: InnovationVariance,
    d: &[f64],
    s: ChangePrior,
) -> MultipleModelFilter<8, 4> {
    let first = Hypothesis::new(eta, &diagonal(spread), level).unwrap();
    MultipleModelFilter::new(first, d, s).unwrap()
}

fn innovation_variance(deviation: f64) -> InnovationVariance {
    InnovationVariance::new(deviation * deviation, 2000.0, 1.0 - 1.0 / 2000.0)
}

/// Delayed error and control of an operator with AR(1) noise, whose gains act at the output and are given by `eta` at
/// each sample.
fn simulate_operator(samples: usize, seed: u64, deviation: f64, eta: impl Fn(usize) -> [f64; 4]) -> Vec<(f64, f64)> {
    simulate_with_noise(samples, seed, |_| deviation, eta)
}

fn simulate_with_noise(
    samples: usize,
    seed: u64,
    deviation: impl Fn(usize) -> f64,
    eta: impl Fn(usize) -> [f64; 4],
) -> Vec<(f64, f64)> {
    let mut noise = Noise(seed);
    let mut response = Response::new([S1[2], S1[3]], TS);
    let (mut slow, mut fast, mut n) = (0.0, 0.0, 0.0);
    (0..samples)
        .map(|k| {
            slow = 0.98 * slow + 0.3 * noise.next();
            fast = 0.9 * fast + 0.3 * noise.next();
            let x = slow + fast;
            let signals = response.step(x);
            n = 0.85 * n + deviation(k) * noise.next();
            let [k_e, k_e_dot, ..] = eta(k);
            (x, k_e * signals[0] + k_e_dot * signals[1] + n)
        })
        .collect()
}

#[test]
fn responses_and_derivatives_match_the_held_operator() {
    let at = |eta: [f64; 4]| {
        let mut noise = Noise(5);
        let mut response = Response::new([eta[2], eta[3]], TS);
        let ([b0, b1, f1, f2], _) = zoh_operator(eta, TS);
        let (mut w, mut before) = ([0.0; 2], 0.0);
        let mut largest: f64 = 0.0;
        let mut last = [0.0; 6];
        for _ in 0..500 {
            let x = noise.next();
            last = response.step(x);
            let direct = b0 * x + b1 * before - f1 * w[0] - f2 * w[1];
            (before, w) = (x, [direct, w[0]]);
            largest = largest.max((eta[0] * last[0] + eta[1] * last[1] - direct).abs());
        }
        (last, largest)
    };
    let (signals, difference) = at(S1);
    // The tolerance allows for rounding of sums of about 25 terms of size 0.1.
    assert!(difference < 1e-13, "{difference}");
    for (parameter, step) in [(2, 1e-4), (3, 1e-6)] {
        let shifted = |sign: f64| {
            let mut eta = S1;
            eta[parameter] += sign * step;
            at(eta).0
        };
        let (high, low) = (shifted(1.0), shifted(-1.0));
        for gain in 0..2 {
            let by_difference = (high[gain] - low[gain]) / (2.0 * step);
            let derivative = signals[2 * (parameter - 1) + gain];
            assert!(
                (derivative - by_difference).abs() < 1e-6 * (1.0 + derivative.abs()),
                "{parameter} {gain}"
            );
        }
    }
}

#[test]
fn moved_linearisation_point_updates_past_states() {
    // After a move, the states of the filters differ only to second order from those of filters with this linearisation
    // point from the start.
    let error = |step: f64| {
        let mut noise = Noise(9);
        let (mut moved, mut there) = (
            Response::new([11.0, 0.35], TS),
            Response::new([11.0 + step, 0.35 + step / 30.0], TS),
        );
        let mut last = [[0.0; 6]; 1];
        for _ in 0..400 {
            let x = noise.next();
            last[0] = moved.step(x);
            there.step(x);
        }
        moved.move_to(there.point(), &mut last);
        let (a, b) = (moved.step(0.0), there.step(0.0));
        (a[0] - b[0]).abs().max((a[1] - b[1]).abs() / 10.0)
    };
    let ratio = error(0.4) / error(0.2);
    assert!((3.3..4.7).contains(&ratio), "{ratio}");
}

#[test]
fn one_hypothesis_is_weighted_least_squares() {
    let d = [-0.85];
    let data = simulate_operator(3000, 3, 0.02, |_| S1);
    let prior = [1e-4, 1e-4];
    // With many prior residuals sigma^2 stays constant.
    let sigma2 = 4e-4;
    let fixed = InnovationVariance::new(sigma2, 1e30, 1.0);
    let mut bank = bank(
        [0.05, 0.05, S1[2], S1[3]],
        [prior[0], prior[1], 0.0, 0.0],
        fixed,
        &d,
        steady_prior(),
    );
    let mut response = Response::new([S1[2], S1[3]], TS);
    let (mut r, mut y) = ([[0.0; 2]; 2], 0.0);
    // These are the normal equations of the prior and the whitened data.
    let mut matrix = [[1.0 / prior[0], 0.0], [0.0, 1.0 / prior[1]]];
    let mut right = [0.05 / prior[0], 0.05 / prior[1]];
    for &(x, u) in &data {
        bank.step(x, u);
        let s = response.step(x);
        r = [[s[0], s[1]], r[0]];
        let psi = [r[0][0] + d[0] * r[1][0], r[0][1] + d[0] * r[1][1]];
        let target = u + d[0] * y;
        y = u;
        for i in 0..2 {
            for j in 0..2 {
                matrix[i][j] += psi[i] * psi[j] / sigma2;
            }
            right[i] += psi[i] * target / sigma2;
        }
    }
    let determinant = matrix[0][0] * matrix[1][1] - matrix[0][1] * matrix[1][0];
    let solution = [
        (matrix[1][1] * right[0] - matrix[0][1] * right[1]) / determinant,
        (matrix[0][0] * right[1] - matrix[1][0] * right[0]) / determinant,
    ];
    let covariance = bank.bank().covariance();
    for i in 0..2 {
        let eta = bank.bank().mixture().eta[i];
        assert!((eta / solution[i] - 1.0).abs() < 1e-9, "{i}: {eta} {}", solution[i]);
        let variance = matrix[1 - i][1 - i] / determinant;
        assert!((covariance[i][i] / variance - 1.0).abs() < 1e-9);
    }
    assert_eq!(bank.bank().mixture().eta[2], S1[2]);
    assert_eq!(bank.bank().hypotheses().count(), 1);
}

#[test]
fn neuromuscular_system_converges_from_25_percent_off() {
    let data = simulate_operator(20_000, 8, 0.002, |_| S1);
    let start = [0.1, 0.03, 14.0, 0.45];
    let mut bank = bank(
        start,
        [1e-3, 1e-3, 10.0, 0.02],
        innovation_variance(0.002),
        &[-0.85],
        steady_prior(),
    );
    for &(x, u) in &data {
        bank.step(x, u);
    }
    let covariance = bank.bank().covariance();
    for i in 0..4 {
        let error = bank.bank().mixture().eta[i] - S1[i];
        // The tolerance is five standard errors plus one hundredth, for the linearisation error at the distant start.
        let allowed = 5.0 * covariance[i][i].sqrt() + 0.01 * S1[i];
        assert!(error.abs() < allowed, "{i}: {error} {allowed}");
    }
}

#[test]
fn change_is_declared_once_with_time_and_gains() {
    let change_at = 6000;
    let data = simulate_operator(10_000, 21, 0.02, |k| if k < change_at { S1 } else { S2 });
    let mut bank = bank(
        S1,
        WIDE_COVARIANCE,
        innovation_variance(0.02),
        &[-0.85],
        known_delay_prior(),
    );
    let mut declared = Vec::new();
    for (k, &(x, u)) in data.iter().enumerate() {
        bank.step(x, u);
        let total: f64 = bank.bank().hypotheses().map(|h| h.probability).sum();
        assert!((total - 1.0).abs() < 1e-12);
        declared.extend(bank.bank().change().map(|c| (k, c)));
    }
    assert_eq!(declared.len(), 1, "{declared:?}");
    let (k, change) = declared[0];
    assert!((change_at..change_at + 150).contains(&k), "{k}");
    // The change is dated to the birth before or after it.
    let since = k as f64 - change.samples_ago as f64;
    assert!((since - change_at as f64).abs() <= 64.0, "{since}");
    assert!(change.log_odds > 4.0 && change.z[1] > 2.0, "{change:?}");
    assert!((change.before.eta[1] - S1[1]).abs() < 0.01);
    let covariance = bank.bank().covariance();
    for i in 0..2 {
        let error = bank.bank().mixture().eta[i] - S2[i];
        assert!(error.abs() < 4.0 * covariance[i][i].sqrt(), "{i}: {error}");
    }
}

#[test]
fn a_steady_operator_raises_no_alarm_and_memory_grows() {
    // The run lasts ten minutes.
    let data = simulate_operator(60_000, 33, 0.02, |_| S1);
    let mut bank = bank(
        S1,
        WIDE_COVARIANCE,
        innovation_variance(0.02),
        &[-0.85],
        known_delay_prior(),
    );
    for &(x, u) in &data {
        bank.step(x, u);
        assert!(bank.bank().change().is_none());
    }
    assert!(
        bank.bank()
            .hypotheses()
            .any(|h| h.birth_sample == 0 && h.probability > 0.5)
    );
}

#[test]
fn change_of_remnant_variance_is_declared() {
    let data = simulate_with_noise(8000, 2, |k| if k < 4000 { 0.02 } else { 0.06 }, |_| S1);
    let mut bank = bank(
        S1,
        WIDE_COVARIANCE,
        innovation_variance(0.02),
        &[-0.85],
        known_delay_prior(),
    );
    let mut declared = Vec::new();
    for (k, &(x, u)) in data.iter().enumerate() {
        bank.step(x, u);
        declared.extend(bank.bank().change().map(|c| (k, c)));
    }
    let (k, change) = declared[0];
    assert!((4000..4150).contains(&k), "{k}");
    assert!(change.z[4] > 2.0 && change.z[0].abs() < 3.0, "{change:?}");
}

#[test]
fn outliers_are_not_declared_as_changes() {
    let mut data = simulate_operator(8000, 12, 0.02, |_| S1);
    for k in (500..8000).step_by(700) {
        data[k].1 += 5.0;
    }
    let mut bank = bank(
        S1,
        WIDE_COVARIANCE,
        innovation_variance(0.02),
        &[-0.85],
        known_delay_prior(),
    );
    for &(x, u) in &data {
        bank.step(x, u);
        assert!(bank.bank().change().is_none());
    }
    let covariance = bank.bank().covariance();
    for i in 0..4 {
        let error = bank.bank().mixture().eta[i] - S1[i];
        assert!(error.abs() < 4.0 * covariance[i][i].sqrt(), "{i}: {error}");
    }
}

#[test]
fn extreme_signals_leave_everything_finite() {
    let data = simulate_operator(2000, 4, 0.02, |_| S1);
    let mut bank = bank(
        S1,
        WIDE_COVARIANCE,
        innovation_variance(0.02),
        &[-1.6, 0.7],
        known_delay_prior(),
    );
    let finite = |bank: &mut MultipleModelFilter<8, 4>, x: f64, u: f64| {
        bank.step(x, u);
        assert!(bank.bank().mixture().eta.iter().all(|e| e.is_finite()));
        assert!(bank.bank().covariance().iter().flatten().all(|c| c.is_finite()));
        assert!(bank.bank().mixture().variance.is_finite() && bank.bank().log_odds().is_finite());
        assert!(bank.bank().hypotheses().all(Hypothesis::is_valid));
    };
    for round in 0..3 {
        for k in 0..8000 {
            let (x, u) = match (k / 2000) % 4 {
                0 => data[k % 2000],
                1 => (0.0, 0.0),
                2 => (0.7, -0.3),
                _ => (data[k % 2000].0.signum(), data[k % 2000].1.clamp(-0.01, 0.01)),
            };
            finite(&mut bank, x, u);
        }
        // The largest numbers that a caller may pass, followed by numbers that cause an internal overflow.
        finite(&mut bank, 1e6, -1e6);
        finite(&mut bank, if round == 2 { 1e308 } else { 0.0 }, 1e308);
        finite(&mut bank, -1e308, -1e308);
        bank.bridge(0.1);
        bank.step_without_update(0.1, 0.1);
    }
    assert!(bank.restarts() > 0);
}

#[test]
fn gap_in_the_output_is_bridged() {
    let data = simulate_operator(9000, 14, 0.02, |_| S1);
    let mut bank = bank(
        S1,
        WIDE_COVARIANCE,
        innovation_variance(0.02),
        &[-0.85],
        known_delay_prior(),
    );
    for (k, &(x, u)) in data.iter().enumerate() {
        if (3000..3050).contains(&k) || k % 97 == 0 {
            bank.bridge(x);
        } else {
            bank.step(x, u);
            assert!(bank.bank().change().is_none(), "{k}");
        }
    }
    let covariance = bank.bank().covariance();
    for i in 0..4 {
        let error = bank.bank().mixture().eta[i] - S1[i];
        assert!(error.abs() < 4.0 * covariance[i][i].sqrt(), "{i}: {error}");
    }
}

#[test]
fn t_l_stays_finite_as_k_e_becomes_zero() {
    let data = simulate_operator(3000, 6, 0.02, |_| [0.0, 0.05, S1[2], S1[3]]);
    let mut bank = bank(
        [0.0, 0.05, S1[2], S1[3]],
        WIDE_COVARIANCE,
        innovation_variance(0.02),
        &[-0.85],
        known_delay_prior(),
    );
    for &(x, u) in &data {
        bank.step(x, u);
        let covariance = bank.bank().covariance();
        let [lead, variance] = bank.bank().lead_time(&covariance);
        // Because |E[xy]| <= sqrt(E[x^2] E[y^2]), |T| <= sqrt(E[y^2]/E[x^2]).
        let largest = ((0.06_f64.powi(2) + covariance[1][1]) / covariance[0][0]).sqrt();
        assert!(lead.abs() < largest && variance.is_finite(), "{lead} {largest}");
    }
}

#[test]
fn invalid_starts_are_refused() {
    let first = |eta| Hypothesis::new(eta, &diagonal(WIDE_COVARIANCE), innovation_variance(0.02)).unwrap();
    let new = |eta, d: &[f64], s| MultipleModelFilter::<8, 4>::new(first(eta), d, s);
    assert!(new(S1, &[-0.85], known_delay_prior()).is_some());
    assert!(new(S1, &[0.0; 5], known_delay_prior()).is_none());
    assert!(new([0.09, 0.036, 200.0, 0.35], &[], known_delay_prior()).is_none());
    assert!(new([f64::NAN, 0.036, 11.0, 0.35], &[], known_delay_prior()).is_none());
    assert!(MultipleModelFilter::<1, 4>::new(first(S1), &[], known_delay_prior()).is_none());
    for wrong in [
        ChangePrior {
            birth_interval: 0,
            ..known_delay_prior()
        },
        ChangePrior {
            hazard: 0.1,
            ..known_delay_prior()
        },
        ChangePrior {
            sample_time: 0.0,
            ..known_delay_prior()
        },
    ] {
        assert!(new(S1, &[], wrong).is_none(), "{wrong:?}");
    }
    let negative = diagonal([1e-4, -1e-4, 0.5, 1e-3]);
    assert!(Hypothesis::new(S1, &negative, innovation_variance(0.02)).is_none());
}

#[test]
fn change_of_the_neuromuscular_system_is_tracked() {
    let slower = [S1[0], S1[1], 9.0, 0.45];
    let at = 4500;
    let mut noise = Noise(17);
    let (mut slow, mut fast, mut n) = (0.0, 0.0, 0.0);
    let (mut before, mut w) = (0.0, [0.0; 2]);
    let first = Hypothesis::new(S1, &diagonal(WIDE_COVARIANCE), innovation_variance(0.003)).unwrap();
    let mut bank: MultipleModelFilter<16, 4> = MultipleModelFilter::new(first, &[-0.85], known_delay_prior()).unwrap();
    let mut changes = Vec::new();
    for k in 0..9000 {
        let ([b0, b1, f1, f2], _) = zoh_operator(if k < at { S1 } else { slower }, TS);
        slow = 0.98 * slow + 0.3 * noise.next();
        fast = 0.9 * fast + 0.3 * noise.next();
        let x = slow + fast;
        w = [b0 * x + b1 * before - f1 * w[0] - f2 * w[1], w[0]];
        before = x;
        n = 0.85 * n + 0.003 * noise.next();
        bank.step(x, w[0] + n);
        if let Some(change) = bank.bank().change() {
            assert!((at..at + 500).contains(&k), "{k}");
            changes.push(change.z);
        }
    }
    assert!(!changes.is_empty() && changes.len() <= 3, "{changes:?}");
    assert!(changes.iter().any(|z| z[2] < -2.0), "{changes:?}");
    let (found, covariance) = (bank.bank().mixture().eta, bank.bank().covariance());
    for i in 0..4 {
        let error = found[i] - slower[i];
        // The tolerance is 3.5 standard errors, for four numbers and one seed.
        assert!(
            error.abs() < 3.5 * covariance[i][i].sqrt(),
            "{i}: {error} {}",
            covariance[i][i].sqrt()
        );
    }
    assert!((found[2] - slower[2]).abs() < 0.5, "{found:?}");
}
