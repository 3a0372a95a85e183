//! What a study says of the operator's parameters: their relative bias, as a table of one screen.
//!
//! A row is an estimator in a cell: how many of its estimates are an operator, and for each parameter the
//! median of `100 (estimate - true) / true` with its Monte Carlo error. The median, since single
//! estimates of a poor model may be as wrong as they like.

use std::path::PathBuf;

use hoid::io::{ColumnValues, OutputTable, read_table};
use hoid::report::numbers;

use crate::{error::CliError, text};

/// Parameters that are shown, the first that the table has.
const PARAMETERS: [&str; 7] = ["K_e", "K_over_T_I", "K", "T_L", "T_I", "omega_nm", "zeta_nm"];
/// Columns of a screen that is 80 wide.
const MOST_PARAMETERS: usize = 3;
/// Rows of one screen.
const MOST_ROWS: usize = 24;

/// The answer of the tables of a study; empty where they have no bias of a parameter.
pub fn answer(tables: &[PathBuf]) -> Result<String, CliError> {
    let is_summary = |path: &&PathBuf| path.file_stem().is_some_and(|stem| stem == "summary");
    let Some(summary) = tables.iter().find(is_summary) else {
        return Ok(String::new());
    };
    Ok(words(&read_table(summary)?))
}

/// One estimator in one cell.
struct Row {
    cell: String,
    estimator: String,
    /// Estimates that are an operator, and all.
    estimates: (f64, f64),
    /// One a parameter, empty where there is none.
    biases: Vec<String>,
}

fn words(summary: &OutputTable) -> String {
    let (cell, estimator, quantity) = (
        texts(summary, "cell"),
        texts(summary, "estimator"),
        texts(summary, "quantity"),
    );
    let [count, missing, median, error] = ["count", "missing", "median", "median_se"].map(|name| reals(summary, name));
    let bias = |name: &str| format!("bias_{name}");
    let shown: Vec<&str> = PARAMETERS
        .into_iter()
        .filter(|name| quantity.contains(&bias(name)))
        .take(MOST_PARAMETERS)
        .collect();
    let mut rows: Vec<Row> = Vec::new();
    for i in 0..quantity.len() {
        let Some(at) = shown.iter().position(|name| bias(name) == quantity[i]) else {
            continue;
        };
        let known = rows
            .iter()
            .position(|row| row.cell == cell[i] && row.estimator == estimator[i]);
        let place = known.unwrap_or_else(|| {
            rows.push(Row {
                cell: cell[i].clone(),
                estimator: estimator[i].clone(),
                estimates: (count[i], count[i] + missing[i]),
                biases: vec![String::new(); shown.len()],
            });
            rows.len() - 1
        });
        let (value, error) = numbers::with_uncertainty(median[i], Some(error[i]));
        rows[place].biases[at] = format!("{value} ± {error}");
    }
    if rows.is_empty() {
        return String::new();
    }
    let mut headings = vec!["cell", "estimator", "fits"];
    headings.extend(&shown);
    let mut table = text::table(&headings);
    for row in rows.iter().take(MOST_ROWS) {
        let mut cells = vec![row.cell.clone(), row.estimator.clone()];
        cells.push(format!("{}/{}", row.estimates.0, row.estimates.1));
        cells.extend(row.biases.iter().cloned());
        table.add_row(cells);
    }
    let more = match rows.len().checked_sub(MOST_ROWS) {
        None | Some(0) => String::new(),
        Some(more) => format!("and {more} rows more\n"),
    };
    format!(
        "{table}\n{more}Relative bias in %: median over the fits that are an operator (of all), and its Monte Carlo error. \
         Other parameters and their spread: table summary. Cells by number: hoid study check.\n"
    )
}

fn texts(table: &OutputTable, name: &str) -> Vec<String> {
    match table.column(name) {
        Some(ColumnValues::Text(values)) => values.clone(),
        Some(ColumnValues::Whole(values)) => values.iter().map(u64::to_string).collect(),
        Some(ColumnValues::Real(values)) => values.iter().map(f64::to_string).collect(),
        None => Vec::new(),
    }
}

fn reals(table: &OutputTable, name: &str) -> Vec<f64> {
    match table.column(name) {
        Some(ColumnValues::Real(values)) => values.clone(),
        Some(ColumnValues::Whole(values)) => values.iter().map(|value| *value as f64).collect(),
        Some(ColumnValues::Text(_)) | None => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use hoid::io::OutputColumn;

    use super::*;

    #[test]
    fn a_row_for_each_estimator_in_each_cell() {
        let column = |name: &str, values| OutputColumn {
            name: name.to_owned(),
            values,
        };
        let names = |all: &[&str]| ColumnValues::Text(all.iter().map(|&one| one.to_owned()).collect());
        let table = OutputTable {
            comments: Vec::new(),
            columns: vec![
                column("cell", ColumnValues::Whole(vec![0, 0, 0, 1])),
                column("estimator", names(&["ARX", "ARX", "ARX", "BJ"])),
                column("quantity", names(&["loss", "bias_K_e", "bias_T_L", "bias_K_e"])),
                column("count", ColumnValues::Whole(vec![10, 3, 3, 10])),
                column("missing", ColumnValues::Whole(vec![0, 7, 7, 0])),
                column("median", ColumnValues::Real(vec![1.0, 1.8, -12.34, 0.12])),
                column("median_se", ColumnValues::Real(vec![0.1, 1.4, 2.1, 0.48])),
            ],
        };
        let words = words(&table);
        for part in ["3/10", "1.8 ± 1.4", "-12.3 ± 2.1", "10/10", "0.12 ± 0.48", "fits"] {
            assert!(words.contains(part), "{part}: {words}");
        }
        assert!(!words.contains("omega_nm"), "{words}");
    }
}
