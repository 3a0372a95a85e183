//! `cargo xtask bench`: our tasks and those of the peers in one sitting, and how cost grows.
//!
//! Ours are the example `tasks` of the crate `hoid`, the peers the scripts in `crates/hoid/benches/peers`. Both print one line of JSON a task
//! ([`lines`]). They take turns, and of the medians of the rounds the smallest counts, so that what else the machine does falls on both. The
//! tables go between the markers of a page of the book ([`page`]).

mod growth;
mod instructions;
mod lines;
mod page;
mod table;

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use lines::{Line, Outcome};

const PEERS: &str = "crates/hoid/benches/peers";
/// Belongs to the example `evidence` and prints no lines.
const OF_EVIDENCE: &str = "scipy_bj.py";
const WORK: &str = "target/bench";
pub const USAGE: &str = "cargo xtask bench [--only TASK,...] [--peers none|installed|install] [--rounds N] [--reproduce M] [--growth [--quick]] [--instructions [--keep]] [--dry]";

/// Which peers take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Peers {
    None,
    Installed,
    Install,
}

#[derive(Debug, PartialEq)]
struct Options {
    only: Vec<String>,
    peers: Peers,
    rounds: usize,
    reproduce: Option<u64>,
    growth: bool,
    quick: bool,
    instructions: bool,
    keep: bool,
    dry: bool,
}

impl Options {
    fn read(arguments: &[String]) -> Result<Self, String> {
        let mut options = Self {
            only: Vec::new(),
            peers: Peers::Installed,
            rounds: 2,
            reproduce: None,
            growth: false,
            quick: false,
            instructions: false,
            keep: false,
            dry: false,
        };
        let mut rest = arguments.iter();
        while let Some(argument) = rest.next() {
            let mut value = || rest.next().ok_or(format!("{argument} needs a value\nusage: {USAGE}"));
            let number = |text: &String| {
                text.parse::<u64>()
                    .map_err(|_| format!("{argument}: {text} is not a number"))
            };
            match argument.as_str() {
                "--only" => options.only = value()?.split(',').map(str::to_owned).collect(),
                "--peers" => {
                    options.peers = match value()?.as_str() {
                        "none" => Peers::None,
                        "installed" => Peers::Installed,
                        "install" => Peers::Install,
                        other => return Err(format!("--peers: found {other}; expected none, installed or install")),
                    }
                }
                "--rounds" => options.rounds = number(value()?)?.max(1) as usize,
                "--reproduce" => options.reproduce = Some(number(value()?)?),
                "--growth" => options.growth = true,
                "--quick" => options.quick = true,
                "--instructions" => options.instructions = true,
                "--keep" => options.keep = true,
                "--dry" => options.dry = true,
                _ => return Err(format!("unknown {argument}\nusage: {USAGE}")),
            }
        }
        Ok(options)
    }

    fn chooses(&self, task: &str) -> bool {
        self.only.is_empty() || self.only.iter().any(|name| name == task)
    }
}

/// Runs it.
///
/// # Errors
/// What cannot be run or written, in words.
pub fn bench(arguments: &[String]) -> Result<(), String> {
    let options = Options::read(arguments)?;
    if options.instructions {
        // Of the whole workspace, as the tests: with other features the same crates would be built twice.
        let ours = build(&["--workspace", "--example", "tasks"], "examples/tasks", Profile::Tests)?;
        return instructions::gate(&ours, &data(), options.keep);
    }
    let ours = build(
        &["-p", "hoid", "--example", "tasks"],
        "examples/tasks",
        Profile::Release,
    )?;
    if options.growth {
        let hoid = build(&["-p", "hoid-cli"], "hoid", Profile::Release)?;
        let text = growth::tables(&ours, &hoid, Path::new(WORK), options.quick)?;
        println!("\n{text}");
        return page::write("growth", &text, options.dry);
    }
    let interpreter = interpreter(options.peers)?;
    let mut lines = Vec::new();
    for round in 0..options.rounds {
        eprintln!("round {} of {}", round + 1, options.rounds);
        lines.extend(run_ours(&ours, &options, round == 0)?);
        if options.peers != Peers::None {
            for script in scripts()? {
                lines.extend(run_peer(&script, &interpreter, &options));
            }
        }
    }
    lines.retain(|line| options.chooses(&line.task));
    let text = table::ratios(&lines::best(lines), &machine());
    println!("\n{text}");
    // A part of the tasks is for the eye, not for the page.
    page::write("ratios", &text, options.dry || !options.only.is_empty())
}

