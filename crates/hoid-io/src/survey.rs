//! What is inside of a file, before anything is chosen: columns, their sampling and ranges, and
//! what is suspicious in them.
//!
//! Nothing is judged finally here: a channel may rightly be constant. What is suspicious is found
//! by `data_quality`, in columns that belong to one time together; a column that is constant is
//! only marked, because many files carry such.

use std::path::Path;

use crate::IoError;
use crate::arrays::{ColumnPath, Contents, Holds, TIMES};
use crate::data_quality::{
    Grid, Levels, QualityIssue, QualityIssueKind, Signal, Signals, issues_of, names_a_clock, rails,
};
use crate::format::Reading;
use crate::formats::bytes_of;
use crate::table::{Column, DECIMAL_COMMA, Precision, Table, UNITS_ROW, has_decimal_comma};
use crate::time_column::with_time;
use crate::wording::named;

/// Characters of a sketch.
const SKETCH: usize = 32;
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct FileSurvey {
    /// Its format, as in "Parquet".
    pub format: &'static str,
    /// Its columns, in their order.
    pub columns: Vec<ColumnSurvey>,
    /// The sampling of each structure with a time, one for a flat table.
    pub samplings: Vec<SamplingSurvey>,
    /// What is wrong with the sampling, structure by structure.
    pub quality_issues: Vec<QualityIssue>,
    /// What to know about how it was read.
    pub notes: Vec<String>,
}

/// One column.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnSurvey {
    /// Its name, or its path in the file.
    pub path: String,
    /// Unit; empty when unknown.
    pub unit: String,
    /// The type of its values, such as "double" or "text".
    pub kind: String,
    /// The number of its rows; 0 for what is not read.
    pub rows: usize,
    /// What its numbers are, where it holds any finite one.
    pub values: Option<ValueSurvey>,
}

/// The numbers of a column, in its unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueSurvey {
    /// Values that are missing, text or not finite.
    pub missing: usize,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// Mean.
    pub mean: f64,
    /// Root mean square deviation from the mean.
    pub deviation: f64,
    /// Whether all values are one.
    pub constant: bool,
    /// The step of a quantised column.
    pub quantum: Option<f64>,
    /// Rows in which a saturated column stands at its smallest value.
    pub saturated_low: usize,
    /// Rows in which a saturated column stands at its largest value.
    pub saturated_high: usize,
    /// The course of the values in block characters.
    pub sketch: String,
}

/// The sampling of columns that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplingSurvey {
    /// Path of the time.
    pub path: String,
    /// Number of rows.
    pub rows: usize,
    /// First and last finite time, s.
    pub span_s: (f64, f64),
    /// Sample time of the even grid behind the time, s.
    pub sample_time_s: f64,
    /// Largest deviation of a time from the even grid, s.
    pub jitter_s: f64,
    /// Places where rows are missing.
    pub gaps: usize,
    /// Rows missing in them.
    pub missing: u64,
    /// Time of the row before the first gap, s.
    pub first_gap_s: Option<f64>,
    /// Rows in which the time stands still or runs back.
    pub not_increasing: usize,
    /// Rows in which each other column that is not constant repeats the row before.
    pub repeated: usize,
}

/// A column as it was read.
struct Read {
    path: String,
    parent: String,
    name: String,
    unit: String,
    kind: String,
    values: Option<Vec<f64>>,
    rows: usize,
    precision: Precision,
}

/// Looks into a file of any format that is read.
///
/// # Errors
/// Those of reading: [`IoError`], naming the place in the file.
pub fn survey(path: &Path) -> Result<FileSurvey, IoError> {
    let file = path.display().to_string();
    let (format, mut bytes) = bytes_of(path)?;
    let (columns, notes) = match format.reading {
        Reading::Table { record, .. } => of_table(with_time(record(&mut bytes, &file)?, None)?),
        Reading::Arrays(read) => of_arrays(&read(bytes, &file)?),
    };
    let is_time = |column: &&Read| TIMES.contains(&column.name.as_str()) && column.rows > 1;
    let samplings = columns
        .iter()
        .filter(is_time)
        .filter_map(|time| sampling(time, &columns))
        .collect();
    let quality_issues = quality_issues(&columns);
    let survey = |column: Read| ColumnSurvey {
        values: column.values.as_deref().and_then(values),
        path: column.path,
        unit: column.unit,
        kind: column.kind,
        rows: column.rows,
    };
    Ok(FileSurvey {
        format: format.name,
        samplings,
        quality_issues,
        columns: columns.into_iter().map(survey).collect(),
        notes,
    })
}

