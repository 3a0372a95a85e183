//! Evidence from the data about a claim, and the resulting verdict.

use hoid_study::Statistics;

use super::{
    claim::{Claim, Source},
    evidence::Evidence,
    rules::{self, CellOutcome, CellTest, Part, Verdict},
};

/// Evidence from the data about a claim.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Verdict on the claim.
    pub verdict: Verdict,
    /// Parts of the claim with all their cells.
    pub parts: Vec<Part>,
    /// The measured numbers, a few for each part.
    pub measured_numbers: Vec<MeasuredNumber>,
    /// Number of cells that pass.
    pub passing_cells: usize,
    /// Number of cells that exceed the claimed number.
    pub exceeding_cells: usize,
    /// Number of cells that fail.
    pub failing_cells: usize,
    /// Number of all cells, including the undecided ones.
    pub cell_count: usize,
    /// The findings as text.
    pub text: String,
}

/// A number measured in the cells of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredNumber {
    /// Name of the number.
    pub label: String,
    /// Median over the cells that have a value.
    pub value: f64,
    /// Monte Carlo error of one cell: the median over the cells.
    pub error: f64,
    /// Smallest value in any cell.
    pub min: f64,
    /// Largest value in any cell.
    pub max: f64,
    /// Number of cells with a value.
    pub cells: usize,
}

impl Claim {
    /// Evaluates the claim with the evidence from the data.
    pub fn evaluate(&self, evidence: &Evidence<'_>) -> Finding {
        let found = match self.source {
            Source::Data(measure) => measure(evidence),
            Source::Untested(reason) => Err(reason.to_owned()),
        };
        let (verdict, parts) = match found {
            Ok(parts) => (rules::verdict(&parts), parts),
            Err(reason) => (Verdict::CannotBeTested(reason), Vec::new()),
        };
        let count = |outcome| parts.iter().map(|part| part.count(outcome)).sum();
        Finding {
            passing_cells: count(CellOutcome::Passes),
            exceeding_cells: count(CellOutcome::Exceeds),
            failing_cells: count(CellOutcome::Fails),
            cell_count: parts.iter().map(|part| part.tests.len()).sum(),
            measured_numbers: parts.iter().flat_map(measured_numbers).collect(),
            text: verdict_text(&verdict, &parts),
            verdict,
            parts,
        }
    }
}

fn measured_numbers(part: &Part) -> Vec<MeasuredNumber> {
    let of = |figure: fn(&CellTest) -> f64| Statistics::of(&part.tests.iter().map(figure).collect::<Vec<_>>());
    let values = of(|test| test.measured.value);
    let over_cells = MeasuredNumber {
        label: part.label.clone(),
        value: values.median,
        error: of(|test| test.measured.error).median,
        min: values.min,
        max: values.max,
        cells: values.count,
    };
    let shown = part.shown.iter().map(|(label, value)| MeasuredNumber {
        label: label.clone(),
        value: value.value,
        error: value.error,
        min: value.value,
        max: value.value,
        cells: 1,
    });
    std::iter::once(over_cells).chain(shown).collect()
}

fn verdict_text(verdict: &Verdict, parts: &[Part]) -> String {
    let of_part = |part: &Part| {
        let (above, below) = part.outcome_counts_beyond_bounds();
        let open = part.count(CellOutcome::Undecided);
        let further = part.count(CellOutcome::Exceeds);
        let mut text = format!(
            "{}: {} of {} cells pass",
            part.label,
            part.count(CellOutcome::Passes),
            part.tests.len()
        );
        for (count, what) in [
            (further, "go further"),
            (above, "above"),
            (below, "below"),
            (open, "undecided"),
        ] {
            if count > 0 {
                text.push_str(&format!(", {count} {what}"));
            }
        }
        text
    };
    let parts: Vec<String> = parts.iter().map(of_part).collect();
    match verdict {
        Verdict::CannotBeTested(reason) if parts.is_empty() => reason.clone(),
        _ => parts.join("; "),
    }
}
