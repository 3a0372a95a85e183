//! MATLAB's versions 5 and 7: compressed zeros, wrong sizes, nested cells, excessive numbers of fields.

use super::zeros::{self, MEGABYTE};
use crate::mutations::draw::Draw;

const MATRIX: u32 = 14;
const CELL: u32 = 1;
const STRUCTURE: u32 = 2;
pub const CHARACTERS: u32 = 4;
pub const DOUBLE: u32 = 6;

/// Makes a bomb.
pub fn bomb(draw: &mut Draw) -> Vec<u8> {
    let megabytes = 1 << (3 + draw.below(8));
    let bytes = megabytes * MEGABYTE;
    // Types of stored numbers, with 8, 4 and 1 bytes.
    let (stored, size) = *draw.one_of(&[(9, 8), (7, 4), (2, 1), (1, 1)]);
    let class = *draw.one_of(&[DOUBLE, DOUBLE, CHARACTERS, 9, 5]);
    match draw.below(6) {
        0..=2 => {
            let values = (bytes / size) as u32;
            let sizes = *draw.one_of(&[[values, 1], [1, values], [values / 4, 4], [u32::MAX, u32::MAX]]);
            file(&[variable(class, sizes, stored, bytes as u32, megabytes)])
        }
        3 => {
            let several = || variable(DOUBLE, [32 << 20, 1], 2, 32 << 20, 32);
            file(&[several(), several(), several(), several()])
        }
        // Empty cells and structures of any size.
        4 => {
            let class = *draw.one_of(&[CELL, STRUCTURE]);
            let many = 1 << (10 + draw.below(21));
            let mut inside = array_header(class, [many, 1], "x");
            if class == STRUCTURE {
                inside.extend([word(5 | 4 << 16), word(8), word(1), word(8 * 200)].concat());
                inside.extend((0..200_u32).flat_map(|k| format!("f{k:07}").into_bytes()));
            }
            file(&[compress(&matrix_element(&inside))])
        }
        // Nested cells.
        _ => {
            let deep = 1 << (4 + draw.below(10));
            let inside = (0..deep).fold(array_header(DOUBLE, [0, 0], ""), |inside, _| {
                [array_header(CELL, [1, 1], ""), matrix_element(&inside)].concat()
            });
            file(&[compress(&matrix_element(&inside))])
        }
    }
}

fn word(n: u32) -> [u8; 4] {
    n.to_le_bytes()
}

/// Returns the flags, the sizes and the name of an array.
fn array_header(class: u32, sizes: [u32; 2], name: &str) -> Vec<u8> {
    let mut head = [word(6), word(8), word(class), word(0)].concat();
    head.extend([word(5), word(8), word(sizes[0]), word(sizes[1])].concat());
    head.extend([word(1), word(name.len() as u32)].concat());
    head.extend(name.as_bytes());
    head.resize(head.len().next_multiple_of(8), 0);
    head
}

fn matrix_element(inside: &[u8]) -> Vec<u8> {
    [&word(MATRIX)[..], &word(inside.len() as u32), inside].concat()
}

/// Returns the variable e, which consists of zeros.
pub fn variable(class: u32, sizes: [u32; 2], stored: u32, bytes: u32, megabytes: usize) -> Vec<u8> {
    let head = array_header(class, sizes, "e");
    let length = head.len() as u32 + 8 + bytes;
    let beginning = [&word(MATRIX)[..], &word(length), &head, &word(stored), &word(bytes)].concat();
    zeros::zlib(&beginning, megabytes)
}

fn compress(element: &[u8]) -> Vec<u8> {
    zeros::zlib(element, 0)
}

/// Returns a file of compressed variables.
pub fn file(variables: &[Vec<u8>]) -> Vec<u8> {
    let mut file = vec![b' '; 128];
    file[..19].copy_from_slice(b"MATLAB 5.0 MAT-file");
    file[124..].copy_from_slice(&[0, 1, b'I', b'M']);
    for packed in variables {
        file.extend([word(15), word(packed.len() as u32)].concat());
        file.extend(packed);
    }
    file
}
