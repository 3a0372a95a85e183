//! Faults in streams and their effect on a tracker, for the test and for the slow study `tracker-faults`.

mod faults;
mod tracked;

#[allow(unused_imports)]
pub use faults::{Fault, Signal, faults};
#[allow(unused_imports)]
pub use tracked::{Effect, Reference, Run};
