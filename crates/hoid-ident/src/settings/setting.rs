//! What is known of an option.

use std::fmt;

use hoid_model::Structure;

use super::Value;
use crate::IdentError;

/// An option: name, type, unit, default, bounds, help.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name, with underscores: a keyword in Python, with hyphens a flag of the command line.
    pub name: &'static str,
    /// Type of its value.
    pub kind: Kind,
    /// Unit of its value; empty where it has none.
    pub unit: &'static str,
    /// Default as text, or in words; empty where nothing stands for it.
    pub default: String,
    /// What its numbers may be.
    pub bounds: Bounds,
    /// What it does, without a full stop.
    pub help: String,
}

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Yes or no.
    Flag,
    /// A whole number.
    Count,
    /// A number; `inf` where the bounds allow it.
    Number,
    /// Samples (`256`), seconds (`2.56s`) or `inf`.
    Memory,
    /// `LO..HI`, two finite numbers in order.
    Span,
    /// `LO..HI`, of which either end may be left out.
    OpenSpan,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// Name of a channel.
    Channel,
    /// Values of a type by name, as `b0=256,f=inf`.
    Named(&'static Kind),
}

/// What numbers may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    /// Any number.
    Any,
    /// More than zero, finite or not.
    Positive,
    /// More than zero and finite.
    PositiveFinite,
    /// At least zero and finite.
    NonNegative,
    /// At least this, and finite.
    AtLeast(f64),
    /// More than the first and less than the second.
    Between(f64, f64),
    /// More than the first, and at most the second.
    UpTo(f64, f64),
}

impl Bounds {
    /// True for a number within them.
    pub fn hold(self, x: f64) -> bool {
        match self {
            Self::Any => !x.is_nan(),
            Self::Positive => x > 0.0,
            Self::PositiveFinite => x > 0.0 && x.is_finite(),
            Self::NonNegative => x >= 0.0 && x.is_finite(),
            Self::AtLeast(least) => x >= least && x.is_finite(),
            Self::Between(low, high) => x > low && x < high,
            Self::UpTo(low, high) => x > low && x <= high,
        }
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => f.write_str("a number"),
            Self::Positive => f.write_str("a positive number, or inf"),
            Self::PositiveFinite => f.write_str("a positive finite number"),
            Self::NonNegative => f.write_str("a finite number of zero or more"),
            Self::AtLeast(least) => write!(f, "{least} or more"),
            Self::Between(low, high) => write!(f, "more than {low} and less than {high}"),
            Self::UpTo(low, high) => write!(f, "more than {low} and at most {high}"),
        }
    }
}

impl Setting {
    /// An option of the type of its default.
    pub fn of<V: Value>(name: &'static str, default: &V) -> Self {
        Self {
            name,
            kind: V::KIND,
            unit: "",
            default: default.text().unwrap_or_default(),
            bounds: Bounds::Any,
            help: String::new(),
        }
    }

    /// With another name than its field.
    pub fn name(self, name: &'static str) -> Self {
        Self { name, ..self }
    }

    /// With a unit.
    pub fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// With bounds.
    pub fn bounds(self, bounds: Bounds) -> Self {
        Self { bounds, ..self }
    }

    /// With a default in words.
    pub fn default(self, words: &str) -> Self {
        Self {
            default: words.to_owned(),
            ..self
        }
    }

    /// With help: lines of a comment.
    pub fn help(self, lines: &[&str]) -> Self {
        let lines: Vec<&str> = lines.iter().map(|line| line.trim()).collect();
        Self {
            help: lines.join(" "),
            ..self
        }
    }

    /// Reads a value.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a text that is none, or out of the bounds.
    pub fn read<V: Value>(&self, text: &str) -> Result<V, IdentError> {
        let bad = |expected: String| IdentError::BadOption {
            option: self.name.to_owned(),
            found: text.to_owned(),
            expected,
        };
        let value = V::read(text.trim()).map_err(bad)?;
        match value.numbers().into_iter().all(|x| self.bounds.hold(x)) {
            true => Ok(value),
            false => Err(bad(self.bounds.to_string())),
        }
    }
}

/// What is known of an estimator or a recursive method.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodSpec {
    /// Name as typed.
    pub name: &'static str,
    /// What it is, in a line without a full stop.
    pub help: &'static str,
    /// Where it comes from in the literature.
    pub source: &'static str,
    /// The structures that it serves.
    pub structures: &'static [Structure],
    /// Its options.
    pub settings: Vec<Setting>,
}