/// How a program is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Profile {
    Release,
    /// As the tests are, which have compiled all of it before.
    Tests,
}

/// Builds a program and says where it is.
fn build(arguments: &[&str], program: &str, profile: Profile) -> Result<PathBuf, String> {
    let mut command = super::cargo_command();
    command.args(["build", "--quiet"]).args(arguments);
    if profile == Profile::Release {
        command.arg("--release");
    }
    super::run(&mut command)?;
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("target"), PathBuf::from);
    let folder = if profile == Profile::Release {
        "release"
    } else {
        "debug"
    };
    let name = format!("{program}{}", env::consts::EXE_SUFFIX);
    Ok(target.join(folder).join(name))
}

fn run_ours(program: &Path, options: &Options, first: bool) -> Result<Vec<Line>, String> {
    let mut command = Command::new(program);
    command.arg(data()).env("RAYON_NUM_THREADS", "1");
    if !options.only.is_empty() {
        command.args(["--task", &options.only.join(",")]);
    }
    let mut lines = lines::of(&output(&mut command)?);
    // On all cores, and once: it takes minutes.
    if let (true, Some(replications)) = (first, options.reproduce) {
        let mut command = Command::new(program);
        command
            .arg(data())
            .args(["--task", "none", "--reproduce", &replications.to_string()]);
        lines.extend(lines::of(&output(&mut command)?).into_iter().map(|line| Line {
            task: format!("reproduce, M = {replications}"),
            ..line
        }));
    }
    Ok(lines)
}

/// A peer that does not run is a line that says so.
fn run_peer(script: &Path, python: &str, options: &Options) -> Vec<Line> {
    let record = data().join("record.csv");
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

fn output(command: &mut Command) -> Result<String, String> {
    let shown = format!("{command:?}");
    match command.stderr(Stdio::inherit()).output() {
        Ok(output) if output.status.success() => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        Ok(output) => Err(format!("failed ({}): {shown}", output.status)),
        Err(error) => Err(format!("cannot run {shown}: {error}")),
    }
}

fn data() -> PathBuf {
    Path::new(WORK).join("data")
}

/// Peers: scripts whose names begin with a letter.
fn scripts() -> Result<Vec<PathBuf>, String> {
    let entries = fs::read_dir(PEERS).map_err(|e| format!("{PEERS}: {e}"))?;
    let mut found: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|e| e == "py" || e == "m" || e == "sce"))
        .filter(|path| {
            !path.ends_with(OF_EVIDENCE) && !path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('_'))
        })
        .collect();
    found.sort();
    Ok(found)
}

/// The interpreter for the peers: that of the environment in `target/bench`, which is made when asked for, else `python3`.
fn interpreter(peers: Peers) -> Result<String, String> {
    let environment = Path::new(WORK).join("venv");
    let folder = if cfg!(windows) { "Scripts" } else { "bin" };
    let own = environment.join(folder).join("python");
    if peers == Peers::Install {
        if !own.exists() {
            super::run(Command::new("python3").args(["-m", "venv"]).arg(&environment))?;
        }
        let requirements = Path::new(PEERS).join("requirements.txt");
        super::run(
            Command::new(&own)
                .args(["-m", "pip", "install", "--quiet", "-r"])
                .arg(requirements),
        )?;
    }
    let found = if own.exists() { own } else { PathBuf::from("python3") };
    Ok(found.to_string_lossy().into_owned())
}

/// The processor, its cores and the system.
fn machine() -> String {
    let model = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = model
        .lines()
        .find_map(|line| line.strip_prefix("model name"))
        .map_or(env::consts::ARCH, |rest| rest.trim_start_matches([' ', '\t', ':']));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores, {}", env::consts::OS)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Options, String> {
        Options::read(&text.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
    }

    #[test]
    fn options_are_read_and_nonsense_is_refused() {
        let options = read("--only arx,bj --peers none --rounds 3 --dry").unwrap();
        assert_eq!((options.peers, options.rounds, options.dry), (Peers::None, 3, true));
        assert!(options.chooses("arx") && !options.chooses("rls"));
        assert!(read("").unwrap().chooses("rls"));
        assert!(
            read("--peers some")
                .unwrap_err()
                .contains("expected none, installed or install")
        );
        assert!(read("--rounds").unwrap_err().contains("needs a value"));
        assert!(read("--what").unwrap_err().contains("usage"));
    }
}
