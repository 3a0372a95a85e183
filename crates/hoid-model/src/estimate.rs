//! A number with its standard error.

use std::fmt;

use crate::numbers::{DASH, with_uncertainty};

/// A number with its standard error; the standard error is `None` if it cannot be determined (for example, for a fixed
/// delay or a singular information matrix).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimate {
    /// Estimated value.
    pub value: f64,
    /// Standard error of the estimate.
    pub standard_error: Option<f64>,
}

impl Estimate {
    /// Returns an estimate with the given variance of its error. A variance that is negative or not finite gives no
    /// standard error.
    pub fn with_variance(value: f64, variance: f64) -> Self {
        Self {
            value,
            standard_error: (variance >= 0.0 && variance.is_finite()).then(|| variance.sqrt()),
        }
    }

    /// Returns an estimate without a standard error.
    pub fn fixed(value: f64) -> Self {
        Self {
            value,
            standard_error: None,
        }
    }
}

impl fmt::Display for Estimate {
    /// Formats `value ± standard error` with two significant digits of the standard error; without a standard error,
    /// only the value.
    ///
    /// ```
    /// # use hoid_model::uncertainty::Estimate;
    /// assert_eq!(Estimate::with_variance(11.2499, 0.0099).to_string(), "11.250 ± 0.099");
    /// ```
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (value, error) = with_uncertainty(self.value, self.standard_error);
        f.write_str(&value)?;
        if error == DASH {
            return Ok(());
        }
        write!(f, " ± {error}")
    }
}
