//! Contents of a file before any selection: columns, their sampling and ranges, and suspicious values.
//!
//! The survey does not assess the file. `data_quality` finds suspicious values in columns that share a time. A constant
//! column is only marked, because many files have legitimate constant columns.

use std::path::Path;

use super::read::{RawColumn, columns_of_arrays, columns_of_table};
use super::sampling::{SamplingSurvey, survey_sampling};
use super::values::{ValueSurvey, survey_values};
use crate::IoError;
use crate::data_quality::{QualityIssue, QualityIssueKind, Signal, Signals, find_issues, is_clock_name};
use crate::formats::arrays::TIME_NAMES;
use crate::formats::{Format, FormatReader, read_long_text, read_with_format};
use crate::record::ReadOptions;
use crate::time::with_time;

/// Contents of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct FileSurvey {
    /// Name of the file format, such as "Parquet".
    pub format: &'static str,
    /// Columns in the order of the file.
    pub columns: Vec<ColumnSurvey>,
    /// Sampling of each structure that has a time; a flat table has at most one.
    pub samplings: Vec<SamplingSurvey>,
    /// Problems with the sampling and the values, listed by structure.
    pub quality_issues: Vec<QualityIssue>,
    /// Notes about the reading of the file.
    pub notes: Vec<String>,
}

/// Overview of one column.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnSurvey {
    /// Name of the column, or its path in the file.
    pub path: String,
    /// Unit of the column; empty if unknown.
    pub unit: String,
    /// Type of the values, such as "double" or "text".
    pub kind: String,
    /// Number of rows; 0 for unsupported content.
    pub rows: usize,
    /// Statistics of the finite values, if there are any.
    pub values: Option<ValueSurvey>,
}

/// Surveys a file of any supported format.
///
/// # Errors
/// [`IoError`] as in reading a record, with the place in the file.
pub fn survey(path: &Path) -> Result<FileSurvey, IoError> {
    let file = path.display().to_string();
    let (format, columns, notes) = columns_of(path, &file)?;
    let is_time = |column: &&RawColumn| TIME_NAMES.contains(&column.name.as_str()) && column.rows > 1;
    let samplings = columns
        .iter()
        .filter(is_time)
        .filter_map(|time| survey_sampling(time, &columns))
        .collect();
    let quality_issues = quality_issues(&columns);
    let survey = |column: RawColumn| ColumnSurvey {
        values: column.values.as_deref().and_then(survey_values),
        path: column.path,
        unit: column.unit,
        kind: column.kind,
        rows: column.rows,
    };
    Ok(FileSurvey {
        format: format.name,
        samplings,
        quality_issues,
        columns: columns.into_iter().map(survey).collect(),
        notes,
    })
}

/// Returns the format, the columns and the notes of a file.
fn columns_of(path: &Path, file: &str) -> Result<(&'static Format, Vec<RawColumn>, Vec<String>), IoError> {
    if let Some((format, table)) = read_long_text(path, file, &ReadOptions::default())? {
        let (columns, notes) = columns_of_table(with_time(table, None)?);
        return Ok((format, columns, notes));
    }
    let (format, mut bytes) = read_with_format(path)?;
    let (columns, notes) = match format.reading {
        FormatReader::Table { record, .. } => {
            columns_of_table(with_time(record(&mut bytes, file, &ReadOptions::default())?, None)?)
        }
        FormatReader::Arrays(read) => columns_of_arrays(&read(bytes, file)?),
    };
    Ok((format, columns, notes))
}

fn signal(column: &RawColumn) -> Signal<'_> {
    Signal {
        name: &column.path,
        values: column.values.as_deref().unwrap_or_default(),
    }
}

/// Returns the problems found in the columns, grouped by structure and length.
fn quality_issues(columns: &[RawColumn]) -> Vec<QualityIssue> {
    let mut seen: Vec<(&str, usize)> = Vec::new();
    let mut found = Vec::new();
    for column in columns.iter().filter(|column| column.rows > 1) {
        let key = (column.parent.as_str(), column.rows);
        if seen.contains(&key) {
            continue;
        }
        seen.push(key);
        let neighbours = || columns.iter().filter(|c| (c.parent.as_str(), c.rows) == key);
        let time = TIME_NAMES
            .iter()
            .find_map(|name| neighbours().find(|c| c.name == *name && c.values.is_some()));
        let is_time = |c: &RawColumn| time.is_some_and(|time| time.path == c.path);
        let numbers = || neighbours().filter(|c| c.values.is_some() && !is_time(c));
        let is_clock = |c: &&RawColumn| is_clock_name(&c.name) || TIME_NAMES.contains(&c.name.as_str());
        found.extend(find_issues(&Signals {
            columns: numbers().filter(|c| !is_clock(c)).map(signal).collect(),
            time: time.map(signal),
            precision: time.map(|c| c.precision).unwrap_or_default(),
            clocks: numbers().filter(is_clock).map(signal).collect(),
            ..Signals::default()
        }));
    }
    found.retain(|one| one.kind != QualityIssueKind::Constant);
    found
}
