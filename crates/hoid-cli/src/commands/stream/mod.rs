//! `hoid stream`: a recursive estimate, live. Each line of standard input that is no comment gives
//! one line of JSON on standard output, flushed, whatever the line holds.

mod clock;
mod line;
mod lines;

use std::{
    collections::VecDeque,
    io::{self, ErrorKind, Write},
    process,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
    time::{Duration, Instant},
};

use hoid_ident::Choice;
use hoid_model::{Finding, SampleTime};
use hoid_track::{Change, Live, LiveOutcome, Sample, TrackFault, TrackOptions};

use crate::{
    args::StreamArgs,
    error::CliError,
    interrupt, output,
    recursion::{self, Plan},
};
use clock::{Arrival, Clock, LONGEST_GAP_S};
use line::{Counts, Standing};
use lines::{Columns, Lines, Meaning, Read};

/// Length of the warm-up when none is typed, s.
const USUAL_WARM_UP_S: f64 = 20.0;
/// Faults that are kept for the next line.
const FAULTS_TOLD: usize = 4;
/// An interrupt waits so long for a line that is being written.
const PATIENCE: Duration = Duration::from_secs(1);

pub fn run(args: &StreamArgs) -> Result<(), CliError> {
    let sample_time = SampleTime::new(1.0 / args.fs)?;
    let plan = Plan::new(&args.recursion, sample_time)?;
    if plan.options().method.smooths() {
        return Err(CliError::Usage(
            "--smooth belongs to hoid track: what is still to come cannot say anything of a stream".to_owned(),
        ));
    }
    if args.warm_up.is_some() && plan.options().method.starts_itself() {
        return Err(CliError::Usage(format!(
            "--warm-up is for a start fit, and {} has none: it speaks at once; drop it, or name --method physical",
            plan.options().method
        )));
    }
    if args.recursion.start.is_some() && !plan.is_settled() {
        return Err(CliError::Usage(
            "--start leaves no warm-up to search nk and orders on; give --nk and --orders as single numbers, as --nk 29 \
             --orders nd=1"
                .to_owned(),
        ));
    }
    let session = Arc::new(Mutex::new(Session::new(args, plan, sample_time)?));
    end_on_interrupt(&session);
    let mut input = Lines::new(io::stdin().lock());
    let mut buffer = Vec::new();
    let broken = |e: io::Error| CliError::Stream(format!("standard input cannot be read: {e}"));
    while let Some(text) = input.next().map_err(broken)? {
        let mut session = lock(&session);
        if !session.take(text)? {
            continue;
        }
        session.write(&mut buffer)?;
        let mut out = io::stdout().lock();
        match out.write_all(&buffer).and_then(|()| out.flush()) {
            Ok(()) => {}
            // The reader has closed the pipe.
            Err(e) if e.kind() == ErrorKind::BrokenPipe => process::exit(0),
            Err(e) => return Err(CliError::Stream(format!("standard output cannot be written: {e}"))),
        }
    }
    let session = lock(&session);
    output::message(&session.summary());
    session.end()
}

/// Everything that a line changes.
struct Session {
    plan: Plan,
    columns: Columns,
    clock: Clock,
    live: Live,
    sample_time: SampleTime,
    /// What e and u are multiplied by.
    scale: (f64, f64),
    every: u64,
    /// Lines that count for `every`.
    lines: u64,
    counts: Counts,
    /// Time of the last sample, s.
    t: Option<f64>,
    innovation: Option<f64>,
    /// A change that no line has reported yet, and when it was declared, s.
    change: Option<(Option<f64>, Change)>,
    /// What the guard found and no line has reported yet.
    event: Option<TrackFault>,
    names: Vec<String>,
    faults: VecDeque<String>,
    /// That the times go at another rate has been said.
    rate_told: bool,
    /// What they go at.
    rate: Option<Finding>,
}

