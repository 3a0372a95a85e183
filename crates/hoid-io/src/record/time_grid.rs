//! The rows of a table that form a record, and the evenly spaced grid of its samples.

use std::ops::Range;

use hoid_model::SampleTime;

use super::repair::rows_are_equal;
use super::table_reader::TableReader;
use super::trials::MIN_TRIAL_ROWS;
use crate::IoError;
use crate::preparation::Step;
use crate::table::Precision;
use crate::time::sampling::{self, SamplingFault};
use crate::wording::{format_decimal, list_names};

/// Maximum ratio of the number of resampled samples to that of recorded samples.
const MAX_RESAMPLING_RATIO: usize = 100;

/// Rows and times from which the samples of a record are taken.
pub(super) struct TimeGrid {
    /// Rows of the table from which the samples are taken.
    pub(super) rows: Range<usize>,
    pub(super) start_s: f64,
    pub(super) sample_time: SampleTime,
    /// Number of samples that are interpolated from rows with an unevenly spaced t; `None` without resampling.
    pub(super) resampled: Option<usize>,
    /// Values of t in these rows, if t is known to increase.
    pub(super) t: Option<Vec<f64>>,
}

impl TableReader<'_> {
    pub(super) fn time_grid(&mut self, time: Option<usize>) -> Result<TimeGrid, IoError> {
        let given = match self.options.sampling_hz {
            None => None,
            Some(hz) => match SampleTime::new(1.0 / hz) {
                Ok(ts) => Some(ts),
                Err(_) => return Err(IoError::SamplingFrequency { found: hz }),
            },
        };
        match (time, given) {
            (Some(time), None) => self.grid_from_time(time, None),
            (Some(time), Some(ts)) if self.options.repair.resample => self.grid_from_time(time, Some(ts)),
            (time, Some(ts)) => self.counted_grid(time, ts),
            (None, None) => Err(IoError::NoSampling {
                file: self.file.clone(),
                available: list_names(&self.table.names()),
            }),
        }
    }

    /// Counts the samples from the first one at a given frequency.
    fn counted_grid(&mut self, time: Option<usize>, sample_time: SampleTime) -> Result<TimeGrid, IoError> {
        let t = time
            .and_then(|time| self.table.columns.get(time))
            .map(|column| &column.values);
        let first = t.and_then(|t| t.first().copied());
        let start = first.filter(|t| t.is_finite()).unwrap_or(0.0);
        let ts = sample_time.s();
        match (t, first) {
            (None, _) if self.options.repair.resample => {
                self.table.notes.push(String::from(
                    "there is no column t for resampling: the samples are taken as evenly spaced",
                ));
            }
            (Some(t), Some(first)) if first.is_finite() => {
                let last = t.last().copied().unwrap_or(first);
                let stated = (last - first) / t.len().saturating_sub(1) as f64;
                // A deviation above one percent is larger than any clock error.
                if (stated - ts).abs() > 0.01 * ts {
                    self.table.notes.push(format!(
                        "the given sampling frequency of {} Hz is used; t gives {:.6} Hz on average",
                        1.0 / ts,
                        1.0 / stated
                    ));
                }
            }
            (Some(_), _) => {
                let place = self.table.source.location(0);
                self.table.notes.push(format!(
                    "t is not a number in {place}: the time of the first sample is taken as 0 s"
                ));
            }
            _ => {}
        }
        let time_s = |row: usize| start + row as f64 * ts;
        let times: Vec<f64> = (0..self.table.rows).map(time_s).collect();
        let rows = self.rows_in_span(&times)?;
        let rows = self.rows_between_values(rows, None);
        Ok(TimeGrid {
            start_s: time_s(rows.start),
            rows,
            sample_time,
            resampled: None,
            t: None,
        })
    }

    /// Determines the grid from the column t, or the grid to which the record is resampled.
    fn grid_from_time(&mut self, time: usize, given: Option<SampleTime>) -> Result<TimeGrid, IoError> {
        let too_few = |this: &Self| this.sampling_error(SamplingFault::TooFew, &(0..0), &[]);
        let column = self.table.columns.get(time).ok_or_else(|| too_few(self))?;
        if column.texts.is_empty() && column.values.iter().all(|t| t.is_nan()) {
            return Err(IoError::EmptyTime {
                file: self.file.clone(),
            });
        }
        let precision = column.precision;
        let rows = self.rows_in_span(&column.values)?;
        let rows = self.rows_between_values(rows, Some(time));
        let t = self.values(time, rows.clone(), None)?;
        let start_s = *t.first().ok_or_else(|| too_few(self))?;
        let stated = self.table.sample_time_s;
        let sampled = match (sampling::even_sampling(&t, precision, stated), given) {
            (Ok(even), Some(given)) if !given.matches(self.sample_time(even.sample_time_s)?) => Ok(given),
            (Ok(even), _) => {
                self.table.notes.extend(even.note);
                return Ok(TimeGrid {
                    rows,
                    start_s,
                    sample_time: given.map_or_else(|| self.sample_time(even.sample_time_s), Ok)?,
                    resampled: None,
                    t: Some(t),
                });
            }
            (Err(SamplingFault::Gap { .. } | SamplingFault::Jitter { .. }), Some(given)) => Ok(given),
            (Err(SamplingFault::Gap { .. } | SamplingFault::Jitter { .. }), None) if self.options.repair.resample => {
                let own = self.recorded_times(&rows, time, &t);
                match sampling::typical_sample_time(own.as_deref().unwrap_or(&t), precision) {
                    Ok(ts) => Ok(self.sample_time(ts)?),
                    Err(uneven) => Err(uneven),
                }
            }
            (Err(uneven), _) => Err(uneven),
        };
        let sample_time = sampled.map_err(|uneven| self.sampling_error(uneven, &rows, &t))?;
        self.resampled_grid(rows, t, sample_time, precision)
    }

    fn resampled_grid(
        &mut self,
        rows: Range<usize>,
        t: Vec<f64>,
        sample_time: SampleTime,
        precision: Precision,
    ) -> Result<TimeGrid, IoError> {
        // Interpolation needs at least two samples.
        let &[start_s, .., end_s] = t.as_slice() else {
            return Err(self.sampling_error(SamplingFault::TooFew, &rows, &t));
        };
        let ts = sample_time.s();
        // The rounding of the last t must not remove the last sample.
        let slack = 1e-6 + (precision.unit(end_s) / ts).min(0.5);
        let samples = ((end_s - start_s) / ts + slack).floor() + 1.0;
        if samples > MAX_RESAMPLING_RATIO.saturating_mul(t.len()) as f64 || !samples.is_finite() {
            return Err(IoError::ResampledTooLong {
                file: self.file.clone(),
                start_s,
                end_s,
                samples,
                rows: t.len(),
                factor: MAX_RESAMPLING_RATIO,
            });
        }
        let longest = sampling::steps(&t).fold(0.0, f64::max);
        self.steps.push(Step::Interpolate {
            from_samples: t.len(),
            to_samples: samples as usize,
            to_hz: 1.0 / ts,
            longest_step_s: longest,
        });
        // At half the frequency or less, signal power above the new Nyquist frequency aliases.
        if 2.0 * samples <= t.len() as f64 {
            self.table.notes.push(String::from(
                "resampling to the lower frequency applied no low-pass filter: if the recording has power above half the \
                 new frequency, read it at the old frequency and give the new one with --new-fs",
            ));
        }
        Ok(TimeGrid {
            rows,
            start_s,
            sample_time,
            resampled: Some(samples as usize),
            t: Some(t),
        })
    }

    fn sampling_error(&self, uneven: SamplingFault, rows: &Range<usize>, t: &[f64]) -> IoError {
        let file = self.file.clone();
        let place = |row: usize| self.table.source.location(rows.start.saturating_add(row));
        let at = |row: usize| t.get(row).copied().unwrap_or(f64::NAN);
        match uneven {
            SamplingFault::TooFew => IoError::TooFewSamples { file, found: t.len() },
            SamplingFault::NotIncreasing { row } => IoError::NotIncreasing {
                file,
                location: place(row),
                found: at(row),
                previous: at(row.saturating_sub(1)),
                remedy: {
                    let after = rows.start.saturating_add(row);
                    backward_remedy(t, row, rows_are_equal(&self.table, after.saturating_sub(1), after))
                },
            },
            SamplingFault::WrongTime {
                row,
                expected_s,
                sample_time_s,
            } => IoError::WrongTime {
                file,
                location: place(row),
                found: at(row),
                expected_s: format_decimal(expected_s),
                hz: 1.0 / sample_time_s,
            },
            SamplingFault::Gap {
                row,
                missing,
                gaps,
                sample_time_s,
            } => IoError::Gap {
                file,
                location: place(row),
                after_s: at(row),
                next_s: at(row.saturating_add(1)),
                missing,
                gaps,
                sample_time_s,
            },
            SamplingFault::Jitter {
                row,
                deviation_s,
                tolerance_s,
                sample_time_s,
            } => IoError::Jitter {
                file,
                location: place(row),
                found: at(row),
                deviation_s,
                tolerance_s,
                sample_time_s,
            },
        }
    }

    fn sample_time(&self, ts_s: f64) -> Result<SampleTime, IoError> {
        SampleTime::new(ts_s).map_err(|source| self.model_error(source))
    }

    /// Returns the range of rows whose time is inside the span.
    fn rows_in_span(&self, times: &[f64]) -> Result<Range<usize>, IoError> {
        let (from, to) = self.options.span_s;
        let mut finite = times.iter().copied().filter(|t| t.is_finite());
        let (start_s, end_s) = (
            finite.next().unwrap_or(f64::NAN),
            finite.next_back().unwrap_or(f64::NAN),
        );
        // With this tolerance, a bound that coincides with a sample is not affected by rounding.
        let slack = ((end_s - start_s).abs() / times.len() as f64 * 1e-6).min(1e-6);
        let slack = if slack.is_finite() { slack } else { 0.0 };
        let start = match from {
            None => Some(0),
            Some(from) => times.iter().position(|t| *t >= from - slack),
        };
        let rows = start.map(|start| {
            let mut rest = times.iter().enumerate().skip(start);
            let end = to.and_then(|to| rest.find(|(_, t)| **t >= to - slack));
            start..end.map_or(times.len(), |(end, _)| end)
        });
        let whole = [from, to].iter().flatten().all(|bound| !bound.is_nan());
        match rows {
            Some(rows) if whole && !rows.is_empty() => Ok(rows),
            _ => {
                let bound = |value: Option<f64>, open: &str| value.map_or(open.to_owned(), |v| format!("{v} s"));
                Err(IoError::EmptySpan {
                    file: self.file.clone(),
                    span: format!("from {} to {}", bound(from, "the start"), bound(to, "the end")),
                    start_s,
                    end_s,
                })
            }
        }
    }
}

/// Returns the remedy for a time in a row that is not later than the time before.
fn backward_remedy(t: &[f64], row: usize, is_repeated: bool) -> &'static str {
    let previous = row.checked_sub(1).and_then(|row| t.get(row));
    let mut next = t.iter().skip(row).take(MIN_TRIAL_ROWS);
    if previous == t.get(row) && !is_repeated {
        "write t with more decimals, or give --fs HZ in place of t if the samples are evenly spaced"
    } else if previous == t.get(row) {
        "drop rows that were written twice with --drop-repeated, write t with more decimals, or give --fs HZ in place \
         of t if the samples are evenly spaced"
    } else if next.any(|t| Some(t) > previous) {
        "drop rows that were written twice with --drop-repeated, sort the rows by t if they are out of order, or give \
         --fs HZ in place of t if the samples are evenly spaced"
    } else {
        "use --trial t if the time restarts with each trial, drop rows that were written twice with --drop-repeated, \
         sort the rows by t if they are out of order, or give --fs HZ in place of t if the samples are evenly spaced"
    }
}
