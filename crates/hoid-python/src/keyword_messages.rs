//! Conversion of command-line options in messages of the libraries to Python keywords.
//!
//! `--new-fs 50` becomes `new_sampling_frequency=50`, `--fill` becomes `fill=True`, and `--trial t=1` becomes
//! `trial="t=1"`.

use hoid_model::option_names::{NamedOption, Renamed, literal, literal_entries, rename_options};
use pyo3::pyfunction;

/// Options whose keyword has a different name.
const KEYWORD_NAMES: [(&str, &str); 6] = [
    ("fs", "sampling_frequency"),
    ("new-fs", "new_sampling_frequency"),
    ("from", "start"),
    ("to", "stop"),
    ("for", "answers"),
    ("orders", "na, nb, nc, nd, nf"),
];
/// Options without a value.
const FLAG_OPTIONS: [&str; 6] = ["drop-repeated", "fill", "resample", "resume", "robust", "stable"];
/// Options that take a dictionary in Python.
const DICTIONARY_OPTIONS: [&str; 6] = ["unit", "scale", "offset", "sparse", "fix", "bound"];

/// Returns the message with keywords in place of options.
#[pyfunction]
pub fn in_python(message: &str) -> String {
    rename_options(message, |NamedOption { name, value, .. }| {
        let renamed = KEYWORD_NAMES.iter().find(|(typed, _)| *typed == name);
        let keyword = renamed.map_or_else(|| name.replace('-', "_"), |(_, keyword)| (*keyword).to_owned());
        Some(match value {
            _ if FLAG_OPTIONS.contains(&name) => Renamed::Name(format!("{keyword}=True")),
            Some(value) => Renamed::WithValue(format!("{keyword}={}", python_argument(name, value))),
            None => Renamed::Name(keyword),
        })
    })
}

fn python_argument(option: &str, value: &str) -> String {
    if value.chars().all(|c| c.is_ascii_uppercase()) {
        return value.to_owned();
    }
    if !DICTIONARY_OPTIONS.contains(&option) {
        return literal(value);
    }
    format!(
        "{{{}}}",
        literal_entries(value, |name, value| format!("{name:?}: {value}"))
    )
}
