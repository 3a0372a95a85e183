//! Selection of the columns of a record from all arrays of a file.
//!
//! A name is a path (`data.run(3).e`), or the end of a path if no other path has this end (`run(3).e`, or `e`); a path
//! equal to the name takes precedence. `run(1).e` also matches `run.e` if `run` has a single element. The time is named
//! in the same way, or it is `t`, or `time`, in the structure of the output or in the nearest enclosing structure. The
//! other arrays in the structure of the output become channels if they have the same length. Columns whose own times
//! differ from the times of the record are interpolated to these ([`clocks`]).

use std::ops::Range;

use super::clocks;
use super::column_path::{ColumnPath, parent};
use super::contents::Contents;
use super::numbers::Numbers;
use crate::IoError;
use crate::record::ReadOptions;
use crate::table::{Column, ColumnExpression, Precision, Signal, Source, Table, read_comments};
use crate::time::is_time;
use crate::wording::{abbreviate, list_names};

/// Names of the time column, in order of precedence.
pub(crate) const TIME_NAMES: [&str; 2] = ["t", "time"];

/// Unit of clock times, which are converted to seconds since the first clock time.
pub(crate) const CLOCK_TIME_UNIT: &str = "s from the first";

/// Maximum number of columns of a record; further columns are omitted.
const MAX_COLUMNS: usize = 1024;

/// The arrays of a file as the source of the rows of a table, for messages.
struct ArraySource<'a> {
    file: &'a str,
    columns: Vec<Numbers>,
}

impl Source for ArraySource<'_> {
    fn file(&self) -> &str {
        self.file
    }

    fn location(&self, row: usize) -> String {
        format!("row {}", row.saturating_add(1))
    }

    fn cell(&self, row: usize, column: usize) -> String {
        self.columns
            .get(column)
            .map_or_else(String::new, |numbers| numbers.value(row).to_string())
    }
}

