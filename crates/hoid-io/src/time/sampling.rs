//! Sampling determined by a column t, and the check that t is evenly spaced.
//!
//! The sample time is `Ts = (t_last - t_first) / (N - 1)`. Each t must lie on the grid `t_first + k Ts` within a
//! tolerance, which is the larger of `1e-3 Ts` and one unit of the last printed decimal of t: rounded times in files
//! (0.0167 at 60 Hz) still count as evenly spaced. If `1 / Ts` is a whole number of Hz within a relative deviation of
//! `1e-4`, or within the rounding of t, that number is used, so that all runs of a laboratory have the same sample
//! time.

use crate::table::Precision;

/// Largest permitted deviation from the evenly spaced grid, in sample times.
const MAX_JITTER: f64 = 1e-3;
/// Number of times from which a single time off the even grid of the others counts as wrong.
const MIN_EVEN_TIMES: usize = 8;
/// Largest relative deviation at which a frequency is rounded to a whole number of Hz.
const WHOLE_HZ_TOLERANCE: f64 = 1e-4;

/// Reason why the samples are not evenly spaced. Rows are counted from the first row in use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum SamplingFault {
    TooFew,
    NotIncreasing {
        row: usize,
    },
    /// A single time that is not later than the time before it, while all others are on an even grid.
    WrongTime {
        row: usize,
        expected_s: f64,
        sample_time_s: f64,
    },
    Gap {
        row: usize,
        missing: u64,
        gaps: usize,
        sample_time_s: f64,
    },
    Jitter {
        row: usize,
        deviation_s: f64,
        tolerance_s: f64,
        sample_time_s: f64,
    },
}

/// A sample time, and a note if it was not taken unchanged from the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sampling {
    pub(crate) sample_time_s: f64,
    pub(crate) note: Option<String>,
}

/// Returns the sample time in s of evenly spaced times that do not come from a file. The rules are those for files: a
/// possible rounding of the times is detected.
///
/// # Errors
/// The index of the row, counted from 0, at which the spacing is uneven.
pub fn even_times(t: &[f64]) -> Result<f64, usize> {
    match even_sampling(t, Precision::from_times(t, false), None) {
        Ok(sampling) => Ok(sampling.sample_time_s),
        Err(SamplingFault::TooFew) => Err(0),
        Err(SamplingFault::Gap { row, .. }) => Err(row.saturating_add(1)),
        Err(
            SamplingFault::NotIncreasing { row }
            | SamplingFault::WrongTime { row, .. }
            | SamplingFault::Jitter { row, .. },
        ) => Err(row),
    }
}

/// Returns the sampling of an evenly spaced t. A sample time stated in the file is used if t agrees with it.
pub(crate) fn even_sampling(t: &[f64], precision: Precision, stated_s: Option<f64>) -> Result<Sampling, SamplingFault> {
    let (&[first, .., last], steps) = (t, t.len().saturating_sub(1) as f64) else {
        return match stated_s {
            Some(sample_time_s) if t.len() == 1 => Ok(Sampling {
                sample_time_s,
                note: None,
            }),
            _ => Err(SamplingFault::TooFew),
        };
    };
    if let Err(row) = check_increasing(t) {
        let wrong = [Some(row), row.checked_sub(1)].into_iter().flatten();
        let wrong = wrong.filter_map(|row| find_wrong_time(t, row, precision)).next();
        return Err(wrong.unwrap_or(SamplingFault::NotIncreasing { row }));
    }
    let rounding = Rounding::of(t, precision);
    let typical_s = typical_step(t, rounding);
    check_gaps(t, rounding, typical_s)?;
    let mean_s = (last - first) / steps;
    let first_unit = rounding.unit(first);
    let tolerance = |t: f64| (MAX_JITTER * mean_s).max(rounding.unit(t).max(first_unit) * (1.0 + 1e-6));
    let step_s = grid_step(t, mean_s, tolerance);
    // The largest excess of the deviation over the tolerance is decisive; NaN, which results from an overflow, counts
    // as an excess.
    let deviation = |k: usize, t: f64| (t - (first + k as f64 * step_s)).abs();
    let excess = t
        .iter()
        .enumerate()
        .map(|(k, t)| (deviation(k, *t) - tolerance(*t), k, *t));
    let (excess, row, worst) = excess
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .unwrap_or((f64::NAN, 0, first));
    if !(excess <= 0.0 && step_s.is_finite() && step_s > 0.0) {
        return Err(SamplingFault::Jitter {
            row,
            deviation_s: deviation(row, worst),
            tolerance_s: tolerance(worst),
            sample_time_s: step_s,
        });
    }
    let end_tolerance = tolerance(last);
    let moves_end = |ts: f64| steps * (ts - step_s).abs() > end_tolerance;
    if let Some(stated) = stated_s {
        if !moves_end(stated) {
            return Ok(Sampling {
                sample_time_s: stated,
                note: None,
            });
        }
        let note = format!("the stated sample time {stated} s contradicts t, which gives {step_s} s; t is used");
        return Ok(Sampling {
            sample_time_s: step_s,
            note: Some(note),
        });
    }
    let sample_time_s = round_to_whole_hz(step_s, rounding.unit(first.abs().max(last.abs())) / steps);
    let note = moves_end(sample_time_s).then(|| {
        format!(
            "t gives a sampling frequency of {:.6} Hz, taken as {:.0} Hz",
            1.0 / step_s,
            1.0 / sample_time_s
        )
    });
    Ok(Sampling { sample_time_s, note })
}

