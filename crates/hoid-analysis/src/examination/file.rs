//! Contents of a file, and the signals and properties recognised in it.

use std::path::Path;

use hoid_io::{ColumnSurvey, FileSurvey, IoError, ReadOptions, read_record, survey};
use hoid_model::Record;

use super::{
    columns::Roles,
    lag::{self, Lag},
    options::ExaminationOptions,
    periods::{self, Periods},
};

/// Result of the examination of a file.
#[derive(Debug)]
pub struct FileExamination {
    /// Columns, sampling and problems of the file.
    pub survey: FileSurvey,
    /// Columns of error and control.
    pub roles: Roles,
    /// Summary of the record of these columns, or the reason why they do not form a record.
    pub summary: Result<RecordSummary, IoError>,
    pub(super) options: ExaminationOptions,
}

/// Summary of the record of a file.
#[derive(Debug)]
pub struct RecordSummary {
    /// The record without preparation.
    pub record: Record,
    /// The excitation and its span of whole periods, or the reason why none was found.
    pub periods: Result<Periods, String>,
    /// Number of samples by which the control was recorded late, or the reason why this is unknown; `None` if no
    /// controlled element is given, or if the user gave the lag.
    pub lag: Option<Result<Lag, String>>,
}

impl FileExamination {
    /// Examines a file.
    ///
    /// # Errors
    /// The errors of [`survey`] if the file cannot be read.
    pub fn at(path: &Path, known: &ExaminationOptions) -> Result<Self, IoError> {
        let found = survey(path)?;
        let roles = Roles::of(&column_names(&found), known.input.as_deref(), known.output.as_deref());
        Ok(Self {
            summary: summarise_record(path, &roles, known),
            survey: found,
            roles,
            options: known.clone(),
        })
    }

    /// Returns the columns that have a unit, with the unit from the file or from the name, as in `Stick [V]`.
    pub fn units(&self) -> Vec<(&str, &str)> {
        let all = self.survey.columns.iter();
        all.filter_map(|column| Some((column.path.as_str(), unit_of(column)?)))
            .collect()
    }
}

/// Returns the names of the columns.
pub(super) fn column_names(found: &FileSurvey) -> Vec<&str> {
    found.columns.iter().map(|column| column.path.as_str()).collect()
}

/// Returns the unit of a column from the file, or from brackets at the end of its name.
fn unit_of(column: &ColumnSurvey) -> Option<&str> {
    let stored_unit = Some(column.unit.as_str()).filter(|unit| !unit.is_empty());
    stored_unit.or_else(|| {
        [('(', ')'), ('[', ']')].into_iter().find_map(|(open, close)| {
            let (name, unit) = column.path.trim().strip_suffix(close)?.rsplit_once(open)?;
            let is_unit = !name.trim().is_empty() && unit.chars().any(|c| c.is_alphabetic() || c == '%' || c == '°');
            is_unit.then(|| unit.trim())
        })
    })
}

fn summarise_record(path: &Path, roles: &Roles, known: &ExaminationOptions) -> Result<RecordSummary, IoError> {
    let options = ReadOptions {
        input: Some(roles.input.column.parse()?),
        output: roles.output.column.parse()?,
        time: known.time.clone(),
        trial: known.trial.clone(),
        sampling_hz: known.sampling_hz,
        ..ReadOptions::default()
    };
    // If the file contains several trials, the first one is examined.
    let record = match read_record(path, &options) {
        Err(IoError::SeveralTrials {
            trial_column: by,
            trials,
            ..
        }) => {
            let first = trials.first().map_or("", String::as_str);
            let trial = Some(format!("{by}={first}").parse()?);
            read_record(path, &ReadOptions { trial, ..options })?.record
        }
        read => read?.record,
    };
    let periods = periods::search(&record, known);
    let lag = match (known.offset_samples, &known.controlled_element) {
        (None, Some((_, element))) => {
            let excitation = periods.as_ref().ok().map(|found| found.channel.as_str());
            Some(lag::control_lag(&record, excitation, element))
        }
        _ => None,
    };
    Ok(RecordSummary { record, periods, lag })
}
