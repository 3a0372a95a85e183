//! The session as a whole: planned and finished runs, and its continuation after an interruption.

use std::{
    collections::BTreeMap,
    fs::OpenOptions,
    io::Write as _,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    folder::{Stem, check_subject, session_folder},
    log::{RunLog, whole_lines},
    run_start::{APPENDED, Ended, How, RunStart},
};
use crate::{
    LabError,
    config::{Condition, Config},
    order::{Planned, plan},
    utc,
    verify::{Checked, check},
};

/// The file of the plan, and its backup copy.
const FACTS: &str = "lab.toml";
const FACTS_AGAIN: &str = "lab.copy.toml";

/// True for the folder of a session.
fn is_session(folder: &Path) -> bool {
    [FACTS, FACTS_AGAIN].iter().any(|name| folder.join(name).exists())
}

/// Contents of `lab.toml` in a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Facts {
    /// Version of hoid.
    pub hoid: String,
    /// Pseudonym.
    pub subject: String,
    /// Number of the session of this person, from 1.
    pub session: usize,
    /// Start time in UTC.
    pub began: String,
    /// Confirmation of the consent, and its time.
    pub consent: String,
    /// `CC0-1.0` if the person donates the data; otherwise empty.
    pub licence: String,
    /// Row of the Latin square.
    pub row: usize,
    /// True when all runs are done.
    #[serde(default)]
    pub finished: bool,
    /// Browser and screen, as the page reports them.
    #[serde(default)]
    pub browser: BTreeMap<String, String>,
    /// All planned runs.
    pub plan: Vec<Planned>,
    /// The experiment.
    pub config: Config,
}

impl Facts {
    fn read(path: &Path) -> Result<Self, LabError> {
        let text = hoid_io::read_settings(path)?;
        let facts: Self = toml::from_str(&text)
            .map_err(|error| LabError::damaged(path, format!("{}; expected that of a session", error.message())))?;
        let conditions = facts.config.condition.len();
        if let Some(wrong) = facts.plan.iter().find(|run| run.condition >= conditions) {
            let reason = format!(
                "the plan names condition {} of {conditions}; it is not as hoid lab wrote it",
                wrong.condition
            );
            return Err(LabError::damaged(path, reason));
        }
        Ok(facts)
    }

    /// A planned run, by its index in the plan, and its condition.
    pub fn run(&self, place: usize) -> Option<(&Planned, &Condition)> {
        let planned = self.plan.get(place)?;
        Some((planned, self.config.condition.get(planned.condition)?))
    }
}

/// A run that has ended: a line of `runs.csv`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// Its number.
    pub number: usize,
    /// Its index in the plan.
    pub planned: usize,
    /// Name of its condition.
    pub condition: String,
    /// True for a training run.
    pub training: bool,
    /// How it ended.
    pub how: How,
    /// Time in UTC.
    pub utc: String,
    /// `verified` or `unverified`.
    pub verdict: String,
    /// Reasons of the verdict `unverified`.
    pub reasons: String,
    /// Additional notes.
    pub notes: String,
    /// Root mean square of e.
    pub rms_e: f64,
    /// 100 for no error, 0 for the error without control.
    pub score: f64,
}

/// A session and its folder.
#[derive(Debug)]
pub struct Session {
    /// The folder.
    pub folder: PathBuf,
    /// Contents of its `lab.toml`.
    pub facts: Facts,
    /// The finished runs, in their order.
    pub done: Vec<Done>,
}

