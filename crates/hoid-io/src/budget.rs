//! How much memory a file may take: a few bytes can be made to unpack to any length.

use crate::IoError;

/// What every file may unpack to, bytes. Readers hold values up to four times on their way (as they
/// stand in the file, as numbers, as columns, in a survey): a file of a few bytes stays below 300 MB.
const AT_LEAST: u64 = 1 << 26;
/// And so many times its own length.
const FACTOR: u64 = 64;
/// Structures inside of structures, at most.
pub(crate) const MOST_NESTED: usize = 32;

/// What is left of the memory that a file may take.
#[derive(Debug)]
pub(crate) struct Budget {
    left: u64,
    all: u64,
}

impl Budget {
    /// That of a file of so many bytes.
    pub(crate) fn of(file_bytes: usize) -> Self {
        let all = AT_LEAST.saturating_add(FACTOR.saturating_mul(file_bytes as u64));
        Self { left: all, all }
    }

    /// Takes memory before it is filled.
    pub(crate) fn take(&mut self, bytes: u64, file: &str) -> Result<(), IoError> {
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(IoError::Unsupported {
                file: file.to_owned(),
                found: format!("it unpacks to more than {} MB", self.all >> 20),
                remedy: "write it without compression, or in parts",
            }),
        }
    }
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
    }
}
