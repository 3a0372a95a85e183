//! Journal of a run in progress: each line is complete or absent.
//!
//! A line is complete if it has its line end. If a batch cannot be written completely, the write is undone: the files
//! are truncated to the last complete batch, and the ticks of a batch count only when all three files contain them. A
//! temporarily full disk therefore leaves no partial line before later lines; the run is ended and is *unverified*.
//! After a power failure the files are used only up to the last complete line.
//!
//! A batch is passed to the operating system when it arrives, so nothing is lost if the server is killed. It is flushed
//! to the disk at least every second, which limits the loss if the computer fails. Numbers are written with enough
//! digits to reproduce every bit.

use std::{
    fs::{File, OpenOptions},
    io::Write as _,
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use serde::Deserialize;

use super::{folder::Stem, run_start::APPENDED_FILES};
use crate::LabError;

/// Maximum time until appended data are flushed to the disk.
const SYNC_INTERVAL: Duration = Duration::from_millis(900);

/// An event of the input device.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(from = "(f64, f64, f64, f64)")]
pub struct Event {
    /// First tick at which the event takes effect.
    pub tick: f64,
    /// Time stamp of the event, ms from tick 0.
    pub stamp_ms: f64,
    /// Time at which the page received the event, ms from tick 0.
    pub handled_ms: f64,
    /// Raw value of the device.
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

/// A frame drawn by the page.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(from = "(f64, f64, f64, f64)")]
pub struct Frame {
    /// Time of the frame according to the browser, ms from tick 0.
    pub frame_ms: f64,
    /// Time at which the frame was drawn, ms from tick 0.
    pub drawn_ms: f64,
    /// The displayed tick.
    pub tick: f64,
    /// Displayed e.
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

/// Data in one message from a page.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Batch {
    /// Number of the first tick.
    pub first: usize,
    /// u from the first tick on.
    pub u: Vec<f64>,
    /// e from the first tick on.
    pub e: Vec<f64>,
    /// Input events since the last batch.
    pub events: Vec<Event>,
    /// Frames since the last batch.
    pub frames: Vec<Frame>,
}

/// The appended files of the current run.
#[derive(Debug)]
pub struct RunLog {
    files: [(PathBuf, File); 3],
    /// Size in bytes of the complete batches in each file.
    complete_bytes: [u64; 3],
    last_sync: Instant,
    logged: usize,
    planned_ticks: usize,
}

impl RunLog {
    /// Creates the files with their headers.
    ///
    /// # Errors
    /// [`LabError::File`]; an existing file is not overwritten.
    pub fn create(stem: &Stem, ticks: usize) -> Result<Self, LabError> {
        let headers = [
            "tick,u,e\n",
            "tick,stamp_ms,handled_ms,raw\n",
            "frame_ms,drawn_ms,tick,e_shown\n",
        ];
        let make = |end: &str, header: &str| -> Result<(PathBuf, File), LabError> {
            let path = stem.file(end);
            let opened = OpenOptions::new().append(true).create_new(true).open(&path);
            let mut file = opened.map_err(|source| LabError::file(&path, source))?;
            append(&path, &mut file, header)?;
            Ok((path, file))
        };
        Ok(Self {
            files: [
                make(APPENDED_FILES[0], headers[0])?,
                make(APPENDED_FILES[1], headers[1])?,
                make(APPENDED_FILES[2], headers[2])?,
            ],
            complete_bytes: headers.map(|header| header.len() as u64),
            last_sync: Instant::now(),
            logged: 0,
            planned_ticks: ticks,
        })
    }

    /// Checks that a batch continues the log; returns the number of the tick after the batch.
    ///
    /// # Errors
    /// [`LabError::Message`] for a batch that does not continue the previous one or extends beyond the end of the run.
    pub fn check_batch(&self, batch: &Batch) -> Result<usize, LabError> {
        let end = batch.first.saturating_add(batch.u.len());
        if batch.first != self.logged || batch.u.len() != batch.e.len() || end > self.planned_ticks {
            return Err(LabError::Message(format!(
                "ticks {} to {end} with {} values of e, expected ticks from {} to at most {}",
                batch.first,
                batch.e.len(),
                self.logged,
                self.planned_ticks
            )));
        }
        Ok(end)
    }

    /// Appends a batch completely or not at all.
    ///
    /// # Errors
    /// The errors of [`RunLog::check_batch`]; [`LabError::File`], after which the files contain only the previous
    /// batches.
    pub fn append(&mut self, batch: &Batch) -> Result<(), LabError> {
        let end = self.check_batch(batch)?;
        let mut texts = [String::new(), String::new(), String::new()];
        for (tick, (u, e)) in (batch.first..).zip(batch.u.iter().zip(&batch.e)) {
            texts[0].push_str(&format!("{tick},{u:?},{e:?}\n"));
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
            self.truncate_to_last_batch();
            return Err(error);
        }
        for (complete_bytes, text) in self.complete_bytes.iter_mut().zip(&texts) {
            *complete_bytes = complete_bytes.saturating_add(text.len() as u64);
        }
        self.logged = end;
        if self.last_sync.elapsed() > SYNC_INTERVAL {
            self.sync()?;
        }
        Ok(())
    }

    /// Truncates the files to the last complete batch. A failure is ignored, since an incomplete line is never read.
    fn truncate_to_last_batch(&self) {
        for ((_, file), complete_bytes) in self.files.iter().zip(self.complete_bytes) {
            let _ = file.set_len(complete_bytes);
        }
    }

    /// Returns the number of logged ticks.
    pub fn tick_count(&self) -> usize {
        self.logged
    }

    /// Flushes all files to the disk.
    ///
    /// # Errors
    /// [`LabError::File`].
    pub fn sync(&mut self) -> Result<(), LabError> {
        for (path, file) in &self.files {
            file.sync_data().map_err(|source| LabError::file(path, source))?;
        }
        self.last_sync = Instant::now();
        Ok(())
    }
}

fn append(path: &Path, file: &mut File, text: &str) -> Result<(), LabError> {
    file.write_all(text.as_bytes())
        .map_err(|source| LabError::file(path, source))
}

/// Returns the bytes up to the end of the last complete line.
pub(super) fn complete_lines(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    end.and_then(|end| bytes.get(..=end)).unwrap_or_default()
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// The third file is on a full disk: none of the files contains the batch, and its ticks do not count.
    #[test]
    fn batch_on_a_full_disk_is_rolled_back() {
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
        assert_eq!(log.tick_count(), 10);
        assert_eq!(std::fs::read(stem.file("ticks.csv")).unwrap(), before);
        // Once there is space, the log continues at the same position.
        log.files[2].1 = frames;
        log.append(&batch(10)).unwrap();
        assert_eq!(log.tick_count(), 20);
        let text = std::fs::read_to_string(stem.file("ticks.csv")).unwrap();
        assert_eq!(text.lines().count(), 21);
    }
}
