//! Types of values, and bounds of numbers.

use std::fmt;

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// True or false.
    Flag,
    /// An integer.
    Count,
    /// A number; `inf` if the bounds allow it.
    Number,
    /// Samples (`256`), seconds (`2.56s`) or `inf`.
    Memory,
    /// A number, or `off`.
    NumberOrOff,
    /// A number, or the option without a value, which means the number given here.
    NumberOrDefault(&'static str),
    /// A transfer function of s, such as `90/(s(s+6))`.
    Element,
    /// `LO..HI`, two finite numbers in order.
    Span,
    /// `LO..HI`, where either end may be missing.
    OpenSpan,
    /// An integer, or `LO..HI` for a search over integers.
    Counts,
    /// A number, or `LO..HI`.
    NumberOrSpan,
    /// A delay: samples (`29`, `20..40`) or seconds (`0.28s`, `0.1s..0.4s`).
    Delay,
    /// A guess and its weight, `VALUE:WEIGHT`.
    Guess,
    /// One word of this list.
    Choice(&'static [&'static str]),
    /// A text, such as the name of a channel.
    Channel,
    /// Names, such as `K,T_L`.
    Names,
    /// Prior knowledge about a person: `population`, `none`, `NAME=CENTRE:SPREAD,..`, or the file of a fit.
    Prior,
    /// Values of the same type, each with a name, such as `b0=256,f=inf`.
    Named(&'static Kind),
}

/// Admissible range of a number.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    /// Any number.
    Any,
    /// Any finite number.
    Finite,
    /// More than zero, finite or infinite.
    Positive,
    /// More than zero and finite.
    PositiveFinite,
    /// At least zero and finite.
    NonNegative,
    /// At least this value, and finite.
    AtLeast(f64),
    /// More than the first value and less than the second.
    Between(f64, f64),
    /// More than the first value, and at most the second.
    UpTo(f64, f64),
}

impl Bounds {
    /// True if the number is within the bounds.
    pub fn contains(self, x: f64) -> bool {
        match self {
            Self::Any => !x.is_nan(),
            Self::Finite => x.is_finite(),
            Self::Positive => x > 0.0,
            Self::PositiveFinite => x > 0.0 && x.is_finite(),
            Self::NonNegative => x >= 0.0 && x.is_finite(),
            Self::AtLeast(least) => x >= least && x.is_finite(),
            Self::Between(low, high) => x > low && x < high,
            Self::UpTo(low, high) => x > low && x <= high,
        }
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => f.write_str("a number"),
            Self::Finite => f.write_str("a finite number"),
            Self::Positive => f.write_str("a positive number, or inf"),
            Self::PositiveFinite => f.write_str("a positive finite number"),
            Self::NonNegative => f.write_str("a finite nonnegative number"),
            Self::AtLeast(least) => write!(f, "{least} or more"),
            Self::Between(low, high) => write!(f, "a number between {low} and {high}"),
            Self::UpTo(low, high) => write!(f, "a number above {low} and up to {high}"),
        }
    }
}
