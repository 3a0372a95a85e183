//! The challenge on recorded people (`hoid_challenge`, `people`).
//!
//! `cargo xtask slow challenge-people [--kinds fo-so,...] [--methods NAME,...] [--runs N] [--part I/N] [--out
//! DIRECTORY]`; the environment variable `HOID_HUMAN_DATA` names the directory of the recordings, which are not part of
//! the project. Its results must not be stored in the project either.
#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::{path::PathBuf, process::ExitCode};

use hoid_challenge::{PeopleOptions, Portion, challenge_people, tables};

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
    let recordings = std::env::var_os("HOID_HUMAN_DATA")
        .map(PathBuf::from)
        .ok_or("HOID_HUMAN_DATA does not name the directory of the recordings")?;
    let mut options = PeopleOptions {
        recordings,
        directory: PathBuf::from("challenge-results"),
        runs: usize::MAX,
        kinds: Vec::new(),
        methods: Vec::new(),
        portion: Portion::WHOLE,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or(format!("{name} needs a value"))?;
        let list = || value.split(',').map(|name| name.trim().to_owned()).collect();
        match name.as_str() {
            "--kinds" => options.kinds = list(),
            "--methods" => options.methods = list(),
            "--runs" => {
                options.runs = value
                    .parse()
                    .map_err(|_| format!("--runs {value}: expected a number"))?
            }
            "--part" => options.portion = value.parse()?,
            "--out" => options.directory = PathBuf::from(value),
            _ => return Err(format!("{name} is not an option; see the head of this example")),
        }
    }
    let lines = challenge_people(&options, &|run| eprintln!("{run}")).map_err(|e| e.to_string())?;
    println!("{}", tables(&lines));
    Ok(())
}
