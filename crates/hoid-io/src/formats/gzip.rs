//! Text compressed by gzip.

use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;

use super::budget::Budget;
use crate::IoError;

/// Number of bytes decompressed at a time.
const PART_BYTES: usize = 1 << 16;

/// Returns the path without `.gz`; `None` if the file has another extension.
pub(crate) fn path_without_gz(path: &Path) -> Option<PathBuf> {
    let packed = path.extension()?.eq_ignore_ascii_case("gz");
    packed.then(|| path.with_extension(""))
}

/// Decompresses gzip data.
pub(super) fn decompress(bytes: &[u8], file: &str) -> Result<Vec<u8>, IoError> {
    let mut budget = Budget::of(bytes.len());
    let mut reader = MultiGzDecoder::new(bytes);
    let mut text = Vec::new();
    let mut part = vec![0; PART_BYTES];
    loop {
        let read = reader.read(&mut part).map_err(|error| IoError::Damaged {
            file: file.to_owned(),
            found: format!("it is not a complete gzip file: {error}"),
        })?;
        if read == 0 {
            return Ok(text);
        }
        budget.take(read as u64, file)?;
        text.extend(part.iter().take(read));
    }
}
