//! MAT-files of MATLAB.
//!
//! | module | contents |
//! |---|---|
//! | `read` | the variables of a file of any version |
//! | `elements` | tags and data of version 5, damaged or not |
//! | `version5` | versions 5 to 7: arrays, structures, cells, texts |
//! | `version4` | version 4: matrices |
//! | `version73` | version 7.3, which is HDF5; any HDF5 |
//! | `records` | tables of records in HDF5 |
//! | `objects` | instructions to convert a timetable, a table or a timeseries |
//! | `names` | names of columns and names of variables |
//! | `write` | version 7, one variable a column |
//!
//! Structures and cells become paths: `data.run(3).e`, `c{2}`; the index of an array of structures
//! is column-major, as MATLAB's linear index.

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
use crate::formats::format::{Format, Reading, Writing};

pub(super) const MAT: Format = Format {
    name: "MATLAB",
    endings: &["mat"],
    reading: Reading::Arrays(read::read),
    writing: Writing::Columns(write::write),
    record: None,
};

/// HDF5 of other programs: datasets in groups, with dimensions in the order of numpy.
pub(super) const HDF5: Format = Format {
    name: "HDF5",
    endings: &["h5", "hdf5"],
    reading: Reading::Arrays(|bytes, file| {
        version73::read(bytes, file, Indexing::Python).map(|entries| Contents::new(entries, Indexing::Python))
    }),
    writing: Writing::ReadOnly("read alone; .npz and .mat hold the same arrays"),
    record: None,
};
