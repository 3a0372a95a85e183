//! A single numpy array.

use std::rc::Rc;

use super::header::{self, Descr, Header};
use crate::IoError;
use crate::formats::arrays::{Array, CLOCK_TIME_UNIT, Entry, Kind, Numbers, Value};
use crate::formats::budget::Budget;
use crate::results::Values;
use crate::wording::{abbreviate, quote_start};

const MAGIC: &[u8] = b"\x93NUMPY";
/// Number of bytes before a header: the magic bytes, the version, and the header length in two bytes (version 1) or
/// four bytes (versions 2 and 3).
const SHORT_PREFIX_BYTES: usize = MAGIC.len() + 4;
const LONG_PREFIX_BYTES: usize = MAGIC.len() + 6;
/// Longest valid header in bytes; a longer one counts as damage.
const MAX_HEADER_BYTES: usize = 1 << 20;
/// Alignment of the start of the data in bytes.
const ALIGNMENT: usize = 64;

/// Reasons why an array cannot be read.
#[derive(Debug)]
pub(super) enum NpyError {
    NoMagic(String),
    Damaged(String),
    Other(IoError),
}

impl From<IoError> for NpyError {
    fn from(error: IoError) -> Self {
        Self::Other(error)
    }
}

/// Type of an array item, such as `<f8`.
enum Item {
    Numbers {
        kind: Kind,
        big_endian: bool,
    },
    /// Text with four bytes per character.
    Unicode {
        length: usize,
        big_endian: bool,
    },
    /// Text with one byte per character.
    Bytes {
        length: usize,
    },
    /// Clock times or time differences, as integer multiples of a unit from ns to days.
    Clock {
        big_endian: bool,
        unit_s: f64,
        is_clock_time: bool,
    },
    Unread {
        what: &'static str,
        size: Option<usize>,
    },
}

impl Item {
    fn of(descr: &str) -> Self {
        let big_endian = descr.starts_with('>');
        let plain = descr.trim_start_matches(['<', '>', '|', '=']);
        let unread = |what, size| Self::Unread { what, size };
        let Some(letter) = plain.chars().next() else {
            return unread("an unknown type", None);
        };
        let size = plain[letter.len_utf8()..].parse::<usize>().ok();
        let kind = match (letter, size) {
            ('f', Some(2)) => Kind::F16,
            ('f', Some(4)) => Kind::F32,
            ('f', Some(8)) => Kind::F64,
            ('i', Some(1)) => Kind::I8,
            ('i', Some(2)) => Kind::I16,
            ('i', Some(4)) => Kind::I32,
            ('i', Some(8)) => Kind::I64,
            ('b' | 'u', Some(1)) => Kind::U8,
            ('u', Some(2)) => Kind::U16,
            ('u', Some(4)) => Kind::U32,
            ('u', Some(8)) => Kind::U64,
            ('U', Some(length)) => return Self::Unicode { length, big_endian },
            ('S' | 'a', Some(length)) => return Self::Bytes { length },
            ('f', size) => return unread("numbers of extended precision", size),
            ('c', size) => return unread("complex numbers", size),
            ('M' | 'm', _) => {
                return match clock_unit_s(plain) {
                    Some(unit_s) => Self::Clock {
                        big_endian,
                        unit_s,
                        is_clock_time: letter == 'M',
                    },
                    None => unread("dates or times", Some(8)),
                };
            }
            ('O', _) => return unread("Python objects", None),
            (_, size) => return unread("an unknown type", size),
        };
        Self::Numbers { kind, big_endian }
    }

    /// Returns the unit that the type implies; empty if there is none.
    fn unit(&self) -> String {
        String::from(match self {
            Self::Clock {
                is_clock_time: true, ..
            } => CLOCK_TIME_UNIT,
            Self::Clock {
                is_clock_time: false, ..
            } => "s",
            _ => "",
        })
    }

