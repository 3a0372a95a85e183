//! The files of a virtual experiment: one table per run, `truth.csv`, and `group.toml`. `group.toml` is written last,
//! so a directory that contains it is complete.

use std::path::Path;

use hoid_model::Record;

use super::{
    analysis_settings::AnalysisSettings,
    condition_settings::ConditionSettings,
    manifest::{MANIFEST_FILE, Manifest, RunEntry},
    preparation_settings::PreparationSettings,
    read_settings::ReadSettings,
    sampling_defects::{SamplingDefect, recorded_table},
};
use crate::{StudyError, columns::Rows};

/// Writer for the files of a virtual experiment.
pub(super) struct VirtualFiles<'a> {
    directory: &'a Path,
    /// Columns of a run, except t.
    columns: &'a [&'a str],
    defects: &'a [SamplingDefect],
    runs: Vec<RunEntry>,
}

impl<'a> VirtualFiles<'a> {
    /// Returns an error if the directory already contains an experiment.
    ///
    /// # Errors
    /// [`StudyError::ExperimentThere`] if the directory contains an experiment.
    pub fn check_no_experiment(directory: &Path) -> Result<(), StudyError> {
        if directory.join(MANIFEST_FILE).exists() {
            return Err(StudyError::ExperimentThere {
                directory: directory.display().to_string(),
            });
        }
        Ok(())
    }

    /// Creates the directory.
    ///
    /// # Errors
    /// [`StudyError::Io`] if the directory cannot be created.
    pub fn new(directory: &'a Path, columns: &'a [&'a str], defects: &'a [SamplingDefect]) -> Result<Self, StudyError> {
        hoid_io::make_directory(directory)?;
        Ok(Self {
            directory,
            columns,
            defects,
            runs: Vec::new(),
        })
    }

    /// Writes a run of a subject in a condition, with the sampling defects applied.
    ///
    /// # Errors
    /// [`StudyError::Io`] if the file cannot be written.
    pub fn write_run(
        &mut self,
        (subject, condition, run): (u64, String, u64),
        record: &Record,
        noise: &[f64],
    ) -> Result<(), StudyError> {
        let file = format!("S{subject}_{condition}_{run}.csv");
        let table = recorded_table(record, self.columns, self.defects, noise);
        hoid_io::write_table(&self.directory.join(&file), &table)?;
        self.runs.push(RunEntry {
            then: None,
            file: file.into(),
            subject: format!("S{subject}"),
            condition,
            run: run.to_string(),
            counts: true,
        });
        Ok(())
    }

    /// Writes the true parameters and the manifest.
    ///
    /// # Errors
    /// [`StudyError::Io`] if a file cannot be written.
    pub fn finish(
        self,
        name: &str,
        truth: Rows,
        analysis: AnalysisSettings,
        conditions: impl Iterator<Item = (String, ConditionSettings)>,
    ) -> Result<Manifest, StudyError> {
        hoid_io::write_table(&self.directory.join("truth.csv"), &truth.into_table(Vec::new()))?;
        let manifest = Manifest {
            name: name.to_owned(),
            read: ReadSettings {
                resample: self.defects.iter().any(|defect| defect.is_uneven()),
                ..ReadSettings::default()
            },
            prepare: PreparationSettings::default(),
            analysis,
            conditions: conditions.collect(),
            runs: self.runs,
        };
        let text = manifest.text();
        hoid_io::write_atomically(&self.directory.join(MANIFEST_FILE), |file| {
            file.write_all(text.as_bytes())
        })?;
        Ok(manifest)
    }
}
