//! The folder of recorded pilots, for the examples that read them.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use hoid::{io::ReadOptions, model::Record};

/// Start of the measurements (s); earlier data belong to the run-in.
pub const MEASUREMENT_START_S: f64 = 8.08;

/// Returns the folder given by `HOID_PILOT_DATA`; if the variable is not set, prints a message and returns `None`.
pub fn folder() -> Option<PathBuf> {
    let folder = env::var_os("HOID_PILOT_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("HOID_PILOT_DATA does not name the folder of the recorded pilots");
    }
    folder
}

/// Returns the names of the recordings of the given runs, such as `1,4` or `all`, in alphabetical order.
pub fn recording_names(folder: &Path, runs: &str) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|f| f.unwrap().file_name().to_string_lossy().into_owned())
        .filter_map(|n| n.strip_suffix(".parquet").map(str::to_owned))
        .filter(|n| runs == "all" || runs.split(',').any(|r| n.ends_with(&format!("_{r}"))))
        .collect();
    names.sort();
    names
}

/// Reads a recording; returns it with the index of its first sample from [`MEASUREMENT_START_S`] on.
pub fn read(folder: &Path, name: &str) -> (Record, usize) {
    let path = folder.join(format!("{name}.parquet"));
    let record = hoid::io::read_record(&path, &ReadOptions::default()).unwrap().record;
    let first = (0..record.len())
        .find(|k| record.time_s(*k) >= MEASUREMENT_START_S - 1e-6)
        .unwrap();
    (record, first)
}
