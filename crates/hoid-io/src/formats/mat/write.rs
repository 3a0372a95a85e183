//! Writing of version 7 with each variable compressed: a numeric column becomes a column vector, and a text column
//! becomes a cell array.

use std::io::{self, Write};

use flate2::Compression;
use flate2::write::ZlibEncoder;

use super::elements::{HEADER_BYTES, data};
use super::names::{NAMES_VARIABLE, variable_names};
use crate::formats::arrays::COMMENTS_ARRAY;
use crate::results::{TableSchema, Values};

const CELL: u32 = 1;
const CHAR: u32 = 4;
const DOUBLE: u32 = 6;
const UINT64: u32 = 15;

/// Writes the columns, and the comments as a cell array of strings.
pub(super) fn write(file: &mut dyn Write, schema: &TableSchema, columns: &[Values<'_>]) -> io::Result<()> {
    // Neither the time of writing nor a path is written, so the same columns give the same bytes.
    let mut header = format!("MATLAB 5.0 MAT-file, written by hoid {}", env!("CARGO_PKG_VERSION")).into_bytes();
    header.resize(HEADER_BYTES - 12, b' ');
    header.extend([0; 8]);
    header.extend([0x00, 0x01, b'I', b'M']);
    file.write_all(&header)?;
    let names: Vec<&str> = schema.columns.iter().map(|column| column.name.as_str()).collect();
    let variables = variable_names(&names);
    for (variable, values) in variables.iter().zip(columns) {
        write_compressed(file, &column(variable, *values)?)?;
    }
    if !schema.comments.is_empty() {
        write_compressed(file, &column(COMMENTS_ARRAY, Values::Text(&schema.comments))?)?;
    }
    let renamed = names
        .iter()
        .zip(&variables)
        .filter(|(name, variable)| *name != variable);
    let lines: Vec<String> = renamed.map(|(name, variable)| format!("{variable} {name}")).collect();
    if !lines.is_empty() {
        write_compressed(file, &column(NAMES_VARIABLE, Values::Text(&lines))?)?;
    }
    Ok(())
}

fn column(name: &str, values: Values<'_>) -> io::Result<Vec<u8>> {
    let mut matrix = MatrixWriter::default();
    match values {
        Values::Real(values) => {
            matrix.write_header(DOUBLE, values.len(), 1, name)?;
            matrix.write_element(
                data::DOUBLE,
                &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>(),
            )?;
        }
        Values::Whole(values) => {
            matrix.write_header(UINT64, values.len(), 1, name)?;
            matrix.write_element(
                data::UINT64,
                &values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>(),
            )?;
        }
        Values::Text(texts) => {
            matrix.write_header(CELL, texts.len(), 1, name)?;
            for text in texts {
                let mut cell = MatrixWriter::default();
                let rows = usize::from(!text.is_empty());
                cell.write_header(CHAR, rows, text.chars().count(), "")?;
                cell.write_element(data::UTF8, text.as_bytes())?;
                matrix.write_element(data::MATRIX, &cell.bytes)?;
            }
        }
    }
    let mut element = MatrixWriter::default();
    element.write_element(data::MATRIX, &matrix.bytes)?;
    Ok(element.bytes)
}

/// Writes the parts of an array in sequence.
#[derive(Default)]
struct MatrixWriter {
    bytes: Vec<u8>,
}

impl MatrixWriter {
    fn write_header(&mut self, class: u32, rows: usize, columns: usize, name: &str) -> io::Result<()> {
        let side = |side: usize| i32::try_from(side).map_err(|_| too_long_error());
        self.write_element(data::UINT32, &[class.to_le_bytes(), [0; 4]].concat())?;
        self.write_element(
            data::INT32,
            &[side(rows)?.to_le_bytes(), side(columns)?.to_le_bytes()].concat(),
        )?;
        self.write_element(data::INT8, name.as_bytes())
    }

    fn write_element(&mut self, kind: u32, bytes: &[u8]) -> io::Result<()> {
        let length = u32::try_from(bytes.len()).map_err(|_| too_long_error())?;
        self.bytes.extend(kind.to_le_bytes());
        self.bytes.extend(length.to_le_bytes());
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        Ok(())
    }
}

fn write_compressed(file: &mut dyn Write, element: &[u8]) -> io::Result<()> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    encoder.write_all(element)?;
    let bytes = encoder.finish()?;
    let length = u32::try_from(bytes.len()).map_err(|_| too_long_error())?;
    file.write_all(&data::COMPRESSED.to_le_bytes())?;
    file.write_all(&length.to_le_bytes())?;
    file.write_all(&bytes)
}

fn too_long_error() -> io::Error {
    io::Error::other("a variable of more than 4 GB, which .mat does not support; write Parquet")
}
