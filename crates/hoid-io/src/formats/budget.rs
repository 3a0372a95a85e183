//! Memory limit of a file of any format, because a crafted file of a few bytes can decompress to any length.
//!
//! A file of n bytes may decompress to `48 MB + 64 n`, at most 16 GB. The environment variable [`LIMIT_VARIABLE`], in
//! megabytes, replaces this limit if it is larger. Parsing a settings file takes many times the memory of its text
//! (TOML up to a hundred times, JSON less). The text may therefore have at most 2 MB (TOML) or 10 MB (JSON), or a
//! fraction of the limit in the environment variable if that is larger.

use crate::IoError;

/// Number of bytes to which a file of any size may decompress. Readers hold up to four copies of the values during
/// conversion (as stored, as numbers, as columns, in a survey), so reading a file of a few bytes takes less than 300
/// MB.
const MIN_BUDGET_BYTES: u64 = 48 << 20;
/// Additional decompressed bytes allowed per byte of the file.
const BUDGET_BYTES_PER_FILE_BYTE: u64 = 64;
/// Largest number of bytes to which a file may decompress, regardless of its size.
const MAX_BUDGET_BYTES: u64 = 16 << 30;
/// Environment variable that raises the limit, in MB.
const LIMIT_VARIABLE: &str = "HOID_MAX_UNPACKED_MB";
/// Memory that a string takes in addition to its characters, in bytes.
const TEXT_OVERHEAD_BYTES: u64 = 64;
/// Maximum nesting of structures.
pub(super) const MAX_NESTING: usize = 32;

/// Memory that reading a file may still take.
#[derive(Debug)]
pub(super) struct Budget {
    remaining: u64,
    limit: u64,
}

impl Budget {
    /// Returns the budget of a file of the given size in bytes.
    pub(super) fn of(file_bytes: usize) -> Self {
        let by_size = MIN_BUDGET_BYTES.saturating_add(BUDGET_BYTES_PER_FILE_BYTE.saturating_mul(file_bytes as u64));
        Self::with_limit(by_size.min(MAX_BUDGET_BYTES).max(configured_limit().unwrap_or(0)))
    }

    fn with_limit(all: u64) -> Self {
        Self {
            remaining: all,
            limit: all,
        }
    }

    /// Reserves memory before it is filled; an error if the limit is exceeded.
    pub(super) fn take(&mut self, bytes: u64, file: &str) -> Result<(), IoError> {
        match self.remaining.checked_sub(bytes) {
            Some(remaining) => {
                self.remaining = remaining;
                Ok(())
            }
            None => Err(IoError::Unsupported {
                file: file.to_owned(),
                found: format!("it unpacks to more than {} MB", self.limit >> 20),
                remedy: "write it without compression, or in parts; if this size is intended, set HOID_MAX_UNPACKED_MB \
                         in the environment to the number of MB allowed",
            }),
        }
    }

    /// Reserves the memory that `count` numbers need as [`f64`] in addition to their `bytes_each` stored bytes.
    pub(super) fn take_numbers(&mut self, count: usize, bytes_each: usize, file: &str) -> Result<(), IoError> {
        let more = (size_of::<f64>() as u64).saturating_sub(bytes_each as u64);
        self.take(more.saturating_mul(count as u64), file)
    }

    /// Reserves the memory of `count` strings with `bytes` bytes in total.
    pub(super) fn take_texts(&mut self, count: usize, bytes: usize, file: &str) -> Result<(), IoError> {
        self.take(
            TEXT_OVERHEAD_BYTES
                .saturating_mul(count as u64)
                .saturating_add(bytes as u64),
            file,
        )
    }
}

/// Returns the limit in the environment variable in bytes; `None` if it is not set.
fn configured_limit() -> Option<u64> {
    let megabytes: u64 = std::env::var(LIMIT_VARIABLE).ok()?.trim().parse().ok()?;
    megabytes.checked_mul(1 << 20)
}

/// Text format of a settings file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum SettingsFormat {
    Json,
    Toml,
}

impl SettingsFormat {
    /// Returns the number by which the limit in the environment variable is divided to obtain the maximum length of the
    /// text.
    pub(crate) fn limit_divisor(self) -> u64 {
        match self {
            Self::Json => 32,
            Self::Toml => 128,
        }
    }

    /// Returns the maximum length of the text in bytes.
    pub(crate) fn max_bytes(self) -> u64 {
        let typical = match self {
            Self::Json => 10 << 20,
            Self::Toml => 2 << 20,
        };
        let most = configured_limit().and_then(|raised| raised.checked_div(self.limit_divisor()));
        most.map_or(typical, |most| typical.max(most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A damaged file of 31 kB may state an array of 128 MB that it does not contain; its budget must be smaller.
    #[test]
    fn small_files_have_a_small_budget() {
        let mut budget = Budget::of(31_128);
        assert!(budget.take(1 << 27, "a.mat").is_err());
        budget.take(1 << 25, "a.mat").unwrap();
        assert!(budget.take(1 << 25, "a.mat").is_err());
        // A million strings of one character exceed the limit of a small file.
        assert!(Budget::of(1000).take_texts(1_000_000, 1_000_000, "a.mat").is_err());
        // A larger file may decompress to more.
        Budget::of(10 << 20).take(1 << 29, "a.mat").unwrap();
        assert!(Budget::of(usize::MAX).take(MAX_BUDGET_BYTES + 1, "a.mat").is_err());
        let message = Budget::with_limit(1).take(2, "a.mat").unwrap_err().to_string();
        assert!(message.contains(LIMIT_VARIABLE), "{message}");
    }
}
