//! The experiment with virtual or recorded people: Table 3, Figs. 13, 14 and I.1 to I.18.
//!
//! All items of the experiment show the same runs, which are made once, before the first item is drawn. A figure of
//! recorded people has the number of the figure in the thesis in which the controlled element changes in the same way,
//! followed by the name of the condition if it differs from that in the thesis.
//!
//! | module | contents |
//! |---|---|
//! | `figures` | quantities over time: mean and median over the runs |
//! | `run_selection` | the runs of a subject, their mean and median |
//! | `tables` | Table 3 (for recorded people also with all conditions), and the operators before and after the change |

mod figures;
mod run_selection;
mod tables;

use std::sync::{Arc, OnceLock};

use hoid_model::scenario::Condition;

use super::item::{Item, ItemOutput, ProgressCallbacks, SharedRuns};
use crate::{
    ThesisError,
    experiment::{
        EXPERIMENT_PLAN, EvaluatedRun, Evaluation, Experiment, ExperimentCondition, ExperimentPlan, RecordedPeople,
        experiment,
    },
};
use figures::{DISCRETE, OPERATOR, Row, VARIANCES};

/// Name of the experiment.
pub(super) const NAME: &str = "experiment";

/// The runs of the experiment, which are made only once.
#[derive(Clone)]
struct Runs {
    people: Arc<dyn Experiment>,
    evaluation: Arc<OnceLock<Evaluation>>,
}

impl Runs {
    fn new(people: impl Experiment + 'static) -> Self {
        Self {
            people: Arc::new(people),
            evaluation: Arc::default(),
        }
    }

    fn get(&self, watch: &ProgressCallbacks<'_>) -> &Evaluation {
        let estimates = self.people.estimate_count_per_run();
        self.evaluation.get_or_init(|| {
            experiment(
                self.people.as_ref(),
                &|| (watch.completed)(estimates),
                watch.should_continue,
            )
        })
    }

    /// Returns the runs in the form in which items share them.
    fn to_shared_runs(&self, title: &'static str) -> SharedRuns {
        let runs = self.clone();
        SharedRuns {
            name: NAME,
            title,
            estimates: self.people.estimate_count_per_run() * self.people.runs().len() as u64,
            make_runs: Arc::new(move |watch| failure_notes(runs.get(watch))),
        }
    }

    /// Creates an item that is made from the runs.
    fn item(
        &self,
        (name, title, caption): (String, String, &str),
        make: impl Fn(&Item, &[EvaluatedRun]) -> ItemOutput + Send + Sync + 'static,
    ) -> Item {
        let runs = self.clone();
        let made =
            move |item: &Item, _: Option<&hoid_study::Results>| make(item, &runs.get(&ProgressCallbacks::IGNORED).runs);
        Item::new(name, title, caption, None, made)
    }
}

/// Returns the reasons why runs could not be evaluated; an error if no run could be evaluated.
fn failure_notes(found: &Evaluation) -> Result<Vec<String>, ThesisError> {
    let note = |(key, reason): &(crate::experiment::RunKey, String)| {
        format!("run {} of {} in {}: {reason}", key.run, key.subject, key.condition)
    };
    match (found.runs.first(), found.failed.first()) {
        (None, Some(first)) => Err(ThesisError::Recordings {
            subject: NAME.to_owned(),
            reason: format!(
                "none of the {} runs can be evaluated; first failure: {}",
                found.failed.len(),
                note(first)
            ),
        }),
        _ => Ok(found.failed.iter().map(note).collect()),
    }
}

/// Items for the virtual people.
pub(super) fn items() -> Vec<Item> {
    let Ok(plan) = ExperimentPlan::parse(EXPERIMENT_PLAN) else {
        return Vec::new();
    };
    let runs = Runs::new(plan);
    let shared = runs.to_shared_runs("The experiment with virtual people");
    let mut all = vec![runs.item(
        (
            "table-3".to_owned(),
            "Model parameters n_k* and T_n* used in each run and model structure (virtual people)".to_owned(),
            "Mean of the values from the best fits to [0, 30.72] and [51.20, 81.92] s, condition C4, with the true n_k of the subject.",
        ),
        |item, runs| tables::delays(item, runs, &["C4".to_owned()]),
    )];
    all.extend(condition_figures(
        &runs,
        "virtual people",
        "Three virtual subjects, mean (dark) and median (light) over the last five of seven runs at each time; the \
         thesis shows the mean. Dashed in colour: mean of the batch fits to [0, 30.72] and [51.20, 81.92] s; dashed \
         black: mean of the simulated operator over the runs.",
    ));
    all.into_iter().map(|item| item.with_shared_runs(&shared)).collect()
}

