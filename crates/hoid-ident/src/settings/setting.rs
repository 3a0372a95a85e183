//! Description of an option.

use hoid_model::{NamedChoice, Structure};

use super::{
    kind::{Bounds, Kind},
    value::Value,
};
use crate::IdentError;

/// An option: name, type, unit, default, bounds, help.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name, with underscores: a keyword in Python, and with hyphens a flag of the command line.
    pub name: &'static str,
    /// Type of its value.
    pub kind: Kind,
    /// Unit of its value; empty if it has none.
    pub unit: &'static str,
    /// Default as text, or a description of it; empty if there is none.
    pub default: String,
    /// Bounds of its numbers.
    pub bounds: Bounds,
    /// Description, without a full stop.
    pub help: String,
}

impl Setting {
    /// Creates an option of the type of its default.
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

    /// Creates an option of an explicit type, without a default.
    pub fn new(name: &'static str, kind: Kind, help: &str) -> Self {
        Self {
            name,
            kind,
            unit: "",
            default: String::new(),
            bounds: Bounds::Any,
            help: help.to_owned(),
        }
    }

    /// Returns the option with a name other than that of its field.
    pub fn name(self, name: &'static str) -> Self {
        Self { name, ..self }
    }

    /// Returns the option with a unit.
    pub fn unit(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// Returns the option with bounds.
    pub fn bounds(self, bounds: Bounds) -> Self {
        Self { bounds, ..self }
    }

    /// Returns the option with a default as text.
    pub fn default(self, words: &str) -> Self {
        Self {
            default: words.to_owned(),
            ..self
        }
    }

    /// Returns the option with help: the lines of a comment.
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
    /// [`IdentError::BadOption`] for a text that is invalid, or out of the bounds.
    pub fn read<V: Value>(&self, text: &str) -> Result<V, IdentError> {
        let bad = |expected: String| self.refused(text, &expected);
        let value = V::read(text.trim()).map_err(bad)?;
        match value.numbers().into_iter().all(|x| self.bounds.hold(x)) {
            true => Ok(value),
            false => Err(bad(self.bounds.to_string())),
        }
    }
}

impl Setting {
    /// Reads one of the words of a choice, with hyphens or underscores.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] with the available words.
    pub fn word<T: NamedChoice>(&self, text: &str) -> Result<T, IdentError> {
        T::of_name(&text.replace('_', "-")).map_err(|_| {
            let words: Vec<&str> = T::CHOICES.iter().map(|choice| choice.choice_name()).collect();
            self.refused(text, &format!("one of {}", words.join(", ")))
        })
    }

    /// Returns the error for an invalid text, with the expected value.
    pub fn refused(&self, text: &str, expected: &str) -> IdentError {
        IdentError::BadOption {
            option: self.name.to_owned(),
            found: text.to_owned(),
            expected: expected.to_owned(),
        }
    }

    /// Returns the error for a contradiction with other options, with the reason.
    pub fn error(&self, reason: impl Into<String>) -> IdentError {
        IdentError::Option {
            name: self.name,
            reason: reason.into(),
        }
    }
}

/// Description of an estimator or a recursive method.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodSpec {
    /// Name as typed.
    pub name: &'static str,
    /// Description, in a line without a full stop.
    pub help: &'static str,
    /// Source in the literature.
    pub source: &'static str,
    /// The structures for which it is valid.
    pub structures: &'static [Structure],
    /// Its options.
    pub settings: Vec<Setting>,
}