fn of_table(mut table: Table<'_>) -> (Vec<Read>, Vec<String>) {
    let rows = table.rows;
    let commas = decimal_commas(&table);
    table.notes.extend(commas);
    let unusable = unusable(&table);
    table.notes.extend(unusable);
    if rows > 1 && table.has_no_number_in(0) {
        let place = table.source.place(0);
        table.notes.push(format!("{place}: {UNITS_ROW}"));
    }
    let read = |column: Column| {
        let text = column.texts.len() == rows;
        Read {
            path: column.name.clone(),
            parent: String::new(),
            name: column.name,
            unit: column.unit,
            kind: String::from(if text { "text" } else { "numbers" }),
            values: (!text).then_some(column.values),
            rows,
            precision: column.precision,
        }
    };
    (table.columns.into_iter().map(read).collect(), table.notes)
}

/// Columns of text that would be numbers with a point in the place of each comma.
fn decimal_commas(table: &Table<'_>) -> Vec<String> {
    let first_text = |(at, column): (usize, &Column)| {
        let row = *column.texts.first()?;
        let cell = table.source.cell(row, at);
        has_decimal_comma(&cell).then(|| {
            let (name, place) = (named(&column.name), table.source.place(row));
            let (count, rows) = (column.texts.len(), table.rows);
            format!("column {name}, {place}: \"{cell}\" is text, {count} of {rows} cells in all; {DECIMAL_COMMA}")
        })
    };
    table.columns.iter().enumerate().filter_map(first_text).collect()
}

/// Columns of numbers in which some cells are text, or infinite: they are refused when read, and told as they are then.
fn unusable(table: &Table<'_>) -> Vec<String> {
    let first = |(at, column): (usize, &Column)| {
        let numbers = column.values.iter().any(|value| value.is_finite());
        let row = (0..table.rows)
            .find(|row| column.values[*row].is_infinite() || column.texts.binary_search(row).is_ok())
            .filter(|row| numbers && !(*row == 0 && table.has_no_number_in(0)))?;
        let comma = has_decimal_comma(&table.source.cell(row, at));
        (!comma).then(|| table.bad_value(at, row, 0..table.rows).to_string())
    };
    table.columns.iter().enumerate().filter_map(first).collect()
}

fn of_arrays(contents: &Contents) -> (Vec<Read>, Vec<String>) {
    let column_paths = contents.column_paths();
    let read = |column_path: ColumnPath| {
        let (values, single) = match &column_path.holds {
            Holds::Numbers(numbers) => (Some(numbers.values()), numbers.kind().is_single()),
            Holds::Texts(_) | Holds::Unread(_) => (None, false),
        };
        let times = values.as_deref().filter(|_| TIMES.contains(&column_path.name()));
        Read {
            parent: column_path.parent.clone(),
            name: column_path.name().to_owned(),
            unit: column_path.unit.clone(),
            kind: column_path.what(),
            rows: column_path.len(),
            precision: times.map_or_else(Precision::default, |t| Precision::of_times(t, single)),
            values,
            path: column_path.path,
        }
    };
    (column_paths.into_iter().map(read).collect(), contents.notes.clone())
}

fn signal(column: &Read) -> Signal<'_> {
    Signal {
        name: &column.path,
        values: column.values.as_deref().unwrap_or_default(),
    }
}

