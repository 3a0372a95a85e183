//! Errors of identification.

use hoid_model::ModelError;
use thiserror::Error;

/// Errors that stop a fit. The termination of a search is not an error but part of the fit ([`crate::Termination`]).
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum IdentError {
    /// The model or a record is invalid in itself.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// No record was given.
    #[error("no record was given; a fit needs at least one record")]
    NoRecords,
    /// The structure has an input, but a record has none.
    #[error("{structure} needs an input, but record {label} has no input; give an input, or use ar, ma or arma")]
    NoInput {
        /// Name of the structure.
        structure: String,
        /// Label of the record.
        label: String,
    },
    /// The records have different sample times and therefore cannot share a discrete-time model.
    #[error(
        "record {label} has a sample time of {found} s, but the first record has {expected} s; resample them to one \
         rate, for example with --new-fs {rate}, or fit them separately",
        rate = lower_rate_text(*found, *expected)
    )]
    MixedSampling {
        /// Label of the record that differs from the first.
        label: String,
        /// Sample time of this record, s.
        found: f64,
        /// Sample time of the first record, s.
        expected: f64,
    },
    /// The number of residuals does not exceed the number of unknowns.
    #[error(
        "record {label} has {samples} samples, but {orders} with the delay and initial states needs more than \
         {needed}; use a longer record or lower orders"
    )]
    TooFewSamples {
        /// Label of the record.
        label: String,
        /// Number of samples of the record.
        samples: usize,
        /// Orders of the model.
        orders: String,
        /// Number of samples that the record must exceed.
        needed: usize,
    },
    /// The delay is at least as long as the record.
    #[error(
        "the delay nk = {nk} must be below the {samples} samples of record {label}; check nk and the sampling rate"
    )]
    DelayTooLong {
        /// Delay in samples.
        nk: usize,
        /// Label of the record.
        label: String,
        /// Number of samples of the record.
        samples: usize,
    },
    /// A signal is constant.
    #[error("{channel} of record {label} is constant: there is nothing to identify; check the column and the span")]
    NoExcitation {
        /// Name of the channel.
        channel: String,
        /// Label of the record.
        label: String,
    },
    /// The regressors are linearly dependent.
    #[error(
        "the regressors are singular: {columns}; the record does not excite this many parameters: lower the orders or \
         use a record with more frequencies"
    )]
    SingularRegressors {
        /// Names of the dependent columns.
        columns: String,
    },
    /// The instruments are linearly dependent or uncorrelated with the regressors.
    #[error(
        "the instruments are singular: {dependence}; their source signal does not excite this many parameters: lower \
         the orders or use a signal with more frequencies"
    )]
    SingularInstruments {
        /// The dependence between instruments.
        dependence: String,
    },
    /// A record lacks a requested channel.
    #[error("record {label} has no channel {channel} for the instruments; its channels are {available}")]
    NoChannel {
        /// Name of the requested channel.
        channel: String,
        /// Label of the record.
        label: String,
        /// Names of the available channels.
        available: String,
    },
    /// The information matrix is singular.
    #[error(
        "the data do not determine {parameters}: the information matrix is singular (a pole and a zero that cancel, or too little excitation); lower the orders"
    )]
    SingularInformation {
        /// Names of the parameters in the undetermined combination.
        parameters: String,
    },
    /// The start of the search cannot be used.
    #[error("the start cannot be used: {reason}")]
    BadStart {
        /// Reason why the start cannot be used, and remedy.
        reason: String,
    },
    /// The model has no parameter with this name.
    #[error("the model has no parameter {name}; it has {available}")]
    UnknownParameter {
        /// The unknown name.
        name: String,
        /// Names of the available parameters.
        available: String,
    },
    /// An option is invalid, by itself or in combination with others.
    #[error("{option}: found {found}; expected {expected}")]
    BadOption {
        /// Description of the option.
        option: String,
        /// The invalid value.
        found: String,
        /// The expected value.
        expected: String,
    },
    /// An option contradicts another one or does not apply to the estimator.
    #[error("{name}: {reason}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Reason: value found, expected value, remedy.
        reason: String,
    },
    /// No start led to a finite loss.
    #[error("no start of the search gave a finite loss; check the scale of the data and the orders")]
    NoFiniteLoss,
    /// The output is the input times a constant at each sample.
    #[error(
        "in record {label} the output is {factor} times the input at each sample, expected the delayed response of a \
         person: check which columns are the input (--input) and the output (--output)"
    )]
    OutputIsInput {
        /// Label of the record.
        label: String,
        /// The constant.
        factor: String,
    },
    /// The search did not converge, but the result requires a minimum.
    #[error("the search did not converge ({reason}); lower the orders, or use a longer window")]
    NotSettled {
        /// Reason why the search stopped.
        reason: String,
    },
    /// A range of orders is empty.
    #[error("the range {range} is empty; write LO..HI with LO <= HI")]
    EmptyRange {
        /// The range as given.
        range: String,
    },
    /// A span does not contain a whole number of periods.
    #[error(
        "record {label} has {samples} samples ({span_s} s), which is not a whole number of periods of {period_s} s; {remedy}"
    )]
    NotWholePeriods {
        /// Label of the record.
        label: String,
        /// Number of samples in the span.
        samples: usize,
        /// Duration of the span, s.
        span_s: f64,
        /// Period of the excitation, s.
        period_s: f64,
        /// Remedy: the nearest suitable span.
        remedy: String,
    },
    /// A channel has no power at a line of the excitation.
    #[error(
        "{channel} of record {label} has no power at the line of {omega_rad_s} rad/s; omit this line, or check the \
         period and the span"
    )]
    NoLinePower {
        /// Name of the channel.
        channel: String,
        /// Label of the record.
        label: String,
        /// Frequency of the line, rad/s.
        omega_rad_s: f64,
    },
    /// A line is at or above the Nyquist frequency.
    #[error(
        "the line at {omega_rad_s} rad/s must be below the Nyquist frequency of record {label}, {nyquist_rad_s} \
         rad/s; omit this line"
    )]
    LineBeyondNyquist {
        /// Frequency of the line, rad/s.
        omega_rad_s: f64,
        /// Label of the record.
        label: String,
        /// Nyquist frequency of the record, rad/s.
        nyquist_rad_s: f64,
    },
}

/// Returns the lower of the sampling frequencies that belong to two sample times, in Hz: records with either sample
/// time can be resampled to it.
fn lower_rate_text(a_s: f64, b_s: f64) -> String {
    let hz = 1.0 / a_s.max(b_s);
    let digits = format!("{hz:.6}");
    digits.trim_end_matches('0').trim_end_matches('.').to_owned()
}
