//! The experiment of section VI and appendix I of the thesis, with virtual people.
//!
//! The recordings of the text are of three subjects in a simulator and are not public. Its
//! procedure can be applied to virtual people with known parameters: three different subjects,
//! seven runs in each of C1 to C6, of which the last five are evaluated. For each run
//! ([`procedure`]):
//!
//! 1. Batch fits of [0, 30.72] and [51.20, 81.92] s, ARX by OLS and BJ(m* = 1) by PEM, with every
//!    delay of a range. In each span the delay with the highest VAF is the best; the n_k* of the
//!    run and structure is the mean of the two, rounded, and T_n* that of their two time constants
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
//! | [`procedure`] | what is done with one run |

mod people;
pub mod procedure;

use hoid_model::scenario::Condition;
use rayon::prelude::*;

pub use people::{EXPERIMENT, ExperimentPlan};

use crate::ThesisError;
use procedure::{RunOutcome, evaluate};

/// An evaluated run.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedRun {
    /// Subject, from 1.
    pub subject: u64,
    /// Condition.
    pub condition: Condition,
    /// Run, from 1, within the subject and condition.
    pub run: u64,
    /// The results.
    pub outcome: RunOutcome,
}

/// Carries out an experiment: the evaluated runs, by subject, condition and run.
///
/// # Errors
/// [`ThesisError`] for people without stable loops and models that cannot be fitted.
pub fn experiment(plan: &ExperimentPlan) -> Result<Vec<EvaluatedRun>, ThesisError> {
    let mut all = Vec::new();
    for subject in 1..=plan.subjects {
        for condition in ExperimentPlan::CONDITIONS {
            for run in plan.runs - plan.evaluated + 1..=plan.runs {
                all.push((subject, condition, run));
            }
        }
    }
    let one = |(subject, condition, run): (u64, Condition, u64)| {
        let record = plan.record(subject, condition, run)?;
        Ok(EvaluatedRun {
            subject,
            condition,
            run,
            outcome: evaluate(&record, plan.delays)?,
        })
    };
    all.into_par_iter().map(one).collect()
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
        let found = experiment(&plan).unwrap();
        let conditions: Vec<Condition> = found.iter().map(|run| run.condition).collect();
        assert_eq!(conditions, ExperimentPlan::CONDITIONS);
        assert!(found.iter().all(|run| (run.subject, run.run) == (1, 2)));
        // The true values of a run are those of its person: the same in both spans of C1.
        let [first, last] = found[0].outcome.truth.map(|state| state.discrete);
        assert_eq!(first, last);
        assert_ne!(found[2].outcome.truth[0].discrete, found[2].outcome.truth[1].discrete);
    }
}
