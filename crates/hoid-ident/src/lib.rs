//! Identification of the human operator from records: batch estimators.
//!
//! **The problem.** A person tracks a target: they see the error e and move the control u. Both signals are sampled
//! with the period Ts. The quantities to estimate are the dynamics from e to u, their uncertainty, and the remnant: the
//! part of u that these dynamics do not explain.
//!
//! **The model.** All models of this crate are special cases of
//!
//! `A(q) u(t) = (B(q)/F(q)) q^-nk e(t) + (C(q)/D(q)) eps(t)`
//!
//! with polynomials in the backward shift `q^-1`, `A = 1 + a1 q^-1 + ..`, `B = b0 + b1 q^-1 + ..`, and white
//! innovations eps with the variance sigma^2. B/(A F) and the delay nk describe the operator, and C/(A D) shapes the
//! remnant. Polynomials that a structure does not have are equal to one (ARX has A and B; Box-Jenkins has B, C, D and
//! F).
//!
//! **The method.** For given coefficients theta the error of the best prediction of u(t) from all earlier data is
//!
//! `eps(t, theta) = (D/C) (A u(t) - (B/F) q^-nk e(t))`
//!
//! and theta minimises `V = (1/N) sum eps(t, theta)^2`: the prediction error method (L. Ljung, *System Identification*,
//! 1999, ch. 7). The estimate is consistent if the structure contains the true dynamics, also in a closed loop with a
//! delay, and asymptotically attains the Cramér-Rao bound for normally distributed innovations. Its covariance is
//! `sigma^2 (psi' psi)^-1` with `psi = -d eps/d theta`. The unknown initial states of a record enter eps linearly and
//! are eliminated exactly for each theta. ARX models are linear in theta and solved in one step; all other structures
//! are fitted by damped Gauss-Newton steps from several starts.
//!
//! ```
//! use hoid_ident::Estimator;
//! use hoid_model::{Structure, scenario::{Condition, Scenario}};
//! use hoid_sim::Simulator;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // A run of a simulated person in condition C1, 81.92 s at 100 Hz.
//! let record = Simulator::new(&Scenario::condition(Condition::C1))?.run(Default::default(), false)?;
//! // Box-Jenkins with two poles and a delay of 28 samples, 0.28 s.
//! let estimator = Estimator::new(Structure::BoxJenkins, Structure::BoxJenkins.operator_orders(29));
//! let fit = estimator.fit(std::slice::from_ref(&record))?;
//! // Coefficients with standard errors, loss, how the search ended.
//! println!("{fit}");
//! // K_e, T_L, omega_nm, zeta_nm and tau_e with standard errors.
//! let operator = fit.operator()?;
//! println!("{operator}");
//! // Does it describe the record, and are the residuals white?
//! println!("{}", fit.validate(&record)?);
//! let k_e = operator.k_e;
//! assert!((k_e.value - 0.09).abs() < 4.0 * k_e.standard_error.unwrap_or(0.0));
//! # Ok(())
//! # }
//! ```
//!
//! **Contents**
//!
//! | module | contents |
//! |---|---|
//! | [`Estimator`] | the prediction error method: structure, orders, options; the fits `fit` and `fit_each` |
//! | [`Fit`] | the model, its covariance and criteria; prediction, simulation, frequency response, poles and margins |
//! | [`validation`] | VAF, NRMSE, residual tests |
//! | [`order_selection`] | selection of orders and delay from ranges, by a criterion |
//! | [`several_inputs`] | polynomial models with several inputs |
//! | [`iv`] | instrumental variables, in open and closed loop |
//! | [`family`] | operators of recorded people: form, parameters, robust errors, a verdict |
//! | [`grey_box`] | fits in physical parameters: an operator with a real-valued delay, a remnant filter |
//! | [`SigmoidChange`] | gains that change once along a sigmoid, with the time and the rate of the change |
//! | [`faults`] | faults of recorded data, detected and repaired before a fit |
//! | [`frequency`] | describing function, coherence, remnant spectrum and margins from Fourier coefficients |
//! | [`diagnostics`] | evidence for and against a fit: [`Fit::verdict`] |
//! | [`progress`] | progress of a fit, reported to the caller |
//! | [`linalg`] | sums of products, least squares by QR, the inverse of an information matrix |
//!
//! Internal modules; each uses the modules above it:
//!
//! | module | contents |
//! |---|---|
//! | `optimize` | minimisation of a sum of squares, also along the boundary of the stability region |
//! | `criterion` | prediction-error criterion of the general model, its gradients, and initial states |
//! | `multistart` | searches from several starts |
//! | `initial_guess` | starting values of a search |
//! | `pem` | bounds, priors, robust loss, focus; fits of one record, or of many records in parallel lanes |
//! | `searched_delay` | contribution of the search for nk to the error bars |

mod assembled_fit;
mod constraint;
mod criterion;
mod derived_quantities;
pub mod diagnostics;
mod error;
mod estimator;
pub mod family;
pub mod faults;
mod fit;
pub mod frequency;
pub mod grey_box;
mod independent_inputs;
mod informative_data;
mod initial_guess;
pub mod iv;
pub mod level;
pub mod linalg;
mod multistart;
mod noise_model;
mod optimize;
pub mod order_selection;
mod pem;
pub mod progress;
mod searched_delay;
pub mod settings;
pub mod several_inputs;
pub mod shared_options;
mod sigmoid;
mod summary;
pub mod validation;

pub use constraint::{Constraint, Prior};
pub use criterion::{InitialState, first_residual};
pub use derived_quantities::{MarginEstimates, Root};
pub use error::IdentError;
pub use estimator::{Estimator, Focus};
pub use fit::{Fit, ResponsePoint, Series};
pub use grey_box::{GreyBox, GreyBoxFit};
pub use independent_inputs::check_independent_inputs;
pub use iv::{InstrumentalVariable, Instruments, IvMethod};
pub use optimize::{Reason, SearchMethod, SearchOptions, Termination};
pub use order_selection::{Candidate, Choice, NamedOrders, OrderRanges, choose_orders, identify_box_jenkins};
pub use pem::loss::Loss;
pub use sigmoid::{
    ChangeParameter, ChangedOperator, Comparison, InstantGains, NamedEstimate, NoiseLevel, Remark, SIGMOID_NAMES,
    SigmoidChange, SigmoidFit,
};
