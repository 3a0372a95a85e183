//! Verification of a run: every tick is recomputed from the logged inputs.
//!
//! A run is *verified* if none of these problems is found; otherwise it is *unverified*, and the reasons are given:
//!
//! | kind | reason |
//! |---|---|
//! | `lab-interrupted` | the run did not reach its end |
//! | `lab-task` | the tables of the run do not match its condition and seed |
//! | `lab-ticks` | ticks are missing, duplicated or out of order |
//! | `lab-log` | a file of the log is missing, truncated or invalid; its complete part is still used |
//! | `lab-input` | u at a tick does not match the input events |
//! | `lab-tick` | e at a tick differs in at least one bit from the e computed with the controlled element |
//! | `lab-event` | an event took effect before its time stamp, too late, or out of sequence |
//! | `lab-frame` | a frame was late, did not show the tick that was due, or showed an e that differs from the e of its tick |
//! | `lab-changed` | a file was changed after the end of the run |
//!
//! u and e are compared bit by bit, except for the sign of zero, which is not preserved in text. e is recomputed from
//! the logged u, so a wrong event can be distinguished from a wrong tick. The tables used are those sent to the page;
//! they are compared, up to rounding, with tables recomputed from the seed (sines may differ between computers in the
//! last bit).

use hoid_model::{Finding, Verdict, VerdictLevel};
use hoid_numerics::statistics::upper_median;
use serde::Serialize;

use crate::{
    LabError,
    session::{EndRecord, LoggedRun, RunEnd, RunStart, Stem},
    task::{Task, held_inputs},
};

/// Largest relative difference in a table that may be due to different sine functions.
const TABLE_TOLERANCE: f64 = 1e-9;
/// A frame counts as missed if the interval between frames exceeds this multiple of the typical interval.
const MISSED_FRAME_RATIO: f64 = 1.5;

/// Result of the verification of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Verification {
    /// Verdict on the run; trustworthy means verified.
    pub verdict: Verdict,
    /// Additional measurements.
    pub measures: Measures,
}

/// Measured quantities of a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Measures {
    /// Number of ticks in the log.
    pub ticks: usize,
    /// Number of frames in the log.
    pub frames: usize,
    /// Median interval between frames, ms.
    pub frame_ms: f64,
    /// Longest interval between frames, ms.
    pub longest_frame_ms: f64,
    /// Number of missed frames.
    pub missed_frames: usize,
    /// Number of input events per second.
    pub input_hz: f64,
    /// Median time from an event to its reception by the page, ms.
    pub input_age_ms: f64,
    /// Root mean square of e during the measurement.
    pub rms_e: f64,
    /// Root mean square of the error that would result without control.
    pub rms_forcing: f64,
    /// Score from 0 to 100: 100 for zero error, 0 for the error without control.
    pub score: f64,
}

impl Verification {
    /// True if the run is verified.
    pub fn is_verified(&self) -> bool {
        self.verdict.level == VerdictLevel::Trustworthy
    }

    /// Returns `verified` or `unverified`.
    pub fn label(&self) -> &'static str {
        if self.is_verified() { "verified" } else { "unverified" }
    }

    /// Returns the reasons in one line; empty if the run is verified.
    pub fn reasons(&self) -> String {
        self.verdict.reasons().collect::<Vec<_>>().join("; ")
    }
}

/// Checks a run of a session.
///
/// # Errors
/// [`LabError`] if `run.json` is missing or the operating system cannot read a file; problems of the other files are
/// findings.
pub fn check(stem: &Stem) -> Result<Verification, LabError> {
    let run_start = RunStart::read(stem)?;
    let logged = LoggedRun::read(stem)?;
    let ended = EndRecord::read(stem).unwrap_or_default();
    let mut findings: Vec<Finding> = (logged.faults.iter())
        .map(|words| Finding::warning("lab-log", words.clone()))
        .collect();
    let task = match run_start.task(stem) {
        Ok(task) => task,
        Err(error) => {
            findings.push(Finding::warning("lab-task", error.to_string()));
            return Ok(Verification {
                verdict: Verdict::of(findings),
                measures: Measures::default(),
            });
        }
    };
    findings.extend(check_end(&run_start, ended.as_ref(), &logged));
    findings.extend(check_task(&run_start, &task));
    findings.extend(check_ticks(&logged));
    findings.extend(check_events(&run_start, &logged));
    findings.extend(check_inputs(&run_start, &logged));
    findings.extend(check_errors(&task, &logged));
    findings.extend(check_frames(&run_start, &logged));
    if let Some(ended) = &ended {
        findings.extend(check_files(stem, ended)?);
        findings.extend(input_findings(&run_start, ended));
    }
    let measures = measures(&run_start, &task, &logged);
    if measures.missed_frames > 0 {
        let words = format!("{} of {} frames were missed", measures.missed_frames, measures.frames);
        findings.push(Finding::note("lab-missed-frames", words));
    }
    Ok(Verification {
        verdict: Verdict::of(findings),
        measures,
    })
}

