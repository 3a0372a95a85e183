//! Files that are whole or not there: written beside their place, then renamed into it.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::IoError;

/// Writes a file through `write`. A file that exists is replaced only when everything is written and on the disk; on an error
/// it stays as it was and nothing else is left behind. A pipe or a device is written into directly.
///
/// # Errors
/// [`IoError::Directory`], [`IoError::Unwritable`] for what the system or `write` says.
///
/// ```
/// let path = std::env::temp_dir().join("hoid-example.txt");
/// hoid_io::write_atomically(&path, |file| writeln!(file, "done"))?;
/// assert_eq!(std::fs::read_to_string(&path).unwrap(), "done\n");
/// # std::fs::remove_file(&path).unwrap();
/// # Ok::<(), hoid_io::IoError>(())
/// ```
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), IoError> {
    let file = || path.display().to_string();
    // A link stays a link: the file that it names is replaced.
    let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let known = fs::metadata(&place).ok();
    let unwritable = |source| IoError::Unwritable { file: file(), source };
    match &known {
        Some(known) if known.is_dir() => Err(IoError::Directory { file: file() }),
        Some(known) if !known.is_file() => {
            let direct = fs::OpenOptions::new().write(true).open(&place).map_err(unwritable)?;
            fill(direct, write).map_err(unwritable).map(drop)
        }
        _ => replace(&place, known.map(|k| k.permissions()), write).map_err(unwritable),
    }
}

/// Makes a directory for results, and those above it, where they are not there yet.
///
/// # Errors
/// [`IoError::Unwritable`] for what the system says.
pub fn make_directory(path: &Path) -> Result<(), IoError> {
    fs::create_dir_all(path).map_err(|source| IoError::Unwritable {
        file: path.display().to_string(),
        source,
    })
}

fn replace(
    place: &Path,
    permissions: Option<fs::Permissions>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    if place.file_name().is_none() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "the path names no file"));
    }
    let parent = match place.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
        _ => PathBuf::from("."),
    };
    let beside = beside().tempfile_in(parent)?;
    let beside = {
        let (file, name) = beside.into_parts();
        let file = fill(file, write)?;
        file.sync_all()?;
        tempfile::NamedTempFile::from_parts(file, name)
    };
    if let Some(permissions) = permissions {
        fs::set_permissions(beside.path(), permissions)?;
    }
    beside.persist(place).map(drop).map_err(|error| error.error)
}

fn fill(file: fs::File, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<fs::File> {
    let mut buffer = BufWriter::with_capacity(1 << 16, file);
    write(&mut buffer)?;
    buffer.into_inner().map_err(io::IntoInnerError::into_error)
}

/// A file of the usual permissions (those of the umask), where temporary files are otherwise closed to all others.
fn beside() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".hoid-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_leaves_the_old_file_and_nothing_beside_it() {
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
    fn places_that_cannot_be_written() {
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
    fn links_and_permissions_stay_what_they_are() {
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
