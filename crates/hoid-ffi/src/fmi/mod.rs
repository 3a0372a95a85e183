//! Functional mock-up units: the tracker, and the operator of a scenario, for simulators.
//!
//! The shared library is the one of the C ABI; `hoid fmu` packs it with a description. The contents of a unit are
//! defined by [`hoid_io::fmu`]; this module implements them.
//!
//! | file | contents |
//! |---|---|
//! | `instance` | an instance: its values, its phases, when a sample is due |
//! | `given` | parameters and inputs, by their names |
//! | `model` | recipients of samples: tracker and operator |
//! | `operator` | the operator of a scenario, of the thesis or of the family |
//! | `component` | handles, statuses and messages of both interfaces |
//! | `state` | its state, to go back to it or to continue elsewhere |
//! | `fmi2`, `fmi3` | the functions of FMI 2.0 and 3.0 |

mod component;
pub mod fmi2;
pub mod fmi3;
mod instance;
mod model;
mod operator;
pub mod state;
mod values;
