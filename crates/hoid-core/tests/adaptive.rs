//! Tests of the adaptive recursion on signals with known true parameters.
#![allow(clippy::expect_used)]

use hoid_core::{
    adaptive::{
        AdaptiveFilter, AdaptivePrior, GAIN_COUNT, MAX_NOISE_ORDER, STATE_COUNT,
        basis::{Basis, Point},
        defaults::{DefaultOperator, REPLAY_SPAN_S},
        detector::DetectorSettings,
        difference::ParameterGroup,
        initial_estimate::InitialEstimate,
        memory_needed, min_memory,
        mixture::ChangePrior,
        noise::Lags,
    },
    state::State,
};

const TS: f64 = 0.02;

fn prior(threshold: f64) -> AdaptivePrior {
    AdaptivePrior {
        order: 8,
        detection: DetectorSettings {
            recent: [10, 16],
            least: 16,
            most: 80,
            threshold,
            dynamics: [3.3, 0.125, 0.05],
            refractory: 16,
        },
        ..DefaultOperator::with_delay(0.2).prior(TS)
    }
}

fn default_operator() -> Point {
    Point {
        tau: 0.2,
        omega: 11.0,
        zeta: 0.25,
        lag: 3.0,
    }
}

fn basis(point: Point) -> Basis {
    Basis::new(point, TS).expect("a sound point")
}

fn filter(threshold: f64) -> AdaptiveFilter<Vec<f64>> {
    let memory = vec![0.0; memory_needed(TS, REPLAY_SPAN_S)];
    AdaptiveFilter::new(prior(threshold), memory).expect("a sound prior")
}

/// Nearly normal random numbers from a fixed stream: sums of twelve uniform numbers.
struct NormalStream(u64);

impl NormalStream {
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

/// A person with gains in a basis and an autoregressive remnant of order 2.
struct Person {
    stream: NormalStream,
    basis: Basis,
    past: Vec<f64>,
    e: f64,
    v: [f64; 2],
    /// Response to the error of the last sample.
    w: f64,
}

impl Person {
    fn new(seed: u64) -> Self {
        Self::at(seed, default_operator())
    }

    fn at(seed: u64, point: Point) -> Self {
        let basis = basis(point);
        Self {
            stream: NormalStream(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1),
            past: vec![0.0; basis.delay() + 3],
            basis,
            e: 0.0,
            v: [0.0; 2],
            w: 0.0,
        }
    }

