//! Files in progress: `.hoid-*.part` in the directory of their final path.
//!
//! A part is locked during the life of its writer; the system releases the locks of a process that
//! ended, for any reason. A part that can be locked therefore has no owner, and the next process
//! that writes to its directory removes it. After locking, a writer checks that its part still
//! exists, so that a part is never removed between its creation and its lock. On a file system
//! without locks, parts are left alone.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{NamedTempFile, TempPath};

const PREFIX: &str = ".hoid-";
const SUFFIX: &str = ".part";

/// Attempts to create a part that another process removes before it is locked; normally one suffices.
const ATTEMPTS: usize = 16;

/// Files in progress of this process, and the directories that it has cleaned.
struct PartFiles {
    parts: BTreeSet<PathBuf>,
    swept: BTreeSet<PathBuf>,
}

static KNOWN: Mutex<PartFiles> = Mutex::new(PartFiles {
    parts: BTreeSet::new(),
    swept: BTreeSet::new(),
});

fn known() -> MutexGuard<'static, PartFiles> {
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes the partial output of this process when it is interrupted, since nothing is dropped when a process exits.
pub fn remove_unfinished_files() {
    for part in std::mem::take(&mut known().parts) {
        // A part that was already renamed, or cannot be removed now, is removed later.
        let _ = fs::remove_file(part);
    }
}

/// A file in progress, removed when it is dropped.
pub(super) struct Part {
    path: Option<TempPath>,
}

impl Part {
    /// Creates a locked part in a directory, after removing the parts of ended processes.
    pub(super) fn create_in(directory: &Path) -> io::Result<(File, Self)> {
        sweep_once(directory);
        let mut made = make(directory)?;
        for _ in 1..ATTEMPTS {
            // Without locks no process removes it.
            if made.as_file().lock().is_err() || made.path().exists() {
                break;
            }
            made = make(directory)?;
        }
        let (file, path) = made.into_parts();
        known().parts.insert(path.to_path_buf());
        Ok((file, Self { path: Some(path) }))
    }

    /// Renames the part to its final path.
    pub(super) fn persist(mut self, file: File, place: &Path, permissions: Option<fs::Permissions>) -> io::Result<()> {
        let Some(path) = self.path.take() else {
            return Err(io::Error::other("the file was already put in its place"));
        };
        let name = path.to_path_buf();
        let part = NamedTempFile::from_parts(file, path);
        let set = permissions.map_or(Ok(()), |permissions| fs::set_permissions(part.path(), permissions));
        let persisted = set.and_then(|()| part.persist(place).map(drop).map_err(|error| error.error));
        known().parts.remove(&name);
        persisted
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        if let Some(path) = &self.path {
            known().parts.remove(&path.to_path_buf());
        }
    }
}

/// Creates a file with default permissions (those of the umask); temporary files are otherwise
/// private to their owner.
fn make(directory: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PREFIX).suffix(SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(directory).map_err(without_path)
}

/// The error of the system without the name of the part, which is of no interest to the user: the message names the
/// requested path.
fn without_path(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.split_once(" at path ") {
        Some((what, _)) => io::Error::new(error.kind(), what.to_owned()),
        None => error,
    }
}

/// Cleans a directory the first time that this process writes to it.
fn sweep_once(directory: &Path) {
    let directory = fs::canonicalize(directory).unwrap_or_else(|_| directory.to_owned());
    if known().swept.insert(directory.clone()) {
        sweep(&directory);
    }
}

/// Removes the parts of ended processes. A part that cannot be examined is left.
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
        // The lock is held during the removal: the owner of the part waits for it, and creates another.
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
    fn parts_of_the_dead_are_swept_and_those_of_the_living_are_not() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let (file, living) = Part::create_in(dir.path()).unwrap();
        // No process holds the lock of these, as after kill -9.
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
    fn an_error_does_not_name_the_part() {
        let dir = tempfile::tempdir().unwrap();
        let error = Part::create_in(&dir.path().join("none")).err().unwrap();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
        assert!(!error.to_string().contains(PREFIX), "{error}");
    }

    #[test]
    fn an_interrupt_leaves_nothing_on_its_way() {
        let dir = tempfile::tempdir().unwrap();
        let (_file, part) = Part::create_in(dir.path()).unwrap();
        // For this directory only: other tests have parts in progress.
        let own = part.path.as_ref().unwrap().to_path_buf();
        assert!(known().parts.contains(&own) && own.exists());
        drop(part);
        assert!(!known().parts.contains(&own) && !own.exists());
    }
}
