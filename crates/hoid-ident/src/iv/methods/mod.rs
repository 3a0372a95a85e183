//! The methods of instrumental variables. A new method is a file in this folder with its [`Algorithm`], its `mod` line
//! and its line in the list below.

mod iv4;
mod rivbj;
mod sriv;

use std::fmt;

use hoid_model::Structure;

use super::algorithm::Algorithm;

/// The list of the methods: variant, and module with its algorithm.
macro_rules! methods {
    ($($(#[$doc:meta])* $method:ident = $file:ident,)+) => {
        /// A method of instrumental variables.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[non_exhaustive]
        pub enum IvMethod {
            $($(#[$doc])* $method,)+
        }

        impl IvMethod {
            /// All methods.
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

    /// Returns the description, in a line without a full stop.
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

    /// Returns the structure that the method fits, as a list.
    pub fn structures(self) -> &'static [Structure] {
        self.algorithm().structures
    }
}

impl fmt::Display for IvMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
