//! The tracker of `hoid track` and `hoid stream` behind a C ABI.
//!
//! The one crate of the workspace with unsafe code. What is unsafe about a C boundary is that pointers are trusted, so
//! that is all the unsafe code does: `boundary` reads texts and writes results through pointers of the caller, and
//! nothing else dereferences one. Behind it is the safe `session`, which does not depend on C.
//!
//! Three rules hold for every function:
//!
//! - **It returns a status**, zero for done, positive if there is no value now, negative for an error. The reason is in
//!   [`hoid_last_error`] of the calling thread.
//! - **No panic crosses.** A panic is caught, becomes [`HOID_PANIC`], and the tracker that was at work
//!   answers [`HOID_BROKEN`] from then on: its state may be half updated.
//! - **A null pointer is an error**, not a crash, and a list that is too short is not written.
//!
//! Names, order and units are those of Rust and Python.
//!
//! | module | contents |
//! |---|---|
//! | `session` | a tracker as its options ask for it, and the prior knowledge of it |
//! | `options` | options in JSON, by the keywords of Python |
//! | `saved`, `packed` | a tracker as bytes |
//! | `status`, `boundary` | statuses and their texts; pointers |
//! | `types` | types that cross the interface |
//! | `making`, `stepping`, `reading` | the functions |
//! | [`fmi`] | the functions of the Functional Mock-up Interface |

mod boundary;
/// cbindgen:ignore
pub mod fmi;
mod making;
mod options;
mod packed;
mod reading;
mod saved;
mod session;
mod status;
mod stepping;
mod types;

pub use boundary::HoidTracker;
pub use making::*;
pub use reading::*;
pub use status::*;
pub use stepping::*;
pub use types::*;
