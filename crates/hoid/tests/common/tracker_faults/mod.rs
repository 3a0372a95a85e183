//! Faults in streams, and what they do to a tracker: for the test and for the slow study
//! `tracker-faults`.

mod faults;
mod tracked;

pub use faults::faults;
pub use tracked::{Effect, Reference, Run};
