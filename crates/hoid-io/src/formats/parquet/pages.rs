//! Decompressed size of the pages of a column, determined before decompression.
//!
//! The footer states the decompressed size of a column, and the header of each page the decompressed size of the page.
//! Neither is necessarily correct: a page of a few kB may state 2 GB, which Snappy and LZ4 then fill with zeros, and
//! gzip decompresses to its end regardless of the stated size. The headers are therefore read here first, in the
//! compact protocol of Thrift (<https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>): a
//! field starts with a byte `delta << 4 | type`, numbers are zigzag varints, and a struct ends with a 0. These fields
//! of `PageHeader` (<https://github.com/apache/parquet-format>, `parquet.thrift`) are read:
//!
//! | field | contents |
//! |---|---|
//! | 2, 3 | decompressed and compressed size in bytes |
//! | 5.1, 8.1 | number of values of a data page |
//! | 8.5, 8.6, 8.7 | sizes of the levels before the values in bytes, and whether the values are compressed |
//!
//! Pages without compression, or with Snappy or LZ4, have the stated length or are rejected by the crate `parquet`. A
//! gzip page is decompressed here without storing the result, up to one byte beyond the stated size.

use std::io::{self, Read as _};

use flate2::read::MultiGzDecoder;
use parquet::basic::Compression;

/// Maximum nesting of structures in a header; the format needs three levels.
const MAX_NESTING: usize = 8;
/// Types of the compact protocol.
const STOP: u8 = 0;
const TRUE: u8 = 1;
const FALSE: u8 = 2;
const BYTE: u8 = 3;
const DOUBLE: u8 = 7;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const MAP: u8 = 11;
const STRUCT: u8 = 12;

/// Contents of a page header.
#[derive(Debug, Clone, Copy, PartialEq)]
struct PageHeader {
    decompressed: u64,
    compressed: u64,
    values: u64,
    /// Number of bytes of levels that precede the compressed data.
    levels: u64,
    is_compressed: bool,
}

/// Returns the stated decompressed size of the pages of a column in bytes; `None` if a header is invalid, or if a gzip
/// page is longer than stated. `column` holds the pages, which contain `values` values in total.
pub(super) fn decompressed_size(column: &[u8], compression: Compression, values: u64) -> Option<u64> {
    let (mut rest, mut all, mut seen) = (column, 0_u64, 0_u64);
    while !rest.is_empty() && seen < values {
        let header = PageHeader::read(&mut rest)?;
        let page = rest.get(..usize::try_from(header.compressed).ok()?)?;
        if matches!(compression, Compression::GZIP(_)) && header.is_compressed {
            let packed = page.get(usize::try_from(header.levels).ok()?..)?;
            let stated = header.decompressed.checked_sub(header.levels)?;
            // Other damage of the gzip data is reported when the page is read.
            let mut limited = MultiGzDecoder::new(packed).take(stated.saturating_add(1));
            if io::copy(&mut limited, &mut io::sink()).is_ok_and(|bytes| bytes > stated) {
                return None;
            }
        }
        all = all.saturating_add(header.decompressed);
        seen = seen.saturating_add(header.values);
        rest = rest.get(page.len()..)?;
    }
    Some(all)
}

impl PageHeader {
    fn read(bytes: &mut &[u8]) -> Option<Self> {
        let mut header = Self {
            decompressed: 0,
            compressed: 0,
            values: 0,
            levels: 0,
            is_compressed: true,
        };
        header.read_structure(bytes, None, 0)?;
        Some(header)
    }

    /// Reads the fields of a structure; `inside` is the number of the field of the header that holds it.
    fn read_structure(&mut self, bytes: &mut &[u8], inside: Option<i64>, depth: usize) -> Option<()> {
        if depth > MAX_NESTING {
            return None;
        }
        let mut field = 0_i64;
        loop {
            let head = read_byte(bytes)?;
            let kind = head & 15;
            if kind == STOP {
                return Some(());
            }
            field = match head >> 4 {
                0 => read_zigzag(bytes)?,
                delta => field.checked_add(i64::from(delta))?,
            };
            match kind {
                TRUE | FALSE => {
                    if (inside, field) == (Some(8), 7) {
                        self.is_compressed = kind == TRUE;
                    }
                }
                BYTE => drop(read_byte(bytes)?),
                4..=6 => self.store_number(inside, field, read_zigzag(bytes)?)?,
                STRUCT => self.read_structure(
                    bytes,
                    Some(if depth == 0 { field } else { -1 }),
                    depth.saturating_add(1),
                )?,
                other => self.skip_field(bytes, other, depth.saturating_add(1))?,
            }
        }
    }

    fn store_number(&mut self, inside: Option<i64>, field: i64, value: i64) -> Option<()> {
        let place = match (inside, field) {
            (None, 2) => &mut self.decompressed,
            (None, 3) => &mut self.compressed,
            (Some(5 | 8), 1) => &mut self.values,
            (Some(8), 5 | 6) => {
                self.levels = self.levels.checked_add(u64::try_from(value).ok()?)?;
                return Some(());
            }
            _ => return Some(()),
        };
        *place = u64::try_from(value).ok()?;
        Some(())
    }

