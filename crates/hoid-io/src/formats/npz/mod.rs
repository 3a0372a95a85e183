//! NPZ, the archive format of numpy for several arrays, and NPY, its format for a single array.
//!
//! | module | contents |
//! |---|---|
//! | `header` | the header before the data of an array, a Python literal |
//! | `npy` | reading and writing of one array |
//! | `archive` | NPZ: the zip archive that contains the arrays |
//! | `npy_format` | NPY: a file that contains one array |

mod archive;
mod header;
mod npy;
mod npy_format;

use crate::formats::format::{Format, FormatReader, FormatWriter};

pub(super) const NPZ: Format = Format {
    name: "NPZ",
    extensions: &["npz"],
    reading: FormatReader::Arrays(|bytes, file| archive::read(&bytes, file)),
    writing: FormatWriter::Columns(archive::write),
    record: None,
};

pub(super) const NPY: Format = Format {
    name: "NPY",
    extensions: &["npy"],
    reading: FormatReader::Arrays(npy_format::read),
    writing: FormatWriter::ReadOnly("hoid only reads this format, which holds one unnamed array"),
    record: None,
};