fn check_end(run_start: &RunStart, ended: Option<&EndRecord>, logged: &LoggedRun) -> Option<Finding> {
    let finished = ended.is_some_and(|ended| ended.how == RunEnd::Finished);
    let ticks = logged.numbers.len();
    (!finished || ticks != run_start.ticks).then(|| {
        let words = format!("the run ended after {ticks} of {} ticks", run_start.ticks);
        Finding::warning("lab-interrupted", words)
    })
}

fn check_task(run_start: &RunStart, task: &Task) -> Option<Finding> {
    let wrong = |what: &str| {
        Some(Finding::warning(
            "lab-task",
            format!("{what} does not match its condition and seed"),
        ))
    };
    let Ok(made) = Task::new(&run_start.condition, run_start.cell, run_start.replication) else {
        let words = "the task cannot be built from its condition".to_owned();
        return Some(Finding::warning("lab-task", words));
    };
    let near = |a: &[f64], b: &[f64]| {
        let size = b.iter().fold(1e-300, |m: f64, v| m.max(v.abs()));
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= TABLE_TOLERANCE * size)
    };
    if !near(&task.target, &made.target) {
        return wrong("the target");
    }
    if !near(&task.disturbance, &made.disturbance) {
        return wrong("the disturbance");
    }
    let same = task.phases.len() == made.phases.len()
        && task.phases.iter().zip(&made.phases).all(|(a, b)| {
            let (p, q) = (&a.plant, &b.plant);
            a.from == b.from && near(&p.a, &q.a) && near(&p.b, &q.b) && near(&p.c, &q.c) && near(&[p.d], &[q.d])
        });
    if same { None } else { wrong("the controlled element") }
}

fn check_ticks(logged: &LoggedRun) -> Option<Finding> {
    let wrong = logged.numbers.iter().enumerate().find(|(k, tick)| **tick != *k as f64);
    wrong.map(|(k, tick)| Finding::warning("lab-ticks", format!("found tick {tick} where tick {k} was expected")))
}

fn check_events(run_start: &RunStart, logged: &LoggedRun) -> Option<Finding> {
    let mut last = 0.0;
    for (number, event) in (1_usize..).zip(&logged.events) {
        let whole = event.tick >= 0.0 && event.tick.fract() == 0.0 && event.raw.is_finite();
        let late = event.tick - event.stamp_ms.max(0.0);
        let words = if !whole || event.tick < last {
            "does not fit into the sequence of ticks".to_owned()
        } else if !((0.0..).contains(&late) && (event.stamp_ms..).contains(&event.handled_ms)) {
            format!(
                "was used at tick {}, before its time stamp of {:.3} ms",
                event.tick, event.stamp_ms
            )
        } else if late > run_start.limits.input_ms {
            let limit = run_start.limits.input_ms;
            format!("was used {late:.1} ms after its time stamp, expected at most {limit} ms")
        } else {
            last = event.tick;
            continue;
        };
        return Some(Finding::warning("lab-event", format!("input event {number} {words}")));
    }
    None
}

fn check_inputs(run_start: &RunStart, logged: &LoggedRun) -> Option<Finding> {
    let events: Vec<(usize, f64)> = (logged.events.iter())
        .map(|event| (event.tick as usize, run_start.input.u(event.raw)))
        .collect();
    let made = held_inputs(&events, logged.signals.u.len());
    find_differences(&made, &logged.signals.u).map(|(first, count)| {
        let all = logged.signals.u.len();
        let words = format!("u does not match the input events at {count} of {all} ticks, first at tick {first}");
        Finding::warning("lab-input", words)
    })
}

fn check_errors(task: &Task, logged: &LoggedRun) -> Option<Finding> {
    let made = task.run(&logged.signals.u);
    find_differences(&made.e, &logged.signals.e).map(|(first, count)| {
        let all = logged.signals.e.len();
        let words = format!("e does not match the controlled element at {count} of {all} ticks, first at tick {first}");
        Finding::warning("lab-tick", words)
    })
}

/// Returns the first index at which two signals differ in a bit, and the number of differences; `None` if they are
/// equal.
fn find_differences(made: &[f64], logged: &[f64]) -> Option<(usize, usize)> {
    // Adding zero converts minus zero to zero.
    let differ = |(a, b): (&f64, &f64)| (a + 0.0).to_bits() != (b + 0.0).to_bits();
    let indices: Vec<usize> = (logged.iter().enumerate())
        .filter(|(k, logged)| made.get(*k).is_none_or(|made| differ((made, logged))))
        .map(|(k, _)| k)
        .collect();
    Some((*indices.first()?, indices.len()))
}

