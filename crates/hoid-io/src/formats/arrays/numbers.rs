//! Numbers as stored in a file: bytes, a type and a stride. The numbers are converted to `f64` on request.

use std::rc::Rc;

use half::f16;

/// The type of a stored number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    F16,
    F32,
    F64,
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
}

impl Kind {
    /// Returns the size of one number in bytes.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::F16 | Self::I16 | Self::U16 => 2,
            Self::F32 | Self::I32 | Self::U32 => 4,
            Self::F64 | Self::I64 | Self::U64 => 8,
        }
    }

    /// True for integer types.
    pub(crate) fn is_whole(self) -> bool {
        !matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    /// True for floating-point types of single precision or less.
    pub(crate) fn is_single(self) -> bool {
        matches!(self, Self::F16 | Self::F32)
    }

    /// Returns the name of the type in numpy and MATLAB.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::F16 => "half",
            Self::F32 => "single",
            Self::F64 => "double",
            Self::I8 => "int8",
            Self::I16 => "int16",
            Self::I32 => "int32",
            Self::I64 => "int64",
            Self::U8 => "uint8",
            Self::U16 => "uint16",
            Self::U32 => "uint32",
            Self::U64 => "uint64",
        }
    }
}

/// Numbers of one type that lie `step` bytes apart.
#[derive(Debug, Clone)]
pub(crate) struct Numbers {
    bytes: Rc<Vec<u8>>,
    kind: Kind,
    big_endian: bool,
    start: usize,
    step: usize,
    len: usize,
}

impl Numbers {
    /// Interprets the bytes as numbers; an incomplete number at the end is ignored.
    pub(crate) fn new(bytes: Vec<u8>, kind: Kind, big_endian: bool) -> Self {
        let len = bytes.len().checked_div(kind.size()).unwrap_or(0);
        Self {
            bytes: Rc::new(bytes),
            kind,
            big_endian,
            start: 0,
            step: kind.size(),
            len,
        }
    }

    /// Extracts a field: one number from each item of `item` bytes, at `offset` bytes from the start of the item.
    pub(crate) fn field(bytes: &Rc<Vec<u8>>, kind: Kind, big_endian: bool, offset: usize, item: usize) -> Self {
        let fits = offset.checked_add(kind.size()).is_some_and(|end| end <= item);
        Self {
            bytes: Rc::clone(bytes),
            kind,
            big_endian,
            start: offset,
            step: item,
            len: if fits {
                bytes.len().checked_div(item).unwrap_or(0)
            } else {
                0
            },
        }
    }

    /// Stores numbers that are already `f64`.
    pub(crate) fn from_f64(values: &[f64]) -> Self {
        Self::new(values.iter().flat_map(|v| v.to_le_bytes()).collect(), Kind::F64, false)
    }

    pub(crate) fn len(&self) -> usize {
        self.len
    }

    pub(crate) fn kind(&self) -> Kind {
        self.kind
    }

    /// Selects `len` numbers, every `stride`-th one from index `first` on; numbers beyond the end are omitted.
    pub(crate) fn line(&self, first: usize, stride: usize, len: usize) -> Self {
        let there = self.len.saturating_sub(first).div_ceil(stride.max(1));
        Self {
            start: self.start.saturating_add(first.min(self.len).saturating_mul(self.step)),
            step: self.step.saturating_mul(stride.max(1)),
            len: len.min(there),
            ..self.clone()
        }
    }

    /// Returns the number at an index; NaN if the index is out of range.
    pub(crate) fn value(&self, at: usize) -> f64 {
        let Some(bytes) = self.bytes_at(at) else {
            return f64::NAN;
        };
        let number = |n: [u8; 8]| (u64::from_le_bytes(n), i64::from_le_bytes(n));
        let (unsigned, signed) = number(bytes);
        match self.kind {
            Kind::F16 => f16::from_bits(unsigned as u16).to_f64(),
            Kind::F32 => f64::from(f32::from_bits(unsigned as u32)),
            Kind::F64 => f64::from_bits(unsigned),
            Kind::I8 => f64::from(unsigned as u8 as i8),
            Kind::I16 => f64::from(unsigned as u16 as i16),
            Kind::I32 => f64::from(unsigned as u32 as i32),
            Kind::I64 => signed as f64,
            Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => unsigned as f64,
        }
    }

