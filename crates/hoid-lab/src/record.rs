//! Conversion of a run to a record that all commands of hoid can read. It contains every tenth tick: e and u at that
//! time, and the target, disturbance, output and displayed e. A target that was displayed has a role for the person.
//! t = 0 is the start of the measurement.

use hoid_model::{Channel, Record, SampleTime};

use crate::{
    LabError,
    session::{LoggedRun, RunStart},
    task::{TICK_S, TICKS_PER_SAMPLE, Task},
};

/// Name of the channel of the target.
pub(crate) const TARGET_CHANNEL: &str = "f_t";

/// Returns the record of a run, including the run-in.
///
/// # Errors
/// [`LabError::Model`] for a run without samples.
pub fn record(run_start: &RunStart, task: &Task, logged: &LoggedRun) -> Result<Record, LabError> {
    // If a log is longer than its run, the additional ticks are invalid.
    let n = logged.signals.e.len().min(logged.signals.u.len()).min(task.ticks);
    let every = |values: &[f64]| {
        values
            .iter()
            .copied()
            .take(n)
            .step_by(TICKS_PER_SAMPLE)
            .collect::<Vec<f64>>()
    };
    let channel = |name: &str, values: Vec<f64>| Channel::new(name, "", values);
    let mut shown = Vec::new();
    let (mut frames, mut e) = (logged.frames.iter().peekable(), 0.0);
    for k in (0..n).step_by(TICKS_PER_SAMPLE) {
        while let Some(frame) = frames.next_if(|frame| frame.drawn_ms <= k as f64) {
            e = frame.e;
        }
        shown.push(e);
    }
    let y: Vec<f64> = task.target.iter().zip(&logged.signals.e).map(|(f, e)| f - e).collect();
    let mut record = Record::new(
        SampleTime::new(TICK_S * TICKS_PER_SAMPLE as f64)?,
        channel("e", every(&logged.signals.e)),
        channel("u", every(&logged.signals.u)),
    )?
    .starting_at(-(run_start.run_in as f64) * TICK_S);
    let role_of_target = run_start.condition.target_role()?.unwrap_or_default();
    for (name, values, role) in [
        (TARGET_CHANNEL, &task.target, role_of_target),
        ("d", &task.disturbance, String::new()),
    ] {
        if values.iter().any(|v| *v != 0.0) {
            record = record.with_channel(channel(name, every(values)).with_role(role))?;
        }
    }
    Ok(record
        .with_channel(channel("y", every(&y)))?
        .with_channel(channel("e_shown", shown))?)
}
