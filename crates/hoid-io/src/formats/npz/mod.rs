//! NPZ, numpy's archive of arrays, and NPY, a single array of it.
//!
//! | module | contents |
//! |---|---|
//! | `header` | header that numpy writes before the numbers, a Python literal |
//! | `npy` | one array, in and out |
//! | `archive` | NPZ: the zip around them |
//! | `single` | NPY: one array in a file of its own |

mod archive;
mod header;
mod npy;
mod single;

use crate::formats::format::{Format, Reading, Writing};

pub(super) const NPZ: Format = Format {
    name: "NPZ",
    endings: &["npz"],
    reading: Reading::Arrays(|bytes, file| archive::read(&bytes, file)),
    writing: Writing::Columns(archive::write),
    record: None,
};

pub(super) const NPY: Format = Format {
    name: "NPY",
    endings: &["npy"],
    reading: Reading::Arrays(single::read),
    writing: Writing::ReadOnly("a single array without names"),
    record: None,
};
