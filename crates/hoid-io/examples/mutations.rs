//! A million damaged files, given to all readers in process: no panic, no reader takes more than a
//! second, at most 300 MB. The numbers are those of `research/notes/mutations.md`.
//!
//! `cargo xtask slow mutations [--inputs N] [--first N] [--jobs N] [--seed N] [--memory MB] [--keep DIRECTORY]`.
//!
//! The cases are shared among processes, each with a limit on its address space (`ulimit -v`; where there is no such
//! limit, memory is not reported). A case that ends its process, or takes longer than [`PATIENCE`], is reported, and a
//! new process continues after it. `--keep` writes the files of the failed cases. Built with overflow checks on, as the
//! tests are.
#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

#[path = "../tests/common/mutations/mod.rs"]
mod mutations;

use std::{
    fs::{self, File},
    io::{BufRead, BufReader, Seek, SeekFrom, Write},
    panic::{self, AssertUnwindSafe},
    path::{Path, PathBuf},
    process::{Child, Command, ExitCode, Stdio},
    sync::{Arc, Mutex},
    thread,
    time::{Duration, Instant},
};

use mutations::{Case, case, originals::originals, readers, spent::Spent};

/// Seed of the page; the tests use another.
const SEED: u64 = 2026;
/// Time limit of one case.
const LIMIT: Duration = Duration::from_secs(1);
/// A process without progress for this time hangs.
const PATIENCE: Duration = Duration::from_secs(60);

/// The task of one run.
#[derive(Debug, Clone)]
struct Task {
    inputs: u64,
    first: u64,
    jobs: u64,
    seed: u64,
    memory_mb: u64,
    keep: Option<PathBuf>,
    /// For a child process: its directory for files and its number.
    part: Option<(PathBuf, u64)>,
}

