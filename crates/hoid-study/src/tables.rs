//! Access to the tables of a study by column, in Parquet or CSV format.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
};

use hoid_io::{ColumnValues, OutputTable};

use crate::StudyError;

/// Returns the path of a table: the Parquet file if it exists, otherwise the CSV file.
pub(crate) fn table_path(directory: &Path, table: &str) -> PathBuf {
    let parquet = directory.join(format!("{table}.parquet"));
    if parquet.exists() {
        parquet
    } else {
        directory.join(format!("{table}.csv"))
    }
}

/// A table with access by column. In CSV the kind of a column is unknown if it has only whole numbers or no values.
pub(crate) struct Columns {
    file: String,
    table: OutputTable,
}

impl Columns {
    pub(crate) fn read(directory: &Path, table: &str) -> Result<Self, StudyError> {
        let path = table_path(directory, table);
        Ok(Self {
            table: hoid_io::read_table(&path)?,
            file: path.display().to_string(),
        })
    }

    fn column(&self, name: &str) -> Result<&ColumnValues, StudyError> {
        self.table
            .column(name)
            .ok_or_else(|| self.problem(format!("it has no column {name}")))
    }

    fn problem(&self, reason: String) -> StudyError {
        StudyError::Table {
            file: self.file.clone(),
            reason,
        }
    }

    /// Returns the names of the columns that contain no text.
    pub(crate) fn numeric_column_names(&self) -> impl Iterator<Item = &str> {
        let numbers = self.table.columns.iter().filter(|column| match &column.values {
            ColumnValues::Text(values) => values.iter().all(String::is_empty),
            _ => true,
        });
        numbers.map(|column| column.name.as_str())
    }

    pub(crate) fn real(&self, name: &str) -> Result<Vec<f64>, StudyError> {
        match self.column(name)? {
            ColumnValues::Real(values) => Ok(values.clone()),
            ColumnValues::Whole(values) => Ok(values.iter().map(|v| *v as f64).collect()),
            ColumnValues::Text(values) if values.iter().all(String::is_empty) => Ok(vec![f64::NAN; values.len()]),
            ColumnValues::Text(_) => Err(self.problem(format!("column {name} is text, expected numbers"))),
        }
    }

    pub(crate) fn text(&self, name: &str) -> Result<&[String], StudyError> {
        match self.column(name)? {
            ColumnValues::Text(values) => Ok(values),
            _ => Err(self.problem(format!("column {name} has numbers, expected text"))),
        }
    }

    pub(crate) fn cell_estimator_index(
        &self,
        at: &HashMap<(u64, String), usize>,
        cell: f64,
        estimator: &str,
    ) -> Result<usize, StudyError> {
        at.get(&(cell as u64, estimator.to_owned()))
            .copied()
            .ok_or_else(|| self.problem(format!("its plan has no cell {cell} with the estimator {estimator}")))
    }
}
