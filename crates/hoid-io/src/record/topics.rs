//! Topics that were written one after the other into one table, each with the times of its own block, as some programs
//! export the recordings of ROS.
//!
//! The rows of the topics are put in the order of t, and rows of the same t are joined. The result is the table of an
//! outer join: where the topics share a time, all cells are filled; in other rows, the cells of the other topics are
//! missing.

use super::read_options::ReadOptions;
use crate::table::{Signal, Table, keep_rows};
use crate::time::sampling::pairs;

/// Returns the table with its topics joined if t decreases and no row has values of both input and output, although
/// each of these has values in other rows; otherwise returns the table unchanged.
pub(crate) fn join_topics<'a>(table: Table<'a>, options: &ReadOptions) -> Table<'a> {
    let names = table.names();
    let Some(time) = names.iter().position(|name| *name == "t") else {
        return table;
    };
    let resolved = |signal: Option<Signal>| signal.map(|signal| signal.columns().collect::<Vec<_>>());
    let input = resolved(options.input.as_ref().and_then(|one| one.resolve(&names, "").ok()));
    let output = resolved(options.output.resolve(&names, "").ok());
    let Some((input, output)) = input.zip(output) else {
        return table;
    };
    let t = table.columns.get(time).map_or(&[][..], |column| &column.values);
    let falls = pairs(t).any(|(before, next)| next < before);
    let has = |columns: &[usize], row: usize| columns.iter().all(|at| table.value(*at, row).is_finite());
    let has_some = |columns: &[usize]| (0..table.rows).any(|row| has(columns, row));
    let apart = || (0..table.rows).all(|row| !(has(&input, row) && has(&output, row)));
    if !falls || !t.iter().all(|t| t.is_finite()) || !apart() || !has_some(&input) || !has_some(&output) {
        return table;
    }
    let mut order: Vec<usize> = (0..table.rows).collect();
    order.sort_by(|a, b| table.value(time, *a).total_cmp(&table.value(time, *b)));
    with_joined_rows(keep_rows(table, order), time)
}

/// Joins consecutive rows of the same t: each missing value is taken from the next of these rows that has one.
fn with_joined_rows(mut table: Table<'_>, time: usize) -> Table<'_> {
    let mut rows: Vec<usize> = Vec::new();
    for row in 0..table.rows {
        let first = rows.last().copied();
        let Some(first) = first.filter(|first| table.value(time, *first) == table.value(time, row)) else {
            rows.push(row);
            continue;
        };
        for column in &mut table.columns {
            let value = column.values.get(row).copied().unwrap_or(f64::NAN);
            if column.is_missing(first)
                && let Some(place) = column.values.get_mut(first)
            {
                *place = value;
            }
        }
    }
    let mut table = keep_rows(table, rows);
    table.notes.push(String::from(
        "t starts again, and no row has values of both input and output: the rows are joined by t as topics",
    ));
    table
}
