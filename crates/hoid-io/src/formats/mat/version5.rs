//! Versions 5 to 7 (MathWorks, "MAT-File Format", 2019, chapter 1); from version 7 on each variable may be compressed.

use std::io::Read;

use flate2::read::ZlibDecoder;

use super::elements::{Elements, HEADER_BYTES, data};
use super::objects::describe_object;
use crate::IoError;
use crate::formats::arrays::{Array, Entry, Kind, Numbers, Value};
use crate::formats::budget::{Budget, MAX_NESTING};
use crate::wording::{abbreviate, short_error};

const CELL: u32 = 1;
const STRUCT: u32 = 2;
const OBJECT: u32 = 3;
const CHAR: u32 = 4;
const SPARSE: u32 = 5;
const DOUBLE: u32 = 6;
const SINGLE: u32 = 7;
const UINT64: u32 = 15;
const FUNCTION: u32 = 16;
const OPAQUE: u32 = 17;
/// Flag that marks an array of complex numbers.
const COMPLEX_FLAG: u32 = 0x800;
/// Longest name accepted, in characters; MATLAB allows 63.
const MAX_NAME_CHARS: usize = 256;
/// Approximate memory of an entry in bytes, without its path and its values.
const ENTRY_BYTES: u64 = 256;

/// Reason why a variable cannot be read: a violation of the format, or another error.
enum VariableError {
    Damaged(String),
    Other(IoError),
}

impl From<String> for VariableError {
    fn from(found: String) -> Self {
        Self::Damaged(found)
    }
}

impl From<IoError> for VariableError {
    fn from(error: IoError) -> Self {
        Self::Other(error)
    }
}

/// Reads the variables of a file.
pub(super) fn read(bytes: &[u8], big_endian: bool, budget: &mut Budget, file: &str) -> Result<Vec<Entry>, IoError> {
    let mut elements = Elements::new(bytes.get(HEADER_BYTES..).unwrap_or_default(), big_endian);
    let mut reader = Reader {
        entries: Vec::new(),
        budget,
        file,
    };
    let mut variable = 0_usize;
    while !elements.is_empty() {
        variable = variable.saturating_add(1);
        reader.read_variable(&mut elements).map_err(|stop| match stop {
            VariableError::Other(error) => error,
            VariableError::Damaged(found) => IoError::Damaged {
                file: file.to_owned(),
                found: format!("variable {variable}: {found}"),
            },
        })?;
    }
    Ok(reader.entries)
}

struct Reader<'a> {
    entries: Vec<Entry>,
    budget: &'a mut Budget,
    file: &'a str,
}

/// Path and nesting depth of a variable.
#[derive(Clone, Copy)]
struct VariablePath<'a> {
    /// Path of the enclosing structure; empty at top level.
    parent: &'a str,
    /// Path of the variable; at top level its name.
    path: &'a str,
    depth: usize,
}