    fn size(&self) -> Option<usize> {
        match self {
            Self::Numbers { kind, .. } => Some(kind.size()),
            Self::Unicode { length, .. } => length.checked_mul(4),
            Self::Bytes { length } => Some(*length),
            Self::Clock { .. } => Some(8),
            Self::Unread { size, .. } => *size,
        }
    }
}

/// Returns the contents of an array as one entry, or as one entry per field; the fields are at top level if the file
/// has no other array.
pub(super) fn entries(
    bytes: Vec<u8>,
    name: &str,
    alone: bool,
    (budget, file): (&mut Budget, &str),
) -> Result<Vec<Entry>, NpyError> {
    let (header, at) = header_of(&bytes)?;
    reserve_memory(&header, budget, file)?;
    let data = || bytes.get(at..).unwrap_or_default().to_vec();
    let entries = match &header.descr {
        Descr::Plain(descr) => {
            let item = Item::of(descr);
            vec![Entry {
                unit: item.unit(),
                ..Entry::new(name, plain_value(&item, &header, data())?)
            }]
        }
        Descr::Fields(fields) => structured_values(fields, &header, data())?
            .into_iter()
            .map(|(field, value)| Entry::field(if alone { "" } else { name }, &field, value))
            .collect(),
    };
    Ok(entries)
}

/// Reserves the memory that the items need when read, in addition to their bytes in the file.
fn reserve_memory(header: &Header, budget: &mut Budget, file: &str) -> Result<(), IoError> {
    let count = header
        .shape
        .iter()
        .fold(1_usize, |count, side| count.saturating_mul(*side));
    let mut take = |descr: &str| match Item::of(descr) {
        Item::Numbers { kind, .. } => budget.take_numbers(count, kind.size(), file),
        Item::Unicode { .. } | Item::Bytes { .. } => budget.take_texts(count, 0, file),
        Item::Clock { .. } => budget.take_numbers(count, 0, file),
        Item::Unread { .. } => Ok(()),
    };
    match &header.descr {
        Descr::Plain(descr) => take(descr),
        Descr::Fields(fields) => (fields.iter())
            .filter_map(|(_, descr)| descr.as_deref())
            .try_for_each(take),
    }
}

fn header_of(bytes: &[u8]) -> Result<(Header, usize), NpyError> {
    let damaged = |what: &str| NpyError::Damaged(what.to_owned());
    if !bytes.starts_with(MAGIC) {
        return Err(NpyError::NoMagic(quote_start(bytes)));
    }
    let rest = bytes.get(MAGIC.len()..).unwrap_or_default();
    let (length, before) = match rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), SHORT_PREFIX_BYTES),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, LONG_PREFIX_BYTES),
        [version, ..] if !(1..=3).contains(version) => {
            return Err(NpyError::Damaged(format!(
                "the array has version {version}, expected 1 to 3"
            )));
        }
        _ => return Err(damaged("the array ends within its header")),
    };
    if length > MAX_HEADER_BYTES {
        return Err(NpyError::Damaged(format!(
            "the header of an array has {length} bytes, expected at most {MAX_HEADER_BYTES}"
        )));
    }
    let end = before.saturating_add(length);
    let text = bytes
        .get(before..end)
        .ok_or_else(|| damaged("the array ends within its header"))?;
    // The text is Latin 1 before version 3, UTF-8 in version 3; everything that hoid needs, except names, is ASCII.
    let text = String::from_utf8_lossy(text);
    let header = header::parse(&text).ok_or_else(|| {
        NpyError::Damaged(format!(
            "the header of an array cannot be parsed: {}",
            abbreviate(&text)
        ))
    })?;
    Ok((header, end))
}

/// Returns the number of items; an error if their total size is not `bytes`.
fn item_count(header: &Header, size: usize, bytes: usize) -> Result<usize, NpyError> {
    let count = header
        .shape
        .iter()
        .try_fold(1_usize, |count, side| count.checked_mul(*side));
    let expected = count.and_then(|count| count.checked_mul(size));
    match (count, expected) {
        (Some(count), Some(expected)) if expected == bytes => Ok(count),
        _ => Err(NpyError::Damaged(format!(
            "an array of {} items of {size} bytes holds {bytes} bytes",
            abbreviate(&format!("{:?}", header.shape))
        ))),
    }
}

