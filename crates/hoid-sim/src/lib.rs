//! The closed loop of operator and controlled element, simulated sample by sample.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Simulator`] | a scenario made ready, and its runs |
//! | [`Stream`] | the random stream of one run |
//! | `cascade` | exact zero-order hold of the remnant filter |

mod cascade;
mod error;
mod simulator;
mod stream;

pub use error::SimError;
pub use simulator::{Signals, Simulator};
pub use stream::Stream;
