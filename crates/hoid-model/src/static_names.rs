//! Names with static lifetime, for results that are read from files.
//!
//! Kinds of findings and units are literals of the program (`&'static str`). A result written by another version may
//! contain a name that this program does not have. Such a name is stored once, in a set that only grows. The length and
//! the number of these names are limited, so no file can exhaust the memory.

use std::{
    collections::BTreeSet,
    sync::{LazyLock, Mutex, PoisonError},
};

use serde::{Deserialize, Deserializer, de::Error};

/// Name of a finding or a unit. It is a type alias because serde would try to borrow a plain reference from its input.
pub type Name = &'static str;

/// Maximum length of a stored name in bytes.
const MAX_NAME_BYTES: usize = 64;
/// Largest number of stored names.
const MAX_NAMES: usize = 10_000;

static NAMES: LazyLock<Mutex<BTreeSet<Name>>> = LazyLock::new(Mutex::default);

/// Returns the name with static lifetime; `None` if the name is too long, or if too many names are stored.
pub fn interned(name: &str) -> Option<Name> {
    let mut names = NAMES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(known) = names.get(name) {
        return Some(known);
    }
    if name.len() > MAX_NAME_BYTES || names.len() >= MAX_NAMES {
        return None;
    }
    let kept: Name = Box::leak(name.into());
    names.insert(kept);
    Some(kept)
}

/// Reads a name; for use as `#[serde(deserialize_with = "hoid_model::static_names::name")]`.
///
/// # Errors
/// The errors of the deserializer, and an error for a name that cannot be stored ([`interned`]).
pub fn name<'de, D: Deserializer<'de>>(reader: D) -> Result<Name, D::Error> {
    let text = String::deserialize(reader)?;
    interned(&text).ok_or_else(|| {
        D::Error::custom(format!(
            "found a name of {} bytes, expected at most {MAX_NAME_BYTES}",
            text.len()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn name_is_interned_once_and_long_text_is_refused() {
        let typed: String = ["delay", "at", "bound"].join("-");
        let (one, two) = (interned("delay-at-bound"), interned(&typed));
        assert_eq!(one, Some("delay-at-bound"));
        assert_eq!(one.map(str::as_ptr), two.map(str::as_ptr));
        assert_eq!(interned(&"x".repeat(65)), None);
    }
}
