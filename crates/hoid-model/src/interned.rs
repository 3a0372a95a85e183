//! Names that live as long as the program, of results that are read again.
//!
//! Kinds of findings and units are literals of the program (`&'static str`). In a result that was written by
//! another version may stand one that this program does not have: it is kept once, in a set that only grows.
//! What is no such name (long, or one too many) is refused, so that no file can fill the memory.

use std::{
    collections::BTreeSet,
    sync::{LazyLock, Mutex, PoisonError},
};

use serde::{Deserialize, Deserializer, de::Error};

/// A name, under another type than a reference: those serde would borrow from what it reads.
pub type Name = &'static str;

/// Bytes of the longest name.
const LONGEST: usize = 64;
/// Names that are kept at most.
const MOST: usize = 10_000;

static NAMES: LazyLock<Mutex<BTreeSet<Name>>> = LazyLock::new(Mutex::default);

/// The name as a literal; `None` for one that is too long, or one too many.
pub fn interned(name: &str) -> Option<Name> {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return Some(known);
    }
    if name.len() > LONGEST || names.len() >= MOST {
        return None;
    }
    let kept: Name = Box::leak(name.into());
    names.insert(kept);
    Some(kept)
}

/// Reads a name: `#[serde(deserialize_with = "hoid_model::interned::name")]`.
///
/// # Errors
/// The errors of the reader, and for a name that is too long.
pub fn name<'de, D: Deserializer<'de>>(reader: D) -> Result<Name, D::Error> {
    let text = String::deserialize(reader)?;
    interned(&text).ok_or_else(|| {
        D::Error::custom(format!(
            "found a name of {} bytes, expected {LONGEST} at most",
            text.len()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_kept_once_and_a_text_is_none() {
        let typed: String = ["delay", "at", "bound"].join("-");
        let (one, two) = (interned("delay-at-bound"), interned(&typed));
        assert_eq!(one, Some("delay-at-bound"));
        assert_eq!(one.map(str::as_ptr), two.map(str::as_ptr));
        assert_eq!(interned(&"x".repeat(65)), None);
    }
}
