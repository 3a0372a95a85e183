//! The experiment of section VI and appendix I of the thesis, with virtual or recorded people.
//!
//! The recordings of the thesis come from three subjects in a simulator and are not public. The procedure of the thesis
//! can be applied to virtual people with known parameters (three different subjects, seven runs in each of C1 to C6, of
//! which the last five are evaluated), and to the user's own recordings. For each run ([`procedure`]):
//!
//! 1. Batch fits to the first and the last three eighths of the run, [0, 30.72] and [51.20, 81.92] s in the thesis: ARX
//!    by OLS and BJ(m* = 1) by PEM, with every delay in a range. In each span, the delay with the highest VAF is
//!    selected. The n_k* of the run and structure is the rounded mean of the two selected delays; T_n* is the mean of
//!    the remnant time constants of the two fits (the thesis: *the average between the best two sub-batch-fitting
//!    estimations made*).
//! 2. With this n_k*, the OLS and PEM fits to both spans are repeated.
//! 3. RLS and RPEM with lambda = 1 - 1/256 and P0 = 0.1 I track the run, starting from the fit of the first span. T_n*
//!    is only reported in Table 3: d1 is a parameter of RPEM and starts from the value in its fit, as in section V.B.
//!
//! Figures show the average over the five runs, as in the thesis, and also the median.
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

pub use people::{EXPERIMENT_PLAN, ExperimentPlan};
pub use recorded::RecordedPeople;

use crate::ThesisError;
use procedure::{RunOutcome, evaluate};

/// Identification of a run: subject, condition and number of the run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunKey {
    /// Subject.
    pub subject: String,
    /// Condition.
    pub condition: String,
    /// Run of the subject in the condition.
    pub run: String,
}

/// A condition of an experiment, and the condition of the thesis in which the controlled element changes in the same
/// way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExperimentCondition {
    /// Name of the condition in the experiment.
    pub name: String,
    /// Corresponding condition of the thesis.
    pub thesis_condition: Condition,
}

/// A run whose times are counted from the start of the measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRun {
    /// The measurement; it starts at 0 s.
    pub record: Record,
    /// Time of a known change in the controlled element, s.
    pub change_s: Option<f64>,
}

/// People whose runs are evaluated.
pub trait Experiment: Send + Sync {
    /// The runs that are evaluated, ordered by subject, condition and run.
    fn runs(&self) -> Vec<RunKey>;

    /// The conditions of the experiment.
    fn conditions(&self) -> Vec<ExperimentCondition>;

    /// First and last delay that is tried, samples.
    fn delays(&self) -> (usize, usize);

    /// The record of a run.
    ///
    /// # Errors
    /// [`ThesisError::Study`] if the run cannot be read or simulated.
    fn read_run(&self, run: &RunKey) -> Result<MeasuredRun, ThesisError>;

    /// Number of estimates for a run: for each structure, the fits to two spans with every delay and with n_k*, and one
    /// recursive estimate.
    fn estimate_count_per_run(&self) -> u64 {
        let (first, last) = self.delays();
        2 * (2 * (last + 1).saturating_sub(first) as u64 + 2 + 1)
    }
}

/// An evaluated run.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedRun {
    /// Identification of the run.
    pub key: RunKey,
    /// Time of a known change in the controlled element, s.
    pub change_s: Option<f64>,
    /// Results for the run.
    pub outcome: RunOutcome,
}

/// Results of all runs of an experiment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evaluation {
    /// Evaluated runs, ordered by subject, condition and run.
    pub runs: Vec<EvaluatedRun>,
    /// Runs that could not be evaluated, with the reason.
    pub failed: Vec<(RunKey, String)>,
}

/// Evaluates the runs of an experiment. `each` is called after each run. Once `keep_running` returns false, the
/// remaining runs are omitted.
pub fn experiment(
    people: &dyn Experiment,
    each: &(dyn Fn() + Sync),
    keep_running: &(dyn Fn() -> bool + Sync),
) -> Evaluation {
    let one = |key: RunKey| {
        if !keep_running() {
            return None;
        }
        let evaluated = people.read_run(&key).and_then(|MeasuredRun { record, change_s }| {
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
    fn last_runs_of_each_condition_are_evaluated() {
        let plan = ExperimentPlan {
            subjects: 1,
            runs: 2,
            evaluated: 1,
            delays: (28, 30),
            ..ExperimentPlan::parse(EXPERIMENT_PLAN).unwrap()
        };
        let found = experiment(&plan, &|| (), &|| true).runs;
        let conditions: Vec<&str> = found.iter().map(|run| run.key.condition.as_str()).collect();
        assert_eq!(conditions, ["C1", "C2", "C3", "C4", "C5", "C6"]);
        assert!(
            found
                .iter()
                .all(|run| (run.key.subject.as_str(), run.key.run.as_str()) == ("1", "2"))
        );
        // The true values of a run are the parameters of its person, which are the same in both spans of C1.
        let truth = |run: &EvaluatedRun| run.outcome.truth.unwrap().states.map(|state| state.discrete);
        let [first, last] = truth(&found[0]);
        assert_eq!(first, last);
        let [first, last] = truth(&found[2]);
        assert_ne!(first, last);
        assert_eq!(experiment(&plan, &|| (), &|| false), Evaluation::default());
    }
}
