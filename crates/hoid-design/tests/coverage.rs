//! Checks that 95 % confidence intervals contain the true difference in 95 % of experiments, and that one test in
//! twenty has a false finding if there is no difference.
//!
//! Each virtual person has a true difference, drawn from `N(delta, tau^2)`, and an estimate of it with a standard error
//! between .1 and .5. The variance v of the estimate is known exactly, or estimated as from the scatter of five runs,
//! `v chi^2_4/4`. With 6000 experiments, the standard error of a share of .95 is .0028. A test has a false finding
//! exactly if the interval of the same people, shifted by delta, does not contain zero, so 5 +- 1 % false findings
//! correspond to a coverage of 94 to 96 %.
//!
//! If people differ only by estimation errors of very different sizes, the intervals for few people contain the
//! difference too often, in up to 98 % of cases (as do those of the unweighted t test). In these cases only a lower
//! limit is checked.
#![allow(clippy::unwrap_used)]

use hoid_design::compare::{Observation, Weights, meta_mean, meta_regression};
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rand_distr::{ChiSquared, Distribution, StandardNormal};

const EXPERIMENT_COUNT: usize = 6_000;
const TRUE_DIFFERENCE: f64 = -0.6;

fn normal_deviate(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Returns an estimate for one person.
fn person(rng: &mut ChaCha8Rng, share: f64, mean: f64, tau: f64, estimated: bool) -> Observation {
    let error = 0.1 + 0.4 * share;
    let value = mean + tau * normal_deviate(rng) + error * normal_deviate(rng);
    let variance_factor = if estimated {
        ChiSquared::new(4.0).unwrap().sample(rng) / 4.0
    } else {
        1.0
    };
    Observation {
        value,
        variance: error * error * variance_factor,
    }
}

/// Returns the share of intervals that contain the difference.
fn paired_coverage(n: usize, tau: f64, estimated: bool, weights: Weights) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(53 + n as u64);
    let mut held = 0;
    for _ in 0..EXPERIMENT_COUNT {
        let one =
            |i: usize, rng: &mut ChaCha8Rng| person(rng, i as f64 / (n - 1) as f64, TRUE_DIFFERENCE, tau, estimated);
        let people: Vec<Observation> = (0..n).map(|i| one(i, &mut rng)).collect();
        let (low, high) = meta_mean(&people, weights).unwrap().coefficients[0].interval;
        held += usize::from(low <= TRUE_DIFFERENCE && TRUE_DIFFERENCE <= high);
    }
    held as f64 / EXPERIMENT_COUNT as f64
}

#[test]
fn within_person_intervals_have_nominal_coverage() {
    for n in [3, 6, 12] {
        for tau in [1.0, 0.4, 0.0] {
            for estimated in [false, true] {
                let held = paired_coverage(n, tau, estimated, Weights::Penalised);
                println!("{n} people, tau {tau}, errors estimated {estimated}: intervals {held:.4}");
                let most = if tau == 0.0 { 0.99 } else { 0.96 };
                assert!((0.94..=most).contains(&held), "{n} {tau} {estimated}: {held}");
            }
        }
    }
}

/// The reason why the weights do not use the tau^2 of the restricted likelihood.
#[test]
fn restricted_likelihood_undercovers_for_three_people() {
    let held = paired_coverage(3, 0.4, false, Weights::Restricted);
    println!("restricted likelihood, 3 people: intervals {held:.4}");
    assert!((0.86..0.89).contains(&held), "{held}");
}

#[test]
fn between_group_intervals_have_nominal_coverage() {
    for n in [6, 12, 24] {
        for estimated in [false, true] {
            let mut rng = ChaCha8Rng::seed_from_u64(530 + n as u64);
            let x: Vec<Vec<f64>> = (0..n).map(|i| vec![1.0, f64::from(u8::from(i >= n / 2))]).collect();
            let mut held = 0;
            for _ in 0..EXPERIMENT_COUNT {
                let one = |i: usize| {
                    let share = (i % (n / 2)) as f64 / (n / 2 - 1) as f64;
                    person(&mut rng, share, 3.0 + TRUE_DIFFERENCE * x[i][1], 0.4, estimated)
                };
                let people: Vec<Observation> = (0..n).map(one).collect();
                let found = meta_regression(&people, &x, Weights::Penalised).unwrap();
                let (low, high) = found.coefficients[1].interval;
                held += usize::from(low <= TRUE_DIFFERENCE && TRUE_DIFFERENCE <= high);
            }
            let held = held as f64 / EXPERIMENT_COUNT as f64;
            println!(
                "two groups of {}, errors estimated {estimated}: intervals {held:.4}",
                n / 2
            );
            assert!((0.93..=0.97).contains(&held), "{n}: {held}");
        }
    }
}
