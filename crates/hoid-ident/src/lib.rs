//! Identification of the human operator from records: batch estimators.
//!
//! **The problem.** A person tracks a target: they see the error e and move the control, u. Both are sampled with the
//! period Ts. The dynamics from e to u, their uncertainty, and the part of u that they leave unexplained, the remnant,
//! must be estimated.
//!
//! **The model.** Everything here is a case of
//!
//! `A(q) u(t) = (B(q)/F(q)) q^-nk e(t) + (C(q)/D(q)) eps(t)`
//!
//! with polynomials in the backward shift `q^-1`, `A = 1 + a1 q^-1 + ..`, `B = b0 + b1 q^-1 + ..`,
//! and white innovations eps with the variance sigma^2. B/F with nk is the operator with the delay,
//! C/D shapes the remnant; structures set some of the polynomials to one (ARX: A and B;
//! Box-Jenkins: B, C, D and F).
//!
//! **The method.** For given coefficients theta the best prediction of u(t) from all earlier data leaves
//!
//! `eps(t, theta) = (D/C) (A u(t) - (B/F) q^-nk e(t))`
//!
//! and theta minimises `V = (1/N) sum eps(t, theta)^2`: the prediction error method (L. Ljung, *System Identification*,
//! 1999, ch. 7). It is consistent if the structure contains the true dynamics, in a closed loop too if there is a delay
//! in the loop, and it attains the Cramér-Rao bound for normal innovations. Its covariance is `sigma^2 (psi' psi)^-1`
//! with `psi = -d eps/d theta`. The unknown initial states of a record enter eps linearly and are eliminated exactly
//! for each theta. ARX is linear in theta and solved in one step; the others by damped Gauss-Newton from several
//! starts.
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
//! | [`Estimator`] | the prediction error method: structure, orders, options; `fit`, `fit_each` |
//! | [`Fit`] | the model, its covariance and criteria; prediction, simulation, frequency response, poles and margins |
//! | [`validation`] | VAF, NRMSE, residual tests |
//! | [`order_selection`] | ranges of orders and delay, criteria, the chosen model |
//! | [`several_inputs`] | polynomial models with several inputs |
//! | [`iv`] | instrumental variables, in open and closed loop |
//! | [`family`] | operators of recorded people: form, parameters, reliable errors, a verdict |
//! | [`grey_box`] | the fit in physical parameters: operator with a real delay, remnant filter |
//! | [`SigmoidChange`] | gains that follow a sigmoid, with the time and the rate of the change |
//! | [`faults`] | faults of recorded data, found and repaired before a fit |
//! | [`frequency`] | describing function, coherence, remnant spectrum and margins by Fourier coefficients |
//! | [`diagnostics`] | evidence for and against a fit: [`Fit::verdict`] |
//! | [`progress`] | progress of a fit, for the caller that waits |
//! | [`linalg`] | sums of products, least squares by QR, the inverse of an information matrix |
//!
//! and internally, each using those before it:
//!
//! | module | contents |
//! |---|---|
//! | `optimize` | minimisation of a sum of squares, also along the border of stability |
//! | `criterion` | the prediction-error criterion of the general model and its gradients; initial states |
//! | `multistart` | searches from several starts |
//! | `initial_guess` | starts of a search |
//! | `pem` | bounds, priors, robust loss, focus; fits of one record or of many in parallel lanes |
//! | `searched_delay` | contribution of the search of nk to the error bars |

mod assembled_fit;
mod constraint;
mod criterion;
mod derived;
pub mod diagnostics;
mod error;
mod estimator;
pub mod family;
pub mod faults;
mod fit;
pub mod frequency;
pub mod grey_box;
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
pub use derived::{MarginEstimates, Root};
pub use error::IdentError;
pub use estimator::{Estimator, Focus};
pub use fit::{Fit, ResponsePoint, Series};
pub use grey_box::{GreyBox, GreyBoxFit};
pub use iv::{InstrumentalVariable, Instruments, IvMethod};
pub use optimize::{Reason, SearchMethod, SearchOptions, Termination};
pub use order_selection::{Candidate, Choice, NamedOrders, OrderRanges, choose_orders, identify_box_jenkins};
pub use pem::loss::Loss;
pub use sigmoid::{
    ChangeParameter, ChangedOperator, Comparison, GainsAt, NamedEstimate, NoiseLevel, Remark, SIGMOID_NAMES,
    SigmoidChange, SigmoidFit,
};
