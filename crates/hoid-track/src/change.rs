//! Change in a person as reported by a method, and the published baseline for the detection of changes.
//!
//! The baseline uses only the signals of the loop: an adaptation is assumed to be needed while the tracking error or
//! its rate exceeds k of its standard deviations before the change (R. A. Hess, *Journal of Guidance, Control, and
//! Dynamics* 32 (2009), with k = 3). Here either signal raises the alarm, and the rate is the difference of
//! neighbouring samples.

use hoid_model::{SampleTime, uncertainty::Estimate};
use hoid_numerics::statistics::{mean, sample_variance};

use crate::further_input::FurtherOperator;

/// A declared change in the person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Time from the change in the person to its declaration, s. For `adaptive` its resolution is half a second.
    pub seconds_ago: f64,
    /// For `adaptive`, -ln p of the change test; for `multiple-model`, the logarithm of the odds of a change within the
    /// last four seconds.
    pub odds: f64,
    /// K_e before and after the change.
    pub k_e: [Estimate; 2],
    /// K_e_dot before and after the change, s.
    pub k_e_dot: [Estimate; 2],
    /// omega_nm before and after the change, rad/s.
    pub omega_nm_rad_s: [Estimate; 2],
    /// zeta_nm before and after the change.
    pub zeta_nm: [Estimate; 2],
    /// Delay tau_e before and after the change (in s); both values are equal if the delay is known.
    pub tau_e_s: [Estimate; 2],
    /// T_L before and after the change, s.
    pub t_l_s: [f64; 2],
    /// Innovation variance before and after the change.
    pub innovation_variance: [f64; 2],
    /// Changes in K_e, K_e_dot, omega_nm, zeta_nm, the logarithm of the innovation variance and tau_e, each divided by
    /// its standard error.
    pub z: [f64; 6],
    /// True if the response to e was tested as a whole and changed, even if no single quantity changed by two standard
    /// errors.
    pub of_operator: bool,
    /// Change in the response to a further input, for a model with one.
    pub further: Option<FurtherChange>,
}

/// Change in the response to a further input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FurtherChange {
    /// The response before and after the change.
    pub operators: [FurtherOperator; 2],
    /// Changes of K_f, K_f_dot and tau_f, each divided by its standard error.
    pub z: [f64; 3],
    /// True if the response changed, even if no single quantity changed by more than two standard errors.
    pub is_changed: bool,
}

impl FurtherChange {
    /// Returns the names of the quantities that changed by more than two standard errors; if the response changed but
    /// none of its quantities changed by that much, `response_f`.
    pub fn changed_quantities(&self) -> Vec<&'static str> {
        let each = FurtherOperator::NAMES.into_iter().zip(self.z);
        let named: Vec<&str> = each
            .filter(|(_, z)| z.abs() > SIGNIFICANT_CHANGE)
            .map(|(name, _)| name)
            .collect();
        match named.is_empty() && self.is_changed {
            true => vec!["response_f"],
            false => named,
        }
    }
}

/// Change in a quantity, in standard errors, beyond which the quantity counts as changed.
const SIGNIFICANT_CHANGE: f64 = 2.0;
/// Names of the quantities of [`Change::z`].
const QUANTITY_NAMES: [&str; 6] = ["K_e", "K_e_dot", "omega_nm", "zeta_nm", REMNANT, "tau_e"];
const REMNANT: &str = "remnant";

impl Change {
    /// Returns `1/(1 + exp(-odds))`: the posterior probability of a change for `multiple-model`, but only `1/(1 + p)`
    /// with the p-value p of the test, which is not a probability of a change, for `adaptive`.
    pub fn probability(&self) -> f64 {
        1.0 / (1.0 + (-self.odds).exp())
    }

    /// Returns the names of the quantities that changed by more than two standard errors: `K_e`, `K_e_dot`, `omega_nm`,
    /// `zeta_nm`, `remnant`, `tau_e`, and for a further input `K_f`, `K_f_dot`, `tau_f`. If the response to e changed
    /// as a whole but none of its quantities changed by that much, the name is `response` (`response_f` for a further
    /// input).
    pub fn changed_quantities(&self) -> Vec<&'static str> {
        let each = || {
            QUANTITY_NAMES
                .into_iter()
                .zip(self.z)
                .filter(|(_, z)| z.abs() > SIGNIFICANT_CHANGE)
        };
        let is_named = each().any(|(name, _)| name != REMNANT);
        let whole = (self.of_operator && !is_named).then_some("response");
        let further = self.further.iter().flat_map(FurtherChange::changed_quantities);
        whole
            .into_iter()
            .chain(each().map(|(name, _)| name))
            .chain(further)
            .collect()
    }

    /// Returns the names of the quantities of the response to e that changed, without the remnant.
    pub(crate) fn changed_quantities_of_e(&self) -> Vec<&'static str> {
        let alone = Self { further: None, ..*self };
        let all = alone.changed_quantities().into_iter();
        all.filter(|name| *name != REMNANT).collect()
    }
}

