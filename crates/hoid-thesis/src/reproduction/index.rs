//! The page of the reproduction: tables, figures with their data, claims, and studies with their plans.

use crate::claims::{Claim, Finding, MeasuredNumber, Verdict};
use hoid_io::{ColumnValues, OutputTable};
use minijinja::{Value, context};

use super::item::Item;
use hoid_report::{numbers, render_with};

use crate::ThesisError;

/// Contents of the page of the reproduction.
#[derive(Debug, Default)]
pub struct IndexPage {
    /// Inputs and processing, as pairs of name and value.
    pub settings: Vec<(String, String)>,
    /// Remarks for the reader.
    pub notes: Vec<String>,
    entries: Vec<Value>,
    claims: Vec<Value>,
    /// Numbers of claims by verdict: hold, hold more strongly, hold in part, do not hold, cannot be tested.
    verdict_counts: [usize; 5],
    studies: Vec<Value>,
}

/// Entry for a study on the page.
#[derive(Debug, Clone, PartialEq)]
pub struct StudyEntry {
    /// Name of the study.
    pub name: String,
    /// Title of the study.
    pub title: String,
    /// Path of the directory of the study, relative to the page; empty if the results are not stored.
    pub directory: String,
    /// Number of estimates.
    pub estimates: u64,
    /// Duration (s); `None` if the results already existed.
    pub seconds: Option<f64>,
}

impl IndexPage {
    /// Adds a table or figure, with the paths of its figure and its data relative to the page.
    pub fn add(&mut self, item: &Item, svg: Option<&str>, data: &str, table: &OutputTable) {
        let rows = if svg.is_none() { table_rows(table) } else { Vec::new() };
        let header: Vec<String> = table.columns.iter().map(|c| c.name.clone()).collect();
        self.entries.push(context! {
            name => &item.name, title => &item.title, caption => &item.caption, plan => item.plan,
            svg, data, header, rows,
        });
    }

    /// Adds the claims of the thesis with the evidence about them.
    pub fn add_claims(&mut self, findings: &[(Claim, Finding)]) {
        let mut theme = "";
        for (claim, finding) in findings {
            // Only the first claim of a theme has a heading.
            let heading = (claim.theme.title() != theme).then(|| claim.theme.title());
            theme = claim.theme.title();
            let class = match finding.verdict {
                Verdict::Holds | Verdict::HoldsWithLargerEffect => "holds",
                Verdict::HoldsInPart => "part",
                Verdict::DoesNotHold => "not",
                Verdict::CannotBeTested(_) => "open",
            };
            let measured: Vec<String> = finding.measured_numbers.iter().map(format_measured).collect();
            self.claims.push(context! {
                heading, class, measured, id => claim.id, statement => claim.statement, place => claim.reference, measure => claim.measure,
                found => &finding.text, verdict => finding.verdict.to_string(),
            });
        }
        let count = |of: fn(&Verdict) -> bool| findings.iter().filter(|(_, finding)| of(&finding.verdict)).count();
        self.verdict_counts = [
            count(|v| *v == Verdict::Holds),
            count(|v| *v == Verdict::HoldsWithLargerEffect),
            count(|v| *v == Verdict::HoldsInPart),
            count(|v| *v == Verdict::DoesNotHold),
            count(|v| matches!(v, Verdict::CannotBeTested(_))),
        ];
    }

    /// Returns the numbers of claims by verdict: hold, hold more strongly, hold in part, do not hold, cannot be tested.
    pub fn verdict_counts(&self) -> [usize; 5] {
        self.verdict_counts
    }

    /// Adds a study.
    pub fn add_study(&mut self, study: &StudyEntry) {
        let seconds = study.seconds.map(|s| format!("{s:.1}"));
        self.studies.push(context! {
            name => &study.name, title => &study.title, directory => &study.directory, estimates => study.estimates, seconds,
        });
    }

    /// Returns the page as HTML text.
    ///
    /// # Errors
    /// [`ThesisError::Report`] if the template is defective.
    pub fn to_html(&self) -> Result<String, ThesisError> {
        let facts: Vec<_> = self
            .settings
            .iter()
            .map(|(label, text)| context! { label, text })
            .collect();
        let page = render_with(
            &[("reproduction.html", include_str!("../../templates/reproduction.html"))],
            "reproduction.html",
            context! {
                title => "Reproduction of the thesis",
                settings => facts,
                notes => &self.notes,
                entries => &self.entries,
                claims => &self.claims,
                tally => self.verdict_counts,
                studies => &self.studies,
            },
        )?;
        Ok(page)
    }
}

/// Formats a measured value with its error and, if there are several cells, its range over the cells.
fn format_measured(of: &MeasuredNumber) -> String {
    let (value, error) = numbers::with_uncertainty(of.value, Some(of.error).filter(|error| *error > 0.0));
    let error = if of.error > 0.0 {
        format!(" \u{b1} {error}")
    } else {
        String::new()
    };
    let range = if of.cells > 1 {
        format!(
            " ({} to {} in {} cells)",
            format_number(of.min),
            format_number(of.max),
            of.cells
        )
    } else {
        String::new()
    };
    format!("{}: {value}{error}{range}", of.label)
}

/// Returns the cells of a table as text.
fn table_rows(table: &OutputTable) -> Vec<Vec<String>> {
    let rows = table.columns.first().map_or(0, |c| c.values.len());
    let cell = |values: &ColumnValues, row: usize| match values {
        ColumnValues::Real(v) if v[row].is_nan() => "\u{2013}".to_owned(),
        ColumnValues::Real(v) => format_number(v[row]),
        ColumnValues::Whole(v) => v[row].to_string(),
        ColumnValues::Text(v) => v[row].clone(),
    };
    (0..rows)
        .map(|row| table.columns.iter().map(|c| cell(&c.values, row)).collect())
        .collect()
}

/// Formats a number with up to six significant digits.
fn format_number(value: f64) -> String {
    if !value.is_finite() {
        return "\u{2013}".to_owned();
    }
    if value == value.round() && value.abs() < 1e6 {
        return format!("{value}");
    }
    let digits = (5 - value.abs().log10().floor() as i32).clamp(0, 10) as usize;
    format!("{value:.digits$}")
        .trim_end_matches('0')
        .trim_end_matches('.')
        .to_owned()
}
