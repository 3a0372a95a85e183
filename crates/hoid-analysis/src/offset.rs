//! Treatment of channels that were recorded late, for periodic signals: the offset is a phase shift, and cutting rows
//! would leave incomplete periods.

use std::collections::BTreeMap;

use hoid_io::{NewRate, Offset};
use hoid_model::Record;

use crate::{AnalysisError, reading::Reading};

/// Returns the reading options without offsets, and the offsets. If another sampling frequency is requested, the
/// offsets remain in the reading options, because resampling follows the alignment.
pub fn without_offsets(reading: &Reading) -> (Reading, BTreeMap<String, Offset>) {
    let mut reading = reading.clone();
    let offsets = match reading.preparation.rate {
        NewRate::Hz(_) => BTreeMap::new(),
        _ => std::mem::take(&mut reading.preparation.offset),
    };
    (reading, offsets)
}

/// Returns the number of samples by which the output was recorded later than the input. The offset of any other channel
/// changes only the phase of that channel, which does not affect the averages.
///
/// # Errors
/// [`AnalysisError::NoSuchChannel`].
pub fn output_delay_samples(record: &Record, offsets: &BTreeMap<String, Offset>) -> Result<f64, AnalysisError> {
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
                available: names.join(", "),
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