fn check_frames(run_start: &RunStart, logged: &LoggedRun) -> Option<Finding> {
    let limit = run_start.limits.frame_ms;
    let wrong = |number: usize, words: String| Some(Finding::warning("lab-frame", format!("frame {number} {words}")));
    let mut last = 0.0;
    for (number, frame) in (1_usize..).zip(&logged.frames) {
        let shown = (frame.tick >= 0.0)
            .then(|| logged.signals.e.get(frame.tick as usize))
            .flatten();
        if shown.is_none_or(|e| find_differences(&[*e], &[frame.e]).is_some()) {
            return wrong(number, format!("does not show e of tick {}", frame.tick));
        }
        let due = frame.drawn_ms.floor().min(run_start.ticks as f64 - 1.0);
        if frame.tick != due {
            return wrong(
                number,
                format!("was drawn at {:.1} ms and shows tick {}", frame.drawn_ms, frame.tick),
            );
        }
        let (interval, age) = (frame.drawn_ms - last, (frame.drawn_ms - frame.frame_ms).abs());
        if !(0.0..=limit).contains(&interval) {
            return wrong(
                number,
                format!("came {interval:.1} ms after the previous frame, expected 0 to {limit} ms"),
            );
        }
        if !(0.0..=limit).contains(&age) {
            return wrong(
                number,
                format!("was drawn {age:.1} ms away from its time stamp, expected at most {limit} ms"),
            );
        }
        last = frame.drawn_ms;
    }
    let end = logged.numbers.len() as f64;
    if end - last > limit {
        let words = format!(
            "the last frame came {:.1} ms before the last tick, expected at most {limit} ms",
            end - last
        );
        return Some(Finding::warning("lab-frame", words));
    }
    None
}

fn check_files(stem: &Stem, ended: &EndRecord) -> Result<Option<Finding>, LabError> {
    let names = ["ticks", "events", "frames"];
    let changed: Vec<&str> = (EndRecord::hashes(stem)?.iter().zip(names).enumerate())
        .filter(|(k, (hash, _))| ended.sha256.get(*k) != Some(hash))
        .map(|(_, (_, name))| name)
        .collect();
    Ok((!changed.is_empty()).then(|| {
        let words = format!("files changed after the end of the run: {}", changed.join(", "));
        Finding::warning("lab-changed", words)
    }))
}

/// Returns notes if a program made input events or the time did not come from the browser; such runs may nevertheless
/// be verified.
fn input_findings(run_start: &RunStart, ended: &EndRecord) -> Vec<Finding> {
    let made = ended.counted.get("synthetic_events").copied().unwrap_or(0.0);
    let mut notes = Vec::new();
    if made > 0.0 {
        let words = format!("{made} input events were made by a program, not by hand");
        notes.push(Finding::note("lab-simulated", words));
    }
    if run_start.clock != "browser" {
        let words = format!("the clock was {}, not the browser's", run_start.clock);
        notes.push(Finding::note("lab-clock", words));
    }
    notes
}

fn measures(run_start: &RunStart, task: &Task, logged: &LoggedRun) -> Measures {
    let intervals: Vec<f64> = logged
        .frames
        .iter()
        .zip(logged.frames.iter().skip(1))
        .map(|(last, next)| next.frame_ms - last.frame_ms)
        .collect();
    let frame_ms = median(&intervals);
    let typical = if run_start.refresh_ms > 0.0 {
        run_start.refresh_ms
    } else {
        frame_ms
    };
    let missed = |interval: &f64| {
        if *interval > MISSED_FRAME_RATIO * typical {
            ((interval / typical).round() as usize).saturating_sub(1)
        } else {
            0
        }
    };
    let ages: Vec<f64> = logged
        .events
        .iter()
        .map(|event| event.handled_ms - event.stamp_ms)
        .collect();
    let e = &logged.signals.e;
    // Ticks after the end of the run are invalid.
    let e = e.get(..task.ticks).unwrap_or(e);
    let measured = |e: &[f64]| rms(e.get(run_start.run_in..).unwrap_or_default());
    let rms_e = measured(e);
    // The loop is simulated without control.
    let rest = task.run(&vec![0.0; e.len()]);
    let rms_forcing = measured(&rest.e);
    Measures {
        ticks: logged.numbers.len(),
        frames: logged.frames.len(),
        frame_ms,
        longest_frame_ms: intervals.iter().copied().fold(0.0, f64::max),
        missed_frames: intervals.iter().map(missed).fold(0, usize::saturating_add),
        input_hz: logged.events.len() as f64 / (e.len().max(1) as f64 * crate::task::TICK_S),
        input_age_ms: median(&ages),
        rms_e,
        rms_forcing,
        score: if rms_forcing > 0.0 {
            (100.0 * (1.0 - rms_e / rms_forcing)).max(0.0)
        } else {
            0.0
        },
    }
}

fn rms(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|v| v * v).sum();
    (sum / values.len().max(1) as f64).sqrt()
}

/// Returns the median of the finite values; zero if there are none.
fn median(values: &[f64]) -> f64 {
    let mut finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    upper_median(&mut finite).unwrap_or(0.0)
}
