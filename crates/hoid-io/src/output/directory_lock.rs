//! Exclusive use of a directory of results by one process.
//!
//! The lock is an operating-system lock on the directory itself (or, on systems where directories cannot be opened, on
//! a file `.hoid-lock` in the directory), so a killed process leaves no lock. On a file system that does not support
//! locks nothing is locked.

use std::fs::{File, TryLockError};
use std::path::Path;

use crate::IoError;

/// A directory that is locked against other processes until this value is dropped.
#[derive(Debug)]
pub struct DirectoryLock(#[allow(dead_code)] Option<File>);

impl DirectoryLock {
    /// Locks an existing directory.
    ///
    /// # Errors
    /// [`IoError::InUse`] if another process, or another run in the same process, has locked the directory.
    pub fn take(directory: &Path) -> Result<Self, IoError> {
        #[cfg(unix)]
        let opened = File::open(directory);
        #[cfg(not(unix))]
        let opened = File::options()
            .create(true)
            .truncate(false)
            .write(true)
            .open(directory.join(".hoid-lock"));
        let file = opened.map_err(|source| IoError::Unwritable {
            file: directory.display().to_string(),
            source,
        })?;
        match file.try_lock() {
            Ok(()) => Ok(Self(Some(file))),
            Err(TryLockError::WouldBlock) => Err(IoError::InUse {
                directory: directory.display().to_string(),
            }),
            Err(TryLockError::Error(_)) => Ok(Self(None)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directory_lock_is_exclusive() {
        let dir = tempfile::tempdir().unwrap();
        let first = DirectoryLock::take(dir.path()).unwrap();
        let message = DirectoryLock::take(dir.path()).unwrap_err().to_string();
        assert!(message.contains("another process is using"), "{message}");
        drop(first);
        DirectoryLock::take(dir.path()).unwrap();
        assert!(DirectoryLock::take(&dir.path().join("none")).is_err());
    }
}
