//! Sample-by-sample simulation of the closed loop of operator, remnant and controlled element.
//!
//! The operator, the remnant filter and the controlled element are each discretised exactly (zero-order hold), so the
//! simulated record follows the model of an estimator without integration errors. The random numbers of a run are
//! identified by seed, cell and replication, not by the thread that computes it, so any run can be repeated alone.
//!
//! ```
//! use hoid_model::scenario::{Condition, Scenario};
//! use hoid_sim::{RunSeed, Simulator};
//!
//! let simulator = Simulator::new(&Scenario::condition(Condition::C1))?;
//! let record = simulator.run(RunSeed { seed: 1, ..RunSeed::default() }, false)?;
//! assert_eq!(record.len(), 8192);
//!
//! // Another replication is independent; the same one is the same to the last bit.
//! let other = simulator.run(RunSeed { seed: 1, replication: 1, ..RunSeed::default() }, false)?;
//! assert_ne!(record.output(), other.output());
//! assert_eq!(record, simulator.run(RunSeed { seed: 1, ..RunSeed::default() }, false)?);
//! # Ok::<(), hoid_sim::SimError>(())
//! ```
//!
//! | module | contents |
//! |---|---|
//! | `simulator` | [`Simulator`]: a prepared scenario and its runs |
//! | `operator_run` | [`OperatorRun`]: the operator alone, sample by sample |
//! | `run_seed` | [`RunSeed`]: identifier of the random numbers of one run |
//! | `normal_deviates` | standard normal deviates by the ziggurat method |
//! | `cascade` | exact zero-order hold of the remnant filter |
//! | `zoh_operator` | operator of the family over one sample |
//! | `target_response` | response to a displayed target |
//! | [`family`] | loop of any operator of the family: [`FamilySimulator`]; the operator alone |
//! | [`people`] | virtual people drawn from the family |
//! | `error` | [`SimError`]: reasons why a simulation gives no record |

mod cascade;
mod error;
pub mod family;
mod normal_deviates;
mod operator_run;
pub mod people;
mod run_seed;
mod simulator;
mod target_response;
mod zoh_operator;

pub use error::SimError;
pub use family::{FamilyOperatorRun, FamilySignals, FamilySimulator};
pub use operator_run::OperatorRun;
pub use run_seed::RunSeed;
pub use simulator::{Signals, Simulator};
