//! Recognition of error and control by their common column names.

use hoid_io::{find_control_column, find_error_column};

/// Common names of the tracked signals.
const TARGETS: [&str; 7] = ["r", "ref", "reference", "target", "track", "setpoint", "f_t"];
/// Common names of the controlled variables.
const OUTPUTS: [&str; 7] = ["y", "output", "position", "state", "cursor", "response", "x"];

/// The column of a signal, and the reason why it was chosen.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Role {
    /// Name of the column, or a difference of two columns.
    pub column: String,
    /// Reason why the column was chosen.
    pub reason: String,
    /// True if no other column is equally likely.
    pub is_certain: bool,
}

/// Columns of error and control in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Roles {
    /// Column of the tracking error.
    pub input: Role,
    /// Column of the control.
    pub output: Role,
}

impl Role {
    fn new(column: impl Into<String>, why: impl Into<String>, certain: bool) -> Self {
        Self {
            column: column.into(),
            reason: why.into(),
            is_certain: certain,
        }
    }
}

impl Roles {
    /// Finds input and output among the columns; columns requested by the user are kept. For a signal that is not
    /// found, the default name (`e` or `u`) is returned as uncertain, for the user to replace.
    pub fn of(columns: &[&str], input: Option<&str>, output: Option<&str>) -> Self {
        let known = |names: &[&str]| -> Vec<&str> {
            let all = names.iter();
            all.flat_map(|name| {
                columns
                    .iter()
                    .copied()
                    .filter(|column| column.eq_ignore_ascii_case(name))
            })
            .collect()
        };
        let (targets, outputs) = (known(&TARGETS), known(&OUTPUTS));
        let asked = |name: &str| Role::new(name, "as requested", true);
        let input = match (input, find_error_column(columns), targets.first().zip(outputs.first())) {
            (Some(name), ..) => asked(name),
            (_, Some(name), _) => Role::new(name, "the tracking error, by name", true),
            (_, _, Some((r, y))) => Role::new(
                format!("{r}-{y}"),
                format!("no column is named e: target {r} minus output {y}"),
                targets.len() == 1 && outputs.len() == 1,
            ),
            _ => Role::new(
                "e",
                "not found by name: give the column, or a difference such as r-y",
                false,
            ),
        };
        let output = match (output, find_control_column(columns)) {
            (Some(name), _) => asked(name),
            (_, Some(name)) => Role::new(name, "the control, by name", true),
            _ => Role::new("u", "not found by name: give the column", false),
        };
        Self { input, output }
    }

    /// True if both columns are certain.
    pub fn are_certain(&self) -> bool {
        self.input.is_certain && self.output.is_certain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roles_follow_names_unless_columns_are_given() {
        let of = |columns: &[&str], input, output| {
            let chosen = Roles::of(columns, input, output);
            (chosen.input.column, chosen.output.column)
        };
        let pair = |e: &str, u: &str| (e.to_owned(), u.to_owned());
        assert_eq!(of(&["t", "e", "u", "y"], None, None), pair("e", "u"));
        assert_eq!(of(&["t", "r", "d", "u", "y"], None, None), pair("r-y", "u"));
        assert_eq!(of(&["Time", "Error", "Stick"], None, None), pair("Error", "Stick"));
        let words = ["Time (s)", "Target", "Stick [V]", "Tracking error"];
        assert_eq!(of(&words, None, None), pair("Tracking error", "Stick [V]"));
        assert_eq!(of(&["t", "e", "u"], Some("-e"), Some("w")), pair("-e", "w"));
        let nothing = Roles::of(&["a", "b"], None, None);
        assert!(nothing.input.reason.contains("not found") && nothing.output.reason.contains("not found"));
        assert!(!nothing.are_certain() && !Roles::of(&[], None, None).are_certain());
    }

    #[test]
    fn ambiguous_or_missing_columns_are_not_certain() {
        let certain = |columns: &[&str]| Roles::of(columns, None, None).are_certain();
        assert!(certain(&["t", "r", "y", "u"]) && certain(&["t", "Tracking error", "Stick"]));
        assert!(!certain(&["t", "r", "target", "y", "u"]) && !certain(&["t", "r", "y", "x", "u"]));
        assert!(!certain(&["t", "r", "y", "w"]) && !certain(&["t", "y", "u"]));
        assert!(Roles::of(&["t", "r", "x", "y", "u"], Some("r-y"), None).are_certain());
    }
}
