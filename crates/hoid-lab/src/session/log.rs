//! Journal of a run in progress: each line is complete or absent.
//!
//! A line is whole with its end. A batch that cannot be written to its end is taken back: the files
//! are cut to the last whole batch, and its ticks count only once all three have them. A disk that
//! is full for a moment therefore leaves no half of a line in front of later ones; the run is ended,
//! and *unverified*. What a power cut leaves is cut to the last whole line when it is read.
//!
//! A batch is handed to the system when it comes, so that a server that is killed loses nothing of
//! it, and to the disk at least each second, so that a computer that stops loses no more. Numbers are
//! written with the digits that give the same bits back.

use std::{
    fs::{File, OpenOptions},
    io::Write as _,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use serde::Deserialize;

use super::{folder::Stem, run_start::APPENDED};
use crate::LabError;

/// Longest time until the disk has what was appended.
const SYNC: Duration = Duration::from_millis(900);

/// An input event.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(from = "(f64, f64, f64, f64)")]
pub struct Event {
    /// The first tick that takes it.
    pub tick: f64,
    /// Its own time stamp, ms from tick 0.
    pub stamp_ms: f64,
    /// When the page had it, ms from tick 0.
    pub handled_ms: f64,
    /// Report of the device.
    pub raw: f64,
}

impl From<(f64, f64, f64, f64)> for Event {
    fn from((tick, stamp_ms, handled_ms, raw): (f64, f64, f64, f64)) -> Self {
        Self {
            tick,
            stamp_ms,
            handled_ms,
            raw,
        }
    }
}

/// A frame.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(from = "(f64, f64, f64, f64)")]
pub struct Frame {
    /// The browser's time of the frame, ms from tick 0.
    pub frame_ms: f64,
    /// When it was drawn, ms from tick 0.
    pub drawn_ms: f64,
    /// The tick that it shows.
    pub tick: f64,
    /// e as shown.
    pub e: f64,
}

impl From<(f64, f64, f64, f64)> for Frame {
    fn from((frame_ms, drawn_ms, tick, e): (f64, f64, f64, f64)) -> Self {
        Self {
            frame_ms,
            drawn_ms,
            tick,
            e,
        }
    }
}

/// One message of a page.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Batch {
    /// The first tick.
    pub first: usize,
    /// u from there on.
    pub u: Vec<f64>,
    /// e from there on.
    pub e: Vec<f64>,
    /// Input events since the last batch.
    pub events: Vec<Event>,
    /// Frames since the last batch.
    pub frames: Vec<Frame>,
}

/// The files of a run that continues.
#[derive(Debug)]
pub struct RunLog {
    files: [(PathBuf, File); 3],
    /// Bytes of each file that are whole batches.
    whole: [u64; 3],
    synced: Instant,
    logged: usize,
    planned: usize,
}

impl RunLog {
    /// Makes the files with their headers.
    ///
    /// # Errors
    /// [`LabError::File`]; a file that is already present is not written over.
    pub fn create(stem: &Stem, ticks: usize) -> Result<Self, LabError> {
        let headers = [
            "tick,u,e\n",
            "tick,stamp_ms,handled_ms,raw\n",
            "frame_ms,drawn_ms,tick,e_shown\n",
        ];
        let make = |k: usize| -> Result<(PathBuf, File), LabError> {
            let path = stem.file(APPENDED[k]);
            let opened = OpenOptions::new().append(true).create_new(true).open(&path);
            let mut file = opened.map_err(|source| LabError::file(&path, source))?;
            append(&path, &mut file, headers[k])?;
            Ok((path, file))
        };
        Ok(Self {
            files: [make(0)?, make(1)?, make(2)?],
            whole: headers.map(|header| header.len() as u64),
            synced: Instant::now(),
            logged: 0,
            planned: ticks,
        })
    }

