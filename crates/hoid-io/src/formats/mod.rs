//! The file formats, one module each.
//!
//! To add one: a module with a [`Format`], here its `mod` line and its line in [`ALL`].
//!
//! | module | what it holds |
//! |---|---|
//! | `csv` | text with commas, semicolons or tabs |
//! | `parquet` | Apache Parquet |
//! | `npz` | NPZ and NPY of numpy |
//! | `mat` | variables of MATLAB, HDF5 |
//! | `xdf` | streams of the Lab Streaming Layer |
//! | `packed` | text packed by gzip, and tables of BIDS |
//! | `lookup` | the format of a file by its extension |

mod csv;
mod lookup;
mod mat;
mod npz;
mod packed;
mod parquet;
mod xdf;

pub(crate) use csv::write_record as write_record_as_csv;
pub(crate) use lookup::{bytes_of, format_to_write};
pub use lookup::{readable_endings, writable_endings};

use crate::format::Format;

/// All formats, in the order in which messages name them. No two have an ending in common.
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
