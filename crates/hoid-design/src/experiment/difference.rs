//! Number of people and runs needed to find a difference between two conditions, if each person is in both conditions.
//!
//! For one person, the difference of the means of r runs in each of two conditions has the variance
//!
//! `sigma^2 = b^2 + 2 (w^2 + s^2)/r`
//!
//! where b is the standard deviation, over people, of the true difference, w the standard deviation of one person from
//! run to run, and s the expected error of one run (`information`). The power of the paired t test is computed in
//! `power`. More runs reduce the effect of w and s; only more people reduce the effect of b.
//!
//! **Defaults.** The spread from run to run is [`RUN_TO_RUN_DEVIATION`](super::RUN_TO_RUN_DEVIATION). The spread
//! of the difference over people is 10 % (the crossover of three recorded people fell by .31 to .78 rad/s from one
//! element to another, a standard deviation of 10 % of its mean). A spread is relative to the quantity; for the phase
//! margin it is the spread that results from this spread of the gain.
//!
//! **Answer.** If the number of runs is not given, the number with the lowest total cost is chosen, where each person
//! costs as much as four runs (instruction and training) in addition to their own runs.

use std::str::FromStr;

use hoid_analysis::json;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use super::{
    DesignError, Expected, People, SpreadSource,
    power::{MAX_PEOPLE, people_needed, power},
    requested_quantities::parse_named_number,
    spread::between_people_spread,
};

/// The difference to be found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TargetDifference {
    /// Name of the quantity: `crossover`, `phase_margin`, or a parameter.
    pub name: String,
    /// Size of the difference, in the unit of the quantity or relative to its value.
    pub size: f64,
    /// True if the size is relative.
    pub relative: bool,
}

impl FromStr for TargetDifference {
    type Err = DesignError;

    /// Parses a string such as `crossover=.5` (in rad/s) or `tau_e=10%` (of its value).
    fn from_str(text: &str) -> Result<Self, DesignError> {
        let (name, number, relative) = parse_named_number(text, "quantity with the size of its difference")?;
        Ok(Self {
            name,
            size: if relative { number / 100.0 } else { number },
            relative,
        })
    }
}

/// A difference to be found, with the assumptions for its test.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DifferenceRequest {
    /// The difference to be found.
    pub sought: TargetDifference,
    /// Required probability of finding the difference.
    pub power: f64,
    /// Significance level of the test.
    pub alpha: f64,
    /// Standard deviation, over people, of the difference. If `None`, it comes from the people of the design if they
    /// provide it; otherwise it is [`DEFAULT_BETWEEN_PEOPLE`].
    pub between_people: Option<SpreadSource>,
}

/// Default required probability of finding a difference.
pub const DEFAULT_POWER: f64 = 0.8;
/// Default significance level of the test.
pub const DEFAULT_ALPHA: f64 = 0.05;
/// Default standard deviation, over people, of the difference, relative to the quantity.
pub const DEFAULT_BETWEEN_PEOPLE: f64 = 0.1;

impl DifferenceRequest {
    /// Creates a request for a difference with the default assumptions.
    pub fn new(sought: TargetDifference) -> Self {
        Self {
            sought,
            power: DEFAULT_POWER,
            alpha: DEFAULT_ALPHA,
            between_people: None,
        }
    }
}

/// A number of runs in each condition, and the number of people that it requires.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunsAndPeople {
    /// Number of runs in each condition.
    pub runs: usize,
    /// Standard deviation of the measured difference of one person.
    pub of_person: f64,
    /// Number of people needed; `None` if it exceeds a thousand.
    pub people: Option<usize>,
    /// Power for each number of people in the table.
    pub power: Vec<f64>,
}

/// Number of people and runs needed to find a difference.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DifferencePlan {
    /// The request that the plan answers.
    pub request: DifferenceRequest,
    /// Size of the difference in the unit of the quantity.
    pub size: f64,
    /// Expected error of one run.
    pub error_of_run: f64,
    /// Standard deviation of one person from run to run, in the unit of the quantity.
    pub run_to_run: f64,
    /// Standard deviation, over people, of the difference between the conditions, in the unit of the quantity.
    pub between_people: f64,
    /// Source of `between_people`, in words.
    pub between_source: String,
    /// Numbers of people in the table.
    pub people: Vec<usize>,
    /// Rows of the table: number of runs, people needed, and power for each number of people.
    pub rows: Vec<RunsAndPeople>,
    /// Index of the recommended row.
    pub answer: usize,
}

/// Numbers of runs in the table.
const RUN_COUNTS: [usize; 6] = [1, 2, 3, 4, 6, 8];
/// Numbers of people in the table.
const PEOPLE_COUNTS: [usize; 8] = [4, 6, 8, 10, 12, 16, 20, 30];
/// Cost of a person in addition to their runs, expressed as a number of runs.
const PERSON_COST_RUNS: usize = 4;

