//! From the columns of a file to a record: which rows, on which grid, with which values.

use std::ops::Range;

use hoid_model::{Channel, ModelError, Record, SampleTime};

use crate::column_expression::{Signal, list};
use crate::preparation::Step;
use crate::repair::{self, OpenEnd};
use crate::sampling::{self, Uneven};
use crate::table::{Precision, Table};
use crate::{ColumnExpression, IoError, ReadOptions, ReadRecord, Trouble, TroubleKind, trouble};

/// Resampling makes at most so many samples out of one.
const LARGEST_FACTOR: usize = 100;

/// The record in a table, without rows that are there twice where that is asked for.
pub(crate) fn record_of(
    mut table: Table<'_>,
    options: &ReadOptions,
    drop_repeated: bool,
) -> Result<ReadRecord, IoError> {
    let file = table.source.file().to_owned();
    let names = table.names();
    let resolve = |expression: &ColumnExpression| expression.resolve(&names, &file);
    let input = options.input.as_ref().map(resolve).transpose()?;
    let output = resolve(&options.output)?;
    if input == Some(output) {
        let asked = options.output.to_string();
        return Err(IoError::SameColumn { file, asked });
    }
    let time = names.iter().position(|name| *name == "t");
    if time.is_none() && options.sampling_hz.is_none() {
        let available = list(&names);
        return Err(IoError::NoSampling { file, available });
    }
    let trouble = trouble_in(&table, time, input.into_iter().chain([output]), options);
    let mut steps = Vec::new();
    match (drop_repeated, time) {
        (true, Some(_)) => {
            let (kept, step) = repair::drop_repeated(table);
            table = kept;
            steps.extend(step);
        }
        (true, None) => table.notes.push(String::from(
            "there is no column t, so that a row written twice cannot be told from a value that holds: no row is dropped",
        )),
        _ => {}
    }
    let mut reader = Reader {
        table,
        options,
        file,
        steps,
    };
    let grid = reader.grid(time)?;
    let input = input.zip(options.input.as_ref());
    let read = reader.record(grid, time, input, (output, &options.output))?;
    Ok(ReadRecord { trouble, ..read })
}

/// What is wrong with the columns that are asked for, within the span.
///
/// # Errors
/// [`IoError::NoSuchColumn`] and [`IoError::Expression`].
pub(crate) fn trouble_of(table: &Table<'_>, options: &ReadOptions) -> Result<(Vec<Trouble>, Range<usize>), IoError> {
    let file = table.source.file();
    let names = table.names();
    let signals = options.input.iter().chain([&options.output]);
    let signals: Vec<Signal> = signals.map(|one| one.resolve(&names, file)).collect::<Result<_, _>>()?;
    let time = names.iter().position(|name| *name == "t");
    let rows = span_rows(table, time, options);
    Ok((trouble_in(table, time, signals.into_iter(), options), rows))
}

fn trouble_in(
    table: &Table<'_>,
    time: Option<usize>,
    signals: impl Iterator<Item = Signal>,
    options: &ReadOptions,
) -> Vec<Trouble> {
    let signals: Vec<Signal> = signals.collect();
    let mut used: Vec<usize> = signals.iter().copied().flat_map(Signal::columns).collect();
    used.sort_unstable();
    used.dedup();
    // A frequency to resample to says nothing of the clock of the file.
    let nominal_hz = options.sampling_hz.filter(|_| !options.repair.resample);
    let mut found = trouble::of_table(table, &used, time, nominal_hz, span_rows(table, time, options));
    // A difference may rightly have one constant term, such as a reference of zero.
    let names = |one: &Trouble, column: usize| table.columns[column].name == one.channel;
    let constant: Vec<Trouble> = found
        .iter()
        .filter(|one| one.kind == TroubleKind::Constant)
        .cloned()
        .collect();
    found.retain(|one| {
        let is_fair = |signal: &Signal| match signal {
            Signal::Difference(a, b) if names(one, *a) => constant.iter().all(|other| !names(other, *b)),
            Signal::Difference(a, b) if names(one, *b) => constant.iter().all(|other| !names(other, *a)),
            _ => false,
        };
        one.kind != TroubleKind::Constant || !signals.iter().any(is_fair)
    });
    found
}

