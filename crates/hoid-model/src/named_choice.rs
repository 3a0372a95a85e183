//! Choices with names that users type: on the command line, in files and in Python.

use thiserror::Error;

/// A choice with a name that users type. The macro [`named_choice!`](crate::named_choice) implements it.
pub trait NamedChoice: Copy + PartialEq + Sized + 'static {
    /// Kind of the choice in messages, such as "structure".
    const KIND: &'static str;
    /// All choices, in the order in which they are listed.
    const CHOICES: &'static [Self];

    /// Returns the name that users type.
    fn choice_name(self) -> &'static str;

    /// Returns the choice with the given name, which is compared case-insensitively.
    ///
    /// # Errors
    /// [`UnknownName`], which lists the available names.
    fn from_name(name: &str) -> Result<Self, UnknownName> {
        let name = name.trim();
        let known = |choice: &&Self| choice.choice_name().eq_ignore_ascii_case(name);
        Self::CHOICES.iter().find(known).copied().ok_or_else(|| {
            let names: Vec<&str> = Self::CHOICES.iter().map(|choice| choice.choice_name()).collect();
            let expected = match names.as_slice() {
                [others @ .., last] if !others.is_empty() => format!("{} or {last}", others.join(", ")),
                names => names.concat(),
            };
            UnknownName {
                what: Self::KIND,
                found: name.to_owned(),
                expected,
            }
        })
    }
}

/// A name that is not one of the available names.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("unknown {what} {found}; expected {expected}")]
pub struct UnknownName {
    /// Kind of the choice, such as "structure".
    pub what: &'static str,
    /// Name that was given.
    pub found: String,
    /// Available names.
    pub expected: String,
}

/// Defines the names that users type for an enum without fields: `ALL`, `NAMES`, `name`,
/// [`Display`](std::fmt::Display), [`FromStr`](std::str::FromStr) and [`NamedChoice`].
///
/// ```
/// #[derive(Debug, Clone, Copy, PartialEq)]
/// enum Window {
///     Hann,
///     Rectangular,
/// }
/// hoid_model::named_choice!(Window, "window", 2, { Hann => "hann", Rectangular => "none" });
///
/// assert_eq!("hann".parse(), Ok(Window::Hann));
/// assert_eq!(Window::Rectangular.to_string(), "none");
/// let error = "hamming".parse::<Window>().unwrap_err();
/// assert_eq!(error.to_string(), "unknown window hamming; expected hann or none");
/// ```
#[macro_export]
macro_rules! named_choice {
    ($type:ty, $what:literal, $count:literal, { $($variant:ident => $name:literal),+ $(,)? }) => {
        impl $type {
            /// All choices, in the order in which they are listed.
            pub const ALL: [Self; $count] = [$(Self::$variant),+];
            /// The names of all choices.
            pub const NAMES: [&'static str; $count] = [$($name),+];

            /// Returns the name that users type.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$variant => $name),+
                }
            }
        }

        impl $crate::NamedChoice for $type {
            const KIND: &'static str = $what;
            const CHOICES: &'static [Self] = &Self::ALL;

            fn choice_name(self) -> &'static str {
                self.name()
            }
        }

        /// Formats the choice as the name that users type.
        impl ::std::fmt::Display for $type {
            fn fmt(&self, f: &mut ::std::fmt::Formatter<'_>) -> ::std::fmt::Result {
                f.pad(self.name())
            }
        }

        /// Parses the name that users type, case-insensitively.
        impl ::std::str::FromStr for $type {
            type Err = $crate::UnknownName;

            fn from_str(text: &str) -> Result<Self, $crate::UnknownName> {
                <Self as $crate::NamedChoice>::from_name(text)
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use crate::Structure;

    #[test]
    fn unknown_names_list_the_choices() {
        for structure in Structure::ALL {
            assert_eq!(structure.to_string().parse(), Ok(structure));
            assert_eq!(structure.label().parse(), Ok(structure));
        }
        let error = "arxx".parse::<Structure>().unwrap_err().to_string();
        assert_eq!(
            error,
            "unknown structure arxx; expected fir, ar, ma, arx, arma, armax, ararx, ararmax, oe, bj or general"
        );
    }
}
