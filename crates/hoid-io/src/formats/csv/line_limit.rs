//! Maximum length of a line, which is the same for all text readers.
//!
//! A recorder that was stopped by a full disk or a power cut may leave any number of bytes without a line end. Because
//! a whole line is kept in memory, reading stops at a line that is too long.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use crate::IoError;

/// Maximum length of a line in bytes.
pub(super) const MAX_LINE_BYTES: usize = 32 << 20;
/// Number of bytes that are read and examined at a time.
const READ_BYTES: usize = 1 << 20;

/// Length of the line that is being read.
#[derive(Debug, Default)]
pub(in crate::formats) struct LineLimit {
    /// Number of bytes examined.
    examined_bytes: usize,
    /// Start of the current line.
    line: usize,
}

impl LineLimit {
    /// Starts at a line that starts at byte `at` of the file.
    pub(super) fn starting_at(at: usize) -> Self {
        Self {
            examined_bytes: at,
            line: at,
        }
    }

    /// Examines the next bytes.
    ///
    /// # Errors
    /// [`IoError::LongLine`] for a line longer than [`MAX_LINE_BYTES`].
    pub(in crate::formats) fn add(&mut self, bytes: &[u8], file: &str) -> Result<(), IoError> {
        let is_end = |byte: &u8| matches!(byte, b'\n' | b'\r');
        for part in bytes.chunks(READ_BYTES) {
            let first = part.iter().position(is_end).unwrap_or(part.len());
            if self.examined_bytes.saturating_add(first).saturating_sub(self.line) > MAX_LINE_BYTES {
                return Err(IoError::LongLine {
                    file: file.to_owned(),
                    byte: self.line,
                    max_mb: MAX_LINE_BYTES >> 20,
                });
            }
            if let Some(last) = part.iter().rposition(is_end) {
                self.line = self.examined_bytes.saturating_add(last).saturating_add(1);
            }
            self.examined_bytes = self.examined_bytes.saturating_add(part.len());
        }
        Ok(())
    }
}

/// Reads a whole text.
///
/// # Errors
/// [`IoError::LongLine`]; [`IoError::Unreadable`].
pub(in crate::formats) fn read_whole_text(path: &Path, file: &str) -> Result<Vec<u8>, IoError> {
    let unreadable = |source| IoError::Unreadable {
        file: file.to_owned(),
        source,
    };
    let mut opened = File::open(path).map_err(unreadable)?;
    let length = opened.metadata().map_or(0, |about| about.len() as usize);
    let mut bytes = Vec::new();
    // The size of a sparse file may exceed any memory although it contains few lines; a failed reservation is ignored.
    let _ = bytes.try_reserve(length.saturating_add(1));
    let mut limit = LineLimit::default();
    loop {
        let from = bytes.len();
        let read = (&mut opened)
            .take(READ_BYTES as u64)
            .read_to_end(&mut bytes)
            .map_err(unreadable)?;
        if read == 0 {
            return Ok(bytes);
        }
        limit.add(bytes.get(from..).unwrap_or_default(), file)?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_up_to_the_limit_are_read() {
        let line = vec![b'1'; MAX_LINE_BYTES];
        for end in [&b"\n"[..], b"\r", b"\r\n"] {
            let mut limit = LineLimit::default();
            for _ in 0..2 {
                limit.add(&line, "run.csv").unwrap();
                limit.add(end, "run.csv").unwrap();
            }
            limit.add(b"0,1\n", "run.csv").unwrap();
        }
        let mut limit = LineLimit::starting_at(7);
        limit.add(b"0,1\n", "run.csv").unwrap();
        limit.add(&line, "run.csv").unwrap();
        let error = limit.add(b"1", "run.csv").unwrap_err().to_string();
        assert!(
            error.starts_with("run.csv: no line ends within 32 MB after byte 11, expected one line per sample"),
            "{error}"
        );
    }

    #[test]
    fn text_without_line_ends_is_refused() {
        let file = tempfile::Builder::new().suffix(".csv").tempfile().unwrap();
        std::fs::write(file.path(), "t,\"e\"\n0,1\n").unwrap();
        assert_eq!(read_whole_text(file.path(), "run.csv").unwrap(), b"t,\"e\"\n0,1\n");
        File::options()
            .write(true)
            .open(file.path())
            .unwrap()
            .set_len(1 << 30)
            .unwrap();
        let error = read_whole_text(file.path(), "run.csv").unwrap_err().to_string();
        assert!(error.contains("within 32 MB after byte 10"), "{error}");
        std::fs::write(file.path(), "").unwrap();
        assert_eq!(read_whole_text(file.path(), "run.csv").unwrap(), b"");
        let missing = read_whole_text(&file.path().with_extension("no"), "run.csv");
        assert!(matches!(missing, Err(IoError::Unreadable { .. })));
    }
}
