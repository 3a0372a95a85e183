//! Search for all problems in columns that share a time and in the channels of a record.

use hoid_model::Record;

use super::grid::Grid;
use super::issue::QualityIssue;
use super::signals::{Signal, Signals};
use super::values::Levels;
use super::{stalls, timing, values};

/// Returns all problems found in columns that share a time.
pub(crate) fn find_issues(signals: &Signals<'_>) -> Vec<QualityIssue> {
    let mut found = Vec::new();
    if signals.row_count() == 0 {
        return found;
    }
    let grid = signals.time.map(|time| Grid::of(time.values));
    if let Some(grid) = &grid {
        stalls::check_non_advancing_rows(signals, grid, &mut found);
        timing::check_timing(signals, grid, &mut found);
    }
    let levels: Vec<Levels> = signals.columns.iter().map(|signal| Levels::of(signal.values)).collect();
    stalls::check_stalls(signals, &levels, grid.as_ref(), &mut found);
    for (signal, levels) in signals.columns.iter().zip(&levels) {
        values::check_values(signals, *signal, levels, &mut found);
    }
    found.sort_by(|a, b| (a.kind, &a.channel).cmp(&(b.kind, &b.channel)));
    found
}

/// Returns the problems with the values of e and u: stalls, saturation, quantisation, constants. The times are not
/// examined, since the samples of a record are always evenly spaced.
pub fn issues_of_channels(record: &Record) -> Vec<QualityIssue> {
    let channels = record.input_channel().into_iter().chain([record.output_channel()]);
    let columns = channels
        .map(|channel| Signal {
            name: &channel.name,
            values: &channel.values,
        })
        .collect();
    find_issues(&Signals {
        columns,
        nominal_hz: Some(1.0 / record.sample_time().s()),
        ..Signals::default()
    })
}

/// True if a name denotes a time column.
pub(crate) fn is_clock_name(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    ["time", "clock", "stamp"].iter().any(|word| name.contains(word))
}
