//! Tests of the adaptive recursion with a further input, on signals with known true parameters.
#![allow(clippy::expect_used)]

use hoid_core::adaptive::{
    DelayPrior, GAIN_COUNT, TwoInputFilter,
    basis::{Basis, Point},
    defaults::{DefaultOperator, REPLAY_SPAN_S, further_delay},
    difference::ParameterGroup,
    first_gain, memory_needed_for,
};

const TS: f64 = 0.02;
const DELAYS_S: [f64; 2] = [0.23, 0.14];
const GAINS: [[f64; GAIN_COUNT]; 2] = [[1.2, 1.8, 0.9], [0.2, 1.1, 0.6]];

type Filter = TwoInputFilter<Vec<f64>>;

fn point(input: usize) -> Point {
    Point {
        tau: DELAYS_S[input],
        omega: 10.5,
        zeta: 0.3,
        lag: 3.0,
    }
}

fn filter() -> Filter {
    let memory = vec![0.0; memory_needed_for(2, TS, REPLAY_SPAN_S)];
    Filter::with_further_input(
        DefaultOperator::with_delay(0.2).prior(TS),
        further_delay(0.2, false),
        memory,
    )
    .expect("a sound prior")
}

/// Nearly normal random numbers from a fixed stream: sums of twelve uniform numbers.
struct NormalStream(u64);

