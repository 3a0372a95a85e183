//! The mutations: flipped bits, truncation, moved or duplicated parts, huge numbers, words of the
//! format in wrong places.

use super::{draw::Draw, originals::Original};

/// Maximum length of a mutated file.
const MAX_FILE_BYTES: usize = 1 << 18;
/// Maximum number of mutations of a case.
const MAX_MUTATIONS: usize = 8;

/// Integers at which counts, sizes and sums overflow.
const EDGE_INTEGERS: [u64; 20] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    0x1_0000,
    0x00ff_ffff,
    0x0fff_ffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x1_0000_0000,
    0x7fff_ffff_ffff_ffff,
    0x8000_0000_0000_0000,
    0xffff_ffff_ffff_fff8,
    0xffff_ffff_ffff_ffff,
];
/// Decimal numbers at which counts, sizes and sums overflow.
const EDGE_DECIMALS: [&str; 16] = [
    "",
    "0",
    "-1",
    "1e308",
    "1e-320",
    "1e999",
    "-0",
    "NaN",
    "inf",
    "4294967296",
    "9223372036854775807",
    "18446744073709551616",
    "99999999999999999999999999999",
    "0.1,5",
    "1.5.2",
    "0x10",
];

/// The bytes of a damaged file.
pub fn mutated(original: &Original, other: &Original, draw: &mut Draw) -> Vec<u8> {
    // Most cases have one mutation: with many mutations, only the first checks are reached.
    let count = 1 + draw
        .below(MAX_MUTATIONS)
        .min(draw.below(MAX_MUTATIONS))
        .min(draw.below(MAX_MUTATIONS));
    if let Some(inside) = original.inside.as_ref().filter(|_| draw.below(3) > 0) {
        let mut inside = inside.clone();
        let mut from = other.inside.clone();
        let mut from = from
            .as_mut()
            .map(super::inside::UnpackedParts::parts)
            .unwrap_or_default();
        let at = draw.below(from.len());
        let foreign: &[u8] = from.get_mut(at).map_or(&other.bytes, |part| part);
        let mut parts = inside.parts();
        let at = draw.below(parts.len());
        if let Some(part) = parts.get_mut(at) {
            (0..count).for_each(|_| mutate(part, foreign, original, draw));
        }
        return inside.pack();
    }
    let mut bytes = original.bytes.clone();
    (0..count).for_each(|_| mutate(&mut bytes, &other.bytes, original, draw));
    bytes
}

/// One mutation.
fn mutate(bytes: &mut Vec<u8>, other: &[u8], original: &Original, draw: &mut Draw) {
    // A binary file with a byte too many or too few is rejected at once.
    let keeps_length = !original.is_text() && draw.below(3) > 0;
    let kind = if keeps_length {
        *draw.one_of(&[0, 1, 2, 7, 8, 9, 11])
    } else {
        draw.below(13)
    };
    match kind {
        0 | 1 => {
            let at = random_position(bytes.len(), draw);
            if let Some(byte) = bytes.get_mut(at) {
                *byte ^= 1 << draw.below(8);
            }
        }
        2 => {
            let at = random_position(bytes.len(), draw);
            if let Some(byte) = bytes.get_mut(at) {
                *byte = draw.bits() as u8;
            }
        }
        3 => bytes.truncate(draw.below(bytes.len())),
        4 => {
            let (at, length) = random_range(bytes.len(), draw);
            bytes.drain(at..at + length);
        }
        5 => {
            let (at, length) = random_range(bytes.len(), draw);
            let copy = bytes[at..at + length].to_vec();
            let times = if draw.below(8) == 0 { 1 + draw.below(200) } else { 1 };
            let into = random_position(bytes.len(), draw);
            insert(bytes, into, &copy.repeat(times));
        }
        6 => {
            let (at, length) = random_range(other.len(), draw);
            let into = random_position(bytes.len(), draw);
            insert(bytes, into, &other[at..at + length]);
        }
        7 => {
            let (at, length) = random_range(other.len(), draw);
            let into = random_position(bytes.len(), draw);
            let length = length.min(bytes.len() - into);
            bytes[into..into + length].copy_from_slice(&other[at..at + length]);
        }
        8 | 9 => {
            let edge = match draw.below(4) {
                0 => (bytes.len() as u64).wrapping_add(*draw.one_of(&[0, 1, u64::MAX])),
                _ => *draw.one_of(&EDGE_INTEGERS),
            };
            let size = *draw.one_of(&[1, 2, 4, 4, 8, 8]);
            let number = if draw.below(4) == 0 {
                edge.to_be_bytes()[8 - size..].to_vec()
            } else {
                edge.to_le_bytes()[..size].to_vec()
            };
            let at = random_position(bytes.len(), draw);
            let at = if draw.below(2) == 0 { at - at % size } else { at };
            if let Some(there) = bytes.get_mut(at..at + size) {
                there.copy_from_slice(&number);
            }
        }
        10 => {
            let token = *draw.one_of(original.tokens);
            let at = random_position(bytes.len(), draw);
            insert(bytes, at, token);
        }
        11 => {
            let token = *draw.one_of(original.tokens);
            let at = random_position(bytes.len(), draw);
            let end = bytes.len().min(at + token.len());
            bytes[at..end].copy_from_slice(&token[..end - at]);
        }
        _ => replace_number(bytes, draw),
    }
}

/// Draws a position within a number of bytes: anywhere, or near the start or the end, which contain most of the
/// structure.
fn random_position(length: usize, draw: &mut Draw) -> usize {
    match draw.below(4) {
        0 => draw.below(length.min(256)),
        1 => length.saturating_sub(1 + draw.below(length.min(512))),
        _ => draw.below(length),
    }
}

/// Draws a range within a number of bytes, which is mostly short.
fn random_range(length: usize, draw: &mut Draw) -> (usize, usize) {
    let at = random_position(length, draw).min(length);
    let most = if draw.below(4) == 0 { length } else { 64 };
    (at, draw.below(most + 1).min(length - at))
}

fn insert(bytes: &mut Vec<u8>, at: usize, what: &[u8]) {
    let room = MAX_FILE_BYTES.saturating_sub(bytes.len());
    let what = &what[..what.len().min(room)];
    let at = at.min(bytes.len());
    bytes.splice(at..at, what.iter().copied());
}

/// Replaces a decimal number in the bytes.
fn replace_number(bytes: &mut Vec<u8>, draw: &mut Draw) {
    let from = random_position(bytes.len(), draw);
    let Some(start) = bytes.iter().skip(from).position(u8::is_ascii_digit).map(|at| at + from) else {
        return;
    };
    let length = bytes[start..].iter().take_while(|b| b.is_ascii_digit()).count();
    bytes.splice(start..start + length, draw.one_of(&EDGE_DECIMALS).bytes());
}
