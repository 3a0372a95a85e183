//! Whiteness of the residuals: the Ljung-Box test.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::correlation::{Correlation, autocorrelation, centred};

/// Largest lag of the residual tests, samples.
pub const MAX_LAG: usize = 50;

/// Result of the Ljung-Box test for white residuals.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LjungBox {
    /// `Q = n (n + 2) sum_k r_k^2/(n - k)` over the lags 1 to [`MAX_LAG`].
    pub statistic: f64,
    /// Number of lags minus the number of free coefficients of the noise model (the coefficients of A, C and D).
    pub degrees_of_freedom: usize,
    /// Probability of a larger Q if the residuals are white.
    pub p_value: f64,
}

/// Applies the Ljung-Box test to residuals of a model whose noise model has `free` free coefficients; `None` unless
/// there are more lags than coefficients.
pub fn whiteness(residuals: &[f64], free: usize) -> Option<LjungBox> {
    let residuals = centred(residuals.to_vec());
    ljung_box(&autocorrelation(&residuals, MAX_LAG), residuals.len(), free)
}

/// Applies the Ljung-Box test to the autocorrelation of n residuals.
pub(super) fn ljung_box(correlation: &Correlation, n: usize, free: usize) -> Option<LjungBox> {
    let lags = correlation.lags.len();
    let degrees_of_freedom = lags.checked_sub(free).filter(|d| *d > 0)?;
    let n = n as f64;
    let terms = correlation.lags.iter().zip(&correlation.values);
    let statistic = n * (n + 2.0) * terms.map(|(k, r)| r * r / (n - *k as f64)).sum::<f64>();
    let chi_square = ChiSquared::new(degrees_of_freedom as f64).ok()?;
    Some(LjungBox {
        statistic,
        degrees_of_freedom,
        p_value: chi_square.sf(statistic),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ljung_box_statistic_matches_the_formula() {
        // r = 0.1, -0.2, n = 100: Q = 100 * 102 * (0.01/99 + 0.04/98) = 5.1936; chi-square with 2
        // degrees: exp(-Q/2).
        let correlation = Correlation {
            lags: vec![1, 2],
            values: vec![0.1, -0.2],
            bound_99: 0.0,
        };
        let test = ljung_box(&correlation, 100, 0).unwrap();
        assert!((test.statistic - 5.193_568).abs() < 1e-6, "{}", test.statistic);
        assert!((test.p_value - (-test.statistic / 2.0).exp()).abs() < 1e-12);
        assert_eq!(ljung_box(&correlation, 100, 1).unwrap().degrees_of_freedom, 1);
        assert!(ljung_box(&correlation, 100, 2).is_none());
    }
}
