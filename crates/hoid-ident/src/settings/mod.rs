//! Self-describing options.
//!
//! An estimator or a recursive method declares its options once, by [`settings!`](crate::settings!): name, type, unit,
//! default, bounds and a line of help. The command line, study plans, Python and the pages of the book use this
//! declaration and have no separate list.
//!
//! ```
//! use hoid_ident::{settings, settings::{Bounds, Settings}};
//!
//! settings! {
//!     /// Options of a method.
//!     pub struct WindowOptions {
//!         /// Samples between fits
//!         #[setting(unit("samples"), bounds(Bounds::AtLeast(1.0)))]
//!         pub refit: usize = 25,
//!     }
//! }
//!
//! let mut options = WindowOptions::default();
//! assert!(options.set("refit", "50")?);
//! assert_eq!(options.refit, 50);
//! assert_eq!(options.list()[0].help, "Samples between fits");
//! assert!(options.set("refit", "0").is_err());
//! // `set` returns false for an unknown name.
//! assert!(!options.set("memory", "256")?);
//! # Ok::<(), hoid_ident::IdentError>(())
//! ```
//!
//! A value is written as on the command line: `256`, `true`, `0.2..0.4`, `b0=256,f=inf`. Typed values from a plan or
//! from Python are first converted to this form, so each type has a single parser ([`Value`]).

mod batch_option;
mod declare;
mod kind;
mod range;
mod setting;
mod value;

pub use batch_option::{BatchOption, BatchOptions};
pub use kind::{Bounds, Kind};
pub use range::{DelayRange, NumberOrSpan};
pub use setting::{MethodSpec, Setting};
pub use value::{Value, parse_named_pairs};

use crate::IdentError;

/// A set of named options.
pub trait Settings {
    /// Returns the available settings in the order of their declaration, with their defaults.
    fn list(&self) -> Vec<Setting>;

    /// Sets an option from text; returns false if there is no option with this name.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] if the text is not a valid value of the option or is outside its bounds.
    fn set(&mut self, name: &str, text: &str) -> Result<bool, IdentError>;

    /// Returns the value of an option as text; `None` if it has no value, or if there is no option with this name.
    fn get(&self, name: &str) -> Option<String>;
}
