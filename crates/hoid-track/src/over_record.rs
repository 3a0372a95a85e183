//! A recursive estimate over a record.

use hoid_ident::{Fit, IdentError, check_independent_inputs};
use hoid_model::Record;
use hoid_numerics::statistics::mean;

use crate::{
    change::Change,
    diagnostics::COMPARED_RAD_S,
    idle::idle_head,
    open_loop::OpenLoop,
    options::TrackOptions,
    recursion::Sample,
    response::Response,
    trace::{self, Trace, pack},
    tracker::Tracker,
    two_sided::CausalRun,
};

/// Tracks a record and returns the trace, which has a row for every `every`-th sample.
///
/// # Errors
/// [`IdentError`] if the options contradict each other or the record, or if the start fit fails.
pub fn track(record: &Record, options: &TrackOptions, every: usize) -> Result<Trace, IdentError> {
    track_from(record, options, every, None)
}

/// Like [`track`], with a given fit of the start span by [`TrackOptions::start_estimator`], so several methods with the
/// same start need this fit only once.
///
/// # Errors
/// Same as [`track`].
pub fn track_from(
    record: &Record,
    options: &TrackOptions,
    every: usize,
    start: Option<&Fit>,
) -> Result<Trace, IdentError> {
    track_with(record, options, every, start, &mut |_, _| {})
}

/// Like [`track_from`]; after every sample, `each` is called with the tracker and the index of the sample.
pub(crate) fn track_with(
    record: &Record,
    options: &TrackOptions,
    every: usize,
    start: Option<&Fit>,
    each: &mut dyn FnMut(&mut Tracker, usize),
) -> Result<Trace, IdentError> {
    trace::check_row_interval(every)?;
    options.check()?;
    let sample_time = record.sample_time();
    if options.structure.has_input() && record.input_channel().is_none() {
        return Err(IdentError::NoInput {
            structure: options.structure.label(),
            label: record.label().to_owned(),
        });
    }
    if let Some(prior) = options.method.person_prior() {
        let input = record.input_channel().map_or("", |channel| &channel.unit);
        prior.check(sample_time, [input, &record.output_channel().unit])?;
    }
    let (span, end_s) = match options.start_span(record) {
        Some((from, to)) => (Some(record.span(from, to)?), to),
        None => (None, f64::NEG_INFINITY),
    };
    let mut options = options.clone();
    options.method.inner_mut().prepare(record);
    let options = &options;
    let reference = reference_signal(record, options)?;
    let mut tracker = Tracker::from_fit(options, span.as_ref(), start, sample_time)?;
    let known = span.is_some() && options.method.initial_covariance().is_none() && !options.method.is_self_starting();
    let from_s = options
        .update_from_s
        .unwrap_or(if known { end_s } else { f64::NEG_INFINITY })
        .max(record.time_s(0));
    let further_rad_s = options
        .further
        .as_ref()
        .map_or_else(Vec::new, |_| options.further_rad_s());
    let rows = record.len().div_ceil(every);
    let mut trace = Trace::empty(options.clone(), sample_time, rows, every);
    trace.start = tracker.start.fit.clone();
    trace.updated_from_s = from_s;
    let (input, output) = (record.input(), record.output());
    let p = options.coefficient_count();
    let mut covariance = vec![0.0; p * p];
    // The limit is half a sample earlier, so rounding of the times has no effect.
    let first_update = from_s - sample_time.s() / 2.0;
    for k in 0..record.len() {
        let t = record.time_s(k);
        let sample = Sample {
            e: input.get(k).copied().unwrap_or(0.0),
            u: output[k],
            reference: reference.and_then(|r| r.get(k).copied()),
        };
        let outcome = tracker.update(sample, t >= first_update);
        each(&mut tracker, k);
        if let Some(change) = tracker.change() {
            trace.changes.push((t, change));
        }
        if let Some(revised) = tracker.revised_change()
            && let Some((_, last)) = trace.changes.last_mut()
        {
            *last = Change {
                odds: last.odds,
                ..revised
            };
        }
        if let Some(event) = tracker.event() {
            if let Some(from) = event.withdrawn_from_s(t, sample_time) {
                trace.changes.retain(|(declared, _)| *declared < from);
            }
            event.at(t, sample_time).append_to(&mut trace.faults);
        }
        if (k + 1) % every != 0 && k + 1 != record.len() {
            continue;
        }
        trace.times_s.push(t);
        trace.theta.extend_from_slice(tracker.theta());
        if !tracker.recursion.covariance(&mut covariance) {
            covariance.fill(f64::NAN);
        }
        pack(&covariance, p, &mut trace.covariance);
        trace.operator.extend(tracker.recursion.operator());
        trace.delays.extend(tracker.recursion.delay());
        trace.further_operator.extend(tracker.recursion.further_operator());
        if options.method.is_self_starting() {
            for omega in further_rad_s.iter() {
                let told = tracker
                    .recursion
                    .further_response(*omega)
                    .map(|response| response.pack());
                trace
                    .further_responses
                    .extend(told.unwrap_or([f64::NAN; Response::PACKED_LEN]));
            }
            for omega in &options.at_rad_s {
                let told = tracker.response(*omega).map(|response| response.pack());
                trace.responses.extend(told.unwrap_or([f64::NAN; Response::PACKED_LEN]));
            }
            if let Some(found) = tracker.open_loop() {
                trace.no_crossover.push(found.err());
                trace.open_loops.extend(OpenLoop::pack(found));
            }
        }
        trace.innovation.push(outcome.innovation.unwrap_or(f64::NAN));
        trace.innovation_variance.push(tracker.innovation_variance());
        trace.shortened.push(tracker.counts.shortened);
        trace.held.push(tracker.counts.held);
        trace.change_odds.extend(tracker.change_odds());
    }
    trace.response_finding = tracker.response_finding();
    let low = COMPARED_RAD_S.iter().filter_map(|omega| tracker.response(*omega));
    trace.low_responses = low.collect();
    trace.loop_shape = tracker.open_loop_shape();
    trace.response_is_known = tracker.response_is_known();
    trace.counts = tracker.counts;
    trace.guarded = tracker.guard.is_some();
    if let Some(last) = trace.faults.last_mut().filter(|last| last.is_open()) {
        last.to_s = record.time_s(record.len());
    }
    trace.idle_s = idle_head(record) as f64 * sample_time.s();
    trace.failures = tracker.failures();
    if options.method.requests_two_sided() {
        let causal = CausalRun {
            setup: options.setup()?,
            largest: options.largest,
            rows: kept_rows(record.len(), every),
            last: trace.operator.last().copied(),
        };
        trace.replace_rows(options.method.two_sided(record, &causal, &tracker.start)?);
        trace.updated_from_s = record.time_s(0);
    }
    Ok(trace)
}