/// What is wrong with the columns that stand beside each other, by structure and length.
fn quality_issues(columns: &[Read]) -> Vec<QualityIssue> {
    let mut seen: Vec<(&str, usize)> = Vec::new();
    let mut found = Vec::new();
    for column in columns.iter().filter(|column| column.rows > 1) {
        let key = (column.parent.as_str(), column.rows);
        if seen.contains(&key) {
            continue;
        }
        seen.push(key);
        let beside = || columns.iter().filter(|c| (c.parent.as_str(), c.rows) == key);
        let time = TIMES
            .iter()
            .find_map(|name| beside().find(|c| c.name == *name && c.values.is_some()));
        let is_time = |c: &Read| time.is_some_and(|time| time.path == c.path);
        let numbers = || beside().filter(|c| c.values.is_some() && !is_time(c));
        let is_clock = |c: &&Read| names_a_clock(&c.name) || TIMES.contains(&c.name.as_str());
        found.extend(issues_of(&Signals {
            columns: numbers().filter(|c| !is_clock(c)).map(signal).collect(),
            time: time.map(signal),
            precision: time.map(|c| c.precision).unwrap_or_default(),
            clocks: numbers().filter(is_clock).map(signal).collect(),
            ..Signals::default()
        }));
    }
    found.retain(|one| one.kind != QualityIssueKind::Constant);
    found
}

/// The numbers of a column; none where no value is finite.
fn values(all: &[f64]) -> Option<ValueSurvey> {
    let finite: Vec<f64> = all.iter().copied().filter(|value| value.is_finite()).collect();
    let (min, max) = finite.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), v| {
        (min.min(*v), max.max(*v))
    });
    if finite.is_empty() {
        return None;
    }
    let n = finite.len() as f64;
    // Scaled, so that no sum overflows.
    let mean = if min == max {
        min
    } else {
        finite.iter().map(|v| v / n).sum::<f64>()
    };
    let deviation = (finite.iter().map(|v| (v - mean).powi(2) / n).sum::<f64>()).sqrt();
    let constant = min == max;
    let levels = Levels::of(all);
    let found = rails(all, &levels);
    let at_rail = |upper: bool| {
        let rail = found.iter().find(|rail| rail.is_upper == upper);
        rail.map_or(0, |rail| rail.rows())
    };
    let (low, high) = (at_rail(false), at_rail(true));
    Some(ValueSurvey {
        missing: all.len() - finite.len(),
        min,
        max,
        mean,
        deviation,
        constant,
        quantum: levels.quantum().map(|(step, _)| step),
        saturated_low: low,
        saturated_high: high,
        sketch: sketch(all, min, max),
    })
}

/// Means of equal parts as bars; a blank where no value is finite.
fn sketch(all: &[f64], min: f64, max: f64) -> String {
    let parts = SKETCH.min(all.len());
    let bar = |part: usize| {
        let values = &all[part * all.len() / parts..(part + 1) * all.len() / parts];
        let (sum, count) = values
            .iter()
            .filter(|value| value.is_finite())
            .fold((0.0, 0_usize), |(sum, count), value| {
                (sum + (value / max.abs().max(min.abs()).max(1e-300)), count + 1)
            });
        if count == 0 {
            return ' ';
        }
        let scale = max.abs().max(min.abs()).max(1e-300);
        let (low, high) = (min / scale, max / scale);
        let height = if high > low {
            (sum / count as f64 - low) / (high - low)
        } else {
            0.5
        };
        BARS[((height * BARS.len() as f64) as usize).min(BARS.len() - 1)]
    };
    (0..parts).map(bar).collect()
}