/// The published baseline: an alarm if the tracking error or its rate is more than k standard deviations from its mean
/// before the change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorThreshold {
    /// Mean and standard deviation of the error, and of its rate per second.
    levels: [[f64; 2]; 2],
    sample_time_s: f64,
    last: Option<f64>,
}

impl ErrorThreshold {
    /// Computes the means and standard deviations from the error of a span without a change; `None` for fewer than
    /// three samples, or for values that are not finite.
    pub fn new(error: &[f64], sample_time: SampleTime) -> Option<Self> {
        let ts = sample_time.s();
        let rate: Vec<f64> = error.windows(2).map(|w| (w[1] - w[0]) / ts).collect();
        if error.len() < 3 || error.iter().any(|e| !e.is_finite()) {
            return None;
        }
        let level = |values: &[f64]| [mean(values), sample_variance(values).sqrt()];
        Some(Self {
            levels: [level(error), level(&rate)],
            sample_time_s: ts,
            last: None,
        })
    }

    /// Returns the larger of the distances of the error and of its rate from their means, in standard deviations; a
    /// distance above k is an alarm. The rate is used from the second sample on.
    pub fn step(&mut self, error: f64) -> f64 {
        let distance = |[mean, deviation]: [f64; 2], v: f64| ((v - mean) / deviation).abs();
        let by_error = distance(self.levels[0], error);
        let rate = self.last.map(|last| (error - last) / self.sample_time_s);
        self.last = Some(error);
        let by_rate = rate.map_or(0.0, |r| distance(self.levels[1], r));
        by_error.max(by_rate)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn threshold_statistic_is_the_distance_in_standard_deviations() {
        let ts = SampleTime::AT_100_HZ;
        // The error has the mean 0 and the variance 8/7; its rates are +-200.
        let error = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
        let mut baseline = ErrorThreshold::new(&error, ts).unwrap();
        let deviation = (8.0_f64 / 7.0).sqrt();
        assert!((baseline.step(3.0) - 3.0 / deviation).abs() < 1e-12);
        // Rates of the error: their mean is -200/7, and their standard deviation follows from the definition.
        let rates = [-200.0, 200.0, -200.0, 200.0, -200.0, 200.0, -200.0];
        let mean = rates.iter().sum::<f64>() / 7.0;
        let spread = (rates.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / 6.0).sqrt();
        let expected = (4.0 / deviation).max((100.0 - mean) / spread);
        assert!((baseline.step(4.0) - expected).abs() < 1e-12);
        assert!(ErrorThreshold::new(&[0.0, 1.0], ts).is_none());
        assert!(ErrorThreshold::new(&[0.0, f64::NAN, 1.0], ts).is_none());
    }

    #[test]
    fn response_is_named_if_no_single_parameter_changed() {
        let estimate = Estimate::with_variance(1.0, 0.01);
        let of = |of_operator, z| Change {
            seconds_ago: 1.0,
            odds: 10.0,
            k_e: [estimate; 2],
            k_e_dot: [estimate; 2],
            omega_nm_rad_s: [estimate; 2],
            zeta_nm: [estimate; 2],
            tau_e_s: [estimate; 2],
            t_l_s: [1.0; 2],
            innovation_variance: [1.0; 2],
            z,
            of_operator,
            further: None,
        };
        let further = |z: [f64; 3]| FurtherChange {
            operators: [FurtherOperator {
                k_f: estimate,
                k_f_dot: estimate,
                tau_f_s: estimate,
            }; 2],
            z,
            is_changed: true,
        };
        let both = |z| Change {
            further: Some(further(z)),
            ..of(false, [0.0; 6])
        };
        assert_eq!(both([2.4, 0.0, -1.0]).changed_quantities(), ["K_f"]);
        assert_eq!(both([0.0; 3]).changed_quantities(), ["response_f"]);
        let louder = [0.5, -1.7, 0.0, 0.0, 6.0, 0.0];
        assert_eq!(of(true, louder).changed_quantities(), ["response", "remnant"]);
        assert_eq!(of(false, louder).changed_quantities(), ["remnant"]);
        assert_eq!(
            of(true, [0.0, 2.5, 1.9, 0.0, 0.0, -3.0]).changed_quantities(),
            ["K_e_dot", "tau_e"]
        );
        assert_eq!(of(true, [0.0; 6]).changed_quantities(), ["response"]);
    }
}
