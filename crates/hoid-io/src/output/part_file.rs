//! Files on their way: `.hoid-*.part` next to the place where they are to be.
//!
//! A part is locked for as long as its writer lives; the system drops the locks of a process that is
//! gone, however it ended. A part that can be locked therefore belongs to no person, and is removed
//! by the next process that writes into its directory. A writer looks after locking whether its part
//! is still there, so that a part is never swept between its making and its lock. Where a file
//! system has no locks, parts are left alone.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{NamedTempFile, TempPath};

const PREFIX: &str = ".hoid-";
const SUFFIX: &str = ".part";

/// Attempts to make a part that another process sweeps before it is locked; one is the rule.
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

/// Removes the partial output of this process, for the end at an interrupt: a process that exits
/// drops nothing.
pub fn remove_unfinished_files() {
    for part in std::mem::take(&mut known().parts) {
        // Contents of its place already, or cannot be removed, is swept later.
        let _ = fs::remove_file(part);
    }
}

/// A file on its way, removed when it is dropped.
pub(super) struct Part {
    path: Option<TempPath>,
}

impl Part {
    /// A new, locked part in a directory, from which the parts of dead processes are removed.
    pub(super) fn create_in(directory: &Path) -> io::Result<(File, Self)> {
        sweep_once(directory);
        let mut made = make(directory)?;
        for _ in 1..ATTEMPTS {
            // Without locks there is nothing that could sweep it.
            if made.as_file().lock().is_err() || made.path().exists() {
                break;
            }
            made = make(directory)?;
        }
        let (file, path) = made.into_parts();
        known().parts.insert(path.to_path_buf());
        Ok((file, Self { path: Some(path) }))
    }

    /// Renames the part into its place.
    pub(super) fn persist(mut self, file: File, place: &Path, permissions: Option<fs::Permissions>) -> io::Result<()> {
        let Some(path) = self.path.take() else {
            return Err(io::Error::other("the file was put in its place before"));
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

/// A file of the default permissions (those of the umask), where temporary files are otherwise
/// closed to all others.
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

/// The error of the system without the name of the part, which belongs to no person business: the
/// message names the place that was requested.
fn without_path(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.split_once(" at path ") {
        Some((what, _)) => io::Error::new(error.kind(), what.to_owned()),
        None => error,
    }
}

/// Sweeps a directory the first time that this process writes into it.
fn sweep_once(directory: &Path) {
    let directory = fs::canonicalize(directory).unwrap_or_else(|_| directory.to_owned());
    if known().swept.insert(directory.clone()) {
        sweep(&directory);
    }
}

/// Removes the parts of processes that are gone. A part that cannot be examined stays.
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
        // The lock is held while it is removed: its maker waits for it, and makes another.
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
        // For this directory alone: other tests have parts on their way.
        let own = part.path.as_ref().unwrap().to_path_buf();
        assert!(known().parts.contains(&own) && own.exists());
        drop(part);
        assert!(!known().parts.contains(&own) && !own.exists());
    }
}
