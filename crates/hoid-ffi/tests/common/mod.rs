//! C compilers, the built library and a simulated run.
#![allow(dead_code, clippy::unwrap_used, clippy::print_stderr)]

use std::{
    env, fs,
    io::Write as _,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
};

use hoid_model::{
    Record,
    scenario::{Condition, Scenario},
};
use hoid_sim::{RunSeed, Simulator};

/// Returns the data of the tests: 82 s of C4, in which the person changes.
pub fn record() -> Record {
    let simulator = Simulator::new(&Scenario::condition(Condition::C4)).unwrap();
    let seed = RunSeed {
        seed: 1,
        ..RunSeed::default()
    };
    simulator.run(seed, false).unwrap()
}

/// Returns e and u as lines with all digits.
pub fn lines(record: &Record) -> String {
    let pairs = record.input().iter().zip(record.output());
    pairs.map(|(e, u)| format!("{e:?},{u:?}\n")).collect()
}

/// Returns the newest library with this name in the folder in which these tests were built.
pub fn library(name: &str) -> PathBuf {
    let tests = env::current_exe().unwrap();
    let deps = tests.parent().unwrap();
    let built = [deps.join(name), deps.parent().unwrap().join(name)];
    let age = |path: &PathBuf| fs::metadata(path).and_then(|m| m.modified()).ok();
    let newest = built.into_iter().filter(|path| age(path).is_some()).max_by_key(age);
    newest.unwrap_or_else(|| panic!("{name} was not built next to {}", tests.display()))
}

pub fn shared_library() -> PathBuf {
    library(&format!(
        "{}hoid_ffi{}",
        env::consts::DLL_PREFIX,
        env::consts::DLL_SUFFIX
    ))
}

/// Returns a compiler if it is installed; otherwise reports that it is missing.
pub fn compiler(name: &str) -> Option<String> {
    let there = Command::new(name).arg("--version").stdout(Stdio::null()).status();
    if there.is_ok_and(|status| status.success()) {
        return Some(name.to_owned());
    }
    eprintln!("skipped: there is no compiler {name}");
    None
}

pub fn example_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name)
}

/// Compiles a source against the shared library. Warnings are errors.
pub fn compile(compiler: &str, source: &Path, program: &Path, options: &[&str]) -> Output {
    let library = shared_library();
    Command::new(compiler)
        .args(["-Wall", "-Wextra", "-Werror", "-O1", "-g"])
        .args(options)
        .arg("-I")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("include"))
        .arg(source)
        .arg("-o")
        .arg(program)
        .arg(&library)
        .arg(format!("-Wl,-rpath,{}", library.parent().unwrap().display()))
        .arg("-lm")
        .output()
        .unwrap()
}

/// Runs a program on an input.
pub fn run(program: &Path, arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new(program)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut to = child.stdin.take().unwrap();
    let input = input.to_owned();
    // A pipe closed by its reader is not an error of this library.
    let writer = std::thread::spawn(move || drop(to.write_all(input.as_bytes())));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap();
    output
}

pub fn successful_output(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}
