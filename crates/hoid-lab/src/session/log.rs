//! What is appended while a run goes on.
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

use super::{begun::APPENDED, folder::Stem};
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
    /// What the device said.
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

/// What a page sends at once.
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

/// The files of a run that goes on.
#[derive(Debug)]
pub struct RunLog {
    files: [(PathBuf, File); 3],
    synced: Instant,
    logged: usize,
    planned: usize,
}

impl RunLog {
    /// Makes the files with their headers.
    ///
    /// # Errors
    /// [`LabError::File`]; a file that is there already is not written over.
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
            synced: Instant::now(),
            logged: 0,
            planned: ticks,
        })
    }

    /// Appends a batch.
    ///
    /// # Errors
    /// [`LabError::Message`] for a batch that does not continue the last one or is beyond the end;
    /// [`LabError::File`].
    pub fn append(&mut self, batch: &Batch) -> Result<(), LabError> {
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
        self.logged = end;
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
        for ((path, file), text) in self.files.iter_mut().zip(&texts) {
            append(path, file, text)?;
        }
        if self.synced.elapsed() > SYNC {
            self.sync()?;
        }
        Ok(())
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
