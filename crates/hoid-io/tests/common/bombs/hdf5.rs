//! HDF5 (version 7.3 of MATLAB): huge sizes of arrays, chunks, attributes and lists in a valid file. Data beyond the
//! file are read as zeros.

use std::{fs, path::Path};

use crate::mutations::draw::Draw;

/// Sizes of the arrays of the file, and of their chunks.
const SIZES: [u64; 3] = [40, 16, 2];

/// Makes a bomb.
pub fn bomb(draw: &mut Draw) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/mat/h5py_v73.mat");
    let mut file = fs::read(path).unwrap();
    // Sizes of arrays are numbers of eight bytes, and sizes of chunks are numbers of four bytes.
    let width = *draw.one_of(&[8, 8, 4]);
    let small = |at: &usize| {
        let number = file[*at..*at + width]
            .iter()
            .rev()
            .fold(0, |sum, byte| sum << 8 | u64::from(*byte));
        SIZES.contains(&number)
    };
    let indices: Vec<usize> = (512..file.len() - width).step_by(4).filter(small).collect();
    for _ in 0..1 + draw.below(4) {
        let at = *draw.one_of(&indices);
        let size = (1_u64 << draw.below(if width == 8 { 62 } else { 32 })).wrapping_sub(draw.below(2) as u64);
        file[at..at + width].copy_from_slice(&size.to_le_bytes()[..width]);
    }
    file
}