/// Items for recorded people.
pub(super) fn recorded_items(people: RecordedPeople) -> Vec<Item> {
    const DELAYS_CAPTION: &str = "Mean of the values from the best fits to the first and last three eighths of a run, with \
                          the value from each fit.";
    let name = people.name().to_owned();
    let runs = Runs::new(people);
    let shared = runs.to_shared_runs("The experiment with recorded people");
    let conditions = runs.people.conditions();
    let names = |wanted: &dyn Fn(&ExperimentCondition) -> bool| -> Vec<String> {
        let own = conditions.iter().filter(|condition| wanted(condition));
        own.map(|condition| condition.name.clone()).collect()
    };
    let of_table_3 = names(&|condition| condition.thesis_condition == Condition::C4);
    let every = names(&|_| true);
    let title =
        |what: &str| format!("Model parameters n_k* and T_n* used in each run and model structure, {what} ({name})");
    let mut all = Vec::new();
    if !of_table_3.is_empty() {
        all.push(runs.item(
            (
                "table-3".to_owned(),
                title("sudden change from s1 to s2"),
                DELAYS_CAPTION,
            ),
            move |item, runs| tables::delays(item, runs, &of_table_3),
        ));
    }
    let conditions = every.clone();
    all.push(runs.item(
        ("table-3-all".to_owned(), title("all conditions"), DELAYS_CAPTION),
        move |item, runs| tables::delays(item, runs, &every),
    ));
    all.push(runs.item(
        (
            "operators".to_owned(),
            format!("Operators before and after ({name})"),
            "Median over the runs of a person. OLS and PEM: batch fits to the first and last three eighths; RLS and \
             RPEM: median over the second half of each of these spans. determined: share of the runs whose model \
             can be converted to an operator.",
        ),
        move |item, runs| tables::operators(item, runs, &conditions),
    ));
    all.extend(condition_figures(
        &runs,
        &name,
        "Recorded people, mean (dark) and median (light) over the last five runs of each person at each time; the \
         thesis shows the mean. Thick dots: mean of the batch fits to the first and last three eighths of a run; \
         dotted vertical line: the change of the controlled element. Outliers beyond the range of a vertical axis are \
         clipped, but the data file contains them.",
    ));
    all.into_iter().map(|item| item.with_shared_runs(&shared)).collect()
}

/// Figs. 13, 14 and I.1 to I.18 for the available conditions.
fn condition_figures(runs: &Runs, people: &str, caption: &str) -> Vec<Item> {
    let [discrete, operator, variances] = [
        (
            "Recursive ARX and Box-Jenkins (m* = 1) estimates, discrete parameters",
            &DISCRETE[..],
        ),
        (
            "Recursive ARX and Box-Jenkins (m* = 1) estimates, operator parameters",
            &OPERATOR,
        ),
        ("Covariance of RPEM, Box-Jenkins (m* = 1)", &VARIANCES),
    ];
    let mut all = Vec::new();
    for condition in runs.people.conditions() {
        let of_text = condition.thesis_condition;
        let mut figure = |number: String, (what, rows): (&str, &'static [Row])| {
            let (name, title) = figure_name_and_title(&number, what, &condition, people);
            let own = condition.name.clone();
            let make = move |item: &Item, runs: &[EvaluatedRun]| figures::draw(item, runs, (&own, of_text), rows);
            all.push(runs.item((name, title, caption), make));
        };
        if of_text == Condition::C4 {
            figure("fig-13".to_owned(), discrete);
            figure("fig-14".to_owned(), operator);
        }
        let i = ExperimentPlan::CONDITIONS
            .iter()
            .position(|of| *of == of_text)
            .unwrap_or(0);
        for (k, what) in [discrete, operator, variances].into_iter().enumerate() {
            figure(format!("I.{}", 3 * i + k + 1), what);
        }
    }
    all
}

/// Name and title of a figure.
fn figure_name_and_title(number: &str, what: &str, condition: &ExperimentCondition, people: &str) -> (String, String) {
    let ExperimentCondition {
        name,
        thesis_condition: of_text,
    } = condition;
    if *name == of_text.to_string() {
        return (number.to_owned(), format!("{what}, condition {name} ({people})"));
    }
    let in_a_file_name = |c: char| if c.is_ascii_alphanumeric() || c == '_' { c } else { '-' };
    let suffix: String = name.chars().map(in_a_file_name).collect();
    (
        format!("{number}-{suffix}"),
        format!("{what}, condition {name}, {of_text} in the thesis ({people})"),
    )
}

#[cfg(test)]
mod tests;
