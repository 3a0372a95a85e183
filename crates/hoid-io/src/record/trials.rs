//! Trials in one file, distinguished by a column that numbers them, by a time that restarts, or by the elements of an
//! array of structures.
//!
//! Each trial becomes a separate record with its own initial states; in a single record of all trials, the output after
//! each boundary would depend on inputs that never preceded it. A trial starts where the value of the given column
//! changes or where t decreases. Without `--trial`, trials are recognised only where t decreases: each trial must have
//! at least [`MIN_TRIAL_ROWS`] rows, and t must decrease by at least half of its range in the previous trial, which a
//! clock correction never does. If a column changes exactly where t decreases, the trials have the names in this
//! column.

use std::ops::Range;

use super::read_options::TrialChoice;
use crate::IoError;
use crate::formats::arrays::Contents;
use crate::table::{Column, ColumnOption, Table, keep_rows};
use crate::time::sampling::pairs;
use crate::wording::{abbreviate, did_you_mean, list_names};

/// Minimum number of rows of a trial that is recognised automatically.
pub(super) const MIN_TRIAL_ROWS: usize = 8;

/// Names and rows of the trials found.
type NamedRanges = Vec<(String, Range<usize>)>;

/// Returns the requested trial of a table, or the table itself if it contains a single trial.
pub(crate) fn select_trial<'a>(table: Table<'a>, choice: Option<&TrialChoice>) -> Result<Table<'a>, IoError> {
    let file = || table.source.file().to_owned();
    let (by, parts) = match choice {
        Some(choice) => (choice.column.clone(), split_by(&table, choice)?),
        None => match split_at_restarts(&table) {
            Some(found) => found,
            None => return Ok(table),
        },
    };
    let names: Vec<&str> = parts.iter().map(|(name, _)| name.as_str()).collect();
    let rows = match choice.and_then(|choice| choice.value.as_deref()) {
        Some(value) => match parts.iter().find(|(name, _)| name == value) {
            Some((_, rows)) => rows.clone(),
            None => {
                return Err(IoError::NoSuchTrial {
                    file: file(),
                    requested: format!("{by}={value}"),
                    available: list_names(&names),
                });
            }
        },
        None => match parts.as_slice() {
            [(_, rows)] => rows.clone(),
            [] => return Err(IoError::NoRows { file: file() }),
            _ => return Err(several_trials_error(file(), &by, names)),
        },
    };
    Ok(keep_rows(table, rows.collect()))
}

fn several_trials_error(file: String, by: &str, names: Vec<&str>) -> IoError {
    IoError::SeveralTrials {
        file,
        trial_column: by.to_owned(),
        trials: names.into_iter().map(str::to_owned).collect(),
    }
}

/// Returns the rows at which t decreases and a trial may start. A few rows with a wrong time are not a trial: t resumes
/// within fewer than [`MIN_TRIAL_ROWS`] rows, or only the time in the row before was too late.
fn rows_with_decreasing_time(table: &Table<'_>) -> Vec<usize> {
    let time = table.columns.iter().find(|column| column.name == "t");
    let values = time.map_or(&[][..], |t| &t.values);
    let is_restart = |(row, (before, t)): &(usize, (f64, f64))| {
        let mut next = values.iter().skip(*row).take(MIN_TRIAL_ROWS);
        let last_but_one = row.checked_sub(2).and_then(|row| values.get(row));
        t < before && !next.any(|next| next > before) && !last_but_one.is_some_and(|last| t > last)
    };
    let pairs = (1..).zip(pairs(values)).filter(is_restart);
    pairs.map(|(row, _)| row).collect()
}

/// Returns the row range of each trial; `begins` are the first rows of all trials except the first.
fn trial_ranges(begins: &[usize], rows: usize) -> Vec<Range<usize>> {
    let from = std::iter::once(0).chain(begins.iter().copied());
    let to = begins.iter().copied().chain([rows]);
    from.zip(to).map(|(from, to)| from..to).collect()
}

/// Returns the contents of a cell; `None` if the cell is empty.
fn cell(table: &Table<'_>, at: usize, row: usize) -> Option<String> {
    let column = table.columns.get(at)?;
    if let Some(value) = column.values.get(row).filter(|value| value.is_finite()) {
        return Some(value.to_string());
    }
    let is_text = column.texts.binary_search(&row).is_ok();
    is_text.then(|| table.source.cell(row, at))
}

/// Divides a table into trials by a column and by t, or only by t.
fn split_by(table: &Table<'_>, choice: &TrialChoice) -> Result<NamedRanges, IoError> {
    let mut begins = rows_with_decreasing_time(table);
    if choice.column == "t" {
        return Ok(number_trials(trial_ranges(&begins, table.rows)));
    }
    let names = table.names();
    let Some(at) = names.iter().position(|name| *name == choice.column) else {
        return Err(IoError::NoSuchColumn {
            file: table.source.file().to_owned(),
            missing: format!("\"{}\"", choice.column),
            suggestion: did_you_mean(&[&choice.column], &names).into_boxed_str(),
            requested: choice.to_string(),
            available: list_names(&names),
            option: ColumnOption::Trial,
        });
    };
    let labels: Vec<Option<String>> = (0..table.rows).map(|row| cell(table, at, row)).collect();
    let pairs = (1..).zip(labels.iter().zip(labels.iter().skip(1)));
    begins.extend(pairs.filter(|(_, (before, label))| before != label).map(|(row, _)| row));
    begins.sort_unstable();
    begins.dedup();
    Ok(name_trials(trial_ranges(&begins, table.rows), |row| {
        labels.get(row).cloned().flatten()
    }))
}

