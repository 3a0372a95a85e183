//! Interface of a recursive method.

use hoid_core::{recursion::Step, state::State};
use hoid_model::uncertainty::{Estimate, OperatorEstimate};

use crate::{change::Change, further_input::FurtherOperator, response::Response};

/// One sample of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Tracking error.
    pub e: f64,
    /// Control output.
    pub u: f64,
    /// Value of the further input ([`crate::TrackedInput`]) or, for methods that use one, of the external signal f_t;
    /// `None` if it is not known.
    pub reference: Option<f64>,
}

/// Outcome of a sample that a recursion has taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepOutcome {
    /// A-priori innovation.
    pub innovation: f64,
    /// True if stability or a bound shortened the step.
    pub shortened: bool,
}

impl From<Step> for StepOutcome {
    fn from(step: Step) -> Self {
        Self {
            innovation: step.innovation,
            shortened: step.shortened,
        }
    }
}

/// The tracked delay, and the delay of the polynomials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delay {
    /// Delay of b0 of the polynomials, samples.
    pub nk: usize,
    /// Delay of the person.
    pub tau_e_s: Estimate,
}

/// A recursive method. The samples that it receives are finite and not too large.
pub trait Recursion: State + Send + Sync {
    /// Takes a sample: filters and estimate are updated.
    fn step(&mut self, sample: Sample) -> StepOutcome;
    /// Takes a sample into the filters only; the estimate stays constant.
    fn step_without_update(&mut self, sample: Sample) -> StepOutcome;
    /// Like `step_without_update`, for a missing output, which the one-step prediction replaces.
    fn bridge(&mut self, sample: Sample);
    /// Returns theta in the order of [`hoid_model::Orders::parameter_names`].
    fn theta(&self) -> &[f64];
    /// Writes the covariance of theta by rows; returns false while there is none.
    fn covariance(&self, into: &mut [f64]) -> bool;
    /// Returns the tracked innovation variance.
    fn innovation_variance(&self) -> f64;
    /// Returns the evidence of a recent change, as [`Change::odds`], for methods that compute it.
    fn change_odds(&self) -> Option<f64> {
        None
    }
    /// Returns the change that was declared at the last sample, if there was one.
    fn change(&self) -> Option<Change> {
        None
    }
    /// Returns the last declared change if its parameters were estimated again at the last sample, from more data.
    fn revised_change(&self) -> Option<Change> {
        None
    }
    /// Returns the number of failed fits and the reason for the last failure, for methods that fit.
    fn failures(&self) -> Option<(usize, String)> {
        None
    }
    /// Returns the response at a frequency in rad/s, if it differs from the response of the polynomials.
    fn response(&self, _omega_rad_s: f64) -> Option<Response> {
        None
    }
    /// Returns the real and imaginary parts of the response at a frequency in rad/s, without covariance, if it differs
    /// from the response of the polynomials.
    fn response_value(&self, _omega_rad_s: f64) -> Option<[f64; 2]> {
        None
    }
    /// Returns the response to the further input, for methods that estimate it.
    fn further_operator(&self) -> Option<FurtherOperator> {
        None
    }
    /// Returns the response to the further input at a frequency in rad/s, if it differs from the response of the
    /// polynomials.
    fn further_response(&self, _omega_rad_s: f64) -> Option<Response> {
        None
    }
    /// Multiplies the covariance in the gain, P, by a factor; returns false if there is none.
    fn scale_covariance(&mut self, _factor: f64) -> bool {
        false
    }
    /// Returns the current delay, if it is tracked.
    fn delay(&self) -> Option<Delay> {
        None
    }
    /// Returns the operator, for methods that estimate it.
    fn operator(&self) -> Option<OperatorEstimate> {
        None
    }
}
