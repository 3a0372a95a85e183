//! Recognition of the time column under the name and in the unit that a recorder uses.
//!
//! The time is the column t, in s. If there is no such column, the first of the following columns that exists is used:
//! 1. the only column whose name denotes a time, with or without a unit: `Time (s)`, `Zeit [s]`, `time_ns`, `elapsed`,
//!    `%time`;
//! 2. the only column with time stamps: dates and clock times as text or as a data type, or numbers counted from 1970
//!    in a column such as `timestamp` or `header.stamp`, or serial days, or numbers with steps of fractions of a
//!    second;
//! 3. whole seconds in one column and nanoseconds in another with the same prefix: `stamp.sec`, `stamp.nanosec`;
//! 4. the only increasing column with a unit of time, such as `xAxis [s]`;
//! 5. the first column or the index of pandas if it has no name, or the first row or column of a matrix, if its values
//!    increase from row to row and are not row numbers.
//!
//! A column selected by `--time COLUMN[:unit]` takes precedence. The unit is taken from the name. Without a unit in the
//! name, the unit follows from the size of numbers counted from 1970 (1e11 s would be the year 5138), or else from the
//! steps: integers with steps of 5 or more are a count, in the unit that gives a sampling frequency from 2 to 2000 Hz.
//! Times with decimals, such as `10.0`, are in s, and so are integers whose steps are all the same number of minutes
//! (60, 300, 900 ... s). The note on a unit inferred from the steps names the option that changes it. Numbers from
//! 20 000 to 80 000 or from 700 000 to 800 000 with steps of 0.5 ms to 10 s in days are the serial days of spreadsheets
//! (from 1900) or the date numbers of MATLAB (from the year 0): in s, the sampling frequency would be above 8 kHz. The
//! choice is reported.

use std::ops::Range;

use hoid_model::numbers::format_plain;

use super::sampling::{pairs, steps};
use super::time_choice::{TimeChoice, Unit};
use crate::IoError;
use crate::table::{Column, Precision, Table};
use crate::wording::{abbreviate, format_name};

/// Size above which the numbers in a time stamp column are assumed to be counted from 1970: 1e8 s is in 1973.
const MIN_STAMP: f64 = 1e8;
/// Median step above which integer times are assumed not to be in s.
const MIN_NON_SECOND_STEP: f64 = 5.0;
/// Length of an hour, s. Recorders of slow processes store a sample in each of these equal parts of an hour.
const HOUR_S: f64 = 3600.0;
/// Largest sampling frequency that is assumed when the unit is inferred from the steps, Hz.
const MAX_HZ: f64 = 2000.0;

/// Name of the index column of pandas in Parquet if the index has no name.
const PANDAS_INDEX: &str = "__index_level_0__";
/// Serial days of spreadsheets from 1954 to 2119, and of MATLAB from 1916 to 2190.
const SERIAL_DAYS: [Range<f64>; 2] = [20_000.0..80_000.0, 700_000.0..800_000.0];
/// Steps of serial days, in s.
const SERIAL_STEPS_S: Range<f64> = 1.0 / MAX_HZ..10.0;

/// Column names that denote a time.
const TIME_NAMES: [&str; 11] = [
    "t",
    "time",
    "zeit",
    "temps",
    "tiempo",
    "tempo",
    "elapsed",
    "elapsed time",
    "elapsedtime",
    "real time",
    "x value",
];
/// Column names that denote a time stamp; a column with such a name may also hold the time of day or a count.
const STAMP_NAMES: [&str; 14] = [
    "timestamp",
    "timestamps",
    "time stamp",
    "time stamps",
    "stamp",
    "datetime",
    "date time",
    "date",
    "datum",
    "uhrzeit",
    "zeitstempel",
    "datenum",
    "date number",
    "serial date",
];

/// Role of a column, as its name suggests.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ColumnRole {
    Time(Option<Unit>),
    Stamp,
    Other,
}

