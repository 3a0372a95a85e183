//! Errors of identification.

use hoid_model::ModelError;
use thiserror::Error;

/// Errors that stop a fit. How a search *ended* is data in the fit ([`crate::Termination`]), not an error.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum IdentError {
    /// The model or a record is invalid by itself.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// No record at all.
    #[error("no record was given; a fit needs at least one")]
    NoRecords,
    /// A structure with an input, and a record without one.
    #[error(
        "{structure} describes how an output follows an input, but record {label} has no input; give one, or use ar, ma or arma"
    )]
    NoInput {
        /// The structure.
        structure: String,
        /// The record.
        label: String,
    },
    /// Records that were sampled differently cannot share a discrete model.
    #[error(
        "record {label} has the sample time {found} s, the first record {expected} s; resample them to one rate, for example with --new-fs {rate}, or fit them separately",
        rate = lower_rate(*found, *expected)
    )]
    MixedSampling {
        /// The record that differs.
        label: String,
        /// Its sample time, s.
        found: f64,
        /// The sample time of the first record, s.
        expected: f64,
    },
    /// Fewer residuals than unknowns.
    #[error(
        "record {label} has {samples} samples; {orders} with its delay and initial states needs more than {needed}; use a longer record or lower orders"
    )]
    TooFewSamples {
        /// The record.
        label: String,
        /// Number of its samples.
        samples: usize,
        /// The orders.
        orders: String,
        /// Number of samples that are used up before the first degree of freedom is left.
        needed: usize,
    },
    /// A delay for which nothing of the record is left.
    #[error("the delay nk = {nk} is not shorter than record {label} with {samples} samples; check nk and the sampling")]
    DelayTooLong {
        /// The delay in samples.
        nk: usize,
        /// The record.
        label: String,
        /// Number of its samples.
        samples: usize,
    },
    /// A constant signal.
    #[error(
        "{channel} of record {label} is {value} in every sample: there is nothing to identify; check the column and the span"
    )]
    NoExcitation {
        /// Name of the channel.
        channel: String,
        /// The record.
        label: String,
        /// Its constant value.
        value: f64,
    },
    /// Linearly dependent regressors.
    #[error(
        "the regressors are singular: {columns}; the record does not excite so many parameters: lower the orders or use a record with more frequencies"
    )]
    SingularRegressors {
        /// The dependent columns by name.
        columns: String,
    },
    /// Linearly dependent instruments, or instruments that do not follow the regressors.
    #[error(
        "the instruments are singular: {dependence}; the signal that they are made from does not excite so many \
         parameters: lower the orders or use one with more frequencies"
    )]
    SingularInstruments {
        /// The dependence between instruments.
        dependence: String,
    },
    /// A channel that a record does not have.
    #[error("record {label} has no channel {channel} to make instruments from; it has {available}")]
    NoChannel {
        /// The channel that was requested.
        channel: String,
        /// The record.
        label: String,
        /// The available channels.
        available: String,
    },
    /// A singular information matrix.
    #[error(
        "the data do not determine {parameters}: the information matrix is singular (a pole and a zero that cancel, or too little excitation); lower the orders"
    )]
    SingularInformation {
        /// The parameters of the undetermined combination.
        parameters: String,
    },
    /// An unusable start of the search.
    #[error("the start cannot be used: {reason}")]
    BadStart {
        /// The reason, and the remedy.
        reason: String,
    },
    /// A name that is not a parameter of the model.
    #[error("the model has no parameter {name}; it has {available}")]
    UnknownParameter {
        /// The name.
        name: String,
        /// The available parameters.
        available: String,
    },
    /// An option that is not valid, alone or with the others.
    #[error("{option}: found {found}; expected {expected}")]
    BadOption {
        /// The option.
        option: String,
        /// The value given.
        found: String,
        /// The expected value.
        expected: String,
    },
    /// An option that contradicts another, or does not fit the estimator.
    #[error("{name}: {reason}")]
    Option {
        /// Its name.
        name: &'static str,
        /// The reason: the value found, the expected value, the remedy.
        reason: String,
    },
    /// No start led to a finite loss.
    #[error("no start of the search gave a finite loss; check the scale of the data and the orders")]
    NoFiniteLoss,
    /// A search that found no minimum where a minimum is necessary.
    #[error("the search did not converge ({reason}); lower the orders, or use a longer window")]
    NotSettled {
        /// How it ended.
        reason: String,
    },
    /// An empty range of orders.
    #[error("the range {range} is empty; write LO..HI with LO <= HI")]
    EmptyRange {
        /// The range as given.
        range: String,
    },
    /// A span that holds no whole number of periods.
    #[error(
        "record {label} has {samples} samples ({span_s} s), which is not a whole number of periods of {period_s} s; {remedy}"
    )]
    NotWholePeriods {
        /// The record.
        label: String,
        /// Samples of the span.
        samples: usize,
        /// Its duration, s.
        span_s: f64,
        /// The period of the excitation, s.
        period_s: f64,
        /// The nearest suitable span.
        remedy: String,
    },
    /// A line of the excitation at which a channel has no power.
    #[error(
        "{channel} of record {label} has no power at the line {omega_rad_s} rad/s; leave this line out, or check the period and the span"
    )]
    NoLinePower {
        /// Name of the channel.
        channel: String,
        /// The record.
        label: String,
        /// The line, rad/s.
        omega_rad_s: f64,
    },
    /// A line above the Nyquist frequency.
    #[error(
        "the line {omega_rad_s} rad/s is not below half the sampling frequency of record {label}, {nyquist_rad_s} rad/s; leave it out"
    )]
    LineBeyondNyquist {
        /// The line, rad/s.
        omega_rad_s: f64,
        /// The record.
        label: String,
        /// Half its sampling frequency, rad/s.
        nyquist_rad_s: f64,
    },
}

/// Lower of the rates of two sample times, in Hz, to which both can be converted.
fn lower_rate(a_s: f64, b_s: f64) -> String {
    let hz = 1.0 / a_s.max(b_s);
    let digits = format!("{hz:.6}");
    digits.trim_end_matches('0').trim_end_matches('.').to_owned()
}
