//! NPZ: members of zeros, wrong shapes, types that are small in the file and large as numbers, endless headers and
//! archives.

use super::zeros::{self, MEGABYTE};
use crate::mutations::draw::Draw;

/// Makes a bomb.
pub fn bomb(draw: &mut Draw) -> Vec<u8> {
    let megabytes = 1 << (3 + draw.below(8));
    let bytes = megabytes * MEGABYTE;
    let kind = *draw.one_of(&[
        ("<f8", 8),
        ("<f4", 4),
        ("<f2", 2),
        ("|i1", 1),
        ("|b1", 1),
        ("<U250", 1000),
        ("|S1", 1),
        ("<c16", 16),
    ]);
    match draw.below(6) {
        0..=2 => {
            let rows = bytes / kind.1;
            let shape = *draw.one_of(&[[rows, 0], [1, rows], [rows / 4, 4], [1 << 40, 0]]);
            archive(&[member("e", &array_header(kind.0, &shape), megabytes)])
        }
        // Several members, each of them below the limit.
        3 => {
            archive(&["e", "u", "x", "y", "z"].map(|name| member(name, &array_header("|b1", &[32 * MEGABYTE, 0]), 32)))
        }
        // A structure with many fields.
        4 => {
            let fields: String = (0..1 << (8 + draw.below(8)))
                .map(|k| format!("('c{k}', '|b1'), "))
                .collect();
            let head = format!(
                "{{'descr': [{fields}], 'fortran_order': False, 'shape': ({}, )}}",
                1 << draw.below(20)
            );
            archive(&[member("x", &head, 1)])
        }
        _ => {
            let names: Vec<String> = (0..1 << (8 + draw.below(6))).map(|k| format!("c{k}")).collect();
            let small = array_header("<f8", &[4, 0]);
            archive(&names.iter().map(|name| member(name, &small, 0)).collect::<Vec<_>>())
        }
    }
}

/// The header of an array; a second size of 0 is omitted.
pub fn array_header(kind: &str, shape: &[usize; 2]) -> String {
    let second = if shape[1] == 0 {
        String::new()
    } else {
        shape[1].to_string()
    };
    format!(
        "{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}, {second})}}",
        shape[0]
    )
}

/// A member of an archive.
pub struct Member {
    name: String,
    packed: Vec<u8>,
    sum: u32,
    length: u32,
}

/// An array of zeros.
pub fn member(name: &str, head: &str, megabytes: usize) -> Member {
    let mut beginning = b"\x93NUMPY\x02\x00".to_vec();
    beginning.extend((head.len() as u32).to_le_bytes());
    beginning.extend(head.as_bytes());
    Member {
        name: format!("{name}.npy"),
        packed: zeros::deflated(&beginning, megabytes),
        sum: zeros::crc(&beginning, megabytes),
        length: (beginning.len() + megabytes * MEGABYTE) as u32,
    }
}

/// Returns the archive (PKWARE, APPNOTE.TXT 4.3.7, 4.3.12, 4.3.16).
pub fn archive(members: &[Member]) -> Vec<u8> {
    let (mut file, mut directory) = (Vec::new(), Vec::new());
    for of in members {
        let mut local_header = vec![20, 0, 0, 0, 8, 0, 0, 0, 0x21, 0];
        for number in [of.sum, of.packed.len() as u32, of.length] {
            local_header.extend(number.to_le_bytes());
        }
        local_header.extend((of.name.len() as u16).to_le_bytes());
        local_header.extend([0, 0]);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&local_header);
        directory.extend([0; 10]);
        directory.extend((file.len() as u32).to_le_bytes());
        directory.extend(of.name.as_bytes());
        file.extend(b"PK\x03\x04");
        file.extend(&local_header);
        file.extend(of.name.as_bytes());
        file.extend(&of.packed);
    }
    let (at, count) = (file.len() as u32, members.len() as u16);
    file.extend(&directory);
    file.extend(b"PK\x05\x06\0\0\0\0");
    for number in [count, count] {
        file.extend(number.to_le_bytes());
    }
    for number in [directory.len() as u32, at] {
        file.extend(number.to_le_bytes());
    }
    file.extend([0, 0]);
    file
}