fn column_role(name: &str) -> ColumnRole {
    let name = name.trim().trim_start_matches(['%', '#']).to_lowercase();
    let words: Vec<&str> = name
        .split([' ', '_', '-', '.', ',', '/', '(', ')', '[', ']'])
        .filter(|word| !word.is_empty())
        .collect();
    let unit = words.last().filter(|_| words.len() > 1).and_then(|last| Unit::of(last));
    let unit = unit.filter(|unit| !matches!(unit, Unit::Iso | Unit::SecondsAndNanoseconds));
    let base = match (words.as_slice(), unit) {
        ([base @ .., _], Some(_)) => base.join(" "),
        (all, _) => all.join(" "),
    };
    if TIME_NAMES.contains(&base.as_str()) {
        return ColumnRole::Time(unit);
    }
    match (words.last(), unit) {
        _ if STAMP_NAMES.contains(&base.as_str()) && unit.is_some() => ColumnRole::Time(unit),
        (Some(last), None) if STAMP_NAMES.contains(last) || STAMP_NAMES.contains(&base.as_str()) => ColumnRole::Stamp,
        _ => ColumnRole::Other,
    }
}

/// True if a column with this name may become the time.
pub(crate) fn is_time(name: &str) -> bool {
    column_role(name) != ColumnRole::Other
}

/// True if a column may be the time or a part of the time, because of its name, its position or the choice of the user.
pub(crate) fn may_be_time(at: usize, name: &str, choice: Option<&TimeChoice>) -> bool {
    let last = name.to_lowercase();
    let last = last.rsplit(['.', '_', '/', ' ']).next().unwrap_or_default();
    let is_part = matches!(Unit::of(last), Some(Unit::Power(0 | -9)));
    let is_chosen = choice.is_some_and(|choice| choice.column.split('+').any(|part| part == name));
    is_time(name)
        || is_part
        || is_chosen
        || choice.is_some_and(|choice| choice.column == name)
        || (at == 0 && name.is_empty())
}

/// True if a column with this unit may become the time.
pub(crate) fn is_time_unit(unit: &str) -> bool {
    Unit::of(unit).is_some()
}

/// Returns the table with its time column, if one is selected or recognised, renamed to t and converted to s.
pub(crate) fn with_time<'a>(mut table: Table<'a>, choice: Option<&TimeChoice>) -> Result<Table<'a>, IoError> {
    let found = match choice {
        Some(choice) => Some(selected_time_column(&table, choice)?),
        None if table
            .columns
            .iter()
            .any(|column| column.name == "t" && !column.is_clock_time) =>
        {
            table
                .columns
                .iter()
                .position(|column| column.name == "t")
                .map(|at| (at, None))
        }
        None => find_time_column(&table),
    };
    if let Some((at, unit)) = found {
        convert_to_time(&mut table, at, unit);
    }
    // Clock times in other columns do not count as numbers.
    for column in table.columns.iter_mut().filter(|column| column.is_clock_time) {
        column.values.fill(f64::NAN);
        column.texts = (0..table.rows).collect();
    }
    Ok(table)
}

/// Returns the column that the user selected, and its unit.
fn selected_time_column(table: &Table<'_>, choice: &TimeChoice) -> Result<(usize, Option<Unit>), IoError> {
    let position = |name: &str| table.columns.iter().position(|column| column.name == name);
    let unit = choice.unit;
    if let Some((seconds, nanoseconds)) = choice.column.split_once('+')
        && let (Some(at), Some(_)) = (position(seconds), position(nanoseconds))
        && nanoseconds_of(table, at).is_some()
    {
        return Ok((at, Some(Unit::SecondsAndNanoseconds)));
    }
    if choice.is_pair() {
        let seconds = table.columns.iter().enumerate().find(|(at, Column { name, .. })| {
            let ours = *name == choice.column || name.strip_prefix(&choice.column).is_some_and(|end| end.len() < 9);
            ours && nanoseconds_of(table, *at).is_some()
        });
        if let Some((at, _)) = seconds {
            return Ok((at, unit));
        }
    } else if let Some(at) = position(&choice.column) {
        return Ok((at, unit));
    }
    Err(choice.unknown_error(&table.names(), table.source.file()))
}

