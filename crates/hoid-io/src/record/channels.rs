//! The channels of a record as columns of a file, the same for all formats.

use hoid_model::{Channel, Record};

/// The channels in the order for readers: the target first, then the input and the output of the
/// operator.
pub(crate) fn channels(record: &Record) -> Vec<&Channel> {
    let (target, others): (Vec<&Channel>, Vec<&Channel>) = record.channels().partition(|c| c.name == "f_t");
    target.into_iter().chain(others).collect()
}

/// Comments of a file: units and sample time.
pub(crate) fn comments(record: &Record, channels: &[&Channel]) -> Vec<String> {
    let mut comments = Vec::new();
    if channels.iter().any(|c| !c.unit.is_empty()) {
        // This line cannot hold a comma or a line break: such a unit is omitted.
        let fits = |text: &str| !text.is_empty() && !text.contains([',', '\n', '\r']);
        let with_unit = channels.iter().filter(|c| fits(&c.name) && fits(&c.unit));
        let units: String = with_unit.map(|c| format!(", {} {}", c.name, c.unit)).collect();
        comments.push(format!("units: t s{units}"));
    }
    comments.push(format!("sample_time: {} s", record.sample_time().s()));
    comments
}
