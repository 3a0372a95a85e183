//! Goodness of fit of a model, VAF and NRMSE, for one or several records.

use crate::linalg::{products::variance, vectors::dot};

/// VAF and NRMSE fit of a model, %.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct GoodnessOfFit {
    /// VAF of the simulated output, %.
    pub vaf_simulation: f64,
    /// VAF of the one-step-ahead prediction, %.
    pub vaf_prediction: f64,
    /// NRMSE fit of the simulated output, %.
    pub nrmse_simulation: f64,
    /// NRMSE fit of the one-step-ahead prediction, %.
    pub nrmse_prediction: f64,
}

/// Sums of squares of the output and of the errors, for one or several records.
#[derive(Default)]
pub(super) struct ErrorSums {
    power: f64,
    spread: f64,
    simulation: f64,
    prediction: f64,
}

impl ErrorSums {
    /// Returns the sums after adding a record.
    pub fn with_record(self, measured: &[f64], simulated: &[f64], predicted: &[f64]) -> Self {
        Self {
            power: self.power + dot(measured, measured),
            spread: self.spread + squared_deviations(measured),
            simulation: self.simulation + squared_distance(measured, simulated),
            prediction: self.prediction + squared_distance(measured, predicted),
        }
    }

    pub fn quality(&self) -> GoodnessOfFit {
        GoodnessOfFit {
            vaf_simulation: vaf_from_sums(self.simulation, self.power),
            vaf_prediction: vaf_from_sums(self.prediction, self.power),
            nrmse_simulation: nrmse_from_sums(self.simulation, self.spread),
            nrmse_prediction: nrmse_from_sums(self.prediction, self.spread),
        }
    }
}

/// Returns the variance accounted for (eq. 39), %; zero if the measured signal is zero.
pub fn vaf(measured: &[f64], model: &[f64]) -> f64 {
    vaf_from_sums(squared_distance(measured, model), dot(measured, measured))
}

/// Returns the NRMSE fit, %; zero if the measured signal is constant.
pub fn nrmse_fit(measured: &[f64], model: &[f64]) -> f64 {
    nrmse_from_sums(squared_distance(measured, model), squared_deviations(measured))
}

/// Returns the sum of the squared deviations from the mean.
fn squared_deviations(x: &[f64]) -> f64 {
    if x.is_empty() {
        0.0
    } else {
        variance(&[x]) * x.len() as f64
    }
}

fn vaf_from_sums(squared_error: f64, power: f64) -> f64 {
    if power == 0.0 {
        0.0
    } else {
        (100.0 * (1.0 - squared_error / power)).max(0.0)
    }
}

fn nrmse_from_sums(squared_error: f64, spread: f64) -> f64 {
    if spread == 0.0 {
        0.0
    } else {
        100.0 * (1.0 - (squared_error / spread).sqrt())
    }
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vaf_and_nrmse_match_hand_calculation() {
        let u = [1.0, 3.0, 1.0, 3.0];
        assert_eq!(vaf(&u, &u), 100.0);
        assert_eq!(nrmse_fit(&u, &u), 100.0);
        // With an error of 1 in each sample, the sum of squares is 4 of 20 and equals the squared deviations from the
        // mean.
        let off = [2.0, 2.0, 2.0, 2.0];
        assert!((vaf(&u, &off) - 80.0).abs() < 1e-12);
        assert!(nrmse_fit(&u, &off).abs() < 1e-12);
        assert_eq!(vaf(&u, &[-9.0; 4]), 0.0);
        assert!(nrmse_fit(&u, &[-9.0; 4]) < 0.0);
        assert_eq!(vaf(&[0.0; 3], &[1.0; 3]), 0.0);
        assert_eq!(nrmse_fit(&[2.0; 3], &[1.0; 3]), 0.0);
    }
}
