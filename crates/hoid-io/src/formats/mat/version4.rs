//! Version 4 (MathWorks, "MAT-File Format", 2019, chapter 2): matrices, each after a header of five numbers.

use crate::IoError;
use crate::formats::arrays::{Array, Entry, Kind, Numbers, Value};
use crate::formats::budget::Budget;

/// Size, in bytes, of the five numbers in a header.
const HEADER_BYTES: usize = 20;
const MAX_NAME_CHARS: usize = 256;

/// Reads the variables of a file.
pub(super) fn read(bytes: &[u8], budget: &mut Budget, file: &str) -> Result<Vec<Entry>, IoError> {
    let mut rest = bytes;
    let mut entries = Vec::new();
    while !rest.is_empty() {
        let (entry, remaining) = read_variable(rest).map_err(|found| IoError::Damaged {
            file: file.to_owned(),
            found: format!("variable {}: {found}", entries.len().saturating_add(1)),
        })?;
        budget.take(rest.len().saturating_sub(remaining.len()) as u64, file)?;
        entries.push(entry);
        rest = remaining;
    }
    Ok(entries)
}

fn read_variable(bytes: &[u8]) -> Result<(Entry, &[u8]), String> {
    let header = bytes
        .get(..HEADER_BYTES)
        .ok_or_else(|| format!("the file is truncated: it ends after {} bytes", bytes.len()))?;
    let number = |at: usize, big_endian: bool| {
        let bytes = header
            .chunks_exact(4)
            .nth(at)
            .and_then(|four| four.try_into().ok())
            .unwrap_or_default();
        if big_endian {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        }
    };
    // In the first number, the thousands digit gives byte order and machine type; the hundreds digit is unused; the
    // tens digit gives the number type, and the ones digit the kind of matrix.
    let big_endian = number(0, false) > 4999;
    let kinds = number(0, big_endian);
    if kinds > 1999 || !kinds.is_multiple_of(1000) && kinds % 1000 / 100 != 0 {
        return Err(format!("its type code {kinds} is unknown"));
    }
    let kind = match kinds % 100 / 10 {
        0 => Kind::F64,
        1 => Kind::F32,
        2 => Kind::I32,
        3 => Kind::I16,
        4 => Kind::U16,
        5 => Kind::U8,
        other => return Err(format!("its number type {other} is unknown")),
    };
    let [rows, columns, imaginary, name] = [1, 2, 3, 4].map(|at| number(at, big_endian) as usize);
    if name > MAX_NAME_CHARS {
        return Err(format!("its name has {name} bytes, expected at most {MAX_NAME_CHARS}"));
    }
    let count = rows.checked_mul(columns);
    let length = count.and_then(|count| {
        count
            .checked_mul(kind.size())?
            .checked_mul(if imaginary == 0 { 1 } else { 2 })
    });
    let ends = || {
        let there = bytes.len();
        format!("the file is truncated, or a size is wrong: {rows} x {columns} numbers end after {there} bytes")
    };
    let named = bytes.get(HEADER_BYTES..).and_then(|named| named.split_at_checked(name));
    let (text, data) = named.ok_or_else(ends)?;
    let (data, rest) = length
        .and_then(|length| data.split_at_checked(length))
        .ok_or_else(ends)?;
    let text: Vec<u8> = text.iter().copied().take_while(|byte| *byte != 0).collect();
    let name = String::from_utf8_lossy(&text).into_owned();
    let numbers = || Numbers::new(data.to_vec(), kind, big_endian);
    let value = match kinds % 10 {
        _ if imaginary != 0 => Value::Unread(String::from("complex numbers")),
        0 => {
            let numbers = numbers();
            // An integer storage type does not imply an integer class: version 4 has only one numeric class.
            let numbers = if kind.is_whole() {
                Numbers::from_f64(&numbers.values())
            } else {
                numbers
            };
            Value::Array(Array {
                numbers,
                dims: vec![rows, columns],
                is_row_major: false,
            })
        }
        1 => {
            let characters: Vec<char> = numbers().values().iter().map(|code| char::from(*code as u8)).collect();
            let row = |at: usize| {
                characters
                    .iter()
                    .skip(at)
                    .step_by(rows)
                    .collect::<String>()
                    .trim_end()
                    .to_owned()
            };
            Value::Texts((0..rows.min(characters.len())).map(row).collect())
        }
        2 => Value::Unread(String::from("a sparse matrix")),
        other => return Err(format!("its matrix type {other} is unknown")),
    };
    Ok((Entry::new(name, value), rest))
}
