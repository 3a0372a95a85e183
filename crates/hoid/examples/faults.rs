//! Effect of a fault in a recording on a result, and whether the result reports the fault. The program prints the
//! numbers of the page `research/notes/faults.md`.
//!
//! `cargo xtask slow faults [--part N] [--clean N] [--only METHOD] [--rows FILE] [--program FILE] [--seed N]`:
//! evaluates all faults in runs of C1, of C2 and of a virtual person, and then clean runs (by default 1000 in total,
//! each evaluated in batch and by one tracker). `--part` uses only every N-th case and clean run, `--rows` writes a CSV
//! row for each result, and `--program` is the program that is assessed (by default the program built in the same
//! folder as this example).
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

#[allow(dead_code)]
#[path = "../tests/common/fault_corpus/mod.rs"]
mod fault_corpus;

use std::{path::PathBuf, time::Instant};

use fault_corpus::{
    bases::OperatorKind,
    kinds::{Fault, faults},
    program::{EvaluationMethod, Outcome, evaluate_case},
    summary::{clean_run_table, recovery_table, table_by_fault, table_by_method, to_csv},
};
use rayon::prelude::*;

/// Seed of the numbers in `research/notes/faults.md`; the tests have other seeds.
const SEED: u64 = 2121;
/// First number of the clean runs; no case with a fault has such a number.
const FIRST_CLEAN_NUMBER: u64 = 100_000;

fn main() {
    let (mut part, mut number, mut rows, mut program, mut seed) = (1, 1000, None, built_program_path(), SEED);
    let mut ways = EvaluationMethod::ALL.to_vec();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().unwrap();
        match argument.as_str() {
            "--part" => part = value().parse::<usize>().unwrap(),
            "--clean" => number = value().parse::<u64>().unwrap(),
            "--rows" => rows = Some(PathBuf::from(value())),
            "--program" => program = PathBuf::from(value()),
            "--seed" => seed = value().parse().unwrap(),
            "--only" => {
                let wanted = value();
                ways.retain(|way| way.name() == wanted);
            }
            other => panic!("{other}: there is --part, --clean, --rows, --program, --seed and --only"),
        }
    }
    let start_time = Instant::now();
    let cases: Vec<(u64, Fault, OperatorKind)> = (0..)
        .zip(faults())
        .step_by(part)
        .flat_map(|(case, fault)| OperatorKind::ALL.map(|who| (case, fault, who)))
        .collect();
    let faulty: Vec<Outcome> = cases
        .into_par_iter()
        .flat_map_iter(|(case, fault, who)| evaluate_case(&program, seed, case, fault, who, &ways).unwrap())
        .collect();
    // Half of the clean runs are of people, a quarter of C1 and a quarter of C2.
    let sound: Vec<Outcome> = (0..number)
        .step_by(part)
        .collect::<Vec<_>>()
        .into_par_iter()
        .flat_map_iter(|i| {
            let i = i / part as u64;
            let who = [
                OperatorKind::C1,
                OperatorKind::Person,
                OperatorKind::C2,
                OperatorKind::Person,
            ][i as usize % 4];
            // The kinds of people are used in turn, according to the number of the case.
            let case = FIRST_CLEAN_NUMBER + i / 2;
            let tracker = [
                EvaluationMethod::MultipleModel,
                EvaluationMethod::Physical,
                EvaluationMethod::Rpem,
                EvaluationMethod::Rls,
            ][i as usize / 4 % 4];
            let batch = [EvaluationMethod::GreyBox, EvaluationMethod::BoxJenkins][i as usize / 4 % 2];
            let such: Vec<EvaluationMethod> = ways
                .iter()
                .copied()
                .filter(|way| who == OperatorKind::Person || [tracker, batch].contains(way))
                .collect();
            evaluate_case(&program, seed, case, Fault::NO_FAULT, who, &such).unwrap()
        })
        .collect();
    if let Some(file) = rows {
        let all: Vec<Outcome> = faulty.iter().chain(&sound).cloned().collect();
        std::fs::write(file, to_csv(&all)).unwrap();
    }
    println!("## With a fault\n\n{}", table_by_method(&faulty));
    println!(
        "Wrong, wrong and not flagged, right and flagged, of how many:\n\n{}",
        table_by_fault(&faulty)
    );
    println!("## How long trackers take\n\n{}", recovery_table(&faulty));
    println!("## Clean runs\n\n{}", clean_run_table(&sound));
    let longest = faulty.iter().chain(&sound).map(|o| o.seconds).fold(0.0, f64::max);
    println!(
        "{} faults, {} results with a fault, {} without; {:.0} s in all, {longest:.1} s the longest",
        faults().len(),
        faulty.len(),
        sound.len(),
        start_time.elapsed().as_secs_f64()
    );
}

/// Path of the program in the build folder of this example.
fn built_program_path() -> PathBuf {
    let here = std::env::current_exe().unwrap();
    let folder = here.parent().unwrap().parent().unwrap();
    folder.join("hoid").with_extension(std::env::consts::EXE_EXTENSION)
}
