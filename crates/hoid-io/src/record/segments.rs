//! Records between faults of a recording: a file is cut where samples are missing, constant or clipped, and each
//! segment becomes a record.
//!
//! No data are invented, and each segment has its own initial states in a fit. However, the choice of the excluded
//! samples depends on the recorded data. Without the saturated samples, the largest responses are missing, which biases
//! the estimate from the remaining samples; if C1 is clipped at 1.5 standard deviations, its lead is biased by 9 %. If
//! the clipped samples are included, the gain is 12 % too small.

use std::ops::Range;
use std::path::Path;

use super::alignment::read_as_recorded;
use super::file::read_prepared;
use super::from_table::ReadRecord;
use super::read_options::{ReadOptions, TrialChoice};
use super::sparse::close_gaps;
use crate::IoError;
use crate::data_quality::{QualityIssue, QualityIssueKind, issues_of_record};
use crate::formats::table_of_file;
use crate::preparation::{Preparation, Step};
use crate::wording::{format_decimal, list_names};

/// Reads the segments of a file that lie between faults of the given kinds and last at least `shortest_s`, in their
/// order; if no kind is given, reads the whole record. The first segment carries the problems with the file as a whole.
///
/// In a file with several trials, the segments of each trial are read, one trial after the other.
///
/// # Errors
/// As [`read_prepared`]; [`IoError::Preparation`] for kinds without a location (such as a clock error or a constant
/// channel), for a run-in, and if no segment remains.
pub fn read_segments(
    path: &Path,
    options: &ReadOptions,
    preparation: &Preparation,
    mask: &[QualityIssueKind],
    shortest_s: f64,
) -> Result<Vec<ReadRecord>, IoError> {
    let read = read_trial(path, options, preparation, mask, shortest_s);
    let (by, trials) = match read {
        Err(IoError::SeveralTrials {
            trial_column: by,
            trials,
            ..
        }) if !options.trial.as_ref().is_some_and(TrialChoice::selects_one_trial) => (by, trials),
        read => return read,
    };
    let mut all = Vec::new();
    for trial in &trials {
        let one = ReadOptions {
            trial: Some(TrialChoice::single(&by, trial)),
            ..options.clone()
        };
        for mut read in read_trial(path, &one, preparation, mask, shortest_s)? {
            let label = format!("{} ({by} {trial})", read.record.label());
            read.record = read.record.labelled(label);
            if all.is_empty() {
                let count = trials.len();
                read.notes.push(format!(
                    "{count} trials according to {by} ({}): each is a separate record",
                    list_of_trials(&trials)
                ));
            } else {
                // Notes about the file are reported with its first trial only.
                read.notes.clear();
            }
            all.push(read);
        }
    }
    Ok(all)
}

