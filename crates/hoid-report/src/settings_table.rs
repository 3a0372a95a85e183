//! Contents of the table of settings on every page.

use hoid_analysis::{Account, Setting};
use hoid_io::{QualityIssue, Step};
use hoid_model::Fault;

/// Inputs and processing as pairs of name and value: version, records, settings, the processing steps applied to the
/// records and the problems found in them.
pub fn settings_pairs(names: &[String], settings: &[Setting], accounts: &[Account]) -> Vec<(String, String)> {
    let records = if names.len() == 1 { "record" } else { "records" };
    let mut rows = vec![
        ("hoid".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        (records.to_owned(), names.join(", ")),
    ];
    rows.extend(settings.iter().map(|one| (one.name.clone(), one.value.clone())));
    let name = |what: &str, file: &str| match names.len() {
        1 => what.to_owned(),
        _ => format!("{what} of {file}"),
    };
    for (file, account) in names.iter().zip(accounts) {
        let steps: Vec<String> = account.steps.iter().map(Step::to_string).collect();
        let issues: Vec<String> = account.quality_issues.iter().map(QualityIssue::to_string).collect();
        let faults: Vec<String> = account.faults.iter().map(Fault::to_string).collect();
        for (what, parts) in [
            ("preparation", steps),
            ("sampling problems", issues),
            ("faults", faults),
        ] {
            if !parts.is_empty() {
                rows.push((name(what, file), parts.join("; ")));
            }
        }
    }
    rows
}
