//! Instrumental variable methods. A new method needs a file in this folder with its [`Algorithm`], a `mod` line, and a
//! line in the list below.

mod iv4;
mod rivbj;
mod sriv;

use std::fmt;

use hoid_model::Structure;

use super::algorithm::Algorithm;

/// Declares the methods: for each method, its variant and the module with its algorithm.
macro_rules! methods {
    ($($(#[$doc:meta])* $method:ident = $file:ident,)+) => {
        /// An instrumental variable method.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum IvMethod {
            $($(#[$doc])* $method,)+
        }

        impl IvMethod {
            /// All instrumental variable methods.
            pub const ALL: [Self; [$(stringify!($method)),+].len()] = [$(Self::$method),+];

            pub(in crate::iv) fn algorithm(self) -> &'static Algorithm {
                match self {
                    $(Self::$method => &$file::ALGORITHM,)+
                }
            }
        }
    };
}

methods! {
    /// The four-step method for ARX models.
    Iv4 = iv4,
    /// Simplified refined instrumental variable, for output-error models.
    Sriv = sriv,
    /// Refined instrumental variable, for Box-Jenkins models.
    RivBj = rivbj,
}

impl IvMethod {
    /// Returns the short name: `iv4`, `sriv`, `rivbj`.
    pub fn name(self) -> &'static str {
        self.algorithm().name
    }

    /// Returns a description in one line, without a full stop.
    pub fn help(self) -> &'static str {
        self.algorithm().help
    }

    /// Returns the source in the literature.
    pub fn source(self) -> &'static str {
        self.algorithm().source
    }

    /// Returns the structure that the method fits.
    pub fn structure(self) -> Structure {
        self.algorithm().structures[0]
    }

    /// Returns the structure that the method fits, as a list with one element.
    pub fn structures(self) -> &'static [Structure] {
        self.algorithm().structures
    }
}

impl fmt::Display for IvMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