    /// Whether a batch continues the log; the tick after its last.
    ///
    /// # Errors
    /// [`LabError::Message`] for one that does not continue the last one or is beyond the end.
    pub fn continued_by(&self, batch: &Batch) -> Result<usize, LabError> {
        let end = batch.first.saturating_add(batch.u.len());
        if batch.first != self.logged || batch.u.len() != batch.e.len() || end > self.planned {
            return Err(LabError::Message(format!(
                "ticks {} to {end} with {} of e, expected ticks from {} to at most {}",
                batch.first,
                batch.e.len(),
                self.logged,
                self.planned
            )));
        }
        Ok(end)
    }

    /// Appends a batch, all of it or nothing.
    ///
    /// # Errors
    /// The errors of [`RunLog::continued_by`]; [`LabError::File`], after which the files hold the batches before.
    pub fn append(&mut self, batch: &Batch) -> Result<(), LabError> {
        let end = self.continued_by(batch)?;
        let mut texts = [String::new(), String::new(), String::new()];
        for (k, (u, e)) in batch.u.iter().zip(&batch.e).enumerate() {
            texts[0].push_str(&format!("{},{u:?},{e:?}\n", batch.first + k));
        }
        for v in &batch.events {
            texts[1].push_str(&format!(
                "{:?},{:?},{:?},{:?}\n",
                v.tick, v.stamp_ms, v.handled_ms, v.raw
            ));
        }
        for f in &batch.frames {
            texts[2].push_str(&format!("{:?},{:?},{:?},{:?}\n", f.frame_ms, f.drawn_ms, f.tick, f.e));
        }
        let written = (self.files.iter_mut().zip(&texts)).try_for_each(|((path, file), text)| append(path, file, text));
        if let Err(error) = written {
            self.take_back();
            return Err(error);
        }
        for (whole, text) in self.whole.iter_mut().zip(&texts) {
            *whole += text.len() as u64;
        }
        self.logged = end;
        if self.synced.elapsed() > SYNC {
            self.sync()?;
        }
        Ok(())
    }

    /// Cuts the files to the last whole batch. What cannot be cut now is when the session is opened.
    fn take_back(&self) {
        for ((_, file), whole) in self.files.iter().zip(self.whole) {
            let _ = file.set_len(whole);
        }
    }

    /// Ticks that are logged.
    pub fn ticks(&self) -> usize {
        self.logged
    }

    /// Hands all to the disk.
    ///
    /// # Errors
    /// [`LabError::File`].
    pub fn sync(&mut self) -> Result<(), LabError> {
        for (path, file) in &self.files {
            file.sync_data().map_err(|source| LabError::file(path, source))?;
        }
        self.synced = Instant::now();
        Ok(())
    }
}

fn append(path: &Path, file: &mut File, text: &str) -> Result<(), LabError> {
    file.write_all(text.as_bytes())
        .map_err(|source| LabError::file(path, source))
}

/// Bytes up to the end of the last whole line.
pub(super) fn whole_lines(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The third file is on a disk that takes nothing: the batch is in none of them, and does not count.
    #[test]
    fn a_batch_that_a_full_disk_refuses_is_taken_back() {
        let dir = tempfile::tempdir().unwrap();
        let stem = Stem::new(dir.path(), "P01", 1, "rate", 1);
        let mut log = RunLog::create(&stem, 100).unwrap();
        let batch = |first: usize| Batch {
            first,
            u: vec![0.5; 10],
            e: vec![0.25; 10],
            events: Vec::new(),
            frames: vec![Frame::from((1.0, 1.0, 1.0, 0.25))],
        };
        log.append(&batch(0)).unwrap();
        let before = std::fs::read(stem.file("ticks.csv")).unwrap();
        let frames = std::mem::replace(
            &mut log.files[2].1,
            OpenOptions::new().write(true).open("/dev/full").unwrap(),
        );
        assert!(log.append(&batch(10)).unwrap_err().to_string().contains("frames.csv"));
        assert_eq!(log.ticks(), 10);
        assert_eq!(std::fs::read(stem.file("ticks.csv")).unwrap(), before);
        // Once there is room it continues where it was.
        log.files[2].1 = frames;
        log.append(&batch(10)).unwrap();
        assert_eq!(log.ticks(), 20);
        let text = std::fs::read_to_string(stem.file("ticks.csv")).unwrap();
        assert_eq!(text.lines().count(), 21);
    }
}
