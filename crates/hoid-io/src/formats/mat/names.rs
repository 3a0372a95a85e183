//! Conversion between column names and names of MATLAB variables.
//!
//! A name that is invalid in MATLAB, such as `K e` or `f-y`, is replaced by a similar valid name, and the original name
//! is stored in the variable [`NAMES_VARIABLE`].

use crate::formats::arrays::{COMMENTS_ARRAY, Entry, Value};

/// Variable that stores the original names; each line holds a variable name and its column name.
pub(super) const NAMES_VARIABLE: &str = "hoid_names";
/// Maximum length of a variable name; MATLAB truncates longer names.
const MAX_NAME_CHARS: usize = 63;
const KEYWORDS: [&str; 20] = [
    "break",
    "case",
    "catch",
    "classdef",
    "continue",
    "else",
    "elseif",
    "end",
    "for",
    "function",
    "global",
    "if",
    "otherwise",
    "parfor",
    "persistent",
    "return",
    "spmd",
    "switch",
    "try",
    "while",
];

/// Returns a distinct variable name for each column.
pub(super) fn variable_names(names: &[&str]) -> Vec<String> {
    let mut variables: Vec<String> = Vec::with_capacity(names.len());
    for name in names {
        let plain: String = name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
            .take(MAX_NAME_CHARS)
            .collect();
        let plain = match plain.chars().next() {
            Some(first) if first.is_ascii_alphabetic() && !KEYWORDS.contains(&plain.as_str()) => plain,
            _ => format!("x{plain}"),
        };
        let mut variable: String = plain.chars().take(MAX_NAME_CHARS).collect();
        // A column whose original name equals the variable name keeps this name.
        let taken = |variable: &str| {
            variables.iter().any(|v| v == variable)
                || [COMMENTS_ARRAY, NAMES_VARIABLE].contains(&variable)
                || names.iter().any(|other| other != name && *other == variable)
        };
        let mut number = 2_u64;
        while taken(&variable) {
            let end = format!("_{number}");
            variable = plain
                .chars()
                .take(MAX_NAME_CHARS.saturating_sub(end.len()))
                .collect::<String>()
                + &end;
            number = number.saturating_add(1);
        }
        variables.push(variable);
    }
    variables
}

/// Renames the variables to their original names.
pub(super) fn restore_names(mut entries: Vec<Entry>) -> Vec<Entry> {
    let at = entries.iter().position(|entry| entry.path == NAMES_VARIABLE);
    if let Some(Value::Texts(lines)) = at.map(|at| entries.remove(at).value) {
        for line in &lines {
            let Some((variable, name)) = line.split_once(' ') else {
                continue;
            };
            if let Some(entry) = entries.iter_mut().find(|entry| entry.path == variable) {
                name.clone_into(&mut entry.path);
            }
        }
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variable_names_are_valid_and_unique() {
        let found = variable_names(&[
            "e",
            "K e",
            "K_e",
            "f-y",
            "1st",
            "",
            "end",
            "_x",
            "K/e",
            "run(3).e",
            "hoid_names",
        ]);
        let expected = [
            "e",
            "K_e_2",
            "K_e",
            "f_y",
            "x1st",
            "x",
            "xend",
            "x_x",
            "K_e_3",
            "run_3__e",
            "hoid_names_2",
        ];
        assert_eq!(found, expected);
        let long = "a".repeat(70);
        let found = variable_names(&[&long, &format!("{long}b")]);
        assert!(found.iter().all(|name| name.len() == 63) && found[0] != found[1]);
    }
}
