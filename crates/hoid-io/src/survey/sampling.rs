//! Sampling of columns that share a time.

use super::read::RawColumn;
use crate::data_quality::Grid;
use crate::time::sampling::pairs;

/// Sampling of columns that share a time.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplingSurvey {
    /// Path of the time column.
    pub path: String,
    /// Number of rows.
    pub rows: usize,
    /// First and last finite time, s.
    pub span_s: (f64, f64),
    /// Sample time of the evenly spaced grid fitted to the time, s.
    pub sample_time_s: f64,
    /// Largest deviation of a time from the evenly spaced grid, s.
    pub jitter_s: f64,
    /// Number of gaps in the time.
    pub gaps: usize,
    /// Total number of rows missing in the gaps.
    pub missing: u64,
    /// Time of the row before the first gap, s.
    pub first_gap_s: Option<f64>,
    /// Number of rows in which the time is constant or runs backwards.
    pub not_increasing: usize,
    /// Number of rows in which all other columns, except constant ones, repeat their values in the row before.
    pub repeated: usize,
}

/// Returns the sampling that a time column determines; `None` if fewer than two times are finite or the time does not
/// advance.
pub(super) fn survey_sampling(time: &RawColumn, columns: &[RawColumn]) -> Option<SamplingSurvey> {
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
    let neighbours: Vec<&Vec<f64>> = columns
        .iter()
        .filter(|column| column.parent == time.parent && column.rows == time.rows && column.path != time.path)
        .filter_map(|column| column.values.as_ref())
        .filter(|values| pairs(values).any(|(value, next)| value != next && !value.is_nan() && !next.is_nan()))
        .collect();
    let repeats =
        |(before, row): &(usize, usize)| neighbours.iter().all(|values| values.get(*before) == values.get(*row));
    Some(SamplingSurvey {
        path: time.path.clone(),
        rows: time.rows,
        span_s: (first, last),
        sample_time_s: grid.sample_time_s,
        jitter_s: grid.jitter(all).map_or(0.0, |(_, worst, _)| worst),
        gaps: grid.gaps().count(),
        missing: grid
            .gaps()
            .map(|(.., missing)| missing as u64)
            .fold(0, u64::saturating_add),
        first_gap_s: grid.gaps().next().and_then(|(before, ..)| all.get(before).copied()),
        not_increasing: pairs(&t).filter(|(time, next)| next <= time).count(),
        repeated: if neighbours.is_empty() {
            0
        } else {
            (0..).zip(1..time.rows).filter(repeats).count()
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Precision;

    #[test]
    fn time_column_faults_are_reported() {
        let read = |name: &str, values: Vec<f64>| RawColumn {
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
        let found = survey_sampling(&columns[0], &columns).unwrap();
        assert!((found.sample_time_s - 0.01).abs() < 1e-5 && (found.jitter_s - 0.002).abs() < 2e-4);
        // The row after a row with constant time is two steps later.
        assert_eq!(
            (found.gaps, found.missing, found.not_increasing, found.repeated),
            (2, 4, 1, 1)
        );
        assert!((found.first_gap_s.unwrap() - 0.49).abs() < 1e-12);
        assert!(survey_sampling(&read("t", vec![1.0, 1.0]), &columns).is_none());
    }
}
