//! The session as a whole: planned and finished runs, and resumption after an interruption.

use std::{
    collections::BTreeMap,
    fs::OpenOptions,
    io::Write as _,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    folder::{Stem, check_subject, session_folder},
    log::{RunLog, complete_lines},
    run_start::{APPENDED_FILES, EndRecord, RunEnd, RunStart},
};
use crate::{
    LabError,
    config::{Condition, Config},
    order::{PlannedRun, plan},
    utc,
    verify::{Verification, check},
};

/// Name of the file with the plan, and name of its backup copy.
const PLAN_FILE: &str = "lab.toml";
const PLAN_COPY_FILE: &str = "lab.copy.toml";

/// True if a folder contains a session.
fn is_session(folder: &Path) -> bool {
    [PLAN_FILE, PLAN_COPY_FILE]
        .iter()
        .any(|name| folder.join(name).exists())
}

/// Contents of `lab.toml` in the folder of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionPlan {
    /// Version of hoid.
    pub hoid: String,
    /// Pseudonym of the person.
    pub subject: String,
    /// Number of the session of this person, counted from 1.
    pub session: usize,
    /// Start time in UTC.
    pub began: String,
    /// Confirmation of the consent, with its time.
    pub consent: String,
    /// `CC0-1.0` if the person donates the data; otherwise empty.
    pub licence: String,
    /// Row of the Latin square used for this person.
    pub row: usize,
    /// True if all planned runs are done.
    #[serde(default)]
    pub finished: bool,
    /// Browser and screen data sent by the page.
    #[serde(default)]
    pub browser: BTreeMap<String, String>,
    /// All planned runs.
    pub plan: Vec<PlannedRun>,
    /// Configuration of the experiment.
    pub config: Config,
}

impl SessionPlan {
    fn read(path: &Path) -> Result<Self, LabError> {
        let text = hoid_io::read_settings(path)?;
        let facts: Self = toml::from_str(&text).map_err(|error| {
            LabError::damaged_file(path, format!("{}; expected the lab.toml of a session", error.message()))
        })?;
        let conditions = facts.config.condition.len();
        if let Some(wrong) = facts.plan.iter().find(|run| run.condition >= conditions) {
            let reason = format!(
                "a run has condition index {}, expected below {conditions}; the file was changed after hoid lab \
                 wrote it",
                wrong.condition
            );
            return Err(LabError::damaged_file(path, reason));
        }
        Ok(facts)
    }

    /// Returns a planned run, by its index in the plan, with its condition.
    pub fn planned_run(&self, index: usize) -> Option<(&PlannedRun, &Condition)> {
        let planned = self.plan.get(index)?;
        Some((planned, self.config.condition.get(planned.condition)?))
    }
}

/// A run that has ended, as a line of `runs.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FinishedRun {
    /// Number of the run.
    pub number: usize,
    /// Index of the run in the plan.
    pub planned: usize,
    /// Name of the condition.
    pub condition: String,
    /// True for a training run.
    pub training: bool,
    /// End of the run: completed or interrupted.
    pub how: RunEnd,
    /// Time of the end of the run in UTC.
    pub utc: String,
    /// `verified` or `unverified`.
    pub verdict: String,
    /// Reasons for the verdict `unverified`.
    pub reasons: String,
    /// Additional notes.
    pub notes: String,
    /// Root mean square of e during the measurement.
    pub rms_e: f64,
    /// Score from 0 to 100: 100 for zero error, 0 for the error without control.
    pub score: f64,
}

/// A session and its folder.
#[derive(Debug)]
pub struct Session {
    /// Folder of the session.
    pub folder: PathBuf,
    /// Contents of `lab.toml`.
    pub plan: SessionPlan,
    /// Runs that have ended, in the order in which they were recorded.
    pub finished_runs: Vec<FinishedRun>,
}

impl Session {
    /// Starts a session for a person who has confirmed the consent.
    ///
    /// # Errors
    /// [`LabError::Order`] for an invalid pseudonym; errors of reading or writing files.
    pub fn create(out: &Path, config: &Config, subject: &str, cc0: bool) -> Result<Self, LabError> {
        check_subject(subject)?;
        hoid_io::make_directory(out)?;
        let row = latin_square_row(out, subject)?;
        let free = (1..).find(|session| !session_folder(out, subject, *session).exists());
        let session = free.unwrap_or(1);
        let folder = session_folder(out, subject, session);
        hoid_io::make_directory(&folder)?;
        let now = utc::now();
        let session = Self {
            plan: SessionPlan {
                hoid: env!("CARGO_PKG_VERSION").to_owned(),
                subject: subject.to_owned(),
                session,
                began: now.clone(),
                consent: format!("confirmed {now}"),
                licence: if cc0 { "CC0-1.0".to_owned() } else { String::new() },
                row,
                finished: false,
                browser: BTreeMap::new(),
                plan: plan(config, row),
                config: config.clone(),
            },
            folder,
            finished_runs: Vec::new(),
        };
        session.save()?;
        Ok(session)
    }

