//! Printed summary of a fit.

use std::fmt;

use hoid_model::{estimate_table::write_rows, numbers::format_significant};

use crate::{Fit, Reason};

/// Number of significant digits of loss and criteria.
const SIGNIFICANT_DIGITS: i32 = 5;

impl fmt::Display for Fit {
    /// Formats the title, the parameters with standard errors (one row each), the loss, the criteria, and the
    /// termination of the search.
    ///
    /// ```
    /// # use hoid_ident::Estimator;
    /// # use hoid_model::{Channel, Orders, Record, SampleTime, Structure};
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let e: Vec<f64> = (0..400).map(|t| f64::from(t * t % 17) - 8.0).collect();
    /// # let mut u = vec![0.0];
    /// # for t in 1..400 {
    /// #     u.push(0.8 * u[t - 1] + 0.5 * e[t - 1] + 0.01 * f64::from((t * t * t % 23) as u32) - 0.11);
    /// # }
    /// # let record = Record::new(SampleTime::new(0.01)?, Channel::new("e", "deg", e), Channel::new("u", "deg", u))?;
    /// let orders = Orders { na: 1, nb: 1, nk: 1, ..Orders::default() };
    /// let fit = Estimator::new(Structure::Arx, orders).fit(&[record])?;
    /// println!("{fit}");
    /// # let text = fit.to_string();
    /// # assert!(text.starts_with("ARX("), "{text}");
    /// # assert!(text.contains("b0") && text.contains(" ± "), "{text}");
    /// # Ok(())
    /// # }
    /// ```
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title())?;
        write_rows(
            f,
            self.parameters()
                .into_iter()
                .map(|(name, estimate)| (name, estimate, "")),
        )?;
        let number = |value: f64| format_significant(value, SIGNIFICANT_DIGITS);
        writeln!(
            f,
            "\nloss {}, innovation variance {}, {} residuals",
            number(self.loss()),
            number(self.innovation_variance()),
            self.residual_count()
        )?;
        if self.termination().reason != Reason::ExactFit {
            let (aic, bic, fpe) = (number(self.aic()), number(self.bic()), number(self.fpe()));
            writeln!(f, "AIC {aic}, BIC {bic}, FPE {fpe}")?;
        }
        write!(f, "{}", self.termination())?;
        match self.termination().reason {
            Reason::Direct => Ok(()),
            _ => write!(f, "; start: {}", self.start()),
        }
    }
}

#[cfg(test)]
mod tests {
    use hoid_model::{Channel, Orders, Record, SampleTime, Structure};

    use crate::Estimator;

    /// First-order response to a square wave, with a small deterministic disturbance.
    fn record() -> Record {
        let e: Vec<f64> = (0..400).map(|t| if t / 7 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let mut u = vec![0.0];
        for t in 1..400 {
            u.push(0.8 * u[t - 1] + 0.5 * e[t - 1] + 0.05 * (1.7 * (t * t) as f64).sin());
        }
        let ts = SampleTime::new(0.01).unwrap();
        Record::new(ts, Channel::new("e", "deg", e), Channel::new("u", "deg", u)).unwrap()
    }

    #[test]
    fn fit_and_validation_print_as_aligned_text() {
        let orders = Orders {
            na: 1,
            nb: 1,
            nk: 1,
            ..Orders::default()
        };
        let fit = Estimator::new(Structure::Arx, orders).fit(&[record()]).unwrap();
        let expected = "\
ARX(na=1, nb=1, nk=1)
a1  -0.8017 ± 0.0018
b0   0.5000 ± 0.0018
loss 0.0012924, innovation variance 0.0012989, 399 residuals
AIC -2649.8, BIC -2641.9, FPE 0.0013054
solved directly (linear least squares)";
        assert_eq!(fit.to_string(), expected);
        let validation = fit.validate(&record()).unwrap();
        let expected = "                       VAF    NRMSE
simulation          99.7 %   94.5 %
prediction          99.9 %   96.6 %
whiteness          Q = 34.3 with 49 degrees of freedom, p = 0.95: residuals white at the 1 % level
input, lags >= 0   0 of 51 lags outside the 99 % bound: no sign of missing dynamics
input, lags < 0    5 of 50 lags outside the 99 % bound: feedback from the output";
        assert_eq!(validation.to_string(), expected);
    }
}
