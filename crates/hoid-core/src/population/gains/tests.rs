#![allow(clippy::unwrap_used)]
use super::*;
use crate::population::cholesky;

fn basis() -> Basis {
    Basis::new(
        Point {
            tau: 0.2,
            omega: 11.0,
            zeta: 0.25,
            lag: 3.0,
        },
        0.01,
    )
    .unwrap()
}

fn prior() -> GainPrior {
    GainPrior {
        drifts: [0.0; DRIFTS],
        shares: [1.0, 1e-300, 1e-300],
        newborn: [0.0; 2],
        odds: 1e-300,
        births: 1e300,
        life: 1e9,
        steady: 0.0,
        freedom: 1e300,
        limit: f64::INFINITY,
        forgotten: [0.0; 2],
        held: [0.3, 0.5, 0.04],
        sample_time: 0.01,
    }
}

const AROUND: Around = Around {
    variance: 0.02,
    unit: 1.0,
    level: [0.0; 2],
};

fn wave(t: u32, by: u32) -> f64 {
    f64::from((t * t * by + 3 * t) % 101) / 50.0 - 1.0
}

fn sample(t: u32) -> (f64, Regressors) {
    let x = [wave(t, 1), wave(t, 7), wave(t, 13)];
    let by = [[0.0; GAINS]; HELD];
    let y = 1.5 * x[0] - 0.7 * x[1] + 0.2 * x[2] + 0.1 * 0.3 + 0.2 * wave(t, 29);
    (y, Regressors { x, by })
}

#[test]
fn without_drift_and_corrections_it_is_weighted_least_squares() {
    let basis = basis();
    let mut gains = Gains::new(prior(), &basis).unwrap();
    gains.begin(2.0, 0.5);
    // The form that leaves everything open: (sum r r'/sigma^2 + P_0^-1) s = sum r y/sigma^2, with a
    // variance that changes.
    let (mut a, mut b) = ([[0.0; LINEAR]; LINEAR], [0.0; LINEAR]);
    for (i, row) in a.iter_mut().enumerate() {
        row[i] = if i < GAINS { 0.25 } else { 4.0 };
    }
    for t in 0..300 {
        let (y, regressors) = sample(t);
        let around = Around {
            variance: if t < 150 { 0.02 } else { 0.1 },
            ..AROUND
        };
        gains.update(y, &regressors, 0.3, basis.point(), &around);
        let r = [regressors.x[0], regressors.x[1], regressors.x[2], 0.3];
        for i in 0..LINEAR {
            b[i] += r[i] * y / around.variance;
            for j in 0..LINEAR {
                a[i][j] += r[i] * r[j] / around.variance;
            }
        }
    }
    assert!(cholesky::factor(&mut a, LINEAR));
    cholesky::solve(&a, LINEAR, &mut b);
    let free = &gains.filters[0];
    let state = free.state_of(0);
    for i in 0..LINEAR {
        assert!((state[i] - b[i]).abs() < 1e-9, "{i}");
        let mut column = [0.0; LINEAR];
        column[i] = 1.0;
        cholesky::solve(&a, LINEAR, &mut column);
        for (j, c) in column.iter().enumerate() {
            assert!((free.covariance_of(0, i, j) - c).abs() < 1e-9 * column[i].abs());
        }
    }
    // Those are not the gains of a gain with a lead, and the weights say so.
    assert!(gains.probability(0) > 0.999 && gains.probability(FORMS) == 0.0);
    for (mean, free) in gains.state().iter().zip(state) {
        assert!((mean - free).abs() < 1e-3 * free.abs().max(0.1));
    }
}

/// K_e = .5, K_e_dot = .4: theta = [K_e a, K_e + K_e_dot a, K_e_dot] over the scale.
fn lead(basis: &Basis) -> [f64; GAINS] {
    let raw = [0.5 / 3.0, 0.5 + 0.4 / 3.0, 0.4];
    std::array::from_fn(|i| raw[i] / basis.scale()[i])
}

/// Noise of a fixed stream, uniform with variance 1/12.
fn stream(seed: &mut u64) -> f64 {
    *seed = seed
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}

