//! Data for replaying a run in the page: its signals at 100 Hz, its live estimate, and its current verdict.

use serde_json::{Value, json};

use crate::{
    LabError,
    record::record,
    session::{LoggedRun, RunStart, Stem},
    verify::check,
};

/// Returns the data of the run as JSON.
///
/// # Errors
/// Errors of reading files.
pub fn data(stem: &Stem) -> Result<Vec<u8>, LabError> {
    let run_start = RunStart::read(stem)?;
    let task = run_start.task(stem)?;
    let logged = LoggedRun::read(stem)?;
    let checked = check(stem)?;
    let record = record(&run_start, &task, &logged)?;
    let channel = |name: &str| record.channel(name).map(round_for_display);
    let data = json!({
        "number": run_start.number,
        "condition": run_start.condition,
        "training": run_start.training,
        "start_s": record.time_s(0),
        "step_s": record.sample_time().s(),
        "e": channel("e"),
        "u": channel("u"),
        "y": channel("y"),
        "f": channel("f_t"),
        "live": live_rows(stem),
        "verdict": checked.label(),
        "reasons": checked.reasons(),
        "measures": checked.measures,
    });
    serde_json::to_vec(&data).map_err(|error| LabError::damaged_file(&stem.file("beh.parquet"), error.to_string()))
}

/// Rounds to six decimal places, which suffice for display.
fn round_for_display(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| (v * 1e6).round() / 1e6).collect()
}

/// Returns the rows of the live estimate (numbers or null) without the header; empty if there was no live estimate.
fn live_rows(stem: &Stem) -> Vec<Vec<Value>> {
    let text = hoid_io::read_text(&stem.file("live.csv")).unwrap_or_default();
    let cell = |cell: &str| cell.parse::<f64>().map_or(Value::Null, Value::from);
    text.lines()
        .skip(1)
        .map(|line| line.split(',').map(cell).collect())
        .collect()
}
