//! Complete state of a result as text: a restored result is identical to the original and can predict again.
//!
//! The numbers outside the state in the JSON object are meant for people and other programs; a model contains more
//! (covariances of quantities that are not printed, states, fixed parameters). The complete state is written as TOML,
//! which can represent infinity and NaN, whereas JSON cannot, and is stored as one string in the JSON object;
//! floating-point numbers are written with enough digits to restore every bit. The first eight bytes of its SHA-256
//! hash precede the text, so text that was truncated or edited by hand is rejected. The hash protects against damage,
//! not against deliberate forgery.

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;
use sha2::{Digest, Sha256};

use crate::AnalysisError;

/// Number of hexadecimal digits of the checksum.
const CHECKSUM_DIGITS: usize = 16;

/// Wrapper that makes a value of any type a TOML table.
#[derive(Serialize, Deserialize)]
struct Table<T> {
    value: T,
}

/// Serialises a value to text; `None` if this is not possible.
// Serialising to a table first halves the code that is generated for each type of result, compared with serialising
// directly to text.
pub fn serialise<T: Serialize>(value: &T) -> Option<String> {
    let text = toml::Table::try_from(Table { value }).ok()?.to_string();
    Some(format!("{}{text}", checksum(&text)))
}

/// Restores the value from a string written by [`serialise`].
///
/// # Errors
/// A message if the text was truncated or changed, or comes from another version.
pub fn read<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let (stated, text) = text.split_at_checked(CHECKSUM_DIGITS).ok_or("its state is truncated")?;
    if stated != checksum(text) {
        return Err("its state was truncated or changed after it was written".to_owned());
    }
    let version = env!("CARGO_PKG_VERSION");
    let table: Table<T> = text
        .parse()
        .and_then(toml::Table::try_into)
        .map_err(|error| format!("its state is from a version other than {version}: {}", error.message()))?;
    Ok(table.value)
}

/// Restores the value in the key `state` of the JSON object of a result of the given kind.
///
/// # Errors
/// [`AnalysisError::NotAResult`] if the text is invalid or damaged, or belongs to another kind or version.
pub fn restore_state<T: DeserializeOwned>(text: &str, kind: &str) -> Result<T, AnalysisError> {
    let none = |found: String| AnalysisError::NotAResult { found };
    let object: Value = serde_json::from_str(text).map_err(|error| none(format!("it is not JSON: {error}")))?;
    if object["kind"] != kind {
        return Err(none(format!("its kind is {}, expected {kind:?}", object["kind"])));
    }
    let state = object["state"].as_str();
    read(state.ok_or_else(|| none("it has no state".to_owned()))?).map_err(none)
}

fn checksum(text: &str) -> String {
    let bytes = Sha256::digest(text.as_bytes());
    bytes
        .iter()
        .take(CHECKSUM_DIGITS / 2)
        .map(|byte| format!("{byte:02x}"))
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn round_trip_is_bit_identical() {
        let numbers = [0.1, -0.0, 1.0 / 3.0, f64::INFINITY, f64::MIN_POSITIVE / 3.0];
        let back: Vec<f64> = read(&serialise(&numbers.to_vec()).unwrap()).unwrap();
        assert!(numbers.iter().zip(&back).all(|(a, b)| a.to_bits() == b.to_bits()));
        let nan: f64 = read(&serialise(&f64::NAN).unwrap()).unwrap();
        assert!(nan.is_nan());
    }

    #[test]
    fn damaged_state_is_refused() {
        let whole = serialise(&vec![1.0, 2.0]).unwrap();
        for text in ["", "0123", &whole[..whole.len() - 4], &whole.replacen("2", "3", 1)] {
            assert!(read::<Vec<f64>>(text).is_err(), "{text}");
        }
        assert!(read::<String>(&whole).unwrap_err().contains("a version other than"));
    }
}
