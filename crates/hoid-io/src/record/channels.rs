//! The channels of a record as columns of a file, in the same order in all formats.

use hoid_model::{Channel, Record};

/// Returns the channels in the order in which people read them: target, input and output of the operator, other
/// channels.
pub(crate) fn ordered_channels(record: &Record) -> Vec<&Channel> {
    let (target, others): (Vec<&Channel>, Vec<&Channel>) = record.channels().partition(|c| c.name == "f_t");
    target.into_iter().chain(others).collect()
}

/// Returns the comments that are written above a record: units, roles and sample time.
pub(crate) fn comments(record: &Record, channels: &[&Channel]) -> Vec<String> {
    // An entry of a comment cannot contain a comma or a line break: names, units and roles that contain one are
    // omitted.
    let fits = |text: &str| !text.is_empty() && !text.contains([',', '\n', '\r']);
    let list = |words: fn(&Channel) -> &str| {
        let with_words = channels.iter().filter(move |c| fits(&c.name) && fits(words(c)));
        with_words.map(move |c| format!("{} {}", c.name, words(c)))
    };
    let mut comments = Vec::new();
    if channels.iter().any(|c| !c.unit.is_empty()) {
        let units: Vec<String> = std::iter::once("t s".to_owned()).chain(list(|c| &c.unit)).collect();
        comments.push(format!("units: {}", units.join(", ")));
    }
    let roles: Vec<String> = list(|c| &c.role).collect();
    if !roles.is_empty() {
        comments.push(format!("roles: {}", roles.join(", ")));
    }
    comments.push(format!("sample_time: {} s", record.sample_time().s()));
    comments
}
