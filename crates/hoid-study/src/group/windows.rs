//! The windows of a run in which quantities are estimated.

use hoid_model::Record;

use super::analysis_settings::AnalysisSettings;

/// Name of the window that covers the whole run.
pub(super) const WHOLE_RUN: &str = "whole";

/// A time span of the run, with its name.
#[derive(Clone, Copy)]
pub(super) struct Window {
    pub name: &'static str,
    pub from_s: f64,
    pub to_s: f64,
}

/// Returns the two sub-batches and the whole run.
pub(super) fn windows(settings: &AnalysisSettings, record: &Record) -> [Window; 3] {
    let (start, end) = (
        record.time_s(0),
        record.time_s(0) + record.len() as f64 * record.sample_time().s(),
    );
    let eighth = (end - start) / 8.0;
    let [first, last] = settings
        .windows_s
        .unwrap_or([(start, start + 3.0 * eighth), (end - 3.0 * eighth, end)]);
    let window = |name, (from_s, to_s)| Window { name, from_s, to_s };
    [
        window("first", first),
        window("last", last),
        window(WHOLE_RUN, (start, end)),
    ]
}
