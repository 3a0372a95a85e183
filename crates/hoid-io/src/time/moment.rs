//! Dates and clock times in text, such as `2024-03-05T10:11:12.020Z`, `05.03.2024 10:11:12,02` or `10:11:12.5`.
//!
//! A clock time is counted in ns from the start of 1970 (from midnight if there is no date) in the proleptic Gregorian
//! calendar. The year is assumed to start on 1 March, which makes the leap day its last day: with `y` and `m` shifted
//! in this way, the number of days is `365 y + y/4 - y/100 + y/400 + (153 m + 2)/5 + d` (H. Hinnant, *chrono-compatible
//! low-level date algorithms*).

use std::borrow::Cow;

use super::time_choice::Unit;
use crate::table::{Column, Precision};

/// Number of ns in a second.
const NS_PER_S: i64 = 1_000_000_000;

/// Period in ns after which a clock without a date, or a clock without hours, returns to zero.
const DAY_NS: i64 = 86_400 * NS_PER_S;
const HOUR_NS: i64 = 3600 * NS_PER_S;

/// A clock time, and the precision of its seconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ClockTime {
    ns: i64,
    precision: Precision,
    /// Time after which the clock starts again at zero, ns; `None` if there is a date.
    cycle: Option<i64>,
}

/// Parses a cell as a clock time; `None` if the cell is not a clock time. A date without a time means midnight.
fn parse(cell: &str) -> Option<ClockTime> {
    let cell = without_zone_name(cell.trim());
    if !cell.starts_with(|c: char| c.is_ascii_alphanumeric()) || cell.len() > 50 {
        return None;
    }
    if let Some(moment) = parse_duration(cell) {
        return Some(moment);
    }
    let named = with_named_month(cell);
    let (date, time) = match &named {
        Some((date, time)) => (Some(date.as_str()), Some(time.as_str())),
        None => match cell.split_once(['T', ' ', '_']) {
            Some((date, time)) => (Some(date), Some(time.trim())),
            None if cell.contains(':') || cell.contains(',') => (None, Some(cell)),
            None => (Some(cell), None),
        },
    };
    // In a file with columns for date and clock, a cell such as `10:11:12 PM` has no date.
    let (date, time) = match (date, time) {
        (Some(clock), Some(half)) if clock.contains(':') && is_half(half) => (None, Some(cell)),
        other => other,
    };
    let days = date.map_or(Some(0), |date| days_of(date, time.is_some()))?;
    let (ns, decimals, cycle) = time.map_or(Some((0, 0, DAY_NS)), |time| parse_time_of_day(&with_colons(time)))?;
    let day = days.checked_mul(DAY_NS)?;
    Some(ClockTime {
        ns: day.checked_add(ns)?,
        precision: precision_of_decimals(decimals),
        cycle: date.is_none().then_some(cycle),
    })
}

/// True for the name of a time zone, such as UTC or CET.
fn is_zone_name(text: &str) -> bool {
    (3..=4).contains(&text.len())
        && text.bytes().all(|letter| letter.is_ascii_uppercase())
        && (text == "UTC" || text.ends_with('T'))
}

/// Removes the name of a time zone, which does not change within a recording.
fn without_zone_name(cell: &str) -> &str {
    match cell.rsplit_once(' ') {
        Some((rest, zone)) if is_zone_name(zone) => rest.trim_end(),
        _ => cell,
    }
}

/// Returns the date as `5-Mar-2024` and the time of a cell with the name of a month and a time, such as `05 Mar 2024
/// 10:11:12`, `Tue, 05 Mar 2024 10:11:12 +0100`, `Tue Mar 05 10:11:12 2024` or `March 5, 2024 10:11:12 PM`.
fn with_named_month(cell: &str) -> Option<(String, String)> {
    let words = || cell.split([' ', ',']).filter(|word| !word.is_empty());
    let month = words().find(|word| month_of(word).is_some())?;
    let mut time = Vec::new();
    let (mut day, mut year) = (None, None);
    for word in words().filter(|word| *word != month) {
        let is_number = word.bytes().all(|byte| byte.is_ascii_digit());
        match word.len() {
            _ if is_zone_name(word) || DAY_NAMES.iter().any(|name| is_name(word, name)) => {}
            1 | 2 if is_number && day.is_none() => day = Some(word),
            4 if is_number && year.is_none() => year = Some(word),
            _ if word.starts_with(|c: char| c.is_ascii_digit()) && word.contains(':') || !time.is_empty() => {
                time.push(word);
            }
            _ => return None,
        }
    }
    let date = format!("{}-{month}-{}", day?, year?);
    (!time.is_empty()).then(|| (date, time.join(" ")))
}

