//! The closed loop of any operator of the family, sample by sample.
//!
//! The fast path for the thesis's operator is [`Simulator`](crate::Simulator); here all orders are known only at run
//! time.
//!
//! | file | contents |
//! |---|---|
//! | `held_loop` | the loop with its parameters at one instant, and one sample of it |
//! | `noise` | the parts of the remnant and the walk of the stick |
//! | `remnant_run` | all of the remnant of a run, one sample after the other |
//! | `calibration` | the gains that give each part its share of the variance of u |
//! | `simulator` | [`FamilySimulator`]: a scenario made ready, and its runs |
//! | `operator_run` | [`FamilyOperatorRun`]: the operator alone, a sample at a time |

mod calibration;
mod held_loop;
mod noise;
mod operator_run;
mod remnant_run;
mod simulator;

pub use operator_run::FamilyOperatorRun;
pub use simulator::{FamilySignals, FamilySimulator};
