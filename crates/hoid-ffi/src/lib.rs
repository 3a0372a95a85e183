//! C interface of the tracker of `hoid track` and `hoid stream`.
//!
//! This is the only crate of the workspace with unsafe code. A C interface is unsafe because it must trust pointers,
//! and the unsafe code does nothing else: `boundary` reads strings and writes results through pointers from the caller,
//! and no other code of the tracker interface dereferences such a pointer. The module `session`, which the functions of
//! the interface call, is safe and independent of C.
//!
//! Every function follows three rules:
//!
//! - **It returns a status**: zero for success, positive if there is currently no value, negative for an error.
//!   [`hoid_last_error`], called in the same thread, returns the reason.
//! - **No panic crosses the interface.** A panic is caught and becomes [`HOID_PANIC`]. From then on, every call with
//!   the affected tracker returns [`HOID_BROKEN`], since the state of the tracker may be inconsistent.
//! - **A null pointer is an error**, not a crash, and nothing is written to an array that is too short.
//!
//! The names, their order and the units are the same as in Rust and Python.
//!
//! | module | contents |
//! |---|---|
//! | `session` | tracker built from its options, with its prior knowledge |
//! | `options` | options in JSON, with the keywords of Python |
//! | `saved_tracker`, `binary_format` | serialisation of a tracker as bytes |
//! | `status`, `boundary` | status codes and error messages; pointers |
//! | `types` | types of the interface |
//! | `create`, `update`, `results` | functions of the interface |
//! | [`fmi`] | functions of the Functional Mock-up Interface |

mod binary_format;
mod boundary;
mod create;
/// cbindgen:ignore
pub mod fmi;
mod options;
mod results;
mod saved_tracker;
mod session;
mod status;
mod types;
mod update;

pub use boundary::HoidTracker;
pub use create::*;
pub use results::*;
pub use status::*;
pub use types::*;
pub use update::*;
