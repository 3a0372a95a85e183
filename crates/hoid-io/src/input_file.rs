//! Reading of whole files that are not recordings (text, settings of limited length, bytes), and the file names in a
//! directory.

use std::fs;
use std::io::{self, Read as _};
use std::path::Path;

use crate::IoError;
use crate::formats::SettingsFormat;

/// Reads a text file.
///
/// # Errors
/// [`IoError::Unreadable`] for errors reported by the operating system.
pub fn read_text(path: &Path) -> Result<String, IoError> {
    fs::read_to_string(path).map_err(|source| IoError::Unreadable {
        file: path.display().to_string(),
        source,
    })
}

/// Reads the text of a settings file, whose length is limited so that parsing it takes little memory.
///
/// # Errors
/// [`IoError::Unreadable`] for errors reported by the operating system, and for a file that is too long.
pub fn read_settings(path: &Path) -> Result<String, IoError> {
    settings_text(path).map_err(|source| IoError::Unreadable {
        file: path.display().to_string(),
        source,
    })
}

/// As [`read_settings`], but returns the error of the operating system.
pub(crate) fn settings_text(path: &Path) -> io::Result<String> {
    let is_json = path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("json"));
    let kind = if is_json {
        SettingsFormat::Json
    } else {
        SettingsFormat::Toml
    };
    let longest = kind.max_bytes();
    let mut text = String::new();
    fs::File::open(path)?
        .take(longest.saturating_add(1))
        .read_to_string(&mut text)?;
    if text.len() as u64 <= longest {
        return Ok(text);
    }
    Err(io::Error::other(format!(
        "the settings exceed {} MB; if this size is intended, set HOID_MAX_UNPACKED_MB in the environment to {} times \
         the size in MB",
        longest >> 20,
        kind.limit_divisor()
    )))
}

/// Reads the bytes of a file.
///
/// # Errors
/// [`IoError::Unreadable`] for errors reported by the operating system.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, IoError> {
    fs::read(path).map_err(|source| IoError::Unreadable {
        file: path.display().to_string(),
        source,
    })
}

/// Returns the names of the files in a directory, in arbitrary order.
///
/// # Errors
/// [`IoError::Unreadable`] for errors reported by the operating system.
pub fn file_names(directory: &Path) -> Result<Vec<String>, IoError> {
    let unreadable = |source| IoError::Unreadable {
        file: directory.display().to_string(),
        source,
    };
    let mut names = Vec::new();
    for entry in fs::read_dir(directory).map_err(unreadable)? {
        let entry = entry.map_err(unreadable)?;
        if entry.path().is_file() {
            names.push(entry.file_name().to_string_lossy().into_owned());
        }
    }
    Ok(names)
}
