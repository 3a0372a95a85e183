//! A stream: its samples in order, and the state of the recursion.

use std::collections::VecDeque;

use hoid::analysis::{Setting, settings_of_recursion};
use hoid::ident::Choice;
use hoid::model::numbers::count_with_noun;
use hoid::model::{Finding, SampleTime};
use hoid::track::{Change, Live, Sample, Stage, TrackFault, TrackOptions, TrackRequest};

use super::{
    clock::{Arrival, Clock, MAX_GAP_S},
    datagram::{Datagram, EstimateDatagram},
    line::{Counts, StreamStatus},
    lines::{Columns, ParsedLine, StreamSample, is_object},
};
use crate::{args::StreamArgs, commands::reading, error::CliError, output, recursion};

/// Maximum number of faults kept for the next line of the output.
const MAX_FAULTS: usize = 4;

/// The state of the stream, which each line of the input updates.
pub struct Session {
    request: TrackRequest,
    columns: Columns,
    clock: Clock,
    live: Live,
    /// Time between two samples of the stream.
    sample_time: SampleTime,
    /// Scale factors of e and u.
    scale: (f64, f64),
    every: u64,
    /// Number of lines processed, of which every `every`-th gives a line of the output.
    lines: u64,
    counts: Counts,
    /// True after the first sample with a time.
    has_time: bool,
    /// Time of the last sample, s.
    t: Option<f64>,
    innovation: Option<f64>,
    /// Last change that has not been reported, with the time of its declaration, s.
    change: Option<(Option<f64>, Change)>,
    /// Time of the last change that has been reported, s.
    reported_change_s: Option<f64>,
    /// Last guard event that has not been reported.
    event: Option<TrackFault>,
    names: Vec<String>,
    faults: VecDeque<String>,
    /// True once a warning about the rate of the times has been printed.
    has_reported_rate: bool,
    /// Finding about the rate of the time stamps, if it differs from `--fs`.
    rate: Option<Finding>,
}

impl Session {
    pub fn new(args: &StreamArgs, asked: TrackRequest, live: Live) -> Result<Self, CliError> {
        let with_input = asked.structure().has_input();
        let sample_time = live.sample_time();
        let largest = live.plan().options().largest;
        let mut session = Self {
            live,
            request: asked,
            columns: Columns::new(&args.input, &args.output, with_input, largest),
            clock: Clock::new(sample_time.s()),
            sample_time,
            scale: scale_factors(args)?,
            every: args.every as u64,
            lines: 0,
            counts: Counts::default(),
            has_time: false,
            t: None,
            innovation: None,
            change: None,
            reported_change_s: None,
            event: None,
            names: Vec::new(),
            faults: VecDeque::new(),
            has_reported_rate: false,
            rate: None,
        };
        if session.live.tracker().is_some() {
            let options = session.live.plan().options().clone();
            session.report_start("started at once", &options, None);
        }
        Ok(session)
    }

    /// Reports the start of the tracker: stores the names of its coefficients, and prints all settings to standard
    /// error.
    fn report_start(&mut self, when: &str, options: &TrackOptions, choice: Option<&Choice>) {
        if let Some(tracker) = self.live.tracker() {
            self.names = tracker.parameter_names();
        }
        let mut settings = settings_of_recursion(&self.request, self.live.plan(), options, choice);
        if let Some(done) = self.live.decimation() {
            settings.push(Setting::new("rate", format!("{done}, delayed by {:.3} s", done.lag_s)));
        }
        if self.scale != (1.0, 1.0) {
            let (e, u) = self.scale;
            settings.push(Setting::new("scale", format!("e times {e}, u times {u}")).with_given(true));
        }
        let each: Vec<String> = settings
            .iter()
            .map(|one| format!("{}: {}", one.name, one.value))
            .collect();
        output::print_message(&format!("{when}; {}.", each.join("; ")));
    }

