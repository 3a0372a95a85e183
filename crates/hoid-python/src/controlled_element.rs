//! Controlled elements in the form in which Python passes them.

use hoid_model::ContinuousTransferFunction;
use pyo3::prelude::*;

use crate::errors::Outcome;

/// Text such as `90/(s(s+6))`, or the numerator and the denominator in descending powers of s.
#[derive(FromPyObject)]
pub enum ControlledElement {
    Text(String),
    Coefficients(Vec<f64>, Vec<f64>),
}

impl ControlledElement {
    pub fn transfer_function(&self) -> Outcome<ContinuousTransferFunction> {
        Ok(match self {
            Self::Text(text) => text.parse()?,
            Self::Coefficients(num, den) => ContinuousTransferFunction::new(num, den)?,
        })
    }
}