impl Reader<'_> {
    fn read_variable(&mut self, elements: &mut Elements<'_>) -> Result<(), VariableError> {
        // At top level an element that extends beyond the end of the file indicates truncation.
        let cut = |found: String| format!("the file is truncated, or a length is wrong: {found}");
        let element = elements.next().map_err(cut)?;
        let top = VariablePath {
            parent: "",
            path: "",
            depth: 0,
        };
        match element.kind {
            data::MATRIX => self.read_matrix(element.bytes, elements.big_endian, top),
            data::COMPRESSED => {
                let bytes = self.inflate(element.bytes, elements.big_endian)?;
                self.read_matrix(&bytes, elements.big_endian, top)
            }
            // Programs may store other data between the variables.
            _ => Ok(()),
        }
    }

    /// Decompresses the data of a matrix. The tag gives an upper bound of their length, since Octave counts the data in
    /// a tag twice.
    fn inflate(&mut self, bytes: &[u8], big_endian: bool) -> Result<Vec<u8>, VariableError> {
        let failed = |error: std::io::Error| VariableError::Damaged(short_error(&error.to_string()));
        let mut decoder = ZlibDecoder::new(bytes);
        let mut tag = [0; 8];
        decoder.read_exact(&mut tag).map_err(failed)?;
        let [k0, k1, k2, k3, l0, l1, l2, l3] = tag;
        let number = |bytes| {
            if big_endian {
                u32::from_be_bytes(bytes)
            } else {
                u32::from_le_bytes(bytes)
            }
        };
        let (kind, length) = (number([k0, k1, k2, k3]), u64::from(number([l0, l1, l2, l3])));
        if kind != data::MATRIX {
            return Err(format!("a compressed element of type {kind}, expected {}", data::MATRIX).into());
        }
        self.budget.take(length, self.file)?;
        let mut inflated = Vec::new();
        decoder.take(length).read_to_end(&mut inflated).map_err(failed)?;
        Ok(inflated)
    }

    /// Reads an array of any class, part by part.
    fn read_matrix(&mut self, bytes: &[u8], big_endian: bool, place: VariablePath<'_>) -> Result<(), VariableError> {
        // An element without data is a field that is not set.
        if bytes.is_empty() {
            return self.push(place, place.path, Value::Array(Array::vector(Numbers::from_f64(&[]))));
        }
        let mut parts = Elements::new(bytes, big_endian);
        let flags = parts.next_of_type(data::UINT32, "the flags of an array")?;
        let flags = parts
            .u32s(flags)
            .first()
            .copied()
            .ok_or_else(|| String::from("an array without flags"))?;
        let class = flags & 0xff;
        if class == OPAQUE {
            let name = String::from_utf8_lossy(parts.next()?.bytes).into_owned();
            let system = parts.next()?;
            let of = parts.next().unwrap_or(system).bytes;
            let what = describe_object(&String::from_utf8_lossy(of));
            let path = if place.depth == 0 {
                abbreviate(&name)
            } else {
                place.path.to_owned()
            };
            return self.push(place, &path, Value::Unread(what));
        }
        let dims = parts.next_of_type(data::INT32, "the size of an array")?;
        let dims: Vec<usize> = parts.u32s(dims).iter().map(|side| *side as usize).collect();
        let count = dims.iter().try_fold(1_usize, |count, side| count.checked_mul(*side));
        let count = count.ok_or_else(|| format!("an array of {}", abbreviate(&format!("{dims:?}"))))?;
        if dims.len() > MAX_NESTING {
            return Err(format!("an array of {} dimensions, expected at most {MAX_NESTING}", dims.len()).into());
        }
        let name = name(parts.next()?.bytes)?;
        // An element without a name is not a variable: MATLAB stores the parts of objects in such elements.
        if place.depth == 0 && name.is_empty() {
            return Ok(());
        }
        let place = VariablePath {
            path: if place.depth == 0 { &name } else { place.path },
            ..place
        };
        match class {
            CELL => self.read_cell(parts, count, place),
            STRUCT => self.read_structure(parts, count, place),
            OBJECT => {
                parts.next()?;
                self.read_structure(parts, count, place)
            }
            CHAR => {
                let bytes = parts.clone().next().map_or(0, |element| element.bytes.len());
                // In memory each character takes four bytes.
                let rows = dims.first().map_or(1, |rows| (*rows).min(bytes));
                self.budget.take_texts(rows, bytes.saturating_mul(5), self.file)?;
                let texts = texts(&mut parts, &dims, count)?;
                self.push(place, place.path, Value::Texts(texts))
            }
            SPARSE => self.add_unreadable(place, "a sparse matrix"),
            FUNCTION => self.add_unreadable(place, "a function"),
            DOUBLE..=UINT64 if flags & COMPLEX_FLAG != 0 => self.add_unreadable(place, "complex numbers"),
            DOUBLE..=UINT64 => {
                let numbers = self.read_numbers(&mut parts, class, count)?;
                let array = Array {
                    numbers,
                    dims,
                    is_row_major: false,
                };
                self.push(place, place.path, Value::Array(array))
            }
            _ => Err(format!("an array of unknown class {class}").into()),
        }
    }

    /// Reads numbers, which may be stored in a shorter type than the type of their class.
    fn read_numbers(&mut self, parts: &mut Elements<'_>, class: u32, count: usize) -> Result<Numbers, VariableError> {
        let element = parts.next()?;
        let kind = match element.kind {
            data::INT8 => Kind::I8,
            data::UINT8 => Kind::U8,
            data::INT16 => Kind::I16,
            data::UINT16 => Kind::U16,
            data::INT32 => Kind::I32,
            data::UINT32 => Kind::U32,
            data::SINGLE => Kind::F32,
            data::DOUBLE => Kind::F64,
            data::INT64 => Kind::I64,
            data::UINT64 => Kind::U64,
            other => return Err(format!("numbers of unknown type {other}").into()),
        };
        if count.checked_mul(kind.size()) != Some(element.bytes.len()) {
            let found = element.bytes.len();
            return Err(format!("{found} bytes for {count} numbers of {} bytes", kind.size()).into());
        }
        self.budget.take(element.bytes.len() as u64, self.file)?;
        self.budget.take_numbers(count, kind.size(), self.file)?;
        let numbers = Numbers::new(element.bytes.to_vec(), kind, parts.big_endian);
        if kind.is_whole() && (DOUBLE..=SINGLE).contains(&class) {
            return Ok(Numbers::from_f64(&numbers.values()));
        }
        Ok(numbers)
    }

    /// Reads one or more structures with the same fields.
    fn read_structure(
        &mut self,
        mut parts: Elements<'_>,
        count: usize,
        place: VariablePath<'_>,
    ) -> Result<(), VariableError> {
        let depth = next_depth(place)?;
        let length = parts.next_of_type(data::INT32, "the length of the field names")?;
        let length = parts.u32s(length).first().map_or(0, |length| *length as usize);
        let names = parts.next()?.bytes;
        if names.is_empty() || count == 0 {
            return Ok(());
        }
        if length == 0 || !names.len().is_multiple_of(length) {
            return Err(format!("field names of {length} bytes each in {} bytes", names.len()).into());
        }
        let names: Vec<String> = names.chunks(length).map(name).collect::<Result<_, _>>()?;
        for at in 0..count {
            let parent = match count {
                1 => place.path.to_owned(),
                _ => format!("{}({})", place.path, at.saturating_add(1)),
            };
            for name in &names {
                let matrix = parts.next_of_type(data::MATRIX, "a field")?;
                let path = format!("{parent}.{name}");
                let place = VariablePath {
                    parent: &parent,
                    path: &path,
                    depth,
                };
                self.read_matrix(matrix, parts.big_endian, place)?;
            }
        }
        Ok(())
    }

    /// Reads a cell array, in which each cell has its own path; if all cells hold text, they form one column.
    fn read_cell(
        &mut self,
        mut parts: Elements<'_>,
        count: usize,
        place: VariablePath<'_>,
    ) -> Result<(), VariableError> {
        let depth = next_depth(place)?;
        let before = self.entries.len();
        for at in 0..count {
            let matrix = parts.next_of_type(data::MATRIX, "a cell")?;
            let path = format!("{}{{{}}}", place.path, at.saturating_add(1));
            self.read_matrix(
                matrix,
                parts.big_endian,
                VariablePath {
                    path: &path,
                    depth,
                    ..place
                },
            )?;
        }
        let text = |entry: &Entry| matches!(&entry.value, Value::Texts(texts) if texts.len() == 1);
        let cells = self.entries.get(before..).unwrap_or_default();
        if cells.len() == count && cells.iter().all(text) {
            let texts = self.entries.drain(before..).filter_map(|entry| match entry.value {
                Value::Texts(texts) => texts.into_iter().next(),
                _ => None,
            });
            let texts = texts.collect();
            return self.push(place, place.path, Value::Texts(texts));
        }
        Ok(())
    }

    fn add_unreadable(&mut self, place: VariablePath<'_>, what: &str) -> Result<(), VariableError> {
        self.push(place, place.path, Value::Unread(what.to_owned()))
    }

    fn push(&mut self, place: VariablePath<'_>, path: &str, value: Value) -> Result<(), VariableError> {
        let bytes = (path.len().saturating_add(place.parent.len()) as u64).saturating_add(ENTRY_BYTES);
        self.budget.take(bytes, self.file)?;
        let mut entry = Entry::new(path, value);
        place.parent.clone_into(&mut entry.parent);
        self.entries.push(entry);
        Ok(())
    }
}

