//! Data elements of version 5: a tag with type and length, followed by the data, padded to a multiple of 8 bytes. Data
//! of up to 4 bytes may be stored in the tag.

/// Length of the file header of version 5.
pub(super) const HEADER_BYTES: usize = 128;

/// Data types with the numbers assigned by MathWorks.
pub(super) mod data {
    pub(crate) const INT8: u32 = 1;
    pub(crate) const UINT8: u32 = 2;
    pub(crate) const INT16: u32 = 3;
    pub(crate) const UINT16: u32 = 4;
    pub(crate) const INT32: u32 = 5;
    pub(crate) const UINT32: u32 = 6;
    pub(crate) const SINGLE: u32 = 7;
    pub(crate) const DOUBLE: u32 = 9;
    pub(crate) const INT64: u32 = 12;
    pub(crate) const UINT64: u32 = 13;
    pub(crate) const MATRIX: u32 = 14;
    pub(crate) const COMPRESSED: u32 = 15;
    pub(crate) const UTF8: u32 = 16;
    pub(crate) const UTF16: u32 = 17;
    pub(crate) const UTF32: u32 = 18;
}

/// A data element.
#[derive(Debug, Clone, Copy)]
pub(super) struct Element<'a> {
    pub(super) kind: u32,
    pub(super) bytes: &'a [u8],
}

/// Consecutive elements.
#[derive(Debug, Clone)]
pub(super) struct Elements<'a> {
    rest: &'a [u8],
    pub(super) big_endian: bool,
}

impl<'a> Elements<'a> {
    pub(super) fn new(bytes: &'a [u8], big_endian: bool) -> Self {
        Self {
            rest: bytes,
            big_endian,
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// Returns the next element, or a description of the violation of the format.
    pub(super) fn next(&mut self) -> Result<Element<'a>, String> {
        let ends = |left: usize| format!("an element ends {left} bytes into its tag");
        let first = self
            .rest
            .get(..4)
            .and_then(|b| self.u32(b))
            .ok_or_else(|| ends(self.rest.len()))?;
        if first >> 16 != 0 {
            let length = (first >> 16) as usize;
            let bytes = self.rest.get(4..8).ok_or_else(|| ends(self.rest.len()))?;
            let bytes = bytes
                .get(..length)
                .ok_or_else(|| format!("{length} bytes in a tag that holds at most 4"))?;
            self.rest = self.rest.get(8..).unwrap_or_default();
            return Ok(Element {
                kind: first & 0xffff,
                bytes,
            });
        }
        let length = self
            .rest
            .get(4..8)
            .and_then(|b| self.u32(b))
            .ok_or_else(|| ends(self.rest.len()))? as usize;
        let data = self.rest.get(8..).unwrap_or_default();
        let Some(bytes) = data.get(..length) else {
            return Err(format!("an element of {length} bytes ends after {} bytes", data.len()));
        };
        // Compressed elements are not padded, and the last element of a file may lack its padding.
        let padded = if first == data::COMPRESSED {
            length
        } else {
            length.next_multiple_of(8)
        };
        self.rest = data.get(padded..).unwrap_or_default();
        Ok(Element { kind: first, bytes })
    }

    /// Returns the next element, which must be of the given type.
    pub(super) fn next_of_type(&mut self, kind: u32, what: &str) -> Result<&'a [u8], String> {
        match self.next()? {
            element if element.kind == kind => Ok(element.bytes),
            element => Err(format!("{what} is of type {}, expected {kind}", element.kind)),
        }
    }

    /// Interprets bytes as 32-bit unsigned integers.
    pub(super) fn u32s(&self, bytes: &[u8]) -> Vec<u32> {
        bytes.chunks_exact(4).filter_map(|bytes| self.u32(bytes)).collect()
    }

    fn u32(&self, bytes: &[u8]) -> Option<u32> {
        let bytes = <[u8; 4]>::try_from(bytes).ok()?;
        Some(if self.big_endian {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        })
    }
}
