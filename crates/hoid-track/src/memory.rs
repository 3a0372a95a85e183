//! Memory length: the time in which the weight of an observation falls to 1/e.

use std::{collections::BTreeMap, str::FromStr};

use hoid_ident::{
    IdentError, settings,
    settings::{Bounds, Kind, Setting, Settings, Value},
};
use hoid_model::SampleTime;

/// Memory length: the time in which the weight of an observation falls to 1/e.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Memory {
    /// N samples: `lambda = 1 - 1/N`.
    Samples(f64),
    /// T seconds: `lambda = 1 - Ts/T`. (`exp(-Ts/T)` agrees to first order.)
    Seconds(f64),
    /// Infinite: `lambda = 1`.
    Infinite,
}

impl Memory {
    /// Returns the forgetting factor lambda.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] unless the memory is longer than one sample.
    pub fn lambda(self, sample_time: SampleTime) -> Result<f64, IdentError> {
        match self {
            Self::Infinite => Ok(1.0),
            _ => Ok(1.0 - 1.0 / self.length(sample_time)?),
        }
    }

    /// Returns the length, in samples, of a window that is as long as the memory.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for an infinite memory, or one not longer than one sample.
    pub fn window_samples(self, sample_time: SampleTime) -> Result<usize, IdentError> {
        Ok(self.length(sample_time)?.round() as usize)
    }

    fn length(self, sample_time: SampleTime) -> Result<f64, IdentError> {
        let samples = match self {
            Self::Samples(n) => n,
            Self::Seconds(t) => t / sample_time.s(),
            Self::Infinite => f64::INFINITY,
        };
        // A window of more than 1e9 samples would not fit in memory.
        if samples > 1.0 && samples <= 1e9 {
            Ok(samples)
        } else {
            Err(IdentError::BadOption {
                option: "the memory".to_owned(),
                found: format!("{samples} samples"),
                expected: "more than one sample and at most 1e9, or inf to forget nothing".to_owned(),
            })
        }
    }
}

/// Parses `256` (samples), `2.56s`, or `inf`.
impl Value for Memory {
    const KIND: Kind = Kind::Memory;

    fn read(text: &str) -> Result<Self, String> {
        let trimmed = text.trim();
        if ["inf", "infinite"]
            .iter()
            .any(|word| trimmed.eq_ignore_ascii_case(word))
        {
            return Ok(Self::Infinite);
        }
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        let memory = match trimmed.strip_suffix('s') {
            Some(seconds) => number(seconds).filter(|s| *s > 0.0).map(Self::Seconds),
            None => number(trimmed).filter(|n| *n > 1.0).map(Self::Samples),
        };
        memory.ok_or_else(|| "more than 1 sample (256), seconds (2.56s) or inf".to_owned())
    }

    fn text(&self) -> Option<String> {
        match self {
            Self::Samples(n) => n.text(),
            Self::Seconds(s) => Some(format!("{s}s")),
            Self::Infinite => Some("inf".to_owned()),
        }
    }
}

impl FromStr for Memory {
    type Err = IdentError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        Setting::of("the memory", &Self::Infinite).read(text)
    }
}

/// The memory of all parameters, given directly or by its forgetting factor.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CommonMemory(pub Option<Memory>);

impl CommonMemory {
    fn memory_setting() -> Setting {
        Setting::of("memory", &None::<Memory>).help(&[
            "Memory of all parameters, after which the weight of a sample is 1/e:",
            "samples (256), seconds (2.56s) or inf",
        ])
    }

    fn factor_setting() -> Setting {
        Setting::of("lambda", &None::<f64>)
            .bounds(Bounds::UpTo(0.0, 1.0))
            .help(&["Forgetting factor instead of a memory: lambda = 1 - 1/N for a memory of N samples"])
    }
}

impl Settings for CommonMemory {
    fn list(&self) -> Vec<Setting> {
        vec![Self::memory_setting(), Self::factor_setting()]
    }

    fn set(&mut self, name: &str, text: &str) -> Result<bool, IdentError> {
        let memory = match name {
            "memory" => Self::memory_setting().read(text)?,
            "lambda" => match Self::factor_setting().read::<f64>(text)? {
                1.0 => Memory::Infinite,
                lambda => Memory::Samples(1.0 / (1.0 - lambda)),
            },
            _ => return Ok(false),
        };
        if self.0.is_some() {
            return Err(IdentError::BadOption {
                option: name.to_owned(),
                found: "memory and lambda".to_owned(),
                expected: "one of them".to_owned(),
            });
        }
        self.0 = Some(memory);
        Ok(true)
    }

    fn get(&self, name: &str) -> Option<String> {
        (name == "memory").then(|| self.0.text()).flatten()
    }
}

settings! {
    /// Memories of a recursion that forgets.
    pub struct MemoryOptions {
        /// Memory of individual parameters, or of all parameters with one letter, such as b0=256,f=inf,K_e=5s
        pub memory_of: BTreeMap<String, Memory> = BTreeMap::new(),
    }
    groups {
        /// Memory of all parameters.
        pub memory: CommonMemory,
    }
}

impl MemoryOptions {
    /// Returns options with the same memory for all parameters.
    pub fn common(memory: Memory) -> Self {
        Self {
            memory: CommonMemory(Some(memory)),
            ..Self::default()
        }
    }

    /// Returns the given memory of a parameter: by its name, by the letter of its polynomial, or for all parameters.
    /// `None` if no memory was given.
    pub(crate) fn given_memory(&self, name: &str) -> Option<Memory> {
        let by_letter = self.memory_of.iter().find(|(key, _)| is_named(name, key));
        let by_letter = by_letter.map(|(_, memory)| *memory);
        self.memory_of.get(name).copied().or(by_letter).or(self.memory.0)
    }

    /// Returns the first name with a memory that is neither a parameter nor the letter of a polynomial.
    pub(crate) fn unknown_name(&self, names: &[String]) -> Option<&String> {
        let known = |key: &String| names.iter().any(|name| is_named(name, key));
        self.memory_of.keys().find(|key| !known(key))
    }
}

/// True if `key` is the name of the parameter, or the letter of its polynomial.
fn is_named(name: &str, key: &str) -> bool {
    name == key || (key.len() == 1 && name.starts_with(key) && name[1..].bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn lambda_sets_the_memory_and_excludes_the_memory_option() {
        let mut options = MemoryOptions::default();
        assert!(options.set("lambda", "0.75").unwrap());
        assert_eq!(options.memory.0, Some(Memory::Samples(4.0)));
        assert!(options.set("memory", "256").is_err());
        for bad in ["0", "1.1", "-1", "x", "NaN"] {
            assert!(MemoryOptions::default().set("lambda", bad).is_err(), "{bad}");
        }
        let mut options = MemoryOptions::default();
        assert!(options.set("memory_of", "b=256, f1=inf").unwrap());
        assert_eq!(
            (
                options.given_memory("b1"),
                options.given_memory("f1"),
                options.given_memory("f2")
            ),
            (Some(Memory::Samples(256.0)), Some(Memory::Infinite), None)
        );
    }

    #[test]
    fn memory_text_is_parsed() {
        assert_eq!("256".parse::<Memory>().unwrap(), Memory::Samples(256.0));
        assert_eq!("2.56s".parse::<Memory>().unwrap(), Memory::Seconds(2.56));
        assert_eq!("Inf".parse::<Memory>().unwrap(), Memory::Infinite);
        for bad in ["", "0", "1", "-5", "nan", "0s", "s", "-infs", "2m"] {
            assert!(bad.parse::<Memory>().is_err(), "{bad}");
        }
    }
}