fn main() -> ExitCode {
    let mut task = Task {
        inputs: 1_000_000,
        first: 0,
        jobs: thread::available_parallelism().map_or(1, |n| n.get() as u64),
        seed: SEED,
        memory_mb: 300,
        keep: None,
        part: None,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().unwrap();
        match argument.as_str() {
            "--inputs" => task.inputs = value().parse().unwrap(),
            "--first" => task.first = value().parse().unwrap(),
            "--jobs" => task.jobs = value().parse().unwrap(),
            "--seed" => task.seed = value().parse().unwrap(),
            "--memory" => task.memory_mb = value().parse().unwrap(),
            "--keep" => task.keep = Some(value().into()),
            "--part" => task.part = Some((value().into(), value().parse().unwrap())),
            other => panic!("{other}: there is --inputs, --first, --jobs, --seed, --memory and --keep"),
        }
    }
    if let Some((place, number)) = &task.part {
        part(&task, place, *number);
        return ExitCode::SUCCESS;
    }
    let begun = Instant::now();
    let sum = Arc::new(Mutex::new(Sum::default()));
    let directory = tempfile::tempdir().unwrap();
    let watchers: Vec<_> = (0..task.jobs)
        .map(|number| {
            let (task, sum, place) = (
                task.clone(),
                Arc::clone(&sum),
                directory.path().join(number.to_string()),
            );
            thread::spawn(move || watch(&task, &place, number, &sum))
        })
        .collect();
    watchers.into_iter().for_each(|watcher| watcher.join().unwrap());
    let sum = sum.lock().unwrap();
    println!(
        "{} inputs of seed {} in {:.0} s: {} answers with values, {} with an error; slowest {} ms (case {}); largest process \
         {} MB of {} allowed; {} failures",
        task.inputs,
        task.seed,
        begun.elapsed().as_secs_f64(),
        sum.read,
        sum.refused,
        sum.slowest.0,
        sum.slowest.1,
        sum.memory_mb,
        task.memory_mb,
        sum.failures.len()
    );
    sum.failures.iter().for_each(|failure| println!("{failure}"));
    if sum.failures.is_empty() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Results of all processes.
#[derive(Debug, Default)]
struct Sum {
    read: u64,
    refused: u64,
    /// Longest time, ms, and its case.
    slowest: (u64, u64),
    memory_mb: u64,
    failures: Vec<String>,
}

/// Runs the cases of one part, in as many processes as it takes.
fn watch(task: &Task, place: &Path, number: u64, sum: &Mutex<Sum>) {
    fs::create_dir_all(place).unwrap();
    let progress = place.join("progress");
    let end = task.first + task.inputs;
    let mut first = task.first + number;
    while first < end {
        fs::write(&progress, first.to_le_bytes()).unwrap();
        let mut child = start(task, place, first, end);
        let output = BufReader::new(child.stdout.take().unwrap());
        let listener = thread::spawn(move || output.lines().map_while(Result::ok).collect::<Vec<String>>());
        let hung = wait(&mut child, &progress);
        let status = child.wait().unwrap();
        let lines = listener.join().unwrap();
        let mut sum = sum.lock().unwrap();
        for line in &lines {
            match line.strip_prefix("done ") {
                Some(rest) => {
                    let n: Vec<u64> = rest.split(' ').map(|n| n.parse().unwrap()).collect();
                    sum.read += n[0];
                    sum.refused += n[1];
                    sum.slowest = sum.slowest.max((n[2], n[3]));
                    sum.memory_mb = sum.memory_mb.max(n[4]);
                }
                None => sum.failures.push(line.clone()),
            }
        }
        if status.success() && !hung {
            return;
        }
        let at = reached(&progress);
        sum.failures.push(match hung {
            true => format!("case {at}: no end after {} s", PATIENCE.as_secs()),
            false => format!("case {at}: it ended its process ({status}), as memory beyond the limit does"),
        });
        keep(task, at);
        first = at + task.jobs;
    }
}

/// Starts a process for the cases of one part, from case `first` on.
fn start(task: &Task, place: &Path, first: u64, end: u64) -> Child {
    let program = std::env::current_exe().unwrap();
    let mut command = if cfg!(unix) {
        let mut command = Command::new("sh");
        let limit = format!("ulimit -v {} 2>/dev/null; exec \"$0\" \"$@\"", task.memory_mb * 1024);
        command.args(["-c", &limit]).arg(program);
        command
    } else {
        Command::new(program)
    };
    command
        .args(["--first", &first.to_string(), "--inputs", &(end - first).to_string()])
        .args(["--jobs", &task.jobs.to_string(), "--seed", &task.seed.to_string()]);
    if let Some(keep) = &task.keep {
        command.arg("--keep").arg(keep);
    }
    command.arg("--part").arg(place).arg(first.to_string());
    command.stdout(Stdio::piped()).spawn().unwrap()
}

/// Waits for the process to end; true if it hangs and has been killed.
fn wait(child: &mut Child, progress: &Path) -> bool {
    let mut last = (u64::MAX, Instant::now());
    while child.try_wait().unwrap().is_none() {
        thread::sleep(Duration::from_millis(200));
        let at = reached(progress);
        if at != last.0 {
            last = (at, Instant::now());
        } else if last.1.elapsed() > PATIENCE {
            child.kill().unwrap();
            return true;
        }
    }
    false
}

fn reached(progress: &Path) -> u64 {
    let bytes = fs::read(progress).unwrap();
    <[u8; 8]>::try_from(bytes.as_slice()).map_or(u64::MAX, u64::from_le_bytes)
}

fn keep(task: &Task, number: u64) {
    let Some(directory) = &task.keep else { return };
    let case = case(&originals(), task.seed, number);
    fs::create_dir_all(directory).unwrap();
    fs::write(directory.join(format!("{number}.{}", case.extension)), &case.bytes).unwrap();
}

/// Runs the cases of this process.
fn part(task: &Task, place: &Path, first: u64) {
    let said = Arc::new(Mutex::new(String::new()));
    let heard = Arc::clone(&said);
    panic::set_hook(Box::new(move |info| {
        *heard.lock().unwrap() = info.to_string().replace('\n', " ")
    }));
    let originals = originals();
    let mut progress = File::create(place.join("progress")).unwrap();
    let (mut read, mut refused, mut slowest) = (0, 0, (0, 0));
    let mut number = first;
    while number < task.first + task.inputs {
        progress.seek(SeekFrom::Start(0)).unwrap();
        progress.write_all(&number.to_le_bytes()).unwrap();
        let case = case(&originals, task.seed, number);
        let path = place.join("damaged").with_extension(case.extension);
        fs::write(&path, &case.bytes).unwrap();
        let mut took = Duration::MAX;
        // Where the system does not report the CPU time of this process, another process may have used the processor:
        // the least of three measurements.
        for _ in 0..3 {
            let begun = Spent::now();
            let outcome = panic::catch_unwind(AssertUnwindSafe(|| readers::all(&path, case.bytes.len(), case.choice)));
            took = took.min(begun.elapsed());
            match outcome {
                Ok(answers) if took <= LIMIT => {
                    read += answers.read;
                    refused += answers.refused;
                }
                Ok(_) => continue,
                Err(_) => failed(task, number, &case, &said.lock().unwrap()),
            }
            break;
        }
        if took > LIMIT {
            failed(task, number, &case, &format!("it takes {} ms", took.as_millis()));
        }
        slowest = slowest.max((took.as_millis() as u64, number));
        number += task.jobs;
    }
    println!("done {read} {refused} {} {} {}", slowest.0, slowest.1, largest_mb());
}

fn failed(task: &Task, number: u64, case: &Case, what: &str) {
    println!("case {number} ({}, .{}): {what}", case.name, case.extension);
    keep(task, number);
}

/// Largest address space of this process, where the system reports it.
fn largest_mb() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:"));
    let kilobytes = line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse::<u64>().ok());
    kilobytes.map_or(0, |kb| kb.div_ceil(1024))
}