/// Returns the step of an even grid from the first time that agrees with all times within their tolerances, which may
/// differ if the times have a fixed number of significant digits; without such a grid, or if the mean step is such a
/// step, the mean step.
fn grid_step(t: &[f64], mean_s: f64, tolerance: impl Fn(f64) -> f64) -> f64 {
    let first = t.first().copied().unwrap_or(f64::NAN);
    let bounds = (1..).zip(t.iter().skip(1)).map(|(k, t): (usize, _)| {
        let (elapsed, k) = (t - first, k as f64);
        ((elapsed - tolerance(*t)) / k, (elapsed + tolerance(*t)) / k)
    });
    let (low, high) = bounds.fold((f64::NEG_INFINITY, f64::INFINITY), |all, one| {
        (one.0.max(all.0), one.1.min(all.1))
    });
    if low <= high && !(low..=high).contains(&mean_s) {
        0.5 * (low + high)
    } else {
        mean_s
    }
}

/// Returns the sample time for resampling an unevenly spaced t, which is its typical step.
pub(crate) fn typical_sample_time(t: &[f64], precision: Precision) -> Result<f64, SamplingFault> {
    let &[first, .., last] = t else {
        return Err(SamplingFault::TooFew);
    };
    check_increasing(t).map_err(|row| SamplingFault::NotIncreasing { row })?;
    let rounding = Rounding::of(t, precision);
    let slack_s = rounding.unit(first.abs().max(last.abs())) / t.len().saturating_sub(1) as f64;
    Ok(round_to_whole_hz(typical_step(t, rounding), slack_s))
}

/// Returns the fault of a single time if the times are even with the value that its neighbours suggest in its place.
fn find_wrong_time(t: &[f64], row: usize, precision: Precision) -> Option<SamplingFault> {
    let at = |row: Option<usize>| row.and_then(|row| t.get(row)).copied();
    let [near, far] = [1, 2].map(|steps| (at(row.checked_sub(steps)), at(row.checked_add(steps))));
    let expected_s = match (near, far) {
        ((Some(before), Some(after)), _) => 0.5 * (before + after),
        // At an end, an equal time may belong to a row that was written twice.
        ((Some(before), None), (Some(earlier), _)) if at(Some(row)) != Some(before) => 2.0 * before - earlier,
        ((None, Some(after)), (_, Some(later))) if at(Some(row)) != Some(after) => 2.0 * after - later,
        _ => return None,
    };
    if t.len() < MIN_EVEN_TIMES {
        return None;
    }
    let mut corrected = t.to_vec();
    *corrected.get_mut(row)? = expected_s;
    check_increasing(&corrected).ok()?;
    let even = even_sampling(&corrected, precision, None).ok()?;
    Some(SamplingFault::WrongTime {
        row,
        expected_s,
        sample_time_s: even.sample_time_s,
    })
}

/// Checks that the times increase; the error is the first row whose time does not.
fn check_increasing(t: &[f64]) -> Result<(), usize> {
    // The condition is formulated so that NaN also counts as not increasing.
    let standing =
        |(_, (before, next)): &(usize, (f64, f64))| next.partial_cmp(before) != Some(std::cmp::Ordering::Greater);
    match (1..).zip(pairs(t)).find(standing) {
        None => Ok(()),
        Some((row, _)) => Err(row),
    }
}

