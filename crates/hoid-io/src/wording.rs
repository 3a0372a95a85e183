//! Formatting of numbers, names and cells in messages.

use std::borrow::Cow;

use crate::table::{find_control_column, find_error_column};

/// Maximum length, in characters, of a cell quoted in a message.
const MAX_CELL_CHARS: usize = 40;

/// Formats a cell or a name for a message: shortened, and without terminal control characters.
pub(crate) fn abbreviate(text: &str) -> String {
    let text = text.trim();
    let cut = match text.char_indices().nth(MAX_CELL_CHARS) {
        Some((at, _)) => Cow::Owned(format!("{}...", &text[..at])),
        None => Cow::Borrowed(text),
    };
    cut.escape_debug().to_string()
}

/// Number of bytes at the start of a file that a message quotes.
const QUOTED_BYTES: usize = 12;

/// Quotes the start of a file for a message about its format: `it starts with "..."`.
pub(crate) fn quote_start(bytes: &[u8]) -> String {
    let start = bytes.get(..QUOTED_BYTES).unwrap_or(bytes);
    format!("it starts with \"{}\"", String::from_utf8_lossy(start).escape_debug())
}

/// Maximum length, in characters, of a column name in a message.
const MAX_NAME_CHARS: usize = 80;

/// Formats a column name for a message: a long name is shortened, and control characters are escaped; nothing else is
/// changed.
pub(crate) fn format_name(name: &str) -> String {
    let mut text = String::with_capacity(name.len().min(4 * MAX_NAME_CHARS));
    for (at, character) in name.chars().enumerate() {
        if at == MAX_NAME_CHARS {
            text.push_str("...");
            break;
        }
        if character.is_control() {
            text.extend(character.escape_default());
        } else {
            text.push(character);
        }
    }
    text
}

/// Returns the command-line option for reading a sparse column.
pub(crate) fn sparse_option(name: &str) -> String {
    let name = format_name(name);
    if name.contains(char::is_whitespace) {
        format!("--sparse \"{name}=hold\"")
    } else {
        format!("--sparse {name}=hold")
    }
}

/// Escapes the terminal control characters, except line ends, of a message that may quote parts of a file; for example,
/// escape is written as `\u{1b}`.
#[must_use]
pub fn escape_control_characters(message: &str) -> String {
    let mut text = String::with_capacity(message.len());
    for character in message.chars() {
        if character.is_control() && character != '\n' {
            text.extend(character.escape_default());
        } else {
            text.push(character);
        }
    }
    text
}

/// Formats the error message of a third-party crate: shortened, and without terminal control characters.
pub(crate) fn short_error(what: &str) -> String {
    let line = what.lines().next().unwrap_or_default();
    line.chars().take(200).collect::<String>().escape_debug().to_string()
}

/// Minimum similarity of a suggested name; flags of the command line have the same limit.
const MIN_SIMILARITY: f64 = 0.7;

/// Ends of the names of columns that contain the values of a signal; `e.Data` has one, `e.Time` has none.
const VALUE_PARTS: [&str; 2] = [".data", ".values"];

/// Returns suggestions such as "; did you mean "u"?" for names that do not exist: for each of them the name that
/// differs only in case, or else the most similar name in Jaro's measure (M. A. Jaro, J. Am. Stat. Assoc. 84 (1989)
/// 414-420). For e and u the column with a common name of the signal may be suggested. The result is empty if no name
/// is similar.
pub(crate) fn did_you_mean(unknown: &[&str], names: &[&str]) -> String {
    let of = |asked: &&str| {
        let asked = asked.trim().to_lowercase();
        let score = |name: &str| (strsim::jaro(&asked, &name.trim().to_lowercase()), name.to_owned());
        // Of equally similar parts of a signal, the part that contains the values is suggested.
        let is_values = |name: &str| VALUE_PARTS.iter().any(|part| name.to_lowercase().ends_with(part));
        // One or two letters occur in many longer names: only a name that starts with them is suggested.
        let is_near = |name: &&&str| asked.chars().count() > 2 || name.trim().to_lowercase().starts_with(&asked);
        let known = names
            .iter()
            .filter(|name| !name.is_empty())
            .filter(is_near)
            .map(|name| score(name));
        let best = known
            .max_by(|a, b| a.0.total_cmp(&b.0).then(is_values(&a.1).cmp(&is_values(&b.1))))
            .filter(|best| best.0 > MIN_SIMILARITY);
        let meant = best.map(|best| best.1).or_else(|| suggest_by_role(&asked, names))?;
        Some(format!("\"{}\"", format_name(&meant)))
    };
    let near: Vec<String> = unknown.iter().filter_map(of).collect();
    if near.is_empty() {
        String::new()
    } else {
        format!("; did you mean {}?", near.join(" and "))
    }
}

