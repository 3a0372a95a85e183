//! The closed loop of any operator of the family, sample by sample.
//!
//! The lean path of the reference text's operator stays [`Simulator`](crate::Simulator); here all
//! orders are found at run time.
//!
//! | file | what it holds |
//! |---|---|
//! | `held_loop` | the loop with its parameters at one instant, and one sample of it |
//! | `noise` | the parts of the remnant and the walk of the stick |
//! | `calibration` | the gains that give each part its share of the variance of u |
//! | `simulator` | [`FamilySimulator`]: a scenario made ready, and its runs |

mod calibration;
mod held_loop;
mod noise;
mod simulator;

pub use simulator::{FamilySignals, FamilySimulator};
