//! Claims and their verdicts as a table.

use hoid_io::{ColumnValues, OutputColumn, OutputTable};

use super::{
    claim::Claim,
    finding::{Finding, MeasuredNumber},
};

/// Creates a table of claims, one row for each, with the measurements as text and the first measured number.
pub fn claims_table(findings: &[(Claim, Finding)]) -> OutputTable {
    let text = |name: &str, of: &dyn Fn(&Claim, &Finding) -> String| OutputColumn {
        name: name.to_owned(),
        values: ColumnValues::Text(findings.iter().map(|(claim, finding)| of(claim, finding)).collect()),
    };
    let whole = |name: &str, of: &dyn Fn(&Finding) -> usize| OutputColumn {
        name: name.to_owned(),
        values: ColumnValues::Whole(findings.iter().map(|(_, finding)| of(finding) as u64).collect()),
    };
    let real = |name: &str, of: &dyn Fn(&MeasuredNumber) -> f64| OutputColumn {
        name: name.to_owned(),
        values: ColumnValues::Real(
            findings
                .iter()
                .map(|(_, finding)| finding.measured_numbers.first().map_or(f64::NAN, of))
                .collect(),
        ),
    };
    OutputTable {
        comments: vec!["Statements of the thesis and the evidence from the data".to_owned()],
        columns: vec![
            text("id", &|claim, _| claim.id.to_owned()),
            text("theme", &|claim, _| claim.theme.title().to_owned()),
            text("statement", &|claim, _| claim.statement.to_owned()),
            text("place", &|claim, _| claim.reference.to_owned()),
            text("measure", &|claim, _| claim.measure.to_owned()),
            text("plans", &|claim, _| claim.plans.join(" ")),
            text("verdict", &|_, finding| finding.verdict.to_string()),
            whole("passed", &|finding| finding.passing_cells),
            whole("exceeded", &|finding| finding.exceeding_cells),
            whole("failed", &|finding| finding.failing_cells),
            whole("cells", &|finding| finding.cell_count),
            real("value", &|measured| measured.value),
            real("error", &|measured| measured.error),
            real("least", &|measured| measured.min),
            real("most", &|measured| measured.max),
            text("found", &|_, finding| finding.text.clone()),
        ],
    }
}
