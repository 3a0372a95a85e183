//! Reading of files as recordings: columns, span, units, alignment, and masked rows.

use std::path::{Path, PathBuf};

use hoid_io::{IoError, ReadRecord, read_prepared, read_segments, survey};
use hoid_model::Record;

use crate::{
    AnalysisError,
    reading::{Reading, Source},
    recordings::{Account, Recordings},
};

impl Reading {
    /// Reads the files; a callback receives each record read, for example to show notes to the user.
    ///
    /// # Errors
    /// The errors of reading; [`AnalysisError::OtherColumns`] if error and control have other names in a file.
    pub fn read_files(
        &self,
        paths: &[PathBuf],
        mut on_read: impl FnMut(&Path, &ReadRecord),
    ) -> Result<Recordings, AnalysisError> {
        let mut all = Recordings::default();
        for path in paths {
            let reads = self
                .read_segments(path)
                .map_err(|error| column_in_another_file(error, path, paths))?;
            let parts = reads.len() > 1 || !self.mask.is_empty();
            for read in reads {
                on_read(path, &read);
                let (record, account) = with_account(read);
                // The label of a trial ends with the name of the trial, the label of a segment with its span.
                let stem = path.file_stem().map_or(0, |stem| stem.to_string_lossy().len());
                let span = record.label().get(stem..).filter(|_| parts).unwrap_or_default();
                all.push(format!("{}{span}", path.display()), record, account);
            }
        }
        all.source = Some(Source {
            paths: paths.to_vec(),
            reading: self.clone(),
        });
        Ok(all)
    }

    /// Reads one file: its record, or the records between masked rows.
    ///
    /// # Errors
    /// Same as [`Reading::read_files`].
    pub fn read_segments(&self, path: &Path) -> Result<Vec<ReadRecord>, AnalysisError> {
        read_segments(path, &self.options, &self.preparation, &self.mask, self.shortest_s)
            .map_err(|error| AnalysisError::from_reading(error, path, &self.options))
    }

    /// Reads the record of a file that contains one trial.
    ///
    /// # Errors
    /// Same as [`Reading::read_files`].
    pub fn single_record(&self, path: &Path) -> Result<ReadRecord, AnalysisError> {
        read_prepared(path, &self.options, &self.preparation)
            .map_err(|error| AnalysisError::from_reading(error, path, &self.options))
    }

    /// Reads one file without masking.
    ///
    /// # Errors
    /// Same as [`Reading::read_files`].
    pub fn read_file(
        &self,
        path: &Path,
        on_read: impl FnOnce(&Path, &ReadRecord),
    ) -> Result<Recordings, AnalysisError> {
        let read = self.single_record(path)?;
        on_read(path, &read);
        let (record, account) = with_account(read);
        let mut one = Recordings::default();
        one.push(path.display().to_string(), record, account);
        one.source = Some(Source {
            paths: vec![path.to_owned()],
            reading: self.clone(),
        });
        Ok(one)
    }
}

/// Returns the error for a column that is in another of the files. For example, an eye tracker and a stick recorded in
/// two files, each with its own rate, are not two recordings.
fn column_in_another_file(error: AnalysisError, path: &Path, paths: &[PathBuf]) -> AnalysisError {
    let AnalysisError::Io(IoError::NoSuchColumn { missing, .. }) = &error else {
        return error;
    };
    let has_it = |other: &&PathBuf| {
        let found =
            survey(other).is_ok_and(|found| found.columns.iter().any(|c| format!("\"{}\"", c.path) == *missing));
        found && other.as_path() != path
    };
    match paths.iter().find(has_it) {
        None => error,
        Some(other) => AnalysisError::InAnotherFile {
            file: path.display().to_string(),
            missing: missing.clone(),
            other: other.display().to_string(),
        },
    }
}

fn with_account(read: ReadRecord) -> (Record, Account) {
    let account = Account {
        steps: read.steps,
        quality_issues: read.quality_issues,
        ..Account::default()
    };
    (read.record, account)
}