impl DifferenceRequest {
    /// Plans the numbers of people and runs; `of_run` contains the expected errors of one run, to which the relative
    /// variation from run to run is added.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] for an option out of range, [`DesignError::NotThere`] for an unknown quantity.
    pub(super) fn plan(
        &self,
        people: &People,
        (of_run, run_to_run): (&Expected, f64),
        runs: Option<usize>,
    ) -> Result<DifferencePlan, DesignError> {
        self.check()?;
        let found = of_run
            .quantity(&self.sought.name)
            .ok_or_else(|| DesignError::NotThere {
                name: self.sought.name.clone(),
                expected: of_run.names().join(", "),
            })?;
        let value = found.estimate.value.abs();
        let size = if self.sought.relative {
            self.sought.size * value
        } else {
            self.sought.size
        };
        let name = self.sought.name.as_str();
        let between = between_people_spread(
            self.between_people.as_ref(),
            people,
            (name, found.size),
            DEFAULT_BETWEEN_PEOPLE,
        )?;
        let mut plan = DifferencePlan {
            request: self.clone(),
            size,
            error_of_run: found.estimate.standard_error.unwrap_or(f64::NAN),
            run_to_run: run_to_run * found.size,
            between_people: between.value,
            between_source: between.source,
            people: PEOPLE_COUNTS.to_vec(),
            rows: Vec::new(),
            answer: 0,
        };
        let mut all = RUN_COUNTS.to_vec();
        all.extend(runs.filter(|runs| !RUN_COUNTS.contains(runs)));
        all.sort_unstable();
        plan.rows = all.into_iter().map(|runs| self.row(&plan, runs)).collect();
        plan.answer = chosen_row(&plan.rows, runs);
        Ok(plan)
    }

    fn row(&self, plan: &DifferencePlan, runs: usize) -> RunsAndPeople {
        let within = plan.run_to_run.powi(2) + plan.error_of_run.powi(2);
        let of_person = (plan.between_people.powi(2) + 2.0 * within / runs as f64).sqrt();
        let effect = plan.size / of_person;
        let of = |people: &usize| power(effect, *people, self.alpha).unwrap_or(f64::NAN);
        RunsAndPeople {
            runs,
            of_person,
            people: people_needed(effect, self.power, self.alpha),
            power: plan.people.iter().map(of).collect(),
        }
    }

    fn check(&self) -> Result<(), DesignError> {
        let part = |quantity, found: f64, expected| match found > 0.0 && found < 1.0 {
            true => Ok(()),
            false => Err(DesignError::OutOfRange {
                quantity,
                found,
                expected,
            }),
        };
        part("power of the test", self.power, "above 0 and below 1, such as 0.8")?;
        part(
            "level of the test (alpha)",
            self.alpha,
            "above 0 and below 1, such as 0.05",
        )?;
        if let Some(SpreadSource::Part(part)) = self.between_people {
            check_spread("spread of the difference between people", part)?;
        }
        if !(self.sought.size.is_finite() && self.sought.size != 0.0) {
            return Err(DesignError::OutOfRange {
                quantity: "size of the difference",
                found: self.sought.size,
                expected: "a number other than zero, such as crossover=0.5",
            });
        }
        Ok(())
    }
}

/// Checks a relative standard deviation.
pub(super) fn check_spread(quantity: &'static str, found: f64) -> Result<(), DesignError> {
    match (0.0..=10.0).contains(&found) {
        true => Ok(()),
        false => Err(DesignError::OutOfRange {
            quantity,
            found,
            expected: "0 to 10, relative to the quantity, such as 0.1",
        }),
    }
}

/// Returns the index of the row with the given number of runs or, if there is none, of the row with the lowest cost.
fn chosen_row(rows: &[RunsAndPeople], runs: Option<usize>) -> usize {
    if let Some(index) = rows.iter().position(|row| Some(row.runs) == runs) {
        return index;
    }
    let cost = |row: &RunsAndPeople| row.people.unwrap_or(MAX_PEOPLE) * (2 * row.runs + PERSON_COST_RUNS);
    let least = rows.iter().enumerate().min_by_key(|(_, row)| cost(row));
    least.map_or(0, |(index, _)| index)
}

impl DifferencePlan {
    /// Returns the recommended row: the number of runs and of people.
    pub fn recommended_row(&self) -> Option<&RunsAndPeople> {
        self.rows.get(self.answer)
    }

