//! The virtual people of the experiment.

use hoid_model::{Record, scenario::Condition};
use hoid_study::group::VirtualExperiment;
use toml::{Table, Value};

use super::{Experiment, ExperimentCondition, MeasuredRun, RunKey};
use crate::ThesisError;

/// Text of the built-in plan.
pub const EXPERIMENT_PLAN: &str = include_str!("../../plans/experiment.toml");

/// The virtual people of the experiment, and the processing of their runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExperimentPlan {
    /// Seed of all random streams.
    pub seed: u64,
    /// Number of subjects.
    pub subjects: u64,
    /// Number of runs per subject and condition.
    pub runs: u64,
    /// Number of runs that are evaluated; these are the last runs.
    pub evaluated: u64,
    /// Spread of the parameters between subjects, and between the runs of a subject.
    pub spreads: (f64, f64),
    /// Order of the remnant.
    pub remnant_order: usize,
    /// Noise level before the spread is applied.
    pub noise_level: f64,
    /// First and last delay that is tried, samples.
    pub delays: (usize, usize),
}

fn invalid_value(key: &str, found: &str, expected: &str) -> ThesisError {
    ThesisError::Unsuited {
        method: "the plan of the experiment",
        quantity: key.to_owned(),
        found: found.to_owned(),
        expected: expected.to_owned(),
    }
}

impl ExperimentPlan {
    /// The conditions of the thesis.
    pub const CONDITIONS: [Condition; 6] = [
        Condition::C1,
        Condition::C2,
        Condition::C3,
        Condition::C4,
        Condition::C5,
        Condition::C6,
    ];

    /// Reads and checks the text of a plan.
    ///
    /// # Errors
    /// [`ThesisError::Unsuited`] with the invalid key and the remedy.
    pub fn parse(text: &str) -> Result<Self, ThesisError> {
        const KEYS: [&str; 9] = [
            "seed",
            "subjects",
            "runs",
            "evaluated",
            "between_subjects",
            "between_runs",
            "remnant_order",
            "noise_level",
            "delays",
        ];
        let table: Table = text
            .parse()
            .map_err(|error: toml::de::Error| invalid_value("its text", error.message(), "TOML"))?;
        if let Some(key) = table.keys().find(|key| !KEYS.contains(&key.as_str())) {
            return Err(invalid_value("a key", key, &format!("one of {}", KEYS.join(", "))));
        }
        let shown = |key: &str| table.get(key).map_or("missing".to_owned(), Value::to_string);
        let whole = |key: &str| {
            let value = table.get(key).and_then(Value::as_integer);
            let value = value.and_then(|n| u64::try_from(n).ok());
            value.ok_or_else(|| invalid_value(key, &shown(key), "a whole number, 0 or larger"))
        };
        let number = |key: &str| {
            let value = table.get(key).and_then(Value::as_float);
            value.ok_or_else(|| invalid_value(key, &shown(key), "a number with a decimal point"))
        };
        let delays: Vec<usize> = table
            .get("delays")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .filter_map(|value| usize::try_from(value.as_integer()?).ok())
            .collect();
        let (first, last) = match delays.as_slice() {
            [first, last] if 1 <= *first && first <= last => (*first, *last),
            _ => {
                return Err(invalid_value(
                    "delays",
                    &shown("delays"),
                    "[first, last], both 1 or larger",
                ));
            }
        };
        let plan = Self {
            seed: whole("seed")?,
            subjects: whole("subjects")?,
            runs: whole("runs")?,
            evaluated: whole("evaluated")?,
            spreads: (number("between_subjects")?, number("between_runs")?),
            remnant_order: whole("remnant_order")? as usize,
            noise_level: number("noise_level")?,
            delays: (first, last),
        };
        if plan.evaluated == 0 || plan.evaluated > plan.runs {
            return Err(invalid_value(
                "evaluated",
                &shown("evaluated"),
                "1 to the number of runs",
            ));
        }
        Ok(plan)
    }

    /// Simulates a run of a subject in a condition.
    ///
    /// # Errors
    /// [`ThesisError::Study`] if no people with stable loops are found.
    pub fn record(&self, subject: u64, condition: Condition, run: u64) -> Result<Record, ThesisError> {
        let experiment = VirtualExperiment {
            subjects: self.subjects,
            conditions: Self::CONDITIONS.to_vec(),
            runs: self.runs,
            between_subjects: self.spreads.0,
            between_runs: self.spreads.1,
            remnant_order: self.remnant_order,
            noise_level: self.noise_level,
            seed: self.seed,
            defects: Vec::new(),
        };
        let cell = Self::CONDITIONS.iter().position(|of| *of == condition).unwrap_or(0);
        Ok(experiment.run(subject, cell as u64, condition, run)?.1)
    }
}

impl Experiment for ExperimentPlan {
    fn runs(&self) -> Vec<RunKey> {
        let mut all = Vec::new();
        for subject in 1..=self.subjects {
            for condition in Self::CONDITIONS {
                for run in self.runs - self.evaluated + 1..=self.runs {
                    all.push(RunKey {
                        subject: subject.to_string(),
                        condition: condition.to_string(),
                        run: run.to_string(),
                    });
                }
            }
        }
        all
    }

    fn conditions(&self) -> Vec<ExperimentCondition> {
        let of = |condition: Condition| ExperimentCondition {
            name: condition.to_string(),
            thesis_condition: condition,
        };
        Self::CONDITIONS.map(of).to_vec()
    }

    fn delays(&self) -> (usize, usize) {
        self.delays
    }

    /// Returns no time of change, because the record contains the simulated operator with its change.
    fn read_run(&self, key: &RunKey) -> Result<MeasuredRun, ThesisError> {
        let number = |key: &str, text: &str| {
            let number = text.parse::<u64>();
            number.map_err(|_| invalid_value(key, text, "a whole number, 1 or larger"))
        };
        let record = self.record(
            number("subject", &key.subject)?,
            (key.condition.parse()).map_err(|_| invalid_value("condition", &key.condition, "C1 to C6"))?,
            number("run", &key.run)?,
        )?;
        Ok(MeasuredRun { record, change_s: None })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn plan_matches_the_thesis_and_bad_values_are_refused() {
        let plan = ExperimentPlan::parse(EXPERIMENT_PLAN).unwrap();
        assert_eq!((plan.subjects, plan.runs, plan.evaluated), (3, 7, 5));
        for (from, to, named) in [
            ("runs = 7", "runs = 3", "evaluated"),
            ("delays = [20, 38]", "delays = [38, 20]", "delays"),
            ("noise_level = 0.15", "noise_level = \"much\"", "noise_level"),
            ("subjects = 3", "people = 3", "people"),
            ("seed = 3006", "seed = -1", "seed"),
        ] {
            let refused = ExperimentPlan::parse(&EXPERIMENT_PLAN.replace(from, to)).unwrap_err();
            assert!(refused.to_string().contains(named), "{refused}");
        }
    }

    #[test]
    fn runs_of_a_subject_differ_and_are_reproducible() {
        let plan = ExperimentPlan::parse(EXPERIMENT_PLAN).unwrap();
        let gain = |subject, run| {
            plan.record(subject, Condition::C1, run)
                .unwrap()
                .channel("K_e")
                .unwrap()[0]
        };
        assert_ne!(gain(1, 6), gain(1, 7));
        assert_ne!(gain(1, 7), gain(2, 7));
        assert_eq!(gain(2, 7), gain(2, 7));
    }
}
