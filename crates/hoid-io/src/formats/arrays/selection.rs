//! Selection of the columns of a record from all arrays of a file.
//!
//! A name is a path (`data.run(3).e`), or the end of a path if no other path has this end (`run(3).e`, or `e`); a path
//! equal to the name takes precedence. `run(1).e` also matches `run.e` if `run` has a single element. The time is `t`,
//! or `time`, in the structure of the output or in the nearest enclosing structure. The other arrays in the structure
//! of the output become channels if they have the same length.

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

    fn place(&self, row: usize) -> String {
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
    let neighbour = (used.last())
        .and_then(|at| named.columns.get(*at))
        .map_or("", |(_, column_path)| column_path.parent.as_str());
    let mut columns: Vec<(String, &ColumnPath, Numbers)> = Vec::new();
    let mut shared = None;
    for (name, column_path) in used.iter().filter_map(|at| named.columns.get(*at)) {
        let mut numbers = column_path
            .numbers()
            .ok_or_else(|| column_path.not_numeric_error(file))?
            .clone();
        if contents.own_clocks && column_path.parent != neighbour {
            let aligned = clocks::align_column(&column_paths, column_path, neighbour, file)?;
            notes.push(aligned.note);
            numbers = aligned.numbers;
            shared = Some(common_rows(shared, aligned.rows));
        }
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
        && let Some(time) = time_of_same_group(&column_paths, neighbour, rows)
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
        match column_path.numbers().filter(|numbers| numbers.len() == rows && !known) {
            Some(numbers) => columns.push((column_path.name().to_owned(), column_path, numbers.clone())),
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
        moments: column_path.unit == CLOCK_TIME_UNIT,
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
        for expression in expressions {
            let mut ambiguous = None;
            for name in expression.terms() {
                if paths.contains(&name) {
                    continue;
                }
                match paths_ending_in(column_paths, name).as_slice() {
                    [one] => aliases.push((name.to_owned(), *one)),
                    [] => {}
                    several => {
                        let paths: Vec<&str> = several.iter().map(|one| one.path.as_str()).collect();
                        ambiguous = Some((name, paths));
                    }
                }
            }
            if let Some((name, paths)) = ambiguous {
                return Err(IoError::AmbiguousColumn {
                    file: file.to_owned(),
                    asked: abbreviate(name),
                    found: list_names(&paths),
                });
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

/// Returns the columns whose paths end in a name, compared part by part.
fn paths_ending_in<'a>(column_paths: &'a [ColumnPath], name: &str) -> Vec<&'a ColumnPath> {
    let ending = |name: &str| -> Vec<&'a ColumnPath> {
        let ends = |column_path: &&ColumnPath| {
            (column_path.path.strip_suffix(name)).is_some_and(|before| before.is_empty() || before.ends_with('.'))
        };
        column_paths.iter().filter(ends).collect()
    };
    let found = ending(name);
    // A structure with a single element has no index in its path.
    if found.is_empty() && name.contains("(1)") {
        ending(&name.replace("(1)", ""))
    } else {
        found
    }
}

/// Returns the time column with `rows` values in the structure of the output or in the nearest enclosing structure.
fn time_of_same_group<'a>(column_paths: &'a [ColumnPath], neighbour: &str, rows: usize) -> Option<&'a ColumnPath> {
    let mut place = neighbour;
    loop {
        let time = |name: &&str| {
            let is_time = |column_path: &&ColumnPath| column_path.parent == place && column_path.name() == *name;
            column_paths
                .iter()
                .filter(is_time)
                .find(|column_path| column_path.numbers().is_some_and(|numbers| numbers.len() == rows))
        };
        let found = TIME_NAMES.iter().find_map(time);
        if found.is_some() || place.is_empty() {
            return found;
        }
        place = parent(place);
    }
}
