//! Description of an option.

use hoid_model::{NamedChoice, Structure};

use super::{
    kind::{Bounds, Kind},
    value::Value,
};
use crate::IdentError;

/// Description of an option: name, type, unit, default, bounds and help text.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Name with underscores, which is the keyword argument in Python and, with hyphens, the flag of the command line.
    pub name: &'static str,
    /// Type of the value.
    pub kind: Kind,
    /// Unit of the value; empty if it has none.
    pub unit: &'static str,
    /// Default as text, or a description of it; empty if there is none.
    pub default: String,
    /// Bounds of the numbers in the value.
    pub bounds: Bounds,
    /// Help text, without a full stop.
    pub help: String,
}

impl Setting {
    /// Creates an option with this default; its type follows from the default.
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

    /// Creates an option with an explicit type and without a default.
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

    /// Returns the option with a name that differs from the name of its field.
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

    /// Returns the option with this text as default.
    pub fn default(self, words: &str) -> Self {
        Self {
            default: words.to_owned(),
            ..self
        }
    }

    /// Returns the option with a help text, which is given as the lines of a comment.
    pub fn help(self, lines: &[&str]) -> Self {
        let lines: Vec<&str> = lines.iter().map(|line| line.trim()).collect();
        Self {
            help: lines.join(" "),
            ..self
        }
    }

    /// Parses a value of the option and checks its bounds.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] if the text is invalid or the value is out of bounds.
    pub fn read<V: Value>(&self, text: &str) -> Result<V, IdentError> {
        let bad = |expected: String| self.invalid_value(text, &expected);
        let value = V::read(text.trim()).map_err(bad)?;
        match value.numbers().into_iter().all(|x| self.bounds.contains(x)) {
            true => Ok(value),
            false => Err(bad(self.bounds.to_string())),
        }
    }
}

impl Setting {
    /// Parses one word of a choice, written with hyphens or underscores.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] with the available words if the text is none of them.
    pub fn parse_choice<T: NamedChoice>(&self, text: &str) -> Result<T, IdentError> {
        T::from_name(&text.replace('_', "-")).map_err(|_| {
            let words: Vec<&str> = T::CHOICES.iter().map(|choice| choice.choice_name()).collect();
            self.invalid_value(text, &format!("one of {}", words.join(", ")))
        })
    }

    /// Returns the error for an invalid text; `expected` describes a valid value.
    pub fn invalid_value(&self, text: &str, expected: &str) -> IdentError {
        IdentError::BadOption {
            option: self.name.to_owned(),
            found: text.to_owned(),
            expected: expected.to_owned(),
        }
    }

    /// Returns the error for a contradiction with other options, for the given reason.
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
    /// Name as typed by users.
    pub name: &'static str,
    /// Description in one line, without a full stop.
    pub help: &'static str,
    /// Source in the literature.
    pub source: &'static str,
    /// Structures for which the method is valid.
    pub structures: &'static [Structure],
    /// Options of the method.
    pub settings: Vec<Setting>,
}
