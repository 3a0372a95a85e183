//! Checks, before the work starts, whether a result can be written to a path: a result never replaces its own input,
//! and an unwritable directory is detected at once.
//!
//! Two paths denote the same file if the system reports the same device and file number for both (so that symbolic and
//! hard links are recognised), or, on other systems, if their full paths are equal.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::atomic::directory_of;
use super::part_file::TemporaryFile;
use crate::IoError;

/// True if two paths denote the same existing file, directly or through a link.
#[must_use]
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let (Ok(known_a), Ok(known_b)) = (fs::metadata(a), fs::metadata(b)) else {
        return false;
    };
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        (known_a.dev(), known_a.ino()) == (known_b.dev(), known_b.ino())
    }
    #[cfg(not(unix))]
    {
        known_a.is_dir() == known_b.is_dir()
            && matches!((fs::canonicalize(a), fs::canonicalize(b)), (Ok(a), Ok(b)) if a == b)
    }
}

/// Checks that a file can be written to a path without replacing one of `inputs`. The check leaves no file; pipes and
/// devices are not opened.
///
/// # Errors
/// [`IoError::OutputIsInput`], [`IoError::Directory`] or [`IoError::Unwritable`].
pub fn check_output(output: &Path, inputs: &[&Path]) -> Result<(), IoError> {
    let file = || output.display().to_string();
    match fs::metadata(output) {
        Ok(known) if known.is_dir() => return Err(IoError::Directory { file: file() }),
        Ok(known) if !known.is_file() => return Ok(()),
        _ => {}
    }
    if let Some(input) = inputs.iter().find(|input| is_same_file(output, input)) {
        return Err(IoError::OutputIsInput {
            file: file(),
            input: input.display().to_string(),
        });
    }
    let place = fs::canonicalize(output).unwrap_or_else(|_| output.to_owned());
    let tried = directory_of(&place).and_then(|directory| TemporaryFile::create_in(&directory).map(drop));
    tried.map_err(|source| IoError::Unwritable { file: file(), source })
}

/// Checks that files can be written to a directory, which may not exist yet. None of `inputs` may lie in the directory,
/// so that no input is replaced.
///
/// # Errors
/// [`IoError::OutputAmongInputs`] or [`IoError::Unwritable`].
pub fn check_output_directory(directory: &Path, inputs: &[&Path]) -> Result<(), IoError> {
    let file = || directory.display().to_string();
    let lies_in = |input: &&&Path| directory_of(input).is_ok_and(|of| is_same_file(&of, directory));
    if let Some(input) = inputs.iter().find(lies_in) {
        return Err(IoError::OutputAmongInputs {
            directory: file(),
            input: input.display().to_string(),
        });
    }
    let tried = nearest_existing(directory).and_then(|there| TemporaryFile::create_in(&there).map(drop));
    tried.map_err(|source| IoError::Unwritable { file: file(), source })
}

/// Returns the directory if it exists, otherwise its nearest existing parent.
fn nearest_existing(directory: &Path) -> io::Result<PathBuf> {
    let mut at = directory;
    loop {
        match fs::metadata(at) {
            Ok(known) if known.is_dir() => return Ok(at.to_owned()),
            Ok(_) => {
                let what = format!("{} is a file", at.display());
                return Err(io::Error::new(io::ErrorKind::NotADirectory, what));
            }
            Err(_) => {}
        }
        match at.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => at = parent,
            _ => return Ok(PathBuf::from(".")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn output_equal_to_an_input_is_refused_under_any_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        fs::write(path("in.csv"), "t,e,u\n").unwrap();
        fs::create_dir(path("sub")).unwrap();
        fs::hard_link(path("in.csv"), path("hard.csv")).unwrap();
        let mut names = vec![path("in.csv"), path("sub/../in.csv"), path("hard.csv")];
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(path("in.csv"), path("soft.csv")).unwrap();
            names.push(path("soft.csv"));
        }
        let input = path("in.csv");
        for name in &names {
            let message = check_output(name, &[&input]).unwrap_err().to_string();
            assert!(
                message.contains("of this command and would be overwritten"),
                "{message}"
            );
        }
        check_output(&path("out.csv"), &[&input]).unwrap();
        assert!(check_output_directory(dir.path(), &[&input]).is_err());
        check_output_directory(&path("new/deeper"), &[&input]).unwrap();
        assert!(!path("new").exists());
        assert_eq!(fs::read_to_string(&input).unwrap(), "t,e,u\n");
    }

    #[test]
    fn unwritable_outputs_are_refused_in_advance() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        fs::write(path("file"), "").unwrap();
        assert!(matches!(check_output(dir.path(), &[]), Err(IoError::Directory { .. })));
        assert!(matches!(
            check_output(&path("no/a.csv"), &[]),
            Err(IoError::Unwritable { .. })
        ));
        assert!(matches!(
            check_output_directory(&path("file/below"), &[]),
            Err(IoError::Unwritable { .. })
        ));
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