impl Session {
    fn new(args: &StreamArgs, plan: Plan, sample_time: SampleTime) -> Result<Self, CliError> {
        let length_s = args.warm_up.unwrap_or(USUAL_WARM_UP_S);
        let samples = (length_s * args.fs).round();
        if !(1.0..=1e7).contains(&samples) {
            return Err(CliError::Usage(format!(
                "--warm-up {length_s}: expected a time in s of one sample to 10 million"
            )));
        }
        let with_input = recursion::structure(&args.recursion)?.has_input();
        let largest = plan.options().largest;
        let mut session = Self {
            live: Live::new(plan.options(), samples as usize, sample_time)?,
            plan,
            columns: Columns::new(&args.input, &args.output, with_input, largest),
            clock: Clock::new(sample_time.s()),
            sample_time,
            scale: scale(args)?,
            every: args.every as u64,
            lines: 0,
            counts: Counts::default(),
            t: None,
            innovation: None,
            change: None,
            event: None,
            names: Vec::new(),
            faults: VecDeque::new(),
            rate_told: false,
            rate: None,
        };
        if matches!(session.live, Live::Tracking(_)) {
            let options = session.plan.options().clone();
            session.began("started at once", &options, None);
        }
        Ok(session)
    }

    /// The tracker is there: its names, and all settings to standard error.
    fn began(&mut self, when: &str, options: &TrackOptions, choice: Option<&Choice>) {
        if let Live::Tracking(tracker) = &self.live {
            self.names = tracker.parameter_names();
        }
        let mut settings = self.plan.settings(options, choice);
        if self.scale != (1.0, 1.0) {
            let (e, u) = self.scale;
            settings.push(("scale".to_owned(), format!("e times {e}, u times {u}")));
        }
        let each: Vec<String> = settings.iter().map(|(k, v)| format!("{k}: {v}")).collect();
        output::message(&format!("{when}; {}.", each.join("; ")));
    }

    /// Takes a line; true when the output has a line for it.
    fn take(&mut self, text: Result<String, String>) -> Result<bool, CliError> {
        let meaning = match text {
            Ok(text) => self.columns.read(&text)?,
            Err(reason) => Meaning::Unreadable(reason),
        };
        self.innovation = None;
        match meaning {
            Meaning::Nothing => return Ok(false),
            Meaning::Sample(read) => self.timed(read),
            // By its time the next line will tell whether a sample is missing.
            Meaning::Unreadable(reason) if self.columns.have_time() || !self.columns.are_known() => {
                self.dropped(format!("{reason}: dropped"));
            }
            Meaning::Unreadable(reason) => {
                self.fault(reason);
                self.sample(f64::NAN, f64::NAN, None);
            }
        }
        self.lines += 1;
        Ok(self.lines.is_multiple_of(self.every))
    }

    /// Takes a sample at its place in time.
    fn timed(&mut self, read: Read) {
        if let Some(t) = read.t {
            match self.clock.take(t) {
                Arrival::Behind { last_s } => {
                    return self.dropped(format!("t = {t} s is not later than the last, {last_s} s: dropped"));
                }
                Arrival::Sample { missing, left_out } => {
                    if left_out {
                        self.fault(format!(
                            "a gap before t = {t} s, of which {LONGEST_GAP_S} s are bridged"
                        ));
                    } else if missing > 0 {
                        self.fault(format!("{missing} missing before t = {t} s, bridged"));
                    }
                    for _ in 0..missing {
                        self.counts.bridged += 1;
                        self.sample(f64::NAN, f64::NAN, None);
                    }
                    self.t = Some(t);
                }
            }
            self.judge_rate(t);
        }
        if let Some(fault) = read.fault {
            self.fault(fault);
        }
        self.sample(self.scale.0 * read.e, self.scale.1 * read.u, read.reference);
    }

    /// Says once that the times go at another rate than `--fs`; from there on every line carries the
    /// finding.
    fn judge_rate(&mut self, t: f64) {
        let fs = 1.0 / self.sample_time.s();
        let (hurried, other) = (self.clock.hurried(), self.clock.other_rate());
        let mut warn = |words: &str| {
            if !std::mem::replace(&mut self.rate_told, true) {
                output::message(&format!("warning: {words}"));
            }
        };
        if let Some(hz) = other.filter(|_| self.rate.is_none()) {
            let words = format!(
                "up to t = {t} s the times go at {hz:.4} Hz and --fs says {fs} Hz: delay, lead and frequency of the estimate \
                 are scaled by that; give the rate of the times to --fs, or correct t"
            );
            warn(&words);
            self.rate = Some(Finding::doubt("sampling-rate", words));
        } else if hurried {
            warn(&format!(
                "at t = {t} s the lines run ahead of --fs {fs}: t advances by less than {} s a line",
                self.sample_time.s()
            ));
        }
    }

