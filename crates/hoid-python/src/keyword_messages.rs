//! Conversion of command-line options in messages of the libraries to Python keywords.
//!
//! `--new-fs 50` becomes `new_sampling_frequency=50`, `--fill` becomes `fill=True`, and `--trial t=1` becomes
//! `trial="t=1"`. A word after an option is its value if it is a placeholder (`HZ`), a number, an assignment, or one of
//! [`VALUE_WORDS`]; any other word continues the sentence.

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
/// Words that are recognised as values of options.
const VALUE_WORDS: [&str; 17] = [
    "t",
    "yes",
    "no",
    "cut",
    "keep",
    "gap",
    "stalled",
    "saturated",
    "missing",
    "mean",
    "linear",
    "sigmoid",
    "lead",
    "physical",
    "operator",
    "bj",
    "population",
];

/// Returns the message with keywords in place of options.
#[pyfunction]
pub fn in_python(message: &str) -> String {
    let mut text = String::with_capacity(message.len());
    let mut rest = message;
    while let Some(at) = rest.find("--") {
        text.push_str(&rest[..at]);
        rest = &rest[at + 2..];
        let end = rest
            .find(|c: char| !(c.is_ascii_lowercase() || c == '-'))
            .unwrap_or(rest.len());
        let option = &rest[..end];
        rest = &rest[end..];
        if option.is_empty() {
            text.push_str("--");
            continue;
        }
        let renamed = KEYWORD_NAMES.iter().find(|(typed, _)| *typed == option);
        let keyword = renamed.map_or_else(|| option.replace('-', "_"), |(_, keyword)| (*keyword).to_owned());
        text.push_str(&keyword);
        if FLAG_OPTIONS.contains(&option) {
            text.push_str("=True");
        } else if let Some((value, behind)) = split_value(rest) {
            text.push('=');
            text.push_str(&python_argument(option, value));
            rest = behind;
        }
    }
    text.push_str(rest);
    text
}

/// Splits the text after an option into its value and the remaining text; `None` if the option has no value.
fn split_value(rest: &str) -> Option<(&str, &str)> {
    let word = rest.strip_prefix(' ')?;
    let end = word.find([' ', ';', ')']).unwrap_or(word.len());
    let word_end = word[..end].trim_end_matches([',', ':', '.']).len();
    let (value, behind) = word.split_at(word_end);
    let placeholder = !value.is_empty() && value.chars().all(|c| c.is_ascii_uppercase());
    let is_value = placeholder || value.contains('=') || value.parse::<f64>().is_ok() || VALUE_WORDS.contains(&value);
    is_value.then_some((value, behind))
}

fn python_argument(option: &str, value: &str) -> String {
    let quoted = |text: &str| match text.parse::<f64>() {
        Ok(_) => text.to_owned(),
        Err(_) => format!("\"{text}\""),
    };
    if value.chars().all(|c| c.is_ascii_uppercase()) {
        return value.to_owned();
    }
    if !DICTIONARY_OPTIONS.contains(&option) {
        return quoted(value);
    }
    let pairs = value.split(',').filter_map(|pair| pair.split_once('='));
    let pairs: Vec<String> = pairs
        .map(|(name, value)| format!("\"{name}\": {}", quoted(value)))
        .collect();
    format!("{{{}}}", pairs.join(", "))
}
