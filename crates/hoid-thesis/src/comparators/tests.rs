//! Common helpers for the tests of comparators, and tests of all comparators.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;

use hoid_model::{
    Channel, OperatorParameters, Record, SampleTime,
    scenario::{Condition, RemnantStrength, Scenario},
};
use hoid_sim::{RunSeed, Simulator};
use num_complex::Complex64;

use super::{
    comparator::{Task, delayed_response},
    comparators, names_and_descriptions, untracked_comparator_message,
};

/// Returns a record at 100 Hz.
pub(super) fn test_record(e: &[f64], u: &[f64]) -> Record {
    let channel = |name: &str, values: &[f64]| Channel::new(name, "deg", values.to_vec());
    Record::new(SampleTime::new(0.01).unwrap(), channel("e", e), channel("u", u)).unwrap()
}

/// Returns a task without lines.
pub(super) fn test_task<'a>(record: &'a Record, at: &'a [usize], omega_rad_s: &'a [f64]) -> Task<'a> {
    Task {
        record,
        requested_samples: at,
        lines_rad_s: &[],
        omega_rad_s,
        start_s: (0.0, 30.72),
        nk: 29,
        validation: None,
        change: None,
    }
}

/// A run in a condition of the thesis, and its true values.
pub(super) struct Run {
    pub record: Record,
    validation: Record,
    pub at: Vec<usize>,
    lines_rad_s: Vec<f64>,
    change: Option<(f64, f64)>,
}

impl Run {
    /// Simulates one replication with the given P_n and m0.
    pub fn of(condition: Condition, order: usize, level: f64) -> Self {
        Self::replication(condition, order, level, 0)
    }

    pub fn replication(condition: Condition, order: usize, level: f64, replication: u64) -> Self {
        let mut scenario = Scenario::condition(condition);
        scenario.remnant.order = order;
        if let RemnantStrength::Level { level: of, .. } = &mut scenario.remnant.strength {
            *of = level;
        }
        let simulator = Simulator::new(&scenario).unwrap();
        let run = |cell: u64| {
            let seed = RunSeed {
                seed: 101,
                cell,
                replication,
            };
            simulator.run(seed, false).unwrap()
        };
        Self {
            record: run(0),
            validation: run(1),
            // One sample is before the change and one 24 s after it.
            at: vec![2999, 6499],
            lines_rad_s: scenario.forcing.sinusoids().iter().map(|s| s.omega_rad_s).collect(),
            change: scenario.schedule.change_s().zip(scenario.schedule.rate_per_s()),
        }
    }

    pub fn task(&self) -> Task<'_> {
        Task {
            record: &self.record,
            requested_samples: &self.at,
            lines_rad_s: &self.lines_rad_s,
            omega_rad_s: &self.lines_rad_s[2..9],
            start_s: (0.0, 30.72),
            nk: 29,
            validation: Some(&self.validation),
            change: self.change,
        }
    }

    /// The operator at a sample.
    pub fn operator(&self, k: usize) -> OperatorParameters {
        let of = |name: &str| self.record.channel(name).unwrap()[k];
        OperatorParameters {
            k_e: of("K_e"),
            t_l_s: of("T_L"),
            omega_nm_rad_s: of("omega_nm"),
            zeta_nm: of("zeta_nm"),
            tau_e_s: 0.28,
        }
    }

    /// The true responses at the requested samples.
    pub fn responses(&self) -> Vec<Vec<Complex64>> {
        let task = self.task();
        let of = |k: &usize| delayed_response(&self.operator(*k), self.record.sample_time(), task.omega_rad_s).unwrap();
        self.at.iter().map(of).collect()
    }
}

/// Returns the root mean square of the relative error over the frequencies.
pub(super) fn error(found: &[Complex64], expected: &[Complex64]) -> f64 {
    let squares: f64 = found
        .iter()
        .zip(expected)
        .map(|(h, h0)| (h / h0 - 1.0).norm_sqr())
        .sum();
    (squares / expected.len() as f64).sqrt()
}

#[test]
fn comparators_have_unique_names_and_sources() {
    let all = comparators();
    let names: BTreeSet<&str> = all.iter().map(|c| c.description().name).collect();
    assert_eq!(names.len(), all.len());
    for comparator in &all {
        let about = comparator.description();
        assert!(!about.help.is_empty() && !about.source.is_empty(), "{}", about.name);
        assert!(
            comparator.list().iter().all(|setting| !setting.help.is_empty()),
            "{}",
            about.name
        );
    }
}

/// All comparators are applied to a run with a small remnant: before the change and long after it, the error of the
/// response is below one half. NaN is reported as a missing value.
#[test]
fn all_comparators_follow_a_reference_run() {
    let run = Run::of(Condition::C4, 1, 0.01);
    let truth = run.responses();
    for comparator in comparators() {
        let name = comparator.description().name;
        let found = comparator
            .track(&run.task())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!((found.response.len(), found.operator.len()), (2, 2), "{name}");
        for (k, (found, expected)) in found.response.iter().zip(&truth).enumerate() {
            let off = error(found, expected);
            assert!(off < 0.5, "{name}, {k}: {off}");
        }
    }
}

#[test]
fn zero_input_and_late_samples_are_refused_by_all() {
    let silent = test_record(&[0.0; 4000], &[1.0; 4000]);
    let moving = Run::of(Condition::C1, 1, 0.1);
    let beyond = Task {
        requested_samples: &[8192],
        ..moving.task()
    };
    for comparator in comparators() {
        let name = comparator.description().name;
        let refused = comparator
            .track(&test_task(&silent, &[3999], &[1.0]))
            .unwrap_err()
            .to_string();
        assert!(refused.contains(name) && refused.contains("zero"), "{refused}");
        let refused = comparator.track(&beyond).unwrap_err().to_string();
        assert!(refused.contains("8192"), "{refused}");
    }
}

#[test]
fn non_recursive_methods_are_refused_with_advice() {
    for (typed, words) in [
        ("wavelet", "data after each time as before it"),
        ("lpv", "lpv-subspace is not a recursion"),
        ("rls-fir", "--method rls --structure fir"),
        ("LPV-subspace", "the whole record"),
    ] {
        let message = untracked_comparator_message(typed).unwrap();
        assert!(
            message.contains(words) && message.contains("survey_methods"),
            "{message}"
        );
    }
    for typed in ["rpem", "rls", "kalman", ""] {
        assert_eq!(untracked_comparator_message(typed), None, "{typed}");
    }
    let all: BTreeSet<&str> = names_and_descriptions().map(|(name, _)| name).collect();
    assert_eq!(all.len(), names_and_descriptions().count());
}
