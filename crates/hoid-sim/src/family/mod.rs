//! Closed loop of any operator of the family, sample by sample.
//!
//! [`Simulator`](crate::Simulator) is a faster simulation for the operator of the thesis; in this module all orders are
//! known only at run time.
//!
//! | file | contents |
//! |---|---|
//! | `zoh_loop` | closed loop with its parameters at one instant, and its simulation over one sample |
//! | `noise` | parts of the remnant |
//! | `remnant_run` | complete remnant of a run, with the random walk of the stick, sample by sample |
//! | `calibration` | gains at which each part of the remnant has its share of the variance of u |
//! | `simulator` | [`FamilySimulator`]: a prepared scenario and its runs |
//! | `operator_run` | [`FamilyOperatorRun`]: the operator alone, sample by sample |

mod calibration;
mod noise;
mod operator_run;
mod remnant_run;
mod simulator;
mod zoh_loop;

pub use operator_run::FamilyOperatorRun;
pub use simulator::{FamilySignals, FamilySimulator};
