//! Compressed contents of a file with checksums: the members of a zip archive (CRC-32), the
//! variables of MATLAB's version 7 (Adler-32).

use std::io::{Cursor, Read, Write};

use flate2::{Compression, read::ZlibDecoder, write::ZlibEncoder};
use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

/// The decompressed parts of a file.
#[derive(Debug, Clone)]
pub enum UnpackedParts {
    /// Name and bytes of each member.
    Zip(Vec<(String, Vec<u8>)>),
    /// The header, and each element without compression.
    Matlab(Vec<u8>, Vec<Vec<u8>>),
}

const MATLAB_HEADER_BYTES: usize = 128;
const COMPRESSED: u32 = 15;

impl UnpackedParts {
    /// Contents of a valid file; none if nothing is compressed.
    pub fn of(extension: &str, bytes: &[u8]) -> Option<Self> {
        match extension {
            "npz" => unpack_zip(bytes),
            "mat" if bytes.get(MATLAB_HEADER_BYTES - 2..MATLAB_HEADER_BYTES) == Some(b"IM") => unpack_matlab(bytes),
            _ => None,
        }
    }

    /// The parts that may be modified.
    pub fn parts(&mut self) -> Vec<&mut Vec<u8>> {
        match self {
            Self::Zip(members) => members.iter_mut().map(|(_, bytes)| bytes).collect(),
            Self::Matlab(_, elements) => elements.iter_mut().collect(),
        }
    }

    /// Returns the file with valid checksums.
    pub fn pack(&self) -> Vec<u8> {
        match self {
            Self::Zip(members) => {
                let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
                let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
                for (name, bytes) in members {
                    archive.start_file(name.as_str(), options).unwrap();
                    archive.write_all(bytes).unwrap();
                }
                archive.finish().unwrap().into_inner()
            }
            Self::Matlab(header, elements) => {
                let mut file = header.clone();
                for element in elements {
                    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
                    encoder.write_all(element).unwrap();
                    let bytes = encoder.finish().unwrap();
                    file.extend(COMPRESSED.to_le_bytes());
                    file.extend((bytes.len() as u32).to_le_bytes());
                    file.extend(bytes);
                }
                file
            }
        }
    }
}

fn unpack_zip(bytes: &[u8]) -> Option<UnpackedParts> {
    let mut archive = ZipArchive::new(Cursor::new(bytes)).ok()?;
    let mut members = Vec::new();
    for index in 0..archive.len() {
        let mut member = archive.by_index(index).ok()?;
        let name = member.name().ok()?.into_owned();
        let mut bytes = Vec::new();
        member.read_to_end(&mut bytes).ok()?;
        members.push((name, bytes));
    }
    Some(UnpackedParts::Zip(members))
}

fn unpack_matlab(bytes: &[u8]) -> Option<UnpackedParts> {
    let (header, mut rest) = bytes.split_at_checked(MATLAB_HEADER_BYTES)?;
    let mut elements = Vec::new();
    while let Some((tag, behind)) = rest.split_at_checked(8) {
        let number = |at: usize| Some(u32::from_le_bytes(tag[at..at + 4].try_into().ok()?));
        let (kind, length) = (number(0)?, number(4)? as usize);
        let data = behind.get(..length)?;
        if kind == COMPRESSED {
            let mut element = Vec::new();
            ZlibDecoder::new(data).read_to_end(&mut element).ok()?;
            elements.push(element);
            rest = &behind[length..];
        } else {
            let padded = length.next_multiple_of(8).min(behind.len());
            elements.push([tag, &behind[..padded]].concat());
            rest = &behind[padded..];
        }
    }
    Some(UnpackedParts::Matlab(header.to_vec(), elements))
}
