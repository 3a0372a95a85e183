//! Text compressed by gzip, and recordings of the Brain Imaging Data Structure: a table without a header, whose column
//! names and sampling rate are in a JSON file next to it (BIDS specification, *Physiological recordings*).

use std::fmt::Write as _;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};

use flate2::read::MultiGzDecoder;
use serde::Deserialize;

use super::budget::Budget;
use crate::IoError;
use crate::table::Cell;

/// Number of bytes decompressed at a time.
const PART: usize = 1 << 16;

/// Returns the path without `.gz`; `None` if the file has another extension.
pub(super) fn inner(path: &Path) -> Option<PathBuf> {
    let packed = path.extension()?.eq_ignore_ascii_case("gz");
    packed.then(|| path.with_extension(""))
}

/// Decompresses gzip data.
pub(super) fn decompressed(bytes: &[u8], file: &str) -> Result<Vec<u8>, IoError> {
    let mut budget = Budget::of(bytes.len());
    let mut reader = MultiGzDecoder::new(bytes);
    let mut text = Vec::new();
    let mut part = vec![0; PART];
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

/// Content of the JSON file next to a table without a header.
#[derive(Deserialize)]
struct Sidecar {
    #[serde(rename = "SamplingFrequency")]
    sampling_hz: f64,
    #[serde(rename = "StartTime", default)]
    start_s: f64,
    #[serde(rename = "Columns")]
    columns: Vec<String>,
}

/// Adds a header, and a column t if there is none, to a table without a header that has a JSON file next to it.
pub(super) fn with_sidecar(bytes: Vec<u8>, path: &Path) -> Vec<u8> {
    let said = fs::read(path.with_extension("json")).ok();
    let Some(sidecar) = said.and_then(|json| serde_json::from_slice::<Sidecar>(&json).ok()) else {
        return bytes;
    };
    let Ok(text) = std::str::from_utf8(&bytes) else {
        return bytes;
    };
    let is_row = |line: &str| {
        let cells = || line.split('\t');
        cells().count() == sidecar.columns.len() && cells().all(|cell| Cell::parse(cell) != Cell::Text)
    };
    let known = sidecar.sampling_hz > 0.0 && sidecar.sampling_hz.is_finite() && sidecar.start_s.is_finite();
    if !known || !text.lines().next().is_some_and(is_row) {
        return bytes;
    }
    let named_t = sidecar.columns.iter().any(|name| name == "t");
    let mut table = format!("# sample_time: {} s\n", 1.0 / sidecar.sampling_hz);
    if !named_t {
        table += "t\t";
    }
    table += &sidecar.columns.join("\t");
    table.push('\n');
    for (row, line) in text.lines().enumerate() {
        if !named_t && !line.is_empty() {
            let t = sidecar.start_s + row as f64 / sidecar.sampling_hz;
            // Writing to a String cannot fail.
            let written = write!(table, "{t}\t");
            debug_assert!(written.is_ok());
        }
        table += line;
        table.push('\n');
    }
    table.into_bytes()
}