    /// Processes a line of the input. Returns true if a line of the output is due.
    pub fn process_line(&mut self, text: Result<String, String>) -> Result<bool, CliError> {
        let line = match text {
            Ok(text) => self.columns.parse_line(&text)?,
            Err(reason) => ParsedLine::Unreadable(reason),
        };
        Ok(self.process_parsed_line(line))
    }

    /// Processes a parsed line. Returns true if a line of the output is due.
    fn process_parsed_line(&mut self, line: ParsedLine) -> bool {
        self.forget_innovation();
        match line {
            ParsedLine::Nothing => return false,
            ParsedLine::Sample(read) => self.process_timed_sample(read),
            // The time of the next line shows whether a sample is missing.
            ParsedLine::Unreadable(reason) if self.columns.has_time() || !self.columns.are_known() => {
                self.count_dropped_line(format!("{reason}: dropped"));
            }
            ParsedLine::Unreadable(reason) => {
                self.add_fault(reason);
                self.process_sample(f64::NAN, f64::NAN, None);
            }
        }
        self.lines += 1;
        self.lines.is_multiple_of(self.every)
    }

    /// Processes a datagram; `answer` is called for each sample that requires an answer. Anything that is not a sample
    /// is dropped, because it may come from any sender.
    ///
    /// # Errors
    /// Errors of `answer`.
    pub fn process_datagram(
        &mut self,
        bytes: &[u8],
        mut answer: impl FnMut(&mut Self, Option<u32>) -> Result<(), CliError>,
    ) -> Result<(), CliError> {
        match Datagram::of(bytes) {
            Datagram::Sample(sample) => {
                self.forget_innovation();
                self.process_timed_sample(sample.to_sample(self.sample_time, self.live.plan().options().largest));
                self.lines += 1;
                if self.lines.is_multiple_of(self.every) {
                    answer(self, Some(sample.sequence))?;
                }
            }
            Datagram::Lines(text) => {
                let lines: Vec<&str> = if is_object(text) {
                    vec![text.trim()]
                } else {
                    text.lines().collect()
                };
                for line in lines {
                    match self.columns.parse_line(line) {
                        Ok(ParsedLine::Unreadable(reason)) => self.count_dropped_line(format!("{reason}: dropped")),
                        Err(error) => self.count_dropped_line(format!("{error}: dropped")),
                        Ok(line) => {
                            if self.process_parsed_line(line) {
                                answer(self, None)?;
                            }
                        }
                    }
                }
            }
            Datagram::Unreadable(reason) => self.count_dropped_line(format!("{reason}: dropped")),
        }
        Ok(())
    }

    /// Returns the state of the recursion as the answer to a binary sample.
    pub fn estimate(&mut self, sequence: u32) -> EstimateDatagram {
        let answer = EstimateDatagram::new(sequence, self.t, &self.live, self.innovation, self.change.as_ref());
        self.take_change();
        self.faults.clear();
        self.event = None;
        answer
    }

    /// Processes a sample at its time, after filling in missing samples.
    fn process_timed_sample(&mut self, read: StreamSample) {
        if let Some(t) = read.t {
            self.has_time = true;
            match self.clock.classify(t) {
                Arrival::Behind { last_s } => {
                    return self.count_dropped_line(format!(
                        "t = {t} s is not later than the last time, {last_s} s: dropped"
                    ));
                }
                Arrival::Sample { missing, left_out } => {
                    if left_out {
                        self.add_fault(format!("a gap before t = {t} s, of which {MAX_GAP_S} s are bridged"));
                    } else if missing > 0 {
                        let missing = count_with_noun(missing, "sample");
                        self.add_fault(format!("{missing} missing before t = {t} s, bridged"));
                    }
                    for _ in 0..missing {
                        self.counts.bridged += 1;
                        self.process_sample(f64::NAN, f64::NAN, None);
                    }
                    self.t = Some(t);
                }
            }
            self.check_rate(t);
        }
        if let Some(fault) = read.fault {
            self.add_fault(fault);
        }
        self.process_sample(self.scale.0 * read.e, self.scale.1 * read.u, read.reference);
    }

