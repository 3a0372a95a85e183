//! Recursive methods from the literature, for comparison with the methods of hoid.
//!
//! Each method follows the source named in its file and is a [`Method`](hoid_track::Method), like the default method.
//! All methods share the tracker, the guard, saved states, traces and verdicts of [`hoid_track`]. This crate contains
//! the list of all methods by name.
//!
//! ```
//! use hoid_model::scenario::{Condition, Scenario};
//! use hoid_sim::{RunSeed, Simulator};
//! use hoid_track::{TrackOptions, track};
//!
//! let simulator = Simulator::new(&Scenario::condition(Condition::C4))?;
//! let record = simulator.run(RunSeed::default(), false)?;
//! let physical = hoid_survey::method("physical")?;
//! let options = TrackOptions::default_for(physical, 29).with(&[("memory_of", "K_e=4s")])?;
//! let trace = track(&record, &options, 100)?;
//!
//! // The task changes at 40.96 s, and K_e_dot rises from .036 to .084 s.
//! let last = trace.operator(trace.len() - 1)?;
//! assert!((last.k_e_dot.value - 0.084).abs() < 0.02);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | method |
//! |---|---|
//! | `registry` | [`methods()`]: all methods by name, including those of [`hoid_track`] |
//! | `physical` | `physical`: the prediction-error method in the operator's parameters |
//! | `window` | `window`: a repeated batch fit of the last few seconds |
//! | `rriv` | `rriv`: recursive refined instrumental variable |
//! | `multiple_model` | `multiple-model`: a bank of hypotheses about the time of a change; its two-sided estimate |
//! | `fused` | `fused`: least squares for B with the poles of the prediction-error method |
//! | [`kernel`] | the computations of `physical` and `multiple-model` for one sample |
//! | `joint_filter` | `ekf`, `ukf`: Kalman filters that estimate the state and the parameters jointly |
//! | `dual_ekf` | `dual-ekf`: two alternating Kalman filters, one for the state and one for the parameters |
//! | `linear_network` | `linear-network`: a single linear layer that learns the gains |
//! | `known_noise` | code common to methods that take the noise model from a batch fit |

mod dual_ekf;
mod fused;
mod joint_filter;
pub mod kernel;
mod known_noise;
mod linear_network;
mod multiple_model;
mod physical;
mod registry;
mod rriv;
mod window;

pub use dual_ekf::DualEkfOptions;
pub use fused::FusedOptions;
pub use joint_filter::{EkfOptions, UkfOptions};
pub use linear_network::LinearNetworkOptions;
pub use multiple_model::MultipleModelOptions;
pub use physical::PhysicalOptions;
pub use registry::{
    ListedMethod, dual_ekf, ekf, fused, is_for_comparison, linear_network, list_methods, method, methods,
    multiple_model, options_for_comparison, physical, registry, renamed_method, rriv, set, ukf, window,
};
pub use rriv::RrivOptions;
pub use window::WindowOptions;
