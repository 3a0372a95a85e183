//! A line of units below the header.

use super::super::text::{is_unit, single_line};
use super::lines::{is_number, unquoted};

/// Known units. A line of units must contain at least one of them; its other entries may be any short words.
const KNOWN_UNITS: [&str; 33] = [
    "s", "sec", "secs", "seconds", "ms", "us", "µs", "min", "deg", "degs", "degree", "degrees", "°", "rad", "radians",
    "mrad", "deg/s", "rad/s", "m", "mm", "cm", "ft", "m/s", "v", "volt", "volts", "mv", "ma", "n", "nm", "%",
    "percent", "hz",
];

/// Returns the unit in a cell below the header, without brackets; `None` if the cell contains no unit.
fn unit(cell: &str) -> Option<&str> {
    let cell = unquoted(cell);
    let inside = [('[', ']'), ('(', ')')]
        .into_iter()
        .find_map(|(open, close)| cell.strip_prefix(open)?.strip_suffix(close));
    let unit = inside.unwrap_or(cell).trim();
    // A unit cannot contain a comma, because commas separate the units in the comment.
    let names_one = unit.is_empty() || is_unit(unit) && !unit.contains(',') && !is_number(unit);
    names_one.then_some(unit)
}

/// Returns the comment `units: t s, e deg` for a line of cells below the header `names`; `None` if the cells are not
/// units.
pub(super) fn units_comment(names: &[&str], cells: &[&str]) -> Option<String> {
    let units: Vec<&str> = cells.iter().map(|cell| unit(cell)).collect::<Option<_>>()?;
    let is_known = |unit: &&str| KNOWN_UNITS.contains(&unit.to_lowercase().as_str());
    if units.len() != names.len() || !units.iter().any(is_known) {
        return None;
    }
    let named = names.iter().zip(units).filter(|(_, unit)| !matches!(*unit, "" | "-"));
    let named: Vec<String> = named
        .map(|(name, unit)| format!("{} {unit}", single_line(unquoted(name))))
        .collect();
    Some(format!("units: {}", named.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_lines_become_a_comment() {
        let names = ["t", "\"e\"", "u"];
        for (cells, units) in [
            (["s", "deg", "V"], Some("units: t s, e deg, u V")),
            (["[s]", "(deg)", "\"V\""], Some("units: t s, e deg, u V")),
            (["s", "", "-"], Some("units: t s")),
            (
                ["seconds", "degrees", "volts"],
                Some("units: t seconds, e degrees, u volts"),
            ),
            (["start", "here", "now"], None),
            (["s", "1", "2"], None),
            (["s", "deg", "a unit of many words"], None),
        ] {
            assert_eq!(units_comment(&names, &cells).as_deref(), units, "{cells:?}");
        }
        assert_eq!(units_comment(&names, &["s", "deg"]), None);
        assert_eq!(units_comment(&[], &[]), None);
    }
}
