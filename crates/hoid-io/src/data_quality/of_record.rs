//! What is wrong with the values of a record that was not read from a file here.

use hoid_model::Record;

use super::{
    issue::QualityIssue,
    search::issues_of,
    signals::{Signal, Signals},
};

/// What is wrong with the values of e and u: saturation, quantisation, constants. Of its time nothing is known
/// but that it is even.
pub fn quality_of_record(record: &Record) -> Vec<QualityIssue> {
    let channels = record.input_channel().into_iter().chain([record.output_channel()]);
    let columns = channels
        .map(|channel| Signal {
            name: &channel.name,
            values: &channel.values,
        })
        .collect();
    issues_of(&Signals {
        columns,
        nominal_hz: Some(1.0 / record.sample_time().s()),
        ..Signals::default()
    })
}
