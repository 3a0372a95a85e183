//! The columns of a record among all arrays of a file.
//!
//! A name is a path (`data.run(3).e`), or its end where only one path ends so (`run(3).e`, or `e`); a path that is the name
//! wins. `run(1).e` also finds the only element `run.e`. The time is `t`, or `time`, beside the output or in the next structure
//! around it. The other arrays beside the output become channels where they are as long.

use std::ops::Range;

use super::clocks;
use super::leaves::{Holds, Leaf, parent};
use super::{Contents, Numbers};
use crate::column_expression::{Signal, list};
use crate::output_table::{ColumnValues, OutputColumn, OutputTable};
use crate::table::{Column, Precision, Source, Table, asides, shown};
use crate::{ColumnExpression, IoError, ReadOptions};

/// The names of the time, the first that is there.
pub(crate) const TIMES: [&str; 2] = ["t", "time"];

/// More columns than this are not the channels of a record; the others are left out.
const MOST_COLUMNS: usize = 1024;

/// Where the rows of a table came from.
struct ArraySource<'a> {
    file: &'a str,
    columns: Vec<Numbers>,
}

impl Source for ArraySource<'_> {
    fn file(&self) -> &str {
        self.file
    }

    fn place(&self, row: usize) -> String {
        format!("row {}", row + 1)
    }

    fn cell(&self, row: usize, column: usize) -> String {
        self.columns
            .get(column)
            .map_or_else(String::new, |numbers| numbers.value(row).to_string())
    }
}

/// The table that the options ask for.
pub(crate) fn table_of<'a>(contents: Contents, options: &ReadOptions, file: &'a str) -> Result<Table<'a>, IoError> {
    let leaves = contents.leaves();
    let expressions: Vec<&ColumnExpression> = options.input.iter().chain([&options.output]).collect();
    let named = Named::of(&leaves, &expressions, file)?;
    // Input first, output last.
    let mut used: Vec<usize> = Vec::new();
    for expression in &expressions {
        let terms = match expression.resolve(&named.names(), file)? {
            Signal::Column(a) | Signal::Negative(a) => vec![a],
            Signal::Difference(a, b) => vec![a, b],
        };
        used.extend(terms);
    }
    let mut notes = contents.notes;
    let beside = used.last().map_or("", |at| named.columns[*at].1.parent.as_str());
    let mut columns: Vec<(String, &Leaf, Numbers)> = Vec::new();
    let mut shared = None;
    for &at in &used {
        let (name, leaf) = &named.columns[at];
        let mut numbers = leaf.numbers().ok_or_else(|| no_numbers(leaf, file))?.clone();
        if contents.own_clocks && leaf.parent != beside {
            let aligned = clocks::aligned(&leaves, leaf, beside, file)?;
            notes.push(aligned.note);
            numbers = aligned.numbers;
            shared = Some(common(shared, aligned.rows));
        }
        if let Some((first, _, rows)) = columns.first().filter(|(_, _, rows)| rows.len() != numbers.len()) {
            return Err(IoError::UnequalColumns {
                file: file.to_owned(),
                column: shown(name),
                found: numbers.len(),
                other: shown(first),
                expected: rows.len(),
            });
        }
        if !columns.iter().any(|(known, ..)| known == name) {
            columns.push((name.clone(), leaf, numbers));
        }
    }
    let rows = columns.first().map_or(0, |(.., numbers)| numbers.len());
    if rows == 0 {
        return Err(IoError::NoRows { file: file.to_owned() });
    }
    if !columns.iter().any(|(name, ..)| name == "t")
        && let Some(time) = time_beside(&leaves, beside, rows)
    {
        if time.name() != "t" {
            notes.push(format!("{} is taken as t", shown(&time.path)));
        }
        columns.extend(time.numbers().map(|numbers| (String::from("t"), time, numbers.clone())));
    }
    let mut left_out = Vec::new();
    for leaf in leaves.iter().filter(|leaf| leaf.parent == beside) {
        if columns.len() == MOST_COLUMNS {
            left_out.push(leaf.path.as_str());
            continue;
        }
        let known = columns
            .iter()
            .any(|(name, used, _)| used.path == leaf.path || name == leaf.name());
        match leaf.numbers().filter(|numbers| numbers.len() == rows && !known) {
            Some(numbers) => columns.push((leaf.name().to_owned(), leaf, numbers.clone())),
            None if !columns.iter().any(|(_, used, _)| used.path == leaf.path) => left_out.push(leaf.path.as_str()),
            None => {}
        }
    }
    if !left_out.is_empty() {
        notes.push(format!(
            "left out, for they are no columns of {rows} numbers: {}",
            list(&left_out)
        ));
    }
    // Where other streams have samples as well.
    let rows = shared.unwrap_or(0..rows);
    if rows.is_empty() {
        return Err(IoError::NoOverlap { file: file.to_owned() });
    }
    for (.., numbers) in &mut columns {
        *numbers = numbers.line(rows.start, 1, rows.len());
    }
    let mut read: Vec<Column> = columns
        .iter()
        .map(|(name, leaf, numbers)| column(name, leaf, numbers))
        .collect();
    let sample_time_s = asides(contents.comments.iter().map(String::as_str), &mut read);
    let columns = columns.iter().map(|(.., numbers)| numbers.clone()).collect();
    Ok(Table {
        columns: read,
        rows: rows.len(),
        sample_time_s,
        source: Box::new(ArraySource { file, columns }),
        notes,
    })
}

