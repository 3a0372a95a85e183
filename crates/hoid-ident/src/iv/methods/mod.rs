//! The methods of instrumental variables. A new one is a file next to these with its [`Algorithm`],
//! its `mod` line and its line in the list below.

mod iv4;
mod rivbj;
mod sriv;

use std::fmt;

use hoid_model::Structure;

use super::algorithm::Algorithm;

/// The list of the methods: variant, and the file that holds its algorithm.
macro_rules! methods {
    ($($(#[$doc:meta])* $method:ident = $file:ident,)+) => {
        /// Which instrumental variable method.
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
    /// Short name: `iv4`, `sriv`, `rivbj`.
    pub fn name(self) -> &'static str {
        self.algorithm().name
    }

    /// Its definition, in a line without a full stop.
    pub fn help(self) -> &'static str {
        self.algorithm().help
    }

    /// Where it comes from.
    pub fn source(self) -> &'static str {
        self.algorithm().source
    }

    /// The structure that the method fits.
    pub fn structure(self) -> Structure {
        self.algorithm().structures[0]
    }

    /// The structure that the method fits, as a list.
    pub fn structures(self) -> &'static [Structure] {
        self.algorithm().structures
    }
}

impl fmt::Display for IvMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
