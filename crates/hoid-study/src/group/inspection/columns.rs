//! Error and control by the names that people give them.

use hoid_io::{control_among, error_among};

/// Names of what is followed.
const TARGETS: [&str; 7] = ["r", "ref", "reference", "target", "track", "setpoint", "f_t"];
/// Names of what is steered.
const OUTPUTS: [&str; 7] = ["y", "output", "position", "state", "cursor", "response", "x"];

/// A choice of input and output, each with the reason.
pub struct Chosen {
    pub input: (String, String),
    pub output: (String, String),
}

/// Input and output among columns; what was asked for is taken as it is. Where nothing is known the
/// usual names are kept, to be replaced by hand.
pub fn choose(columns: &[&str], input: Option<&str>, output: Option<&str>) -> Chosen {
    let find = |known: &[&str]| {
        let mut all = known.iter();
        all.find_map(|name| columns.iter().find(|column| column.eq_ignore_ascii_case(name)))
    };
    let asked = |name: &str| (name.to_owned(), "as asked for".to_owned());
    let input = match (input, error_among(columns), find(&TARGETS).zip(find(&OUTPUTS))) {
        (Some(name), ..) => asked(name),
        (_, Some(name), _) => (name.to_owned(), "the tracking error, by its name".to_owned()),
        (_, _, Some((r, y))) => (
            format!("{r}-{y}"),
            format!("no column is called e: target {r} less output {y}"),
        ),
        _ => (
            "e".to_owned(),
            "not found by its name: write the column, or a difference such as r-y".to_owned(),
        ),
    };
    let output = match (output, control_among(columns)) {
        (Some(name), _) => asked(name),
        (_, Some(name)) => (name.to_owned(), "the control, by its name".to_owned()),
        _ => ("u".to_owned(), "not found by its name: write the column".to_owned()),
    };
    Chosen { input, output }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_decide_and_what_was_asked_for_wins() {
        let of = |columns: &[&str], input, output| {
            let chosen = choose(columns, input, output);
            (chosen.input.0, chosen.output.0)
        };
        let pair = |e: &str, u: &str| (e.to_owned(), u.to_owned());
        assert_eq!(of(&["t", "e", "u", "y"], None, None), pair("e", "u"));
        assert_eq!(of(&["t", "r", "d", "u", "y"], None, None), pair("r-y", "u"));
        assert_eq!(of(&["Time", "Error", "Stick"], None, None), pair("Error", "Stick"));
        let words = ["Time (s)", "Target", "Stick [V]", "Tracking error"];
        assert_eq!(of(&words, None, None), pair("Tracking error", "Stick [V]"));
        assert_eq!(of(&["t", "e", "u"], Some("-e"), Some("w")), pair("-e", "w"));
        let nothing = choose(&["a", "b"], None, None);
        assert!(nothing.input.1.contains("not found") && nothing.output.1.contains("not found"));
    }
}
