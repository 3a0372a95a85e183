//! Summary of a study: relative bias of the operator's parameters, as a table that fits onto one screen.
//!
//! Each row describes one estimator in one cell: the number of its estimates that could be converted to an operator,
//! and for each parameter the median of `100 (estimate - true) / true` with its Monte Carlo error. The median is used
//! because single estimates of a poor model may have arbitrarily large errors.

use std::path::PathBuf;

use hoid::io::{ColumnValues, OutputTable, read_table};
use hoid::model::numbers::count_with_noun;
use hoid::report::numbers;

use crate::{error::CliError, text};

/// Parameters in order of preference; the first of them that the table contains are shown.
const SHOWN_PARAMETERS: [&str; 10] = [
    "K_e",
    "K_over_T_I",
    "K",
    "T_L",
    "T_I",
    "omega_nm",
    "zeta_nm",
    "K_e2",
    "T_L2",
    "t_M",
];
/// Maximum number of parameters on a screen of 80 columns.
const MAX_PARAMETERS: usize = 3;
/// Maximum number of rows on a screen.
const MAX_ROWS: usize = 24;

/// Returns the summary of the tables of a study; empty if they contain no bias of a parameter.
pub fn summary(tables: &[PathBuf]) -> Result<String, CliError> {
    let is_summary = |path: &&PathBuf| path.file_stem().is_some_and(|stem| stem == "summary");
    let Some(summary) = tables.iter().find(is_summary) else {
        return Ok(String::new());
    };
    Ok(summary_text(&read_table(summary)?))
}

/// Results of one estimator in one cell.
#[derive(Default)]
struct Row {
    cell: String,
    estimator: String,
    /// Number of estimates.
    estimate_count: f64,
    /// Share of estimates that failed; `not_convertible` is the share that could not be converted to an operator.
    failed: f64,
    not_convertible: f64,
    /// Share of estimates with a trustworthy verdict; `None` if the estimator gives no verdict.
    trustworthy: Option<f64>,
    /// Bias of each parameter as text; empty if there is none.
    biases: Vec<String>,
}

fn summary_text(summary: &OutputTable) -> String {
    let (cell, estimator, quantity) = (
        text_column(summary, "cell"),
        text_column(summary, "estimator"),
        text_column(summary, "quantity"),
    );
    let [count, mean, median, error] = ["count", "mean", "median", "median_se"].map(|name| real_column(summary, name));
    let has = |what: &String| quantity.contains(what);
    let bias = |name: &str| format!("bias_{name}");
    let shown: Vec<&str> = SHOWN_PARAMETERS
        .into_iter()
        .filter(|name| has(&bias(name)))
        .take(MAX_PARAMETERS)
        .collect();
    let mut rows: Vec<Row> = Vec::new();
    for i in 0..quantity.len() {
        let known = rows
            .iter()
            .position(|row| row.cell == cell[i] && row.estimator == estimator[i]);
        let index = known.unwrap_or_else(|| {
            rows.push(Row {
                cell: cell[i].clone(),
                estimator: estimator[i].clone(),
                biases: vec![String::new(); shown.len()],
                ..Row::default()
            });
            rows.len() - 1
        });
        let row = &mut rows[index];
        match quantity[i].as_str() {
            "failed" => (row.estimate_count, row.failed) = (count[i], mean[i]),
            "not_convertible" => row.not_convertible = mean[i],
            "trustworthy" => row.trustworthy = Some(mean[i]),
            quantity => {
                if let Some(at) = shown.iter().position(|name| bias(name) == quantity) {
                    let (value, error) = numbers::with_uncertainty(median[i], Some(error[i]));
                    row.biases[at] = format!("{value} ± {error}");
                }
            }
        }
    }
    rows.retain(|row| row.trustworthy.is_some() || row.biases.iter().any(|bias| !bias.is_empty()));
    if rows.is_empty() {
        return String::new();
    }
    let verdicts = rows.iter().any(|row| row.trustworthy.is_some());
    let mut headings = vec!["cell", "estimator", "fits"];
    headings.extend(verdicts.then_some("trustworthy"));
    headings.extend(&shown);
    let mut table = text::table(&headings);
    for row in rows.iter().take(MAX_ROWS) {
        let of_all = |rate: f64| format!("{}/{}", (rate * row.estimate_count).round(), row.estimate_count);
        let mut cells = vec![row.cell.clone(), row.estimator.clone()];
        cells.push(of_all(1.0 - row.failed - row.not_convertible));
        if verdicts {
            cells.push(row.trustworthy.map(of_all).unwrap_or_default());
        }
        cells.extend(row.biases.iter().cloned());
        table.add_row(cells);
    }
    let more = match rows.len().checked_sub(MAX_ROWS) {
        None | Some(0) => String::new(),
        Some(more) => format!("and {}\n", count_with_noun(more, "more row")),
    };
    format!(
        "{table}\n{more}Fits: how many give an operator, out of all fits. Relative bias in %: median over these fits \
         and its Monte Carlo error. The table summary has the other parameters and their spread. hoid study check \
         lists the cells by number.\n"
    )
}

