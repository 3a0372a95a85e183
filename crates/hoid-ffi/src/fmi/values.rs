//! Parameters and inputs of a unit by name.

use hoid_io::fmu::{FmuStart, FmuVariable};

/// Result of an action, or the reason why it failed.
pub(super) type FmiResult<T = ()> = Result<T, String>;

/// Values of variables, by name.
pub(super) struct VariableValues<'a> {
    pub variables: &'a [FmuVariable],
    pub values: &'a [FmuStart],
}

impl VariableValues<'_> {
    fn value(&self, name: &str) -> Option<&FmuStart> {
        let index = self.variables.iter().position(|variable| variable.name == name)?;
        self.values.get(index)
    }

    pub fn real(&self, name: &str) -> f64 {
        match self.value(name) {
            Some(FmuStart::Real(value)) => *value,
            _ => f64::NAN,
        }
    }

    pub fn text(&self, name: &str) -> &str {
        match self.value(name) {
            Some(FmuStart::Text(text)) => text.trim(),
            _ => "",
        }
    }

    pub fn is(&self, name: &str) -> bool {
        matches!(self.value(name), Some(FmuStart::Boolean(true)))
    }

    pub fn count(&self, name: &str) -> u64 {
        match self.value(name) {
            Some(FmuStart::Integer(value)) => u64::from(value.cast_unsigned()),
            _ => 0,
        }
    }
}