/// A sample of someone with these gains and corrections; the variance of the noise is .0033.
fn corrected(seed: &mut u64, theta: [f64; GAINS], truth: [f64; HELD]) -> (f64, Regressors) {
    let x = [0; GAINS].map(|_| 2.0 * stream(seed));
    let by = [0.2, 1.0, 8.0].map(|size| [0; GAINS].map(|_| size * stream(seed)));
    let y: f64 = (0..GAINS)
        .map(|i| theta[i] * (x[i] + (0..HELD).map(|j| truth[j] * by[j][i]).sum::<f64>()))
        .sum();
    (y + 0.2 * stream(seed), Regressors { x, by })
}

const QUIET: Around = Around {
    variance: 0.0033,
    ..AROUND
};

#[test]
fn a_lead_that_explains_is_believed() {
    let basis = basis();
    let mut gains = Gains::new(prior(), &basis).unwrap();
    gains.begin(2.0, 0.5);
    let mut seed = 3;
    for _ in 0..4000 {
        let (y, regressors) = corrected(&mut seed, lead(&basis), [0.0; HELD]);
        gains.update(y, &regressors, 0.3, basis.point(), &QUIET);
    }
    assert!(gains.probability(1) > 0.7, "{}", gains.probability(1));
}

#[test]
fn corrections_are_found() {
    let basis = basis();
    let mut gains = Gains::new(prior(), &basis).unwrap();
    gains.begin(2.0, 0.5);
    // Omega .8 more, tau .01 s less; open once the gains are known.
    let (theta, truth, mut seed) = (lead(&basis), [0.8, 0.0, -0.01], 5);
    for t in 0..4000 {
        if t == 200 {
            gains.reopen(2.0, 0.5, basis.point());
        }
        let (y, regressors) = corrected(&mut seed, theta, truth);
        gains.update(y, &regressors, 0.3, basis.point(), &QUIET);
    }
    let (state, covariance) = (gains.state(), gains.covariance());
    for i in 0..STATES {
        let expected = match i {
            0..GAINS => theta[i],
            GAINS => 0.0,
            _ => truth[i - LINEAR],
        };
        let deviation = covariance[i][i].sqrt();
        assert!(
            (state[i] - expected).abs() < 4.0 * deviation,
            "{i}: {} {deviation}",
            state[i]
        );
    }
    assert!(covariance[LINEAR][LINEAR].sqrt() < 0.2 && covariance[STATES - 1][STATES - 1].sqrt() < 0.01);
    // The basis moves there: what is left to be corrected is the rest.
    gains.moved([0.8, 0.0, -0.01]);
    assert!((gains.state()[LINEAR] - (state[LINEAR] - 0.8)).abs() < 1e-12);
}

#[test]
fn newborns_follow_a_jump_that_the_steady_would_take_long_for() {
    let of = |newborn: [f64; 2], odds: f64| {
        let prior = GainPrior {
            newborn,
            odds,
            births: 60.0,
            life: 1.0,
            ..prior()
        };
        let mut gains = Gains::new(prior, &basis()).unwrap();
        gains.begin(2.0, 0.5);
        for t in 0..1500 {
            let (y, mut regressors) = sample(t);
            if t >= 1000 {
                regressors.x[0] *= 0.5;
            }
            gains.update(y, &regressors, 0.3, basis().point(), &AROUND);
        }
        (gains.state()[0] - 3.0).abs()
    };
    let (with, without) = (of([0.1, 0.5], 0.01), of([0.0; 2], 1e-300));
    assert!(with < 0.15 && without > 0.5, "{with} {without}");
}

#[test]
fn who_never_changes_has_rare_newborns_and_who_does_often_has_not() {
    let odds = |every: u32| {
        let prior = GainPrior {
            newborn: [0.1, 0.5],
            odds: 0.01,
            births: 60.0,
            life: 1.0,
            ..prior()
        };
        let mut gains = Gains::new(prior, &basis()).unwrap();
        gains.begin(2.0, 0.5);
        for t in 0..12_000 {
            let (y, mut regressors) = sample(t);
            if t / every % 2 == 1 {
                regressors.x[0] *= 0.4;
            }
            gains.update(y, &regressors, 0.3, basis().point(), &AROUND);
        }
        gains.odds
    };
    // 240 births: the prior's .6 of 60 and some by chance; a change every five seconds is 24 more.
    let (steady, restless) = (odds(u32::MAX), odds(500));
    assert!((0.6 / 300.0 - 1e-12..0.005).contains(&steady), "{steady}");
    assert!((0.03..0.15).contains(&restless), "{restless}");
}

