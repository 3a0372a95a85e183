//! Comparison with full searches over models with a change, and tests on runs without a change.

use hoid_model::{
    Channel, Finding, Record, Structure,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

use super::{
    Constancy, Direction, SIGNIFICANCE_LEVEL,
    blocks::score_blocks,
    search::{Change, TimeCourse, strongest_course, strongest_step},
};
use crate::{
    Estimator, Fit, GreyBox,
    criterion::Data,
    linalg::{least_squares::solve_symmetric, vectors::dot},
};

fn simulated_record(condition: Condition, replication: u64) -> Record {
    let streams = RunSeed {
        seed: 90_210,
        replication,
        ..RunSeed::default()
    };
    let simulator = Simulator::new(&Scenario::condition(condition)).unwrap();
    simulator.run(streams, false).unwrap()
}

fn box_jenkins(records: &[Record]) -> Fit {
    let orders = Structure::BoxJenkins.operator_orders(29);
    Estimator::new(Structure::BoxJenkins, orders).fit(records).unwrap()
}

/// Delays u by this number of samples from `at` on.
fn delay_output(record: &Record, at: usize, by: usize) -> Record {
    let u: Vec<f64> = (0..record.len())
        .map(|t| record.output()[if t >= at { t - by } else { t }])
        .collect();
    let input = Channel::new("e", "", record.input().to_vec());
    Record::new(record.sample_time(), input, Channel::new("u", "", u)).unwrap()
}

fn constancy_finding(fit: &Fit, records: &[Record]) -> Option<Finding> {
    let verdict = fit.verdict(records, None).unwrap();
    verdict.findings().iter().find(|f| f.kind == "not-constant").cloned()
}

#[test]
fn changes_are_detected_without_false_alarms() {
    for (condition, changes) in [
        (Condition::C1, false),
        (Condition::C2, false),
        (Condition::C3, true),
        (Condition::C4, true),
        (Condition::C5, true),
        (Condition::C6, true),
    ] {
        let record = simulated_record(condition, 1);
        let found = constancy_finding(
            &box_jenkins(std::slice::from_ref(&record)),
            std::slice::from_ref(&record),
        );
        assert_eq!(found.is_some(), changes, "{condition:?}: {found:?}");
    }
}

#[test]
fn jump_of_the_delay_is_reported_with_its_time() {
    let record = delay_output(&simulated_record(Condition::C1, 2), 4100, 8);
    let records = std::slice::from_ref(&record);
    let verdicts = [
        box_jenkins(records).verdict(records, None).unwrap(),
        GreyBox::new(1..=1).fit(records).unwrap().verdict(records).unwrap(),
    ];
    for verdict in verdicts {
        let found = verdict.findings().iter().find(|f| f.kind == "not-constant");
        let words = &found.expect("a finding").message;
        assert!(words.contains("tau_e changes by about +0.0"), "{words}");
        let at: f64 = words
            .split("about ")
            .find_map(|part| part.split(" s after").next()?.parse().ok())
            .unwrap();
        assert!((at - 41.0).abs() <= 4.0, "{words}");
    }
}

#[test]
fn only_a_differing_run_is_reported() {
    let mut records = vec![simulated_record(Condition::C1, 3), simulated_record(Condition::C1, 4)];
    assert_eq!(constancy_finding(&box_jenkins(&records), &records), None);
    records.push(simulated_record(Condition::C2, 5));
    let words = constancy_finding(&box_jenkins(&records), &records).unwrap().message;
    assert!(words.contains("in record 3 compared with the others"), "{words}");
}

/// Uniform random numbers between -1/2 and 1/2.
fn uniform_numbers(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// Regression on two columns; the first coefficient varies with time. Signals and noise are first-order autoregressions
/// with the coefficient `memory`.
struct Regression {
    x: [Vec<f64>; 2],
    y: Vec<f64>,
}

impl Regression {
    /// The first coefficient increases by `jump` in the middle.
    fn new(seed: u64, n: usize, memory: f64, jump: f64) -> Self {
        Self::with_course(seed, n, memory, |t| if t >= n / 2 { jump } else { 0.0 })
    }

    fn with_course(seed: u64, n: usize, memory: f64, course: impl Fn(usize) -> f64) -> Self {
        let mut draw = uniform_numbers(seed);
        let mut signal = || {
            let mut x = 0.0;
            (0..n)
                .map(|_| {
                    x = memory * x + draw();
                    x
                })
                .collect::<Vec<f64>>()
        };
        let (x, noise) = ([signal(), signal()], signal());
        let y = (0..n)
            .map(|t| (1.0 + course(t)) * x[0][t] - 0.5 * x[1][t] + noise[t])
            .collect();
        Self { x, y }
    }

    /// Returns the least-squares coefficients of these columns.
    fn solve(&self, columns: &[&[f64]]) -> Vec<f64> {
        let gram: Vec<f64> = columns.iter().flat_map(|a| columns.iter().map(|b| dot(a, b))).collect();
        let right: Vec<f64> = columns.iter().map(|a| dot(a, &self.y)).collect();
        solve_symmetric(&gram, &right).unwrap()
    }

    fn strongest_change(&self) -> Change {
        self.strongest(strongest_step).unwrap()
    }

    fn strongest(&self, search: fn(&Constancy<'_>, bool) -> Option<Change>) -> Option<Change> {
        let columns: Vec<&[f64]> = self.x.iter().map(Vec::as_slice).collect();
        let theta = self.solve(&columns);
        let eps: Vec<f64> = (0..self.y.len())
            .map(|t| self.y[t] - theta[0] * self.x[0][t] - theta[1] * self.x[1][t])
            .collect();
        let variance = dot(&eps, &eps) / eps.len() as f64;
        let data = [Data::new(&self.x[0], &self.y)];
        let mut scores = |_: usize, _: Data<'_>| Some((eps.clone(), self.x.iter().cloned().enumerate().collect()));
        let blocks = score_blocks(&data, 0, 2, 0.01, &mut scores).unwrap();
        let direction = Direction {
            name: "x".to_owned(),
            unit: "",
            vector: vec![1.0, 0.0],
            delay: false,
            size: 1.0,
        };
        let constancy = Constancy {
            blocks: &blocks,
            directions: &[direction],
            variance,
            run_to_run: 0.06,
            sample_time_s: 0.01,
        };
        search(&constancy, false)
    }
}

#[test]
fn change_equals_the_coefficient_of_its_regressor() {
    let regression = Regression::new(5, 4000, 0.9, 0.8);
    let found = regression.strongest_change();
    assert!(
        found.first_sample.abs_diff(2000) <= 200 && found.p_value < 1e-4,
        "{found:?}"
    );
    // The reference is least squares with the regressor of the change as an additional column.
    let changed_input: Vec<f64> = (0..4000)
        .map(|t| {
            if t >= found.first_sample {
                regression.x[0][t]
            } else {
                0.0
            }
        })
        .collect();
    let theta = regression.solve(&[&regression.x[0], &regression.x[1], &changed_input]);
    assert!((found.size - theta[2]).abs() < 1e-9, "{} and {}", found.size, theta[2]);
}

#[test]
fn drifts_and_periodic_changes_are_found_with_their_sizes() {
    let sine = |t: usize| (std::f64::consts::TAU * t as f64 / 1400.0 + 0.4).sin();
    let swaying = Regression::with_course(7, 8000, 0.9, sine);
    let found = swaying.strongest(strongest_course).unwrap();
    let TimeCourse::Oscillation(period_s) = found.time_course else {
        panic!("{found:?}");
    };
    assert!(
        (period_s / 14.0 - 1.0).abs() < 0.1 && found.p_value < SIGNIFICANCE_LEVEL,
        "{found:?}"
    );
    assert!((found.size.abs() - 1.0).abs() < 3.0 * found.error, "{found:?}");
    let drifting = Regression::with_course(8, 8000, 0.9, |t| 1.6 * t as f64 / 8000.0);
    let found = drifting.strongest(strongest_course).unwrap();
    assert_eq!(found.time_course, TimeCourse::Drift);
    assert!(
        (found.size - 1.6).abs() < 3.0 * found.error && found.p_value < SIGNIFICANCE_LEVEL,
        "{found:?}"
    );
    // This change is smaller than the variation of people from run to run, which is 6 % here.
    let small = Regression::with_course(9, 8000, 0.9, |t| 0.05 * sine(t));
    assert!(small.strongest(strongest_course).is_none());
}

#[test]
fn false_alarm_rate_does_not_exceed_the_level() {
    // With correlated noise and regressors, the scores are correlated over about ten samples.
    for memory in [0.0, 0.9] {
        let runs = 400_u32;
        let alarms = (0..runs)
            .filter(|k| {
                Regression::new(1000 + u64::from(*k), 4000, memory, 0.0)
                    .strongest_change()
                    .p_value
                    < 0.05
            })
            .count();
        let course = (0..runs)
            .filter_map(|k| Regression::new(5000 + u64::from(k), 4000, memory, 0.0).strongest(strongest_course))
            .filter(|found| found.p_value < 0.05)
            .count();
        assert!(
            course as f64 / f64::from(runs) < 0.05 + 3.0 * 0.011,
            "memory {memory}: {course}"
        );
        let share = alarms as f64 / f64::from(runs);
        // The share is at most 5 %, within three standard errors of 1.1 %.
        assert!(share < 0.05 + 3.0 * 0.011, "memory {memory}: {share}");
    }
}

#[test]
fn short_and_noise_free_records_give_no_finding() {
    let record = simulated_record(Condition::C1, 7);
    let short = [record.span(0.0, 5.0).unwrap()];
    let found = constancy_finding(&box_jenkins(&short), &short);
    assert_eq!(found, None);
    let quiet: Vec<f64> = (0..3000)
        .map(|t| if t >= 29 { 0.3 * record.input()[t - 29] } else { 0.0 })
        .collect();
    let input = Channel::new("e", "", record.input()[..3000].to_vec());
    let exact = [Record::new(record.sample_time(), input, Channel::new("u", "", quiet)).unwrap()];
    let orders = hoid_model::Orders {
        nb: 1,
        nk: 29,
        ..hoid_model::Orders::default()
    };
    let fit = Estimator::new(Structure::Fir, orders).fit(&exact).unwrap();
    assert_eq!(constancy_finding(&fit, &exact), None);
}
