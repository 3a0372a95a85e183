//! An operator at one frequency with the error of its response.

use hoid_model::{Complex64, FamilyOperator, SampleTime, uncertainty::Estimate};

use super::{deviation::ResponseDeviation, intersample::Intersample};

/// An operator at one frequency: its sampled response, and the covariance of the real and imaginary parts of its
/// relative error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownResponse {
    /// Sampled response Y.
    pub value: Complex64,
    /// Covariance of the real and imaginary parts of `dY/Y`; `None` if unknown.
    pub relative: Option<[[f64; 2]; 2]>,
}

impl KnownResponse {
    /// Returns the sampled response of an operator at a frequency, given the covariance of its coordinates and the
    /// deviation of the person from the form.
    pub fn of(
        operator: &FamilyOperator,
        (covariance, deviation): (Option<&[f64]>, Option<&ResponseDeviation>),
        (sample_time, intersample): (SampleTime, Intersample),
        omega_rad_s: f64,
    ) -> Self {
        let found = operator.response_and_gradient(omega_rad_s);
        let mut relative = covariance.map(|c| found.relative_covariance(c));
        let mut value = found.value * intersample.response(omega_rad_s, sample_time);
        if let Some(deviation) = deviation {
            let (delta, variance) = deviation.at(omega_rad_s);
            let factor = delta + 1.0;
            value *= factor;
            if let Some(c) = &mut relative {
                let added = variance / factor.norm_sqr();
                c[0][0] += added;
                c[1][1] += added;
            }
        }
        Self { value, relative }
    }

    /// Returns an estimate that changes by these amounts per unit of the real and imaginary parts of `dY/Y`.
    pub(super) fn estimate(&self, value: f64, [a, b]: [f64; 2]) -> Estimate {
        match self.relative {
            Some(c) => Estimate::with_variance(value, a * a * c[0][0] + 2.0 * a * b * c[0][1] + b * b * c[1][1]),
            None => Estimate::fixed(value),
        }
    }
}
