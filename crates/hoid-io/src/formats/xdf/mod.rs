//! XDF, the format of recordings of the Lab Streaming Layer: streams with their own clocks.
//!
//! | module | contents |
//! |---|---|
//! | `chunks` | the samples and clock offsets of each stream |
//! | `header` | name, channels and rate of a stream, in XML |
//! | `clock` | conversion of the time stamps to one clock, and removal of jitter, as in pyxdf |
//! | `streams` | the streams as paths and arrays |
//!
//! A channel has the path `stream.label`; the time stamps of its stream have the path `stream.t` and are in seconds
//! from the first sample of the file.

mod chunks;
mod clock;
mod header;
mod streams;

use crate::formats::format::{Format, FormatReader, FormatWriter};

pub(super) const XDF: Format = Format {
    name: "XDF",
    extensions: &["xdf"],
    reading: FormatReader::Arrays(|bytes, file| streams::read(&bytes, file)),
    writing: FormatWriter::ReadOnly("hoid only reads this format"),
    record: None,
};
