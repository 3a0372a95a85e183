//! Measures the response time of `hoid stream` to a sample, and its behaviour if readers stop, either side restarts,
//! clocks jump or datagrams are hostile. The program prints the numbers of `research/notes/latency.md`.
//!
//! `cargo xtask slow latency [--seconds N] [--seed N] [--program FILE] [--python FILE]`: measures each transport and
//! rate for 600 s by default, including LabStreamingLayer if the interpreter has pyhoid and pylsl, as the interpreter
//! of `cargo xtask places` does. The program fails if a lost sample is not counted, or if a sample is lost although
//! neither side stopped, but never because of a response time.
#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../tests/common/live/mod.rs"]
mod live;

use std::{
    path::{Path, PathBuf},
    process::{Command, ExitCode},
    time::Duration,
};

use live::{
    Draw,
    paced::{Tally, measure_pipes, measure_udp},
    troubles,
};

const RATES_HZ: [usize; 2] = [100, 1000];
/// Duration of a pause of a reader.
const READER_PAUSE: Duration = Duration::from_secs(2);
const HOSTILE_COUNT: usize = 20_000;

fn main() -> ExitCode {
    let (mut seconds, mut seed, mut program, mut python) = (600, 1, built_program_path(), None);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().unwrap();
        match argument.as_str() {
            "--seconds" => seconds = value().parse().unwrap(),
            "--seed" => seed = value().parse().unwrap(),
            "--program" => program = value().into(),
            "--python" => python = Some(PathBuf::from(value())),
            other => panic!("{other}: there is --seconds, --seed, --program and --python"),
        }
    }
    let mut draw = Draw(seed);
    println!("| way | rate | sent | answered | median | 99 % | 99.9 % | longest |");
    println!("|---|---:|---:|---:|---:|---:|---:|---:|");
    let mut lost = 0;
    for rate_hz in RATES_HZ {
        let n = seconds * rate_hz;
        let udp = measure_udp(&program, rate_hz, n, &mut draw);
        let pipe = measure_pipes(&program, rate_hz, n, &mut draw, Duration::ZERO);
        for (way, tally) in [("UDP, structs", &udp), ("pipes, lines", &pipe)] {
            println!("{}", row(way, rate_hz, tally));
            lost += tally.lost_count() + tally.summary.skipped + tally.summary.dropped;
        }
        match measure_lsl(python.clone().unwrap_or_else(interpreter), rate_hz, seconds) {
            Ok((row, missing)) => {
                println!("{row}");
                lost += missing;
            }
            Err(reason) => println!("| LabStreamingLayer | {rate_hz} Hz | not here: {reason} | | | | | |"),
        }
    }
    println!("\n| what | sent | answered | bridged | dropped |\n|---|---:|---:|---:|---:|");
    for found in troubles::run_all_cases(&program, READER_PAUSE, HOSTILE_COUNT, &mut draw) {
        let summary = found.summary;
        println!(
            "| {} | {} | {} | {} | {} |",
            found.what, found.sent, found.answered, summary.missing, summary.dropped
        );
    }
    println!("\n{lost} samples lost while no one stopped.");
    if lost == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn row(way: &str, rate_hz: usize, tally: &Tally) -> String {
    let times = [0.5, 0.99, 0.999, 1.0].map(|share| format_ms(tally.latency_quantile(share)));
    format!(
        "| {way} | {rate_hz} Hz | {} | {} | {} |",
        tally.sent,
        tally.trips.len(),
        times.join(" | ")
    )
}

fn format_ms(time: Duration) -> String {
    format!("{:.2} ms", 1e3 * time.as_secs_f64())
}

/// Returns the table row for LabStreamingLayer and the number of lost samples, or the reason why there is no row.
fn measure_lsl(python: PathBuf, rate_hz: usize, seconds: usize) -> Result<(String, usize), String> {
    let output = Command::new(python)
        .args(["-m", "places.pace", &rate_hz.to_string(), &seconds.to_string()])
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../python/tests"))
        .output()
        .map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let (row, missing) = text
        .trim()
        .rsplit_once('\n')
        .ok_or_else(|| "there is no Python with pyhoid and pylsl".to_owned())?;
    Ok((row.to_owned(), missing.parse().unwrap()))
}

/// Returns the folder of the build profile of this example.
fn profile_folder() -> PathBuf {
    let path = std::env::current_exe().unwrap();
    path.ancestors().nth(2).unwrap().to_owned()
}

/// Returns the path of the program built with this example.
fn built_program_path() -> PathBuf {
    profile_folder().join(format!("hoid{}", std::env::consts::EXE_SUFFIX))
}

/// Returns the interpreter installed by `cargo xtask places` or by the tests.
fn interpreter() -> PathBuf {
    let of = |environment: &str| profile_folder().join("../python").join(environment).join("bin/python");
    let found = ["venv-shipped", "venv"].map(of).into_iter().find(|path| path.exists());
    found.unwrap_or_else(|| PathBuf::from("python3"))
}