/// Writes a time of day without colons, such as `10.11.12,5` or `101112.5`, with colons; other text is returned
/// unchanged.
fn with_colons(time: &str) -> Cow<'_, str> {
    let digits = time.bytes().take_while(u8::is_ascii_digit).count();
    if !time.contains(':') && time.matches('.').count() > 1 {
        Cow::Owned(time.replacen('.', ":", 2))
    } else if let (6, Some((hour, rest))) = (digits, time.split_at_checked(2))
        && let Some((minute, seconds)) = rest.split_at_checked(2)
    {
        Cow::Owned(format!("{hour}:{minute}:{seconds}"))
    } else {
        Cow::Borrowed(time)
    }
}

fn is_half(text: &str) -> bool {
    ["am", "pm"].iter().any(|half| text.eq_ignore_ascii_case(half))
}

fn precision_of_decimals(decimals: usize) -> Precision {
    // The number of decimals does not depend on the size of the value.
    let mut precision = Precision::default();
    precision.add_decimals(decimals);
    precision
}

/// Parses a duration of MATLAB such as `0.01 sec`, or of pandas such as `0 days 00:00:00.01`.
fn parse_duration(cell: &str) -> Option<ClockTime> {
    let (number, rest) = cell.split_once(' ')?;
    let rest = rest.trim();
    if let Some(clock) = rest.strip_prefix("day") {
        let days = number.parse::<u16>().ok().map(i64::from)?;
        let clock = clock.trim_start_matches(['s', ',', ' ']);
        let (ns, decimals, _) = match clock {
            "" => (0, 0, DAY_NS),
            clock => parse_time_of_day(clock).filter(|(_, _, cycle)| *cycle == DAY_NS)?,
        };
        return Some(ClockTime {
            ns: days.checked_mul(DAY_NS)?.checked_add(ns)?,
            precision: precision_of_decimals(decimals),
            cycle: None,
        });
    }
    let (unit_s, power) = Unit::of(rest)?.seconds()?;
    let value: f64 = number.parse().ok()?;
    let ns = (value * unit_s * NS_PER_S as f64).round();
    let mut precision = Precision::default();
    precision.add(number);
    // Larger numbers of ns are not exact, and may exceed 64 bits.
    (ns.abs() < 9e15).then(|| ClockTime {
        ns: ns as i64,
        precision: precision.scale_by_power_of_ten(power),
        cycle: None,
    })
}

/// True if a cell is a date, a clock time or a duration with a unit.
pub(crate) fn is_clock_time(cell: &str) -> bool {
    parse(cell).is_some()
}

/// Interpretation of the text cells of a column, row by row: they are clock times unless some cell has other contents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum ClockTimes {
    /// All values so far are missing.
    #[default]
    Unknown,
    /// Clock times in ns: the first one, from which the others are counted, the last one, and the time added to it
    /// because the clock returned to zero.
    From { first: i64, last: i64, added: i64 },
    /// The column contains numbers or other text.
    No,
}

impl ClockTimes {
    /// Interprets a text cell and appends its value to the column.
    pub(crate) fn push(&mut self, column: &mut Column, cell: &str) {
        let moment = parse(cell).filter(|_| *self != Self::No);
        let row = column.values.len();
        let Some(ClockTime { ns, precision, cycle }) = moment else {
            self.refuse(column);
            column.texts.push(row);
            column.values.push(f64::NAN);
            return;
        };
        let (first, last, mut added) = match *self {
            Self::From { first, last, added } => (first, last, added),
            Self::Unknown | Self::No => (ns, ns, 0),
        };
        let mut now = ns.saturating_add(added);
        // The clock has returned to zero since the previous row, at midnight or at the full hour.
        if let Some(cycle) = cycle {
            let step = now.saturating_add(cycle).saturating_sub(last);
            if now < last && (0..cycle / 60).contains(&step) {
                added = added.saturating_add(cycle);
                now = now.saturating_add(cycle);
            }
        }
        *self = Self::From {
            first,
            last: now,
            added,
        };
        column.is_clock_time = true;
        column.precision.join(precision);
        column.values.push(seconds_between(now, first));
    }

