//! Numbers with Monte Carlo errors, and the errors of their differences, means and ratios.

/// A number and its Monte Carlo error; the error is zero if the number is not random.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// The number; NaN if too few replications give a value.
    pub value: f64,
    /// Monte Carlo error of the number.
    pub error: f64,
}

impl Value {
    /// The magnitude of the number, with the same error.
    #[must_use]
    pub fn abs(self) -> Self {
        Self {
            value: self.value.abs(),
            ..self
        }
    }

    /// The difference from a number that is based on other replications.
    #[must_use]
    pub fn minus(self, other: Self) -> Self {
        Self {
            value: self.value - other.value,
            error: self.error.hypot(other.error),
        }
    }

    /// The mean of numbers that are based on different replications.
    #[must_use]
    pub fn mean(values: &[Self]) -> Self {
        let n = values.len() as f64;
        Self {
            value: values.iter().map(|v| v.value).sum::<f64>() / n,
            error: values.iter().map(|v| v.error * v.error).sum::<f64>().sqrt() / n,
        }
    }

    /// The ratio to a number that is based on other replications; the error is correct to first order.
    #[must_use]
    pub fn divided_by(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self {
            value,
            error: value.abs() * (self.error / self.value).hypot(other.error / other.value),
        }
    }

    /// Percentage by which the number is smaller than a number that is based on other replications.
    #[must_use]
    pub fn percent_less_than(self, other: Self) -> Self {
        let ratio = self.divided_by(other);
        Self {
            value: 100.0 * (1.0 - ratio.value),
            error: 100.0 * ratio.error,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_differences_and_ratios_are_propagated() {
        let (a, b) = (Value { value: 8.0, error: 0.3 }, Value { value: 2.0, error: 0.4 });
        assert_eq!(a.minus(b), Value { value: 6.0, error: 0.5 });
        assert_eq!(
            Value::mean(&[a, b]),
            Value {
                value: 5.0,
                error: 0.25
            }
        );
        let ratio = a.divided_by(b);
        // sqrt((0.3 / 8)^2 + (0.4 / 2)^2) = 0.203485
        assert!((ratio.value - 4.0).abs() < 1e-12 && (ratio.error - 4.0 * 0.203_485).abs() < 1e-5);
        let less = b.percent_less_than(a);
        assert!((less.value - 75.0).abs() < 1e-12 && (less.error - 25.0 * 0.203_485).abs() < 1e-3);
    }
}
