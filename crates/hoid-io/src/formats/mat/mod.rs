//! Variables of MATLAB.
//!
//! | module | what it holds |
//! |---|---|
//! | `read` | the variables of a file of any version |
//! | `elements` | tags and data of version 5, damaged or not |
//! | `version5` | versions 5 to 7: arrays, structures, cells, texts |
//! | `version4` | version 4: matrices |
//! | `version73` | version 7.3, which is HDF5 |
//! | `names` | names of columns and names of variables |
//! | `write` | version 7, one variable a column |
//!
//! Structures and cells become paths: `data.run(3).e`, `c{2}`; the index of an array of structures
//! counts along its columns, as MATLAB's linear index does.

mod elements;
mod names;
mod read;
mod version4;
mod version5;
mod version73;
mod write;

use crate::format::{Format, Reading, Writing};

pub(super) const MAT: Format = Format {
    name: "MATLAB",
    endings: &["mat"],
    reading: Reading::Arrays(read::read),
    writing: Writing::Columns(write::write),
    record: None,
};