    /// Opens a session and evaluates the runs that are missing in `runs.csv`. A run without `end.json` or with a
    /// damaged `run.json` becomes unverified.
    ///
    /// # Errors
    /// [`LabError::Damaged`] for a folder without a session; errors of writing files.
    pub fn open(folder: &Path) -> Result<Self, LabError> {
        let mut session = Self::read(folder)?;
        for (number, stem) in Stem::find_all(folder)? {
            if session.finished_runs.iter().any(|done| done.number == number) {
                continue;
            }
            if RunStart::read(&stem).is_err() {
                session.mark_run_as_lost(number, &stem)?;
            } else if EndRecord::read(&stem).is_ok_and(|ended| ended.is_some()) {
                session.record_run(&stem, &check(&stem)?)?;
            } else {
                session.end_run(&stem, RunEnd::Interrupted, BTreeMap::new())?;
            }
        }
        Ok(session)
    }

    /// Reads a session without changing it.
    ///
    /// # Errors
    /// [`LabError::Damaged`].
    pub fn read(folder: &Path) -> Result<Self, LabError> {
        // The copy is used only if the file is unreadable; it may lack the last change.
        let facts = match SessionPlan::read(&folder.join(PLAN_FILE)) {
            Ok(facts) => facts,
            Err(damaged) => SessionPlan::read(&folder.join(PLAN_COPY_FILE)).map_err(|_| damaged)?,
        };
        Ok(Self {
            finished_runs: read_runs(&folder.join("runs.csv"))?,
            folder: folder.to_owned(),
            plan: facts,
        })
    }

