//! The tables of a survey, in the format of `research/notes/survey-methods.md`.

use std::collections::BTreeMap;

use hoid_study::{plan::Cell, statistics::median};

use super::{measure::Errors, plan::SurveyPlan, run::MethodErrors};

/// Returns the values displayed for one run: the response in three spans, and K_e, K_e_dot and omega_nm.
fn displayed_values(errors: &Errors) -> [f64; 6] {
    let ([before, through, after], o) = (errors.response, errors.operator);
    [before, through, after, o[0], o[2], o[3]]
}

/// Formats a value with about two digits, as a dash if it is missing, and as `> 1000` if the method diverged.
fn format_two_digits(value: f64) -> String {
    match value {
        v if v.is_nan() => "–".to_owned(),
        v if v >= 1000.0 => "> 1000".to_owned(),
        v if v >= 10.0 => format!("{v:.0}"),
        v => format!("{v:.1}"),
    }
}

/// Returns the median over the runs of each displayed value, which is NaN unless more than half of the runs give a
/// number, and the number of failed runs.
fn medians(of: &MethodErrors) -> ([f64; 6], usize) {
    let runs: Vec<[f64; 6]> = of.runs.iter().flatten().map(displayed_values).collect();
    let column = |i: usize| {
        let finite: Vec<f64> = runs.iter().map(|run| run[i]).filter(|x| x.is_finite()).collect();
        match 2 * finite.len() > of.runs.len() {
            true => median(&finite),
            false => f64::NAN,
        }
    };
    (std::array::from_fn(column), of.runs.len() - runs.len())
}

fn heading(cell: &Cell) -> String {
    let mut words = vec![cell.condition.clone()];
    words.extend(cell.axes.iter().filter(|axis| axis.key != "condition").map(|axis| {
        let name = match axis.key.as_str() {
            "remnant_order" => "m0",
            "remnant_noise_level" => "P_n",
            other => other,
        };
        format!("{name} = {}", axis.value)
    }));
    words.join(", ")
}

/// Returns the tables in Markdown: one with the medians of all methods over the cells, and one for each cell.
pub fn survey_tables(plan: &SurveyPlan, found: &[MethodErrors]) -> String {
    let mut text = String::new();
    let mut everywhere: BTreeMap<&str, Vec<[f64; 6]>> = BTreeMap::new();
    let mut first: Vec<&MethodErrors> = Vec::new();
    let mut each = String::new();
    for cell in &plan.study.cells {
        each += &format!("\n### {}\n\n{}", heading(cell), table_head("failed"));
        for of in found.iter().filter(|of| of.cell == cell.index) {
            let (row, failed) = medians(of);
            let cells: Vec<String> = row.iter().map(|value| format_two_digits(*value)).collect();
            let failed = if failed > 0 { failed.to_string() } else { String::new() };
            each += &format!("| {} | {} | {failed} |\n", of.name, cells.join(" | "));
            if !everywhere.contains_key(of.name.as_str()) {
                first.push(of);
            }
            everywhere.entry(&of.name).or_default().push(row);
        }
    }
    text += &table_head("ms per run");
    for of in first {
        let rows = &everywhere[of.name.as_str()];
        let column = |i: usize| {
            let finite: Vec<f64> = rows.iter().map(|row| row[i]).filter(|x| x.is_finite()).collect();
            format_two_digits(if finite.is_empty() { f64::NAN } else { median(&finite) })
        };
        let cells: Vec<String> = (0..6).map(column).collect();
        let mark = if of.extra_information.is_empty() { "" } else { " *" };
        text += &format!(
            "| {}{mark} | {} | {} |\n",
            of.name,
            cells.join(" | "),
            format_two_digits(1e3 * of.seconds)
        );
    }
    let extra_information: Vec<String> = plan
        .comparators
        .iter()
        .filter(|(_, of)| !of.description().extra_information.is_empty())
        .map(|(name, of)| format!("- *{name}*: {}.", of.description().extra_information))
        .collect();
    format!(
        "{text}\n\\* needs more than e, u and n_k:\n\n{}\n{each}",
        extra_information.join("\n")
    )
}

fn table_head(last: &str) -> String {
    format!("| method | H before | through | after | K_e | K_ė | ω_nm | {last} |\n|---|---|---|---|---|---|---|---|\n")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn medians_ignore_failed_runs() {
        let errors = |before: f64, k_e: f64| {
            Ok(Errors {
                response: [before, 20.0, 30.0],
                operator: [k_e, 1.0, 2.0, 3.0, 4.0],
            })
        };
        let of = MethodErrors {
            cell: 0,
            name: "one".to_owned(),
            extra_information: "",
            runs: vec![
                errors(10.0, f64::NAN),
                errors(12.0, f64::NAN),
                errors(4000.0, 5.0),
                Err("failed".to_owned()),
            ],
            seconds: 0.5,
        };
        let (row, failed) = medians(&of);
        assert_eq!((row[0], row[1], failed), (12.0, 20.0, 1));
        assert!(row[3].is_nan());
        assert_eq!(
            [
                format_two_digits(row[0]),
                format_two_digits(row[3]),
                format_two_digits(4e3),
                format_two_digits(9.96)
            ],
            ["12", "–", "> 1000", "10.0"]
        );
    }
}
