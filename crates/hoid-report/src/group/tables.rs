//! The tables of a finished group and their columns.

use hoid_io::{ColumnValues, OutputTable};

/// The tables of a finished group.
#[derive(Debug, Clone, Copy)]
pub struct GroupTables<'a> {
    /// All estimates in long format.
    pub estimates: &'a OutputTable,
    /// Averages of the estimates over runs.
    pub averages: &'a OutputTable,
    /// Delays and T_n selected before the fits, one row per subject and condition.
    pub delays: &'a OutputTable,
    /// Averages of the traces over runs.
    pub traces: &'a OutputTable,
    /// Settling times and noise of the recursions; empty if no condition has a change.
    pub settling: &'a OutputTable,
    /// Averages of the frequency responses of the fits.
    pub responses: &'a OutputTable,
    /// Tables of the describing functions; `None` if the manifest gives no excitation.
    pub frequencies: Option<FrequencyTables<'a>>,
}

/// The tables of the describing functions.
#[derive(Debug, Clone, Copy)]
pub struct FrequencyTables<'a> {
    /// The describing functions, one row per line.
    pub lines: &'a OutputTable,
    /// Crossover, margins, noise and verdict, one row per subject and condition.
    pub margins: &'a OutputTable,
    /// Distance of each estimator from the describing function.
    pub agreement: &'a OutputTable,
}

/// A column of text values; empty if the table has no such column.
pub(super) fn texts<'a>(table: &'a OutputTable, name: &str) -> &'a [String] {
    match table.column(name) {
        Some(ColumnValues::Text(values)) => values,
        _ => &[],
    }
}

/// A column of numbers; empty if the table has no such column.
pub(super) fn reals<'a>(table: &'a OutputTable, name: &str) -> &'a [f64] {
    match table.column(name) {
        Some(ColumnValues::Real(values)) => values,
        _ => &[],
    }
}

/// Indices of the rows of a table that belong to a subject and condition.
pub(super) fn rows_of(table: &OutputTable, subject: &str, condition: &str) -> Vec<usize> {
    let (s, c) = (texts(table, "subject"), texts(table, "condition"));
    (0..s.len())
        .filter(|i| s[*i] == subject && c[*i] == condition)
        .collect()
}