/// A gain that walks is followed by those that walk, but for the time in which none does.
#[test]
fn gains_do_not_walk_while_poles_and_delay_are_found() {
    let errors = |steady: f64| {
        let prior = GainPrior {
            drifts: [0.0, 0.5, 0.5],
            shares: [0.9, 0.05, 0.05],
            steady,
            ..prior()
        };
        let mut gains = Gains::new(prior, &basis()).unwrap();
        gains.begin(2.0, 0.5);
        gains.reopen(2.0, 0.5, basis().point());
        let mut sums = [0.0; 2];
        for t in 0..2000 {
            let (y, regressors) = sample(t);
            let gain = 1.5 + (f64::from(t) / 150.0).sin();
            gains.update(
                y + (gain - 1.5) * regressors.x[0],
                &regressors,
                0.3,
                basis().point(),
                &AROUND,
            );
            sums[usize::from(t >= 1000)] += (gains.state()[0] - gain).abs() / 1000.0;
        }
        sums
    };
    let [early, late] = errors(10.0);
    let [at_once, _] = errors(0.0);
    assert!(at_once < 0.25 && early > 2.0 * at_once, "{early} {at_once}");
    assert!(late < 0.25, "{late}");
}

#[test]
fn what_makes_no_sense_is_refused() {
    for wrong in [
        GainPrior {
            shares: [0.0, 0.5, 0.5],
            ..prior()
        },
        GainPrior { life: 0.0, ..prior() },
        GainPrior {
            steady: -1.0,
            ..prior()
        },
        GainPrior {
            freedom: f64::NAN,
            ..prior()
        },
        GainPrior {
            held: [-1.0, 0.0, 0.0],
            ..prior()
        },
    ] {
        assert!(Gains::new(wrong, &basis()).is_none(), "{wrong:?}");
    }
}

#[test]
fn the_weight_of_who_starts_again_is_that_of_its_logarithm() {
    assert!((WEIGHT_AGAIN - libm::exp(AGAIN)).abs() < 1e-16);
    assert!((EVEN + libm::log(FORMS as f64)).abs() < 1e-16);
}

/// A sample says nothing where everything is known, and hardly anything where it cannot be; one that is no
/// number moves a state no farther than the limit, as one that is far out does.
#[test]
fn what_cannot_be_does_little_harm() {
    let prior = GainPrior {
        freedom: 5.0,
        limit: 3.5,
        ..prior()
    };
    let (y, regressors) = sample(3);
    let take = |gains: &mut Gains, y: f64| gains.update(y, &regressors, 0.3, basis().point(), &AROUND);
    let mut gains = Gains::new(prior, &basis()).unwrap();
    gains.begin(0.0, 0.0);
    let (eps, log_density) = take(&mut gains, y);
    assert!(eps == y && log_density.is_finite() && gains.state() == [0.0; STATES]);
    for far in [1e100, -1e100, f64::INFINITY, f64::NAN] {
        let mut gains = Gains::new(prior, &basis()).unwrap();
        gains.begin(2.0, 0.5);
        take(&mut gains, far);
        assert!(
            gains.state().iter().all(|s| s.abs() < 10.0),
            "{far}: {:?}",
            gains.state()
        );
        assert!((gains.weights.sum() - 1.0).abs() < 1e-12, "{far}");
        let mut logs = gains
            .filters
            .iter()
            .flat_map(|f| f.log_weight.0)
            .chain(gains.log_weights.0);
        assert!(logs.all(f64::is_finite), "{far}");
        let covariance = gains.covariance();
        assert!((0..STATES).all(|i| covariance[i][i] >= 0.0), "{far}");
        take(&mut gains, y);
        assert!(gains.state().iter().all(|s| s.is_finite()), "{far}");
    }
}
