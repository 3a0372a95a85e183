//! Transfer functions in s and in z. The module `text` parses and formats transfer functions in s.

mod text;

use num_complex::Complex64;

use crate::{ModelError, SampleTime, polynomial};

/// `H(s) = num(s) / den(s) e^{-s tau}`, with coefficients in descending powers of s.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContinuousTransferFunction {
    num: Vec<f64>,
    den: Vec<f64>,
    delay_s: f64,
}

impl ContinuousTransferFunction {
    /// Creates a proper transfer function; the denominator is made monic.
    ///
    /// # Errors
    /// [`ModelError::TransferFunction`] if a coefficient is not finite, the denominator is zero, or the degree of the
    /// numerator exceeds that of the denominator.
    pub fn new(num: &[f64], den: &[f64]) -> Result<Self, ModelError> {
        let refuse = |expected: &str| ModelError::TransferFunction {
            found: format!("{num:?} / {den:?}"),
            expected: expected.to_owned(),
        };
        if num.iter().chain(den).any(|c| !c.is_finite()) {
            return Err(refuse("all coefficients must be finite numbers"));
        }
        let den = without_leading_zeros(den);
        let num = without_leading_zeros(num);
        let Some(&leading) = den.first() else {
            return Err(refuse("the denominator must not be zero"));
        };
        if num.len() > den.len() {
            return Err(refuse(
                "the numerator must not have a higher degree than the denominator",
            ));
        }
        let num = if num.is_empty() { &[0.0][..] } else { num };
        Ok(Self {
            num: num.iter().map(|c| c / leading).collect(),
            den: den.iter().map(|c| c / leading).collect(),
            delay_s: 0.0,
        })
    }

    /// Returns the transfer function with the given pure delay.
    ///
    /// # Errors
    /// [`ModelError::OutOfRange`] if the delay is negative or not finite.
    pub fn with_delay(mut self, delay_s: f64) -> Result<Self, ModelError> {
        if !(delay_s.is_finite() && delay_s >= 0.0) {
            return Err(ModelError::OutOfRange {
                quantity: "delay tau in s",
                found: delay_s,
                expected: "a finite number, zero or more",
            });
        }
        self.delay_s = delay_s;
        Ok(self)
    }

    /// Numerator in descending powers of s, without leading zeros.
    pub fn num(&self) -> &[f64] {
        &self.num
    }

    /// Monic denominator in descending powers of s.
    pub fn den(&self) -> &[f64] {
        &self.den
    }

    /// Pure delay in s.
    pub fn delay_s(&self) -> f64 {
        self.delay_s
    }

    /// Returns the series connection: the product of both transfer functions, with the sum of their delays.
    pub fn series(&self, other: &Self) -> Self {
        Self {
            num: polynomial::product(&self.num, &other.num),
            den: polynomial::product(&self.den, &other.den),
            delay_s: self.delay_s + other.delay_s,
        }
    }

    /// Returns the frequency response `H(j omega)`.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        let s = Complex64::new(0.0, omega_rad_s);
        let horner = |p: &[f64]| p.iter().fold(Complex64::new(0.0, 0.0), |sum, &c| sum * s + c);
        horner(&self.num) / horner(&self.den) * (-s * self.delay_s).exp()
    }
}

fn without_leading_zeros(p: &[f64]) -> &[f64] {
    &p[p.iter().position(|&c| c != 0.0).unwrap_or(p.len())..]
}

/// `H(z) = num(z^-1) / den(z^-1)`, with coefficients in ascending powers of `z^-1` and `den[0] = 1`. A pure delay of n
/// samples is represented by n leading zeros in `num`.
#[derive(Debug, Clone, PartialEq)]
pub struct DiscreteTransferFunction {
    num: Vec<f64>,
    den: Vec<f64>,
    sample_time: SampleTime,
}

impl DiscreteTransferFunction {
    /// Creates a causal transfer function; it is scaled so that `den[0] = 1`.
    ///
    /// # Errors
    /// [`ModelError::TransferFunction`] if a coefficient is not finite or `den[0]` is zero.
    pub fn new(num: &[f64], den: &[f64], sample_time: SampleTime) -> Result<Self, ModelError> {
        let refuse = |expected: &str| ModelError::TransferFunction {
            found: format!("{num:?} / {den:?}"),
            expected: expected.to_owned(),
        };
        if num.iter().chain(den).any(|c| !c.is_finite()) {
            return Err(refuse("all coefficients must be finite numbers"));
        }
        match den.first() {
            Some(&leading) if leading != 0.0 => Ok(Self {
                num: num.iter().map(|c| c / leading).collect(),
                den: den.iter().map(|c| c / leading).collect(),
                sample_time,
            }),
            _ => Err(refuse(
                "the denominator must start with a nonzero coefficient (causality)",
            )),
        }
    }

    /// Numerator in ascending powers of `z^-1`.
    pub fn num(&self) -> &[f64] {
        &self.num
    }

    /// Denominator in ascending powers of `z^-1`, `den[0] = 1`.
    pub fn den(&self) -> &[f64] {
        &self.den
    }

    /// Time between two samples.
    pub fn sample_time(&self) -> SampleTime {
        self.sample_time
    }

    /// Returns the frequency response `H(e^{j omega Ts})`.
    pub fn response(&self, omega_rad_s: f64) -> Complex64 {
        let backward = Complex64::from_polar(1.0, -omega_rad_s * self.sample_time.s());
        polynomial::value(&self.num, backward) / polynomial::value(&self.den, backward)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delayed_first_order_lag_has_exact_response() {
        let lag = ContinuousTransferFunction::new(&[0.0, 4.0], &[2.0, 2.0])
            .unwrap()
            .with_delay(0.3)
            .unwrap();
        assert_eq!(lag.num(), &[2.0]);
        assert_eq!(lag.den(), &[1.0, 1.0]);
        let h = lag.response(1.0);
        assert!((h.norm() - 2f64.sqrt()).abs() < 1e-12);
        assert!((h.arg() + std::f64::consts::FRAC_PI_4 + 0.3).abs() < 1e-12);
        assert!((lag.series(&lag).response(0.7) - lag.response(0.7).powi(2)).norm() < 1e-12);
    }

    #[test]
    fn bad_transfer_functions_are_refused() {
        assert!(ContinuousTransferFunction::new(&[1.0, 0.0], &[1.0]).is_err());
        assert!(ContinuousTransferFunction::new(&[1.0], &[0.0]).is_err());
        assert!(ContinuousTransferFunction::new(&[f64::NAN], &[1.0]).is_err());
        assert!(
            ContinuousTransferFunction::new(&[1.0], &[1.0])
                .unwrap()
                .with_delay(-1.0)
                .is_err()
        );
        let ts = SampleTime::new(0.1).unwrap();
        assert!(DiscreteTransferFunction::new(&[1.0], &[], ts).is_err());
        assert!(DiscreteTransferFunction::new(&[1.0], &[0.0, 1.0], ts).is_err());
    }

    #[test]
    fn discrete_response_is_exact_at_zero_and_nyquist() {
        let ts = SampleTime::new(0.1).unwrap();
        let h = DiscreteTransferFunction::new(&[0.0, 0.5], &[1.0, -0.5], ts).unwrap();
        assert!((h.response(0.0) - 1.0).norm() < 1e-12);
        assert!((h.response(ts.nyquist_rad_s()) + 1.0 / 3.0).norm() < 1e-12);
    }
}