/// Returns the table that the options select.
pub(crate) fn table_of<'a>(contents: Contents, options: &ReadOptions, file: &'a str) -> Result<Table<'a>, IoError> {
    let column_paths = contents.column_paths();
    let expressions: Vec<&ColumnExpression> = options.input.iter().chain([&options.output]).collect();
    let named = NamedColumns::of(&column_paths, &expressions, file)?;
    // In `used`, the columns of the input are first and the columns of the output last.
    let mut used: Vec<usize> = Vec::new();
    for expression in &expressions {
        let resolved = expression.resolve(&named.names(), file).map_err(|error| {
            // If the file contains a MATLAB object, the object is assumed to hold the signals.
            let object = column_paths.iter().find(|column_path| column_path.holds_object());
            object.map_or(error, |object| object.not_numeric_error(file))
        });
        let terms = match resolved? {
            Signal::Column(a) | Signal::Negative(a) => vec![a],
            Signal::Difference(a, b) => vec![a, b],
        };
        used.extend(terms);
    }
    let mut notes = contents.notes;
    let own_times = |column_path: &ColumnPath| times_of(&column_paths, column_path);
    let paths = || {
        used.iter()
            .filter_map(|at| named.columns.get(*at))
            .map(|(_, path)| *path)
    };
    let output = paths().next_back();
    let chosen = output.map(|output| chosen_times(&column_paths, output, options, file));
    let chosen = chosen.transpose()?.unwrap_or_default();
    let is_chosen = |time: &&ColumnPath| chosen.iter().any(|(_, chosen)| chosen.path == time.path);
    // The times of the record: the chosen times if they are the own times of a column, otherwise the times of the
    // output.
    let reference = (paths().filter_map(own_times).find(is_chosen)).or_else(|| output.and_then(own_times));
    let counted = options.sampling_hz.is_some() && !options.repair.resample && !contents.own_clocks;
    let aligned = |column_path: &ColumnPath| match own_times(column_path).zip(reference) {
        Some((own, reference)) if counted && !clocks::are_equal(own, reference) => Ok((
            None,
            Some(format!(
                "the times {} of {} differ from {}: with --fs the times are ignored, and rows are matched by row \
                 number",
                abbreviate(&own.path),
                abbreviate(&column_path.path),
                abbreviate(&reference.path)
            )),
        )),
        Some((own, reference)) if !counted => {
            let aligned = clocks::align_column(column_path, own, reference, file)?;
            Ok(aligned.map_or((None, None), |found| {
                (Some((found.numbers, found.rows)), Some(found.note))
            }))
        }
        _ => Ok((None, None)),
    };
    let neighbour = output.map_or("", |output| output.parent.as_str());
    let mut columns: Vec<(String, &ColumnPath, Numbers)> = Vec::new();
    let mut shared = None;
    let signals = used.iter().filter_map(|at| named.columns.get(*at));
    for (name, column_path) in signals.chain(&chosen) {
        let own = (column_path.numbers()).ok_or_else(|| column_path.not_numeric_error(file))?;
        let (joined, note) = aligned(column_path)?;
        notes.extend(note);
        let numbers = match joined {
            Some((numbers, rows)) => {
                shared = Some(common_rows(shared, rows));
                numbers
            }
            None => own.clone(),
        };
        if let Some((first, _, rows)) = columns.first().filter(|(_, _, rows)| rows.len() != numbers.len()) {
            return Err(IoError::UnequalColumns {
                file: file.to_owned(),
                column: abbreviate(name),
                found: numbers.len(),
                other: abbreviate(first),
                expected: rows.len(),
            });
        }
        if !columns.iter().any(|(known, ..)| known == name) {
            columns.push((name.clone(), column_path, numbers));
        }
    }
    let rows = columns.first().map_or(0, |(.., numbers)| numbers.len());
    if rows == 0 {
        return Err(IoError::NoRows { file: file.to_owned() });
    }
    if !columns.iter().any(|(name, ..)| name == "t")
        && let Some(time) = reference.filter(|time| time.len() == rows && chosen.is_empty())
    {
        if time.name() != "t" {
            notes.push(format!("{} is taken as t", abbreviate(&time.path)));
        }
        columns.extend(time.numbers().map(|numbers| (String::from("t"), time, numbers.clone())));
    }
    let mut left_out = Vec::new();
    for column_path in column_paths
        .iter()
        .filter(|column_path| column_path.parent == neighbour)
    {
        if columns.len() == MAX_COLUMNS {
            left_out.push(column_path.path.as_str());
            continue;
        }
        let known = columns
            .iter()
            .any(|(name, used, _)| used.path == column_path.path || name == column_path.name());
        let own = column_path.numbers().filter(|_| !known);
        let joined = own
            .map(|_| aligned(column_path))
            .transpose()?
            .and_then(|(joined, _)| joined);
        let numbers = joined.map_or_else(|| own.cloned(), |(numbers, _)| Some(numbers));
        match numbers.filter(|numbers| numbers.len() == rows) {
            Some(numbers) => columns.push((column_path.name().to_owned(), column_path, numbers)),
            None if !columns.iter().any(|(_, used, _)| used.path == column_path.path) => {
                left_out.push(column_path.path.as_str())
            }
            None => {}
        }
    }
    if !left_out.is_empty() {
        notes.push(format!(
            "left out, because they are not columns of {rows} numbers: {}",
            list_names(&left_out)
        ));
    }
    // Only rows in which all streams have samples are kept.
    let rows = shared.unwrap_or(0..rows);
    if rows.is_empty() {
        return Err(IoError::NoOverlap { file: file.to_owned() });
    }
    for (.., numbers) in &mut columns {
        *numbers = numbers.line(rows.start, 1, rows.len());
    }
    let mut read: Vec<Column> = columns
        .iter()
        .map(|(name, column_path, numbers)| column(name, column_path, numbers))
        .collect();
    let sample_time_s = read_comments(contents.comments.iter().map(String::as_str), &mut read);
    let columns = columns.iter().map(|(.., numbers)| numbers.clone()).collect();
    Ok(Table {
        columns: read,
        rows: rows.len(),
        sample_time_s,
        source: Box::new(ArraySource { file, columns }),
        notes,
    })
}

fn common_rows(known: Option<Range<usize>>, rows: Range<usize>) -> Range<usize> {
    match known {
        Some(known) => known.start.max(rows.start)..known.end.min(rows.end),
        None => rows,
    }
}

fn column(name: &str, column_path: &ColumnPath, numbers: &Numbers) -> Column {
    let values = numbers.values();
    Column {
        name: name.to_owned(),
        unit: if column_path.unit == CLOCK_TIME_UNIT {
            String::from("s")
        } else {
            column_path.unit.clone()
        },
        role: String::new(),
        precision: if is_time(name) {
            Precision::from_times(&values, numbers.kind().is_single())
        } else {
            Precision::default()
        },
        values,
        texts: Vec::new(),
        is_clock_time: column_path.unit == CLOCK_TIME_UNIT,
        filled_rows: Vec::new(),
        is_held: false,
    }
}

