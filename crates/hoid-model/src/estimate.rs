//! A number with its standard error.

use std::fmt;

use crate::numbers::{DASH, with_uncertainty};

/// A number with its standard error; `None` if the data determine none (a fixed delay, a singular information matrix).
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Its standard error.
    pub standard_error: Option<f64>,
}

impl Estimate {
    /// Returns an estimate with the variance of its error; a variance that is not finite or negative gives no standard
    /// error.
    pub fn with_variance(value: f64, variance: f64) -> Self {
        Self {
            value,
            standard_error: (variance >= 0.0 && variance.is_finite()).then(|| variance.sqrt()),
        }
    }

    /// Returns a number without uncertainty.
    pub fn fixed(value: f64) -> Self {
        Self {
            value,
            standard_error: None,
        }
    }
}

impl fmt::Display for Estimate {
    /// Formats `value ± standard error` with two digits of the error, or only the value if there is no error.
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
