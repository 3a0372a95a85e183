//! Reduction of long series to a few points, with peaks and gaps preserved.

use std::ops::Range;

/// Number of columns of points to which a line is reduced in a single-column figure: one for each unit between its
/// axes.
pub const COLUMN_COUNT: usize = 340;

/// Maximum number of runs of consecutive known values; if there are more, runs that are separated by gaps narrower than
/// a column are joined.
const MAX_RUNS: usize = 200;

/// Indices of the smallest and the largest value in each column, in ascending order; all indices of a short series.
pub fn thinned_indices(values: &[f64]) -> Vec<usize> {
    thinned_run_indices(values, 0..values.len(), COLUMN_COUNT)
}

/// As [`thinned_indices`], for a run of indices of a series that is divided into `parts` columns. Non-finite values are
/// omitted.
pub fn thinned_run_indices(values: &[f64], run: Range<usize>, parts: usize) -> Vec<usize> {
    let finite = |k: &usize| values[*k].is_finite();
    if values.len() <= 2 * parts {
        return run.filter(finite).collect();
    }
    let mut kept = Vec::with_capacity(2 * COLUMN_COUNT + 2);
    kept.extend(run.clone().find(finite));
    for column in columns(values.len(), &run, parts) {
        let by_value = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
        let lowest = column.clone().filter(finite).min_by(by_value);
        let highest = column.filter(finite).max_by(by_value);
        if let (Some(lowest), Some(highest)) = (lowest, highest) {
            kept.extend([lowest.min(highest), lowest.max(highest)]);
        }
    }
    kept.extend(run.rev().find(finite));
    kept.dedup();
    kept
}

/// Points of a band in a run of indices: the first index, the middle index of each column with the smallest lower and
/// the largest upper edge in that column, and the last index.
pub fn thinned_band_points(lower: &[f64], upper: &[f64], run: Range<usize>, parts: usize) -> Vec<(usize, f64, f64)> {
    let point = |k: usize| (k, lower[k], upper[k]);
    if lower.len() <= 2 * parts {
        return run.map(point).collect();
    }
    let mut kept = vec![point(run.start)];
    for column in columns(lower.len(), &run, parts) {
        let least = lower[column.clone()].iter().copied().fold(f64::INFINITY, f64::min);
        let most = upper[column.clone()].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        kept.push(((column.start + column.end) / 2, least, most));
    }
    kept.push(point(run.end - 1));
    kept.dedup_by_key(|k| k.0);
    kept
}

/// Divides a run of indices at the boundaries of the columns of a series of `n` values.
fn columns(n: usize, run: &Range<usize>, parts: usize) -> impl Iterator<Item = Range<usize>> {
    let run = run.clone();
    let (first, last) = (run.start * parts / n, run.end * parts / n);
    (first..=last.min(parts - 1))
        .map(move |c| {
            let (from, to) = (c * n / parts, (c + 1) * n / parts);
            from.max(run.start)..to.min(run.end)
        })
        .filter(|c| !c.is_empty())
}

/// Returns both ends and the indices whose value differs from the value of a neighbour, since a constant level needs no
/// other points.
pub fn remove_constant_stretches<T: PartialEq>(kept: &[usize], value: impl Fn(usize) -> T) -> Vec<usize> {
    let level = |i: usize| {
        let same = |a: usize| value(kept[a]) == value(kept[i]);
        i > 0 && i + 1 < kept.len() && same(i - 1) && same(i + 1)
    };
    let needed = kept.iter().enumerate().filter(|(i, _)| !level(*i));
    needed.map(|(_, &k)| k).collect()
}

/// Runs of consecutive indices with known values. If there are more than `MAX_RUNS` runs, runs that are separated by
/// less than a column are joined.
pub fn runs(n: usize, known: impl Fn(usize) -> bool) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for k in (0..n).filter(|k| known(*k)) {
        match found.last_mut() {
            Some(run) if run.end == k => run.end = k + 1,
            _ => found.push(k..k + 1),
        }
    }
    if found.len() <= MAX_RUNS {
        return found;
    }
    let mut joined: Vec<Range<usize>> = Vec::new();
    for run in found {
        match joined.last_mut() {
            Some(before) if (run.start - before.end) * COLUMN_COUNT < n => before.end = run.end,
            _ => joined.push(run),
        }
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_order_ends_and_peaks() {
        let mut values: Vec<f64> = (0..50_000).map(|k| (k as f64 * 0.01).sin()).collect();
        values[12_345] = 9.0;
        let kept = thinned_indices(&values);
        assert!(kept.len() <= 2 * COLUMN_COUNT + 2);
        assert!(kept.windows(2).all(|w| w[0] < w[1]));
        assert_eq!((kept[0], kept[kept.len() - 1]), (0, 49_999));
        assert!(kept.contains(&12_345));
        assert_eq!(thinned_indices(&[1.0, 2.0]), [0, 1]);
    }

    #[test]
    fn thinned_run_keeps_its_ends() {
        let values: Vec<f64> = (0..10_000).map(|k| (k as f64 * 0.05).cos()).collect();
        for run in [0..1, 17..19, 4_000..9_999, 9_999..10_000, 0..10_000] {
            let kept = thinned_run_indices(&values, run.clone(), COLUMN_COUNT);
            assert_eq!((kept[0], kept[kept.len() - 1]), (run.start, run.end - 1));
            assert!(kept.windows(2).all(|w| w[0] < w[1]), "{run:?}");
        }
    }

    #[test]
    fn thinned_bands_keep_their_extremes() {
        let n = 20_000;
        let mut upper = vec![1.0; n];
        upper[777] = 5.0;
        let lower: Vec<f64> = upper.iter().map(|u| -u).collect();
        let kept = thinned_band_points(&lower, &upper, 100..15_000, COLUMN_COUNT);
        assert!(kept.windows(2).all(|w| w[0].0 < w[1].0));
        assert_eq!((kept[0].0, kept[kept.len() - 1].0), (100, 14_999));
        assert!(kept.iter().any(|k| (k.1, k.2) == (-5.0, 5.0)));
        assert!(kept.len() <= COLUMN_COUNT + 2);
    }

    #[test]
    fn runs_end_at_gaps() {
        assert_eq!(runs(10, |k| k != 3 && k != 7), [0..3, 4..7, 8..10]);
        assert_eq!(runs(0, |_| true), []);
        assert_eq!(runs(5, |_| false), []);
        // Every second value is known, so the gaps are much narrower than a column.
        assert_eq!(runs(100_000, |k| k % 2 == 0), vec![0..99_999]);
        // The wide gap of the same series is preserved.
        assert_eq!(
            runs(100_000, |k| k % 2 == 0 && !(40_000..50_000).contains(&k)),
            vec![0..39_999, 50_000..99_999]
        );
    }
}
