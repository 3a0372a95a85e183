//! What was appended, read back.

use std::path::Path;

use super::{
    folder::Stem,
    log::{Event, Frame},
};
use crate::{LabError, task::Signals};

/// The log of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Logged {
    /// The number of each tick, as it stands there.
    pub numbers: Vec<f64>,
    /// u and e of each.
    pub signals: Signals,
    /// Input events.
    pub events: Vec<Event>,
    /// Frames.
    pub frames: Vec<Frame>,
}

impl Logged {
    /// Reads it. A last line that is cut, of a server that was ended while it wrote, is left out.
    ///
    /// # Errors
    /// [`LabError::Damaged`] with the line, [`LabError::Io`].
    pub fn read(stem: &Stem) -> Result<Self, LabError> {
        let mut logged = Self::default();
        rows(&stem.file("ticks.csv"), |[tick, u, e]| {
            logged.numbers.push(tick);
            logged.signals.u.push(u);
            logged.signals.e.push(e);
        })?;
        rows(&stem.file("events.csv"), |[tick, stamp, handled, raw]| {
            logged.events.push(Event::from((tick, stamp, handled, raw)));
        })?;
        rows(&stem.file("frames.csv"), |[frame, drawn, tick, e]| {
            logged.frames.push(Frame::from((frame, drawn, tick, e)));
        })?;
        Ok(logged)
    }
}

/// Calls `each` with the numbers of every whole line behind the header.
fn rows<const N: usize>(path: &Path, mut each: impl FnMut([f64; N])) -> Result<(), LabError> {
    let text = hoid_io::read_text(path)?;
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    for (k, line) in text[..whole].lines().enumerate().skip(1) {
        let mut numbers = [0.0; N];
        let mut cells = line.split(',');
        let read = numbers.iter_mut().all(|number| match cells.next().map(str::parse) {
            Some(Ok(value)) => {
                *number = value;
                true
            }
            _ => false,
        });
        if !read || cells.next().is_some() {
            let found = hoid_io::printable(line);
            return Err(LabError::damaged(
                path,
                format!("line {}: {found:?}, expected {N} numbers", k + 1),
            ));
        }
        each(numbers);
    }
    Ok(())
}
