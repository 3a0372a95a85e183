//! The tables of `research/notes/survey-methods.md`:
//!
//! `cargo run --release -p hoid-evidence --example survey_methods > survey-methods.md`
//!
//! or, for custom plans, `... --example survey_methods -- my-survey.toml my-comparators.toml`. A method can be tuned on
//! other runs by changing the seed in a copy of the plan.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

use hoid_thesis::{
    plans::SURVEY,
    survey::{COMPARATOR_PLAN, SurveyPlan, survey, survey_tables},
};

fn main() {
    let text = |index: usize, default: &str| {
        let path = std::env::args().nth(index);
        path.map_or_else(|| default.to_owned(), |path| std::fs::read_to_string(path).unwrap())
    };
    let path = std::env::args().nth(1);
    let (study, comparators) = (text(1, SURVEY.text), text(2, COMPARATOR_PLAN));
    let plan = match SurveyPlan::parse(&study, &comparators, path.as_deref().unwrap_or("survey.toml")) {
        Ok(plan) => plan,
        Err(error) => {
            eprintln!("{error}");
            std::process::exit(2);
        }
    };
    let found = survey(&plan, &|run| eprintln!("{run}")).unwrap();
    for of in &found {
        for reason in of.runs.iter().filter_map(|run| run.as_ref().err()) {
            eprintln!("{}, cell {}: {reason}", of.name, of.cell);
        }
    }
    println!(
        "{} runs of each cell, seed {}\n",
        plan.study.replications, plan.study.seed
    );
    println!("{}", survey_tables(&plan, &found));
}
