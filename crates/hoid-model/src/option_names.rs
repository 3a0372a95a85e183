//! Options of the command line in messages, replaced by what the user of another interface writes.
//!
//! The messages of the libraries name the options of `hoid identify`: `--fill`, `--fs HZ`, `--trial t=1`. Python has
//! keywords instead, and the manifest of a group has keys. [`rename_options`] finds each option with its value. A word
//! after an option is its value if it is a placeholder (`HZ`), a number, an assignment, the name of a form, or one of
//! `VALUE_WORDS`; after an option for a column, it is any word except `and` and `or`. Any other word continues the
//! sentence.

use crate::operator_family::Form;

/// Words that are recognised as values of options.
const VALUE_WORDS: [&str; 17] = [
    "t",
    "yes",
    "no",
    "none",
    "cut",
    "keep",
    "gap",
    "stalled",
    "saturated",
    "missing",
    "mean",
    "linear",
    "sigmoid",
    "physical",
    "operator",
    "bj",
    "population",
];
/// Options whose value is a column.
const COLUMN_OPTIONS: [&str; 2] = ["input", "excitation"];

/// An option in a message.
#[derive(Debug, Clone, Copy)]
pub struct NamedOption<'m> {
    /// Name without the hyphens at its start, such as `new-fs`.
    pub name: &'m str,
    /// Value, if the message states one.
    pub value: Option<&'m str>,
    /// Text of the message before the option.
    before: &'m str,
}

impl NamedOption<'_> {
    /// True if the option belongs to a command that the message quotes, such as `hoid identify --input r`.
    pub fn is_in_command(&self) -> bool {
        let clause = self.before.rsplit([';', '(', ':']).next().unwrap_or_default();
        clause.contains("hoid ")
    }
}

/// Text in place of an option.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Renamed {
    /// Text in place of the option and its value.
    WithValue(String),
    /// Text in place of the option; its value remains.
    Name(String),
}

/// Returns the message with each option replaced; `None` leaves the option as typed.
pub fn rename_options(message: &str, rename: impl Fn(NamedOption<'_>) -> Option<Renamed>) -> String {
    let mut text = String::with_capacity(message.len());
    let mut done = 0;
    while let Some(at) = message[done..].find("--").map(|at| done + at) {
        text.push_str(&message[done..at]);
        let rest = &message[at + 2..];
        let length = rest
            .find(|c: char| !(c.is_ascii_lowercase() || c == '-'))
            .unwrap_or(rest.len());
        let name = &rest[..length];
        let value = value_of(name, &rest[length..]);
        let option = NamedOption {
            name,
            value,
            before: &message[..at],
        };
        done = at + 2 + length;
        match rename(option).filter(|_| !name.is_empty()) {
            Some(Renamed::WithValue(renamed)) => {
                text.push_str(&renamed);
                done += value.map_or(0, |value| 1 + value.len());
            }
            Some(Renamed::Name(renamed)) => text.push_str(&renamed),
            None => text.push_str(&message[at..done]),
        }
    }
    text.push_str(&message[done..]);
    text
}

/// Returns the value of an option at the start of the text after it; `None` if the option has no value.
fn value_of<'m>(option: &str, rest: &'m str) -> Option<&'m str> {
    let word = rest.strip_prefix(' ')?;
    let end = word.find([' ', ';', ')']).unwrap_or(word.len());
    let value = word[..end].trim_end_matches([',', ':', '.']);
    let is_placeholder = !value.is_empty() && value.chars().all(|c| c.is_ascii_uppercase());
    let is_column = COLUMN_OPTIONS.contains(&option) && !["", "and", "or"].contains(&value);
    let is_value = is_placeholder
        || is_column
        || value.contains('=')
        || value.parse::<f64>().is_ok()
        || Form::ALL.iter().any(|form| form.name() == value)
        || VALUE_WORDS.contains(&value);
    is_value.then_some(value)
}

/// Returns a value as TOML and Python write it: a number as it is, anything else in quotation marks.
pub fn literal(value: &str) -> String {
    match value.parse::<f64>() {
        Ok(_) => value.to_owned(),
        Err(_) => format!("{value:?}"),
    }
}

/// Returns the assignments `NAME=VALUE,...` of a value as the entries of a table, separated by commas.
pub fn literal_entries(value: &str, entry: impl Fn(&str, String) -> String) -> String {
    let pairs = value.split(',').filter_map(|pair| pair.split_once('='));
    let entries: Vec<String> = pairs.map(|(name, value)| entry(name, literal(value))).collect();
    entries.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_found_with_their_values() {
        let rename = |option: NamedOption<'_>| match (option.is_in_command(), option.value) {
            (true, _) => None,
            (false, Some(value)) => Some(Renamed::WithValue(format!("<{}:{value}>", option.name))),
            (false, None) => Some(Renamed::Name(format!("<{}>", option.name))),
        };
        for (typed, expected) in [
            ("add --input f_t", "add <input:f_t>"),
            (
                "exchange them with --input and --output",
                "exchange them with <input> and <output>",
            ),
            ("choose --form lead-lag, or --fill", "choose <form:lead-lag>, or <fill>"),
            ("use --form NAME; --detrend mean.", "use <form:NAME>; <detrend:mean>."),
            (
                "use hoid identify --input e --input r; or --prior none",
                "use hoid identify --input e --input r; or <prior:none>",
            ),
            ("a -- dash, and --fs", "a -- dash, and <fs>"),
        ] {
            assert_eq!(rename_options(typed, rename), expected);
        }
    }

    #[test]
    fn assignments_become_entries() {
        let entries = literal_entries("e=0.5,u=rad:deg", |name, value| format!("{name} = {value}"));
        assert_eq!(entries, "e = 0.5, u = \"rad:deg\"");
    }
}
