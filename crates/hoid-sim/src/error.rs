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
        "the loop diverges: {signal} is not finite at t = {time_s:.2} s; check gains, delay and controlled element of {scenario}"
    )]
    Diverged {
        /// The signal.
        signal: &'static str,
        /// Time of the first bad sample, s.
        time_s: f64,
        /// Name of the scenario.
        scenario: String,
    },
    /// An operator whose control depends on the error of the same sample.
    #[error(
        "the operator of {scenario} responds to an error within the same sample: its delay is {tau_e_s} s, it has no \
         neuromuscular part and its response is not strictly proper; expected a delay of at least half a sample \
         ({half_a_sample_s} s): make tau_e longer or the sample time shorter, or give omega_nm and zeta_nm"
    )]
    AnswersAtOnce {
        /// Name of the scenario.
        scenario: String,
        /// Delay of the operator, s.
        tau_e_s: f64,
        /// Half the sample time, s.
        half_a_sample_s: f64,
    },
    /// Ranges in which no acceptable person is found.
    #[error(
        "none of {draws} draws of the form {form} on the element {plant} gives an acceptable loop: widen the ranges of the population, or reduce its spreads"
    )]
    NobodyFound {
        /// Form of the operator.
        form: String,
        /// Controlled element.
        plant: String,
        /// Number of draws.
        draws: usize,
    },
    /// Noise whose length differs from that of the run.
    #[error("the noise has {found} samples, but the run needs {expected} (run-in and measurement)")]
    NoiseLength {
        /// Number of samples given.
        found: usize,
        /// Number of samples needed.
        expected: usize,
    },
    /// An instruction set that this processor does not have.
    #[error("this processor does not have the instruction set that was requested; use InstructionSet::Best")]
    NoSuchInstructionSet,
    /// Noise that is not a number.
    #[error("the noise at sample {index} is {value}, expected a finite number")]
    NoiseNotFinite {
        /// Index of the sample, from 0.
        index: usize,
        /// The value.
        value: f64,
    },
}
