//! Parsing and formatting of transfer functions in s.
//!
//! Two notations are accepted. `NUM/DEN` with commas contains the coefficients in descending powers of s, such as
//! `90/1,6,0`. Any other text is an expression in s:
//!
//! ```text
//! sum     = product { (+ | -) product }
//! product = factor { (* | / | nothing) factor }
//! factor  = (+ | -) factor | power
//! power   = atom [ ^ whole number ]
//! atom    = number | s | ( sum ) | exp( -tau s )
//! ```
//!
//! so that `90/(s(s+6))`, `(2s+1)/(s^2+0.4s+1)` and `0.5(s+1)/s/(s+2)` have their expected meaning. A number precedes
//! the factor that it multiplies (`s2` is a mistyped `s^2`). A factor that follows a divisor without an operator in
//! between is ambiguous (`90/s(s+6)`) and is rejected; the error message shows both unambiguous notations. Common
//! factors of the numerator and the denominator are kept: `s/s^2` has a pole that is cancelled in its response. A delay
//! is a factor of the whole expression.
//!
//! | file | contents |
//! |---|---|
//! | `coefficients` | parser of lists of coefficients |
//! | `reader` | parser of expressions |
//! | `ratio` | quotient of polynomials that both parsers return |

mod coefficients;
mod ratio;
mod reader;
#[cfg(test)]
mod tests;

use std::{fmt, str::FromStr};

use self::{coefficients::coefficients, ratio::Ratio, reader::Reader};
use super::ContinuousTransferFunction;
use crate::ModelError;

impl FromStr for ContinuousTransferFunction {
    type Err = ModelError;

    /// Parses a transfer function, such as `90/1,6,0`, `90/(s(s+6))` or `0.5(s+1)exp(-0.1s)/s^2`.
    ///
    /// ```
    /// # use hoid_model::ContinuousTransferFunction;
    /// let element: ContinuousTransferFunction = "90/(s(s+6))".parse()?;
    /// assert_eq!((element.num(), element.den()), (&[90.0][..], &[1.0, 6.0, 0.0][..]));
    /// # Ok::<(), hoid_model::ModelError>(())
    /// ```
    ///
    /// # Errors
    /// [`ModelError::TransferFunction`] with the character at which the text is invalid, or with a problem of the
    /// transfer function: a numerator of higher degree than the denominator, a negative delay.
    fn from_str(text: &str) -> Result<Self, ModelError> {
        let read = if text.contains(',') {
            coefficients(text)
        } else {
            Reader::new(text).expression()
        };
        let refuse = |expected: String| ModelError::TransferFunction {
            found: format!("{text:?}"),
            expected,
        };
        let Ratio { num, den, delay_s } = read.map_err(refuse)?;
        Self::new(&num, &den)
            .and_then(|h| h.with_delay(delay_s))
            .map_err(|error| match error {
                ModelError::TransferFunction { expected, .. } => refuse(expected),
                ModelError::OutOfRange { found, .. } => refuse(format!(
                    "its delay is {found} s, expected zero or more: a delay of 0.1 s is exp(-0.1s)"
                )),
                other => other,
            })
    }
}

impl fmt::Display for ContinuousTransferFunction {
    /// Formats the transfer function as an expression in s from which the same transfer function can be parsed.
    ///
    /// ```
    /// # use hoid_model::ContinuousTransferFunction;
    /// let element = ContinuousTransferFunction::new(&[90.0], &[1.0, 6.0, 0.0])?;
    /// assert_eq!(element.to_string(), "90/(s^2 + 6s)");
    /// # Ok::<(), hoid_model::ModelError>(())
    /// ```
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let terms = |p: &[f64]| p.iter().filter(|c| **c != 0.0).count();
        let delay = if self.delay_s > 0.0 {
            format!("exp(-{}s)", number(self.delay_s))
        } else {
            String::new()
        };
        let (num, den) = (polynomial_text(&self.num), polynomial_text(&self.den));
        let factor = !delay.is_empty() || self.den.len() > 1;
        match terms(&self.num) > 1 && factor {
            true => write!(f, "({num}){delay}")?,
            false => write!(f, "{num}{delay}")?,
        }
        match terms(&self.den) {
            _ if self.den.len() == 1 => Ok(()),
            1 => write!(f, "/{den}"),
            _ => write!(f, "/({den})"),
        }
    }
}

/// Returns the shortest text from which the same number can be parsed.
fn number(value: f64) -> String {
    if value != 0.0 && !(1e-4..1e7).contains(&value.abs()) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

/// Formats a polynomial in descending powers, such as `s^2 + 6s - 1`.
fn polynomial_text(p: &[f64]) -> String {
    let mut text = String::new();
    for (c, power) in p.iter().zip((0..p.len()).rev()).filter(|(c, _)| **c != 0.0) {
        text.push_str(match (text.is_empty(), *c < 0.0) {
            (true, false) => "",
            (true, true) => "-",
            (false, false) => " + ",
            (false, true) => " - ",
        });
        if c.abs() != 1.0 || power == 0 {
            text.push_str(&number(c.abs()));
        }
        match power {
            0 => {}
            1 => text.push('s'),
            _ => text.push_str(&format!("s^{power}")),
        }
    }
    if text.is_empty() { "0".to_owned() } else { text }
}
