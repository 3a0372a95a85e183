//! One recursive estimate of a page and its batch fits.

use hoid_ident::Fit;
use hoid_track::Trace;

/// One recursive estimate of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceSection<'a> {
    /// Heading and legend text, such as `RPEM`.
    pub name: String,
    /// The estimate.
    pub trace: &'a Trace,
    /// Batch fits for comparison.
    pub batch: Vec<BatchLine<'a>>,
}

/// A batch fit of a span, drawn as a dashed line over that span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatchLine<'a> {
    /// Start of the span, s.
    pub from_s: f64,
    /// End of the span, s.
    pub to_s: f64,
    /// The fit.
    pub fit: &'a Fit,
}