fn plain_value(item: &Item, header: &Header, data: Vec<u8>) -> Result<Value, NpyError> {
    let Some(size) = item.size() else {
        return Ok(unread_value(item));
    };
    let count = item_count(header, size, data.len())?;
    Ok(match item {
        Item::Numbers { kind, big_endian } => Value::Array(Array {
            numbers: Numbers::new(data, *kind, *big_endian),
            dims: header.shape.clone(),
            is_row_major: !header.fortran_order,
        }),
        // Items of length zero take no bytes, so the data do not limit their number.
        Item::Unicode { length: 0, .. } | Item::Bytes { length: 0 } => Value::Texts(vec![String::new(); count]),
        Item::Unicode { big_endian, .. } => Value::Texts(
            data.chunks_exact(size)
                .map(|text| decode_unicode(text, *big_endian))
                .collect(),
        ),
        Item::Bytes { .. } => Value::Texts(data.chunks_exact(size).map(decode_bytes).collect()),
        Item::Clock {
            big_endian,
            unit_s,
            is_clock_time,
        } => Value::Array(Array {
            numbers: clock_seconds(&Numbers::new(data, Kind::I64, *big_endian), *unit_s, *is_clock_time),
            dims: header.shape.clone(),
            is_row_major: !header.fortran_order,
        }),
        Item::Unread { .. } => unread_value(item),
    })
}

/// Returns the time unit in s of a type such as `M8[ns]` or `m8[10us]`; `None` for months and years, which have no
/// fixed duration.
fn clock_unit_s(descr: &str) -> Option<f64> {
    let unit = descr.strip_prefix(['M', 'm'])?.strip_prefix("8[")?.strip_suffix(']')?;
    let from = unit.find(|c: char| !c.is_ascii_digit())?;
    let count = if from == 0 { 1.0 } else { unit[..from].parse().ok()? };
    let unit_s = match &unit[from..] {
        "D" => 86_400.0,
        "h" => 3600.0,
        "m" => 60.0,
        "s" => 1.0,
        "ms" => 1e-3,
        "us" => 1e-6,
        "ns" => 1e-9,
        _ => return None,
    };
    Some(count * unit_s)
}

/// Converts the counts of a clock to s, for clock times relative to the first one; an invalid count (NaT) becomes NaN.
fn clock_seconds(counts: &Numbers, unit_s: f64, is_clock_time: bool) -> Numbers {
    let known: Vec<Option<i64>> = (0..counts.len())
        .map(|at| counts.integer(at).filter(|n| *n != i64::MIN))
        .collect();
    let first = known
        .iter()
        .flatten()
        .next()
        .copied()
        .filter(|_| is_clock_time)
        .unwrap_or(0);
    // Dividing by 1e9 keeps digits that multiplying by 1e-9 would lose.
    let seconds = |count: i64| {
        let count = i128::from(count).saturating_sub(i128::from(first)) as f64;
        if unit_s < 1.0 {
            count / (1.0 / unit_s).round()
        } else {
            count * unit_s
        }
    };
    let values: Vec<f64> = known.into_iter().map(|count| count.map_or(f64::NAN, seconds)).collect();
    Numbers::from_f64(&values)
}

fn unread_value(item: &Item) -> Value {
    match item {
        Item::Unread { what, .. } => Value::Unread((*what).to_owned()),
        _ => Value::Unread(String::from("an unknown type")),
    }
}

