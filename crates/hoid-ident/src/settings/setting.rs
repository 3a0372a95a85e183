//! Known properties of an option.

use hoid_model::{NamedChoice, Structure};

use super::{
    kind::{Bounds, Kind},
    value::Value,
};
use crate::IdentError;

/// An option: name, type, unit, default, bounds, help.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name, with underscores: a keyword in Python, with hyphens a flag of the command line.
    pub name: &'static str,
    /// Type of its value.
    pub kind: Kind,
    /// Unit of its value; empty if it has none.
    pub unit: &'static str,
    /// Default as text, or as text; empty if nothing represents it.
    pub default: String,
    /// Bounds of its numbers.
    pub bounds: Bounds,
    /// Its behaviour, without a full stop.
    pub help: String,
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

    /// An option of a type that no value has by itself, without a default.
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

    /// With a default as text.
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
    /// One of the words of a choice, with hyphens or underscores.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] with the words that there are.
    pub fn word<T: NamedChoice>(&self, text: &str) -> Result<T, IdentError> {
        T::of_name(&text.replace('_', "-")).map_err(|_| {
            let words: Vec<&str> = T::CHOICES.iter().map(|choice| choice.choice_name()).collect();
            self.refused(text, &format!("one of {}", words.join(", ")))
        })
    }

    /// Refuses a text, with the expected value.
    pub fn refused(&self, text: &str, expected: &str) -> IdentError {
        IdentError::BadOption {
            option: self.name.to_owned(),
            found: text.to_owned(),
            expected: expected.to_owned(),
        }
    }

    /// Refuses it next to others, with the reason.
    pub fn error(&self, reason: impl Into<String>) -> IdentError {
        IdentError::Option {
            name: self.name,
            reason: reason.into(),
        }
    }
}

/// Known properties of an estimator or a recursive method.
#[derive(Debug, Clone, PartialEq)]
pub struct MethodSpec {
    /// Name as typed.
    pub name: &'static str,
    /// Its definition, in a line without a full stop.
    pub help: &'static str,
    /// Where it comes from in the literature.
    pub source: &'static str,
    /// The structures that it serves.
    pub structures: &'static [Structure],
    /// Its options.
    pub settings: Vec<Setting>,
}
