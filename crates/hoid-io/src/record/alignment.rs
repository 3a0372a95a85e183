//! Alignment of channels that were recorded late, without losing samples at the ends of the span.
//!
//! If a channel is shifted by d samples, d rows are missing at one end of the data, and a span of whole periods would
//! lose its last period. If the file extends beyond the span, additional rows are therefore read, and the span is cut
//! out after the channels have been shifted, so it keeps its length. If the file does not extend far enough, or if the
//! rate changes (the filters of the rate change cut more samples than the offsets), the rows without a sample are cut.

use std::collections::BTreeMap;
use std::path::Path;

use hoid_model::Record;

use super::from_table::{ReadRecord, record_of};
use super::read_options::ReadOptions;
use super::sparse::close_gaps;
use crate::IoError;
use crate::formats::{path_without_gz, table_of_file};
use crate::preparation::{NewRate, Offset, Preparation, Step};

/// Number of additional rows that are read beyond each end of the span for interpolation at a fractional offset.
const INTERPOLATION_MARGIN_ROWS: f64 = 64.0;

/// Reads and prepares a record whose output is additionally shifted earlier by `late_samples`.
///
/// # Errors
/// As [`read_prepared`](crate::read_prepared).
pub fn read_aligned(
    path: &Path,
    options: &ReadOptions,
    preparation: &Preparation,
    late_samples: f64,
) -> Result<ReadRecord, IoError> {
    let drop_repeated = preparation.drop_repeated;
    let read = read_as_recorded(path, options, drop_repeated)?;
    let late = Preparation {
        offset: BTreeMap::from([("u".to_owned(), Offset::Samples(late_samples))]),
        ..Preparation::default()
    };
    let spanned = options.span_s != (None, None);
    if spanned && preparation.rate == NewRate::Kept && (late_samples != 0.0 || !preparation.offset.is_empty()) {
        let ts_s = read.record.sample_time().s();
        let reach_s = ts_s * max_shift(preparation, late_samples, ts_s);
        let wider = ReadOptions {
            span_s: (
                options.span_s.0.map(|t| t - reach_s),
                options.span_s.1.map(|t| t + reach_s),
            ),
            ..options.clone()
        };
        if let Ok(wide) = read_as_recorded(path, &wider, drop_repeated)
            && let Some((record, steps)) = shift_and_cut(wide.record, &read.record, preparation, &late)
        {
            let steps = [read.steps, steps].concat();
            return Ok(ReadRecord { record, steps, ..read });
        }
    }
    let read = read.prepare(preparation)?;
    if late_samples == 0.0 {
        Ok(read)
    } else {
        read.prepare(&late)
    }
}

/// Reads the record without preparation.
pub(super) fn read_as_recorded(path: &Path, options: &ReadOptions, drop_repeated: bool) -> Result<ReadRecord, IoError> {
    let file = path.display().to_string();
    let mut bytes = Vec::new();
    let (table, steps) = close_gaps(table_of_file(path, &file, &mut bytes, options)?, options)?;
    let unpacked = path_without_gz(path);
    let label = unpacked
        .as_deref()
        .unwrap_or(path)
        .file_stem()
        .map(|stem| stem.to_string_lossy().into_owned());
    let read = record_of(table, options, drop_repeated)?;
    Ok(ReadRecord {
        record: read.record.labelled(label.unwrap_or_default()),
        steps: [steps, read.steps].concat(),
        ..read
    })
}

/// Returns an upper bound of the shift of a channel in samples, including the samples needed for interpolation.
fn max_shift(preparation: &Preparation, late_samples: f64, ts_s: f64) -> f64 {
    let samples = |offset: &Offset| match offset {
        Offset::Samples(samples) => *samples,
        Offset::Seconds(seconds) => seconds / ts_s,
    };
    let offsets: Vec<f64> = preparation.offset.values().map(samples).chain([late_samples]).collect();
    let most = offsets.iter().map(|d| d.abs()).fold(0.0, f64::max) + late_samples.abs();
    let between = offsets.iter().any(|d| (d - d.round()).abs() > 1e-6);
    most.ceil() + if between { 2.0 * INTERPOLATION_MARGIN_ROWS } else { 0.0 }
}

/// Shifts the channels of the longer record `wide`, cuts out the span, and applies the remaining steps; `None` if this
/// fails: processing the shorter record then gives the error.
fn shift_and_cut(
    wide: Record,
    narrow: &Record,
    preparation: &Preparation,
    late: &Preparation,
) -> Option<(Record, Vec<Step>)> {
    let first = Preparation {
        units: preparation.units.clone(),
        scale: preparation.scale.clone(),
        offset: preparation.offset.clone(),
        ..Preparation::default()
    };
    let rest = Preparation {
        run_in_s: preparation.run_in_s,
        detrend: preparation.detrend,
        ..Preparation::default()
    };
    let ts_s = narrow.sample_time().s();
    let (begin_s, end_s) = (narrow.time_s(0), narrow.time_s(narrow.len()));
    let label = narrow.label().to_owned();
    let (record, mut steps) = first.apply(wide).ok()?;
    let (record, of_late) = late.apply(record).ok()?;
    let record = record.span(begin_s, end_s).ok()?.labelled(label);
    let at_start = ((record.time_s(0) - begin_s) / ts_s).round() as usize;
    let lost = (
        at_start,
        narrow.len().saturating_sub(at_start).saturating_sub(record.len()),
    );
    steps.extend(of_late);
    for step in &mut steps {
        if let Step::Offset { cut_samples, .. } = step {
            *cut_samples = lost;
        }
    }
    let (record, of_rest) = rest.apply(record).ok()?;
    steps.extend(of_rest);
    Some((record, steps))
}
