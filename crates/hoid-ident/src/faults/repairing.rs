//! Repair of a record with faults: segments, actions, and the resulting findings.

use std::ops::Range;

use hoid_model::{Channel, Fault, FaultAction, FaultHandling, FaultKind, Finding, ModelError, Record, fault_findings};

use super::{
    direction::find_wrong_direction,
    limits::{MAX_SPIKE_SHARE, MIN_SEGMENT_S},
    search::{FaultSpan, find_faults},
    spikes,
};
use crate::frequency::COMMON_EXCITATIONS;

/// Largest sample time with which a person can be identified, s.
pub const MAX_SAMPLE_TIME_S: f64 = 0.5;

/// A record after the repair: one or more segments, with the faults and findings.
#[derive(Debug, Clone, PartialEq)]
pub struct RepairedRecord {
    /// Usable segments, in order of time; the original record if nothing usable is left.
    pub segments: Vec<Record>,
    /// Faults with the action taken, in order of time.
    pub faults: Vec<Fault>,
    /// Findings about the faults, for the verdict on any result from the record.
    pub findings: Vec<Finding>,
}

/// Finds the faults of e and u of a record and the spikes of its excitation, and repairs them as specified.
///
/// # Errors
/// There are no errors for a valid record; otherwise the [`ModelError`] from creating a repaired record is returned.
pub fn repair(record: &Record, handling: FaultHandling) -> Result<RepairedRecord, ModelError> {
    let all_of_it = |record: &Record, kind: FaultKind, size: f64| Fault {
        kind,
        channel: String::new(),
        from_s: record.time_s(0),
        to_s: record.time_s(record.len()),
        samples: record.len(),
        size,
        deviations: None,
        action: FaultAction::Reported,
    };
    let untouched = |faults: Vec<Fault>| RepairedRecord {
        findings: fault_findings(&faults, record.len()),
        segments: vec![record.clone()],
        faults,
    };
    if handling == FaultHandling::Keep {
        return Ok(untouched(Vec::new()));
    }
    // The statistics for faults use fixed times in seconds and would give many false alarms at a longer sample time.
    let ts = record.sample_time().s();
    if ts > MAX_SAMPLE_TIME_S {
        return Ok(untouched(vec![all_of_it(record, FaultKind::TimeUnit, ts)]));
    }
    let (input, output, mut others) = record.clone().into_channels();
    let of_excitation = repair_excitations(&mut others, record);
    let mut channels: Vec<Channel> = input.into_iter().chain([output]).collect();
    let mut values: Vec<Vec<f64>> = channels.iter().map(|c| c.values.clone()).collect();
    let places = find_faults(&mut values, ts, handling == FaultHandling::Cut);
    let of = |place: &FaultSpan, action: FaultAction| Fault {
        kind: place.kind,
        channel: place.channel.map_or_else(String::new, |c| channels[c].name.clone()),
        from_s: record.time_s(place.samples.start),
        to_s: record.time_s(place.samples.end),
        samples: place.samples.len(),
        size: place.size,
        deviations: place.deviations,
        action,
    };
    let mut faults: Vec<Fault> = places.iter().map(|(place, action)| of(place, *action)).collect();
    faults.extend(of_excitation);
    faults.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    let repaired = |fault: &Fault| fault.action != FaultAction::Reported;
    if handling == FaultHandling::Report || !faults.iter().any(repaired) {
        faults.extend(find_wrong_direction(record).map(|(kind, size)| all_of_it(record, kind, size)));
        faults.iter_mut().for_each(|fault| fault.action = FaultAction::Reported);
        return Ok(untouched(faults));
    }
    let kept = segments(record.len(), &places, (MIN_SEGMENT_S / ts).ceil() as usize);
    if kept.is_empty() {
        faults.iter_mut().for_each(|fault| fault.action = FaultAction::Reported);
        let mut nothing = untouched(faults);
        nothing.findings.push(Finding::undetermined(
            "faults",
            format!(
                "{} has no fault-free span of {MIN_SEGMENT_S} s: the whole record is unusable",
                record.label()
            ),
        ));
        return Ok(nothing);
    }
    for (channel, values) in channels.iter_mut().zip(values) {
        channel.values = values;
    }
    let mut channels = channels.into_iter();
    let (first, second) = (channels.next(), channels.next());
    let whole = match (first, second) {
        (Some(input), Some(output)) => Record::new(record.sample_time(), input, output)?,
        (Some(output), None) => Record::from_output(record.sample_time(), output)?,
        // A record always has an output.
        _ => record.clone(),
    };
    let whole = whole.labelled(record.label()).starting_at(record.time_s(0));
    let whole = others.into_iter().try_fold(whole, Record::with_channel)?;
    let segments: Vec<Record> = match kept.as_slice() {
        [only] if only.len() == whole.len() => vec![whole],
        several => several
            .iter()
            .map(|s| whole.span(whole.time_s(s.start), whole.time_s(s.end)))
            .collect::<Result<_, _>>()?,
    };
    // The direction is tested after the repair, because faults could be mistaken for a response.
    let longest = segments.iter().max_by_key(|segment: &&Record| segment.len());
    faults.extend(
        longest
            .and_then(|r| Some((r, find_wrong_direction(r)?)))
            .map(|(r, (kind, size))| all_of_it(r, kind, size)),
    );
    Ok(RepairedRecord {
        segments,
        findings: fault_findings(&faults, record.len()),
        faults,
    })
}

/// Finds the spikes of the channels that have the name of a common excitation. The spikes are bridged: no model is
/// fitted to such a channel, and only its lines are used.
fn repair_excitations(others: &mut [Channel], record: &Record) -> Vec<Fault> {
    let ts = record.sample_time().s();
    let mut all = Vec::new();
    for channel in others
        .iter_mut()
        .filter(|c| COMMON_EXCITATIONS.contains(&c.name.as_str()))
    {
        let mut values = channel.values.clone();
        let found = spikes::find_spikes(&mut values, ts);
        let samples: usize = found.iter().map(|spike| spike.samples.len()).sum();
        let few = samples as f64 <= (MAX_SPIKE_SHARE * values.len() as f64).max(3.0);
        if few {
            channel.values = values;
        }
        all.extend(found.into_iter().map(|spike| Fault {
            kind: FaultKind::Spike,
            channel: channel.name.clone(),
            from_s: record.time_s(spike.samples.start),
            to_s: record.time_s(spike.samples.end),
            samples: spike.samples.len(),
            size: spike.size,
            deviations: Some(spike.deviations),
            action: if few {
                FaultAction::Bridged
            } else {
                FaultAction::Reported
            },
        }));
    }
    all
}

/// Returns the segments between cuts that have at least `shortest` and at least 50 samples. A record without cuts is
/// returned whole.
fn segments(n: usize, places: &[(FaultSpan, FaultAction)], shortest: usize) -> Vec<Range<usize>> {
    let mut out = vec![false; n];
    let mut ends = vec![false; n + 1];
    for (place, _) in places.iter().filter(|(_, action)| *action == FaultAction::Cut) {
        ends[place.samples.start.min(n)] = true;
        if place.kind != FaultKind::Step {
            out[place.samples.clone()].fill(true);
        }
    }
    let mut all: Vec<Range<usize>> = Vec::new();
    for t in (0..n).filter(|t| !out[*t]) {
        match all.last_mut() {
            Some(last) if last.end == t && !ends[t] => last.end = t + 1,
            _ => all.push(t..t + 1),
        }
    }
    all.retain(|segment| segment.len() >= shortest.max(50) || segment.len() == n);
    all
}
