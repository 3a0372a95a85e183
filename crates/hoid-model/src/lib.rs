//! Models of hoid and the mathematics that needs no data: records, polynomial models, exact discretisation, the
//! parameters of the operator, and the task in which an operator is measured.
//!
//! A person who tracks a target sees the error e and responds with the control u. The operator model is a gain, a lead,
//! a delay and the neuromuscular dynamics, `K_e (1 + T_L s) omega^2 / (s^2 + 2 zeta omega s + omega^2) e^{-tau s}`,
//! with a remnant of filtered white noise. The model estimated from samples is a polynomial model in `q^-1`. This crate
//! converts the operator model to the polynomial model and back, with derivatives, and describes the loop around the
//! operator.
//!
//! ```
//! use hoid_model::{
//!     Structure,
//!     margins::{MANUAL_CONTROL_RANGE_RAD_S, margins},
//!     scenario::{Condition, Scenario},
//! };
//!
//! let scenario = Scenario::condition(Condition::C1);
//! let operator = scenario.initial.operator;
//!
//! // To discrete time and back: the conversion is exact.
//! let discrete = operator.discretise(scenario.sample_time)?;
//! assert!((discrete.parameters()?.t_l_s - operator.t_l_s).abs() < 1e-9);
//!
//! // Crossover frequency and phase margin of the loop.
//! let element = scenario.initial.controlled_element.transfer_function()?;
//! let open_loop = operator.transfer_function()?.series(&element);
//! let found = margins(|omega| open_loop.response(omega), MANUAL_CONTROL_RANGE_RAD_S);
//! assert!(found.phase_margin_deg.is_some_and(|margin| margin > 0.0));
//!
//! // The Box-Jenkins model of this operator and a remnant of first order has five parameters.
//! let structure: Structure = "bj".parse()?;
//! assert_eq!(structure.operator_orders(29).parameter_count(), 5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Notation and units are those of the symbol table in the documentation (`docs/src/symbols.md`).
//!
//! | module | contents |
//! |---|---|
//! | [`record`] | [`Record`]: evenly sampled input, output and further channels |
//! | [`polynomial`] | polynomials in `q^-1`, their roots and stability |
//! | [`structure`] | [`Structure`], [`Orders`], names of the parameters |
//! | [`polynomial_model`] | `A u = (B/F) q^-nk e + (C/D) eps`: prediction, simulation, frequency response |
//! | [`transfer_function`] | transfer functions in s and in z |
//! | [`discretise`] | the discretisations of Table 5.2 for general transfer functions |
//! | [`second_order`] | exact zero-order hold of second-order systems, in both directions, with derivatives |
//! | [`operator`] | [`OperatorParameters`] and their discrete model |
//! | [`delayed_operator`](mod@delayed_operator) | the operator with a delay of any fraction of a sample |
//! | [`operator_family`] | operators with other combinations of gain, lead and lag, as identified for people |
//! | [`resampling`] | changes in the sampling rate: the filter, and [`Decimation`] of records and streams |
//! | [`remnant`] | the remnant filter, its discretisations and its retrieval |
//! | [`remnant_noise`] | the noise model of the exactly held remnant as a function of T_n, with derivatives |
//! | [`uncertainty`] | standard errors of derived quantities by the delta method |
//! | [`numbers`], [`estimate_table`] | numbers with as many digits as their standard error allows, also as a table |
//! | [`controlled_element`], [`forcing`], [`schedule`], [`scenario`] | the task: plant, target signal, change over time, conditions C1-C6 |
//! | [`family_scenario`] | tasks of people: any operator of the family, any controlled element, a remnant of several parts |
//! | [`feedforward`] | response of a person to a displayed target, also as text |
//! | [`zoh_system`] | exact zero-order hold of any rational transfer function |
//! | [`margins`] | crossover frequency, phase and gain margins |
//! | [`remnant_gain`] | the gain K_n for a given noise level |
//! | [`GainUnit`] | units of gains, derived from the units of the channels |
//! | [`Finding`], [`Verdict`], [`AnswerVerdict`] | observations about a result, and its reliability |
//! | [`named_choice!`], [`NamedChoice`] | the names that users type |

mod error;
mod estimate;
mod fault;
mod finding;
mod gain_unit;
mod named_choice;

pub mod controlled_element;
pub mod delayed_operator;
pub mod discretise;
pub mod estimate_table;
pub mod family_scenario;
pub mod feedforward;
pub mod forcing;
pub mod margins;
pub mod numbers;
pub mod operator;
pub mod operator_family;
pub mod option_names;
pub mod polynomial;
pub mod polynomial_model;
pub mod record;
pub mod remnant;
pub mod remnant_gain;
pub mod remnant_noise;
pub mod resampling;
pub mod sample_time;
pub mod scenario;
pub mod schedule;
pub mod second_order;
pub mod static_names;
pub mod structure;
pub mod transfer_function;
pub mod uncertainty;
pub mod zoh_system;

pub use delayed_operator::{DelayedOperator, delayed_operator, delayed_operator_jacobian};
pub use error::{ModelError, NotConvertible};
pub use family_scenario::{FamilyScenario, FamilyState};
pub use fault::{Fault, FaultAction, FaultHandling, FaultKind, MAX_REPAIRED_SHARE, fault_findings};
pub use feedforward::Feedforward;
pub use finding::{AnswerVerdict, Finding, Severity, Verdict, VerdictLevel};
pub use gain_unit::GainUnit;
pub use named_choice::{NamedChoice, UnknownName};
pub use num_complex::Complex64;
pub use operator::{DiscreteOperator, OperatorParameters};
pub use operator_family::{FamilyOperator, FittedOperator, Form};
pub use polynomial_model::PolynomialModel;
pub use record::{Channel, Detrend, Record};
pub use resampling::{Decimated, Decimation, Decimator};
pub use sample_time::SampleTime;
pub use structure::{MAX_DELAY, MAX_ORDER, Orders, Structure, theta_from_start};
pub use transfer_function::{ContinuousTransferFunction, DiscreteTransferFunction};
