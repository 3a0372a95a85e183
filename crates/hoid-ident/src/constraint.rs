//! Prior knowledge of a parameter: a fixed value, bounds, or a weighted guess.

/// Constraint on a parameter: a fixed value or bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constraint {
    /// Held at this value.
    Fixed(f64),
    /// Kept between a lower and an upper bound; either may be infinite.
    Between(f64, f64),
}

impl Constraint {
    /// Returns the lower and the upper bound, which are equal for a fixed parameter.
    pub fn limits(self) -> (f64, f64) {
        match self {
            Self::Fixed(value) => (value, value),
            Self::Between(low, high) => (low, high),
        }
    }

    /// True if the numbers are valid: a finite value, or a lower bound that does not exceed the upper bound.
    pub fn is_valid(self) -> bool {
        match self {
            Self::Fixed(value) => value.is_finite(),
            Self::Between(low, high) => low <= high,
        }
    }
}

/// A guess theta* of one parameter: the loss increases by `weight (theta - theta*)^2`.
///
/// A weight of `sigma^2 / (N s^2)` corresponds to a prior standard deviation s, where sigma^2 is the innovation
/// variance and N the number of residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// The guess theta*.
    pub value: f64,
    /// Weight of the guess, in units of the loss divided by the squared unit of the parameter.
    pub weight: f64,
}