/// The rows of the span, as far as the time of the file tells.
fn span_rows(table: &Table<'_>, time: Option<usize>, options: &ReadOptions) -> Range<usize> {
    let at = |row: usize| match (time, options.sampling_hz) {
        (Some(time), _) => table.columns[time].values[row],
        (None, Some(hz)) => row as f64 / hz,
        (None, None) => f64::NAN,
    };
    let (from, to) = options.span_s;
    let start = from.map_or(0, |from| {
        (0..table.rows).find(|row| at(*row) >= from).unwrap_or(table.rows)
    });
    let end = to.and_then(|to| (start..table.rows).find(|row| at(*row) >= to));
    start..end.unwrap_or(table.rows)
}

/// Where the samples of the record come from.
struct Grid {
    /// Rows of the table in use.
    rows: Range<usize>,
    start_s: f64,
    sample_time: SampleTime,
    /// The number of samples to make out of rows whose t is uneven.
    resampled: Option<usize>,
    /// The t of the rows where it is known to increase.
    t: Option<Vec<f64>>,
}

struct Reader<'a> {
    table: Table<'a>,
    options: &'a ReadOptions,
    file: String,
    steps: Vec<Step>,
}

impl Reader<'_> {
    fn grid(&mut self, time: Option<usize>) -> Result<Grid, IoError> {
        let given = match self.options.sampling_hz {
            None => None,
            Some(hz) => match SampleTime::new(1.0 / hz) {
                Ok(ts) => Some(ts),
                Err(_) => return Err(IoError::SamplingFrequency { found: hz }),
            },
        };
        match (time, given) {
            (Some(time), None) => self.grid_of_t(time, None),
            (Some(time), Some(ts)) if self.options.repair.resample => self.grid_of_t(time, Some(ts)),
            (time, Some(ts)) => self.counted_grid(time, ts),
            (None, None) => Err(IoError::NoSampling {
                file: self.file.clone(),
                available: list(&self.table.names()),
            }),
        }
    }

    /// Samples counted from the first at a given frequency.
    fn counted_grid(&mut self, time: Option<usize>, sample_time: SampleTime) -> Result<Grid, IoError> {
        let first = time.map(|time| self.table.columns[time].values[0]);
        let start = first.filter(|t| t.is_finite()).unwrap_or(0.0);
        let ts = sample_time.s();
        match (time, first) {
            (None, _) if self.options.repair.resample => {
                self.table.notes.push(String::from(
                    "there is no column t to resample along: the samples count as even",
                ));
            }
            (Some(time), Some(first)) if first.is_finite() => {
                let t = &self.table.columns[time].values;
                let stated = (t[t.len() - 1] - first) / (t.len() - 1) as f64;
                // More than one in a hundred is more than a clock is off.
                if (stated - ts).abs() > 0.01 * ts {
                    self.table.notes.push(format!(
                        "the given sampling frequency of {} Hz counts; t gives {:.6} Hz on average",
                        1.0 / ts,
                        1.0 / stated
                    ));
                }
            }
            (Some(_), _) => {
                let place = self.table.source.place(0);
                self.table.notes.push(format!(
                    "t is no number on {place}: the time of the first sample is taken as 0 s"
                ));
            }
            _ => {}
        }
        let times: Vec<f64> = (0..self.table.rows).map(|k| start + k as f64 * ts).collect();
        let rows = self.rows(&times)?;
        Ok(Grid {
            start_s: times[rows.start],
            rows,
            sample_time,
            resampled: None,
            t: None,
        })
    }

    /// The sampling of the column t, or the one to resample it to.
    fn grid_of_t(&mut self, time: usize, given: Option<SampleTime>) -> Result<Grid, IoError> {
        let rows = self.rows(&self.table.columns[time].values)?;
        let t = self.values(time, rows.clone(), None)?;
        let precision = self.table.columns[time].precision;
        let stated = self.table.sample_time_s;
        let sampled = match (sampling::even(&t, precision, stated), given) {
            (Ok(even), Some(given)) if !given.matches(self.sample_time(even.sample_time_s)?) => Ok(given),
            (Ok(even), _) => {
                self.table.notes.extend(even.note);
                return Ok(Grid {
                    rows,
                    start_s: t[0],
                    sample_time: given.map_or_else(|| self.sample_time(even.sample_time_s), Ok)?,
                    resampled: None,
                    t: Some(t),
                });
            }
            (Err(Uneven::Gap { .. } | Uneven::Jitter { .. }), Some(given)) => Ok(given),
            (Err(Uneven::Gap { .. } | Uneven::Jitter { .. }), None) if self.options.repair.resample => {
                match sampling::typical(&t, precision) {
                    Ok(ts) => Ok(self.sample_time(ts)?),
                    Err(uneven) => Err(uneven),
                }
            }
            (Err(uneven), _) => Err(uneven),
        };
        let sample_time = sampled.map_err(|uneven| self.uneven(uneven, &rows, &t))?;
        self.resampled_grid(rows, t, sample_time, precision)
    }

    fn resampled_grid(
        &mut self,
        rows: Range<usize>,
        t: Vec<f64>,
        sample_time: SampleTime,
        precision: Precision,
    ) -> Result<Grid, IoError> {
        let (start_s, end_s, ts) = (t[0], t[t.len() - 1], sample_time.s());
        // The rounding of the last t does not cost the last sample.
        let slack = 1e-6 + (precision.unit(end_s) / ts).min(0.5);
        let samples = ((end_s - start_s) / ts + slack).floor() + 1.0;
        if samples > (LARGEST_FACTOR * t.len()) as f64 || !samples.is_finite() {
            return Err(IoError::ResampledTooLong {
                file: self.file.clone(),
                start_s,
                end_s,
                samples,
                rows: t.len(),
                factor: LARGEST_FACTOR,
            });
        }
        let longest = t.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        self.steps.push(Step::Interpolate {
            from_samples: t.len(),
            to_samples: samples as usize,
            to_hz: 1.0 / ts,
            longest_step_s: longest,
        });
        // Half as many samples or fewer: what lies above the new Nyquist frequency folds down.
        if 2.0 * samples <= t.len() as f64 {
            self.table.notes.push(String::from(
                "resampling to the lower frequency applied no low-pass filter: read at the old frequency and give the new one with --new-fs if the recording holds power above half of it",
            ));
        }
        Ok(Grid {
            rows,
            start_s,
            sample_time,
            resampled: Some(samples as usize),
            t: Some(t),
        })
    }

    fn uneven(&self, uneven: Uneven, rows: &Range<usize>, t: &[f64]) -> IoError {
        let file = self.file.clone();
        let place = |row: usize| self.table.source.place(rows.start + row);
        match uneven {
            Uneven::TooFew => IoError::TooFewSamples { file, found: t.len() },
            Uneven::NotIncreasing { row } => IoError::NotIncreasing {
                file,
                place: place(row),
                found: t[row],
                previous: t[row - 1],
            },
            Uneven::Gap {
                row,
                missing,
                gaps,
                sample_time_s,
            } => IoError::Gap {
                file,
                place: place(row),
                after_s: t[row],
                next_s: t[row + 1],
                missing,
                gaps,
                sample_time_s,
            },
            Uneven::Jitter {
                row,
                deviation_s,
                tolerance_s,
                sample_time_s,
            } => IoError::Jitter {
                file,
                place: place(row),
                found: t[row],
                deviation_s,
                tolerance_s,
                sample_time_s,
            },
        }
    }

    fn sample_time(&self, ts_s: f64) -> Result<SampleTime, IoError> {
        SampleTime::new(ts_s).map_err(|source| self.model(source))
    }

    fn model(&self, source: ModelError) -> IoError {
        IoError::Model {
            file: self.file.clone(),
            source,
        }
    }

    /// The rows inside the span.
    fn rows(&self, times: &[f64]) -> Result<Range<usize>, IoError> {
        let (from, to) = self.options.span_s;
        let mut finite = times.iter().copied().filter(|t| t.is_finite());
        let (start_s, end_s) = (
            finite.next().unwrap_or(f64::NAN),
            finite.next_back().unwrap_or(f64::NAN),
        );
        // A bound that falls on a sample, up to rounding, takes that sample.
        let slack = ((end_s - start_s).abs() / times.len() as f64 * 1e-6).min(1e-6);
        let slack = if slack.is_finite() { slack } else { 0.0 };
        let start = match from {
            None => Some(0),
            Some(from) => times.iter().position(|t| *t >= from - slack),
        };
        let rows = start.map(|start| {
            let length = to.and_then(|to| times[start..].iter().position(|t| *t >= to - slack));
            start..length.map_or(times.len(), |length| start + length)
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

    /// The values of a column in use: all finite, the missing ones bridged where that was asked for.
    fn values(&mut self, column: usize, rows: Range<usize>, t: Option<&[f64]>) -> Result<Vec<f64>, IoError> {
        let source = &mut self.table.columns[column];
        let may_fill = self.options.repair.fill;
        let bridgeable =
            |row: &usize| may_fill && source.values[*row].is_nan() && source.texts.binary_search(row).is_err();
        let bad = |row: &usize| !source.values[*row].is_finite() && !bridgeable(row);
        if let Some(row) = rows.clone().find(bad) {
            return Err(self.table.bad_value(column, row, rows));
        }
        // Nobody reads a column twice: what a file of hours fills is not copied.
        let mut values = std::mem::take(&mut source.values);
        values.truncate(rows.end);
        values.drain(..rows.start);
        let bridged = repair::fill(&mut values, t).map_err(|open| {
            let (row, end) = match open {
                OpenEnd::Start => (rows.start, "start"),
                OpenEnd::End => (rows.end - 1, "end"),
            };
            IoError::NothingToBridgeTo {
                file: self.file.clone(),
                place: self.table.source.place(row),
                column: source.name.clone(),
                end,
            }
        })?;
        if bridged.values > 0 {
            self.steps.push(Step::Fill {
                channel: source.name.clone(),
                values: bridged.values,
                longest: bridged.longest,
            });
        }
        Ok(values)
    }

    fn record(
        mut self,
        grid: Grid,
        time: Option<usize>,
        input: Option<(Signal, &ColumnExpression)>,
        output: (Signal, &ColumnExpression),
    ) -> Result<ReadRecord, IoError> {
        let signals = || input.into_iter().chain([output]);
        let used = |column: usize| signals().any(|(signal, _)| signal.columns().any(|used| used == column));
        let mut columns: Vec<Option<Channel>> = Vec::with_capacity(self.table.columns.len());
        for column in 0..self.table.columns.len() {
            let name = self.table.columns[column].name.clone();
            if !used(column) && (name.is_empty() || Some(column) == time) {
                columns.push(None);
                continue;
            }
            let unit = self.table.columns[column].unit.clone();
            let of_time = grid.t.as_ref().filter(|_| Some(column) == time);
            let values = match of_time {
                Some(t) => Ok(t.clone()),
                None => self.values(column, grid.rows.clone(), grid.t.as_deref()),
            };
            match values {
                Ok(values) => {
                    let values = match grid.t.as_ref().zip(grid.resampled) {
                        None => values,
                        Some((t, n)) => repair::resample(t, &values, grid.start_s, grid.sample_time.s(), n),
                    };
                    columns.push(Some(Channel::new(name, unit, values)));
                }
                Err(error) if used(column) => return Err(error),
                Err(error) => {
                    self.table.notes.push(format!("column {name} is left out: {error}"));
                    columns.push(None);
                }
            }
        }
        // What is made of columns first: then a column that is a signal by itself can move.
        let mut made: Vec<Channel> = signals()
            .map(|(signal, expression)| combine(signal, expression, &columns))
            .collect();
        for ((signal, _), made) in signals().zip(&mut made) {
            if let Signal::Column(column) = signal {
                *made = columns[column].take().unwrap_or_else(nothing);
            }
        }
        let output = made.pop().unwrap_or_else(nothing);
        let record = match made.pop() {
            Some(input) => Record::new(grid.sample_time, input, output),
            None => Record::of_output(grid.sample_time, output),
        };
        let mut record = record.map_err(|source| self.model(source))?.starting_at(grid.start_s);
        for channel in columns.into_iter().flatten() {
            record = record.with_channel(channel).map_err(|source| self.model(source))?;
        }
        Ok(ReadRecord {
            record,
            notes: self.table.notes,
            steps: self.steps,
            trouble: Vec::new(),
        })
    }
}

/// A channel without samples, which no record takes.
fn nothing() -> Channel {
    Channel::new("", "", Vec::new())
}

/// The signal that an expression makes of columns; nothing where it is a column by itself. Its name is the expression; a difference has a unit
/// where both terms share it.
fn combine(signal: Signal, expression: &ColumnExpression, columns: &[Option<Channel>]) -> Channel {
    let nothing = nothing();
    let column = |index: usize| columns[index].as_ref().unwrap_or(&nothing);
    match signal {
        Signal::Column(_) => nothing,
        Signal::Negative(a) => {
            let values = column(a).values.iter().map(|v| -v).collect();
            Channel::new(expression.to_string(), column(a).unit.clone(), values)
        }
        Signal::Difference(a, b) => {
            let (a, b) = (column(a), column(b));
            let values = a.values.iter().zip(&b.values).map(|(a, b)| a - b).collect();
            let unit = if a.unit == b.unit { a.unit.as_str() } else { "" };
            Channel::new(expression.to_string(), unit, values)
        }
    }
}
