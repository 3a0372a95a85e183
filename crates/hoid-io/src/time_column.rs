//! The time under the name that a recorder gives it.
//!
//! The time is the column t, in s. Where no column is called so, the only one that is called time,
//! or t with a unit, takes its place: `Time (s)`, `time_ms`, `t [ms]`, `Timestamp (us)`.

use crate::table::{Precision, Table};
use crate::wording::shown;

/// Powers of ten from the unit in a name to s; `None` where the name is none of a time.
fn power_of(name: &str) -> Option<i32> {
    let name = name.trim().to_lowercase();
    let end = name.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(name.len());
    let (base, unit) = name.split_at(end);
    let unit = unit.trim_matches([' ', '_', '-', '.', ',', '/', '(', ')', '[', ']']);
    let power = match unit {
        "" | "s" | "sec" | "secs" | "second" | "seconds" => 0,
        "ms" | "msec" | "millis" | "millisecond" | "milliseconds" => -3,
        "us" | "µs" | "μs" | "usec" | "micros" | "microsecond" | "microseconds" => -6,
        _ => return None,
    };
    match base {
        "t" | "time" => Some(power),
        // Without a unit it may be the time of day.
        "timestamp" if !unit.is_empty() => Some(power),
        _ => None,
    }
}

/// Whether the values of a column may become the time.
pub(crate) fn is_time(name: &str) -> bool {
    power_of(name).is_some()
}

/// The table with a column t in s, where it has one column that is a time.
pub(crate) fn with_time(mut table: Table<'_>) -> Table<'_> {
    if table.columns.iter().any(|column| column.name == "t") {
        return table;
    }
    let mut times = table.columns.iter_mut().filter(|column| is_time(&column.name));
    let (Some(time), None) = (times.next(), times.next()) else {
        return table;
    };
    let power = power_of(&time.name).unwrap_or(0);
    if power != 0 {
        let parts = 10_f64.powi(-power);
        time.values.iter_mut().for_each(|value| *value /= parts);
        time.precision = Precision::shifted(time.precision, power);
        time.unit = String::from("s");
    }
    let name = std::mem::replace(&mut time.name, String::from("t"));
    table.notes.push(format!("{} is taken as t, in s", shown(&name)));
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_times_and_their_units() {
        for (name, power) in [
            ("t", Some(0)),
            ("Time", Some(0)),
            ("time (s)", Some(0)),
            ("Time [ms]", Some(-3)),
            ("t_ms", Some(-3)),
            ("timestamp_us", Some(-6)),
            ("TIME, sec", Some(0)),
            ("timestamp", None),
            ("times", None),
            ("target", None),
            ("time to go", None),
            ("t2", None),
            ("", None),
        ] {
            assert_eq!(power_of(name), power, "{name}");
        }
    }
}
