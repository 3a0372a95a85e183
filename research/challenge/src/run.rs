//! Runs of the challenge on all cores, with results stored on disk.
//!
//! Each run of a case is a file with a line of JSON for each entrant. The file is written under a temporary name and
//! then renamed. Existing results are not computed again, so a challenge can be stopped, continued, extended by another
//! entrant, or run in parts on several machines. The results do not depend on the number of threads.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::{
    case::Case,
    cases::cases,
    draw::{CaseRun, Portion, Seeds},
    entrant::Entrant,
    entrants::entrants,
    measure::{BATCH_NAME, EvaluationRun, Line},
};
use crate::ChallengeError;

/// Options of the runs.
#[derive(Debug, Clone)]
pub struct ChallengeOptions {
    /// Directory of the results.
    pub directory: PathBuf,
    /// Set of seeds that is used.
    pub seeds: Seeds,
    /// Number of runs of each case.
    pub runs: u64,
    /// Names of cases, prefixes of names (`none-`), or themes; empty for all cases.
    pub cases: Vec<String>,
    /// Names of entrants; empty for all entrants. `batch` is the batch fit with known changes.
    pub methods: Vec<String>,
    /// Part of the runs that is computed.
    pub portion: Portion,
}

/// Returns the entrants with these names, all entrants if `names` is empty, and whether the batch fit is included.
///
/// # Errors
/// [`ChallengeError::Refused`] if a name is unknown.
pub(super) fn chosen_entrants(names: &[String]) -> Result<(Vec<Box<dyn Entrant>>, bool), ChallengeError> {
    let mut all = entrants();
    let known: Vec<String> = all.iter().map(|c| c.name()).chain(["batch".to_owned()]).collect();
    if let Some(unknown) = names.iter().find(|name| !known.contains(name)) {
        return Err(refusal(format!(
            "no entrant is called {unknown}; there is {}",
            known.join(", ")
        )));
    }
    all.retain(|c| names.is_empty() || names.contains(&c.name()));
    Ok((all, names.is_empty() || names.iter().any(|n| n == "batch")))
}

/// Returns the cases with these names, prefixes of names or themes; all cases if `names` is empty.
///
/// # Errors
/// [`ChallengeError::Refused`] if a name is unknown.
pub fn chosen_cases(names: &[String]) -> Result<Vec<Case>, ChallengeError> {
    let all = cases();
    let is = |case: &Case, name: &String| {
        case.name == *name || case.theme.to_string() == *name || name.ends_with('-') && case.name.starts_with(name)
    };
    if let Some(unknown) = names.iter().find(|name| !all.iter().any(|case| is(case, name))) {
        let known: Vec<&str> = all.iter().map(|case| case.name.as_str()).collect();
        return Err(refusal(format!(
            "no case is called {unknown}; there is {}",
            known.join(", ")
        )));
    }
    let chosen = all
        .into_iter()
        .filter(|case| names.is_empty() || names.iter().any(|name| is(case, name)));
    Ok(chosen.collect())
}

pub(super) fn refusal(reason: String) -> ChallengeError {
    ChallengeError::Refused { reason }
}

/// Computes the missing results and returns the lines of all selected cases, ordered by case, run and entrant. `each`
/// is called after every run.
///
/// # Errors
/// [`ChallengeError`] if a name is unknown, a file cannot be read or written, or no person can stabilise a case.
pub fn challenge(options: &ChallengeOptions, each: &(dyn Fn(&str) + Sync)) -> Result<Vec<Line>, ChallengeError> {
    let cases = chosen_cases(&options.cases)?;
    let (entrants, batch) = chosen_entrants(&options.methods)?;
    let all: Vec<(&Case, u64)> = (cases.iter())
        .flat_map(|case| (0..options.runs).map(move |number| (case, number)))
        .collect();
    let own: Vec<_> = (all.into_iter().enumerate())
        .filter(|(i, _)| options.portion.contains(*i))
        .map(|(_, item)| item)
        .collect();
    let lines: Vec<Vec<Line>> = own
        .into_par_iter()
        .map(|(case, number)| {
            let folder = options.directory.join(options.seeds.to_string()).join(&case.name);
            let lines = read_or_compute_lines(&folder, number, &entrants, batch, &mut || {
                let of = CaseRun {
                    seeds: options.seeds,
                    number,
                };
                let posed = EvaluationRun::new(case, of).map_err(refusal)?;
                Ok(Box::new(move |entrant: Option<&dyn Entrant>| match entrant {
                    Some(entrant) => posed.line(entrant),
                    None => posed.batch(),
                }))
            });
            each(&format!("{} {number}", case.name));
            lines
        })
        .collect::<Result<_, _>>()?;
    Ok(lines.concat())
}