fn structured_values(
    fields: &[(String, Option<String>)],
    header: &Header,
    data: Vec<u8>,
) -> Result<Vec<(String, Value)>, NpyError> {
    let items: Option<Vec<(&String, Item, usize)>> = fields
        .iter()
        .map(|(name, descr)| {
            let item = Item::of(descr.as_deref()?);
            let size = item.size()?;
            Some((name, item, size))
        })
        .collect();
    let Some(items) = items else {
        return Ok(vec![(
            String::from("arr"),
            Value::Unread(String::from("a structured array with arrays in it")),
        )]);
    };
    let item = items
        .iter()
        .try_fold(0_usize, |sum, (.., size)| sum.checked_add(*size))
        .unwrap_or(usize::MAX);
    item_count(header, item, data.len())?;
    let data = Rc::new(data);
    let mut offset = 0_usize;
    let mut values = Vec::with_capacity(items.len());
    for (name, kind, size) in items {
        let field = offset..offset.saturating_add(size);
        let texts = |of: &dyn Fn(&[u8]) -> String| {
            let text = |row: &[u8]| of(row.get(field.clone()).unwrap_or_default());
            Value::Texts(data.chunks_exact(item).map(text).collect())
        };
        let value = match kind {
            Item::Numbers { kind, big_endian } => {
                let numbers = Numbers::field(&data, kind, big_endian, offset, item);
                Value::Array(Array::vector(numbers))
            }
            Item::Unicode { big_endian, .. } if size > 0 => texts(&|text| decode_unicode(text, big_endian)),
            Item::Bytes { .. } if size > 0 => texts(&decode_bytes),
            other => unread_value(&other),
        };
        // Fields without a name are padding.
        if !name.is_empty() {
            values.push((name.clone(), value));
        }
        offset = field.end;
    }
    Ok(values)
}

fn decode_unicode(bytes: &[u8], big_endian: bool) -> String {
    let character = |c: &[u8]| {
        let mut c = <[u8; 4]>::try_from(c).unwrap_or_default();
        if big_endian {
            c.reverse();
        }
        char::from_u32(u32::from_le_bytes(c)).unwrap_or(char::REPLACEMENT_CHARACTER)
    };
    let text: String = bytes.chunks_exact(4).map(character).collect();
    text.trim_end_matches('\0').to_owned()
}

fn decode_bytes(bytes: &[u8]) -> String {
    let text = bytes
        .iter()
        .rposition(|byte| *byte != 0)
        .and_then(|last| bytes.get(..=last));
    String::from_utf8_lossy(text.unwrap_or_default()).into_owned()
}

/// Returns a one-dimensional array in the format written by numpy.
pub(super) fn npy_bytes(values: Values<'_>) -> Vec<u8> {
    let (descr, data): (String, Vec<u8>) = match values {
        Values::Real(values) => (
            String::from("<f8"),
            values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        ),
        Values::Whole(values) => (
            String::from("<u8"),
            values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        ),
        Values::Text(texts) => {
            let longest = texts.iter().map(|text| text.chars().count()).max().unwrap_or(0).max(1);
            let padded = |text: &String| {
                let characters: Vec<char> = text.chars().collect();
                (0..longest).flat_map(move |k| characters.get(k).map_or(0, |c| u32::from(*c)).to_le_bytes())
            };
            (format!("<U{longest}"), texts.iter().flat_map(padded).collect())
        }
    };
    let mut header = format!(
        "{{'descr': {}, 'fortran_order': False, 'shape': ({},), }}",
        header::quoted(&descr),
        values.len()
    );
    let whole = SHORT_PREFIX_BYTES.saturating_add(header.len()).saturating_add(1);
    let padding = whole.next_multiple_of(ALIGNMENT).saturating_sub(whole);
    header.extend(std::iter::repeat_n(' ', padding));
    header.push('\n');
    let mut bytes = Vec::with_capacity(
        SHORT_PREFIX_BYTES
            .saturating_add(header.len())
            .saturating_add(data.len()),
    );
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&[1, 0]);
    // The header of a one-dimensional array is far shorter than 2^16 bytes.
    bytes.extend_from_slice(&(header.len() as u16).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    bytes.extend_from_slice(&data);
    bytes
}