    /// Called if a number was found in the column: its apparent clock times are then treated as text.
    pub(crate) fn refuse(&mut self, column: &mut Column) {
        if let Self::From { .. } = std::mem::replace(self, Self::No) {
            column.is_clock_time = false;
            column.precision = Precision::default();
            let of_text = |(row, value): (usize, &mut f64)| {
                let text = !value.is_nan();
                *value = f64::NAN;
                text.then_some(row)
            };
            column.texts = column.values.iter_mut().enumerate().filter_map(of_text).collect();
        }
    }
}

/// Returns the time between two clock times in s.
pub(crate) fn seconds_between(ns: i64, from: i64) -> f64 {
    // The number of ns is exact below 2^53, which is about a hundred days.
    i128::from(ns).saturating_sub(i128::from(from)) as f64 / NS_PER_S as f64
}

/// Returns the number of days from 1 January 1970 to a date, whose year comes first or last; `None` for other text.
/// With points the day comes first, with slashes the month or the day. A date that precedes a time may have a year of
/// two digits at its end, or no marks, as in `20240305`.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "numbers of at most five digits, in 64 bits"
)]
fn days_of(date: &str, precedes_time: bool) -> Option<i64> {
    if precedes_time && date.len() == 8 && date.bytes().all(|byte| byte.is_ascii_digit()) {
        let (year, rest) = date.split_at_checked(4)?;
        let (month, day) = rest.split_at_checked(2)?;
        return days_of(&format!("{year}-{month}-{day}"), true);
    }
    let mark = date.chars().find(|c| ['-', '/', '.'].contains(c))?;
    let parts: Vec<&str> = date.split(mark).collect();
    let &[a, b, c] = parts.as_slice() else { return None };
    let number = |text: &str| text.parse::<u16>().ok().map(i64::from).or_else(|| month_of(text));
    let (year, month, day) = match mark {
        '.' => (c, b, a),
        _ if a.len() != 4 && month_of(b).is_some() => (c, b, a),
        _ if a.len() == 4 => (a, b, c),
        // Otherwise the month or the day comes first. Which of them is unknown, but has no effect within one day.
        _ => (c, a, b),
    };
    let century = match year.len() {
        4 => 0,
        2 if precedes_time && mark != '-' => 2000,
        _ => return None,
    };
    let (year, month, day) = (century + number(year)?, number(month)?, number(day)?);
    // With slashes the day comes first if the month would exceed 12.
    let (month, day) = if mark == '/' && month > 12 {
        (day, month)
    } else {
        (month, day)
    };
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    let (year, month) = if month > 2 {
        (year, month - 3)
    } else {
        (year - 1, month + 9)
    };
    let of_years = 365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    // There are 719 468 days from 1 March of the year 0 to 1 January 1970.
    Some(of_years + (153 * month + 2) / 5 + day - 1 - 719_468)
}

/// English names of the months and of the days of the week.
const MONTHS: [&str; 12] = [
    "january",
    "february",
    "march",
    "april",
    "may",
    "june",
    "july",
    "august",
    "september",
    "october",
    "november",
    "december",
];
const DAY_NAMES: [&str; 7] = [
    "monday",
    "tuesday",
    "wednesday",
    "thursday",
    "friday",
    "saturday",
    "sunday",
];

/// True if the text is a name or the first three letters of a name.
fn is_name(text: &str, name: &str) -> bool {
    text.eq_ignore_ascii_case(name) || name.get(..3).is_some_and(|start| text.eq_ignore_ascii_case(start))
}

/// Returns the number of a month from its English name or the first three letters of the name.
fn month_of(text: &str) -> Option<i64> {
    let mut months = (1..).zip(MONTHS);
    months.find(|(_, month)| is_name(text, month)).map(|(number, _)| number)
}

