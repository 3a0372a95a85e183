//! NPY: a file that contains one array.

use super::npy::{NpyError, entries};
use crate::IoError;
use crate::formats::arrays::{Contents, Indexing};
use crate::formats::budget::Budget;

/// Reads the array of an NPY file; the array gets the name that `numpy.savez` gives to an unnamed array. The fields of
/// a structured array become separate columns.
pub(super) fn read(bytes: Vec<u8>, file: &str) -> Result<Contents, IoError> {
    let mut budget = Budget::of(bytes.len());
    let entries = entries(bytes, "arr_0", true, (&mut budget, file)).map_err(|error| match error {
        NpyError::NoMagic(found) => IoError::WrongFormat {
            file: file.to_owned(),
            format: "NPY",
            found,
            expected: "\\x93NUMPY at the start",
        },
        NpyError::Damaged(found) => IoError::Damaged {
            file: file.to_owned(),
            found,
        },
        NpyError::Other(error) => error,
    })?;
    Ok(Contents::new(entries, Indexing::Python))
}