    /// Prints one warning if the rate of the times differs from `--fs`. Once that rate has been measured, every line of
    /// the output contains the finding.
    fn check_rate(&mut self, t: f64) {
        let fs = 1.0 / self.sample_time.s();
        let (hurried, other) = (self.clock.has_run_ahead(), self.clock.deviating_rate());
        let mut warn = |words: &str| {
            if !std::mem::replace(&mut self.has_reported_rate, true) {
                output::print_message(&format!("warning: {words}"));
            }
        };
        if let Some(hz) = other.filter(|_| self.rate.is_none()) {
            let words = format!(
                "up to t = {t} s, t gives a sampling rate of {hz:.4} Hz, but --fs is {fs} Hz: the estimated delay, \
                 lead and frequency are wrong by this ratio; set --fs to the rate of t, or correct t"
            );
            warn(&words);
            self.rate = Some(Finding::warning("sampling-rate", words));
        } else if hurried {
            warn(&format!(
                "at t = {t} s, t advances by less than the {} s per line that --fs {fs} implies; correct --fs or t",
                self.sample_time.s()
            ));
        }
    }

    /// Discards the innovation, which belongs to a single sample. In a decimated stream the last innovation is kept for
    /// several lines.
    fn forget_innovation(&mut self) {
        if self.live.decimation().is_none() {
            self.innovation = None;
        }
    }

    fn process_sample(&mut self, e: f64, u: f64, reference: Option<f64>) {
        self.counts.samples += 1;
        self.counts.skipped += u64::from(!(e.is_finite() && u.is_finite()));
        if !self.has_time {
            self.t = Some((self.counts.samples - 1) as f64 * self.sample_time.s());
        }
        let taken = self.live.update(Sample { e, u, reference }, true, &recursion::choose);
        if taken.between {
            return;
        }
        self.innovation = taken.outcome.and_then(|outcome| outcome.innovation);
        self.counts.shortened += u64::from(taken.outcome.is_some_and(|outcome| outcome.shortened));
        if let Some(tracker) = self.live.tracker() {
            // Time of the last sample that the recursion has processed.
            let t = self.t.map(|t| t - self.live.lag_s());
            (self.counts.held, self.counts.restarts) = (tracker.counts().held, tracker.counts().restarts);
            let (event, change) = (tracker.event(), tracker.change());
            if let Some(change) = change {
                self.change = Some((t, change));
            }
            if let Some(event) = event {
                let (now_s, ts) = (t.unwrap_or(f64::NAN), self.live.plan().sample_time());
                self.event = Some(event.at(now_s, ts));
                self.withdraw_changes(event.withdrawn_from_s(now_s, ts));
            }
        }
        if let Some((options, choice)) = taken.started {
            let when = format!("started after {} samples", self.counts.samples);
            self.report_start(&when, &options, choice.as_ref());
        }
    }

    /// Withdraws the changes declared from this time on: the guard has restored an earlier state.
    fn withdraw_changes(&mut self, from_s: Option<f64>) {
        let is_withdrawn = |declared_s: Option<f64>| declared_s.zip(from_s).is_some_and(|(at, from)| at >= from);
        if self.change.as_ref().is_some_and(|(t, _)| is_withdrawn(*t)) {
            self.change = None;
        }
        if is_withdrawn(self.reported_change_s)
            && let Some(at) = self.reported_change_s.take()
        {
            self.add_fault(format!(
                "the change declared at t = {at} s is withdrawn: the guard restored the estimate from before the fault"
            ));
        }
    }

    /// Notes the change that a line of the output reports.
    fn take_change(&mut self) -> Option<(Option<f64>, Change)> {
        let change = self.change.take();
        if let Some((t, _)) = change {
            self.reported_change_s = t;
        }
        change
    }

