//! The file formats, one module per format, and their common parts.
//!
//! To add a format, write a module with a [`Format`] and add its `mod` line and its entry in [`FORMATS`] here.
//!
//! | module | contents |
//! |---|---|
//! | `format` | [`Format`]: the interface through which the rest of the crate uses a format |
//! | `lookup` | choice of the format by file extension; remedies for unsupported formats |
//! | `csv` | text with commas, semicolons or tabs |
//! | `parquet` | Apache Parquet |
//! | `npz` | NPZ and NPY of numpy |
//! | `mat` | variables of MATLAB, HDF5 |
//! | `xdf` | streams of the Lab Streaming Layer |
//! | `gzip` | text compressed by gzip |
//! | `bids` | tables of BIDS without a header |
//! | `arrays` | files of named arrays: paths, and selection of columns |
//! | `budget` | limit of the memory that a file may take |
//! | `panic_isolation` | conversion of panics in third-party readers to errors |

pub(crate) mod arrays;
mod bids;
mod budget;
mod csv;
mod format;
mod gzip;
mod lookup;
mod mat;
mod npz;
mod panic_isolation;
mod parquet;
mod xdf;

pub(crate) use budget::SettingsFormat;
pub(crate) use csv::write_record as write_record_as_csv;
pub(crate) use format::{ColumnsWriter, Format, FormatReader, FormatWriter, RowWriter};
pub(crate) use gzip::path_without_gz;
pub(crate) use lookup::{format_to_write, read_long_text, read_with_format, table_of_file};
pub use lookup::{readable_extensions, writable_extensions};

/// All formats, in the order in which messages list them. No two formats share an extension.
const FORMATS: &[&Format] = &[
    &csv::CSV,
    &csv::TSV,
    &parquet::PARQUET,
    &npz::NPZ,
    &npz::NPY,
    &mat::MAT,
    &mat::HDF5,
    &xdf::XDF,
];
