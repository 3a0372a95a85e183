//! The challenge (`hoid_challenge`): tracking methods in cases that can refute them.
//!
//! `cargo xtask slow challenge [--cases NAME,...] [--methods NAME,...] [--seeds open|sealed] [--runs N] [--part I/N]
//! [--out DIRECTORY] [--page FILE --measured TEXT] [--list]`: by default 4 runs of every case, all entrants, the open
//! seeds, and lines of JSON in `challenge-results/`. Existing results are not computed again. A case is selected by its
//! name, the start of its name (`none-`) or its theme. `--page` writes `research/notes/challenge.md`; `--list` only
//! lists the cases.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::{path::PathBuf, process::ExitCode};

use hoid_challenge::{ChallengeOptions, Portion, Seeds, cases, challenge, entrants, page, tables};

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let mut options = ChallengeOptions {
        directory: PathBuf::from("challenge-results"),
        seeds: Seeds::Open,
        runs: 4,
        cases: Vec::new(),
        methods: Vec::new(),
        portion: Portion::WHOLE,
    };
    let (mut file, mut measured) = (None, None);
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        if name == "--list" {
            for case in cases() {
                println!("{:28} {:20} {}", case.name, case.theme.to_string(), case.meaning);
            }
            let names: Vec<String> = entrants().iter().map(|c| c.name()).collect();
            println!("\ncontestants: {}, batch", names.join(", "));
            return Ok(());
        }
        let value = arguments.next().ok_or(format!("{name} needs a value"))?;
        let list = || value.split(',').map(|name| name.trim().to_owned()).collect();
        match name.as_str() {
            "--cases" => options.cases = list(),
            "--methods" => options.methods = list(),
            "--seeds" => options.seeds = value.parse().map_err(|e| format!("{e}"))?,
            "--runs" => {
                options.runs = value
                    .parse()
                    .map_err(|_| format!("--runs {value}: expected a number"))?
            }
            "--part" => options.portion = value.parse()?,
            "--out" => options.directory = PathBuf::from(value),
            "--page" => file = Some(PathBuf::from(value)),
            "--measured" => measured = Some(value),
            _ => return Err(format!("{name} is not an option; see the head of this example")),
        }
    }
    let lines = challenge(&options, &|run| eprintln!("{run}")).map_err(|e| e.to_string())?;
    println!("{}", tables(&lines));
    if let Some(file) = file {
        let default = format!("{} runs of each case, {} seeds.", options.runs, options.seeds);
        let text = page(&lines, &measured.unwrap_or(default));
        std::fs::write(&file, text).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    Ok(())
}
