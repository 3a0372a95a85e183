//! A record into CSV.

use std::fmt::Write as _;
use std::io::{self, Write};

use hoid_model::{Channel, Record};

/// The channels in the order that a person reads in: the target first, then what the operator sees and does.
pub(crate) fn channels(record: &Record) -> Vec<&Channel> {
    let (target, others): (Vec<&Channel>, Vec<&Channel>) = record.channels().partition(|c| c.name == "f_t");
    target.into_iter().chain(others).collect()
}

/// What stands beside the columns: units and sample time.
pub(crate) fn comments(record: &Record, channels: &[&Channel]) -> Vec<String> {
    let mut comments = Vec::new();
    if channels.iter().any(|c| !c.unit.is_empty()) {
        // A comma or a line break has no place in this line: such a unit is left out.
        let fits = |text: &str| !text.is_empty() && !text.contains([',', '\n', '\r']);
        let with_unit = channels.iter().filter(|c| fits(&c.name) && fits(&c.unit));
        let units: String = with_unit.map(|c| format!(", {} {}", c.name, c.unit)).collect();
        comments.push(format!("units: t s{units}"));
    }
    comments.push(format!("sample_time: {} s", record.sample_time().s()));
    comments
}

/// Writes the record with the digits that give the same numbers back.
pub(crate) fn write(file: &mut dyn Write, record: &Record, separator: u8) -> io::Result<()> {
    let channels = channels(record);
    for comment in comments(record, &channels) {
        writeln!(file, "# {comment}")?;
    }
    let mut csv = csv::WriterBuilder::new().delimiter(separator).from_writer(file);
    csv.write_field("t")?;
    for channel in &channels {
        csv.write_field(&channel.name)?;
    }
    csv.write_record(None::<&[u8]>)?;
    let mut text = String::new();
    for k in 0..record.len() {
        let row = channels.iter().map(|c| c.values[k]);
        for value in std::iter::once(record.time_s(k)).chain(row) {
            text.clear();
            shortest(&mut text, value);
            csv.write_field(&text)?;
        }
        csv.write_record(None::<&[u8]>)?;
    }
    csv.flush()
}

/// The fewest digits that give the same number back, with an exponent where that is shorter to read.
fn shortest(text: &mut String, value: f64) {
    let size = value.abs();
    let written = if size == 0.0 || (1e-5..1e16).contains(&size) {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    };
    // Writing into a String does not fail.
    debug_assert!(written.is_ok());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_bit_for_bit() {
        for value in [
            0.0,
            -0.0,
            0.1,
            -1.0 / 3.0,
            1e-5,
            9.9e-6,
            1e16,
            5e-324,
            f64::MAX,
            f64::MIN_POSITIVE,
            1e15 + 0.5,
        ] {
            let mut text = String::new();
            shortest(&mut text, value);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
            assert!(text.len() < 25, "{text}");
        }
    }
}
