//! The closed loop of operator and controlled element, simulated sample by sample.
//!
//! | module | what it holds |
//! |---|---|
//! | [`Simulator`] | a scenario made ready, and its runs |
//! | [`RunSeed`] | what names the random numbers of one run |
//! | `cascade` | exact zero-order hold of the remnant filter |

mod cascade;
mod error;
mod run_seed;
mod simulator;

pub use error::SimError;
pub use run_seed::RunSeed;
pub use simulator::{Signals, Simulator};