/// Function that computes the line of an entrant, or of the batch fit if there is no entrant.
pub(super) type ComputeLine = Box<dyn Fn(Option<&dyn Entrant>) -> Line>;

/// Returns the lines of a run. Lines that are not in the file are computed and added to it.
pub(super) fn read_or_compute_lines(
    folder: &Path,
    number: u64,
    entrants: &[Box<dyn Entrant>],
    batch: bool,
    pose: &mut dyn FnMut() -> Result<ComputeLine, ChallengeError>,
) -> Result<Vec<Line>, ChallengeError> {
    let path = folder.join(format!("{number}.jsonl"));
    let mut lines = if path.exists() { read(&path)? } else { Vec::new() };
    let mut wanted: Vec<(String, Option<&dyn Entrant>)> =
        entrants.iter().map(|c| (c.name(), Some(c.as_ref()))).collect();
    if batch {
        wanted.push((BATCH_NAME.to_owned(), None));
    }
    let missing: Vec<_> = (wanted.iter())
        .filter(|(name, _)| !lines.iter().any(|line| line.method == *name))
        .collect();
    if !missing.is_empty() {
        let line_of = pose()?;
        lines.extend(missing.into_iter().map(|(_, entrant)| line_of(*entrant)));
        write(&path, folder, &lines)?;
        // The lines are read again, because the last digit of a number may differ from the computed one.
        lines = read(&path)?;
    }
    let of = |(name, _): &(String, _)| lines.iter().find(|line| line.method == *name).cloned();
    Ok(wanted.iter().filter_map(of).collect())
}

fn read(path: &Path) -> Result<Vec<Line>, ChallengeError> {
    let text = hoid_io::read_text(path)?;
    let line = |line: &str| {
        serde_json::from_str(line).map_err(|e| {
            refusal(format!(
                "{}: {e}; remove the file, and the run is computed again",
                path.display()
            ))
        })
    };
    text.lines().map(line).collect()
}

fn write(path: &Path, folder: &Path, lines: &[Line]) -> Result<(), ChallengeError> {
    hoid_io::make_directory(folder)?;
    let mut text = String::new();
    for line in lines {
        text += &serde_json::to_string(line).map_err(|e| refusal(e.to_string()))?;
        text.push('\n');
    }
    hoid_io::write_atomically(path, |file| file.write_all(text.as_bytes()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn options(directory: &Path) -> ChallengeOptions {
        ChallengeOptions {
            directory: directory.to_owned(),
            seeds: Seeds::Open,
            runs: 2,
            cases: vec!["change-K_e_dot-100".to_owned()],
            methods: vec!["basis-kalman".to_owned(), "chow".to_owned()],
            portion: Portion::WHOLE,
        }
    }

    /// An existing run is read and not computed again; the lines are the same in any order and with any number of
    /// threads.
    #[test]
    fn existing_runs_are_not_computed_again() {
        let directory = tempfile::tempdir().unwrap();
        let default = options(directory.path());
        let all = challenge(&default, &|_| ()).unwrap();
        assert_eq!(all.len(), 4);
        assert!(all.iter().all(|line| line.failed.is_none()), "{all:?}");
        let path = directory.path().join("open/change-K_e_dot-100/0.jsonl");
        let text = std::fs::read_to_string(&path)
            .unwrap()
            .replace("\"exposed_s\":", "\"exposed_s\":1");
        std::fs::write(&path, text).unwrap();
        let again = challenge(&default, &|_| ()).unwrap();
        assert!(again[0].exposed_s > 100.0 && again[2..] == all[2..]);
        // With one thread and another directory.
        let other = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let single = pool.install(|| challenge(&options(other.path()), &|_| ())).unwrap();
        assert_eq!(single, all);
    }

    #[test]
    fn case_and_entrant_names_are_checked() {
        assert!(chosen_cases(&["none-".to_owned()]).unwrap().len() > 20);
        assert_eq!(chosen_cases(&["rates".to_owned()]).unwrap().len(), 5);
        let refused = chosen_cases(&["nothing".to_owned()]).unwrap_err().to_string();
        assert!(
            refused.contains("nothing") && refused.contains("none-lag-1"),
            "{refused}"
        );
        assert!(chosen_entrants(&["oracle".to_owned()]).is_err());
        let (all, batch) = chosen_entrants(&[]).unwrap();
        assert!(batch && all.iter().any(|c| c.name() == "chow"));
    }
}
