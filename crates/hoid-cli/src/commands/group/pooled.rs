//! `hoid group --pool`: writes the partially pooled estimates of the people and the population of each condition to
//! files, and shows them on the page.

use std::path::{Path, PathBuf};

use hoid::design::pool::{Population, pool, table};
use hoid::ident::family::OperatorPrior;
use hoid::model::numbers::{format_significant, with_uncertainty};
use hoid::study::group::{GroupSummary, Manifest};

use serde_json::Value;

use crate::{error::CliError, text};

const TABLE_FILE: &str = "pooled.csv";

/// Computes the estimates with partial pooling and writes them to files. Returns the populations and the paths of the
/// files.
pub fn write_pooled_estimates(
    manifest: &Manifest,
    summary: &GroupSummary,
    out: &Path,
) -> Result<(Vec<Population>, Vec<PathBuf>), CliError> {
    let prior: OperatorPrior = manifest.analysis.prior.parse()?;
    let populations = pool(&summary.people, &prior);
    let mut files = vec![out.join(TABLE_FILE)];
    hoid::io::write_table(&files[0], &table(&populations))?;
    for population in &populations {
        let name = match populations.len() {
            1 => "population.json".to_owned(),
            _ => format!("population-{}.json", to_file_name(&population.condition)),
        };
        let text = format!("{:#}\n", population.json());
        let path = out.join(name);
        hoid::io::write_atomically(&path, |file| file.write_all(text.as_bytes()))?;
        files.push(path);
    }
    Ok((populations, files))
}

/// Converts the name of a condition for use in a file name.
pub fn to_file_name(condition: &str) -> String {
    condition.replace(|c: char| !c.is_ascii_alphanumeric() && c != '-' && c != '_', "-")
}

/// Returns the populations as JSON objects.
pub fn populations_json(populations: &[Population]) -> Value {
    populations.iter().map(Population::json).collect()
}

/// Returns the part of the page that describes the populations.
pub fn page(populations: &[Population], files: &[PathBuf]) -> String {
    let mut rows = text::table(&[
        "condition",
        "parameter",
        "population",
        "spread",
        "person",
        "own data",
        "from all",
        "shrinkage",
    ]);
    let mut left_out = String::new();
    for population in populations {
        for parameter in &population.parameters {
            for (k, person) in parameter.people.iter().enumerate() {
                let once = |text: String| if k == 0 { text } else { String::new() };
                let of = |value: f64, error: f64| {
                    let (value, error) = with_uncertainty(value, Some(error));
                    format!("{value} ± {error}")
                };
                rows.add_row([
                    once(population.condition.clone()),
                    once(parameter.name.clone()),
                    once(format_significant(parameter.centre, 3)),
                    once(format!("{:.0} %", 100.0 * parameter.spread)),
                    person.subject.clone(),
                    person
                        .own
                        .map_or_else(|| "nothing".to_owned(), |(value, error)| of(value, error)),
                    of(person.value, person.standard_error),
                    format!("{:.0} %", 100.0 * person.shrinkage),
                ]);
            }
        }
        for (name, why) in &population.left_out {
            left_out.push_str(&format!("{name} in {} is not pooled: {why}.\n", population.condition));
        }
    }
    let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
    format!(
        "\nEstimates of each person, pooled with all others (without the prior of the fits)\n{rows}\n\
         {left_out}Written: {}.\n",
        names.join(", ")
    )
}
