//! Interrupted commands and their remaining files: the works, the program in a directory, and the comparison of the
//! files of two runs.
// Each study uses only part of this module.
#![allow(dead_code, clippy::unwrap_used)]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

const PLAN: &str = r#"
name = "short"
seed = 3
replications = 12
block = 1

[[scenarios]]
condition = ["C1", "C2"]
remnant.noise_level = 0.1

[[estimators]]
name = "BJ"
method = "fit"
structure = "bj"
orders.nd = [1]
"#;

/// A command that is interrupted.
pub struct Work {
    pub name: &'static str,
    /// Arguments before `--out`.
    pub arguments: &'static [&'static str],
    /// Arguments that resume the command.
    pub resume: &'static [&'static str],
    /// True if the blocks are in `parts/` of the directory itself.
    pub has_parts: bool,
    /// Path given to `--out`, relative to the directory of the command.
    pub out: &'static str,
}

/// A study, with blocks in `parts/`.
pub const STUDY: Work = Work {
    name: "study",
    arguments: &["study", "run", "plan.toml", "--jobs", "1"],
    resume: &["--resume"],
    has_parts: true,
    out: "",
};

/// A group, also with blocks in `parts/`.
pub const GROUP: Work = Work {
    name: "group",
    arguments: &["group", "people", "--jobs", "1"],
    resume: &["--resume"],
    has_parts: true,
    out: "",
};

/// A reproduction, which consists of several studies.
pub const REPRODUCE: Work = Work {
    name: "reproduce",
    arguments: &[
        "reproduce",
        "--only",
        "table-2,fig-3,A.1",
        "--replications",
        "4",
        "--jobs",
        "1",
    ],
    resume: &[],
    has_parts: false,
    out: "",
};

/// A trace, which is a single file.
pub const TRACK: Work = Work {
    name: "track",
    arguments: &["track", "c1.csv", "--method", "rls", "--nk", "29"],
    resume: &[],
    has_parts: false,
    out: "trace.csv",
};

/// The program, in a directory.
pub struct Bench {
    pub program: PathBuf,
    pub at: PathBuf,
}

impl Bench {
    /// Creates a plan, the recordings of a group and a recording of C1.
    pub fn new(program: PathBuf, at: &Path) -> Self {
        let bench = Self {
            program,
            at: at.to_owned(),
        };
        fs::write(at.join("plan.toml"), PLAN).unwrap();
        let group = "simulate-group --subjects 2 --conditions C1 --runs 1 --noise-level 0.05 --out people";
        for line in [group, "simulate --condition C1 --seed 1 --out c1.csv"] {
            let mut simulate = Command::new(&bench.program);
            simulate.args(line.split(' ')).current_dir(at).stdout(Stdio::null());
            let done = simulate.status().unwrap();
            assert!(done.success(), "{line}: {done}");
        }
        bench
    }

    pub fn output_path(&self, work: &Work, name: &str) -> PathBuf {
        self.at.join(format!("{}-{name}", work.name))
    }

    /// Returns the command whose results are written to a place.
    pub fn command(&self, work: &Work, location: &Path) -> Command {
        let mut command = Command::new(&self.program);
        command.args(work.arguments).args(work.resume).arg("--out");
        command.arg(if work.out.is_empty() {
            location.to_owned()
        } else {
            location.join(work.out)
        });
        command.current_dir(&self.at);
        command
    }

    pub fn start(&self, work: &Work, name: &str) -> Child {
        let mut command = self.command(work, &self.output_path(work, name));
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    }

    /// Runs a command to completion.
    pub fn run_to_end(&self, work: &Work, name: &str) {
        let status = self.start(work, name).wait().unwrap();
        assert!(status.success(), "{} {name}: {status}", work.name);
    }
}

/// Returns all files below a directory, by their paths. The durations on the page of a reproduction are removed,
/// because they are the only difference between runs.
pub fn read_files(directory: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![directory.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
                continue;
            }
            let mut bytes = fs::read(&path).unwrap();
            if path.ends_with("index.html") {
                let text = String::from_utf8(bytes).unwrap();
                let timed = |line: &&str| !line.starts_with("<tr><th>") || !line.contains("studies/");
                bytes = text.lines().filter(timed).collect::<Vec<_>>().join("\n").into_bytes();
            }
            found.insert(path.strip_prefix(directory).unwrap().to_owned(), bytes);
        }
    }
    found
}

/// Returns the differences between the files below a directory and the expected files.
pub fn compare(expected: &BTreeMap<PathBuf, Vec<u8>>, directory: &Path, what: &str) -> Vec<String> {
    let found = read_files(directory);
    let differs = |path: &PathBuf| {
        Some(match (expected.get(path), found.get(path)) {
            (Some(a), Some(b)) if a == b => return None,
            (Some(_), Some(_)) => format!("{what}: {} differs", path.display()),
            (Some(_), None) => format!("{what}: {} is missing", path.display()),
            _ => format!("{what}: {} is left over", path.display()),
        })
    };
    let all: BTreeSet<&PathBuf> = expected.keys().chain(found.keys()).collect();
    all.into_iter().filter_map(differs).collect()
}

/// Returns the path of the program built with this example.
pub fn built_program_path() -> PathBuf {
    let mut path = std::env::current_exe().unwrap();
    path.pop();
    path.pop();
    path.join(format!("hoid{}", std::env::consts::EXE_SUFFIX))
}
