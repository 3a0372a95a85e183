//! Reading of the journal.

use std::path::Path;

use super::{
    folder::Stem,
    log::{Event, Frame, complete_lines},
};
use crate::{LabError, task::Signals};

/// The log of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LoggedRun {
    /// Number of each tick as logged.
    pub numbers: Vec<f64>,
    /// u and e of each tick.
    pub signals: Signals,
    /// Input events.
    pub events: Vec<Event>,
    /// Frames.
    pub frames: Vec<Frame>,
    /// Problems with the files.
    pub faults: Vec<String>,
}

impl LoggedRun {
    /// Reads each file of the log up to its last complete line, or up to its first invalid line. A missing file counts
    /// as empty and is reported in `faults`.
    ///
    /// # Errors
    /// [`LabError::Io`] if the operating system cannot read an existing file.
    pub fn read(stem: &Stem) -> Result<Self, LabError> {
        let mut logged = Self::default();
        let mut faults = Vec::new();
        faults.extend(for_each_row(&stem.file("ticks.csv"), |[tick, u, e]| {
            logged.numbers.push(tick);
            logged.signals.u.push(u);
            logged.signals.e.push(e);
        })?);
        faults.extend(for_each_row(
            &stem.file("events.csv"),
            |[tick, stamp, handled, raw]| {
                logged.events.push(Event::from((tick, stamp, handled, raw)));
            },
        )?);
        faults.extend(for_each_row(&stem.file("frames.csv"), |[frame, drawn, tick, e]| {
            logged.frames.push(Frame::from((frame, drawn, tick, e)));
        })?);
        logged.faults = faults;
        Ok(logged)
    }
}

/// Calls `each` with the numbers in every complete line after the header, up to the first invalid line; returns a
/// description of the problem if there is one.
fn for_each_row<const N: usize>(path: &Path, mut each: impl FnMut([f64; N])) -> Result<Option<String>, LabError> {
    let name = || {
        path.file_name()
            .map_or_else(String::new, |name| name.to_string_lossy().into_owned())
    };
    if !path.exists() {
        return Ok(Some(format!("{} is missing", name())));
    }
    let bytes = hoid_io::read_bytes(path)?;
    let whole = complete_lines(&bytes);
    let text = String::from_utf8_lossy(whole);
    for (number, line) in (1_usize..).zip(text.lines()).skip(1) {
        let mut values = [0.0; N];
        let mut cells = line.split(',');
        let read = values.iter_mut().all(|cell| match cells.next().map(str::parse) {
            Some(Ok(value)) => {
                *cell = value;
                true
            }
            _ => false,
        });
        if !read || cells.next().is_some() {
            let found = hoid_io::escape_control_characters(line);
            let words = format!("line {number} of {} is {found:?}, expected {N} numbers", name());
            return Ok(Some(words));
        }
        each(values);
    }
    let cut = whole.len() < bytes.len() || whole.is_empty();
    Ok(cut.then(|| format!("{} is truncated", name())))
}