    pub(super) fn json(&self) -> Value {
        let row = |row: &RunsAndPeople| {
            let power: Map<String, Value> = self
                .people
                .iter()
                .zip(&row.power)
                .map(|(people, power)| (people.to_string(), json::number(*power)))
                .collect();
            json!({"runs": row.runs, "of_person": json::number(row.of_person), "people": row.people, "power": power})
        };
        json!({
            "of": self.request.sought.name,
            "size": json::number(self.size),
            "power": self.request.power,
            "alpha": self.request.alpha,
            "people": self.recommended_row().and_then(|row| row.people),
            "runs": self.recommended_row().map(|row| row.runs),
            "error_of_run": json::number(self.error_of_run),
            "run_to_run": json::number(self.run_to_run),
            "between_people": json::number(self.between_people),
            "between_source": self.between_source,
            "table": self.rows.iter().map(row).collect::<Vec<_>>(),
        })
    }

    /// Returns the table of the power as CSV, with a row for each combination of runs and people.
    pub fn csv(&self) -> String {
        let mut text = "runs,people,power\n".to_owned();
        for row in &self.rows {
            for (people, power) in self.people.iter().zip(&row.power) {
                text.push_str(&format!("{},{people},{power}\n", row.runs));
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use statrs::distribution::{ContinuousCDF, StudentsT};

    use super::*;
    use crate::experiment::{DesignOptions, RUN_TO_RUN_DEVIATION, information::tests::task};

    fn plan(text: &str, runs: Option<usize>) -> Result<DifferencePlan, DesignError> {
        let task = task(0.2);
        let designed = DesignOptions::default()
            .run(&task, &[crate::experiment::EntryPoint::Target])
            .unwrap();
        DifferenceRequest::new(text.parse()?).plan(
            &People::Population,
            (&designed.expected, RUN_TO_RUN_DEVIATION),
            runs,
        )
    }

    #[test]
    fn more_runs_need_fewer_people() {
        let plan = plan("crossover=0.3", None).unwrap();
        let people: Vec<usize> = plan.rows.iter().map(|row| row.people.unwrap()).collect();
        assert!(people.windows(2).all(|two| two[1] <= two[0]), "{people:?}");
        let of_one = &plan.rows[0];
        let within = plan.run_to_run.powi(2) + plan.error_of_run.powi(2);
        assert!((of_one.of_person.powi(2) - plan.between_people.powi(2) - 2.0 * within).abs() < 1e-12);
        assert!(plan.rows.iter().all(|row| row.of_person > plan.between_people));
        assert_eq!(plan.csv().lines().count(), 1 + 48);
        assert_eq!(plan.json()["people"], plan.recommended_row().unwrap().people.unwrap());
    }

    #[test]
    fn sizes_are_absolute_or_relative() {
        let relative = plan("crossover=10%", Some(5)).unwrap();
        let value = relative.size / 0.1;
        assert_eq!(relative.recommended_row().unwrap().runs, 5);
        let absolute = plan(&format!("crossover={}", relative.size), Some(5)).unwrap();
        assert_eq!(
            absolute.recommended_row().unwrap().people,
            relative.recommended_row().unwrap().people
        );
        assert!((relative.between_people - 0.1 * value).abs() < 1e-12);
        // The variation of the phase margin follows from that of the gain, and amounts to a few degrees.
        let margin = plan("margin=5", None).unwrap();
        assert!((0.6..13.0).contains(&margin.run_to_run), "{}", margin.run_to_run);
        assert_eq!(margin.between_source, "a default");
        for bad in ["crossover=0", "T_I=1", "crossover", "crossover=x"] {
            assert!(plan(bad, None).is_err(), "{bad}");
        }
    }

    #[test]
    fn simulated_experiments_confirm_the_power() {
        let plan = plan("crossover=8%", Some(2)).unwrap();
        let row = plan.recommended_row().unwrap();
        let people = row.people.unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(11);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let critical = StudentsT::new(0.0, 1.0, people as f64 - 1.0)
            .unwrap()
            .inverse_cdf(0.975);
        let mut found = 0;
        for _ in 0..4000 {
            let mut condition = |truth: f64| {
                let runs = (0..row.runs).map(|_| plan.run_to_run * normal() + plan.error_of_run * normal());
                truth + runs.sum::<f64>() / row.runs as f64
            };
            let mut person = |_| {
                let (one, two) = (condition(0.0), condition(plan.size));
                two - one
            };
            let mut differences: Vec<f64> = (0..people).map(&mut person).collect();
            differences
                .iter_mut()
                .for_each(|d| *d += plan.between_people * normal());
            let n = people as f64;
            let mean = differences.iter().sum::<f64>() / n;
            let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
            found += usize::from((mean / (variance / n).sqrt()).abs() > critical);
        }
        let rate = found as f64 / 4000.0;
        let k = people_needed(plan.size / row.of_person, 0.8, 0.05).unwrap();
        let predicted = power(plan.size / row.of_person, k, 0.05).unwrap();
        println!("{people} people: found in {rate:.3}, predicted {predicted:.3}");
        // The standard error of the rate over 4000 experiments is .006.
        assert!((rate - predicted).abs() < 0.02, "{rate} {predicted}");
    }
}
