//! Definition of a recursive method.

use hoid_core::{recursion::Step, state::State};
use hoid_model::uncertainty::{Estimate, OperatorEstimate};

use crate::{change::Change, response::Response};

/// One sample of the loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Tracking error.
    pub e: f64,
    /// Control output.
    pub u: f64,
    /// External signal f_t, where it is known.
    pub reference: Option<f64>,
}

/// Report of a recursion on a sample that it has taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepOutcome {
    /// A-priori innovation.
    pub innovation: f64,
    /// True when stability or a bound made the step shorter.
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

/// A delay that is tracked, and that of the polynomials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delay {
    /// Delay of b0 of the polynomials, samples.
    pub nk: usize,
    /// Delay of the person.
    pub tau_e_s: Estimate,
}

/// A recursive method. Samples are finite and not too large.
pub trait Recursion: State + Send + Sync {
    /// Takes a sample: filters and estimate move on.
    fn step(&mut self, sample: Sample) -> StepOutcome;
    /// Takes a sample into the filters alone; the estimate stays.
    fn follow(&mut self, sample: Sample) -> StepOutcome;
    /// As `follow`, where the output is missing and the one-step prediction takes its place.
    fn bridge(&mut self, sample: Sample);
    /// theta in the order of [`hoid_model::Orders::parameter_names`].
    fn theta(&self) -> &[f64];
    /// Covariance of theta by rows; false when there is none yet.
    fn covariance(&self, into: &mut [f64]) -> bool;
    /// Innovation variance as tracked.
    fn innovation_variance(&self) -> f64;
    /// Logarithm of the odds of a recent change, where the recursion has them.
    fn change_odds(&self) -> Option<f64> {
        None
    }
    /// The change that was declared at the last sample.
    fn change(&self) -> Option<Change> {
        None
    }
    /// Number of fits that failed, and why the last did, for methods that fit.
    fn failures(&self) -> Option<(usize, String)> {
        None
    }
    /// The response at a frequency in rad/s, where it is not that of the polynomials.
    fn response(&self, _omega_rad_s: f64) -> Option<Response> {
        None
    }
    /// Its real and imaginary part alone.
    fn response_value(&self, _omega_rad_s: f64) -> Option<[f64; 2]> {
        None
    }
    /// Multiplies the covariance of its gain by a factor; false if it has none.
    fn scale_covariance(&mut self, _factor: f64) -> bool {
        false
    }
    /// The delay at present, if it is tracked.
    fn delay(&self) -> Option<Delay> {
        None
    }
    /// The operator, where it is what the recursion estimates.
    fn operator(&self) -> Option<OperatorEstimate> {
        None
    }
}
