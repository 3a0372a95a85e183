//! Files that were damaged on purpose, and what each reader has to make of them: values, or an error
//! as text, within a second and 300 MB, and never a panic.
//!
//! Case `k` of a seed is the same bytes on every machine: a good file is drawn, then some mutations
//! of it. Formats that keep checksums over what is compressed are taken apart first and packed
//! again, for damage after a wrong checksum would only try the checksum.
//!
//! | file | contents |
//! |---|---|
//! | `draw` | numbers that look like chance, from a seed |
//! | `originals` | the good files |
//! | `inside` | what is packed in them, out and in |
//! | `mutate` | the mutations |
//! | `readers` | all readers over one file, and what must hold |
//! | `spent` | what a case costs |

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
    /// The extension that its reader goes by.
    pub extension: &'static str,
    /// What was damaged.
    pub name: String,
    /// The damaged bytes.
    pub bytes: Vec<u8>,
    /// Chooses among the options of the readers.
    pub choice: u64,
}

/// The case of a number.
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
