//! Recordings of the Brain Imaging Data Structure: a table without a header, whose column names and sampling rate are
//! in a JSON file (BIDS specification, *Physiological recordings* and *Motion*).
//!
//! By the inheritance principle of the specification, a JSON file with fewer entities, such as
//! `task-track_physio.json`, in the same directory or in a parent directory, also describes
//! `sub-01_task-track_run-2_physio.tsv`. Motion recordings have their column names in a table `..._channels.tsv` next
//! to them.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::table::Cell;

/// Number of directories searched: the directory of the recording and, above it, the directories of the session, the
/// person and the data set.
const SEARCHED_DIRECTORY_COUNT: usize = 4;

/// Content of the JSON file of a recording.
#[derive(Deserialize)]
struct Sidecar {
    #[serde(rename = "SamplingFrequency")]
    sampling_hz: f64,
    #[serde(rename = "StartTime", default)]
    start_s: f64,
    #[serde(rename = "Columns", default)]
    columns: Vec<String>,
    /// Descriptions of the columns, and other properties.
    #[serde(flatten)]
    others: HashMap<String, serde_json::Value>,
}

impl Sidecar {
    fn read(path: &Path) -> Option<Self> {
        serde_json::from_slice(&fs::read(path).ok()?).ok()
    }

    /// Returns the unit of a column; `None` if the file states none.
    fn unit(&self, column: &str) -> Option<&str> {
        self.others.get(column)?.get("Units")?.as_str()
    }
}

/// Returns the name of a file without its extension.
fn stem(path: &Path) -> Option<String> {
    Some(path.file_stem()?.to_str()?.to_owned())
}

/// Finds the JSON file of a recording; `None` if there is none.
fn sidecar(path: &Path) -> Option<Sidecar> {
    if let Some(own) = Sidecar::read(&path.with_extension("json")) {
        return Some(own);
    }
    let stem = stem(path)?;
    let (entities, suffix) = stem.rsplit_once('_').filter(|_| stem.starts_with("sub-"))?;
    let entities: Vec<&str> = entities.split('_').collect();
    let absolute = std::path::absolute(path).ok()?;
    // The nearest directory takes precedence, and in it the name with the most entities.
    absolute
        .ancestors()
        .skip(1)
        .take(SEARCHED_DIRECTORY_COUNT)
        .find_map(|directory| {
            let mut found: Vec<(usize, PathBuf)> = Vec::new();
            for entry in fs::read_dir(directory).ok()?.flatten() {
                let path = entry.path();
                let name = entry.file_name();
                let Some(name) = name.to_str().and_then(|name| name.strip_suffix(".json")) else {
                    continue;
                };
                let (own, own_suffix) = name.rsplit_once('_').unwrap_or(("", name));
                let own: Vec<&str> = own.split('_').filter(|entity| !entity.is_empty()).collect();
                if own_suffix == suffix && own.iter().all(|entity| entities.contains(entity)) {
                    found.push((own.len(), path));
                }
            }
            found.sort_unstable_by(|a, b| b.cmp(a));
            found.iter().find_map(|(_, path)| Sidecar::read(path))
        })
}

/// Returns the names and the units of the columns from the table of channels of a motion recording; empty if there is
/// none.
fn channels(path: &Path) -> Vec<(String, String)> {
    let read = || {
        let stem = stem(path)?;
        let (entities, _) = stem.rsplit_once('_')?;
        let text = fs::read_to_string(path.with_file_name(format!("{entities}_channels.tsv"))).ok()?;
        let mut lines = text.lines();
        let header: Vec<&str> = lines.next()?.split('\t').collect();
        let index = |name: &str| header.iter().position(|column| *column == name);
        let (name, units) = (index("name")?, index("units"));
        let channel = |line: &str| {
            let cells: Vec<&str> = line.split('\t').collect();
            let unit = units.and_then(|at| cells.get(at)).filter(|unit| **unit != "n/a");
            Some((
                (*cells.get(name)?).to_owned(),
                unit.map_or_else(String::new, |unit| (*unit).to_owned()),
            ))
        };
        let filled = lines.filter(|line| !line.trim().is_empty());
        filled.map(channel).collect::<Option<Vec<_>>>()
    };
    read().unwrap_or_default()
}

/// Adds a header, and a column t if there is none, to a table without a header that has a JSON file.
pub(super) fn with_header(bytes: Vec<u8>, path: &Path) -> Vec<u8> {
    let Ok(text) = std::str::from_utf8(&bytes) else {
        return bytes;
    };
    let is_number = |cell: &str| Cell::parse(cell) != Cell::Text;
    // A table with a header needs no other file.
    if !text.lines().next().is_some_and(|line| line.split('\t').all(is_number)) {
        return bytes;
    }
    let Some(sidecar) = sidecar(path) else {
        return bytes;
    };
    let columns: Vec<(String, String)> = if sidecar.columns.is_empty() {
        channels(path)
    } else {
        let unit = |name: &String| sidecar.unit(name).unwrap_or_default().to_owned();
        sidecar.columns.iter().map(|name| (name.clone(), unit(name))).collect()
    };
    let is_row = |line: &str| line.split('\t').count() == columns.len();
    let known = sidecar.sampling_hz > 0.0 && sidecar.sampling_hz.is_finite() && sidecar.start_s.is_finite();
    if !known || !text.lines().next().is_some_and(is_row) {
        return bytes;
    }
    let named_t = columns.iter().any(|(name, _)| name == "t");
    // Commas separate the units in the comment.
    let is_unit = |text: &str| !text.is_empty() && !text.contains([',', '\n', '\r']);
    let with_units = columns.iter().filter(|(name, unit)| is_unit(name) && is_unit(unit));
    let units: Vec<String> = with_units.map(|(name, unit)| format!("{name} {unit}")).collect();
    let mut table = format!("# sample_time: {} s\n", 1.0 / sidecar.sampling_hz);
    if !units.is_empty() {
        table += &format!("# units: {}\n", units.join(", "));
    }
    if !named_t {
        table += "t\t";
    }
    let names: Vec<&str> = columns.iter().map(|(name, _)| name.as_str()).collect();
    table += &names.join("\t");
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
