//! Limit on the number of instructions of a task.
//!
//! Times measured on a shared machine carry little information. The number of instructions of a program is reproducible
//! to a few parts in a thousand, regardless of what else runs. Callgrind (Valgrind) counts the instructions for one run
//! and for three runs of a task in the example `tasks`; half of the difference is the number for one run. The stored
//! numbers are in [`STORED_COUNTS`] with the version of the compiler. The check fails if a number exceeds its stored
//! value by more than [`ALLOWED_INCREASE`]; with a different compiler version the excess is only reported.

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    process::{Command, Stdio},
};

use serde_json::{Value, json};

const STORED_COUNTS: &str = "crates/hoid/benches/instructions.json";
/// Permitted increase relative to the stored number.
const ALLOWED_INCREASE: f64 = 0.05;
/// Tasks with one thread and one record. Valgrind uses AVX2 if the processor has it, but not AVX-512. The sums of `arx`
/// and `bj` therefore use the same registers on all processors except old ones, which need more instructions.
const TASKS: [&str; 6] = ["arx", "bj", "rls", "rpem", "loop", "loop with noise"];

/// Counts the instructions and compares them with the stored numbers; `keep` stores the new numbers.
///
/// # Errors
/// The reason, if a task needs more instructions than permitted or Valgrind fails.
pub fn check_instruction_counts(program: &Path, data: &Path, keep: bool) -> Result<(), String> {
    if Command::new("valgrind")
        .arg("--version")
        .stdout(Stdio::null())
        .status()
        .is_err()
    {
        println!("instructions were not counted: valgrind is not installed (apt install valgrind)");
        return Ok(());
    }
    let compiler = compiler_version()?;
    let mut found = BTreeMap::new();
    for task in TASKS {
        let (one, three) = (
            count_instructions(program, data, task, 1)?,
            count_instructions(program, data, task, 3)?,
        );
        found.insert(task.to_owned(), three.saturating_sub(one) / 2);
    }
    let kept = read_stored_counts();
    let same_compiler = kept.as_ref().is_some_and(|kept| kept.compiler == compiler);
    let known = kept.map(|kept| kept.tasks).unwrap_or_default();
    let (text, over) = compare(&found, &known);
    println!("{text}");
    if keep {
        let text = format!("{:#}\n", json!({"compiler": compiler, "tasks": found}));
        return fs::write(STORED_COUNTS, text).map_err(|error| format!("{STORED_COUNTS}: {error}"));
    }
    match (over, same_compiler) {
        (false, _) => Ok(()),
        (true, true) => Err(format!(
            "a task takes more than {:.0} % more instructions than {STORED_COUNTS} states; repair it, or keep the \
             new numbers with `cargo xtask bench --instructions --keep` and give the reason",
            100.0 * ALLOWED_INCREASE
        )),
        (true, false) => {
            println!("{STORED_COUNTS} was made with a compiler other than {compiler}: the numbers cannot be compared");
            Ok(())
        }
    }
}

struct StoredCounts {
    compiler: String,
    tasks: BTreeMap<String, u64>,
}

fn read_stored_counts() -> Option<StoredCounts> {
    let value: Value = serde_json::from_str(&fs::read_to_string(STORED_COUNTS).ok()?).ok()?;
    let tasks = value.get("tasks")?.as_object()?;
    Some(StoredCounts {
        compiler: value.get("compiler")?.as_str()?.to_owned(),
        tasks: tasks
            .iter()
            .filter_map(|(task, n)| Some((task.clone(), n.as_u64()?)))
            .collect(),
    })
}

/// Returns a line for each task, and whether any task exceeds the limit.
fn compare(found: &BTreeMap<String, u64>, kept: &BTreeMap<String, u64>) -> (String, bool) {
    let mut over = false;
    let mut lines = vec![format!(
        "{:<16} {:>12} {:>12} {:>7}",
        "instructions", "found", "kept", "ratio"
    )];
    for (task, n) in found {
        lines.push(match kept.get(task) {
            Some(kept) => {
                let ratio = *n as f64 / *kept as f64;
                over |= ratio > 1.0 + ALLOWED_INCREASE;
                format!("{task:<16} {n:>12} {kept:>12} {ratio:>7.3}")
            }
            None => format!("{task:<16} {n:>12}"),
        });
    }
    (lines.join("\n"), over)
}

fn count_instructions(program: &Path, data: &Path, task: &str, times: usize) -> Result<u64, String> {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .arg(data)
        .args(["--task", task, "--times", &times.to_string()])
        .env("RAYON_NUM_THREADS", "1")
        .output()
        .map_err(|error| format!("cannot run valgrind: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    parse_instruction_count(&said).ok_or_else(|| format!("valgrind did not count {task}:\n{said}"))
}

/// Returns the number after `Collected :`.
fn parse_instruction_count(said: &str) -> Option<u64> {
    let line = said.lines().find(|line| line.contains("Collected :"))?;
    line.rsplit(' ').next()?.parse().ok()
}

fn compiler_version() -> Result<String, String> {
    let output = Command::new("rustc").arg("--version").output();
    let output = output.map_err(|error| format!("cannot run rustc: {error}"))?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instruction_counts_are_parsed_and_compared() {
        assert_eq!(
            parse_instruction_count("==7== Events    : Ir\n==7== Collected : 4711\n==7=="),
            Some(4711)
        );
        assert_eq!(parse_instruction_count("==7== no such program"), None);
        let kept: BTreeMap<String, u64> = [("arx".to_owned(), 1000)].into();
        let with = |n| compare(&[("arx".to_owned(), n), ("bj".to_owned(), 5)].into(), &kept);
        assert!(!with(1050).1 && !with(900).1);
        let (text, over) = with(1051);
        assert!(over && text.contains("1.051"), "{text}");
    }
}
