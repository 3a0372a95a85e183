//! Files that tests write and read.
// Each test file uses only part of this module.
#![allow(dead_code, clippy::unwrap_used)]

use std::{fs, path::PathBuf};

use hoid_io::{IoError, ReadOptions, ReadRecord, read_record};

/// A temporary folder, removed after the test.
pub struct TestFolder {
    pub dir: tempfile::TempDir,
}

impl TestFolder {
    pub fn new() -> Self {
        Self {
            dir: tempfile::tempdir().unwrap(),
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Returns the record of a file with this text.
    pub fn read(&self, text: impl AsRef<[u8]>, options: &ReadOptions) -> Result<ReadRecord, IoError> {
        let path = self.path("run.csv");
        fs::write(&path, text).unwrap();
        read_record(&path, options)
    }

    /// Returns the error for a file with this text; the error must name the file.
    pub fn error(&self, text: impl AsRef<[u8]>, options: &ReadOptions) -> String {
        let message = self.read(text, options).unwrap_err().to_string();
        assert!(message.contains("run.csv"), "{message}");
        message
    }
}

/// Options with the input and the output given by these expressions.
pub fn options(input: &str, output: &str) -> ReadOptions {
    ReadOptions {
        input: Some(input.parse().unwrap()),
        output: output.parse().unwrap(),
        ..ReadOptions::default()
    }
}

pub fn default_options() -> ReadOptions {
    ReadOptions::default()
}