    /// Skips a value that does not affect the decompressed size.
    fn skip_field(&mut self, bytes: &mut &[u8], kind: u8, depth: usize) -> Option<()> {
        match kind {
            TRUE | FALSE | BYTE => drop(read_byte(bytes)?),
            4..=6 => drop(read_zigzag(bytes)?),
            DOUBLE => *bytes = bytes.get(8..)?,
            BINARY => {
                let length = usize::try_from(read_varint(bytes)?).ok()?;
                *bytes = bytes.get(length..)?;
            }
            LIST | SET => {
                let head = read_byte(bytes)?;
                let count = match head >> 4 {
                    15 => read_varint(bytes)?,
                    count => u64::from(count),
                };
                self.skip_elements(bytes, count, &[head & 15], depth)?;
            }
            MAP => {
                let count = read_varint(bytes)?;
                if count > 0 {
                    let kinds = read_byte(bytes)?;
                    self.skip_elements(bytes, count, &[kinds >> 4, kinds & 15], depth)?;
                }
            }
            STRUCT => self.read_structure(bytes, Some(-1), depth)?,
            _ => return None,
        }
        Some(())
    }

    fn skip_elements(&mut self, bytes: &mut &[u8], count: u64, kinds: &[u8], depth: usize) -> Option<()> {
        // Each element of a list takes at least one byte.
        if depth > MAX_NESTING || count > bytes.len() as u64 {
            return None;
        }
        for _ in 0..count {
            for kind in kinds {
                self.skip_field(bytes, *kind, depth.saturating_add(1))?;
            }
        }
        Some(())
    }
}

fn read_byte(bytes: &mut &[u8]) -> Option<u8> {
    let (first, rest) = bytes.split_first()?;
    *bytes = rest;
    Some(*first)
}

fn read_varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0_u64;
    for shift in (0..70).step_by(7) {
        let next = read_byte(bytes)?;
        value |= u64::from(next & 0x7f).checked_shl(shift)?;
        if next < 0x80 {
            return Some(value);
        }
    }
    None
}

fn read_zigzag(bytes: &mut &[u8]) -> Option<i64> {
    let value = read_varint(bytes)?;
    Some((value >> 1).cast_signed() ^ (value & 1).cast_signed().wrapping_neg())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::io::Write as _;

    use flate2::{Compression as Level, write::GzEncoder};
    use parquet::basic::GzipLevel;

    use super::*;

    const GZIP: fn() -> Compression = || Compression::GZIP(GzipLevel::default());

    /// Returns a data page whose header also has a string and a list, which are skipped.
    fn data_page(unpacked: i64, values: i64, packed: &[u8]) -> Vec<u8> {
        let put = |bytes: &mut Vec<u8>, value: i64| {
            let mut rest = ((value << 1) ^ (value >> 63)).cast_unsigned();
            while rest >= 0x80 {
                bytes.push(rest as u8 | 0x80);
                rest >>= 7;
            }
            bytes.push(rest as u8);
        };
        let mut bytes = vec![0x15];
        put(&mut bytes, 0);
        bytes.push(0x15);
        put(&mut bytes, unpacked);
        bytes.push(0x15);
        put(&mut bytes, packed.len() as i64);
        // Field 5 contains the number of values, and statistics with a string and a list.
        bytes.extend([0x2c, 0x15]);
        put(&mut bytes, values);
        bytes.extend([0x4c, 0x18, 3, b'a', b'b', b'c', 0x19, 0x25, 2, 4, STOP, STOP, STOP]);
        bytes.extend(packed);
        bytes
    }

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Level::default());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn page_sizes_are_read_and_checked_for_gzip() {
        let honest = data_page(800, 100, &gzip(&[0; 800]));
        assert_eq!(decompressed_size(&honest, GZIP(), 100), Some(800));
        // The second page follows the last value and is not examined.
        let two = [honest.clone(), vec![0xff; 40]].concat();
        assert_eq!(decompressed_size(&two, GZIP(), 100), Some(800));
        assert_eq!(decompressed_size(&two, GZIP(), 101), None);
        let two = [honest, data_page(2_000_000_000, 100, &[1, 2, 3])].concat();
        assert_eq!(decompressed_size(&two, Compression::SNAPPY, 200), Some(2_000_000_800));
        let lying = data_page(800, 100, &gzip(&[0; 900]));
        assert_eq!(decompressed_size(&lying, GZIP(), 100), None);
        assert_eq!(decompressed_size(&lying, Compression::SNAPPY, 100), Some(800));
    }

    #[test]
    fn invalid_page_headers_give_none() {
        let whole = data_page(800, 100, &gzip(&[0; 800]));
        assert_eq!(decompressed_size(&[], GZIP(), 100), Some(0));
        for cut in 1..whole.len() {
            assert_eq!(decompressed_size(&whole[..cut], GZIP(), 100), None, "{cut}");
        }
        assert_eq!(
            decompressed_size(&data_page(-1, 100, &[]), Compression::SNAPPY, 100),
            None
        );
        // The headers have structures without an end, or a list that is longer than its data.
        assert_eq!(decompressed_size(&[0x1c; 100], GZIP(), 1), None);
        assert_eq!(
            decompressed_size(&[0x19, 0xf5, 0xff, 0xff, 0xff, 0x7f, 0, 0], GZIP(), 1),
            None
        );
    }
}
