//! Binary format: a description in JSON followed by data, with a checksum.
//!
//! | bytes | contents |
//! |---|---|
//! | 8 | type of the object and version of its layout |
//! | 8 | length L of the description |
//! | L | description |
//! | any number | data |
//! | 8 | FNV-1a checksum of all preceding bytes (G. Fowler, L. C. Noll, K.-P. Vo, 1991; 64 bits) |
//!
//! All numbers are little-endian. The checksum detects damage, but does not protect against an adversary.

use serde_json::Value;

const FNV_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
const FNV_PRIME: u64 = 0x0000_0100_0000_01b3;

/// Reason why packed bytes cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum UnpackError {
    /// The bytes are of another type or version.
    Other,
    /// The bytes were changed or truncated.
    Damaged,
}

pub(crate) fn checksum(bytes: &[u8]) -> u64 {
    let next = |sum: u64, byte: &u8| (sum ^ u64::from(*byte)).wrapping_mul(FNV_PRIME);
    bytes.iter().fold(FNV_BASIS, next)
}

pub(crate) fn pack(magic: [u8; 8], description: &Value, bytes: &[u8]) -> Vec<u8> {
    let description = description.to_string();
    let mut all = magic.to_vec();
    all.extend_from_slice(&(description.len() as u64).to_le_bytes());
    all.extend_from_slice(description.as_bytes());
    all.extend_from_slice(bytes);
    let sum = checksum(&all);
    all.extend_from_slice(&sum.to_le_bytes());
    all
}

/// Returns the description and the data of packed bytes.
pub(crate) fn unpack(magic: [u8; 8], all: &[u8]) -> Result<(Value, &[u8]), UnpackError> {
    let rest = all.strip_prefix(&magic).ok_or(UnpackError::Other)?;
    let of = || {
        let (body, stated) = all.split_last_chunk::<8>()?;
        if checksum(body) != u64::from_le_bytes(*stated) {
            return None;
        }
        let (length, rest) = rest.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok()?;
        let (description, rest) = rest.split_at_checked(length)?;
        let bytes = rest.get(..rest.len().checked_sub(8)?)?;
        Some((serde_json::from_slice(description).ok()?, bytes))
    };
    of().ok_or(UnpackError::Damaged)
}

/// Converts numbers to bytes.
pub(crate) fn as_bytes(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Converts bytes to numbers; `None` if their count is not a multiple of eight.
pub(crate) fn as_numbers(bytes: &[u8]) -> Option<Vec<f64>> {
    let (numbers, []) = bytes.as_chunks::<8>() else {
        return None;
    };
    Some(numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
}
