//! Damaged files, and the required result of each reader: values, or an error message, within a
//! second and 300 MB, and never a panic.
//!
//! Case `k` of a seed has the same bytes on every machine: a valid file is drawn, and then mutations of this file.
//! Formats with checksums over compressed data are unpacked first and packed again, since otherwise only the checksum
//! would be tested.
//!
//! | file | contents |
//! |---|---|
//! | `draw` | pseudo-random numbers from a seed |
//! | `originals` | the valid files |
//! | `inside` | decompression and compression of their contents |
//! | `mutate` | the mutations |
//! | `readers` | all readers applied to one file, and the required properties |
//! | `spent` | cost of a case |

pub mod draw;
pub mod inside;
pub mod mutate;
pub mod originals;
pub mod readers;
pub mod spent;

use draw::Draw;
use mutate::mutated;
use originals::Original;

/// A damaged file.
pub struct Case {
    /// The extension that determines its reader.
    pub extension: &'static str,
    /// Description of the damage.
    pub name: String,
    /// The damaged bytes.
    pub bytes: Vec<u8>,
    /// Selects the options of the readers.
    pub choice: u64,
}

/// Returns the case with this number.
pub fn case(originals: &[Original], seed: u64, number: u64) -> Case {
    let mut draw = Draw::new(seed, number);
    let original = &originals[draw.below(originals.len())];
    let same: Vec<&Original> = originals.iter().filter(|o| o.extension == original.extension).collect();
    let other = same[draw.below(same.len())];
    Case {
        extension: original.extension,
        name: original.name.clone(),
        bytes: mutated(original, other, &mut draw),
        choice: draw.bits(),
    }
}