fn text_column(table: &OutputTable, name: &str) -> Vec<String> {
    match table.column(name) {
        Some(ColumnValues::Text(values)) => values.clone(),
        Some(ColumnValues::Whole(values)) => values.iter().map(u64::to_string).collect(),
        Some(ColumnValues::Real(values)) => values.iter().map(f64::to_string).collect(),
        None => Vec::new(),
    }
}

fn real_column(table: &OutputTable, name: &str) -> Vec<f64> {
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
    fn answer_has_a_row_per_estimator_and_cell() {
        let column = |name: &str, values| OutputColumn {
            name: name.to_owned(),
            values,
        };
        let names = |all: &[&str]| ColumnValues::Text(all.iter().map(|&one| one.to_owned()).collect());
        let rows: [(u64, &str, &str, u64, [f64; 3]); 9] = [
            (0, "ARX", "loss", 10, [0.0, 1.0, 0.1]),
            (0, "ARX", "bias_K_e", 3, [0.0, 1.8, 1.4]),
            (0, "ARX", "bias_T_L", 3, [0.0, -12.34, 2.1]),
            (0, "ARX", "failed", 10, [0.1, f64::NAN, f64::NAN]),
            (0, "ARX", "not_convertible", 10, [0.6, f64::NAN, f64::NAN]),
            (1, "operator", "bias_K_e", 10, [0.0, 0.12, 0.48]),
            (1, "operator", "failed", 10, [0.0, f64::NAN, f64::NAN]),
            (1, "operator", "trustworthy", 10, [0.7, f64::NAN, f64::NAN]),
            (1, "record", "failed", 10, [0.0, f64::NAN, f64::NAN]),
        ];
        let real = |which: usize| ColumnValues::Real(rows.iter().map(|row| row.4[which]).collect());
        let table = OutputTable {
            comments: Vec::new(),
            columns: vec![
                column("cell", ColumnValues::Whole(rows.iter().map(|row| row.0).collect())),
                column("estimator", names(&rows.map(|row| row.1))),
                column("quantity", names(&rows.map(|row| row.2))),
                column("count", ColumnValues::Whole(rows.iter().map(|row| row.3).collect())),
                column("mean", real(0)),
                column("median", real(1)),
                column("median_se", real(2)),
            ],
        };
        let words = summary_text(&table);
        for part in [
            "3/10",
            "1.8 ± 1.4",
            "-12.3 ± 2.1",
            "10/10",
            "7/10",
            "trustworthy",
            "0.12 ± 0.48",
            "fits",
        ] {
            assert!(words.contains(part), "{part}: {words}");
        }
        assert!(!words.contains("omega_nm") && !words.contains("record"), "{words}");
    }
}