    /// Returns the 8-byte integer at an index.
    pub(crate) fn integer(&self, at: usize) -> Option<i64> {
        self.bytes_at(at).map(i64::from_le_bytes)
    }

    /// Returns all numbers as `f64`.
    pub(crate) fn values(&self) -> Vec<f64> {
        (0..self.len).map(|at| self.value(at)).collect()
    }

    /// Returns all numbers as counts; `None` if any of them is not a nonnegative integer.
    pub(crate) fn counts(&self) -> Option<Vec<u64>> {
        let count = |at: usize| {
            let n = self.bytes_at(at).map(u64::from_le_bytes)?;
            match self.kind {
                Kind::U8 | Kind::U16 | Kind::U32 | Kind::U64 => Some(n),
                Kind::I8 | Kind::I16 | Kind::I32 | Kind::I64 => {
                    let sign = 8_u32.checked_mul(self.kind.size() as u32)?.checked_sub(1)?;
                    (n.checked_shr(sign)? == 0).then_some(n)
                }
                Kind::F16 | Kind::F32 | Kind::F64 => None,
            }
        };
        (0..self.len).map(count).collect()
    }

    /// Returns the bytes of a number, little-endian, padded with zeros.
    fn bytes_at(&self, at: usize) -> Option<[u8; 8]> {
        let size = self.kind.size();
        let from = at.checked_mul(self.step)?.checked_add(self.start)?;
        let stored = self.bytes.get(from..from.checked_add(size)?)?;
        let mut bytes = [0; 8];
        let number = bytes.get_mut(..size)?;
        number.copy_from_slice(stored);
        if self.big_endian {
            number.reverse();
        }
        Some(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_types_are_read_in_both_byte_orders() {
        let check = |kind, little: &[u8], expected: f64| {
            let found = Numbers::new(little.to_vec(), kind, false).values();
            assert_eq!(found, [expected], "{kind:?}");
            let big: Vec<u8> = little.iter().rev().copied().collect();
            assert_eq!(Numbers::new(big, kind, true).values(), [expected], "{kind:?}");
        };
        check(Kind::F16, &[0x00, 0xc0], -2.0);
        check(Kind::F32, &(-0.1_f32).to_le_bytes(), f64::from(-0.1_f32));
        check(Kind::F64, &(-0.1_f64).to_le_bytes(), -0.1);
        check(Kind::I8, &[0xfe], -2.0);
        check(Kind::U8, &[0xfe], 254.0);
        check(Kind::I16, &(-300_i16).to_le_bytes(), -300.0);
        check(Kind::U16, &(65_000_u16).to_le_bytes(), 65_000.0);
        check(Kind::I32, &i32::MIN.to_le_bytes(), -2_147_483_648.0);
        check(Kind::U32, &u32::MAX.to_le_bytes(), 4_294_967_295.0);
        check(Kind::I64, &(-7_i64).to_le_bytes(), -7.0);
        check(Kind::U64, &(1_u64 << 60).to_le_bytes(), (1_u64 << 60) as f64);
    }

    #[test]
    fn strided_lines_and_fields_are_extracted() {
        let numbers = Numbers::from_f64(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(numbers.line(1, 3, 2).values(), [1.0, 4.0]);
        assert_eq!(numbers.line(1, 3, 9).values(), [1.0, 4.0]);
        assert_eq!(numbers.line(1, 2, 3).line(1, 2, 5).values(), [3.0]);
        assert_eq!(numbers.line(7, 1, 5).len(), 0);
        let bytes = Rc::new(vec![1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(Numbers::field(&bytes, Kind::U8, false, 2, 3).values(), [3.0, 6.0]);
        assert_eq!(Numbers::field(&bytes, Kind::U16, true, 2, 3).len(), 0);
        let signs = Numbers::new(vec![0, 127, 128], Kind::I8, false);
        assert_eq!(signs.line(0, 1, 2).counts(), Some(vec![0, 127]));
        assert_eq!(signs.counts(), None);
    }
}