/// Columns with the names that expressions may use.
struct NamedColumns<'a> {
    /// All paths, followed by the shorter names that match exactly one path.
    columns: Vec<(String, &'a ColumnPath)>,
}

impl<'a> NamedColumns<'a> {
    fn of(column_paths: &'a [ColumnPath], expressions: &[&ColumnExpression], file: &str) -> Result<Self, IoError> {
        let paths: Vec<&str> = column_paths
            .iter()
            .map(|column_path| column_path.path.as_str())
            .collect();
        let mut aliases: Vec<(String, &ColumnPath)> = Vec::new();
        for name in expressions.iter().flat_map(|expression| expression.terms()) {
            if !paths.contains(&name)
                && let Some(column_path) = path_ending_in(column_paths, name, file)?
            {
                aliases.push((name.to_owned(), column_path));
            }
        }
        let paths = column_paths
            .iter()
            .map(|column_path| (column_path.path.clone(), column_path));
        Ok(Self {
            columns: paths.chain(aliases).collect(),
        })
    }

    fn names(&self) -> Vec<&str> {
        self.columns.iter().map(|(name, _)| name.as_str()).collect()
    }
}

/// Returns the only column whose path ends in a name, compared part by part.
///
/// # Errors
/// [`IoError::AmbiguousColumn`] for several such columns.
fn path_ending_in<'a>(
    column_paths: &'a [ColumnPath],
    name: &str,
    file: &str,
) -> Result<Option<&'a ColumnPath>, IoError> {
    let ending = |name: &str| -> Vec<&'a ColumnPath> {
        let ends = |column_path: &&ColumnPath| {
            (column_path.path.strip_suffix(name)).is_some_and(|before| before.is_empty() || before.ends_with('.'))
        };
        column_paths.iter().filter(ends).collect()
    };
    let mut found = ending(name);
    // A structure with a single element has no index in its path.
    if found.is_empty() && name.contains("(1)") {
        found = ending(&name.replace("(1)", ""));
    }
    match found.as_slice() {
        [] => Ok(None),
        [one] => Ok(Some(*one)),
        several => {
            let paths: Vec<&str> = several.iter().map(|one| one.path.as_str()).collect();
            Err(IoError::AmbiguousColumn {
                file: file.to_owned(),
                requested: abbreviate(name),
                found: list_names(&paths),
            })
        }
    }
}

/// Returns the columns that `--time` names, with their names as typed; the column of nanoseconds may be named after a
/// `+`.
fn chosen_times<'a>(
    column_paths: &'a [ColumnPath],
    output: &ColumnPath,
    options: &ReadOptions,
    file: &str,
) -> Result<Vec<(String, &'a ColumnPath)>, IoError> {
    let Some(choice) = &options.time else {
        return Ok(Vec::new());
    };
    let find = |name: &str| -> Result<Option<(String, &'a ColumnPath)>, IoError> {
        let exact = column_paths.iter().find(|column_path| column_path.path == name);
        let near = exact.or_else(|| nearest(column_paths, &output.parent, &[name], output.len()));
        let found = near.map_or_else(|| path_ending_in(column_paths, name, file), |near| Ok(Some(near)));
        Ok(found?.map(|column_path| (name.to_owned(), column_path)))
    };
    let mut chosen = Vec::new();
    for names in choice.columns() {
        chosen = names
            .into_iter()
            .map(find)
            .collect::<Result<Option<Vec<_>>, _>>()?
            .unwrap_or_default();
        if !chosen.is_empty() {
            break;
        }
    }
    let names: Vec<&str> = column_paths
        .iter()
        .map(|column_path| column_path.path.as_str())
        .collect();
    match chosen.is_empty() && !choice.is_pair() {
        true => Err(choice.unknown_error(&names, file)),
        false => Ok(chosen),
    }
}

/// Returns the times of a column: the time column of the same length in its structure or in the nearest enclosing one.
fn times_of<'a>(column_paths: &'a [ColumnPath], column_path: &ColumnPath) -> Option<&'a ColumnPath> {
    nearest(column_paths, &column_path.parent, &TIME_NAMES, column_path.len())
}