/// Parses a time of day such as `10:11:12.5` or `10:11:12:500`, optionally followed by `Z`, `+02:00`, AM or PM, or
/// minutes and seconds such as `11:12.5`; returns the number of ns since midnight UTC or the full hour, the number of
/// decimals of the seconds, and the number of ns after which the clock returns to zero.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "numbers of at most three digits and a fraction of 1e9 ns, in 64 bits"
)]
fn parse_time_of_day(text: &str) -> Option<(i64, usize, i64)> {
    let (text, half_day) = match text.rsplit_once(' ') {
        Some((text, half)) if half.eq_ignore_ascii_case("pm") => (text, Some(12)),
        Some((text, half)) if half.eq_ignore_ascii_case("am") => (text, Some(0)),
        _ => (text, None),
    };
    let (clock, zone_min) = match text.find(['Z', 'z', '+', '-']) {
        None => (text, 0),
        Some(at) => (text[..at].trim_end(), parse_zone(&text[at..])?),
    };
    let parts: Vec<&str> = clock.split(':').collect();
    let has_fraction = |seconds: &str| seconds.contains(['.', ',']);
    let (hour, minute, seconds, ms) = match parts.as_slice() {
        // Spreadsheets show a short time as minutes and seconds.
        [minute, seconds] if has_fraction(seconds) => ("0", *minute, *seconds, ""),
        [hour, minute] => (*hour, *minute, "0", ""),
        [hour, minute, seconds] => (*hour, *minute, *seconds, ""),
        [hour, minute, seconds, ms] if ms.len() == 3 && !has_fraction(seconds) => (*hour, *minute, *seconds, *ms),
        _ => return None,
    };
    let cycle = match parts.as_slice() {
        [_, seconds] if has_fraction(seconds) => HOUR_NS,
        _ => DAY_NS,
    };
    let whole = |text: &str, below: i64| text.parse::<u8>().ok().map(i64::from).filter(|n| *n < below);
    let hour = match half_day {
        Some(half) => whole(hour, 13)? % 12 + half,
        None => whole(hour, 24)?,
    };
    let (second, fraction) = seconds.split_once(['.', ',']).unwrap_or((seconds, ms));
    if fraction.len() > 18 || !fraction.bytes().all(|digit| digit.is_ascii_digit()) {
        return None;
    }
    let ns = format!("{fraction:0<9}")[..9].parse::<i64>().ok()?;
    // A leap second counts as the first second of the next minute.
    let s = (hour * 60 + whole(minute, 60)? - zone_min) * 60 + whole(second, 61)?;
    Some((s * NS_PER_S + ns, fraction.len(), cycle))
}