/// The sampling by a time; none where it holds fewer than two finite values.
fn sampling(time: &Read, columns: &[Read]) -> Option<SamplingSurvey> {
    let t: Vec<f64> = time
        .values
        .as_ref()?
        .iter()
        .copied()
        .filter(|t| t.is_finite())
        .collect();
    let &[first, .., last] = t.as_slice() else { return None };
    let grid = Grid::of(time.values.as_ref()?);
    if !grid.sample_time_s.is_finite() {
        return None;
    }
    let all = time.values.as_ref()?;
    let beside: Vec<&Vec<f64>> = columns
        .iter()
        .filter(|column| column.parent == time.parent && column.rows == time.rows && column.path != time.path)
        .filter_map(|column| column.values.as_ref())
        .filter(|values| {
            values
                .windows(2)
                .any(|pair| pair[0] != pair[1] && !pair[0].is_nan() && !pair[1].is_nan())
        })
        .collect();
    let repeats = |row: &usize| beside.iter().all(|values| values[*row] == values[row - 1]);
    Some(SamplingSurvey {
        path: time.path.clone(),
        rows: time.rows,
        span_s: (first, last),
        sample_time_s: grid.sample_time_s,
        jitter_s: grid.jitter(all).map_or(0.0, |(_, worst, _)| worst),
        gaps: grid.gaps().count(),
        missing: grid
            .gaps()
            .map(|(_, missing)| missing as u64)
            .fold(0, u64::saturating_add),
        first_gap_s: grid.gaps().next().map(|(i, _)| all[grid.rows[i]]),
        not_increasing: t.windows(2).filter(|pair| pair[1] <= pair[0]).count(),
        repeated: if beside.is_empty() {
            0
        } else {
            (1..time.rows).filter(repeats).count()
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_their_faults() {
        let sine: Vec<f64> = (0..400).map(|k| (0.05 * f64::from(k)).sin()).collect();
        let found = values(&sine).unwrap();
        assert_eq!(
            (found.constant, found.quantum, found.saturated_low, found.saturated_high),
            (false, None, 0, 0)
        );
        assert_eq!(found.sketch.chars().count(), SKETCH);
        assert!(found.sketch.contains('█') && found.sketch.contains('▁'));
        let coarse: Vec<f64> = sine.iter().map(|v| (20.0 * v).round() / 20.0).collect();
        assert!((values(&coarse).unwrap().quantum.unwrap() - 0.05).abs() < 1e-12);
        let clipped: Vec<f64> = sine.iter().map(|v| v.min(0.8)).collect();
        let found = values(&clipped).unwrap();
        assert_eq!(found.saturated_low, 0);
        assert_eq!(found.saturated_high, clipped.iter().filter(|v| **v == 0.8).count());
        let constant = values(&[2.0; 10]).unwrap();
        assert!(constant.constant && constant.deviation == 0.0);
        let missing = values(&[1.0, f64::NAN, 3.0, f64::INFINITY]).unwrap();
        assert_eq!(
            (missing.missing, missing.mean, missing.sketch.as_str()),
            (2, 2.0, "▁ █ ")
        );
        assert_eq!(values(&[f64::NAN]), None);
        assert!(values(&[f64::MAX, f64::MIN]).is_some_and(|found| found.mean == 0.0));
    }

    #[test]
    fn time_and_its_faults() {
        let read = |name: &str, values: Vec<f64>| Read {
            path: name.into(),
            parent: String::new(),
            name: name.into(),
            unit: String::new(),
            kind: String::new(),
            rows: values.len(),
            values: Some(values),
            precision: Precision::default(),
        };
        let mut t: Vec<f64> = (0..100)
            .map(|k| 0.01 * f64::from(k) + if k >= 50 { 0.03 } else { 0.0 })
            .collect();
        t[20] += 0.002;
        t[80] = t[79];
        let mut x: Vec<f64> = (0..100).map(f64::from).collect();
        x[31] = x[30];
        let columns = [read("t", t), read("x", x), read("c", vec![1.0; 100])];
        let found = sampling(&columns[0], &columns).unwrap();
        assert!((found.sample_time_s - 0.01).abs() < 1e-5 && (found.jitter_s - 0.002).abs() < 2e-4);
        // The row behind the one that stands still is two steps late.
        assert_eq!(
            (found.gaps, found.missing, found.not_increasing, found.repeated),
            (2, 4, 1, 1)
        );
        assert!((found.first_gap_s.unwrap() - 0.49).abs() < 1e-12);
        assert!(sampling(&read("t", vec![1.0, 1.0]), &columns).is_none());
    }
}
