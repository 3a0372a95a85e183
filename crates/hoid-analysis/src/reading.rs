//! Options of reading files, kept with the data.

use std::path::PathBuf;

use hoid_io::{NewRate, Preparation, QualityIssueKind, ReadOptions};

/// Options of reading files.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Columns, sampling, span, repair.
    pub options: ReadOptions,
    /// Units, scale, offset, rate, run-in, detrend.
    pub preparation: Preparation,
    /// Masked parts: the record is cut there.
    pub mask: Vec<QualityIssueKind>,
    /// Shortest segment between masked samples, s.
    pub shortest_s: f64,
}

impl Default for Reading {
    fn default() -> Self {
        Self {
            options: ReadOptions::default(),
            preparation: Preparation::default(),
            mask: Vec::new(),
            shortest_s: 2.0,
        }
    }
}

/// Files, and the options with which they were read.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    pub paths: Vec<PathBuf>,
    pub reading: Reading,
}

impl Reading {
    /// True if the rate was named in Hz, and is not to be lowered again.
    pub(crate) fn settles_the_rate(&self) -> bool {
        matches!(self.preparation.rate, NewRate::Hz(_))
    }
}
