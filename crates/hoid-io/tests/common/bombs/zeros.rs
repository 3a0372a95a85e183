//! Compressed zeros: a block of a megabyte, repeated. Checksums are computed if the data are small enough to be read.

use flate2::{Compress, Compression, Crc, FlushCompress};

/// A megabyte.
pub const MEGABYTE: usize = 1 << 20;
/// Largest size of data, in MB, with a valid checksum; readers reject larger data before they reach the checksum.
const MAX_CHECKSUM_MB: usize = 100;

/// Returns deflated data: the given start, followed by a number of megabytes of zeros.
pub fn deflated(beginning: &[u8], megabytes: usize) -> Vec<u8> {
    let mut packer = Compress::new(Compression::default(), false);
    let mut packed = |bytes: &[u8]| {
        let mut packed = Vec::with_capacity(bytes.len() + 1024);
        packer.compress_vec(bytes, &mut packed, FlushCompress::Full).unwrap();
        packed
    };
    let (first, block) = (packed(beginning), packed(&vec![0; MEGABYTE]));
    [first, block.repeat(megabytes), vec![3, 0]].concat()
}

/// Returns the zeros in gzip format.
pub fn gzip(megabytes: usize) -> Vec<u8> {
    let head = [0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255];
    let length = (megabytes * MEGABYTE) as u32;
    let tail = [crc(&[], megabytes).to_le_bytes(), length.to_le_bytes()].concat();
    [&head[..], &deflated(&[], megabytes), &tail].concat()
}

/// Returns the data in zlib format, with the given start.
pub fn zlib(beginning: &[u8], megabytes: usize) -> Vec<u8> {
    // Adler-32 (RFC 1950, section 9): for zeros only the second sum grows.
    let (mut a, mut b) = (1_u64, 0_u64);
    for byte in beginning {
        a = (a + u64::from(*byte)) % 65_521;
        b = (b + a) % 65_521;
    }
    b = (b + a * (megabytes * MEGABYTE) as u64) % 65_521;
    let sum = (b << 16 | a) as u32;
    [&[0x78, 0x9c][..], &deflated(beginning, megabytes), &sum.to_be_bytes()].concat()
}

/// Returns the checksum of a member of a zip archive.
pub fn crc(beginning: &[u8], megabytes: usize) -> u32 {
    let mut sum = Crc::new();
    sum.update(beginning);
    let block = vec![0; MEGABYTE];
    (0..megabytes.min(MAX_CHECKSUM_MB)).for_each(|_| sum.update(&block));
    sum.sum()
}
