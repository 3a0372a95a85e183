//! Recognition of the error and the control by common column names.
//!
//! A column matches if its whole name is a common name, regardless of case. If there is no such column, the only column
//! that contains a common name as a word matches, such as `Tracking error`, `stick [V]` or `e (deg)`. A single letter
//! counts only as the first word.

/// Common names of the error, the most specific first.
const ERROR_NAMES: [&str; 10] = [
    "e",
    "error",
    "err",
    "tracking_error",
    "tracking error",
    "e_t",
    "fehler",
    "regelfehler",
    "regelabweichung",
    "erreur",
];
/// Common names of the control.
const CONTROL_NAMES: [&str; 13] = [
    "u",
    "control",
    "stick",
    "command",
    "cmd",
    "control_input",
    "joystick",
    "delta",
    "knüppel",
    "steuerknüppel",
    "stellgröße",
    "commande",
    "manche",
];

/// Returns the column whose name denotes the tracking error; `None` if there is none.
#[must_use]
pub fn find_error_column<'a>(columns: &[&'a str]) -> Option<&'a str> {
    find_column(columns, &ERROR_NAMES)
}

/// Returns the column whose name denotes the control; `None` if there is none.
#[must_use]
pub fn find_control_column<'a>(columns: &[&'a str]) -> Option<&'a str> {
    find_column(columns, &CONTROL_NAMES)
}

fn find_column<'a>(columns: &[&'a str], names: &[&str]) -> Option<&'a str> {
    let whole = |name: &&str| columns.iter().copied().find(|column| column.eq_ignore_ascii_case(name));
    names.iter().find_map(whole).or_else(|| {
        let mut by_word = columns.iter().copied().filter(|column| has_word_of(column, names));
        by_word.next().filter(|_| by_word.next().is_none())
    })
}

fn has_word_of(column: &str, names: &[&str]) -> bool {
    let words = column
        .split(|c: char| !c.is_alphanumeric())
        .filter(|word| !word.is_empty());
    words.enumerate().any(|(at, word)| {
        let is_word = |name: &&str| word.eq_ignore_ascii_case(name);
        (at == 0 || word.chars().count() > 1) && names.iter().any(is_word)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_names_take_precedence_over_single_words() {
        assert_eq!(find_error_column(&["t", "Error", "e"]), Some("e"));
        assert_eq!(
            find_error_column(&["Time (s)", "Tracking error", "Stick"]),
            Some("Tracking error")
        );
        assert_eq!(
            find_control_column(&["Time (s)", "Tracking error", "Stick [V]"]),
            Some("Stick [V]")
        );
        assert_eq!(find_error_column(&["e (deg)", "u (deg)"]), Some("e (deg)"));
        let german = ["Zeit [s]", "Fehler [deg]", "Knüppel [V]"];
        assert_eq!(
            (find_error_column(&german), find_control_column(&german)),
            (Some(german[1]), Some(german[2]))
        );
        assert_eq!(find_control_column(&["stick force", "stick position"]), None);
        assert_eq!(find_error_column(&["phase e", "terror", ""]), None);
    }
}
