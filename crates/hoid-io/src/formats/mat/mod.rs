//! MAT-files of MATLAB, and HDF5 files.
//!
//! | module | contents |
//! |---|---|
//! | `read` | reading of the variables of a file of any version |
//! | `elements` | tags and data of version 5, with detection of damage |
//! | `version5` | versions 5 to 7: arrays, structures, cells, strings |
//! | `version4` | version 4: matrices |
//! | `version73` | version 7.3, which is HDF5, and other HDF5 files |
//! | `records` | tables of records in HDF5 |
//! | `objects` | instructions for converting a timetable, a table or a timeseries |
//! | `names` | conversion between column names and variable names |
//! | `write` | writing of version 7, one variable per column |
//!
//! Structures and cell arrays become paths such as `data.run(3).e` or `c{2}`; the index of an array of structures is
//! the column-major linear index of MATLAB.

mod elements;
mod names;
mod objects;
mod read;
mod records;
mod version4;
mod version5;
mod version73;
mod write;

use crate::formats::arrays::{Contents, Indexing};
use crate::formats::format::{Format, FormatReader, FormatWriter};

pub(super) const MAT: Format = Format {
    name: "MATLAB",
    extensions: &["mat"],
    reading: FormatReader::Arrays(read::read),
    writing: FormatWriter::Columns(write::write),
    record: None,
};

/// HDF5 files from other programs: datasets in groups, with dimensions in the order of numpy.
pub(super) const HDF5: Format = Format {
    name: "HDF5",
    extensions: &["h5", "hdf5"],
    reading: FormatReader::Arrays(|bytes, file| {
        version73::read(bytes, file, Indexing::Python).map(|entries| Contents::new(entries, Indexing::Python))
    }),
    writing: FormatWriter::ReadOnly("hoid only reads this format; .npz and .mat hold the same arrays"),
    record: None,
};