    /// Returns e and u of a sample, for these gains and this level of the remnant.
    fn sample(&mut self, gains: [f64; GAIN_COUNT], remnant: f64) -> [f64; 2] {
        self.e = 0.97 * self.e + 0.24 * self.stream.normal();
        self.past.rotate_right(1);
        self.past[0] = self.e;
        let l = self.basis.delay();
        let z = self.basis.step([self.past[l], self.past[l + 1], self.past[l + 2]]);
        let x = self.basis.regressors(&z).x;
        let v = 1.6 * self.v[0] - 0.63 * self.v[1] + remnant * self.stream.normal();
        self.v = [v, self.v[0]];
        self.w = gains.iter().zip(x).map(|(g, x)| g * x).sum();
        [self.e, self.w + v]
    }
}

const OPERATOR_GAINS: [f64; GAIN_COUNT] = [1.2, 1.8, 0.9];

fn response(basis: &Basis, gains: [f64; GAIN_COUNT], omega: f64) -> [f64; 2] {
    let h = basis.response(omega, basis.point());
    [0, 1].map(|part| (0..GAIN_COUNT).map(|i| gains[i] * h[i][part]).sum())
}

/// Returns the real and imaginary parts of the estimate at a frequency, with their variances.
fn estimate(filter: &AdaptiveFilter<Vec<f64>>, omega: f64) -> ([f64; 2], [f64; 2]) {
    let (value, by) = filter.response_with_derivatives(omega);
    let c = filter.state_covariance();
    let variance = |row: &[f64; STATE_COUNT]| -> f64 {
        (0..STATE_COUNT)
            .map(|i| (0..STATE_COUNT).map(|j| row[i] * c[i][j] * row[j]).sum::<f64>())
            .sum()
    };
    (value, [variance(&by[0]), variance(&by[1])])
}

#[test]
fn bands_cover_the_truth_and_narrow_with_time() {
    let (mut inside, mut all) = (0.0, 0.0);
    let mut squares = [0.0; 2];
    for seed in 0..16 {
        let (mut person, mut filter) = (Person::new(seed), filter(1e9));
        for k in 0..5000 {
            let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
            filter.step(e, u);
            let age = match k {
                499 => 0,
                4999 => 1,
                _ => continue,
            };
            for omega in [1.0, 2.0, 4.0] {
                let truth = response(&person.basis, OPERATOR_GAINS, omega);
                let (value, variance) = estimate(&filter, omega);
                for part in 0..2 {
                    let error = value[part] - truth[part];
                    squares[age] += error * error;
                    all += 1.0;
                    inside += f64::from(error.abs() < 1.96 * variance[part].sqrt());
                }
            }
        }
    }
    // A share of 192 correlated values has a standard error of 3 to 4 %.
    let share = inside / all;
    assert!((0.87..=1.0).contains(&share), "{share}");
    // The errors after 100 s are compared with those after 10 s, i.e. with ten times the data.
    let ratio = (squares[1] / squares[0]).sqrt();
    assert!(ratio < 0.5, "{ratio}");
}

/// Returns the samples of a remnant with the power .04 and a given number of poles at -1/.06 per second, and the
/// variance of its innovations.
fn steep_remnant(poles: usize, samples: usize, seed: u64) -> (Vec<f64>, f64) {
    let (pole, mut stream, mut state) = ((-TS / 0.06).exp(), NormalStream(seed), vec![0.0; poles]);
    let mut sample = || {
        state.iter_mut().fold(stream.normal(), |input, v| {
            *v = pole * *v + input;
            *v
        })
    };
    let mut v: Vec<f64> = (0..samples + 200).map(|_| sample()).collect();
    v.drain(..200);
    let variance = 0.04 * samples as f64 / v.iter().map(|v| v * v).sum::<f64>();
    v.iter_mut().for_each(|v| *v *= variance.sqrt());
    (v, variance)
}

#[test]
fn steep_remnant_is_estimated_as_precisely_as_a_flat_one() {
    let mut precision = Vec::new();
    for poles in [1, 4] {
        let (v, variance) = steep_remnant(poles, 5000, 7);
        let (mut person, mut filter) = (Person::new(3), filter(1e9));
        for (k, v) in v.iter().enumerate() {
            let [e, u] = person.sample(OPERATOR_GAINS, 0.0);
            filter.step(e, u + v);
            if k == 1000 {
                // The innovation variance is .1 to 60 thousandths of the power of u; its scale is found immediately
                // from the data.
                let ratio = filter.variance() / variance;
                assert!((0.7..1.5).contains(&ratio), "{poles} poles: {ratio}");
            }
        }
        let truth = response(&basis(default_operator()), OPERATOR_GAINS, 2.0);
        let (value, variance) = estimate(&filter, 2.0);
        for part in 0..2 {
            let z = (value[part] - truth[part]) / variance[part].sqrt();
            assert!(z.abs() < 4.0, "{poles} poles: {z}");
        }
        precision.push((variance[0] + variance[1]).sqrt());
    }
    // Both remnants have the same power; the steep one has less of it in the band of the response.
    assert!(precision[1] < 2.0 * precision[0], "{precision:?}");
}

#[test]
fn neuromuscular_system_and_delay_are_found() {
    // The operator is so far from the default that the basis must change.
    let point = Point {
        tau: 0.22,
        omega: 13.0,
        zeta: 0.35,
        ..default_operator()
    };
    for seed in 0..3 {
        let (mut person, mut filter) = (Person::at(300 + seed, point), filter(1e9));
        for _ in 0..6000 {
            let [e, u] = person.sample(OPERATOR_GAINS, 0.02);
            filter.step(e, u);
        }
        let found = filter.dynamics();
        let near = |found: f64, truth: f64, by: f64| (found - truth).abs() < by;
        let all = near(found.omega, 13.0, 0.4) && near(found.zeta, 0.35, 0.04) && near(found.tau, 0.22, 0.004);
        assert!(all && filter.basis().point().omega > 12.0, "{seed}: {found:?}");
    }
}

#[test]
fn operators_far_from_the_prior_are_found() {
    // A delay 100 ms longer than the prior, and a system of 16 rad/s with a delay that is 60 ms shorter: from the
    // default person alone, the corrections converge to another minimum.
    for (point, seed) in [
        (
            Point {
                tau: 0.3,
                ..default_operator()
            },
            400,
        ),
        (
            Point {
                tau: 0.14,
                omega: 16.0,
                zeta: 0.15,
                ..default_operator()
            },
            401,
        ),
    ] {
        let (mut person, mut filter) = (Person::at(seed, point), filter(1e9));
        for _ in 0..4000 {
            let [e, u] = person.sample(OPERATOR_GAINS, 0.02);
            filter.step(e, u);
        }
        let found = filter.dynamics();
        assert!((found.tau - point.tau).abs() < 0.003, "{seed}: {found:?}");
        assert!((found.omega / point.omega - 1.0).abs() < 0.06, "{seed}: {found:?}");
    }
}

#[test]
fn delay_change_is_distinguished_from_a_gain_change() {
    let later = Point {
        tau: 0.21,
        ..default_operator()
    };
    let mut found = 0;
    for seed in 600..604 {
        let (mut person, mut filter) = (Person::new(seed), filter(12.5));
        let mut other = basis(later);
        let mut past = vec![0.0; other.delay() + 3];
        for k in 0..3000 {
            let [e, u] = person.sample(OPERATOR_GAINS, 0.08);
            past.rotate_right(1);
            past[0] = e;
            let l = other.delay();
            let z = other.step([past[l], past[l + 1], past[l + 2]]);
            let response_of = |x: [f64; GAIN_COUNT]| -> f64 { OPERATOR_GAINS.iter().zip(x).map(|(g, x)| g * x).sum() };
            // The change takes half a second.
            let part = ((f64::from(k) - 1500.0) / 25.0).clamp(0.0, 1.0);
            let u = u + part * (response_of(other.regressors(&z).x) - person.w);
            filter.step(e, u);
            if filter.detector().is_change_declared() && (1500..2000).contains(&k) {
                let told = filter.detector().difference();
                let (by, error) = (
                    told.value[STATE_COUNT - 1],
                    told.covariance[STATE_COUNT - 1][STATE_COUNT - 1].sqrt(),
                );
                found += u32::from(
                    told.has_changed(ParameterGroup::Delay(0))
                        && !told.has_changed(ParameterGroup::Gains(0))
                        && by > 3.0 * error,
                );
            }
        }
    }
    assert!(found >= 3, "{found} of 4");
}

#[test]
fn change_is_tracked_and_a_larger_remnant_is_no_change() {
    let (mut found, mut errors) = (0, 0.0);
    for seed in 0..4 {
        let (mut person, mut filter) = (Person::new(100 + seed), filter(12.5));
        let after = OPERATOR_GAINS.map(|g| 0.5 * g);
        for k in 0..3000 {
            let gains = if k < 1500 { OPERATOR_GAINS } else { after };
            let [e, u] = person.sample(gains, 0.03);
            filter.step(e, u);
            found += u32::from(filter.detector().is_change_declared() && (1500..2000).contains(&k));
            assert!(
                !filter.detector().is_change_declared() || k >= 1500,
                "{seed}: false alarm at {k}"
            );
        }
        let truth = response(&person.basis, after, 2.0);
        let (value, variance) = estimate(&filter, 2.0);
        for part in 0..2 {
            let error = (value[part] - truth[part]).abs();
            assert!(error < 2.5 * variance[part].sqrt(), "{seed}: {error} {variance:?}");
        }
        errors += (value[0] - truth[0]).hypot(value[1] - truth[1]) / truth[0].hypot(truth[1]) / 4.0;
    }
    assert!(found >= 3, "{found} of 4");
    // This is the mean error 30 s after the change; each single error has a standard error of .13 to .19.
    assert!(errors < 0.15, "{errors}");

    let mut alarms = 0;
    for seed in 0..4 {
        let (mut person, mut filter) = (Person::new(200 + seed), filter(12.5));
        for k in 0..3000 {
            let [e, u] = person.sample(OPERATOR_GAINS, if k < 1500 { 0.03 } else { 0.06 });
            filter.step(e, u);
            alarms += u32::from(filter.detector().is_change_declared());
        }
    }
    assert_eq!(alarms, 0);
}

#[test]
fn constant_span_is_no_change_and_a_later_change_is_found() {
    let (mut alarms, mut found) = (0, 0);
    for seed in 0..4 {
        let (mut person, mut filter) = (Person::new(300 + seed), filter(12.5));
        for k in 0..4500 {
            let gains = if k < 2500 {
                OPERATOR_GAINS
            } else {
                OPERATOR_GAINS.map(|g| 0.5 * g)
            };
            let [e, u] = person.sample(gains, 0.03);
            // The recording contains zeros for three seconds, and once more while the gains change.
            let is_constant = (1500..1650).contains(&k) || (2400..2550).contains(&k);
            let [e, u] = if is_constant { [0.0; 2] } else { [e, u] };
            filter.step(e, u);
            let declared = u32::from(filter.detector().is_change_declared());
            alarms += if k < 2550 { declared } else { 0 };
            found += if (2550..2950).contains(&k) { declared } else { 0 };
        }
    }
    assert_eq!(alarms, 0);
    assert!(found >= 3, "{found} of 4");
}

#[test]
fn restored_filter_continues_bit_identically() {
    let (mut person, mut first) = (Person::new(5), filter(12.5));
    for _ in 0..1234 {
        let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
        first.step(e, u);
    }
    let mut numbers = Vec::new();
    first.visit(&mut |number| numbers.push(*number));
    let mut second = filter(12.5);
    let mut left = numbers.iter();
    second.visit(&mut |number| *number = *left.next().expect("as many numbers"));
    assert!(left.next().is_none());
    for k in 0..1000 {
        let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
        assert_eq!(first.step(e, u), second.step(e, u), "{k}");
        assert_eq!(
            first.detector().log_significance(),
            second.detector().log_significance()
        );
    }
    assert_eq!(estimate(&first, 2.0), estimate(&second, 2.0));
}

#[test]
fn uninformative_data_keep_the_filter_finite() {
    let mut silent = filter(12.5);
    for _ in 0..500 {
        assert_eq!(silent.step(0.0, 0.0).innovation, 0.0);
    }
    assert!(!silent.has_started());
    // The error is always zero and the output moves: the estimate cannot start.
    let mut stream = NormalStream(3);
    for _ in 0..500 {
        silent.step(0.0, stream.normal());
    }
    assert!(!silent.has_started());

    let (mut person, mut filter) = (Person::new(9), filter(12.5));
    let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
    assert!(filter.step(e, u).innovation.is_finite() && !filter.has_started());
    for k in 0..2000 {
        let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
        match k % 7 {
            0 => filter.bridge(e),
            1 => assert!(filter.step_without_update(e, u).innovation.is_finite()),
            _ => assert!(filter.step(e, u).innovation.is_finite()),
        }
    }
    // A person who does not move: the estimate and its error bands stay finite.
    for _ in 0..3000 {
        filter.step(0.0, 0.0);
    }
    let (value, variance) = estimate(&filter, 2.0);
    assert!(value.iter().chain(&variance).all(|v| v.is_finite()));
    assert!(filter.step(1e200, 1.0).shortened || filter.step(1.0, 1e200).shortened);
    let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
    assert!(filter.step(e, u).innovation.is_finite() && filter.restart_count() > 0);
}

#[test]
fn outlier_hardly_moves_the_estimate() {
    let (mut person, mut filter) = (Person::new(11), filter(12.5));
    for _ in 0..1500 {
        let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
        filter.step(e, u);
    }
    let (before, variance) = estimate(&filter, 2.0);
    let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
    filter.step(e, u + 100.0);
    let (after, _) = estimate(&filter, 2.0);
    for part in 0..2 {
        assert!((after[part] - before[part]).abs() < variance[part].sqrt());
    }
}

#[test]
fn invalid_priors_and_memory_are_refused() {
    let memory = || vec![0.0; min_memory(TS)];
    assert!(AdaptiveFilter::new(prior(13.5), vec![0.0; 3]).is_none());
    let sound = prior(13.5);
    let changed = |mean_interval_s: f64, steady: f64| ChangePrior {
        mean_interval_s,
        steady,
        ..sound.changes
    };
    for wrong in [
        AdaptivePrior {
            person: Point {
                tau: 1.0,
                ..default_operator()
            },
            ..sound
        },
        AdaptivePrior { order: 1, ..sound },
        AdaptivePrior { hold: 0.0, ..sound },
        AdaptivePrior {
            hold: f64::NAN,
            ..sound
        },
        AdaptivePrior {
            spread: [0.3, 0.0, 0.1],
            ..sound
        },
        AdaptivePrior {
            changes: changed(-1.0, 0.5),
            ..sound
        },
        AdaptivePrior {
            changes: changed(60.0, 1.5),
            ..sound
        },
        AdaptivePrior {
            detection: DetectorSettings {
                most: 500,
                ..sound.detection
            },
            ..sound
        },
    ] {
        assert!(AdaptiveFilter::new(wrong, memory()).is_none(), "{wrong:?}");
    }
    assert!(AdaptiveFilter::new(sound, memory()).is_some());
}

#[test]
fn operator_is_tracked_without_replay_memory() {
    let (mut lean, mut replayed) = (0.0, 0.0);
    for seed in 0..4 {
        let mut person = Person::new(700 + seed);
        let memory = vec![0.0; min_memory(TS)];
        let mut filters = [
            filter(1e9),
            AdaptiveFilter::new(prior(1e9), memory).expect("a sound prior"),
        ];
        for _ in 0..3000 {
            let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
            filters.iter_mut().for_each(|filter| {
                filter.step(e, u);
            });
        }
        let truth = response(&person.basis, OPERATOR_GAINS, 2.0);
        let error = |filter: &AdaptiveFilter<Vec<f64>>| {
            let (value, _) = estimate(filter, 2.0);
            (value[0] - truth[0]).hypot(value[1] - truth[1]) / truth[0].hypot(truth[1])
        };
        replayed += error(&filters[0]) / 4.0;
        lean += error(&filters[1]) / 4.0;
    }
    assert!(replayed < 0.05 && lean < 0.1, "{replayed:.3} {lean:.3}");
}

#[test]
fn initial_estimate_is_used() {
    let mut state = [0.0; STATE_COUNT];
    state[..GAIN_COUNT].copy_from_slice(&OPERATOR_GAINS);
    let mut covariance = [[0.0; STATE_COUNT]; STATE_COUNT];
    for (i, row) in covariance.iter_mut().enumerate() {
        row[i] = 1e-3;
    }
    let (pole, other_pole) = (0.9_f64, 0.7_f64);
    // v = 1.6 v(k-1) - .63 v(k-2) + eps, with the poles .9 and .7.
    let lags: Lags = std::array::from_fn(|k| {
        let of = |a: f64, b: f64| a.powi(k as i32 + 1) / ((a - b) * (1.0 - a * b) * (1.0 - a * a));
        of(pole, other_pole) + of(other_pole, pole)
    });
    let known = InitialEstimate {
        state,
        covariance,
        variance: 0.05 * 0.05,
        units: [1.5],
        remnant: Some((lags, 20.0)),
    };
    let mut told = filter(1e9).with_initial_estimate(&known).expect("a sound estimate");
    assert!(told.has_started() && (told.d()[0] + 1.6).abs() < 0.01 && (told.d()[1] - 0.63).abs() < 0.01);
    let spread = told.state_covariance();
    for i in 0..STATE_COUNT {
        for j in 0..STATE_COUNT {
            assert!((spread[i][j] - covariance[i][j]).abs() < 1e-12);
        }
    }
    let (value, truth) = (
        told.response(2.0),
        response(&basis(default_operator()), OPERATOR_GAINS, 2.0),
    );
    assert!((value[0] - truth[0]).hypot(value[1] - truth[1]) < 1e-9);
    // The estimate is compared with that of a filter without an initial estimate, over ten seconds.
    let (mut person, mut other) = (Person::new(3), filter(1e9));
    let mut errors = [0.0; 2];
    for k in 0..500 {
        let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
        told.step(e, u);
        other.step(e, u);
        let truth = response(&person.basis, OPERATOR_GAINS, 2.0);
        for (sum, filter) in errors.iter_mut().zip([&told, &other]).filter(|_| k >= 60) {
            let (value, _) = estimate(filter, 2.0);
            *sum += (value[0] - truth[0]).powi(2) + (value[1] - truth[1]).powi(2);
        }
    }
    assert!(errors[0] < 0.25 * errors[1], "{errors:?}");
    for wrong in [
        InitialEstimate { units: [0.0], ..known },
        InitialEstimate {
            variance: f64::NAN,
            ..known
        },
        InitialEstimate {
            remnant: Some(([0.0; MAX_NOISE_ORDER + 1], 1.0)),
            ..known
        },
    ] {
        assert!(filter(1e9).with_initial_estimate(&wrong).is_none());
    }
}

#[test]
fn stick_limit_does_not_bias_the_response() {
    let (mut told, mut taken) = (0.0, 0.0);
    for seed in 0..4 {
        let (mut person, mut free) = (Person::new(400 + seed), filter(12.5));
        let (mut with_limit, mut without_limit) = (filter(12.5), filter(13.5));
        let mut power = 0.0;
        for _ in 0..3000 {
            let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
            power += u * u;
            free.step(e, u);
        }
        let end = 1.2 * (power / 3000.0).sqrt();
        let mut person = Person::new(400 + seed);
        for k in 0..3000 {
            let [e, u] = person.sample(OPERATOR_GAINS, 0.05);
            let stick = u.clamp(-end, end);
            with_limit.step(e, stick);
            // No two consecutive samples are equal, so the limit of the stick is not recognised.
            without_limit.step(e, stick * (1.0 + 1e-9 * f64::from(k % 2)));
        }
        let (of, _) = estimate(&free, 2.0);
        let distance = |filter: &AdaptiveFilter<Vec<f64>>| {
            let (y, _) = estimate(filter, 2.0);
            (y[0] - of[0]).hypot(y[1] - of[1]) / of[0].hypot(of[1])
        };
        told += distance(&with_limit) / 4.0;
        taken += distance(&without_limit) / 4.0;
    }
    assert!(told < 0.5 * taken, "{told:.3} for {taken:.3}");
}
