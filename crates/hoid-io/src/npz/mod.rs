//! NPZ, the archive of arrays of numpy, and NPY, one array of it.
//!
//! | module | what it holds |
//! |---|---|
//! | `header` | what numpy writes in front of the numbers, a Python literal |
//! | `npy` | [`array`]: one array, in and out |
//! | `archive` | [`read`], [`write`]: the zip around them |

mod archive;
mod header;
mod npy;

pub(crate) use archive::{read, write};

use crate::IoError;
use crate::arrays::{Contents, Lines};

/// The one array in an NPY file; it is named as `numpy.savez` names an array without a name. The fields of a structured array
/// are columns of their own.
pub(crate) fn read_single(bytes: Vec<u8>, file: &str) -> Result<Contents, IoError> {
    let entries = npy::entries(bytes, "arr_0", true).map_err(|error| match error {
        npy::NpyError::NoMagic(found) => IoError::WrongFormat {
            file: file.to_owned(),
            format: "NPY",
            found,
            expected: "\\x93NUMPY at its beginning",
        },
        npy::NpyError::Damaged(found) => IoError::Damaged {
            file: file.to_owned(),
            found,
        },
    })?;
    Ok(Contents::new(entries, Lines::Python))
}
