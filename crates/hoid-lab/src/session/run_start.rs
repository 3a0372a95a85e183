//! Data of a run that are known before its start or after its end, each written as one file.

use std::{collections::BTreeMap, path::Path};

use hoid_io::{ColumnValues, OutputColumn, OutputTable};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use sha2::{Digest, Sha256};

use super::folder::Stem;
use crate::{
    LabError,
    config::{Condition, Limits},
    plant::InputMap,
    task::{Phase, Task},
};

/// Data known before a run, stored in `run.json`, with `forcing.parquet` in the same folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunStart {
    /// Version of hoid.
    pub hoid: String,
    /// Number of the run in its session, counted from 1.
    pub number: usize,
    /// Index of the run in the plan of the session.
    pub planned: usize,
    /// True for a training run.
    pub training: bool,
    /// Time of the start in UTC.
    pub utc: String,
    /// Condition of the run.
    pub condition: Condition,
    /// Index of the condition in the configuration. Together with the seed of the condition and the replication, this
    /// index determines the phases.
    pub cell: u64,
    /// Replication; see `cell`.
    pub replication: u64,
    /// Number of ticks before the measurement.
    pub run_in: usize,
    /// Total number of ticks.
    pub ticks: usize,
    /// Map from raw device values to u.
    pub input: InputMap,
    /// Kind of device, such as `mouse`.
    pub device: String,
    /// Source of the time: `browser`, or `injected` if a program provides it.
    pub clock: String,
    /// Interval between frames measured before the run, ms.
    pub refresh_ms: f64,
    /// Reading of the browser clock at tick 0, ms.
    pub zero_ms: f64,
    /// Limits for the verdict.
    pub limits: Limits,
    /// Controlled elements with their first ticks.
    pub phases: Vec<Phase>,
}

/// End of a run: completed or interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunEnd {
    /// Completed.
    Finished,
    /// Aborted by the person, by closing the window, or because the server ended.
    Interrupted,
}

/// Data known after a run, stored in `end.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EndRecord {
    /// End of the run: completed or interrupted.
    pub how: RunEnd,
    /// Time of the end in UTC.
    pub utc: String,
    /// Quantities measured by the page, such as the number of events not made by hand, or the memory of the page in MB.
    #[serde(default)]
    pub counted: BTreeMap<String, f64>,
    /// SHA-256 hashes of the files of ticks, events and frames, in that order.
    pub sha256: Vec<String>,
}

/// Names of the three appended files.
pub(super) const APPENDED_FILES: [&str; 3] = ["ticks.csv", "events.csv", "frames.csv"];

impl RunStart {
    /// Writes `run.json` and the tables of the task.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn write(&self, stem: &Stem, task: &Task) -> Result<(), LabError> {
        // The disturbance is extended to the length of the target, which exceeds the length of the run by the preview.
        let mut disturbance = task.disturbance.clone();
        disturbance.resize(task.target.len(), 0.0);
        let column = |name: &str, values: Vec<f64>| OutputColumn {
            name: name.to_owned(),
            values: ColumnValues::Real(values),
        };
        let table = OutputTable {
            comments: Vec::new(),
            columns: vec![
                column("target", task.target.clone()),
                column("disturbance", disturbance),
            ],
        };
        hoid_io::write_table(&stem.file("forcing.parquet"), &table)?;
        write_json(&stem.file("run.json"), self)
    }

    /// Reads `run.json`.
    ///
    /// # Errors
    /// [`LabError::Damaged`], [`LabError::Io`].
    pub fn read(stem: &Stem) -> Result<Self, LabError> {
        read_json(&stem.file("run.json"))
    }

    /// Returns the task, from the data written before the run.
    ///
    /// # Errors
    /// [`LabError::Damaged`] for tables of a wrong length.
    pub fn task(&self, stem: &Stem) -> Result<Task, LabError> {
        let path = stem.file("forcing.parquet");
        let table = hoid_io::read_table(&path)?;
        let column = |name: &str| match table.column(name) {
            Some(ColumnValues::Real(values)) => Ok(values.clone()),
            _ => Err(LabError::damaged_file(
                &path,
                format!("there is no numeric column {name}"),
            )),
        };
        let (target, mut disturbance) = (column("target")?, column("disturbance")?);
        disturbance.truncate(self.ticks);
        if target.len() < self.ticks || disturbance.len() < self.ticks {
            let reason = format!("{} rows, expected {} ticks", target.len(), self.ticks);
            return Err(LabError::damaged_file(&path, reason));
        }
        let order = self.phases.first().map(|phase| phase.plant.order());
        let fits = |phase: &Phase| phase.plant.is_valid() && Some(phase.plant.order()) == order;
        if order.is_none() || !self.phases.iter().all(fits) {
            let reason = "the matrices of its controlled element have inconsistent sizes; the file was changed after \
                          hoid lab wrote it";
            return Err(LabError::damaged_file(&stem.file("run.json"), reason));
        }
        Ok(Task {
            run_in: self.run_in,
            ticks: self.ticks,
            phases: self.phases.clone(),
            target,
            disturbance,
        })
    }
}

impl EndRecord {
    /// Writes `end.json`.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn write(&self, stem: &Stem) -> Result<(), LabError> {
        write_json(&stem.file("end.json"), self)
    }

    /// Reads `end.json`; `None` if the run has not ended.
    ///
    /// # Errors
    /// [`LabError::Damaged`], [`LabError::Io`].
    pub fn read(stem: &Stem) -> Result<Option<Self>, LabError> {
        let path = stem.file("end.json");
        if !path.exists() {
            return Ok(None);
        }
        read_json(&path).map(Some)
    }

    /// Returns the SHA-256 hashes of the appended files in their current state; an empty string for a missing file.
    ///
    /// # Errors
    /// [`LabError::Io`].
    pub fn hashes(stem: &Stem) -> Result<Vec<String>, LabError> {
        APPENDED_FILES
            .iter()
            .map(|end| match stem.file(end) {
                path if path.exists() => Ok(digest(&hoid_io::read_bytes(&path)?)),
                _ => Ok(String::new()),
            })
            .collect()
    }
}

/// Returns the SHA-256 hash in hexadecimal digits.
pub fn digest(bytes: &[u8]) -> String {
    data_encoding::HEXLOWER.encode(&Sha256::digest(bytes))
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<(), LabError> {
    let text = serde_json::to_string_pretty(value).map_err(|error| LabError::damaged_file(path, error.to_string()))?;
    hoid_io::write_atomically(path, |file| file.write_all(text.as_bytes()))?;
    Ok(())
}

fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T, LabError> {
    serde_json::from_str(&hoid_io::read_settings(path)?)
        .map_err(|error| LabError::damaged_file(path, format!("{error}; the file was changed after hoid lab wrote it")))
}