impl Session {
    /// Starts a session of a person who has confirmed the consent.
    ///
    /// # Errors
    /// [`LabError::Order`] for a pseudonym that is invalid; those of files.
    pub fn begin(out: &Path, config: &Config, subject: &str, cc0: bool) -> Result<Self, LabError> {
        check_subject(subject)?;
        hoid_io::make_directory(out)?;
        let row = row_of(out, subject)?;
        let free = (1..).find(|session| !session_folder(out, subject, *session).exists());
        let session = free.unwrap_or(1);
        let folder = session_folder(out, subject, session);
        hoid_io::make_directory(&folder)?;
        let now = utc::now();
        let begun = Self {
            facts: Facts {
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
            done: Vec::new(),
        };
        begun.save()?;
        Ok(begun)
    }

    /// Opens a session; runs interrupted by the end of a server, or with missing or truncated files, are closed as
    /// unverified.
    ///
    /// # Errors
    /// [`LabError::Damaged`] for a folder without a session; errors of files that cannot be written.
    pub fn open(folder: &Path) -> Result<Self, LabError> {
        let mut session = Self::read(folder)?;
        for (number, stem) in Stem::all(folder)? {
            if session.done.iter().any(|done| done.number == number) {
                continue;
            }
            if RunStart::read(&stem).is_err() {
                session.lost(number, &stem)?;
            } else if Ended::read(&stem).is_ok_and(|ended| ended.is_some()) {
                session.note(&stem, &check(&stem)?)?;
            } else {
                session.end(&stem, How::Interrupted, BTreeMap::new())?;
            }
        }
        Ok(session)
    }

    /// Reads a session without changing it.
    ///
    /// # Errors
    /// [`LabError::Damaged`].
    pub fn read(folder: &Path) -> Result<Self, LabError> {
        // The copy is used only if the file is unreadable: it is at most one change behind the file.
        let facts = match Facts::read(&folder.join(FACTS)) {
            Ok(facts) => facts,
            Err(damaged) => Facts::read(&folder.join(FACTS_AGAIN)).map_err(|_| damaged)?,
        };
        Ok(Self {
            done: read_runs(&folder.join("runs.csv"))?,
            folder: folder.to_owned(),
            facts,
        })
    }

    /// Writes `lab.toml` and its copy, one after the other.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn save(&self) -> Result<(), LabError> {
        for name in [FACTS, FACTS_AGAIN] {
            let path = self.folder.join(name);
            let text = toml::to_string(&self.facts).map_err(|error| LabError::damaged(&path, error.to_string()))?;
            hoid_io::write_atomically(&path, |file| file.write_all(text.as_bytes()))?;
        }
        Ok(())
    }

    /// The index in the plan of the next run; nothing if all are done.
    pub fn next(&self) -> Option<usize> {
        let finished = |place: &usize| {
            self.done
                .iter()
                .any(|done| done.planned == *place && done.how == How::Finished)
        };
        (0..self.facts.plan.len()).find(|place| !finished(place))
    }

