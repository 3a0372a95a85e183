//! Dual numbers, which carry their derivatives: `x + sum_i x_i eps_i`, `eps_i eps_j = 0`.
//!
//! Results computed with dual numbers contain their partial derivatives, which are exact except for rounding (forward
//! differentiation; A. Griewank and A. Walther, *Evaluating Derivatives*, 2008, chapter 3).

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Number of partial derivatives: the largest number of parameters of a form.
pub const PARTIAL_COUNT: usize = 6;

/// A value and its partial derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual {
    /// Value of the number.
    pub value: f64,
    /// Partial derivatives of the value.
    pub partials: [f64; PARTIAL_COUNT],
}

impl Dual {
    /// Returns a constant, whose derivatives are zero.
    pub const fn constant(value: f64) -> Self {
        Self {
            value,
            partials: [0.0; PARTIAL_COUNT],
        }
    }

    /// Returns the variable with this index, whose derivative with respect to itself is one.
    pub fn variable(value: f64, index: usize) -> Self {
        let mut partials = [0.0; PARTIAL_COUNT];
        partials[index] = 1.0;
        Self { value, partials }
    }

    /// Applies the chain rule to a function f of this number x: `value` is f(x), `slope` is f'(x).
    fn chain(self, value: f64, slope: f64) -> Self {
        Self {
            value,
            partials: self.partials.map(|p| slope * p),
        }
    }

    /// Returns the exponential of the number.
    pub fn exp(self) -> Self {
        let e = self.value.exp();
        self.chain(e, e)
    }

    /// Returns the number multiplied by a constant.
    pub fn scaled(self, factor: f64) -> Self {
        self.chain(factor * self.value, factor)
    }
}

impl From<f64> for Dual {
    fn from(value: f64) -> Self {
        Self::constant(value)
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            partials: std::array::from_fn(|i| self.partials[i] + other.partials[i]),
        }
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

// The rules of differentiation contain sums and products that the lint reports as suspicious arithmetic.
#[allow(clippy::suspicious_arithmetic_impl)]
impl Mul for Dual {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        Self {
            value: a * b,
            partials: std::array::from_fn(|i| a * other.partials[i] + b * self.partials[i]),
        }
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            partials: std::array::from_fn(|i| (self.partials[i] - value * other.partials[i]) / other.value),
        }
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self.scaled(-1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_finite_differences() {
        let f = |x: Dual, y: Dual| (x * y - x / y).exp() + (y - x).scaled(3.0) * -x;
        let at = |x: f64, y: f64| f(x.into(), y.into()).value;
        let (x, y, h) = (0.3, 1.7, 1e-6);
        let exact = f(Dual::variable(x, 0), Dual::variable(y, 1)).partials;
        assert!((exact[0] - (at(x + h, y) - at(x - h, y)) / (2.0 * h)).abs() < 1e-8);
        assert!((exact[1] - (at(x, y + h) - at(x, y - h)) / (2.0 * h)).abs() < 1e-8);
        assert_eq!(exact[2..], [0.0; PARTIAL_COUNT - 2]);
    }
}
