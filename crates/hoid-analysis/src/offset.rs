//! A channel that was recorded late, in what is periodic: an offset of rows is a phase there, and cut rows
//! would leave less than whole periods.

use std::collections::BTreeMap;

use hoid_io::{NewRate, Offset};
use hoid_model::Record;

use crate::{AnalysisError, reading::Reading};

/// How to read without moving rows, and the offsets. With another sampling frequency, which the offset comes
/// before, it stays with the reading.
pub fn without_offsets(reading: &Reading) -> (Reading, BTreeMap<String, Offset>) {
    let mut reading = reading.clone();
    let offsets = match reading.preparation.rate {
        NewRate::Hz(_) => BTreeMap::new(),
        _ => std::mem::take(&mut reading.preparation.offset),
    };
    (reading, offsets)
}

/// Number of samples by which the output is later than the input. The offset of another channel turns its own phase
/// alone, which no average depends on.
///
/// # Errors
/// [`AnalysisError::NoSuchChannel`].
pub fn late_samples(record: &Record, offsets: &BTreeMap<String, Offset>) -> Result<f64, AnalysisError> {
    let names: Vec<&str> = record.channels().map(|c| c.name.as_str()).collect();
    let mut late = 0.0;
    for (name, offset) in offsets {
        let role = match name.as_str() {
            "e" => Some(0),
            "u" => Some(1),
            _ => None,
        };
        let Some(channel) = names.iter().position(|known| known == name).or(role) else {
            return Err(AnalysisError::NoSuchChannel {
                name: name.clone(),
                known: names.join(", "),
            });
        };
        let samples = match offset {
            Offset::Samples(samples) => *samples,
            Offset::Seconds(seconds) => seconds / record.sample_time().s(),
        };
        match channel {
            0 => late -= samples,
            1 => late += samples,
            _ => {}
        }
    }
    Ok(late)
}
