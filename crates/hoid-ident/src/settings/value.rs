//! Types of values, each with a single parser.

use std::collections::BTreeMap;

use hoid_core::{predictor::Regressor, recursion::StablePolynomials};

use super::kind::Kind;
use crate::{Constraint, Prior};

/// A type of value, with its kind, its parser and its text form.
pub trait Value: Sized {
    /// Type as shown to users.
    const KIND: Kind;

    /// Parses the text of a value.
    ///
    /// # Errors
    /// A description of the expected value.
    fn read(text: &str) -> Result<Self, String>;

    /// Returns the value as text; `None` if the value has no text form.
    fn text(&self) -> Option<String>;

    /// Returns the numbers in the value, which are checked against the bounds.
    fn numbers(&self) -> Vec<f64> {
        Vec::new()
    }
}

impl Value for bool {
    const KIND: Kind = Kind::Flag;

    fn read(text: &str) -> Result<Self, String> {
        text.parse().map_err(|_| "true or false".to_owned())
    }

    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }
}

impl Value for usize {
    const KIND: Kind = Kind::Count;

    fn read(text: &str) -> Result<Self, String> {
        text.parse().map_err(|_| "a whole number".to_owned())
    }

    fn text(&self) -> Option<String> {
        Some(self.to_string())
    }

    fn numbers(&self) -> Vec<f64> {
        vec![*self as f64]
    }
}

impl Value for f64 {
    const KIND: Kind = Kind::Number;

    fn read(text: &str) -> Result<Self, String> {
        let number = text.parse::<Self>().ok().filter(|x| !x.is_nan());
        number.ok_or_else(|| "a number".to_owned())
    }

    fn text(&self) -> Option<String> {
        // Prefers 1e6 to 1000000.
        let (plain, short) = (self.to_string(), format!("{self:e}"));
        Some(if short.len() < plain.len() { short } else { plain })
    }

    fn numbers(&self) -> Vec<f64> {
        vec![*self]
    }
}

impl Value for String {
    const KIND: Kind = Kind::Channel;

    fn read(text: &str) -> Result<Self, String> {
        match text.is_empty() {
            true => Err("a name".to_owned()),
            false => Ok(text.to_owned()),
        }
    }

    fn text(&self) -> Option<String> {
        Some(self.clone())
    }
}

impl<V: Value> Value for Option<V> {
    const KIND: Kind = V::KIND;

    fn read(text: &str) -> Result<Self, String> {
        V::read(text).map(Some)
    }

    fn text(&self) -> Option<String> {
        self.as_ref()?.text()
    }

    fn numbers(&self) -> Vec<f64> {
        self.as_ref().map(V::numbers).unwrap_or_default()
    }
}

/// A span `LO..HI` of finite numbers in order.
impl Value for (f64, f64) {
    const KIND: Kind = Kind::Span;

    fn read(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let ends = text.split_once("..").and_then(|(a, b)| Some((number(a)?, number(b)?)));
        ends.filter(|(low, high)| low <= high)
            .ok_or_else(|| "LO..HI with LO <= HI, such as 0.05..0.6".to_owned())
    }

    fn text(&self) -> Option<String> {
        Some(format!("{}..{}", self.0, self.1))
    }

    fn numbers(&self) -> Vec<f64> {
        vec![self.0, self.1]
    }
}

/// Bounds `LO..HI` of a parameter, where either end may be missing.
impl Value for Constraint {
    const KIND: Kind = Kind::OpenSpan;

    fn read(text: &str) -> Result<Self, String> {
        let end = |part: &str, open: f64| match part.trim() {
            "" => Some(open),
            text => text.parse::<f64>().ok().filter(|x| !x.is_nan()),
        };
        let ends = text.split_once("..");
        ends.and_then(|(low, high)| Some((end(low, f64::NEG_INFINITY)?, end(high, f64::INFINITY)?)))
            .filter(|(low, high)| low <= high)
            .map(|(low, high)| Self::Between(low, high))
            .ok_or_else(|| "LO..HI; either end may be omitted".to_owned())
    }

    fn text(&self) -> Option<String> {
        let (low, high) = self.limits();
        let end = |x: f64| if x.is_finite() { x.to_string() } else { String::new() };
        Some(format!("{}..{}", end(low), end(high)))
    }
}

/// A guess and its weight, `VALUE:WEIGHT`.
impl Value for Prior {
    const KIND: Kind = Kind::Guess;

    fn read(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let parts = text.split_once(':');
        parts
            .and_then(|(value, weight)| Some((number(value)?, number(weight)?)))
            .filter(|(_, weight)| *weight >= 0.0)
            .map(|(value, weight)| Self { value, weight })
            .ok_or_else(|| "VALUE:WEIGHT with a nonnegative weight".to_owned())
    }

    fn text(&self) -> Option<String> {
        Some(format!("{}:{}", self.value, self.weight))
    }
}

/// Names separated by commas, such as `K,T_L`.
impl Value for Vec<String> {
    const KIND: Kind = Kind::Names;

    fn read(text: &str) -> Result<Self, String> {
        let names: Self = text.split(',').map(|name| name.trim().to_owned()).collect();
        match names.iter().any(String::is_empty) {
            true => Err("NAME,NAME,...".to_owned()),
            false => Ok(names),
        }
    }

    fn text(&self) -> Option<String> {
        (!self.is_empty()).then(|| self.join(","))
    }
}

