//! Names on the command line for the values of a type of the library.

/// A name on the command line for each value of a type of the library.
macro_rules! names {
    ($name:ident for $target:ty { $($variant:ident = $value:expr),+ $(,)? }) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
        pub enum $name { $($variant),+ }
        impl From<$name> for $target {
            fn from(name: $name) -> Self {
                match name { $($name::$variant => $value),+ }
            }
        }
    };
}
