//! Curves of medians with bars from the lower to the upper quartile.

use hoid_report::figures::{Curve, LineKind, Shade};
use hoid_study::SummaryRow;

/// Creates a curve of medians with bars from the lower to the upper quartile.
pub(super) fn with_quartiles(name: &str, shade: Shade, points: &[(f64, &SummaryRow)]) -> Curve {
    Curve {
        name: name.to_owned(),
        kind: LineKind::Marked,
        shade,
        x: points.iter().map(|(x, _)| *x).collect(),
        y: points.iter().map(|(_, row)| row.statistics.median).collect(),
        band: Vec::new(),
        bars: points
            .iter()
            .map(|(_, row)| (row.statistics.lower_quartile, row.statistics.upper_quartile))
            .collect(),
    }
}
