//! Errors of models, records and conversions.

use thiserror::Error;

use crate::UnknownName;

/// Reason why a model, a record or a conversion is not possible. Each message contains the quantity, the value found,
/// the expected value and, where useful, the remedy.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// A number outside its admissible range.
    #[error("{quantity} is {found}, expected {expected}")]
    OutOfRange {
        /// Name of the quantity, with its symbol and unit.
        quantity: &'static str,
        /// Value that was given.
        found: f64,
        /// Range of valid values.
        expected: &'static str,
    },
    /// A name that is not one of the available names.
    #[error(transparent)]
    UnknownName(#[from] UnknownName),
    /// A sample that is NaN or infinite.
    #[error(
        "channel {channel}: the value at sample {index} is {value}, expected a finite number; remove or repair the sample before identification"
    )]
    NotFinite {
        /// Name of the channel that contains the sample.
        channel: String,
        /// Index of the sample, from 0.
        index: usize,
        /// Value of the sample.
        value: f64,
    },
    /// Channels of one record that differ in length.
    #[error("channel {channel} has {found} samples, expected {expected} as in channel {reference}")]
    LengthMismatch {
        /// Name of the channel with a different length.
        channel: String,
        /// Length of this channel in samples.
        found: usize,
        /// Length of the reference channel in samples.
        expected: usize,
        /// Name of the reference channel.
        reference: String,
    },
    /// Invalid parameters of an operator.
    #[error("{reason}")]
    Operator {
        /// Description of the problem.
        reason: String,
    },
    /// A record without samples.
    #[error("the record {label} has no samples; check the columns and the time span")]
    EmptyRecord {
        /// Label of the record.
        label: String,
    },
    /// A channel name that is already taken.
    #[error("channel {name} already exists; give each channel its own name")]
    DuplicateChannel {
        /// Name of the channel.
        name: String,
    },
    /// A channel that the record does not have.
    #[error("the record has no channel {name}; it has {available}")]
    NoSuchChannel {
        /// The requested name.
        name: String,
        /// Names of the channels of the record.
        available: String,
    },
    /// A decimation that is not possible for a record.
    #[error("decimation of {label}: found {found}, expected {expected}")]
    Decimation {
        /// Label of the record, stream or option.
        label: String,
        /// Value found, such as the factor or the length of the record.
        found: String,
        /// Condition that this value does not satisfy.
        expected: String,
    },
    /// Two records that cannot be joined.
    #[error("{label} cannot be joined: found {found}, expected {expected}")]
    Joined {
        /// Label of the second record.
        label: String,
        /// Differences between the two records.
        found: String,
        /// Requirements for joining two records.
        expected: &'static str,
    },
    /// A time span without samples of the record.
    #[error("the span {from_s} to {to_s} s contains no samples: the record covers {start_s} to {end_s} s")]
    EmptySpan {
        /// Start of the span, s.
        from_s: f64,
        /// End of the span, s.
        to_s: f64,
        /// Start of the record, s.
        start_s: f64,
        /// End of the record, s.
        end_s: f64,
    },
    /// Polynomial orders that contradict each other or the structure.
    #[error("orders {found}: {expected}")]
    Orders {
        /// The orders as given.
        found: String,
        /// Description of the problem, and the remedy.
        expected: String,
    },
    /// A transfer function that is invalid, or to which a method does not apply.
    #[error("transfer function {found}: {expected}")]
    TransferFunction {
        /// The transfer function as given.
        found: String,
        /// Description of the problem, and the remedy.
        expected: String,
    },
    /// A discrete model without a continuous counterpart.
    #[error("not convertible: {0}")]
    NotConvertible(#[from] NotConvertible),
    /// A noise level that cannot be reached with any remnant gain.
    #[error(
        "the noise level P_n = var(n)/var(u) = {requested_level} cannot be reached with remnant order {order}: the largest \
         reachable level is {largest:.4}; request a lower level or use the definition var(u_n)/var(u)"
    )]
    UnreachableNoiseLevel {
        /// Requested noise level P_n.
        requested_level: f64,
        /// Order of the remnant filter.
        order: usize,
        /// Noise level in the limit of an infinite gain, which cannot be exceeded.
        largest: f64,
    },
    /// An unstable closed loop, which has no stationary variance and no margins.
    #[error("the closed loop of operator and controlled element is not stable: {reason}")]
    UnstableLoop {
        /// Evidence of the instability.
        reason: String,
    },
}

/// The reason why a discrete model has no counterpart with physical meaning in continuous time.
#[derive(Debug, Clone, PartialEq, Error, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum NotConvertible {
    /// The form of the operator is not a gain with a lead.
    #[error("the operator has the form {form}, which has parameters other than K_e, T_L and K_e_dot")]
    OtherForm {
        /// Name of the form.
        form: String,
    },
    /// Polynomials that correspond to no operator of the family.
    #[error("the polynomials do not correspond to any operator of the family: {reason}")]
    NotOfTheFamily {
        /// Description of the problem.
        reason: String,
    },
    /// A pole on the closed negative real axis has no real logarithm.
    #[error(
        "the pole z = {pole:.6} lies on the closed negative real axis, so no real continuous-time system corresponds \
         to the model"
    )]
    NegativeRealPole {
        /// Value of the pole in z.
        pole: f64,
    },
    /// The square `omega_nm^2` would not be positive.
    #[error(
        "the continuous-time denominator s^2 + {a1:.4} s + {a2:.3e} gives no positive omega_nm^2: the poles are real, and they have opposite signs or at least one is zero"
    )]
    NoNaturalFrequency {
        /// Coefficient of s in the continuous denominator.
        a1: f64,
        /// Constant coefficient of the continuous denominator.
        a2: f64,
    },
    /// `b0 + b1 = 0`: the model does not respond to a constant error, so T_L = K_e_dot / K_e does not exist.
    #[error("the gain K_e is zero (b0 + b1 = 0), so the lead time T_L = K_e_dot / K_e does not exist")]
    ZeroGain,
    /// Polynomial orders that differ from those of the operator model.
    #[error("the operator model needs two coefficients in B and two poles, found nb = {nb} and {poles} poles")]
    OtherOrders {
        /// Number of coefficients of B.
        nb: usize,
        /// Number of poles of B/F (or B/A).
        poles: usize,
    },
    /// The poles of the system are divided between A and F.
    #[error("the operator model needs its two poles either in A or in F, found na = {na} and nf = {nf}")]
    PolesInBoth {
        /// Number of coefficients of A.
        na: usize,
        /// Number of coefficients of F.
        nf: usize,
    },
    /// A model without delay: after a zero-order hold the delay is at least one sample.
    #[error("nk = 0: a zero-order hold delays by at least one sample, so tau_e = (nk - 1) Ts would be negative")]
    NoDelay,
    /// A coefficient that is not a finite number.
    #[error("the coefficient {name} is {value}, expected a finite number")]
    NotFinite {
        /// Name of the coefficient.
        name: String,
        /// Value of the coefficient.
        value: f64,
    },
    /// A noise polynomial that does not correspond to a remnant filter.
    #[error("the noise model does not correspond to a remnant filter of order {order}: {reason}")]
    NotARemnantFilter {
        /// Order m of the noise polynomial.
        order: usize,
        /// Description of the problem.
        reason: String,
    },
}
