//! Writing of records as CSV.

use std::fmt::Write as _;
use std::io::{self, Write};

use hoid_model::Record;

use super::text::escape_formula;
use crate::record::{comments, ordered_channels};

/// Writes the record, separated by commas.
pub(crate) fn write_with_commas(file: &mut dyn Write, record: &Record) -> io::Result<()> {
    write(file, record, b',')
}

/// Writes the record, separated by tabs.
pub(super) fn write_with_tabs(file: &mut dyn Write, record: &Record) -> io::Result<()> {
    write(file, record, b'\t')
}

/// Writes the record with enough digits to reproduce the numbers exactly.
fn write(file: &mut dyn Write, record: &Record, separator: u8) -> io::Result<()> {
    let channels = ordered_channels(record);
    for comment in comments(record, &channels) {
        writeln!(file, "# {comment}")?;
    }
    let mut csv = csv::WriterBuilder::new().delimiter(separator).from_writer(file);
    csv.write_field("t")?;
    for channel in &channels {
        csv.write_field(escape_formula(&channel.name).as_bytes())?;
    }
    csv.write_record(None::<&[u8]>)?;
    let mut text = String::new();
    let mut columns: Vec<_> = channels.iter().map(|channel| channel.values.iter().copied()).collect();
    for k in 0..record.len() {
        let row = columns.iter_mut().filter_map(Iterator::next);
        for value in std::iter::once(record.time_s(k)).chain(row) {
            text.clear();
            write_shortest(&mut text, value);
            csv.write_field(&text)?;
        }
        csv.write_record(None::<&[u8]>)?;
    }
    csv.flush()
}

/// Writes the fewest digits that reproduce the number exactly, with an exponent if that is shorter.
fn write_shortest(text: &mut String, value: f64) {
    let size = value.abs();
    let written = if size == 0.0 || (1e-5..1e16).contains(&size) {
        write!(text, "{value}")
    } else {
        write!(text, "{value:e}")
    };
    // Writing to a String cannot fail.
    debug_assert!(written.is_ok());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_round_trip_bit_for_bit() {
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
            write_shortest(&mut text, value);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
            assert!(text.len() < 25, "{text}");
        }
    }
}
