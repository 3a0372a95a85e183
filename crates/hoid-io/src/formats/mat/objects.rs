//! MATLAB objects: only MATLAB can read their contents, and one line of MATLAB code extracts their numbers.

use crate::formats::arrays::OBJECT_PREFIX;
use crate::wording::abbreviate;

/// Describes an object of a class, and gives the line of MATLAB code that extracts its numbers.
pub(super) fn describe_object(class: &str) -> String {
    let line = match class {
        "timetable" => "t = seconds(x.Properties.RowTimes - x.Properties.RowTimes(1)); e = x.e; u = x.u;",
        "table" => "t = x.t; e = x.e; u = x.u;",
        "timeseries" => "t = x.Time; e = squeeze(x.Data);",
        "Dataset" | "dataset" => "t = x{1}.Values.Time; e = squeeze(x{1}.Values.Data);",
        "string" => return format!("{OBJECT_PREFIX} string (in MATLAB, char(x) is text)"),
        _ => return format!("{OBJECT_PREFIX} {}", abbreviate(class)),
    };
    format!("{OBJECT_PREFIX} {class} (in MATLAB, if it is named x: {line} save run.mat t e u)")
}

#[cfg(test)]
mod tests {
    use super::describe_object;

    #[test]
    fn classes_with_signals_have_an_export_command() {
        for class in ["timetable", "table", "timeseries"] {
            let message = describe_object(class);
            assert!(message.contains(class) && message.contains("save run.mat"), "{message}");
        }
        assert!(describe_object("thing").contains("class thing"));
    }

    #[test]
    fn control_characters_in_class_names_are_escaped() {
        assert_eq!(
            describe_object("ti\0\u{1b}[31m"),
            format!("{} ti\\0\\u{{1b}}[31m", super::OBJECT_PREFIX)
        );
    }
}
