//! Deviation of residuals from white noise, as effect sizes.
//!
//! With `S = sum eps^2` over all records,
//!
//! - the autocorrelation `sum eps(t) eps(t-k) / S` at lags of 1 to 25, which shows a deficiency of the noise model;
//! - the correlation `sum eps(t) e(t-k) / sqrt(S sum e^2)` at lags of 0 to 0.6 s, which shows a deficiency of the
//!   operator. Only past errors are used, since in a closed loop later errors respond to the residuals;
//! - the leverage `max eps^2 / S`, which measures the influence of one sample on the fit.
//!
//! The limits are effect sizes, not significance levels: with the samples of ten runs a test rejects every model of a
//! person, and the important question is how much the model leaves unexplained. In short records chance alone gives
//! effects of this size. For them the limits are four standard errors `1/sqrt(n)` of a correlation of white noise, and
//! a share of 20/n of the sum of squares, which one of n normal residuals exceeds with probability 8e-6 n.

use hoid_model::{Finding, Record};

use crate::fit::Series;

/// Autocorrelation of the residuals above which the noise model is inadequate.
const MAX_AUTOCORRELATION: f64 = 0.1;
/// Correlation of the residuals with earlier errors above which the operator is inadequate.
const MAX_CROSS_CORRELATION: f64 = 0.1;
/// Limit of a correlation in short records, in standard errors of a correlation of white noise.
const CHANCE_CORRELATION: f64 = 4.0;
/// Share of the sum of squares above which one sample dominates the fit.
const MAX_LEVERAGE: f64 = 0.05;
/// Limit of a squared residual in short records, as a multiple of the mean square.
const CHANCE_LEVERAGE: f64 = 20.0;
/// Number of lags of the autocorrelation.
const LAG_COUNT: usize = 25;
/// Longest lag of the correlation with the error, in s and in samples.
const MAX_LAG_S: f64 = 0.6;
const MAX_LAG_SAMPLES: f64 = 600.0;

/// Measures of the deviation of residuals from white noise.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct ResidualMeasures {
    /// Number of residuals.
    pub count: usize,
    /// Largest modulus of the autocorrelation over lags 1 to 25.
    pub autocorrelation: f64,
    /// Largest modulus of the correlation with e at lags of 0 to 0.6 s; zero for a model without an input.
    pub cross_correlation: f64,
    /// Largest share of one sample in the sum of squares.
    pub leverage: f64,
    /// Record and sample of the residual with the largest share in the sum of squares.
    pub largest_residual: (usize, usize),
}

impl ResidualMeasures {
    /// Computes the measures from the residual series of all records.
    pub fn from_series(found: &[Series], records: &[Record], sample_time_s: f64) -> Self {
        let pairs: Vec<(&[f64], &[f64])> = found
            .iter()
            .zip(records)
            .map(|(eps, record)| (eps.values.as_slice(), &record.input()[eps.first..]))
            .collect();
        Self::of(&pairs, sample_time_s)
    }

    /// Computes the measures from the residuals of all records, each with the error at the same samples (empty for a
    /// model without an input).
    pub fn of(records: &[(&[f64], &[f64])], sample_time_s: f64) -> Self {
        let sum_of_squares = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        let total: f64 = records.iter().map(|(eps, _)| sum_of_squares(eps)).sum();
        let error_power: f64 = records.iter().map(|(_, e)| sum_of_squares(e)).sum();
        let mut measures = Self {
            count: records.iter().map(|(eps, _)| eps.len()).sum(),
            ..Self::default()
        };
        if total <= 0.0 {
            return measures;
        }
        let product = |lag: usize, of_error: bool| -> f64 {
            let one = |(eps, e): &(&[f64], &[f64])| {
                let past = if of_error { e } else { eps };
                (lag..eps.len()).map(|t| eps[t] * past[t - lag]).sum::<f64>()
            };
            records.iter().map(one).sum()
        };
        for lag in 1..=LAG_COUNT {
            measures.autocorrelation = measures.autocorrelation.max((product(lag, false) / total).abs());
        }
        if error_power > 0.0 {
            let longest = (MAX_LAG_S / sample_time_s).round().min(MAX_LAG_SAMPLES) as usize;
            for lag in 0..=longest {
                let correlation = product(lag, true) / (total * error_power).sqrt();
                measures.cross_correlation = measures.cross_correlation.max(correlation.abs());
            }
        }
        for (record, (eps, _)) in records.iter().enumerate() {
            for (t, x) in eps.iter().enumerate() {
                if x * x / total > measures.leverage {
                    measures.leverage = x * x / total;
                    measures.largest_residual = (record, t);
                }
            }
        }
        measures
    }

