//! The experiment of section VI and appendix I of the thesis, with virtual or recorded people.
//!
//! The recordings of the text are of three subjects in a simulator and are not public. Its procedure can be applied to
//! virtual people with known parameters: three different subjects, seven runs in each of C1 to C6, of which the last
//! five are evaluated; and to the user's own recordings. For each run ([`procedure`]):
//!
//! 1. Batch fits of the first and the last three eighths, [0, 30.72] and [51.20, 81.92] s of the text, ARX by OLS and
//!    BJ(m* = 1) by PEM, with every delay of a range. In each span the delay with the highest VAF is the best; the
//!    n_k* of the run and structure is the mean of the two, rounded, and T_n* that of their two time constants
//!    of the remnant (the text: *the average between the best two sub-batch-fitting estimations
//!    made*).
//! 2. With that n_k*, OLS and PEM of both spans again.
//! 3. RLS and RPEM with lambda = 1 - 1/256 and P0 = 0.1 I over the run, from the fit of the first span. T_n* is
//!    reported in Table 3 and not used further: d1 is a parameter of RPEM and starts with that of its fit, as in
//!    section V.B.
//!
//! Figures show the average over the five runs, as in the text, and the median as well.
//!
//! | module | contents |
//! |---|---|
//! | `people` | [`ExperimentPlan`]: the virtual people |
//! | `recorded` | [`RecordedPeople`]: recordings listed in the manifest of a group |
//! | [`procedure`] | processing of one run |

mod people;
pub mod procedure;
mod recorded;

use hoid_model::{Record, scenario::Condition};
use rayon::prelude::*;

pub use people::{EXPERIMENT, ExperimentPlan};
pub use recorded::RecordedPeople;

use crate::ThesisError;
use procedure::{RunOutcome, evaluate};

/// Whose run it is, in which condition, and which.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunKey {
    /// Subject.
    pub subject: String,
    /// Condition.
    pub condition: String,
    /// Run within the subject and condition.
    pub run: String,
}

/// A condition of an experiment, and that of the text with the same course of the controlled element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExperimentCondition {
    /// Its name.
    pub name: String,
    /// The condition of the text.
    pub of_text: Condition,
}

/// A run with its times from the start of the measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRun {
    /// The measurement, from 0 s.
    pub record: Record,
    /// Time of a known change of the controlled element, s.
    pub change_s: Option<f64>,
}

/// People whose runs are evaluated.
pub trait Experiment: Send + Sync {
    /// The runs that are evaluated, by subject, condition and run.
    fn runs(&self) -> Vec<RunKey>;

    /// The conditions.
    fn conditions(&self) -> Vec<ExperimentCondition>;

    /// First and last delay tried, samples.
    fn delays(&self) -> (usize, usize);

    /// The record of a run.
    ///
    /// # Errors
    /// [`ThesisError::Study`] for a run that cannot be read or simulated.
    fn measured(&self, run: &RunKey) -> Result<MeasuredRun, ThesisError>;

    /// Number of estimates of a run: for each structure the fits of two spans with every delay and with the best one,
    /// and a recursive one.
    fn estimates_of_run(&self) -> u64 {
        let (first, last) = self.delays();
        2 * (2 * (last + 1).saturating_sub(first) as u64 + 2 + 1)
    }
}

/// An evaluated run.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedRun {
    /// Which.
    pub key: RunKey,
    /// Time of a known change of the controlled element, s.
    pub change_s: Option<f64>,
    /// The results.
    pub outcome: RunOutcome,
}

/// The runs of an experiment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evaluation {
    /// Evaluated runs, by subject, condition and run.
    pub runs: Vec<EvaluatedRun>,
    /// Runs that could not be evaluated, and why.
    pub failed: Vec<(RunKey, String)>,
}

/// Carries out an experiment. `each` is called after each run; runs are left out from the moment at which `goes_on` is
/// false.
pub fn experiment(
    people: &dyn Experiment,
    each: &(dyn Fn() + Sync),
    goes_on: &(dyn Fn() -> bool + Sync),
) -> Evaluation {
    let one = |key: RunKey| {
        if !goes_on() {
            return None;
        }
        let evaluated = people.measured(&key).and_then(|MeasuredRun { record, change_s }| {
            let outcome = evaluate(&record, people.delays())?;
            Ok((change_s, outcome))
        });
        each();
        Some((key, evaluated))
    };
    let all: Vec<_> = people.runs().into_par_iter().filter_map(one).collect();
    let mut found = Evaluation::default();
    for (key, evaluated) in all {
        match evaluated {
            Ok((change_s, outcome)) => found.runs.push(EvaluatedRun { key, change_s, outcome }),
            Err(error) => found.failed.push((key, error.to_string())),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn each_subject_has_the_last_runs_of_each_condition() {
        let plan = ExperimentPlan {
            subjects: 1,
            runs: 2,
            evaluated: 1,
            delays: (28, 30),
            ..ExperimentPlan::parse(EXPERIMENT).unwrap()
        };
        let found = experiment(&plan, &|| (), &|| true).runs;
        let conditions: Vec<&str> = found.iter().map(|run| run.key.condition.as_str()).collect();
        assert_eq!(conditions, ["C1", "C2", "C3", "C4", "C5", "C6"]);
        assert!(
            found
                .iter()
                .all(|run| (run.key.subject.as_str(), run.key.run.as_str()) == ("1", "2"))
        );
        // The true values of a run are those of its person: the same in both spans of C1.
        let truth = |run: &EvaluatedRun| run.outcome.truth.unwrap().states.map(|state| state.discrete);
        let [first, last] = truth(&found[0]);
        assert_eq!(first, last);
        let [first, last] = truth(&found[2]);
        assert_ne!(first, last);
        assert_eq!(experiment(&plan, &|| (), &|| false), Evaluation::default());
    }
}