    fn count_dropped_line(&mut self, reason: String) {
        self.counts.dropped += 1;
        self.add_fault(reason);
    }

    /// Keeps a fault for the next line of the output; of many faults, only the last few are kept.
    fn add_fault(&mut self, text: String) {
        if self.faults.len() == MAX_FAULTS {
            self.faults.pop_front();
        }
        self.faults.push_back(text);
    }

    /// Writes the line of the output to a buffer.
    pub fn write(&mut self, buffer: &mut Vec<u8>) -> Result<(), CliError> {
        let change = self.take_change();
        let fault = (!self.faults.is_empty()).then(|| self.faults.drain(..).collect::<Vec<_>>().join("; "));
        let standing = StreamStatus {
            t: self.t,
            live: &self.live,
            names: &self.names,
            innovation: self.innovation,
            change,
            event: self.event.take(),
            counts: self.counts,
            fault,
            finding: self.rate.as_ref(),
        };
        let unwritable = |e| CliError::Stream(format!("a line of the output cannot be formatted: {e}"));
        standing.write(buffer).map_err(unwritable)
    }

    /// Returns an error if the stream ended without an estimate.
    pub fn check_estimate(&self) -> Result<(), CliError> {
        let c = self.counts;
        if c.samples == 0 && c.dropped > 0 {
            return Err(CliError::NotDetermined(format!(
                "no line of the stream contained a sample ({} dropped); expected e,u or t,e,u with decimal points, or \
                 a JSON object; the output lines contain the errors",
                count_with_noun(c.dropped, "line")
            )));
        }
        if c.samples == 0 {
            return Err(CliError::NotDetermined(
                "the stream contained no samples; send lines e,u or t,e,u".to_owned(),
            ));
        }
        match self.live.stage() {
            Stage::Tracking(tracker) if tracker.has_estimate() => Ok(()),
            Stage::Tracking(_) => Err(CliError::NotDetermined(format!(
                "the stream ended without an estimate after {} ({} with a fault in e or u); send more samples in which \
                 e and u move",
                count_with_noun(c.samples, "sample"),
                c.skipped
            ))),
            Stage::Collecting(_) => Err(CliError::NotDetermined(
                "the stream ended within the warm-up, without an estimate; send more samples, or shorten --warm-up"
                    .to_owned(),
            )),
        }
    }

    /// Returns a summary for the end of the stream.
    pub fn summary(&self) -> String {
        let c = self.counts;
        let mut text = format!(
            "{} samples: {} skipped for a fault in e or u ({} of them missing), {} shortened; {} dropped.",
            c.samples,
            c.skipped,
            c.bridged,
            count_with_noun(c.shortened, "step"),
            count_with_noun(c.dropped, "line")
        );
        if c.held > 0 || c.restarts > 0 {
            text.push_str(&format!(
                " {} held back by the guard; the estimate was restarted {}.",
                count_with_noun(c.held, "sample"),
                count_with_noun(c.restarts, "time")
            ));
        }
        if let Stage::Collecting(warm_up) = self.live.stage() {
            text.push_str(&format!(
                " The warm-up did not end: {} of {} samples{}.",
                warm_up.collected,
                warm_up.needed,
                warm_up.trouble.as_ref().map_or(String::new(), |t| format!("; {t}"))
            ));
        }
        text
    }
}

/// Returns the scale factors of e and u.
fn scale_factors(args: &StreamArgs) -> Result<(f64, f64), CliError> {
    let mut all = reading::values_by_channel("--scale", &args.scale)?;
    let mut take = |name: &str| all.remove(name).map_or(1.0, |scaling| scaling.factor());
    let factors = (take("e"), take("u"));
    match all.keys().next() {
        None => Ok(factors),
        Some(name) => Err(CliError::Usage(format!(
            "--scale names {name}; in a stream, name e (the input) or u (the output)"
        ))),
    }
}