/// Returns the indices of the samples at which a trace has rows.
fn kept_rows(samples: usize, every: usize) -> Vec<usize> {
    let kept = |k: &usize| (k + 1).is_multiple_of(every) || k + 1 == samples;
    (0..samples).filter(kept).collect()
}

/// Checks that a further input varies and is not a multiple of the error.
fn check_further_input(record: &Record, options: &TrackOptions, values: &[f64]) -> Result<(), IdentError> {
    let Some(further) = &options.further else {
        return Ok(());
    };
    // Missing values of a record are not numbers; they count as the mean.
    let centred = |values: &[f64]| {
        let known: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
        let centre = mean(&known);
        let of = |v: &f64| if v.is_finite() { v - centre } else { 0.0 };
        values.iter().map(of).collect::<Vec<f64>>()
    };
    check_independent_inputs([("e", centred(record.input())), (&further.channel, centred(values))])
}

/// Returns the further input, advanced by its preview, or the external signal for methods that use one.
fn reference_signal<'r>(record: &'r Record, options: &TrackOptions) -> Result<Option<&'r [f64]>, IdentError> {
    let further = options.further.as_ref().map(|further| further.channel.as_str());
    let Some(name) = further.or_else(|| options.method.reference_channel()) else {
        return Ok(None);
    };
    let names = || {
        record
            .channels()
            .map(|c| c.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    match record.channel(name) {
        Some(values) => {
            let lead = options
                .further
                .as_ref()
                .map_or(0, |f| f.preview_samples(record.sample_time()));
            check_further_input(record, options, values)?;
            Ok(Some(values.get(lead..).unwrap_or_default()))
        }
        None => Err(IdentError::NoChannel {
            channel: name.to_owned(),
            label: record.label().to_owned(),
            available: names(),
        }),
    }
}