/// Returns the column that holds the requested signal under another name: if `e` or `error` is requested, the column of
/// the error; if `u` or `stick` is requested, the column of the control.
fn suggest_by_role(asked: &str, names: &[&str]) -> Option<String> {
    let default = match (find_error_column(&[asked]), find_control_column(&[asked])) {
        (Some(_), _) => find_error_column(names),
        (_, Some(_)) => find_control_column(names),
        _ => None,
    };
    default.map(str::to_owned)
}

/// Lists names for a message; a long list is shortened.
pub(crate) fn list_names(names: &[&str]) -> String {
    const MAX_SHOWN_NAMES: usize = 40;
    let known: Vec<&str> = names.iter().copied().filter(|name| !name.is_empty()).collect();
    let shown: Vec<String> = known
        .iter()
        .take(MAX_SHOWN_NAMES)
        .map(|name| format_name(name))
        .collect();
    let mut text = shown.join(", ");
    match known.len() {
        0 => text.push_str("no named columns"),
        n if n > MAX_SHOWN_NAMES => text.push_str(&format!(" and {} more", n.saturating_sub(MAX_SHOWN_NAMES))),
        _ => {}
    }
    text
}

/// Formats a number for a message with up to nine significant digits, without trailing zeros.
pub(crate) fn format_decimal(value: f64) -> String {
    let rounded = format!("{value:.8e}").parse::<f64>().unwrap_or(value);
    format!("{rounded}")
}

/// Formats a number with up to four significant digits.
pub(crate) fn format_short(value: f64) -> String {
    let rounded = format!("{value:.3e}").parse::<f64>().unwrap_or(value);
    if rounded != 0.0 && !(1e-3..1e7).contains(&rounded.abs()) {
        format!("{rounded:e}")
    } else {
        format!("{rounded}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_similar_names_are_suggested() {
        let names = ["t", "error", "stick", "", "E"];
        assert_eq!(did_you_mean(&["eror"], &names), "; did you mean \"error\"?");
        assert_eq!(did_you_mean(&["e"], &names), "; did you mean \"E\"?");
        assert_eq!(
            did_you_mean(&["Stik", "errror"], &names),
            "; did you mean \"stick\" and \"error\"?"
        );
        assert_eq!(did_you_mean(&["q"], &names), "");
        assert_eq!(did_you_mean(&["e"], &["Time [ms]"]), "");
        assert_eq!(did_you_mean(&["q"], &[]), "");
        let parts = ["e.Time", "e.Data", "e.Name"];
        assert_eq!(did_you_mean(&["e"], &parts), "; did you mean \"e.Data\"?");
        let own = ["t", "Target", "Stick", "Tracking error"];
        assert_eq!(did_you_mean(&["e"], &own), "; did you mean \"Tracking error\"?");
        assert_eq!(did_you_mean(&["Error"], &own), "; did you mean \"Tracking error\"?");
        assert_eq!(did_you_mean(&["u"], &own), "; did you mean \"Stick\"?");
    }

    #[test]
    fn long_cells_are_shortened_and_escaped() {
        let shown = abbreviate(&"\u{1b}[31mé".repeat(1000));
        assert!(shown.chars().count() < 200 && !shown.contains('\u{1b}'), "{shown}");
    }
}