    /// A number for a new run.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn new_number(&self) -> Result<usize, LabError> {
        let last = Stem::all(&self.folder)?.last().map_or(0, |(number, _)| *number);
        Ok(last.saturating_add(1))
    }

    /// The names of the files of a run.
    pub fn stem(&self, condition: &str, number: usize) -> Stem {
        Stem::new(&self.folder, &self.facts.subject, self.facts.session, condition, number)
    }

    /// Ends a run: seals its files, checks it and records the result.
    ///
    /// # Errors
    /// The errors of files.
    pub fn end(&mut self, stem: &Stem, how: How, counted: BTreeMap<String, f64>) -> Result<Checked, LabError> {
        if !APPENDED.iter().any(|end| stem.file(end).exists()) {
            // It ended before its first tick.
            drop(RunLog::create(stem, 0)?);
        }
        Ended {
            how,
            utc: utc::now(),
            counted,
            sha256: Ended::hashes(stem)?,
        }
        .write(stem)?;
        let checked = check(stem)?;
        self.note(stem, &checked)?;
        if self.next().is_none() {
            self.facts.finished = true;
            self.save()?;
        }
        Ok(checked)
    }

    /// Appends a finished run to `runs.csv`.
    fn note(&mut self, stem: &Stem, checked: &Checked) -> Result<(), LabError> {
        let begun = RunStart::read(stem)?;
        let done = Done {
            number: begun.number,
            planned: begun.planned,
            condition: begun.condition.name.clone(),
            training: begun.training,
            how: Ended::read(stem)?.map_or(How::Interrupted, |ended| ended.how),
            utc: utc::now(),
            verdict: checked.word().to_owned(),
            reasons: checked.reasons(),
            notes: checked.verdict.notes().collect::<Vec<_>>().join("; "),
            rms_e: checked.measures.rms_e,
            score: checked.measures.score,
        };
        self.write_down(done)
    }

    /// Records a run of which only the name is known.
    fn lost(&mut self, number: usize, stem: &Stem) -> Result<(), LabError> {
        let condition = stem
            .text()
            .split_once("_task-")
            .and_then(|(_, rest)| rest.rsplit_once("_run-"));
        self.write_down(Done {
            number,
            // An index that no plan has.
            planned: u32::MAX as usize,
            condition: condition.map_or_else(String::new, |(name, _)| name.to_owned()),
            training: false,
            how: How::Interrupted,
            utc: utc::now(),
            verdict: "unverified".to_owned(),
            reasons: "run.json is truncated or not as hoid lab wrote it".to_owned(),
            notes: String::new(),
            rms_e: 0.0,
            score: 0.0,
        })
    }

    /// Appends a line completely or not at all, after the last complete one.
    fn write_down(&mut self, done: Done) -> Result<(), LabError> {
        let path = self.folder.join("runs.csv");
        let whole = if path.exists() {
            whole_lines(&hoid_io::read_bytes(&path)?).len()
        } else {
            0
        };
        let mut writer = csv::WriterBuilder::new()
            .has_headers(whole == 0)
            .from_writer(Vec::new());
        let unwritable = |error: String| LabError::damaged(&path, error);
        writer.serialize(&done).map_err(|error| unwritable(error.to_string()))?;
        let line = writer.into_inner().map_err(|error| unwritable(error.to_string()))?;
        let opened = OpenOptions::new().append(true).create(true).open(&path);
        let mut file = opened.map_err(|source| LabError::file(&path, source))?;
        let written = (file.set_len(whole as u64))
            .and_then(|()| file.write_all(&line))
            .and_then(|()| file.sync_data());
        if let Err(source) = written {
            // If it cannot be cut now, it is when the next line is written.
            let _ = file.set_len(whole as u64);
            return Err(LabError::file(&path, source));
        }
        self.done.push(done);
        Ok(())
    }

    /// All sessions of an experiment, in the order of their folders.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn folders(out: &Path) -> Result<Vec<PathBuf>, LabError> {
        let mut found = Vec::new();
        for person in directories(out, "sub-")? {
            found.extend(
                directories(&person, "ses-")?
                    .into_iter()
                    .filter(|folder| is_session(folder)),
            );
        }
        Ok(found)
    }
}

/// The subdirectories whose names start with `prefix`, sorted.
fn directories(of: &Path, prefix: &str) -> Result<Vec<PathBuf>, LabError> {
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

/// The row of a person: that of their first session, otherwise the number of previous people.
fn row_of(out: &Path, subject: &str) -> Result<usize, LabError> {
    let mut others = 0_usize;
    for person in directories(out, "sub-")? {
        let own = person
            .file_name()
            .is_some_and(|name| name.to_string_lossy() == format!("sub-{subject}"));
        let first = directories(&person, "ses-")?
            .into_iter()
            .find(|folder| is_session(folder));
        match first {
            Some(first) if own => return Ok(Session::read(&first)?.facts.row),
            Some(_) => others = others.saturating_add(1),
            None => {}
        }
    }
    Ok(others)
}

fn read_runs(path: &Path) -> Result<Vec<Done>, LabError> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    // A truncated or invalid line is omitted: its run is evaluated again when the session is opened.
    let bytes = hoid_io::read_bytes(path)?;
    let mut reader = csv::Reader::from_reader(whole_lines(&bytes));
    Ok(reader.deserialize().flatten().collect())
}
