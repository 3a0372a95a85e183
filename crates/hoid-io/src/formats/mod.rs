//! The file formats, one module each, and what they share.
//!
//! To add a format: a module with a [`Format`], its `mod` line here and its line in [`ALL`].
//!
//! | module | contents |
//! |---|---|
//! | `format` | [`Format`]: the self-description of a format, and all that the rest of the crate knows of it |
//! | `lookup` | the format of a file by its extension; what to do about the formats of others |
//! | `csv` | text with commas, semicolons or tabs |
//! | `parquet` | Apache Parquet |
//! | `npz` | NPZ and NPY of numpy |
//! | `mat` | variables of MATLAB, HDF5 |
//! | `xdf` | streams of the Lab Streaming Layer |
//! | `packed` | text packed by gzip, and tables of BIDS |
//! | `arrays` | files of named arrays: paths, and the columns among them |
//! | `budget` | how much memory a file may take |
//! | `guarded` | panics of foreign readers as errors |

// Numbers of a file are never an index, a length or a summand before they are checked.
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
pub(crate) mod arrays;
mod budget;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod csv;
mod format;
mod guarded;
mod lookup;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod mat;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod npz;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod packed;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod parquet;
#[cfg_attr(not(test), warn(clippy::indexing_slicing, clippy::arithmetic_side_effects))]
mod xdf;

pub(crate) use budget::Settings;
pub(crate) use csv::write_record as write_record_as_csv;
pub(crate) use format::{ColumnsWriter, Format, Reading, RowWriter, Writing};
pub(crate) use lookup::{bytes_of, format_to_write, long_text, table_of_file};
pub use lookup::{readable_endings, writable_endings};

/// All formats, in the order in which messages name them. No two share an extension.
const ALL: &[&Format] = &[
    &csv::CSV,
    &csv::TSV,
    &parquet::PARQUET,
    &npz::NPZ,
    &npz::NPY,
    &mat::MAT,
    &mat::HDF5,
    &xdf::XDF,
];
