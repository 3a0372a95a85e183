//! Options that describe themselves.
//!
//! An estimator or a recursive method declares its options once, by
//! [`settings!`](crate::settings!): name, type, unit, default, bounds and a line of help. The
//! command line, plans of studies, Python and the pages of the book read that declaration and have no separate list.
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
//! // A name that is not among them is nobody's.
//! assert!(!options.set("memory", "256")?);
//! # Ok::<(), hoid_ident::IdentError>(())
//! ```
//!
//! A value is written as on the command line: `256`, `true`, `0.2..0.4`, `b0=256,f=inf`. Values that a plan or Python
//! has in its own types are first converted to that form, so that there is one reader of each type ([`Value`]).

mod batch_option;
mod declare;
mod kind;
mod range;
mod setting;
mod value;

pub use batch_option::{BatchOption, BatchOptions};
pub use kind::{Bounds, Kind};
pub use range::{DelayRange, OneOrSpan};
pub use setting::{MethodSpec, Setting};
pub use value::{Value, named_pairs};

use crate::IdentError;

/// Options with names.
pub trait Settings {
    /// Available settings, in the order of the declaration, with the defaults.
    fn list(&self) -> Vec<Setting>;

    /// Sets an option from its text; false when the name is not among them.
    ///
    /// # Errors
    /// [`IdentError::BadOption`] for a text that is not a value of the option, or out of its
    /// bounds.
    fn set(&mut self, name: &str, text: &str) -> Result<bool, IdentError>;

    /// The value of an option as text; `None` if it has none, or the name is not among them.
    fn get(&self, name: &str) -> Option<String>;
}
