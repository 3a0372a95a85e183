//! Human-operator identification: how a person controls a machine, from the tracking error e and the control output u.
//!
//! This crate has no code of its own: it gathers what a Rust user needs. Simulate a run, fit an ARX and a Box-Jenkins model,
//! and read the operator's parameters with their standard errors:
//!
//! ```
//! use hoid::prelude::*;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let simulator = Simulator::new(&Scenario::condition(Condition::C1))?;
//! let record = simulator.run(RunSeed { seed: 1, ..RunSeed::default() }, false)?;
//!
//! let orders = Structure::BoxJenkins.operator_orders(29);
//! let fit = Estimator::new(Structure::BoxJenkins, orders).fit(&[record])?;
//! let operator = fit.operator()?;
//! let omega = operator.omega_nm_rad_s;
//! assert!((omega.value - 11.25).abs() < 4.0 * omega.standard_error.unwrap_or(0.0));
//! # Ok(())
//! # }
//! ```

pub use hoid_core as core;
pub use hoid_ident as ident;
pub use hoid_io as io;
pub use hoid_lanes as lanes;
pub use hoid_model as model;
pub use hoid_report as report;
pub use hoid_sim as sim;
pub use hoid_study as study;
pub use hoid_thesis as thesis;
pub use hoid_track as track;

/// What most programs use.
pub mod prelude {
    pub use hoid_ident::{Estimator, Fit, InitialState, OrderRanges, choose_orders};
    pub use hoid_model::{
        Channel, OperatorParameters, Orders, PolynomialModel, Record, SampleTime, Structure,
        scenario::{Condition, Scenario},
        uncertainty::Estimate,
    };
    pub use hoid_sim::{RunSeed, Simulator};
}