    fn sample(&mut self, e: f64, u: f64, reference: Option<f64>) {
        self.counts.samples += 1;
        self.counts.skipped += u64::from(!(e.is_finite() && u.is_finite()));
        if !self.columns.have_time() {
            self.t = Some((self.counts.samples - 1) as f64 * self.sample_time.s());
        }
        let plan = &self.plan;
        let sample = Sample { e, u, reference };
        let LiveOutcome { outcome, started } = self.live.update(sample, &|record| plan.choose(record));
        if let Some(outcome) = outcome {
            self.innovation = outcome.innovation;
            self.counts.shortened += u64::from(outcome.shortened);
            if let Live::Tracking(tracker) = &self.live {
                (self.counts.held, self.counts.restarts) = (tracker.counts().held, tracker.counts().restarts);
                if let Some(event) = tracker.event() {
                    self.event = Some(event.at(self.t.unwrap_or(f64::NAN), self.sample_time));
                }
            }
            if let Live::Tracking(tracker) = &self.live
                && let Some(change) = tracker.change()
            {
                self.change = Some((self.t, change));
            }
        }
        if let Some((options, choice)) = started {
            let when = format!("started after {} samples", self.counts.samples);
            self.began(&when, &options, choice.as_ref());
        }
    }

    fn dropped(&mut self, reason: String) {
        self.counts.dropped += 1;
        self.fault(reason);
    }

    /// Keeps a fault for the next line of the output, the last ones where there are many.
    fn fault(&mut self, text: String) {
        if self.faults.len() == FAULTS_TOLD {
            self.faults.pop_front();
        }
        self.faults.push_back(text);
    }

    /// Writes the line of the output into a buffer.
    fn write(&mut self, buffer: &mut Vec<u8>) -> Result<(), CliError> {
        let fault = (!self.faults.is_empty()).then(|| self.faults.drain(..).collect::<Vec<_>>().join("; "));
        let standing = Standing {
            t: self.t,
            live: &self.live,
            names: &self.names,
            innovation: self.innovation,
            change: self.change.take(),
            event: self.event.take(),
            counts: self.counts,
            fault,
            finding: self.rate.as_ref(),
        };
        let unwritable = |e| CliError::Stream(format!("a line of the output cannot be made: {e}"));
        standing.write(buffer).map_err(unwritable)
    }

    /// A stream that ended without an estimate has not given what was asked.
    fn end(&self) -> Result<(), CliError> {
        match &self.live {
            Live::Tracking(_) => Ok(()),
            Live::Collecting(_) => Err(CliError::NotDetermined(
                "the stream ended within the warm-up, without an estimate; give it more samples, or a shorter --warm-up".to_owned(),
            )),
        }
    }

    /// What there was, for the end.
    fn summary(&self) -> String {
        let c = self.counts;
        let mut text = format!(
            "{} samples: {} skipped for a fault in e or u ({} of them missing), {} steps made shorter; {} lines dropped.",
            c.samples, c.skipped, c.bridged, c.shortened, c.dropped
        );
        if c.held > 0 || c.restarts > 0 {
            text.push_str(&format!(
                " {} samples held back by the guard; the estimate was begun again {} times.",
                c.held, c.restarts
            ));
        }
        if let Live::Collecting(warm_up) = &self.live {
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

/// What e and u are multiplied by.
fn scale(args: &StreamArgs) -> Result<(f64, f64), CliError> {
    let mut all = super::reading::by_channel("--scale", &args.scale)?;
    let mut take = |name: &str| all.remove(name).map_or(1.0, |scaling| scaling.factor());
    let factors = (take("e"), take("u"));
    match all.keys().next() {
        None => Ok(factors),
        Some(name) => Err(CliError::Usage(format!(
            "--scale names {name}; in a stream it is e or u, the input or the output"
        ))),
    }
}

fn lock(session: &Mutex<Session>) -> MutexGuard<'_, Session> {
    session.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends with a summary at an interrupt, with exit code 0 where there is an estimate; a line that is being written is finished
/// before.
fn end_on_interrupt(session: &Arc<Mutex<Session>>) {
    let session = Arc::clone(session);
    interrupt::on_interrupt(move |_| {
        let asked = Instant::now();
        loop {
            if let Ok(session) = session.try_lock() {
                output::message(&session.summary());
                process::exit(session.end().map_or_else(|error| i32::from(error.exit_code()), |()| 0));
            }
            // A start fit, or a reader that takes nothing: lines are written whole, so that none is
            // cut.
            if asked.elapsed() > PATIENCE {
                process::exit(0);
            }
            thread::sleep(Duration::from_millis(1));
        }
    });
}
