//! A fitted operator, used as the start of another estimate of the same person.

use super::operator::FamilyOperator;
use crate::{ModelError, SampleTime};

/// An operator with the covariance of its coordinates, its noise model, and information on its fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedOperator {
    /// Fitted operator.
    pub operator: FamilyOperator,
    /// Covariance of the coordinates, by rows.
    pub covariance: Vec<f64>,
    /// Coefficients c and d of the noise model `v = (C/D) eps`, without the leading 1.
    pub noise: (Vec<f64>, Vec<f64>),
    /// Variance of eps, in the unit of u squared.
    pub innovation_variance: f64,
    /// Sample time of the records used for the fit.
    pub sample_time: SampleTime,
    /// Units of e and u; empty if they were not declared.
    pub units: [String; 2],
    /// Source of the fit for messages, such as the name of a file.
    pub source: String,
}

impl FittedOperator {
    /// Returns the fit unchanged if its values are valid.
    ///
    /// # Errors
    /// [`ModelError::Operator`] for a covariance of the wrong size, numbers that are not finite, and variances that are
    /// not positive.
    pub fn checked(self) -> Result<Self, ModelError> {
        let p = self.operator.coordinates().len();
        let wrong = |reason: String| Err(ModelError::Operator { reason });
        if self.covariance.len() != p * p {
            return wrong(format!(
                "the covariance has {} numbers, expected {} for {p} coordinates of the form {}",
                self.covariance.len(),
                p * p,
                self.operator.form()
            ));
        }
        let coefficients = self.noise.0.iter().chain(&self.noise.1);
        if self.covariance.iter().chain(coefficients).any(|x| !x.is_finite()) {
            return wrong("a number of the covariance or of the noise model is not finite".to_owned());
        }
        if (0..p).any(|i| self.covariance[i * p + i] < 0.0) {
            return wrong("a variance in the covariance is negative".to_owned());
        }
        if !(self.innovation_variance > 0.0 && self.innovation_variance.is_finite()) {
            return wrong(format!(
                "the innovation variance is {}, expected a positive number",
                self.innovation_variance
            ));
        }
        Ok(self)
    }

    /// Checks that a record has the sample time and the units of the fit; units are compared only if both are declared.
    /// `units` are the units of e and u in the record.
    ///
    /// # Errors
    /// [`ModelError::Operator`] with the difference and the remedy.
    pub fn check_samples(&self, sample_time: SampleTime, units: [&str; 2]) -> Result<(), ModelError> {
        let wrong = |reason: String| Err(ModelError::Operator { reason });
        if !self.sample_time.matches(sample_time) {
            return wrong(format!(
                "{} was identified at {:.6} Hz, but these samples are at {:.6} Hz: the noise model of the fit is not \
                 valid here; identify the person at this rate, or resample the record to the rate of the fit with \
                 --resample",
                self.source,
                1.0 / self.sample_time.s(),
                1.0 / sample_time.s()
            ));
        }
        for (signal, (of_fit, here)) in ["e", "u"].into_iter().zip(self.units.iter().zip(units)) {
            if !of_fit.is_empty() && !here.is_empty() && of_fit != here {
                return wrong(format!(
                    "{} was identified with {signal} in {of_fit}, but {signal} of this record is in {here}, so the \
                     gains of the fit are not valid here; convert {signal}, for example with --scale \
                     {signal}={here}:{of_fit}",
                    self.source
                ));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::Form;

    fn fitted_operator() -> FittedOperator {
        FittedOperator {
            operator: FamilyOperator::new(Form::Gain, true, &[2.0, 2.4, -1.2, 0.2]).unwrap(),
            covariance: (0..16).map(|i| if i % 5 == 0 { 0.01 } else { 0.0 }).collect(),
            noise: (Vec::new(), vec![-0.9]),
            innovation_variance: 0.1,
            sample_time: SampleTime::AT_100_HZ,
            units: ["deg".to_owned(), String::new()],
            source: "fit.json".to_owned(),
        }
    }

    #[test]
    fn fit_with_other_rate_or_units_is_refused_with_a_remedy() {
        let fit = fitted_operator().checked().unwrap();
        let ts = SampleTime::AT_100_HZ;
        for units in [["deg", "mm"], ["", ""]] {
            assert!(fit.check_samples(ts, units).is_ok());
        }
        let rate = fit.check_samples(SampleTime::new(0.02).unwrap(), ["", ""]).unwrap_err();
        assert!(
            rate.to_string().contains("100.000000 Hz") && rate.to_string().contains("50.000000 Hz"),
            "{rate}"
        );
        let units = fit.check_samples(ts, ["rad", ""]).unwrap_err();
        assert!(units.to_string().contains("--scale e=rad:deg"), "{units}");
    }

    #[test]
    fn invalid_numbers_are_refused() {
        let short = FittedOperator {
            covariance: vec![1.0; 4],
            ..fitted_operator()
        };
        assert!(short.checked().unwrap_err().to_string().contains("expected 16"));
        let negative = FittedOperator {
            covariance: (0..16).map(|i| if i == 0 { -1.0 } else { 0.0 }).collect(),
            ..fitted_operator()
        };
        let endless = FittedOperator {
            noise: (vec![f64::NAN], Vec::new()),
            ..fitted_operator()
        };
        let silent = FittedOperator {
            innovation_variance: 0.0,
            ..fitted_operator()
        };
        for wrong in [negative, endless, silent] {
            assert!(wrong.checked().is_err());
        }
    }
}
