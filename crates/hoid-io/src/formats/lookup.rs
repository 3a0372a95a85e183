//! The format of a file by its extension, and the endings that are known.

use std::fs;
use std::path::Path;

use super::{ALL, csv};
use crate::IoError;
use crate::format::{Format, Writing};

/// The endings of the files that can be read, for help texts and messages:
/// `.csv (also as .txt), .tsv, ... or .xdf`.
#[must_use]
pub fn readable_endings() -> String {
    endings(ALL)
}

/// The endings of the files that can be written, for help texts and messages.
#[must_use]
pub fn writable_endings() -> String {
    let written: Vec<&Format> = ALL.iter().copied().filter(|format| format.is_written()).collect();
    endings(&written)
}

/// The endings of some formats in words.
fn endings(formats: &[&Format]) -> String {
    let of_one = |format: &&Format| {
        let dotted: Vec<String> = format.endings.iter().map(|ending| format!(".{ending}")).collect();
        match dotted.as_slice() {
            [first, others @ ..] if !others.is_empty() => format!("{first} (also as {})", others.join(" or ")),
            all => all.concat(),
        }
    };
    let all: Vec<String> = formats.iter().map(of_one).collect();
    match all.as_slice() {
        [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        all => all.concat(),
    }
}

/// The format that the extension of a file stands for.
fn format_of(path: &Path) -> Result<&'static Format, IoError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let known = |ending: &str| ALL.iter().copied().find(|format| format.endings.contains(&ending));
    extension
        .as_deref()
        .and_then(known)
        .ok_or_else(|| IoError::UnknownFormat {
            file: path.display().to_string(),
            found: extension.map_or(String::from("there is no extension"), |e| {
                format!("the extension is .{e}")
            }),
            expected: readable_endings(),
        })
}

/// The format of a file to write, which is no directory. A pipe or a device takes CSV under any
/// other name.
pub(crate) fn format_to_write(path: &Path) -> Result<&'static Format, IoError> {
    let known = fs::metadata(path).ok();
    let format = match known {
        Some(known) if known.is_dir() => Err(IoError::Directory {
            file: path.display().to_string(),
        }),
        Some(known) if !known.is_file() => Ok(format_of(path).unwrap_or(&csv::CSV)),
        _ => format_of(path),
    }?;
    let Writing::ReadOnly(what) = format.writing else {
        return Ok(format);
    };
    Err(IoError::UnknownFormat {
        file: path.display().to_string(),
        found: format!("the extension is .{}, {what}", format.endings[0]),
        expected: writable_endings(),
    })
}

/// The format of a file, and what is in it.
pub(crate) fn bytes_of(path: &Path) -> Result<(&'static Format, Vec<u8>), IoError> {
    let file = || path.display().to_string();
    if path.is_dir() {
        return Err(IoError::Directory { file: file() });
    }
    let format = format_of(path)?;
    let bytes = fs::read(path).map_err(|source| IoError::Unreadable { file: file(), source })?;
    Ok((format, bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_ending_stands_for_one_format() {
        let mut endings: Vec<&str> = ALL.iter().flat_map(|format| format.endings).copied().collect();
        let count = endings.len();
        endings.sort_unstable();
        endings.dedup();
        assert_eq!(endings.len(), count);
        assert!(ALL.iter().all(|format| !format.endings.is_empty()));
    }

    #[test]
    fn endings_in_words() {
        assert_eq!(endings(&[&csv::CSV]), ".csv (also as .txt)");
        assert_eq!(
            endings(&[&csv::CSV, &csv::TSV, &csv::TSV]),
            ".csv (also as .txt), .tsv or .tsv"
        );
        assert!(readable_endings().contains(".xdf"));
        assert!(!writable_endings().contains(".xdf"));
    }
}