fn common(known: Option<Range<usize>>, rows: Range<usize>) -> Range<usize> {
    match known {
        Some(known) => known.start.max(rows.start)..known.end.min(rows.end),
        None => rows,
    }
}

fn column(name: &str, leaf: &Leaf, numbers: &Numbers) -> Column {
    let single = numbers.kind().is_single();
    Column {
        name: name.to_owned(),
        unit: leaf.unit.clone(),
        values: numbers.values(),
        texts: Vec::new(),
        precision: if single {
            Precision::single()
        } else {
            Precision::default()
        },
    }
}

/// Columns by the names that expressions may use.
struct Named<'a> {
    /// The paths, then the names that stand for one of them.
    columns: Vec<(String, &'a Leaf)>,
}

impl<'a> Named<'a> {
    fn of(leaves: &'a [Leaf], expressions: &[&ColumnExpression], file: &str) -> Result<Self, IoError> {
        let paths: Vec<&str> = leaves.iter().map(|leaf| leaf.path.as_str()).collect();
        let mut aliases: Vec<(String, &Leaf)> = Vec::new();
        for expression in expressions {
            let mut ambiguous = None;
            for name in expression.terms() {
                let found = match paths.iter().position(|path| *path == name) {
                    Some(at) => vec![at],
                    None => ends(&paths, name),
                };
                match found.as_slice() {
                    [at] => aliases.extend((paths[*at] != name).then(|| (name.to_owned(), &leaves[*at]))),
                    [] => {}
                    several => ambiguous = Some((name, several.iter().map(|at| paths[*at]).collect::<Vec<_>>())),
                }
            }
            if let Some((name, paths)) = ambiguous {
                return Err(IoError::AmbiguousColumn {
                    file: file.to_owned(),
                    asked: shown(name),
                    found: list(&paths),
                });
            }
        }
        let paths = leaves.iter().map(|leaf| (leaf.path.clone(), leaf));
        Ok(Self {
            columns: paths.chain(aliases).collect(),
        })
    }

    fn names(&self) -> Vec<&str> {
        self.columns.iter().map(|(name, _)| name.as_str()).collect()
    }
}

/// The paths that end in a name, part by part.
fn ends(paths: &[&str], name: &str) -> Vec<usize> {
    let ending = |name: &str| -> Vec<usize> {
        let ends = |path: &str| {
            path.strip_suffix(name)
                .is_some_and(|before| before.is_empty() || before.ends_with('.'))
        };
        (0..paths.len()).filter(|at| ends(paths[*at])).collect()
    };
    let found = ending(name);
    // The first of one.
    if found.is_empty() && name.contains("(1)") {
        ending(&name.replace("(1)", ""))
    } else {
        found
    }
}

/// The time in the structure of the output, or in the next around it, that is as long.
fn time_beside<'a>(leaves: &'a [Leaf], beside: &str, rows: usize) -> Option<&'a Leaf> {
    let mut place = beside;
    loop {
        let time = |name: &&str| {
            let is_time = |leaf: &&Leaf| leaf.parent == place && leaf.name() == *name;
            leaves
                .iter()
                .filter(is_time)
                .find(|leaf| leaf.numbers().is_some_and(|numbers| numbers.len() == rows))
        };
        let found = TIMES.iter().find_map(time);
        if found.is_some() || place.is_empty() {
            return found;
        }
        place = parent(place);
    }
}

fn no_numbers(leaf: &Leaf, file: &str) -> IoError {
    IoError::Unsupported {
        file: file.to_owned(),
        found: format!("{} holds {}", shown(&leaf.path), leaf.what()),
        remedy: "save the column as an array of real numbers",
    }
}

/// All columns, for a table of results.
pub(crate) fn output_table_of(contents: Contents, file: &str) -> Result<OutputTable, IoError> {
    let mut columns: Vec<OutputColumn> = Vec::new();
    for leaf in contents.leaves() {
        let error = || no_numbers(&leaf, file);
        let values = match &leaf.holds {
            Holds::Texts(texts) => ColumnValues::Text(texts.clone()),
            Holds::Unread(_) => return Err(error()),
            Holds::Numbers(numbers) => match numbers.counts() {
                Some(counts) if numbers.kind().is_whole() => ColumnValues::Whole(counts),
                _ => ColumnValues::Real(numbers.values()),
            },
        };
        if let Some(first) = columns.first().filter(|first| first.values.len() != values.len()) {
            return Err(IoError::UnequalColumns {
                file: file.to_owned(),
                column: shown(&leaf.path),
                found: values.len(),
                other: shown(&first.name),
                expected: first.values.len(),
            });
        }
        columns.push(OutputColumn {
            name: leaf.path,
            values,
        });
    }
    Ok(OutputTable {
        comments: contents.comments,
        columns,
    })
}
