//! Atomic writing of files: a file is written under a temporary name in the same directory and then renamed.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::part_file::TemporaryFile;
use crate::IoError;

/// Writes a file with the function `write`. An existing file is replaced only after all data have been written to the
/// disk; if an error occurs, the existing file is unchanged and no other file remains. Pipes and devices are written to
/// directly.
///
/// # Errors
/// [`IoError::Directory`] if the path is a directory; [`IoError::Unwritable`] for an error of the operating system or
/// of `write`.
///
/// ```
/// let path = std::env::temp_dir().join("hoid-example.txt");
/// hoid_io::write_atomically(&path, |file| writeln!(file, "done"))?;
/// assert_eq!(std::fs::read_to_string(&path).unwrap(), "done\n");
/// # std::fs::remove_file(&path).unwrap();
/// # Ok::<(), hoid_io::IoError>(())
/// ```
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), IoError> {
    let mut file = WholeFile::create(path)?;
    file.write(write)?;
    file.finish()
}

/// Creates a directory for results, including missing parent directories.
///
/// # Errors
/// [`IoError::Unwritable`] for errors reported by the operating system.
pub fn make_directory(path: &Path) -> Result<(), IoError> {
    fs::create_dir_all(path).map_err(|source| IoError::Unwritable {
        file: path.display().to_string(),
        source,
    })
}

/// A file being written; if this value is dropped before [`finish`](Self::finish), an existing file is unchanged.
pub(crate) struct WholeFile {
    buffer: BufWriter<fs::File>,
    /// Path as given by the user.
    name: String,
    /// Final path and temporary file; `None` for a pipe or a device.
    part_file: Option<PartFile>,
}

struct PartFile {
    part: TemporaryFile,
    path: PathBuf,
    permissions: Option<fs::Permissions>,
}

impl WholeFile {
    pub(crate) fn create(path: &Path) -> Result<Self, IoError> {
        let name = path.display().to_string();
        // If the path is a symbolic link, the link is kept, and the file to which it points is replaced.
        let location = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let known = fs::metadata(&location).ok();
        let opened = match known {
            Some(known) if known.is_dir() => return Err(IoError::Directory { file: name }),
            Some(known) if !known.is_file() => {
                let direct = fs::OpenOptions::new().write(true).open(&location);
                direct.map(|file| (file, None))
            }
            known => {
                create_part(location, known.map(|k| k.permissions())).map(|(file, part_file)| (file, Some(part_file)))
            }
        };
        match opened {
            Ok((file, part_file)) => Ok(Self {
                buffer: BufWriter::with_capacity(1 << 16, file),
                name,
                part_file,
            }),
            Err(source) => Err(IoError::Unwritable { file: name, source }),
        }
    }

    /// Appends the data written by `write`.
    pub(crate) fn write<T>(&mut self, write: impl FnOnce(&mut dyn Write) -> io::Result<T>) -> Result<T, IoError> {
        write(&mut self.buffer).map_err(|source| IoError::Unwritable {
            file: self.name.clone(),
            source,
        })
    }

    /// Renames the file to its final path after all data have been written to the disk.
    pub(crate) fn finish(self) -> Result<(), IoError> {
        let Self {
            buffer,
            name,
            part_file,
        } = self;
        let finished = buffer
            .into_inner()
            .map_err(io::IntoInnerError::into_error)
            .and_then(|file| part_file.map_or(Ok(()), |part_file| part_file.persist(file)));
        finished.map_err(|source| IoError::Unwritable { file: name, source })
    }
}

impl PartFile {
    fn persist(self, file: fs::File) -> io::Result<()> {
        file.sync_all()?;
        self.part.persist(file, &self.path, self.permissions)
    }
}

fn create_part(location: PathBuf, permissions: Option<fs::Permissions>) -> io::Result<(fs::File, PartFile)> {
    let (file, part) = TemporaryFile::create_in(&directory_of(&location)?)?;
    Ok((
        file,
        PartFile {
            part,
            path: location,
            permissions,
        },
    ))
}

/// Returns the directory of a file that will be written.
pub(super) fn directory_of(location: &Path) -> io::Result<PathBuf> {
    if location.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path has no file name"));
    }
    Ok(match location.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failed_write_leaves_only_the_old_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.csv");
        write_atomically(&path, |file| file.write_all(b"old")).unwrap();
        let failed = write_atomically(&path, |file| {
            file.write_all(&[b'x'; 200_000])?;
            Err(io::Error::other("the pen broke"))
        });
        assert!(failed.unwrap_err().to_string().contains("the pen broke"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        write_atomically(&path, |file| file.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }

    #[test]
    fn unwritable_paths_are_errors() {
        let dir = tempfile::tempdir().unwrap();
        let write = |path: &Path| write_atomically(path, |_| Ok(())).unwrap_err();
        assert!(matches!(write(dir.path()), IoError::Directory { .. }));
        assert!(matches!(
            write(&dir.path().join("no/such/a.csv")),
            IoError::Unwritable { .. }
        ));
        assert!(matches!(write(Path::new("")), IoError::Unwritable { .. }));
        assert!(matches!(write(&dir.path().join("no/..")), IoError::Unwritable { .. }));
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_are_preserved() {
        use std::os::unix::fs::PermissionsExt;
        let dir = tempfile::tempdir().unwrap();
        let (path, link) = (dir.path().join("a.csv"), dir.path().join("link.csv"));
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        write_atomically(&path, |file| file.write_all(b"1")).unwrap();
        let plain = dir.path().join("plain");
        fs::write(&plain, b"").unwrap();
        assert_eq!(mode(&path), mode(&plain));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write_atomically(&link, |file| file.write_all(b"2")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&path).unwrap(), b"2");
        assert_eq!(mode(&path), 0o640);
    }
}