/// Returns the first of the named columns with `rows` values in the structure `place` or in the nearest enclosing
/// structure.
fn nearest<'a>(column_paths: &'a [ColumnPath], mut place: &str, names: &[&str], rows: usize) -> Option<&'a ColumnPath> {
    loop {
        let named = |name: &&str| {
            let is_named = |column_path: &&ColumnPath| column_path.parent == place && column_path.name() == *name;
            column_paths
                .iter()
                .filter(is_named)
                .find(|column_path| column_path.numbers().is_some_and(|numbers| numbers.len() == rows))
        };
        let found = names.iter().find_map(named);
        if found.is_some() || place.is_empty() {
            return found;
        }
        place = parent(place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::arrays::array::Array;
    use crate::formats::arrays::contents::{Entry, Indexing, Value};

    /// Reads e and the stick signals, each structure with its own times; a third structure contains only times.
    fn read(stick_start_s: f64, change: impl Fn(&mut ReadOptions)) -> Result<Table<'static>, IoError> {
        let series = |f: &dyn Fn(f64) -> f64, start_s: f64| {
            let values: Vec<f64> = (0..20).map(|k| f(start_s + 0.1 * f64::from(k))).collect();
            Value::Array(Array::vector(Numbers::from_f64(&values)))
        };
        let entries = vec![
            Entry::field("err", "time", series(&|t| t, 0.0)),
            Entry::field("err.signals", "e", series(&|t| 3.0 * t, 0.0)),
            Entry::field("stick", "time", series(&|t| t, stick_start_s)),
            Entry::field("stick", "u", series(&|t| -t, stick_start_s)),
            Entry::field("stick", "x", series(&|t| 2.0 * t, stick_start_s)),
            Entry::field("out", "tout", series(&|t| (1000.0 * t).round(), 5.0)),
        ];
        let mut options = ReadOptions::default();
        change(&mut options);
        let choice = options.time.clone();
        let table = table_of(Contents::new(entries, Indexing::Matlab), &options, "run.mat")?;
        crate::time::with_time(table, choice.as_ref())
    }

    fn values<'a>(table: &'a Table<'_>, name: &str) -> &'a [f64] {
        &table.columns.iter().find(|column| column.name == name).unwrap().values
    }

    fn assert_near(found: &[f64], expected: impl Iterator<Item = f64>) {
        let expected: Vec<f64> = expected.collect();
        assert_eq!(found.len(), expected.len());
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
        assert!(found.iter().zip(&expected).all(is_near), "{found:?} {expected:?}");
    }

    #[test]
    fn columns_with_other_times_are_joined_by_time() {
        let same = read(0.0005, |_| ()).unwrap();
        assert_eq!((same.rows, values(&same, "e")[1]), (20, 0.1 * 3.0));
        assert!(
            !same.notes.iter().any(|note| note.contains("interpolated")),
            "{:?}",
            same.notes
        );
        // The times of the output apply, unless other times are requested.
        for time in [None, Some("stick.time"), Some("err.time")] {
            let table = read(0.53, |options| options.time = time.map(|time| time.parse().unwrap())).unwrap();
            let from = if time == Some("err.time") { 0.6 } else { 0.53 };
            let t = || (0..14).map(move |k| from + 0.1 * f64::from(k));
            assert_near(values(&table, "t"), t());
            assert_near(values(&table, "e"), t().map(|t| 3.0 * t));
            assert_near(values(&table, "u"), t().map(|t| -t));
            assert_near(values(&table, "x"), t().map(|t| 2.0 * t));
            let note = table
                .notes
                .iter()
                .find(|note| note.contains("is interpolated linearly"))
                .unwrap();
            assert!(note.contains("err.time") && note.contains("stick.time"), "{note}");
        }
        assert!(matches!(read(9.0, |_| ()), Err(IoError::NoOverlap { .. })));
        // With a given sampling frequency, the times in the file are ignored.
        let counted = read(0.53, |options| options.sampling_hz = Some(10.0)).unwrap();
        assert_eq!((counted.rows, values(&counted, "e")[1]), (20, 0.1 * 3.0));
        assert!(counted.notes[0].contains("the times err.time of err.signals.e differ from stick.time"));
    }

    #[test]
    fn times_are_selected_by_path() {
        for name in ["out.tout", "tout", "out.tout:ms"] {
            let table = read(0.0, |options| options.time = Some(name.parse().unwrap())).unwrap();
            assert_near(values(&table, "t"), (0..20).map(|k| 5.0 + 0.1 * f64::from(k)));
            assert_eq!(values(&table, "u").len(), 20);
            assert_eq!(table.notes.iter().filter(|note| note.contains("taken as t")).count(), 1);
        }
        let error = |name: &str| {
            let read = read(0.0, |options| options.time = Some(name.parse().unwrap()));
            read.map(drop).unwrap_err().to_string()
        };
        assert!(error("clock").contains("no column \"clock\"") && error("clock").contains("out.tout"));
        assert!(error("clock").contains("--time COLUMN"));
    }
}
