//! The tables of the page "The survey's methods" of the book:
//!
//! `cargo run --release -p hoid-evidence --example survey_methods > survey-methods.md`
//!
//! or, of a plan of one's own, `... --example survey_methods -- my-survey.toml`. Method by method it
//! can be tuned on other runs by another seed in a copy of the plan.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

use hoid_thesis::survey::{SURVEY, SurveyPlan, survey, survey_tables};

fn main() {
    let path = std::env::args().nth(1);
    let text = path
        .as_ref()
        .map_or_else(|| SURVEY.to_owned(), |path| std::fs::read_to_string(path).unwrap());
    let plan = match SurveyPlan::parse(&text, path.as_deref().unwrap_or("survey.toml")) {
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
