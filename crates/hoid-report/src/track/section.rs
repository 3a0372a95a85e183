//! One recursive estimate on a page, with its batch fits.

use hoid_ident::Fit;
use hoid_track::Trace;

/// One recursive estimate on the page.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceSection<'a> {
    /// Heading and legend text, such as `RPEM`.
    pub name: String,
    /// The trace of the estimate.
    pub trace: &'a Trace,
    /// Batch fits for comparison.
    pub batch: Vec<BatchLine<'a>>,
}

/// A batch fit to a span of the record, drawn as a dotted line over that span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BatchLine<'a> {
    /// Start of the span, s.
    pub from_s: f64,
    /// End of the span, s.
    pub to_s: f64,
    /// The batch fit.
    pub fit: &'a Fit,
}
