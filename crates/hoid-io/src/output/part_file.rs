//! Temporary files for output in progress: `.hoid-*.part` in the directory of the final path.
//!
//! A temporary file is locked while its writer exists; the operating system releases the locks of a process when the
//! process ends for any reason. A temporary file that can be locked therefore has no owner, and the next process that
//! writes to its directory removes it. After a writer has locked its file, it checks that the file still exists,
//! because another process may have removed the file before it was locked. On a file system that does not support
//! locks, temporary files are left in place.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{NamedTempFile, TempPath};

const PREFIX: &str = ".hoid-";
const SUFFIX: &str = ".part";

/// Maximum number of attempts to create a temporary file, in case another process removes it before it is locked;
/// normally one attempt suffices.
const MAX_ATTEMPTS: usize = 16;

/// Temporary files of this process, and the directories that this process has cleaned.
struct PartFiles {
    parts: BTreeSet<PathBuf>,
    cleaned_directories: BTreeSet<PathBuf>,
}

static KNOWN: Mutex<PartFiles> = Mutex::new(PartFiles {
    parts: BTreeSet::new(),
    cleaned_directories: BTreeSet::new(),
});

fn lock_part_files() -> MutexGuard<'static, PartFiles> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the temporary files of this process. It must be called on an interrupt, since values are not dropped when a
/// process exits.
pub fn remove_unfinished_files() {
    for part in std::mem::take(&mut lock_part_files().parts) {
        // A file that has already been renamed needs no removal; one that cannot be removed now is removed by a later
        // process.
        let _ = fs::remove_file(part);
    }
}

/// A temporary file, which is removed when this value is dropped.
pub(super) struct TemporaryFile {
    path: Option<TempPath>,
}

impl TemporaryFile {
    /// Creates a locked temporary file in a directory. The first time, the temporary files of processes that have ended
    /// are removed from the directory.
    pub(super) fn create_in(directory: &Path) -> io::Result<(File, Self)> {
        sweep_once(directory);
        let mut made = create_temporary_file(directory)?;
        for _ in 1..MAX_ATTEMPTS {
            // If the file cannot be locked, locks are not supported, and no process removes the file.
            if made.as_file().lock().is_err() || made.path().exists() {
                break;
            }
            made = create_temporary_file(directory)?;
        }
        let (file, path) = made.into_parts();
        lock_part_files().parts.insert(path.to_path_buf());
        Ok((file, Self { path: Some(path) }))
    }

    /// Renames the temporary file to its final path.
    pub(super) fn persist(
        mut self,
        file: File,
        location: &Path,
        permissions: Option<fs::Permissions>,
    ) -> io::Result<()> {
        let Some(path) = self.path.take() else {
            return Err(io::Error::other("the file was already moved to its final path"));
        };
        let name = path.to_path_buf();
        let part = NamedTempFile::from_parts(file, path);
        let set = permissions.map_or(Ok(()), |permissions| fs::set_permissions(part.path(), permissions));
        let persisted = set.and_then(|()| part.persist(location).map(drop).map_err(|error| error.error));
        lock_part_files().parts.remove(&name);
        persisted
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        if let Some(path) = &self.path {
            lock_part_files().parts.remove(&path.to_path_buf());
        }
    }
}

/// Creates a file with default permissions (according to the umask), since temporary files are otherwise private to
/// their owner.
fn create_temporary_file(directory: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(directory).map_err(without_path)
}

/// Returns the error of the operating system without the name of the temporary file; the message names the requested
/// path instead.
fn without_path(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.split_once(" at path ") {
        Some((what, _)) => io::Error::new(error.kind(), what.to_owned()),
        None => error,
    }
}

/// Removes temporary files that processes left in a directory when they ended, the first time this process writes to
/// it.
fn sweep_once(directory: &Path) {
    let directory = fs::canonicalize(directory).unwrap_or_else(|_| directory.to_owned());
    if lock_part_files().cleaned_directories.insert(directory.clone()) {
        sweep(&directory);
    }
}

/// Removes the temporary files of processes that have ended. A file that cannot be opened is left in place.
fn sweep(directory: &Path) {
    let entries = fs::read_dir(directory).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_part = name.starts_with(PREFIX) && name.ends_with(SUFFIX);
        if !is_part || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let path = entry.path();
        // This process holds the lock during the removal: the writer of the file waits for the lock, and then creates
        // another file.
        if let Ok(file) = File::options().read(true).write(true).open(&path)
            && file.try_lock().is_ok()
        {
            let _ = fs::remove_file(&path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stale_parts_are_removed_and_locked_parts_kept() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let (file, living) = TemporaryFile::create_in(dir.path()).unwrap();
        // No process holds the lock of these temporary files, as after kill -9.
        fs::write(path(".hoid-dead01.part"), "half").unwrap();
        for other in [".hoid-notes", "hoid-a.part", ".part"] {
            fs::write(path(other), "kept").unwrap();
        }
        sweep(dir.path());
        let mut left: Vec<String> = crate::file_names(dir.path()).unwrap();
        left.sort();
        assert_eq!(left.len(), 4, "{left:?}");
        assert!(!left.contains(&".hoid-dead01.part".to_owned()));
        living.persist(file, &path("whole"), None).unwrap();
        assert!(path("whole").exists());
    }

    #[test]
    fn errors_do_not_name_the_temporary_file() {
        let dir = tempfile::tempdir().unwrap();
        let error = TemporaryFile::create_in(&dir.path().join("none")).err().unwrap();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
        assert!(!error.to_string().contains(PREFIX), "{error}");
    }

    #[test]
    fn parts_are_registered_and_removed() {
        let dir = tempfile::tempdir().unwrap();
        let (_file, part) = TemporaryFile::create_in(dir.path()).unwrap();
        // Only the file in this directory is examined: other tests have temporary files in progress.
        let own = part.path.as_ref().unwrap().to_path_buf();
        assert!(lock_part_files().parts.contains(&own) && own.exists());
        drop(part);
        assert!(!lock_part_files().parts.contains(&own) && !own.exists());
    }
}
