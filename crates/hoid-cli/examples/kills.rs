//! Kills studies, groups and reproductions at random instants, or damages their blocks between two kills, resumes them,
//! and checks that their results have the same bytes. The program prints the numbers of the page
//! `research/notes/mutations.md`.
//!
//! `cargo xtask slow kills [--kills N] [--damaged N] [--seed N] [--only study|group|reproduce] [--program FILE]`: the
//! arguments give the number of kills by SIGKILL, which prevents any clean-up, and of damaged blocks. Instants and
//! damage are drawn from the seed; the state of the program at an instant depends on the machine.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/draw.rs"]
mod draw;
#[path = "../tests/common/interrupted.rs"]
mod interrupted;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, ExitCode},
    thread,
    time::{Duration, Instant},
};

use draw::Draw;
use interrupted::{Bench, GROUP, REPRODUCE, STUDY, built_program_path, compare, read_files};

/// Number of kills of one run before it may finish.
const MAX_CONSECUTIVE_KILLS: usize = 5;

fn main() -> ExitCode {
    let (mut kills, mut damaged, mut seed, mut program, mut only) = (200, 50, 1, built_program_path(), None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().unwrap();
        match argument.as_str() {
            "--kills" => kills = value().parse().unwrap(),
            "--damaged" => damaged = value().parse().unwrap(),
            "--seed" => seed = value().parse().unwrap(),
            "--only" => only = Some(value()),
            "--program" => program = value().into(),
            other => panic!("{other}: there is --kills, --damaged, --seed, --only and --program"),
        }
    }
    let directory = tempfile::tempdir().unwrap();
    let bench = Bench::new(program, directory.path());
    let mut draw = Draw(seed);
    let mut failures = Vec::new();
    for (k, work) in [STUDY, GROUP, REPRODUCE].iter().enumerate() {
        if only.as_ref().is_some_and(|name| name != work.name) {
            continue;
        }
        let start_time = Instant::now();
        bench.run_to_end(work, "whole");
        // The duration of a run depends on the load of the machine: after a kill that was too late, the following kills
        // are earlier.
        let mut took = start_time.elapsed();
        let expected = read_files(&bench.output_path(work, "whole"));
        // The remainder of the division by three is assigned to the first works.
        let share = |all: usize, of: usize| all / of + usize::from(k < all % of);
        let (mut killed, mut runs) = (0, 0);
        while killed < share(kills, 3) {
            runs += 1;
            let name = format!("killed-{runs}");
            for _ in 0..MAX_CONSECUTIVE_KILLS.min(share(kills, 3) - killed) {
                let child = bench.start(work, &name);
                let hit = kill(child, took.mul_f64(draw.uniform()));
                killed += usize::from(hit);
                if !hit {
                    took = took.mul_f64(0.8);
                    break;
                }
            }
            let start_time = Instant::now();
            bench.run_to_end(work, &name);
            took = took.max(start_time.elapsed());
            failures.extend(compare(
                &expected,
                &bench.output_path(work, &name),
                &format!("{} {name}", work.name),
            ));
            fs::remove_dir_all(bench.output_path(work, &name)).unwrap();
        }
        let mut hit = 0;
        let mut tries = 0;
        while work.has_parts && hit < share(damaged, 2) {
            tries += 1;
            let name = format!("damaged-{tries}");
            let child = bench.start(work, &name);
            if !kill(child, took.mul_f64(0.1 + 0.8 * draw.uniform())) {
                took = took.mul_f64(0.8);
            }
            let what = damage(&bench.output_path(work, &name).join("parts"), &mut draw);
            hit += usize::from(what.is_some());
            let start_time = Instant::now();
            bench.run_to_end(work, &name);
            took = took.max(start_time.elapsed());
            let description = format!("{} {name} ({})", work.name, what.unwrap_or("no block yet"));
            failures.extend(compare(&expected, &bench.output_path(work, &name), &description));
            fs::remove_dir_all(bench.output_path(work, &name)).unwrap();
        }
        println!(
            "{}: {killed} kills over {runs} runs, {hit} blocks damaged in {tries}; {} files compared each, {} failures so far",
            work.name,
            expected.len(),
            failures.len()
        );
    }
    failures.iter().for_each(|failure| println!("{failure}"));
    if failures.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// True if the process was still running.
fn kill(mut child: Child, after: Duration) -> bool {
    thread::sleep(after);
    let _ = child.kill();
    !child.wait().unwrap().success()
}

/// Damages one file of a block; returns the kind of damage, or `None` if there is no block yet.
fn damage(parts: &Path, draw: &mut Draw) -> Option<&'static str> {
    let mut all: Vec<PathBuf> = fs::read_dir(parts).ok()?.map(|entry| entry.unwrap().path()).collect();
    all.retain(|path| !path.file_name().unwrap().to_str().unwrap().starts_with('.') && path.is_file());
    all.sort();
    if all.is_empty() {
        return None;
    }
    let path = &all[draw.integer_below(all.len())];
    let mut bytes = fs::read(path).unwrap();
    let what = match draw.integer_below(5) {
        0 if !bytes.is_empty() => {
            let at = draw.integer_below(bytes.len());
            bytes[at] ^= 1 << draw.integer_below(8);
            "a bit"
        }
        1 => {
            bytes.truncate(draw.integer_below(bytes.len()));
            "cut"
        }
        2 => {
            bytes = fs::read(&all[draw.integer_below(all.len())]).unwrap();
            "another file in its place"
        }
        3 => {
            fs::remove_file(path).unwrap();
            return Some("removed");
        }
        _ => {
            bytes.clear();
            "emptied"
        }
    };
    fs::write(path, bytes).unwrap();
    Some(what)
}
