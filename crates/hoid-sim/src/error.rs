//! Reasons why a simulation gives no record.

use hoid_model::ModelError;
use thiserror::Error;

/// Errors of a simulation.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SimError {
    /// The scenario is invalid.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The closed loop is unstable and has overflowed.
    #[error(
        "the loop diverges: {signal} is not finite at t = {time_s:.2} s; check the gains, the delay and the controlled element of {scenario}"
    )]
    Diverged {
        /// Name of the signal that is not finite.
        signal: &'static str,
        /// Time of the first sample that is not finite, in s.
        time_s: f64,
        /// Name of the scenario.
        scenario: String,
    },
    /// The control of the operator depends on the error of the same sample.
    #[error(
        "the operator of {scenario} responds to an error within the same sample: its delay is {tau_e_s} s, it has no \
         neuromuscular part and its response is not strictly proper; expected a delay of at least half a sample \
         ({half_a_sample_s} s): increase tau_e, reduce the sample time, or give omega_nm and zeta_nm"
    )]
    DirectResponse {
        /// Name of the scenario.
        scenario: String,
        /// Delay of the operator in s.
        tau_e_s: f64,
        /// Half the sample time in s, with which the delay is compared.
        half_a_sample_s: f64,
    },
    /// No acceptable person was found in the ranges of a population.
    #[error(
        "none of {draws} draws of the form {form} on the element {plant} gives an acceptable loop: widen the ranges of the population, or reduce its spreads"
    )]
    NoAcceptablePerson {
        /// Form of the operator.
        form: String,
        /// Controlled element.
        plant: String,
        /// Number of draws.
        draws: usize,
    },
    /// The noise and the run have different lengths.
    #[error("the noise has {found} samples, but the run needs {expected} (run-in and measurement)")]
    NoiseLength {
        /// Number of samples of the given noise.
        found: usize,
        /// Number of samples of the run.
        expected: usize,
    },
    /// This processor does not support the instruction set.
    #[error("this processor does not have the instruction set that was requested; use InstructionSet::Best")]
    NoSuchInstructionSet,
    /// A value of the noise is not finite.
    #[error("the noise at sample {index} is {value}, expected a finite number")]
    NoiseNotFinite {
        /// Index of the sample, counted from 0.
        index: usize,
        /// Value of the noise at this sample.
        value: f64,
    },
}