    /// Writes `lab.toml` and its copy, one after the other.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn save(&self) -> Result<(), LabError> {
        for name in [PLAN_FILE, PLAN_COPY_FILE] {
            let path = self.folder.join(name);
            let text = toml::to_string(&self.plan).map_err(|error| LabError::damaged_file(&path, error.to_string()))?;
            hoid_io::write_atomically(&path, |file| file.write_all(text.as_bytes()))?;
        }
        Ok(())
    }

    /// Returns the index of the next run in the plan; `None` if all runs are done.
    pub fn next_run(&self) -> Option<usize> {
        let finished = |index: &usize| {
            self.finished_runs
                .iter()
                .any(|done| done.planned == *index && done.how == RunEnd::Finished)
        };
        (0..self.plan.plan.len()).find(|index| !finished(index))
    }

    /// Returns the number of a new run, which is one more than the number of the last run that was started.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn next_run_number(&self) -> Result<usize, LabError> {
        let last = Stem::find_all(&self.folder)?.last().map_or(0, |(number, _)| *number);
        Ok(last.saturating_add(1))
    }

    /// Returns the common prefix of the file names of a run.
    pub fn stem(&self, condition: &str, number: usize) -> Stem {
        Stem::new(&self.folder, &self.plan.subject, self.plan.session, condition, number)
    }

    /// Ends a run: hashes its files, verifies it and records the result.
    ///
    /// # Errors
    /// Errors of reading or writing files.
    pub fn end_run(
        &mut self,
        stem: &Stem,
        how: RunEnd,
        counted: BTreeMap<String, f64>,
    ) -> Result<Verification, LabError> {
        if !APPENDED_FILES.iter().any(|end| stem.file(end).exists()) {
            // The run ended before its first tick: empty files are created.
            drop(RunLog::create(stem, 0)?);
        }
        EndRecord {
            how,
            utc: utc::now(),
            counted,
            sha256: EndRecord::hashes(stem)?,
        }
        .write(stem)?;
        let checked = check(stem)?;
        self.record_run(stem, &checked)?;
        if self.next_run().is_none() {
            self.plan.finished = true;
            self.save()?;
        }
        Ok(checked)
    }

    /// Appends a run that has ended to `runs.csv`.
    fn record_run(&mut self, stem: &Stem, checked: &Verification) -> Result<(), LabError> {
        let run_start = RunStart::read(stem)?;
        let done = FinishedRun {
            number: run_start.number,
            planned: run_start.planned,
            condition: run_start.condition.name.clone(),
            training: run_start.training,
            how: EndRecord::read(stem)?.map_or(RunEnd::Interrupted, |ended| ended.how),
            utc: utc::now(),
            verdict: checked.label().to_owned(),
            reasons: checked.reasons(),
            notes: checked.verdict.notes().collect::<Vec<_>>().join("; "),
            rms_e: checked.measures.rms_e,
            score: checked.measures.score,
        };
        self.append_to_log(done)
    }

    /// Records a run of which only the file names are known.
    fn mark_run_as_lost(&mut self, number: usize, stem: &Stem) -> Result<(), LabError> {
        let condition = stem
            .text()
            .split_once("_task-")
            .and_then(|(_, rest)| rest.rsplit_once("_run-"));
        self.append_to_log(FinishedRun {
            number,
            // No plan contains this index.
            planned: u32::MAX as usize,
            condition: condition.map_or_else(String::new, |(name, _)| name.to_owned()),
            training: false,
            how: RunEnd::Interrupted,
            utc: utc::now(),
            verdict: "unverified".to_owned(),
            reasons: "run.json is truncated or was changed after hoid lab wrote it".to_owned(),
            notes: String::new(),
            rms_e: 0.0,
            score: 0.0,
        })
    }

    /// Appends a line to `runs.csv`, completely or not at all, after the last complete line.
    fn append_to_log(&mut self, done: FinishedRun) -> Result<(), LabError> {
        let path = self.folder.join("runs.csv");
        let whole = if path.exists() {
            complete_lines(&hoid_io::read_bytes(&path)?).len()
        } else {
            0
        };
        let mut writer = csv::WriterBuilder::new()
            .has_headers(whole == 0)
            .from_writer(Vec::new());
        let unwritable = |error: String| LabError::damaged_file(&path, error);
        writer.serialize(&done).map_err(|error| unwritable(error.to_string()))?;
        let line = writer.into_inner().map_err(|error| unwritable(error.to_string()))?;
        let opened = OpenOptions::new().append(true).create(true).open(&path);
        let mut file = opened.map_err(|source| LabError::file(&path, source))?;
        let written = (file.set_len(whole as u64))
            .and_then(|()| file.write_all(&line))
            .and_then(|()| file.sync_data());
        if let Err(source) = written {
            // If the file cannot be truncated now, it is truncated when the next line is written.
            let _ = file.set_len(whole as u64);
            return Err(LabError::file(&path, source));
        }
        self.finished_runs.push(done);
        Ok(())
    }

    /// Returns the folders of all sessions of an experiment, in alphabetical order.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn folders(out: &Path) -> Result<Vec<PathBuf>, LabError> {
        let mut found = Vec::new();
        for person in subdirectories(out, "sub-")? {
            found.extend(
                subdirectories(&person, "ses-")?
                    .into_iter()
                    .filter(|folder| is_session(folder)),
            );
        }
        Ok(found)
    }
}

/// Returns the subdirectories whose names start with `prefix`, sorted.
fn subdirectories(of: &Path, prefix: &str) -> Result<Vec<PathBuf>, LabError> {
    if !of.exists() {
        return Ok(Vec::new());
    }
    let entries = std::fs::read_dir(of).map_err(|source| LabError::file(of, source))?;
    let mut found: Vec<PathBuf> = (entries.flatten())
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix))
        .map(|entry| entry.path())
        .filter(|path| path.is_dir())
        .collect();
    found.sort();
    Ok(found)
}

/// Returns the row of the Latin square for a person: the row in their first session, or else the number of people
/// before them.
fn latin_square_row(out: &Path, subject: &str) -> Result<usize, LabError> {
    let mut others = 0_usize;
    for person in subdirectories(out, "sub-")? {
        let own = person
            .file_name()
            .is_some_and(|name| name.to_string_lossy() == format!("sub-{subject}"));
        let first = subdirectories(&person, "ses-")?
            .into_iter()
            .find(|folder| is_session(folder));
        match first {
            Some(first) if own => return Ok(Session::read(&first)?.plan.row),
            Some(_) => others = others.saturating_add(1),
            None => {}
        }
    }
    Ok(others)
}

fn read_runs(path: &Path) -> Result<Vec<FinishedRun>, LabError> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    // A truncated or invalid line is skipped; its run is evaluated again when the session is opened.
    let bytes = hoid_io::read_bytes(path)?;
    let mut reader = csv::Reader::from_reader(complete_lines(&bytes));
    Ok(reader.deserialize().flatten().collect())
}