/// Returns the only column that satisfies the condition; `None` if there are none or several.
fn only_match(table: &Table<'_>, is_meant: impl Fn(usize, &Column) -> bool) -> Option<usize> {
    let all = table.columns.iter().enumerate();
    let mut meant = all.filter(|(at, column)| is_meant(*at, column)).map(|(at, _)| at);
    meant.next().filter(|_| meant.next().is_none())
}

/// Finds the time column by its name, type or position; also returns its unit, if known.
fn find_time_column(table: &Table<'_>) -> Option<(usize, Option<Unit>)> {
    let is_constant = |values: &[f64]| values.iter().all(|value| values.first() == Some(value));
    let unit = |at: usize| match table.columns.get(at).map(|column| column_role(&column.name)) {
        Some(ColumnRole::Time(unit)) => unit,
        _ => None,
    };
    let by_name = || {
        only_match(table, |_, column| {
            matches!(column_role(&column.name), ColumnRole::Time(_)) && column.texts.is_empty()
        })
    };
    let by_type = || only_match(table, |_, column| column.is_clock_time && !is_constant(&column.values));
    let by_stamp = || {
        only_match(table, |_, column| {
            let values = &column.values;
            let is_stamp = || values.iter().all(|value| *value >= MIN_STAMP || value.is_nan());
            column_role(&column.name) == ColumnRole::Stamp
                && (is_stamp() || is_serial_days(values) || runs_in_seconds(values))
        })
    };
    let by_unit = || {
        only_match(table, |_, column| {
            is_time_unit(&column.unit) && is_increasing(&column.values)
        })
    };
    let pair = || only_match(table, |at, _| nanoseconds_of(table, at).is_some());
    by_name()
        .or_else(by_type)
        .or_else(by_stamp)
        .map(|at| (at, unit(at)))
        .or_else(|| pair().map(|at| (at, Some(Unit::SecondsAndNanoseconds))))
        .or_else(|| by_unit().map(|at| (at, None)))
        .or_else(|| first_time_line(table).map(|at| (at, None)))
}

/// Finds the column of nanoseconds that belongs to a column of whole seconds.
fn nanoseconds_of(table: &Table<'_>, at: usize) -> Option<usize> {
    let split = |name: &str| -> Option<(String, Option<Unit>)> {
        let lower = name.to_lowercase();
        let last = lower.rsplit(['.', '_', '/', ' ']).next()?;
        Some((lower.strip_suffix(last)?.to_owned(), Unit::of(last)))
    };
    let column = table.columns.get(at)?;
    let (prefix, unit) = split(&column.name)?;
    let is_whole = |column: &Column| column.values.iter().all(|value| value.fract() == 0.0);
    if unit != Some(Unit::Power(0)) || !is_whole(column) {
        return None;
    }
    only_match(table, |_, column| {
        split(&column.name) == Some((prefix.clone(), Some(Unit::Power(-9))))
            && column.values.iter().all(|ns| (0.0..1e9).contains(ns))
    })
}

/// Returns the first column if it has no name, the index of pandas if it has no name, or the first row or column of a
/// matrix, if its values increase like a time.
fn first_time_line(table: &Table<'_>) -> Option<usize> {
    let is_first = |at: usize, column: &Column| {
        let line = ["(1,:)", "(:,1)", "[0,:]", "[:,0]", "[0]"];
        (at == 0 && column.name.is_empty())
            || column.name == PANDAS_INDEX
            || line.iter().any(|line| column.name.ends_with(line))
    };
    let first = only_match(table, is_first)?;
    let values = &table.columns.get(first)?.values;
    let counts = steps(values).all(|step| step == 1.0);
    (is_increasing(values) && !counts).then_some(first)
}