impl NormalStream {
    fn normal(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// A person with a response to each of two independent inputs and an autoregressive remnant of order 2.
struct Person {
    stream: NormalStream,
    bases: [Basis; 2],
    past: [Vec<f64>; 2],
    v: [f64; 2],
    /// Coefficients of the two last values of an input, and of its noise.
    inputs: [f64; 3],
}

/// Inputs with two poles at 2.6 rad/s, and inputs with a wide spectrum.
const SMOOTH: [f64; 3] = [1.9, -0.9025, 0.012];
const ROUGH: [f64; 3] = [0.97, 0.0, 0.24];

impl Person {
    fn new(seed: u64) -> Self {
        let bases = [0, 1].map(|input| Basis::new(point(input), TS).expect("a sound point"));
        Self {
            stream: NormalStream(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) + 1),
            past: [0, 1].map(|input: usize| vec![0.0; bases[input].delay() + 3]),
            bases,
            v: [0.0; 2],
            inputs: SMOOTH,
        }
    }

    /// Returns the inputs and u of a sample, for these gains and this level of the remnant.
    fn sample(&mut self, gains: &[[f64; GAIN_COUNT]; 2], remnant: f64) -> ([f64; 2], f64) {
        let v = 1.6 * self.v[0] - 0.63 * self.v[1] + remnant * self.stream.normal();
        self.v = [v, self.v[0]];
        let (mut inputs, mut u) = ([0.0; 2], v);
        for input in 0..2 {
            let (past, basis) = (&mut self.past[input], &mut self.bases[input]);
            let [a, b, c] = self.inputs;
            inputs[input] = a * past[0] + b * past[1] + c * self.stream.normal();
            past.rotate_right(1);
            past[0] = inputs[input];
            let l = basis.delay();
            let z = basis.step([past[l], past[l + 1], past[l + 2]]);
            let x = basis.regressors(&z).x;
            u += gains[input].iter().zip(x).map(|(g, x)| g * x).sum::<f64>();
        }
        (inputs, u)
    }

    fn response(&self, input: usize, gains: &[f64; GAIN_COUNT], omega: f64) -> [f64; 2] {
        let h = self.bases[input].response(omega, point(input));
        [0, 1].map(|part| (0..GAIN_COUNT).map(|i| gains[i] * h[i][part]).sum())
    }
}

/// Returns the real and imaginary parts of a response at a frequency, with their variances.
fn estimate(filter: &Filter, input: usize, omega: f64) -> ([f64; 2], [f64; 2]) {
    let (value, by) = filter.response_of_with_derivatives(input, omega);
    let c = filter.state_covariance();
    let variance = |row: &[f64]| -> f64 {
        let each = row
            .iter()
            .zip(&c)
            .map(|(a, c)| a * c.iter().zip(row).map(|(c, b)| c * b).sum::<f64>());
        each.sum()
    };
    (value, [variance(&by[0]), variance(&by[1])])
}

#[test]
fn bands_of_both_responses_cover_the_truth_before_and_after_a_change() {
    const CHANGE: usize = 3000;
    // [input][before or after].
    let (mut inside, mut squares, mut count) = ([[0.0; 2]; 2], [[0.0; 2]; 2], 0.0);
    let (mut named, mut declared, mut wrong, mut named_later) = (0, 0, 0, 0);
    for seed in 0..16 {
        let (mut person, mut filter) = (Person::new(seed), filter());
        // The response to the error changes in half of the runs, the response to the further input in the others.
        let changed = seed as usize % 2;
        let mut gains = GAINS;
        for k in 0..6000 {
            if k == CHANGE {
                gains[changed] = gains[changed].map(|g| 1.7 * g);
            }
            let (inputs, u) = person.sample(&gains, 0.03);
            filter.step_inputs(inputs, u);
            let difference = filter.detector().difference();
            let [own, other] = [changed, 1 - changed].map(ParameterGroup::Gains);
            let is_named = difference.has_changed(own) && !difference.has_changed(other);
            if filter.detector().is_change_declared() {
                if k > CHANGE {
                    declared += 1;
                    named += usize::from(is_named);
                } else {
                    wrong += 1;
                }
            }
            if filter.detector().is_change_revised() && k > CHANGE {
                named_later += usize::from(is_named);
            }
            let when = match k {
                2999 => 0,
                5999 => 1,
                _ => continue,
            };
            for input in 0..2 {
                for omega in [1.0, 2.0, 4.0] {
                    let truth = person.response(input, &gains[input], omega);
                    let (value, variance) = estimate(&filter, input, omega);
                    for part in 0..2 {
                        let z = (value[part] - truth[part]) / variance[part].sqrt();
                        inside[input][when] += f64::from(u8::from(z.abs() < 1.96));
                        squares[input][when] += z * z;
                    }
                }
            }
            count += 6.0;
        }
    }
    let each = count / 2.0;
    let inside = inside.map(|of| of.map(|n| n / each));
    let rms = squares.map(|of| of.map(|s| (s / each).sqrt()));
    // 16 runs of 6 correlated values each: the standard error of a share is about .04. The standard errors allow for
    // the drift of people, which these signals do not have, so they are too large here.
    assert!(inside.as_flattened().iter().all(|share| *share > 0.9), "{inside:?}");
    assert!(rms.as_flattened().iter().all(|rms| *rms < 1.0), "{rms:?}");
    // The first seconds after a change hardly distinguish the inputs, so in some runs both are named at first.
    assert!(
        declared >= 15 && wrong <= 1 && named >= 11 && named_later >= 14,
        "{declared} {wrong} {named} {named_later}"
    );
}

#[test]
fn exchanged_inputs_give_exchanged_responses() {
    // Both inputs have the same prior, so their order only changes the rounding. No replays: they compare candidates.
    let prior = DefaultOperator::with_delay(0.2).prior(TS);
    let delay = further_delay(0.2, false);
    let built = || {
        let memory = vec![0.0; memory_needed_for(2, TS, 0.0)];
        Filter::with_further_input(prior, delay, memory).expect("a sound prior")
    };
    let (mut one, mut other, mut person) = (built(), built(), Person::new(3));
    for _ in 0..2000 {
        let ([a, b], u) = person.sample(&GAINS, 0.03);
        one.step_inputs([a, b], u);
        other.step_inputs([b, a], u);
    }
    for omega in [0.7, 2.0, 5.0] {
        for input in 0..2 {
            let (value, variance) = estimate(&one, input, omega);
            let (twin, of_twin) = estimate(&other, 1 - input, omega);
            for part in 0..2 {
                assert!((value[part] - twin[part]).abs() < 1e-6, "{value:?} {twin:?}");
                assert!((variance[part] / of_twin[part] - 1.0).abs() < 1e-4);
            }
        }
    }
}

#[test]
fn estimate_without_drift_matches_least_squares() {
    // Known dynamics, white noise and no changes: the estimate is that of least squares with a weak prior.
    let default = DefaultOperator {
        point: point(0),
        spread: [1e-6, 1e-6, 1e-6],
        order: 2,
        ..DefaultOperator::with_delay(DELAYS_S[0])
    };
    let mut prior = default.prior(TS);
    prior.changes.drift = [0.0; 2];
    prior.changes.level = 0.0;
    prior.changes.mean_interval_s = 1e12;
    prior.changes.free_numerator = 1.0;
    prior.changes.steady = 1.0;
    let delay = DelayPrior {
        deviation: 1e-6,
        ..further_delay(DELAYS_S[1], true)
    };
    let memory = vec![0.0; memory_needed_for(2, TS, 0.0)];
    let mut filter = Filter::with_further_input(prior, delay, memory).expect("a sound prior");
    let mut person = Person {
        inputs: ROUGH,
        ..Person::new(5)
    };
    let mut twin = [0, 1].map(|input| Basis::new(point(input), TS).expect("a sound point"));
    let mut past: [Vec<f64>; 2] = [0, 1].map(|_| vec![0.0; 40]);
    const N: usize = 2 * GAIN_COUNT + 1;
    let (mut a, mut b) = ([[0.0; N]; N], [0.0; N]);
    for k in 0..4000 {
        let (inputs, clean) = person.sample(&GAINS, 0.0);
        let u = clean + 0.05 * person.stream.normal();
        filter.step_inputs(inputs, u);
        let mut row = [1.0; N];
        for input in 0..2 {
            past[input].rotate_right(1);
            past[input][0] = inputs[input];
            let l = twin[input].delay();
            let z = twin[input].step([past[input][l], past[input][l + 1], past[input][l + 2]]);
            row[input * GAIN_COUNT..][..GAIN_COUNT].copy_from_slice(&twin[input].regressors(&z).x);
        }
        // The first second sets the scales of the prior.
        if k < 50 {
            continue;
        }
        for i in 0..N {
            b[i] += row[i] * u;
            for j in 0..N {
                a[i][j] += row[i] * row[j];
            }
        }
    }
    let expected = solve(a, b);
    let c = filter.state_covariance();
    for input in 0..2 {
        for omega in [1.0, 3.0] {
            let (value, variance) = estimate(&filter, input, omega);
            let gains = std::array::from_fn(|i| expected[input * GAIN_COUNT + i]);
            let truth = person.response(input, &gains, omega);
            for part in 0..2 {
                // A few per cent of the samples are used differently because of the whitening and the start.
                let distance = (value[part] - truth[part]).abs() / variance[part].sqrt();
                assert!(distance < 0.35, "{input} {omega} {distance}");
            }
        }
        assert!(c[first_gain(input)][first_gain(input)] > 0.0);
    }
}

/// Solves linear equations by Gauss elimination with pivots.
fn solve<const N: usize>(mut a: [[f64; N]; N], mut b: [f64; N]) -> [f64; N] {
    for i in 0..N {
        let pivot = (i..N)
            .max_by(|x, y| a[*x][i].abs().total_cmp(&a[*y][i].abs()))
            .expect("a row");
        a.swap(i, pivot);
        b.swap(i, pivot);
        for k in 0..N {
            if k != i {
                let factor = a[k][i] / a[i][i];
                (0..N).for_each(|j| a[k][j] -= factor * a[i][j]);
                b[k] -= factor * b[i];
            }
        }
    }
    std::array::from_fn(|i| b[i] / a[i][i])
}

#[test]
fn input_without_information_leaves_the_response_to_the_error() {
    let sum = |k: usize| (0.9 * k as f64 * TS).sin() + (2.3 * k as f64 * TS).sin() + (4.1 * k as f64 * TS).cos();
    // A constant input, and the error itself: the responses are finite, and the part that the data determine is right.
    for same in [false, true] {
        let (mut filter, mut person) = (filter(), Person::new(7));
        let mut basis = Basis::new(point(0), TS).expect("a sound point");
        for k in 0..3000_usize {
            let value = |age: usize| k.checked_sub(age).map_or(0.0, sum);
            let l = basis.delay();
            let z = basis.step([value(l), value(l + 1), value(l + 2)]);
            let w: f64 = GAINS[0].iter().zip(basis.regressors(&z).x).map(|(g, x)| g * x).sum();
            let further = if same { value(0) } else { 1.0 };
            filter.step_inputs([value(0), further], w + 0.02 * person.stream.normal());
        }
        assert!(filter.has_started() && filter.restart_count() == 0);
        let truth = person.response(0, &GAINS[0], 2.0);
        let [(own, _), (further, variance)] = [0, 1].map(|input| estimate(&filter, input, 2.0));
        let whole = match same {
            true => [0, 1].map(|part| own[part] + further[part]),
            false => own,
        };
        let miss = (whole[0] - truth[0]).hypot(whole[1] - truth[1]);
        assert!(miss < 0.05 * truth[0].hypot(truth[1]), "{same}: {whole:?} {truth:?}");
        // The response to an input that the data do not determine has errors of the size of the prior.
        assert!(
            variance[0].sqrt() > 0.1 && variance[0].is_finite(),
            "{same}: {variance:?}"
        );
    }
    // An input of zero has no scale, so there is no estimate until it moves.
    let (mut filter, mut person) = (filter(), Person::new(8));
    for k in 0..1500 {
        let ([e, r], u) = person.sample(&GAINS, 0.02);
        filter.step_inputs([e, if k < 500 { 0.0 } else { r }], u);
        assert_eq!(filter.has_started(), k >= 500, "{k}");
    }
}

#[test]
fn memory_for_one_input_is_too_little() {
    let prior = DefaultOperator::with_delay(0.2).prior(TS);
    let delay = further_delay(0.1, true);
    let with = |inputs: usize, delay: DelayPrior| {
        let memory = vec![0.0; hoid_core::adaptive::errors_needed(TS) * (2 + inputs)];
        Filter::with_further_input(prior, delay, memory).is_some()
    };
    assert!(!with(1, delay) && with(2, delay));
    assert!(!with(2, DelayPrior { tau: -0.1, ..delay }));
    assert!(!with(
        2,
        DelayPrior {
            deviation: 0.0,
            ..delay
        }
    ));
}
