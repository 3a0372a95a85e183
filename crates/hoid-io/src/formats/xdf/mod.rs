//! XDF, the recordings of the Lab Streaming Layer: streams with their own clocks.
//!
//! | module | contents |
//! |---|---|
//! | `chunks` | the samples and clock offsets of each stream |
//! | `header` | name, channels and rate of a stream, from its XML |
//! | `clock` | the time stamps on one clock, without jitter, as pyxdf does it |
//! | `streams` | paths and arrays |
//!
//! A channel has the path `stream.label`, and the time stamps of its stream are `stream.t`, in
//! seconds from the first sample of the file.

mod chunks;
// A regression over times of a length that it has checked.
#[allow(clippy::indexing_slicing, clippy::arithmetic_side_effects)]
mod clock;
mod header;
mod streams;

use crate::formats::format::{Format, Reading, Writing};

pub(super) const XDF: Format = Format {
    name: "XDF",
    endings: &["xdf"],
    reading: Reading::Arrays(|bytes, file| streams::read(&bytes, file)),
    writing: Writing::ReadOnly("the format of a recorder"),
    record: None,
};