    /// Returns a finding if the noise model is inadequate.
    pub fn noise_model_finding(&self) -> Option<Finding> {
        (self.autocorrelation > MAX_AUTOCORRELATION.max(self.chance_correlation())).then(|| {
            Finding::warning(
                "residuals-not-white",
                format!(
                    "the residuals have a correlation of {:.2} with their own past: the noise model is too simple",
                    self.autocorrelation
                ),
            )
        })
    }

    /// Returns a finding if the operator is inadequate.
    pub fn structure_finding(&self) -> Option<Finding> {
        (self.cross_correlation > MAX_CROSS_CORRELATION.max(self.chance_correlation())).then(|| {
            Finding::warning(
                "structure",
                format!(
                    "the residuals have a correlation of {:.2} with past values of e: the operator misses part of the \
                     response",
                    self.cross_correlation
                ),
            )
        })
    }

    /// Returns a finding if one sample dominates the fit.
    pub fn leverage_finding(&self) -> Option<Finding> {
        (self.leverage > MAX_LEVERAGE.max(CHANCE_LEVERAGE / self.count as f64)).then(|| {
            Finding::warning(
                "leverage",
                format!(
                    "one sample (record {}, residual {}) contributes {:.0} % of the sum of squares: inspect this \
                     sample, or exclude it",
                    self.largest_residual.0 + 1,
                    self.largest_residual.1,
                    100.0 * self.leverage
                ),
            )
        })
    }

    /// Returns all findings about the residuals.
    pub fn findings(&self) -> impl Iterator<Item = Finding> {
        [
            self.noise_model_finding(),
            self.structure_finding(),
            self.leverage_finding(),
        ]
        .into_iter()
        .flatten()
    }

    fn chance_correlation(&self) -> f64 {
        CHANCE_CORRELATION / (self.count as f64).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// White noise, uniform in -0.5 to 0.5.
    fn white_noise(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let draw = |_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..n).map(draw).collect()
    }

    fn finding_kinds(measures: &ResidualMeasures) -> Vec<&'static str> {
        measures.findings().map(|f| f.kind).collect()
    }

    #[test]
    fn white_residuals_of_any_length_give_no_finding() {
        for n in [50, 300, 3000] {
            let (eps, e) = (white_noise(n, 1), white_noise(n, 2));
            let measures = ResidualMeasures::of(&[(&eps, &e)], 0.01);
            assert!(finding_kinds(&measures).is_empty(), "{n}: {measures:?}");
            assert_eq!(measures.count, n);
        }
    }

    #[test]
    fn each_residual_measure_has_its_finding() {
        let (eps, e) = (white_noise(3000, 1), white_noise(3000, 2));
        let coloured: Vec<f64> = (1..3000).map(|t| eps[t] + 0.3 * eps[t - 1]).collect();
        let measures = ResidualMeasures::of(&[(&coloured, &e[1..])], 0.01);
        assert_eq!(finding_kinds(&measures), ["residuals-not-white"]);
        // The autocorrelation of eps(t) + 0.3 eps(t-1) at lag one is 0.3/1.09.
        assert!((measures.autocorrelation - 0.3 / 1.09).abs() < 0.05, "{measures:?}");
        let missed: Vec<f64> = (20..3000).map(|t| eps[t] + 0.3 * e[t - 20]).collect();
        let measures = ResidualMeasures::of(&[(&missed, &e[20..])], 0.01);
        assert_eq!(finding_kinds(&measures), ["structure"]);
        // A lag of more than 0.6 s does not count.
        let measures = ResidualMeasures::of(&[(&missed, &e[20..])], 0.1);
        assert!(finding_kinds(&measures).is_empty(), "{measures:?}");
        let mut blow = eps.clone();
        blow[1234] = 10.0;
        let records = [(eps.as_slice(), e.as_slice()), (blow.as_slice(), e.as_slice())];
        let measures = ResidualMeasures::of(&records, 0.01);
        assert_eq!(
            (finding_kinds(&measures), measures.largest_residual),
            (vec!["leverage"], (1, 1234))
        );
    }

    #[test]
    fn zero_residuals_and_missing_inputs_are_handled() {
        let measures = ResidualMeasures::of(&[(&[0.0; 9], &[1.0; 9])], 0.01);
        assert!(finding_kinds(&measures).is_empty());
        assert!(finding_kinds(&ResidualMeasures::of(&[], 0.01)).is_empty());
        let eps: Vec<f64> = (0..2000).map(|t| (0.1 * f64::from(t)).sin()).collect();
        let measures = ResidualMeasures::of(&[(&eps, &[])], 0.01);
        assert_eq!(finding_kinds(&measures), ["residuals-not-white"]);
    }
}
