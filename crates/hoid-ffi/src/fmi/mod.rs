//! Functional mock-up units for simulators: the tracker, and the operator of a scenario.
//!
//! The shared library of the C interface also contains the FMI functions; `hoid fmu` packs it together with a model
//! description. [`hoid_io::fmu`] defines the contents of a unit; this module implements them.
//!
//! | file | contents |
//! |---|---|
//! | `instance` | instance of a unit: values, phases, times of the samples |
//! | `values` | parameters and inputs by name |
//! | `model` | model that receives the samples: tracker or operator |
//! | `operator` | operator of a scenario, either of the thesis or of the family |
//! | `component` | handles, status codes and messages of both FMI versions |
//! | `state` | saved state of an instance, from which this or another instance can continue |
//! | `fmi2`, `fmi3` | functions of FMI 2.0 and 3.0 |

mod component;
pub mod fmi2;
pub mod fmi3;
mod instance;
mod model;
mod operator;
pub mod state;
mod values;