fn next_depth(place: VariablePath<'_>) -> Result<usize, VariableError> {
    if place.depth == MAX_NESTING {
        return Err(format!("structures nested more than {MAX_NESTING} deep").into());
    }
    Ok(place.depth.saturating_add(1))
}

/// Reads a name, which may be padded with null bytes.
fn name(bytes: &[u8]) -> Result<String, String> {
    let name = bytes.split(|byte| *byte == 0).next().unwrap_or_default();
    if name.len() > MAX_NAME_CHARS {
        return Err(format!(
            "a name of {} bytes, expected at most {MAX_NAME_CHARS}",
            name.len()
        ));
    }
    Ok(String::from_utf8_lossy(name).into_owned())
}

/// Returns the rows of a character array.
fn texts(parts: &mut Elements<'_>, dims: &[usize], count: usize) -> Result<Vec<String>, String> {
    // For an empty text Octave writes no character data.
    if parts.is_empty() || count == 0 {
        return Ok(vec![String::new()]);
    }
    let element = parts.next()?;
    let bytes = element.bytes;
    let order = |pair: &[u8]| {
        let pair = pair.try_into().unwrap_or_default();
        if parts.big_endian {
            u16::from_be_bytes(pair)
        } else {
            u16::from_le_bytes(pair)
        }
    };
    let of = |code: u32| char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER);
    let characters: Vec<char> = match element.kind {
        data::INT8 | data::UINT8 => bytes.iter().map(|byte| char::from(*byte)).collect(),
        data::UTF8 => String::from_utf8_lossy(bytes).chars().collect(),
        data::INT16 | data::UINT16 | data::UTF16 => {
            let units: Vec<u16> = bytes.chunks_exact(2).map(order).collect();
            String::from_utf16_lossy(&units).chars().collect()
        }
        data::INT32 | data::UINT32 | data::UTF32 => parts.u32s(bytes).into_iter().map(of).collect(),
        other => return Err(format!("characters of unknown type {other}")),
    };
    match dims {
        [1, ..] | [] => Ok(vec![characters.into_iter().collect()]),
        [rows, ..] if *rows <= characters.len() => {
            let row = |at: usize| {
                characters
                    .iter()
                    .skip(at)
                    .step_by(*rows)
                    .collect::<String>()
                    .trim_end()
                    .to_owned()
            };
            Ok((0..*rows).map(row).collect())
        }
        [rows, ..] => Err(format!("{} characters in {rows} rows", characters.len())),
    }
}
