//! What is inside of a file, before anything is chosen: columns, their sampling and ranges, and what is suspicious in them.
//!
//! Nothing is judged finally here: a channel may rightly be constant. A channel is
//!
//! - constant where all values are one;
//! - quantised where its values, fewer than half as many as its rows, lie on a grid `v_min + k q` within `1e-3 q`, `q` being the
//!   smallest step between two of them;
//! - saturated where it stays at its smallest or largest value for 5 rows or more, and twice as long as at any other.
//!
//! The sampling is that of `t` beside the columns: the typical step is the mean of the steps below 1.5 times their median, a gap
//! is a step of 1.5 times it or more, and the jitter is the deviation of the other steps from it.

use std::path::Path;

use crate::arrays::{Contents, Holds, TIMES};
use crate::format::{Format, bytes_of};
use crate::table::Table;
use crate::{IoError, csv_table, mat, npz, parquet_record, xdf};

/// Characters of a sketch.
const SKETCH: usize = 32;
const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
/// Rows that a saturated channel stays at its end.
const STAY: usize = 5;

/// What a file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct FileSurvey {
    /// Its format, as in "Parquet".
    pub format: &'static str,
    /// Its columns, in their order.
    pub columns: Vec<ColumnSurvey>,
    /// The sampling of each structure with a time, one for a flat table.
    pub samplings: Vec<SamplingSurvey>,
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
    /// Typical step, s.
    pub sample_time_s: f64,
    /// Largest deviation of a step from the typical one, gaps left aside, s.
    pub jitter_s: f64,
    /// Steps of 1.5 sample times or more.
    pub gaps: usize,
    /// Samples missing in them.
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
}

/// Looks into a file of any format that is read.
///
/// # Errors
/// Those of reading: [`IoError`], naming the place in the file.
pub fn survey(path: &Path) -> Result<FileSurvey, IoError> {
    let file = path.display().to_string();
    let (format, bytes) = bytes_of(path)?;
    let (columns, notes) = match format {
        Format::Csv { .. } => of_table(csv_table::parse(&bytes, &file)?),
        Format::Parquet => of_table(parquet_record::parse(bytes, &file)?),
        Format::Npz => of_arrays(&npz::read(&bytes, &file)?),
        Format::Npy => of_arrays(&npz::read_single(bytes, &file)?),
        Format::Mat => of_arrays(&mat::read(bytes, &file)?),
        Format::Xdf => of_arrays(&xdf::read(&bytes, &file)?),
    };
    let is_time = |column: &&Read| TIMES.contains(&column.name.as_str()) && column.rows > 1;
    let samplings = columns
        .iter()
        .filter(is_time)
        .filter_map(|time| sampling(time, &columns))
        .collect();
    let survey = |column: Read| ColumnSurvey {
        values: column.values.as_deref().and_then(values),
        path: column.path,
        unit: column.unit,
        kind: column.kind,
        rows: column.rows,
    };
    Ok(FileSurvey {
        format: format.name(),
        samplings,
        columns: columns.into_iter().map(survey).collect(),
        notes,
    })
}

fn of_table(table: Table<'_>) -> (Vec<Read>, Vec<String>) {
    let rows = table.rows;
    let read = |column: crate::table::Column| {
        let text = column.texts.len() == rows;
        Read {
            path: column.name.clone(),
            parent: String::new(),
            name: column.name,
            unit: column.unit,
            kind: String::from(if text { "text" } else { "numbers" }),
            values: (!text).then_some(column.values),
            rows,
        }
    };
    (table.columns.into_iter().map(read).collect(), table.notes)
}

fn of_arrays(contents: &Contents) -> (Vec<Read>, Vec<String>) {
    let leaves = contents.leaves();
    let read = |leaf: crate::arrays::Leaf| Read {
        parent: leaf.parent.clone(),
        name: leaf.name().to_owned(),
        unit: leaf.unit.clone(),
        kind: leaf.what(),
        rows: leaf.len(),
        values: match &leaf.holds {
            Holds::Numbers(numbers) => Some(numbers.values()),
            Holds::Texts(_) | Holds::Unread(_) => None,
        },
        path: leaf.path,
    };
    (leaves.into_iter().map(read).collect(), contents.notes.clone())
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
    let (low, high) = if constant { (0, 0) } else { saturated(&finite, min, max) };
    Some(ValueSurvey {
        missing: all.len() - finite.len(),
        min,
        max,
        mean,
        deviation,
        constant,
        quantum: quantum(&finite),
        saturated_low: low,
        saturated_high: high,
        sketch: sketch(all, min, max),
    })
}

/// The step of a grid on which all values lie.
fn quantum(finite: &[f64]) -> Option<f64> {
    let mut levels = finite.to_vec();
    levels.sort_unstable_by(f64::total_cmp);
    levels.dedup();
    if levels.len() < 2 || 2 * levels.len() > finite.len() {
        return None;
    }
    let step = levels
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .fold(f64::INFINITY, f64::min);
    let off = |level: &f64| {
        let steps = (level - levels[0]) / step;
        (steps - steps.round()).abs()
    };
    (step > 0.0 && levels.iter().all(|level| off(level) < 1e-3)).then_some(step)
}

/// Rows at the smallest and the largest value, where the column stays there.
fn saturated(finite: &[f64], min: f64, max: f64) -> (usize, usize) {
    let (mut low, mut high, mut other) = (0, 0, 0);
    let mut run = 0;
    for (k, value) in finite.iter().enumerate() {
        run = if k > 0 && finite[k - 1] == *value { run + 1 } else { 1 };
        let longest = if *value == min {
            &mut low
        } else if *value == max {
            &mut high
        } else {
            &mut other
        };
        *longest = run.max(*longest);
    }
    let stays = |longest: usize| longest >= STAY && longest >= 2 * other;
    let count = |end: f64| finite.iter().filter(|value| **value == end).count();
    (
        if stays(low) { count(min) } else { 0 },
        if stays(high) { count(max) } else { 0 },
    )
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
    let steps: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mut forward: Vec<f64> = steps.iter().copied().filter(|step| *step > 0.0).collect();
    let middle = forward.len() / 2;
    if forward.is_empty() {
        return None;
    }
    let median = *forward.select_nth_unstable_by(middle, f64::total_cmp).1;
    let usual: Vec<f64> = forward.iter().copied().filter(|step| *step < 1.5 * median).collect();
    let sample_time_s = usual.iter().sum::<f64>() / usual.len().max(1) as f64;
    let is_gap = |step: f64| step >= 1.5 * sample_time_s;
    let gaps = || (0..steps.len()).filter(|k| is_gap(steps[*k]));
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
        sample_time_s,
        jitter_s: usual
            .iter()
            .map(|step| (step - sample_time_s).abs())
            .fold(0.0, f64::max),
        gaps: gaps().count(),
        missing: gaps()
            .map(|k| ((steps[k] / sample_time_s).round() - 1.0).max(1.0) as u64)
            .fold(0, u64::saturating_add),
        first_gap_s: gaps().next().map(|k| t[k]),
        not_increasing: steps.iter().filter(|step| **step <= 0.0).count(),
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
        assert!((found.sample_time_s - 0.01).abs() < 1e-9 && (found.jitter_s - 0.002).abs() < 1e-9);
        // The row behind the one that stands still is two steps late.
        assert_eq!(
            (found.gaps, found.missing, found.not_increasing, found.repeated),
            (2, 4, 1, 1)
        );
        assert!((found.first_gap_s.unwrap() - 0.49).abs() < 1e-12);
        assert!(sampling(&read("t", vec![1.0, 1.0]), &columns).is_none());
    }
}