/// Returns the offset in minutes east of UTC from `Z`, `+02:00`, `-0530` or `+02`.
#[expect(
    clippy::arithmetic_side_effects,
    reason = "numbers of at most three digits, in 64 bits"
)]
fn parse_zone(text: &str) -> Option<i64> {
    if text.eq_ignore_ascii_case("z") {
        return Some(0);
    }
    let sign = if text.starts_with('-') { -1 } else { 1 };
    let digits: String = text[1..].chars().filter(|c| *c != ':').collect();
    let number = |text: &str| text.parse::<u8>().ok().map(i64::from);
    let minutes = match digits.len() {
        2 => number(&digits)? * 60,
        4 if digits.is_ascii() => number(&digits[..2])? * 60 + number(&digits[2..])?,
        _ => return None,
    };
    Some(sign * minutes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clock_times_match_unix_time() {
        // Result of `date -u -d '2024-03-05 10:11:12' +%s`.
        let s = 1_709_633_472 * NS_PER_S;
        for (cell, ns) in [
            ("2024-03-05T10:11:12Z", s),
            ("2024-03-05T10:11:12.020Z", s + 20_000_000),
            ("2024-03-05 12:11:12.020+02:00", s + 20_000_000),
            ("2024-03-05T04:41:12-0530", s),
            ("05.03.2024 10:11:12,5", s + NS_PER_S / 2),
            ("3/5/2024 10:11:12 AM", s),
            ("25/12/2023 10:11:12 PM", 1_703_542_272 * NS_PER_S),
            ("1970-01-01", 0),
            ("1969-12-31 23:59:59", -NS_PER_S),
            ("2000-02-29T00:00:00", 951_782_400 * NS_PER_S),
            ("10:11:12.000000001", 36_672 * NS_PER_S + 1),
            ("00:00", 0),
            ("05-Mar-2024 10:11:12.5", s + NS_PER_S / 2),
            ("2024-03-05_10:11:12", s),
            ("10:11:12:500", 36_672 * NS_PER_S + NS_PER_S / 2),
            ("10:11:12 PM", 79_872 * NS_PER_S),
            ("11:12.5", 672 * NS_PER_S + NS_PER_S / 2),
            ("0.01 sec", 10_000_000),
            ("1.5 min", 90 * NS_PER_S),
            ("20 ms", 20_000_000),
            ("1 days 00:00:00.010000", DAY_NS + 10_000_000),
            ("2 days", 2 * DAY_NS),
            ("1 day, 0:00:01", DAY_NS + NS_PER_S),
            ("03/05/24 10:11:12.000", s),
            ("25/12/23 22:11:12", 1_703_542_272 * NS_PER_S),
            ("05.03.24 10:11:12", s),
            ("2024-03-05 10:11:12 UTC", s),
            ("2024-03-05 10:11:12.500 CEST", s + NS_PER_S / 2),
            ("05 Mar 2024 10:11:12.000", s),
            ("Tue Mar 05 10:11:12.020 2024", s + 20_000_000),
            ("Tue Mar  5 10:11:12 UTC 2024", s),
            ("Tuesday, March 05, 2024 10:11:12 AM", s),
            ("Tue, 05 Mar 2024 12:11:12 +0200", s),
            ("20240305T101112.000Z", s),
            ("20240305_101112,5", s + NS_PER_S / 2),
            ("05.03.2024 10.11.12.020", s + 20_000_000),
            ("10.11.12,020", 36_672 * NS_PER_S + 20_000_000),
        ] {
            assert_eq!(parse(cell).map(|moment| moment.ns), Some(ns), "{cell}");
        }
        assert_eq!(
            parse("10:11:12.020").map(|moment| moment.precision.unit(0.0)),
            Some(1e-3)
        );
        assert_eq!(parse("20 ms").map(|moment| moment.precision.unit(0.0)), Some(1e-3));
    }

    #[test]
    fn other_text_is_not_a_clock_time() {
        for cell in [
            "",
            "abc",
            "1.5",
            "1.5.",
            "12",
            "2024-13-01",
            "2024-00-10",
            "24:00:00",
            "10:61",
            "1:2:3:4",
            "1:2:3.5:400",
            "05-Mai-2024",
            "5 deg",
            "1e300 s",
            "5 days 11:12.5",
            "x days",
            "10:11:1é",
            "2024-03-05T",
            "2024-03-05Tx",
            "99999-01-01",
            "10:11:12+é",
            "10:11:12.5x",
            "1-2-3",
            "1,234",
            "10.11.12",
            "24-03-05 10:11:12",
            "May 5",
            "May 10:11:12",
            "Marx 5 2024 10:11:12",
            "20240305",
            "1.234.567,5",
            "3/5/24",
        ] {
            assert_eq!(parse(cell), None, "{cell}");
        }
    }

    /// Pushes cells to a column and returns its values.
    fn column(cells: &[&str]) -> Vec<f64> {
        let mut column = Column::default();
        let mut moments = ClockTimes::default();
        cells.iter().for_each(|cell| moments.push(&mut column, cell));
        column.values
    }

    #[test]
    fn clock_times_continue_past_midnight() {
        assert_eq!(column(&["23:59:59.5", "00:00:00.0", "00:00:00.5"]), [0.0, 0.5, 1.0]);
        assert_eq!(column(&["11:59:59 PM", "12:00:00 AM"]), [0.0, 1.0]);
        assert_eq!(
            column(&["59:59.5", "00:00.0", "59:59.5", "00:00.0"]),
            [0.0, 0.5, 3600.0, 3600.5]
        );
        // No period is added for a time that restarts with each trial, a clock that is set back, or a date.
        assert_eq!(column(&["00:00:30", "00:00:00", "00:00:01"]), [0.0, -30.0, -29.0]);
        assert_eq!(column(&["12:00:00", "11:59:59"]), [0.0, -1.0]);
        assert_eq!(
            column(&["2024-03-05 23:59:59", "2024-03-05 00:00:00"]),
            [0.0, -86_399.0]
        );
    }
}
