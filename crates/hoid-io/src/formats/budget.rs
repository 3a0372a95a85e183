//! How much memory a file may take, whatever its format: a few bytes can be made to unpack to any length.
//!
//! A file of n bytes may unpack to `64 MB + 64 n`, at most 16 GB. [`UNPACKED`], a number of megabytes in the
//! environment, raises both for files that are meant to be so. Settings (TOML, JSON) are held some thirty
//! times their length while they are read: they have at most 10 MB, or a thirtieth of what is raised.

use crate::IoError;

/// What every file may unpack to, bytes. Readers hold values up to four times on their way (as they
/// stand in the file, as numbers, as columns, in a survey): a file of a few bytes stays below 300 MB.
const AT_LEAST: u64 = 1 << 26;
/// And so many times its own length.
const FACTOR: u64 = 64;
/// No file unpacks to more.
const CEILING: u64 = 16 << 30;
/// The variable of the environment that raises what a file may unpack to, MB.
const UNPACKED: &str = "HOID_MAX_UNPACKED_MB";
/// Longest text of settings, bytes, and its share of what is raised.
const SETTINGS: u64 = 10 << 20;
const SETTINGS_SHARE: u64 = 32;
/// Structures inside of structures, at most.
pub(super) const MOST_NESTED: usize = 32;

/// What is left of the memory that a file may take.
#[derive(Debug)]
pub(super) struct Budget {
    left: u64,
    all: u64,
}

impl Budget {
    /// That of a file of so many bytes.
    pub(super) fn of(file_bytes: usize) -> Self {
        let by_size = AT_LEAST.saturating_add(FACTOR.saturating_mul(file_bytes as u64));
        Self::up_to(by_size.min(CEILING).max(raised().unwrap_or(0)))
    }

    fn up_to(all: u64) -> Self {
        Self { left: all, all }
    }

    /// Takes memory before it is filled.
    pub(super) fn take(&mut self, bytes: u64, file: &str) -> Result<(), IoError> {
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(IoError::Unsupported {
                file: file.to_owned(),
                found: format!("it unpacks to more than {} MB", self.all >> 20),
                remedy: "write it without compression, or in parts; where it is meant to be so large, set HOID_MAX_UNPACKED_MB in the \
                         environment to the MB that it may take",
            }),
        }
    }
}

/// What the environment allows, bytes.
fn raised() -> Option<u64> {
    let megabytes: u64 = std::env::var(UNPACKED).ok()?.trim().parse().ok()?;
    megabytes.checked_mul(1 << 20)
}

/// Longest text of settings, bytes.
pub(crate) fn longest_settings() -> u64 {
    SETTINGS.max(raised().unwrap_or(0) / SETTINGS_SHARE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A damaged HDF5 file of 31 kB stated an array of 128 MB that was nowhere in it.
    #[test]
    fn a_small_file_does_not_unpack_to_hundreds_of_megabytes() {
        let mut budget = Budget::of(31_128);
        assert!(budget.take(1 << 27, "a.mat").is_err());
        budget.take(1 << 25, "a.mat").unwrap();
        budget.take(1 << 25, "a.mat").unwrap();
        assert!(budget.take(1 << 25, "a.mat").is_err());
        // What is large itself may unpack to more.
        Budget::of(10 << 20).take(1 << 29, "a.mat").unwrap();
        assert!(Budget::of(usize::MAX).take(CEILING + 1, "a.mat").is_err());
        let said = Budget::up_to(1).take(2, "a.mat").unwrap_err().to_string();
        assert!(said.contains(UNPACKED), "{said}");
    }
}