fn list_of_trials(trials: &[String]) -> String {
    list_names(&trials.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Reads the segments of a single trial.
fn read_trial(
    path: &Path,
    options: &ReadOptions,
    preparation: &Preparation,
    mask: &[QualityIssueKind],
    shortest_s: f64,
) -> Result<Vec<ReadRecord>, IoError> {
    if mask.is_empty() {
        return Ok(vec![read_prepared(path, options, preparation)?]);
    }
    let file = path.display().to_string();
    let refuse = |found: String, expected: &str| IoError::Preparation {
        record: file.clone(),
        step: "mask",
        found,
        expected: expected.to_owned(),
    };
    if let Some(kind) = mask
        .iter()
        .find(|kind| !QualityIssueKind::MASKABLE_KINDS.contains(kind))
    {
        let names = QualityIssueKind::MASKABLE_KINDS.map(QualityIssueKind::name).join(", ");
        return Err(refuse(kind.name().to_owned(), &format!("one or more of {names}")));
    }
    if preparation.run_in_s != 0.0 {
        return Err(refuse(
            "a run-in".to_owned(),
            "a span that starts after the run-in (--from)",
        ));
    }
    if !(shortest_s >= 0.0 && shortest_s.is_finite()) {
        return Err(refuse(
            format!("a shortest segment of {shortest_s} s"),
            "a time of 0 s or more",
        ));
    }
    let mut bytes = Vec::new();
    let (table, _) = close_gaps(table_of_file(path, &file, &mut bytes, options)?, options)?;
    let (quality_issues, rows) = issues_of_record(&table, options)?;
    let time = table.names().iter().position(|name| *name == "t");
    let at = |row: usize| match (time, options.sampling_hz) {
        (Some(time), None) => table.value(time, row),
        // With a given sampling frequency, the time is counted from the first time in the file.
        (time, Some(hz)) => {
            let first = time.map_or(0.0, |time| table.value(time, 0));
            if first.is_finite() { first } else { 0.0 }.max(f64::MIN) + row as f64 / hz
        }
        (None, None) => f64::NAN,
    };
    let mut segments = Vec::new();
    for segment in ranges_between_faults(&quality_issues, mask, rows.clone()) {
        let (from, last) = (at(segment.start), at(segment.end.saturating_sub(1)));
        // The comparison is false if a time is NaN, so such a segment is skipped.
        let is_long = last - from >= shortest_s;
        if !is_long {
            continue;
        }
        let to = if segment.end < rows.end {
            Some(at(segment.end))
        } else {
            options.span_s.1
        };
        let span = ReadOptions {
            span_s: (Some(from), to),
            ..options.clone()
        };
        // The rows next to a segment are excluded faults; an offset therefore does not use rows beyond the segment.
        let read = read_as_recorded(path, &span, preparation.drop_repeated)?.prepare(preparation)?;
        let to_s = to.unwrap_or(last);
        let mut steps = vec![Step::Mask {
            what: mask.iter().map(|kind| kind.name()).collect(),
            from_s: from,
            to_s,
        }];
        steps.extend(read.steps);
        let label = format!(
            "{} ({} to {} s)",
            read.record.label(),
            format_decimal(from),
            format_decimal(to_s)
        );
        segments.push(ReadRecord {
            record: read.record.labelled(label),
            steps,
            quality_issues: Vec::new(),
            ..read
        });
    }
    match segments.first_mut() {
        Some(first) => first.quality_issues = quality_issues,
        None => {
            let names: Vec<&str> = mask.iter().map(|kind| kind.name()).collect();
            return Err(refuse(
                format!("no segment of {shortest_s} s without {} rows", names.join(" or ")),
                "a smaller --shortest, or fewer kinds in --mask",
            ));
        }
    }
    Ok(segments)
}

/// Returns the row ranges between faults of the given kinds.
fn ranges_between_faults(issues: &[QualityIssue], mask: &[QualityIssueKind], rows: Range<usize>) -> Vec<Range<usize>> {
    // `out` marks excluded rows; `cut` marks rows at which the record is cut.
    let mut out = vec![false; rows.len()];
    let mut cut = out.clone();
    for found in issues.iter().filter(|found| mask.contains(&found.kind)) {
        for place in &found.row_spans {
            // Rows of a location are counted from 1.
            let first = place.row.saturating_sub(1).saturating_sub(rows.start);
            if found.kind == QualityIssueKind::Gap {
                cut.iter_mut().skip(first).skip(1).take(1).for_each(|cut| *cut = true);
            } else {
                out.iter_mut().skip(first).take(place.rows).for_each(|out| *out = true);
            }
        }
    }
    let mut segments: Vec<Range<usize>> = Vec::new();
    for (row, (_, cut)) in rows.zip(out.iter().zip(cut)).filter(|(_, (out, _))| !**out) {
        let end = row.saturating_add(1);
        match segments.last_mut() {
            Some(segment) if segment.end == row && !cut => segment.end = end,
            _ => segments.push(row..end),
        }
    }
    segments
}
