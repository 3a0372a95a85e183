//! Recursive identification of a human operator in real time: the part that runs once per sample, either inside a
//! control loop or in parallel with it.
//!
//! A person controls a machine, with the tracking error e and the control output u. The dynamics of a person change as
//! the person learns, tires or adapts to the machine. The recursions of this crate update a model of these dynamics,
//! and its uncertainty, with each new sample.
//!
//! **Mathematics.** For the model `A u = (B/F) q^-nk e + (C/D) eps`, with the coefficients of its polynomials in theta,
//! the one-step prediction error and its negative gradient are `eps(t)` and `psi(t) = -d eps/d theta`. Each sample
//! updates the estimate by the recursive prediction-error method (L. Ljung and T. Söderström, *Theory and Practice of
//! Recursive Identification*, 1983):
//!
//! - forgetting: `P <- Lambda P Lambda` with a factor for each parameter, or another rule of [`adaptation`];
//! - gain: `g = P psi/(1 + psi' P psi)`;
//! - update: `theta <- theta + g eps`, `P <- P - g psi' P`.
//!
//! P is stored in factored form, `U D U'`, which rounding cannot make indefinite. A step that would make the predictor
//! unstable is halved until the predictor stays stable. The error bars propagate the error of the estimate through the
//! recursion, for any gain, in units of the innovation variance sigma^2.
//!
//! **Real time.** The crate is `no_std`, allocates no memory, and depends only on `hoid-numerics` (small systems of
//! equations) and `libm` (elementary functions). Every routine works in memory that the caller owns and has a bounded
//! number of operations. The state of a recursion can be saved and restored ([`mod@state`]). The batch estimators and
//! the simulator of hoid use the same filters, so a recursion and its batch counterpart cannot differ in their filters.
//!
//! ```
//! use hoid_core::{
//!     adaptation::Forgetting,
//!     covariance::Covariance,
//!     error_bars::ErrorBars,
//!     innovation_variance::InnovationVariance,
//!     rls::Rls,
//!     shape::AnyShape,
//!     ud_covariance::UdCovariance,
//! };
//!
//! // u(t) = -a1 u(t-1) + b0 e(t) + eps(t): an ARX model with two parameters.
//! let shape = AnyShape { na: 1, nb: 1, ..AnyShape::default() };
//! // Both start at 0 with variance 100 (over sigma^2); a memory of 50 samples; variances stay below 1000.
//! let gain = Covariance::new(
//!     UdCovariance::diagonal([100.0; 2]),
//!     Forgetting::Exponential { lambda: [1.0 - 1.0 / 50.0; 2] },
//!     [1000.0; 2],
//! );
//! // Nothing is known of sigma^2 at the start; outliers count as five sigma.
//! let sigma2 = InnovationVariance::new(0.0, 0.0, 0.99);
//! let bars = ErrorBars::new(&[[100.0, 0.0], [0.0, 100.0]], sigma2, 5.0);
//! let mut recursion = Rls::new(shape, [0.0; 2], gain, bars).ok_or("orders do not fit")?;
//!
//! let mut u = 0.0;
//! for t in 0..600 {
//!     let e = f64::from(t % 40) - 19.5;
//!     // The operator doubles their gain after 300 samples.
//!     let b0 = if t < 300 { 0.1 } else { 0.2 };
//!     let noise = 0.05 * f64::from(t * t % 7 - 2);
//!     u = 0.8 * u + b0 * e + noise;
//!     recursion.step(e, u);
//! }
//! let [a1, b0] = *recursion.theta();
//! assert!((a1 + 0.8).abs() < 0.02 && (b0 - 0.2).abs() < 0.01, "{a1} {b0}");
//! let variance = recursion.normalised_covariance()[1][1] * recursion.innovation_variance();
//! assert!(variance > 0.0 && variance.is_finite());
//! # Ok::<(), &str>(())
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`rls`], [`rpem`] | recursive least squares and the recursive prediction-error method |
//! | [`adaptive`] | gains in a basis of physical dynamics, with its own noise model, a level of u, and a test for changes |
//! | [`bounds`] | limiting of a number to an interval |
//! | [`predictor`], [`shape`], [`further_input`] | one-step predictor of the general model with its gradient; orders of the model; responses to further inputs |
//! | [`adaptation`], [`covariance`], [`window`] | from gradient to step: forgetting rules; P with protection against windup; a rectangular window |
//! | [`ud_covariance`] | covariance matrix in the factored form `U D U'` |
//! | [`error_bars`], [`sensitivities`], [`innovation_variance`] | covariance of the estimate for any gain; errors in the filters; sigma^2 |
//! | [`recursion`] | result of a step; polynomials that are kept stable |
//! | [`guard`] | detection of samples and spans that cannot come from tracking, before they reach a recursion |
//! | [`zoh_operator`], [`divided_differences`] | exact zero-order hold of the operator with an arbitrary delay, and its Jacobian; the functions used for both |
//! | [`filter`], [`delay`], [`stability`] | rational filters over slices, a delay line, the Schur-Cohn test |
//! | [`mod@state`] | saving a recursion, to continue it elsewhere |
#![no_std]

#[cfg(test)]
extern crate std;

#[macro_use]
pub mod state;

pub mod adaptation;
pub mod adaptive;
pub mod bounds;
pub mod covariance;
pub mod delay;
pub mod divided_differences;
pub mod error_bars;
pub mod filter;
pub mod further_input;
pub mod guard;
pub mod innovation_variance;
pub mod predictor;
pub mod recursion;
pub mod rls;
pub mod rpem;
pub mod sensitivities;
pub mod shape;
pub mod stability;
pub mod ud_covariance;
pub mod window;
pub mod zoh_operator;
