//! Options for reading files, stored with the data.

use std::path::PathBuf;

use hoid_io::{NewRate, Preparation, QualityIssueKind, ReadOptions};

/// Options for reading files.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Columns, sampling, span and repair.
    pub options: ReadOptions,
    /// Units, scale, offset, rate, run-in and detrending.
    pub preparation: Preparation,
    /// Kinds of problems whose rows are masked: the record is cut at these rows.
    pub mask: Vec<QualityIssueKind>,
    /// Minimum length of a segment between masked rows, s.
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
    /// True if the user gave the rate in Hz; it is then not lowered further.
    pub(crate) fn has_fixed_rate(&self) -> bool {
        matches!(self.preparation.rate, NewRate::Hz(_))
    }
}
