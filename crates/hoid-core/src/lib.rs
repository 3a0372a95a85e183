//! Real-time kernel of hoid: what runs once per sample, beside a control loop.
//!
//! `no_std`, no allocation, no dependency but elementary functions (`libm`): every routine works in memory that the caller owns and
//! has a bounded number of operations. The batch estimators and the simulator stand on the same routines, so that a recursion and its batch twin
//! cannot differ in their filters.
//!
//! | module | what it holds |
//! |---|---|
//! | [`delay`] | a delay line of fixed length |
//! | [`divided_differences`] | divided differences of the exponential: second-order holds |
//! | [`filter`] | rational filters `C(q^-1)/D(q^-1)` over slices |
//! | [`held_operator`] | exact zero-order hold of the operator with any delay, and its Jacobian |
//! | [`stability`] | Schur-Cohn test: are all roots inside a circle? |
//! | [`factored`] | covariance `U D U'` |
//! | [`adaptation`] | gain, ways of forgetting, guard against windup |
//! | [`error_bars`] | covariance of the estimate whatever the gain, innovation variance |
//! | [`window`] | the adaptation of a rectangular window |
//! | [`predictor`] | one-step predictor of the general model with its gradient |
//! | [`rls`], [`rpem`], [`physical`] | recursive least squares, prediction-error method in polynomials and in physical parameters |
//! | [`adaptive`] | a bank of hypotheses of when the person changed |
//! | [`recursion`] | outcome of a step, stability of a step |
//! | [`mod@state`] | the numbers that change, to save a recursion and go on elsewhere |
#![no_std]

#[cfg(test)]
extern crate std;

#[macro_use]
pub mod state;

pub mod adaptation;
pub mod adaptive;
pub mod delay;
pub mod divided_differences;
pub mod error_bars;
pub mod filter;
pub mod held_operator;
pub mod innovation_variance;
pub mod physical;
pub mod predictor;
pub mod recursion;
pub mod rls;
pub mod rpem;
pub mod sensitivities;
pub mod shape;
pub mod stability;
pub mod ud_covariance;
pub mod window;