/// Returns each value together with the next value.
pub(crate) fn pairs(values: &[f64]) -> impl Iterator<Item = (f64, f64)> {
    let next = values.get(1..).unwrap_or_default();
    values.iter().copied().zip(next.iter().copied())
}

/// Returns the steps from each value to the next value.
pub(crate) fn steps(values: &[f64]) -> impl Iterator<Item = f64> {
    pairs(values).map(|(value, next)| next - value)
}

/// Returns the stride at which at most about two million steps of a long time are used for its median.
pub(crate) fn median_stride(times: usize) -> usize {
    (times >> 20).max(1)
}

/// Rounding error of the times as printed in a file.
#[derive(Clone, Copy)]
struct Rounding {
    precision: Precision,
    /// Result of [`Precision::fixed_unit`], which avoids a logarithm for nearly all times.
    fixed_unit: (f64, f64),
    median_step_s: f64,
}

impl Rounding {
    fn of(t: &[f64], precision: Precision) -> Self {
        let mut steps: Vec<f64> = steps(t).step_by(median_stride(t.len())).collect();
        let middle = steps.len() / 2;
        Self {
            precision,
            fixed_unit: precision.fixed_unit(),
            median_step_s: *steps.select_nth_unstable_by(middle, f64::total_cmp).1,
        }
    }

    /// Returns one unit of the last digit of t, but at most the median step: with a larger unit t would be constant
    /// over several rows.
    fn unit(self, t: f64) -> f64 {
        let (limit, fixed) = self.fixed_unit;
        let unit = if t.abs() < limit { fixed } else { self.precision.unit(t) };
        unit.min(self.median_step_s)
    }
}

/// Returns the mean of all steps except gaps, which are steps of at least 1.5 times the median step plus one unit for
/// the rounding of t.
fn typical_step(t: &[f64], rounding: Rounding) -> f64 {
    let median = rounding.median_step_s;
    let (sum, count) = pairs(t)
        .map(|(before, next)| (next - before, rounding.unit(next)))
        .filter(|(step, unit)| *step < 1.5 * median + unit)
        .fold((0.0, 0.0), |(sum, count), (step, _)| (sum + step, count + 1.0));
    if count == 0.0 { median } else { sum / count }
}

/// Detects missing samples. Rounding may make a step longer than the sample time by up to one unit, as in 0.00, 0.02,
/// 0.03 at 60 Hz, but not by a full unit if the sample time is a multiple of the unit.
fn check_gaps(t: &[f64], rounding: Rounding, typical_s: f64) -> Result<(), SamplingFault> {
    let is_gap = |(_, (before, next)): &(usize, (f64, f64))| {
        let step = next - before;
        step >= 1.5 * typical_s && step - typical_s > 0.95 * rounding.unit(*next)
    };
    let mut gaps = pairs(t).enumerate().filter(is_gap);
    let Some((row, (before, next))) = gaps.next() else {
        return Ok(());
    };
    Err(SamplingFault::Gap {
        row,
        missing: (((next - before) / typical_s).round() - 1.0).max(1.0) as u64,
        gaps: gaps.count().saturating_add(1),
        sample_time_s: typical_s,
    })
}