/// Numbers the trials; their numbers are their names.
fn number_trials(parts: Vec<Range<usize>>) -> NamedRanges {
    let counted = (1_usize..).zip(parts);
    counted.map(|(number, rows)| (number.to_string(), rows)).collect()
}

/// Names each trial by the value of the column in its first row and omits trials without a value; a number is appended
/// to repeated values.
fn name_trials(parts: Vec<Range<usize>>, label: impl Fn(usize) -> Option<String>) -> NamedRanges {
    let mut found: Vec<(String, usize, Range<usize>)> = Vec::new();
    for rows in parts {
        let Some(value) = label(rows.start) else { continue };
        let before = found.iter().filter(|(known, ..)| *known == value).count();
        found.push((value, before, rows));
    }
    let name = |(value, before, rows): (String, usize, _)| match before {
        0 => (value, rows),
        before => (format!("{value} ({})", before.saturating_add(1)), rows),
    };
    found.into_iter().map(name).collect()
}

/// Returns the name of the column that names the trials, or `t` if no column does, and the trials between restarts of
/// t; `None` if t does not restart.
fn split_at_restarts(table: &Table<'_>) -> Option<(String, NamedRanges)> {
    let begins = rows_with_decreasing_time(table);
    let time = table.columns.iter().position(|column| column.name == "t")?;
    let t = |row: usize| table.value(time, row);
    let parts = trial_ranges(&begins, table.rows);
    let starts_again = parts.iter().zip(parts.iter().skip(1)).all(|(part, next)| {
        let (first, last) = (t(part.start), t(part.end.saturating_sub(1)));
        last - t(next.start) >= 0.5 * (last - first)
    });
    if begins.is_empty() || !starts_again || parts.iter().any(|rows| rows.len() < MIN_TRIAL_ROWS) {
        return None;
    }
    let counts = |at: usize| {
        let same = |rows: &Range<usize>| {
            let first = cell(table, at, rows.start);
            first.is_some() && rows.clone().all(|row| cell(table, at, row) == first)
        };
        let steps = |row: &usize| cell(table, at, *row) != cell(table, at, row.saturating_sub(1));
        // The rows at which t decreases are compared first because they are few.
        begins.iter().all(steps) && parts.iter().all(same)
    };
    let is_named = |column: &Column| !column.name.is_empty() && column.name != "t";
    let mut columns = table.columns.iter().enumerate();
    Some(match columns.find(|(at, column)| is_named(column) && counts(*at)) {
        Some((at, column)) => (column.name.clone(), name_trials(parts, |row| cell(table, at, row))),
        None => (String::from("t"), number_trials(parts)),
    })
}

/// Selects a trial from an array of structures, such as `trial(3).e`; the second value is true if a trial was selected
/// or the array was requested; the rows then need not be divided into trials.
pub(crate) fn select_trial_in_contents(
    mut contents: Contents,
    choice: Option<&TrialChoice>,
    file: &str,
) -> Result<(Contents, bool), IoError> {
    // Returns the name of an array of structures and the index of a structure in it.
    let element = |parent: &str| -> Option<(String, String)> {
        let (array, rest) = parent.split_once('(')?;
        let (number, _) = rest.split_once(')')?;
        number
            .parse::<usize>()
            .ok()
            .map(|_| (array.to_owned(), number.to_owned()))
    };
    let elements: Vec<Option<(String, String)>> = contents.entries.iter().map(|entry| element(&entry.parent)).collect();
    let asked = choice.map(|choice| choice.column.as_str());
    let array = match elements.first() {
        Some(Some((array, _)))
            if asked.is_none() && elements.iter().all(|e| e.as_ref().is_some_and(|e| e.0 == *array)) =>
        {
            array.clone()
        }
        _ => match asked.filter(|asked| elements.iter().flatten().any(|(array, _)| array == asked)) {
            Some(asked) => asked.to_owned(),
            None => return Ok((contents, false)),
        },
    };
    let mut numbers: Vec<&str> = Vec::new();
    for (_, number) in elements.iter().flatten().filter(|(of, _)| *of == array) {
        if !numbers.contains(&number.as_str()) {
            numbers.push(number);
        }
    }
    let number = match choice.and_then(|choice| choice.value.as_deref()) {
        Some(value) if numbers.contains(&value) => value.to_owned(),
        Some(value) => {
            return Err(IoError::NoSuchTrial {
                file: file.to_owned(),
                requested: abbreviate(&format!("{array}={value}")),
                available: list_names(&numbers),
            });
        }
        // An array with a single element needs no choice.
        None if numbers.len() < 2 => return Ok((contents, asked.is_some())),
        None => return Err(several_trials_error(file.to_owned(), &array, numbers)),
    };
    let mut at = elements.iter();
    contents.entries.retain(|_| match at.next() {
        Some(Some((of, this))) => *of != array || *this == number,
        _ => true,
    });
    Ok((contents, true))
}
