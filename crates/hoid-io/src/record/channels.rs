//! The channels of a record as columns of a file, in the same order in all formats.

use hoid_model::{Channel, Record};

/// Returns the channels in the order in which people read them: target, then input and output of the operator.
pub(crate) fn channels(record: &Record) -> Vec<&Channel> {
    let (target, others): (Vec<&Channel>, Vec<&Channel>) = record.channels().partition(|c| c.name == "f_t");
    target.into_iter().chain(others).collect()
}

/// Returns the comments of a file: units and sample time.
pub(crate) fn comments(record: &Record, channels: &[&Channel]) -> Vec<String> {
    let mut comments = Vec::new();
    if channels.iter().any(|c| !c.unit.is_empty()) {
        // A unit with a comma or a line break does not fit into this line and is omitted.
        let fits = |text: &str| !text.is_empty() && !text.contains([',', '\n', '\r']);
        let with_unit = channels.iter().filter(|c| fits(&c.name) && fits(&c.unit));
        let units: String = with_unit.map(|c| format!(", {} {}", c.name, c.unit)).collect();
        comments.push(format!("units: t s{units}"));
    }
    comments.push(format!("sample_time: {} s", record.sample_time().s()));
    comments
}