/// True if the values increase from row to row.
fn is_increasing(values: &[f64]) -> bool {
    let is_increasing = pairs(values).all(|(value, next)| next > value);
    values.len() > 2 && is_increasing && values.iter().all(|value| value.is_finite())
}

/// Returns the median of the steps forward; `None` if there are fewer than two.
fn median_step(values: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = steps(values).filter(|step| *step > 0.0).collect();
    let middle = steps.len() / 2;
    (steps.len() > 1).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// True if the values can be serial days.
fn is_serial_days(values: &[f64]) -> bool {
    let first = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    let range = SERIAL_DAYS.into_iter().find(|range| range.contains(&first));
    range.is_some_and(|range| values.iter().all(|value| range.contains(value) || value.is_nan()))
        && median_step(values).is_some_and(|step| SERIAL_STEPS_S.contains(&(step * 86_400.0)))
}

/// True if the values increase in fractions of a second; whole numbers may be a count.
fn runs_in_seconds(values: &[f64]) -> bool {
    let in_fractions = values.iter().any(|value| value.fract() != 0.0);
    is_increasing(values)
        && in_fractions
        && median_step(values).is_some_and(|step| (1.0 / MAX_HZ..=1.0).contains(&step))
}

/// True if the steps are all the same number of minutes and divide an hour.
fn steps_in_minutes(values: &[f64], step: f64) -> bool {
    step % 60.0 == 0.0 && HOUR_S % step == 0.0 && steps(values).all(|one| one == step)
}

/// Infers the unit of times whose unit is not stated. `decimals` is true if the times were written with decimals.
fn infer_unit(values: &[f64], decimals: bool) -> Unit {
    let first = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    match first {
        stamp if stamp >= 1e17 => return Unit::Power(-9),
        stamp if stamp >= 1e14 => return Unit::Power(-6),
        stamp if stamp >= 1e11 => return Unit::Power(-3),
        _ if is_serial_days(values) => return Unit::Days,
        _ => {}
    }
    if decimals || !values.iter().all(|value| value.fract() == 0.0) {
        return Unit::Power(0);
    }
    let is_count = |step: &f64| *step >= MIN_NON_SECOND_STEP && !steps_in_minutes(values, *step);
    let Some(step) = median_step(values).filter(is_count) else {
        return Unit::Power(0);
    };
    // Sample times from 0.5 ms to 0.5 s are assumed; each unit then covers its own three decades of steps.
    let power = [-3, -6, -9].into_iter().find(|power| {
        let seconds = step * 10_f64.powi(*power);
        (1.0 / MAX_HZ..1000.0 / MAX_HZ).contains(&seconds)
    });
    Unit::Power(power.unwrap_or(0))
}

/// Converts a column to the time t.
fn convert_to_time(table: &mut Table<'_>, at: usize, unit: Option<Unit>) {
    let nanosecond_column = nanoseconds_of(table, at).filter(|_| unit == Some(Unit::SecondsAndNanoseconds));
    let nanosecond_column = nanosecond_column.and_then(|nanosecond_column| table.columns.get(nanosecond_column));
    let nanoseconds = nanosecond_column.map(|column| (column.name.clone(), column.values.clone()));
    let mut columns = table.columns.iter_mut().enumerate();
    if let Some((other, column)) = columns.find(|(_, column)| column.name == "t")
        && other != at
    {
        column.name = String::from("t as recorded");
    }
    let Some(time) = table.columns.get_mut(at) else { return };
    let was_t = time.name == "t";
    let stated = unit.or_else(|| Unit::of(&time.unit));
    let unit = match stated {
        _ if time.is_clock_time => Unit::Iso,
        Some(unit) => unit,
        None => infer_unit(&time.values, time.precision.has_decimals()),
    };
    if was_t && unit == Unit::Power(0) {
        return;
    }
    // If the name of the column does not denote a time, its printed digits were not counted.
    if time.precision == Precision::default() && !time.is_clock_time {
        time.precision = Precision::from_times(&time.values, false);
    }
    let own = std::mem::replace(&mut time.name, String::from("t"));
    let name = if own.is_empty() {
        String::from("the first column, which has no name,")
    } else {
        abbreviate(&own)
    };
    let first = time
        .values
        .iter()
        .copied()
        .find(|value| value.is_finite())
        .unwrap_or(0.0);
    let step = median_step(&time.values);
    let scale = |time: &mut Column, factor: f64, from_s: f64, divide: bool| {
        for value in &mut time.values {
            let from_first = *value - from_s;
            *value = if divide {
                from_first / factor
            } else {
                from_first * factor
            };
        }
    };
    let note = match unit {
        Unit::Iso => {
            time.is_clock_time = false;
            let taken = if was_t { "" } else { "taken as t, " };
            format!("{name} is {taken}in s from its first time stamp")
        }
        Unit::SecondsAndNanoseconds => {
            let (other, ns) = nanoseconds.unwrap_or_default();
            let first_ns = ns.first().copied().unwrap_or(0.0);
            for (value, ns) in time.values.iter_mut().zip(ns) {
                *value = (*value - first) + (ns - first_ns) / 1e9;
            }
            time.precision = Precision::default();
            format!(
                "{name} and {} are taken as t, in s from their first time stamp",
                format_name(&other)
            )
        }
        Unit::Minutes | Unit::Hours | Unit::Days => {
            let (unit_s, power) = unit.seconds().unwrap_or((1.0, 0));
            // Serial days are counted from a distant date, so the last binary digit of such a number is an appreciable
            // time.
            let is_date = unit == Unit::Days && is_serial_days(&time.values);
            scale(time, unit_s, if is_date { first } else { 0.0 }, false);
            time.precision = time.precision.scale_by_power_of_ten(power);
            if is_date {
                let digit_s = first.abs() * f64::EPSILON * unit_s;
                time.precision = time.precision.limit_decimals((-digit_s.log10()).floor() as i32);
            }
            let taken = match (was_t, is_date) {
                (true, _) => "is in s from its first time stamp",
                (false, true) => "is taken as t, in s from its first time stamp",
                (false, false) => "is taken as t",
            };
            format!("{name} {taken}, from {unit}")
        }
        Unit::Power(0) => format!("{name} is taken as t, in s"),
        Unit::Power(power) => {
            let parts = 10_f64.powi(power.saturating_neg());
            let from_first = first / parts >= MIN_STAMP;
            scale(time, parts, if from_first { first } else { 0.0 }, true);
            time.precision = time.precision.scale_by_power_of_ten(power);
            let origin = if from_first { " from its first time stamp" } else { "" };
            let taken = if was_t { "" } else { "taken as t, " };
            // Numbers counted from 1970 are evidence of their unit; steps are not.
            let doubt = match (stated, step) {
                (None, Some(step)) if !from_first && !own.is_empty() => format!(
                    ", since its integers advance by {}; if they are in s, add --time {}:s",
                    format_plain(step),
                    format_name(&own)
                ),
                _ => String::new(),
            };
            format!("{name} is {taken}in s{origin}, from {unit}{doubt}")
        }
    };
    // The unit s is the default for t and is not stored.
    time.unit = String::from(if unit == Unit::Power(0) { "" } else { "s" });
    table
        .notes
        .retain(|note| note != "column 1 has no name and is left out" || !name.starts_with("the first column"));
    table.notes.push(note);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_columns_and_units_are_recognised_by_name() {
        use ColumnRole::{Other, Stamp, Time};
        let power = |power| Time(Some(Unit::Power(power)));
        for (name, meant) in [
            ("t", Time(None)),
            ("Time", Time(None)),
            ("time (s)", power(0)),
            ("Time [ms]", power(-3)),
            ("t_ms", power(-3)),
            ("timestamp_us", power(-6)),
            ("time_ns", power(-9)),
            ("TIME, sec", power(0)),
            ("Zeit [s]", power(0)),
            ("Zeit/min", Time(Some(Unit::Minutes))),
            ("elapsed", Time(None)),
            ("Elapsed Time (ms)", power(-3)),
            ("%time", Time(None)),
            ("timestamp", Stamp),
            ("time_stamps", Stamp),
            ("Date Time", Stamp),
            ("__real,_time", Time(None)),
            ("Time (days)", Time(Some(Unit::Days))),
            ("header.stamp", Stamp),
            ("times", Other),
            ("target", Other),
            ("time to go", Other),
            ("t2", Other),
            ("s", Other),
            ("", Other),
        ] {
            assert_eq!(column_role(name), meant, "{name}");
        }
    }

    #[test]
    fn time_units_are_inferred_from_values() {
        let times = |first: f64, step: f64| (0..9).map(|k| first + step * f64::from(k)).collect::<Vec<_>>();
        let unit = |first: f64, step: f64| infer_unit(&times(first, step), false);
        for (first, step, power) in [
            (1.7e9, 1.0, 0),
            (1.7e12, 20.0, -3),
            (1.7e15, 20_000.0, -6),
            (1.7e18, 2e7, -9),
            (0.0, 0.02, 0),
            (0.0, 1.0, 0),
            (0.0, 20.0, -3),
            (0.0, 499.0, -3),
            (0.0, 500.0, -6),
            (0.0, 20_000.0, -6),
            (0.0, 2e7, -9),
            (0.0, 20.5, 0),
            (0.0, 1e12, 0),
            (0.0, 60.0, 0),
            (0.0, 900.0, 0),
            (0.0, 1000.0, -6),
            (0.0, 16_680.0, -6),
        ] {
            assert_eq!(unit(first, step), Unit::Power(power), "{first} {step}");
        }
        // Serial days at 100 Hz are recognised; numbers with longer steps or of another size are in s.
        for (first, step, unit_found) in [
            (45_321.5, 0.01 / 86_400.0, Unit::Days),
            (739_000.5, 0.01 / 86_400.0, Unit::Days),
            (45_321.5, 0.01, Unit::Power(0)),
            (45_321.5, 1.0, Unit::Power(0)),
            (15_321.5, 0.01 / 86_400.0, Unit::Power(0)),
            (45_321.5, 1e-12, Unit::Power(0)),
        ] {
            assert_eq!(unit(first, step), unit_found, "{first} {step}");
        }
        assert!(!is_serial_days(&[]) && !is_serial_days(&[f64::NAN]) && !is_serial_days(&[45_321.5]));
        assert!(!is_serial_days(&[45_321.5, 45_321.500_000_1, 12.0]));
        assert_eq!(infer_unit(&[f64::NAN], false), Unit::Power(0));
        assert_eq!(infer_unit(&[], false), Unit::Power(0));
        // Times written as 0.0, 10.0, ... are in s; integers whose steps are only about a minute are in ms.
        assert_eq!(infer_unit(&times(0.0, 10.0), true), Unit::Power(0));
        assert_eq!(infer_unit(&[0.0, 60.0, 121.0, 180.0], false), Unit::Power(-3));
    }

    #[test]
    fn time_choices_are_parsed() {
        for text in [
            "clock",
            "clock:ms",
            "a:b:iso",
            "stamp:sec+nanosec",
            "clock:days",
            "ans(1,:)",
            "ans(1,:):ms",
        ] {
            assert_eq!(
                text.parse::<TimeChoice>().map(|time| time.to_string()).ok().as_deref(),
                Some(text)
            );
        }
        for text in ["", ":ms", "clock:fortnight"] {
            assert!(
                matches!(text.parse::<TimeChoice>(), Err(IoError::Expression { .. })),
                "{text}"
            );
        }
    }
}
