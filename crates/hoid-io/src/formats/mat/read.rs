//! Reading of the variables of a file of any version; the first bytes determine the version.

use super::elements::HEADER_BYTES;
use super::names::restore_names;
use super::{version4, version5, version73};
use crate::IoError;
use crate::formats::arrays::{Contents, Indexing};
use crate::formats::budget::Budget;
use crate::wording::quote_start;

/// The first bytes of HDF5.
const HDF5_MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Reads the variables from the bytes of a file.
pub(super) fn read(bytes: Vec<u8>, file: &str) -> Result<Contents, IoError> {
    let wrong = |found: String| IoError::WrongFormat {
        file: file.to_owned(),
        format: "MATLAB",
        found,
        expected: "variables saved by MATLAB, Octave or scipy",
    };
    if bytes.is_empty() {
        return Err(wrong(String::from("it is empty")));
    }
    if bytes.starts_with(HDF5_MAGIC) || bytes.get(512..).is_some_and(|rest| rest.starts_with(HDF5_MAGIC)) {
        let entries = version73::read(bytes, file, Indexing::Matlab)?;
        return Ok(Contents::new(entries, Indexing::Matlab));
    }
    let bytes = bytes.as_slice();
    let mut budget = Budget::of(bytes.len());
    let entries = match bytes.get(HEADER_BYTES - 4..HEADER_BYTES) {
        Some([.., b'I', b'M']) => version5::read(bytes, false, &mut budget, file)?,
        Some([.., b'M', b'I']) => version5::read(bytes, true, &mut budget, file)?,
        // A file of version 4 starts with a number below 5000, files of later versions start with text.
        _ if bytes.iter().take(4).any(|byte| *byte == 0) => version4::read(bytes, &mut budget, file)?,
        _ if bytes.starts_with(b"# Created by Octave") || bytes.starts_with(b"# name:") => {
            return Err(IoError::WrongFormat {
                file: file.to_owned(),
                format: "MATLAB",
                found: String::from("it holds text of Octave"),
                expected: "variables saved with save -v7 run.mat t e u",
            });
        }
        _ => return Err(wrong(quote_start(bytes))),
    };
    Ok(Contents::new(restore_names(entries), Indexing::Matlab))
}
