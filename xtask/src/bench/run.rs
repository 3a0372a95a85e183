//! The benchmark run: hoid's tasks and the peers in turn, and the tables.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use super::{
    growth, instructions,
    lines::{self, Line, Outcome},
    options::{Options, Peers},
    table,
};
use crate::{
    page,
    process::{cargo_command, output, run},
};

const PAGE_PATH: &str = "../../research/notes/speed-peers.md";

const PEER_FOLDER: &str = "crates/hoid/benches/peers";
/// A script that belongs to the example `evidence` and prints no lines.
const EVIDENCE_SCRIPT: &str = "scipy_bj.py";
const WORK_FOLDER: &str = "target/bench";

/// Runs the benchmark.
///
/// # Errors
/// The reason, if building, running or writing fails.
pub fn bench(arguments: &[String]) -> Result<(), String> {
    let options = Options::parse_arguments(arguments)?;
    if options.instructions {
        // The whole workspace is built, as for the tests: with other features the same crates would be built twice.
        let ours = build(&["--workspace", "--example", "tasks"], "examples/tasks", Profile::Tests)?;
        return instructions::check_instruction_counts(&ours, &data_folder(), options.keep);
    }
    let ours = build(
        &["-p", "hoid", "--example", "tasks"],
        "examples/tasks",
        Profile::Release,
    )?;
    if options.growth {
        let hoid = build(&["-p", "hoid-cli"], "hoid", Profile::Release)?;
        let text = growth::measure_tables(&ours, &hoid, Path::new(WORK_FOLDER), options.quick)?;
        println!("\n{text}");
        return page::update_section(PAGE_PATH, "growth", &text, options.dry);
    }
    let interpreter = interpreter(options.peers)?;
    let mut lines = Vec::new();
    for round in 0..options.rounds {
        eprintln!("round {} of {}", round + 1, options.rounds);
        lines.extend(run_hoid(&ours, &options, round == 0)?);
        if options.peers != Peers::None {
            for script in peer_scripts()? {
                lines.extend(run_peer(&script, &interpreter, &options));
            }
        }
    }
    lines.retain(|line| options.selects(&line.task));
    let text = table::ratio_table(&lines::fastest_lines(lines), &machine_description());
    println!("\n{text}");
    // If only some tasks are selected, the table is printed but not written to the page.
    page::update_section(PAGE_PATH, "ratios", &text, options.dry || !options.only.is_empty())
}

/// Build profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Profile {
    Release,
    /// Profile of the tests, which are already compiled.
    Tests,
}

/// Builds a program and returns its path.
fn build(arguments: &[&str], program: &str, profile: Profile) -> Result<PathBuf, String> {
    let mut command = cargo_command();
    command.args(["build", "--quiet"]).args(arguments);
    if profile == Profile::Release {
        command.arg("--release");
    }
    run(&mut command)?;
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    let folder = if profile == Profile::Release {
        "release"
    } else {
        "debug"
    };
    let name = format!("{program}{}", env::consts::EXE_SUFFIX);
    Ok(target.join(folder).join(name))
}

fn run_hoid(program: &Path, options: &Options, first: bool) -> Result<Vec<Line>, String> {
    let mut command = Command::new(program);
    command.arg(data_folder()).env("RAYON_NUM_THREADS", "1");
    if !options.only.is_empty() {
        command.args(["--task", &options.only.join(",")]);
    }
    let mut lines = lines::of(&output(&mut command)?);
    // The reproduction runs on all cores, and only once because it takes minutes.
    if let (true, Some(replications)) = (first, options.reproduce) {
        let mut command = Command::new(program);
        command
            .arg(data_folder())
            .args(["--task", "none", "--reproduce", &replications.to_string()]);
        lines.extend(lines::of(&output(&mut command)?).into_iter().map(|line| Line {
            task: format!("reproduce, M = {replications}"),
            ..line
        }));
    }
    Ok(lines)
}

/// Runs a peer; if the program cannot be started, the result is a line that reports it.
fn run_peer(script: &Path, python: &str, options: &Options) -> Vec<Line> {
    let record = data_folder().join("record.csv");
    let (program, before, behind): (&str, &[&str], &[&str]) = match script.extension().and_then(|e| e.to_str()) {
        Some("m") => ("octave-cli", &[], &[]),
        Some("sce") => ("scilab-cli", &["-nb", "-f"], &["-args"]),
        _ => (python, &[], &[]),
    };
    let mut command = Command::new(program);
    command
        .args(before)
        .arg(script)
        .args(behind)
        .arg(record)
        .args(["50", &options.only.join(",")])
        .envs(["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"].map(|name| (name, "1")))
        .stderr(Stdio::null());
    let name = script.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    eprintln!("  {name}");
    match command.output() {
        Ok(output) => lines::of(&String::from_utf8_lossy(&output.stdout)),
        Err(error) => vec![Line {
            task: String::new(),
            peer: name,
            outcome: Outcome::Skipped(format!("{program}: {error}")),
        }],
    }
}

fn data_folder() -> PathBuf {
    Path::new(WORK_FOLDER).join("data")
}

/// Returns the peers: scripts in the folder whose names do not start with an underscore.
fn peer_scripts() -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(PEER_FOLDER).map_err(|e| format!("{PEER_FOLDER}: {e}"))?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "py" || e == "m" || e == "sce"))
        .filter(|path| {
            !path.ends_with(EVIDENCE_SCRIPT) && !path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('_'))
        })
        .collect();
    found.sort();
    Ok(found)
}

/// Returns the Python interpreter for the peers: the one in the environment `target/bench/venv`, which `--peers
/// install` creates, otherwise `python3`.
fn interpreter(peers: Peers) -> Result<String, String> {
    let environment = Path::new(WORK_FOLDER).join("venv");
    let folder = if cfg!(windows) { "Scripts" } else { "bin" };
    let own = environment.join(folder).join("python");
    if peers == Peers::Install {
        if !own.exists() {
            run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
        }
        let requirements = Path::new(PEER_FOLDER).join("requirements.txt");
        run(Command::new(&own)
            .args(["-m", "pip", "install", "--quiet", "-r"])
            .arg(requirements))?;
    }
    let found = if own.exists() { own } else { PathBuf::from("python3") };
    Ok(found.to_string_lossy().into_owned())
}

/// Describes the processor, its cores and the operating system.
fn machine_description() -> String {
    let model = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = model
        .lines()
        .find_map(|line| line.strip_prefix("model name"))
        .map_or(env::consts::ARCH, |rest| rest.trim_start_matches([' ', '\t', ':']));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores, {}", env::consts::OS)
}
