//! Variables of MATLAB.
//!
//! | module | what it holds |
//! |---|---|
//! | `elements` | [`Elements`]: tags and data of version 5, damaged or not |
//! | `version5` | versions 5 to 7: arrays, structures, cells, texts |
//! | `version4` | version 4: matrices |
//! | `version73` | version 7.3, which is HDF5 |
//! | `write` | [`write`]: version 7, one variable a column |
//!
//! Structures and cells become paths: `data.run(3).e`, `c{2}`; the index of an array of structures counts along its columns, as
//! MATLAB's linear index does.

mod elements;
mod version4;
mod version5;
mod version73;
mod write;

pub(crate) use write::write;

use crate::IoError;
use crate::arrays::{Budget, Contents, Entry, Lines, Value};

/// The variable that keeps the names that are no names of variables, each line a variable and the name it stands for.
const NAMES: &str = "hoid_names";
/// The first bytes of HDF5.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Length of the header of version 5.
const HEADER: usize = 128;

/// The variables in the bytes of a file.
pub(crate) fn read(bytes: Vec<u8>, file: &str) -> Result<Contents, IoError> {
    let wrong = |found: String| IoError::WrongFormat {
        file: file.to_owned(),
        format: "MATLAB",
        found,
        expected: "variables as MATLAB, Octave or scipy save them",
    };
    if bytes.is_empty() {
        return Err(wrong(String::from("it is empty")));
    }
    if bytes.starts_with(HDF5) || bytes.get(512..).is_some_and(|rest| rest.starts_with(HDF5)) {
        return version73::read(bytes, file).map(|entries| Contents::new(entries, Lines::Matlab));
    }
    let bytes = bytes.as_slice();
    let mut budget = Budget::of(bytes.len());
    let entries = match bytes.get(HEADER - 4..HEADER) {
        Some([.., b'I', b'M']) => version5::read(bytes, false, &mut budget, file)?,
        Some([.., b'M', b'I']) => version5::read(bytes, true, &mut budget, file)?,
        // Version 4 begins with a number below 5000, the later ones with text.
        _ if bytes[..bytes.len().min(4)].contains(&0) => version4::read(bytes, &mut budget, file)?,
        _ => {
            let start = String::from_utf8_lossy(&bytes[..bytes.len().min(12)]).into_owned();
            return Err(wrong(format!("it starts with \"{}\"", start.escape_debug())));
        }
    };
    Ok(named(entries))
}

/// The variables under the names that they were written for.
fn named(mut entries: Vec<Entry>) -> Contents {
    let at = entries.iter().position(|entry| entry.path == NAMES);
    if let Some(Value::Texts(lines)) = at.map(|at| entries.remove(at).value) {
        for line in &lines {
            let Some((variable, name)) = line.split_once(' ') else {
                continue;
            };
            if let Some(entry) = entries.iter_mut().find(|entry| entry.path == variable) {
                name.clone_into(&mut entry.path);
            }
        }
    }
    Contents::new(entries, Lines::Matlab)
}