/// Returns the sample time of the nearest whole number of Hz if `ts` is close enough, otherwise `ts`; `slack_s` is the
/// uncertainty of `ts` due to the rounding of t.
fn round_to_whole_hz(ts: f64, slack_s: f64) -> f64 {
    let frequency = (1.0 / ts).round();
    let near =
        (1.0 / ts - frequency).abs() <= WHOLE_HZ_TOLERANCE * frequency || (1.0 / frequency - ts).abs() <= slack_s;
    if frequency >= 1.0 && frequency.is_finite() && near {
        1.0 / frequency
    } else {
        ts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_in_memory_follow_the_rules_for_files() {
        let rounded: Vec<f64> = (0..2702).map(|k| (f64::from(k) / 60.0 * 1e4).round() / 1e4).collect();
        assert_eq!(even_times(&rounded), Ok(1.0 / 60.0));
        let mut missing = rounded.clone();
        missing.drain(100..140);
        assert_eq!(even_times(&missing), Err(100));
        let mut back = rounded;
        back[7] = back[5];
        assert_eq!(even_times(&back), Err(7));
        assert_eq!(even_times(&[0.0]), Err(0));
    }

    /// Returns times as a file with a given number of decimals prints them.
    fn printed_times(times: impl Iterator<Item = f64>, decimals: usize) -> (Vec<f64>, Precision) {
        let mut precision = Precision::default();
        let t = times
            .map(|t| {
                let text = format!("{t:.decimals$}");
                precision.add(&text);
                text.parse().unwrap()
            })
            .collect();
        (t, precision)
    }

    fn grid(n: usize, start: f64, ts: f64) -> impl Iterator<Item = f64> {
        (0..n).map(move |k| start + k as f64 * ts)
    }

    #[test]
    fn rounded_times_are_even_and_give_whole_hz() {
        for hz in [30.0, 50.0, 60.0, 75.0, 100.0, 128.0, 1000.0] {
            for decimals in [3, 4, 6, 17] {
                for (n, start) in [(12, 0.0), (2702, 0.0), (9000, -10.24)] {
                    let (t, precision) = printed_times(grid(n, start, 1.0 / hz), decimals);
                    let sampling = even_sampling(&t, precision, None).unwrap();
                    assert_eq!(
                        sampling.sample_time_s,
                        1.0 / hz,
                        "{hz} Hz, {decimals} decimals, {n} samples"
                    );
                    assert_eq!(sampling.note, None);
                }
            }
        }
        // The rate of 60 Hz is found, although the printed steps alternate between 0.01 and 0.02.
        let (t, precision) = printed_times(grid(2000, 0.0, 1.0 / 60.0), 2);
        assert_eq!(even_sampling(&t, precision, None).unwrap().sample_time_s, 1.0 / 60.0);
    }

    #[test]
    fn times_with_few_significant_digits_are_even() {
        // The output of printf("%.6g") in C and of std::cout in C++, and the same with five digits.
        let significant = |t: f64, digits: i32| {
            let decimals = (digits - 1 - t.abs().max(1e-9).log10().floor() as i32) as usize;
            let text = format!("{t:.decimals$}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        };
        for (hz, n, digits) in [
            (60.0, 12_000, 6),
            (90.0, 13_500, 6),
            (128.0, 25_600, 6),
            (60.0, 2000, 5),
        ] {
            let mut precision = Precision::default();
            let texts = (0..n).map(|k| significant(f64::from(k) / hz, digits));
            let mut t: Vec<f64> = texts
                .inspect(|text| precision.add(text))
                .map(|text| text.parse().unwrap())
                .collect();
            assert_eq!(
                even_sampling(&t, precision, None).unwrap().sample_time_s,
                1.0 / hz,
                "{hz}"
            );
            assert_eq!(even_times(&t), Ok(1.0 / hz), "{hz} Hz in memory");
            // An early stamp has more decimals, and is not permitted the rounding error of the last one.
            t[5] += 5e-4;
            let found = even_sampling(&t, precision, None);
            assert!(matches!(found, Err(SamplingFault::Jitter { row: 5, .. })), "{found:?}");
        }
    }

    #[test]
    fn other_rates_are_not_rounded() {
        let (t, precision) = printed_times(grid(5000, 0.0, 0.0125 / 0.79), 12);
        let ts = even_sampling(&t, precision, None).unwrap().sample_time_s;
        assert!((ts - 0.0125 / 0.79).abs() < 1e-12);
        let (t, precision) = printed_times(grid(100, 0.0, 2.0), 0);
        assert_eq!(even_sampling(&t, precision, None).unwrap().sample_time_s, 2.0);
        // 99.995 Hz is rounded to 100 Hz, with a note.
        let (t, precision) = printed_times(grid(8000, 0.0, 1.0 / 99.995), 9);
        let sampling = even_sampling(&t, precision, None).unwrap();
        assert_eq!(sampling.sample_time_s, 0.01);
        assert!(sampling.note.unwrap().contains("99.995000 Hz, taken as 100 Hz"));
    }

    #[test]
    fn stated_sample_time_is_used_if_t_agrees() {
        let (t, precision) = printed_times(grid(500, 0.0, 0.015), 17);
        let stated = f64::from_bits(0.015_f64.to_bits() + 1);
        assert_eq!(
            even_sampling(&t, precision, Some(stated)).unwrap().sample_time_s,
            stated
        );
        let other = even_sampling(&t, precision, Some(0.016)).unwrap();
        assert!((other.sample_time_s - 0.015).abs() < 1e-12);
        assert!(other.note.unwrap().contains("contradicts t"));
        assert_eq!(
            even_sampling(&[3.0], precision, Some(0.015)).unwrap().sample_time_s,
            0.015
        );
        assert_eq!(even_sampling(&[3.0], precision, None), Err(SamplingFault::TooFew));
        assert_eq!(even_sampling(&[], precision, Some(0.015)), Err(SamplingFault::TooFew));
    }

    #[test]
    fn gaps_are_counted() {
        for decimals in [2, 3, 6] {
            let (mut t, precision) = printed_times(grid(1000, 0.0, 0.01), decimals);
            t.drain(900..903);
            t.remove(400);
            let found = even_sampling(&t, precision, None);
            let Err(SamplingFault::Gap {
                row,
                missing,
                gaps,
                sample_time_s,
            }) = found
            else {
                panic!("{decimals} decimals: {found:?}");
            };
            assert_eq!((row, missing, gaps), (399, 1, 2), "{decimals} decimals");
            assert!((sample_time_s - 0.01).abs() < 1e-4);
        }
        // If the times are counts of samples, a missing count is a gap.
        let (mut t, precision) = printed_times(grid(50, 0.0, 1.0), 0);
        t.remove(20);
        assert!(matches!(
            even_sampling(&t, precision, None),
            Err(SamplingFault::Gap {
                row: 19,
                missing: 1,
                ..
            })
        ));
    }

    #[test]
    fn jitter_is_measured() {
        let (mut t, precision) = printed_times(grid(1000, 0.0, 0.01), 6);
        t[321] += 0.002;
        let Err(SamplingFault::Jitter {
            row,
            deviation_s,
            tolerance_s,
            ..
        }) = even_sampling(&t, precision, None)
        else {
            panic!("not found");
        };
        assert_eq!(row, 321);
        // One deviating sample of 1000 shifts neither end of the grid.
        assert!((deviation_s - 0.002).abs() < 1e-9 && (tolerance_s - 1e-5).abs() < 1e-9);
        t[321] -= 0.001_995;
        assert!(even_sampling(&t, precision, None).is_ok());
    }

    #[test]
    fn non_increasing_or_overflowing_time_is_an_error() {
        let p = Precision::default();
        assert_eq!(
            even_sampling(&[0.0, 0.1, 0.1, 0.2], p, None),
            Err(SamplingFault::NotIncreasing { row: 2 })
        );
        assert_eq!(
            even_sampling(&[0.0, 0.1, 0.05], p, None),
            Err(SamplingFault::NotIncreasing { row: 2 })
        );
        assert_eq!(
            typical_sample_time(&[0.0, f64::NAN], p),
            Err(SamplingFault::NotIncreasing { row: 1 })
        );
        assert!(even_sampling(&[-1e308, 0.0, 1e308], p, None).is_err());
        assert!(even_sampling(&[0.0, 5e-324], p, None).is_ok_and(|s| s.sample_time_s > 0.0));
    }

    #[test]
    fn single_wrong_time_is_found() {
        let p = Precision::default();
        let even: Vec<f64> = grid(40, 0.0, 0.02).collect();
        for (row, wrong) in [(20, 0.0), (20, 99.0), (20, even[19]), (39, 0.1), (0, 5.0)] {
            let mut t = even.clone();
            t[row] = wrong;
            let Err(SamplingFault::WrongTime {
                row: found,
                expected_s,
                sample_time_s,
            }) = even_sampling(&t, p, None)
            else {
                panic!("row {row}");
            };
            assert_eq!((found, sample_time_s), (row, 0.02));
            assert!((expected_s - even[row]).abs() < 1e-12);
            assert_eq!(even_times(&t), Err(row));
        }
        for (row, copy) in [(39, 38), (0, 1)] {
            let mut t = even.clone();
            t[row] = t[copy];
            let row = row.max(1);
            assert_eq!(even_sampling(&t, p, None), Err(SamplingFault::NotIncreasing { row }));
        }
        let mut swapped = even.clone();
        swapped.swap(20, 21);
        assert_eq!(
            even_sampling(&swapped, p, None),
            Err(SamplingFault::NotIncreasing { row: 21 })
        );
    }

    #[test]
    fn typical_step_ignores_gaps_and_rounding() {
        let (mut t, precision) = printed_times(grid(1000, 5.0, 1.0 / 60.0), 4);
        t.iter_mut().skip(300).for_each(|t| *t += 7.0);
        assert_eq!(typical_sample_time(&t, precision).unwrap(), 1.0 / 60.0);
    }
}