/// Parses `NAME=VALUE,NAME=VALUE`; each name may occur once.
///
/// # Errors
/// A description of the expected value.
pub fn parse_named_pairs(text: &str) -> Result<Vec<(String, String)>, String> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for item in text.split(',').map(str::trim).filter(|item| !item.is_empty()) {
        let (name, value) = item
            .split_once('=')
            .map(|(name, value)| (name.trim(), value.trim()))
            .filter(|(name, value)| !name.is_empty() && !value.is_empty())
            .ok_or_else(|| format!("NAME=VALUE in place of {item:?}"))?;
        if pairs.iter().any(|(known, _)| known == name) {
            return Err(format!("each name once; {name} is given twice"));
        }
        pairs.push((name.to_owned(), value.to_owned()));
    }
    match pairs.is_empty() {
        true => Err("NAME=VALUE,NAME=VALUE,...".to_owned()),
        false => Ok(pairs),
    }
}

impl<V: Value> Value for BTreeMap<String, V> {
    const KIND: Kind = Kind::Named(&V::KIND);

    fn read(text: &str) -> Result<Self, String> {
        let value = |(name, text): (String, String)| match V::read(&text) {
            Ok(value) => Ok((name, value)),
            Err(expected) => Err(format!("for {name}: {expected}")),
        };
        parse_named_pairs(text)?.into_iter().map(value).collect()
    }

    fn text(&self) -> Option<String> {
        let each: Vec<String> = self
            .iter()
            .filter_map(|(name, value)| Some(format!("{name}={}", value.text()?)))
            .collect();
        (!each.is_empty()).then(|| each.join(","))
    }

    fn numbers(&self) -> Vec<f64> {
        self.values().flat_map(V::numbers).collect()
    }
}

/// Parses one word of a list; the words of a second list are also accepted.
fn parse_word<T: Copy>(text: &str, words: &[(&str, T)], others: &[(&str, T)]) -> Result<T, String> {
    let plain = text.to_ascii_lowercase().replace('_', "-");
    let known = || words.iter().map(|(word, _)| *word).collect::<Vec<_>>().join(", ");
    words
        .iter()
        .chain(others)
        .find(|(word, _)| *word == plain)
        .map(|(_, value)| *value)
        .ok_or_else(|| format!("one of {}", known()))
}

/// Implements [`Value`] for an enum as a choice of words.
macro_rules! choices {
    ($target:ty { $($word:literal = $value:path),+ $(,)? } $(also { $($alias:literal = $other:path),+ })?) => {
        impl Value for $target {
            const KIND: Kind = Kind::Choice(&[$($word),+]);

            fn read(text: &str) -> Result<Self, String> {
                parse_word(text, &[$(($word, $value)),+], &[$($(($alias, $other)),+)?])
            }

            fn text(&self) -> Option<String> {
                Some(match self { $($value => $word),+ }.to_owned())
            }
        }
    };
}

choices!(Regressor { "gradient" = Regressor::Gradient, "cascade" = Regressor::Cascade, "pseudo-linear" = Regressor::PseudoLinear });
choices!(StablePolynomials { "predictor" = StablePolynomials::Predictor, "noise" = StablePolynomials::PredictorAndNoise } also { "predictor-and-noise" = StablePolynomials::PredictorAndNoise });

#[cfg(test)]
mod tests {
    use super::*;

    /// A value that is written and parsed again is unchanged.
    fn assert_round_trip<V: Value + PartialEq + std::fmt::Debug>(text: &str, value: V) {
        assert_eq!(V::read(text), Ok(value));
        let read = V::read(text).ok().and_then(|v| v.text()).unwrap_or_default();
        assert_eq!(V::read(&read), V::read(text), "{text} {read}");
    }

    #[test]
    fn value_text_round_trips() {
        assert_round_trip("true", true);
        assert_round_trip("17", 17_usize);
        assert_round_trip("0.1", 0.1);
        assert_round_trip("1e6", 1e6);
        assert_round_trip("inf", f64::INFINITY);
        assert_round_trip("-3..4.5", (-3.0, 4.5));
        assert_round_trip("5..", Constraint::Between(5.0, f64::INFINITY));
        assert_round_trip("..0.99", Constraint::Between(f64::NEG_INFINITY, 0.99));
        assert_round_trip(
            "-1.9:0.5",
            Prior {
                value: -1.9,
                weight: 0.5,
            },
        );
        assert_round_trip("K, T_L", vec!["K".to_owned(), "T_L".to_owned()]);
        assert_round_trip("noise", StablePolynomials::PredictorAndNoise);
        assert_round_trip(
            "K_e=0.01, f1=2",
            BTreeMap::from([("K_e".to_owned(), 0.01), ("f1".to_owned(), 2.0)]),
        );
        assert_round_trip("2", Some(2_usize));
        assert_eq!(1e6.text().as_deref(), Some("1e6"));
        assert_eq!(None::<f64>.text(), None);
    }

    #[test]
    fn invalid_values_are_refused_with_the_expected_format() {
        assert!(bool::read("yes").is_err() && usize::read("-1").is_err() && f64::read("nan").is_err());
        assert!(<(f64, f64)>::read("3..1").is_err() && <(f64, f64)>::read("1").is_err());
        assert!(Constraint::read("5").is_err() && Constraint::read("5..1").is_err());
        for bad in ["-1.9", "-1.9:-1", ":1", "1:inf"] {
            assert!(Prior::read(bad).is_err(), "{bad}");
        }
        assert!(Vec::<String>::read("K,,T_L").is_err());
        assert_eq!(
            StablePolynomials::read("all"),
            Err("one of predictor, noise".to_owned())
        );
        let named = |text| BTreeMap::<String, f64>::read(text);
        assert!(named("").is_err() && named("b0").is_err() && named("b0=1,b0=2").is_err());
        assert_eq!(named("b0=x"), Err("for b0: a number".to_owned()));
    }
}
