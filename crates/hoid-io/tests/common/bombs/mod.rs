//! Files of a few bytes to two megabytes that unpack, or state that they unpack, to any size, and the required result
//! of all readers: values or an error message, in bounded memory.
//!
//! Bomb `k` of a format has the same bytes on every machine.
//!
//! | file | contents |
//! |---|---|
//! | `zeros` | compressed zeros of any length, generated quickly |
//! | `parquet`, `npz`, `mat`, `hdf5`, `xdf`, `texts` | the bombs of a format |

pub mod hdf5;
pub mod mat;
pub mod npz;
pub mod parquet;
pub mod texts;
pub mod xdf;
pub mod zeros;

use std::{fs, path::Path, time::Duration};

use hoid_io::{read_any_scenario, read_fit};

use crate::{
    memory,
    mutations::{
        draw::Draw,
        readers::{self, ReadCounts},
        spent::ProcessorTime,
    },
};

/// Makes a bomb.
type BombMaker = fn(&mut Draw) -> Vec<u8>;

/// The formats, with the extensions that determine their readers.
pub const FORMATS: [(&str, &str, BombMaker); 7] = [
    ("Parquet", "parquet", parquet::bomb),
    ("NPZ", "npz", npz::bomb),
    ("MAT", "mat", mat::bomb),
    ("HDF5", "mat", hdf5::bomb),
    ("XDF", "xdf", xdf::bomb),
    ("TOML", "toml", texts::toml),
    ("JSON", "json", texts::json),
];

/// Makes bomb `number` of a format at a path and gives it to all its readers; returns the time taken.
pub fn run_bomb(path: &Path, maker: BombMaker, number: u64) -> (ReadCounts, Duration) {
    let bytes = maker(&mut Draw::new(54, number));
    fs::write(path, &bytes).unwrap();
    let length = bytes.len();
    drop(bytes);
    memory::reset_peak();
    let start = ProcessorTime::now();
    let settings = |refused: bool| ReadCounts {
        read: u64::from(!refused),
        refused: u64::from(refused),
    };
    let answers = match path.extension().and_then(|ending| ending.to_str()) {
        Some("toml") => settings(read_any_scenario(path).is_err()),
        Some("json") => settings(read_fit(path).is_err()),
        _ => readers::read_with_all(path, length, number),
    };
    (answers, start.elapsed())
}
