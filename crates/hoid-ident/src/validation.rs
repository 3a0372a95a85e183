//! How well a model describes a record.
//!
//! - `VAF = max(0, 1 - sum (u - u^)^2 / sum u^2) 100 %` (eq. 39): no mean is removed;
//! - `NRMSE fit = (1 - |u - u^| / |u - mean u|) 100 %`: the mean is removed, may be negative (the fit percent of most tools);
//! - residual autocorrelation `r_eps(k) / r_eps(0)`, bounds `+- z / sqrt n` for white residuals;
//! - cross-correlation of residuals and input, `r_eps,e(k) / sqrt(r_eps(0) r_e(0))`, with the bounds
//!   `+- z sqrt( (1/n) sum_k rho_eps(k) rho_e(k) )` that hold when the residuals need not be white (Ljung, *System
//!   Identification*, 1999, eq. 16.56). At positive lags it tells of dynamics that the model missed; at negative lags
//!   (the residual leads the input) of feedback, which a closed loop always has;
//! - whiteness by `Q = n (n + 2) sum_k r_k^2/(n - k)`, chi-square distributed for white residuals (G. M. Ljung and G. E. P. Box,
//!   *Biometrika* 65 (1978) 297-303).

use hoid_model::{Record, polynomial::product, polynomial_model::monic};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::{Fit, IdentError, Series, linalg::least_squares::dot, linalg::products::variance};

/// Largest lag of the residual tests, in samples.
pub const LARGEST_LAG: usize = 50;

/// 99 % point of the normal distribution, two sided.
const Z_99: f64 = 2.575_829_303_548_901;

/// Fit percentages on one record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// VAF of the simulated output, %.
    pub vaf_simulation: f64,
    /// VAF of the one-step-ahead prediction, %.
    pub vaf_prediction: f64,
    /// NRMSE fit of the simulated output, %.
    pub nrmse_simulation: f64,
    /// NRMSE fit of the one-step-ahead prediction, %.
    pub nrmse_prediction: f64,
}

/// A correlation over lags with its 99 % bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    /// Lags in samples.
    pub lags: Vec<i64>,
    /// Normalised correlation at each lag.
    pub values: Vec<f64>,
    /// Bound that 99 % of the values keep when there is no correlation.
    pub bound_99: f64,
}

/// Test of Ljung and Box: are the residuals white?
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LjungBox {
    /// `Q = n (n + 2) sum_k r_k^2/(n - k)` over the lags 1 to [`LARGEST_LAG`].
    pub statistic: f64,
    /// Lags less the free coefficients of the noise model (those of A, C and D).
    pub degrees_of_freedom: usize,
    /// Probability of a larger Q for white residuals.
    pub p_value: f64,
}

/// What the residual tests say. A lag outside its 99 % bound is expected once in a hundred; more than [`SHARE_ALLOWED`] of
/// them is a sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Signs {
    /// The residuals are not white at the 1 % level: the noise model is too small.
    pub coloured_residuals: bool,
    /// The residuals follow the input at positive lags: the model misses dynamics, or has the wrong delay.
    pub under_modelled: bool,
    /// The input follows the residuals at negative lags: the output is fed back to the input, as in every closed loop.
    pub feedback: bool,
}

/// Share of lags outside the 99 % bound above which a correlation counts as present.
pub const SHARE_ALLOWED: f64 = 0.06;

/// Simulated and predicted output of a model on a record, with what follows from them.
#[derive(Debug, Clone, PartialEq)]
pub struct Validation {
    /// First sample that all of the series below cover.
    pub first: usize,
    /// Simulated output.
    pub simulated: Vec<f64>,
    /// One-step-ahead prediction.
    pub predicted: Vec<f64>,
    /// VAF and NRMSE.
    pub quality: Quality,
    /// Residual autocorrelation, lags 1 to [`LARGEST_LAG`].
    pub autocorrelation: Correlation,
    /// Cross-correlation of residuals and input, lags from minus to plus [`LARGEST_LAG`]; no lags without an input.
    pub cross_correlation: Correlation,
    /// Whiteness of the residuals; `None` when there are fewer lags than coefficients of the noise model.
    pub ljung_box: Option<LjungBox>,
}

impl Validation {
    /// What the residual tests say.
    pub fn signs(&self) -> Signs {
        let outside = |keep: fn(i64) -> bool| {
            let c = &self.cross_correlation;
            let lags = || c.lags.iter().zip(&c.values).filter(|(k, _)| keep(**k));
            let beyond = lags().filter(|(_, r)| r.abs() > c.bound_99).count();
            beyond as f64 > SHARE_ALLOWED * lags().count() as f64
        };
        Signs {
            coloured_residuals: self.ljung_box.is_some_and(|t| t.p_value < 0.01),
            under_modelled: outside(|k| k >= 0),
            feedback: outside(|k| k < 0),
        }
    }
}

impl Fit {
    /// Compares the model with a record, the one it was fitted on or another.
    ///
    /// # Errors
    /// As [`Fit::residuals`].
    pub fn validate(&self, record: &Record) -> Result<Validation, IdentError> {
        let (first, simulated, predicted) = self.model_outputs(record)?;
        let output = &record.output()[first..];
        let residuals = centred(output.iter().zip(&predicted).map(|(u, p)| u - p).collect());
        let autocorrelation = autocorrelation(&residuals, LARGEST_LAG);
        let o = self.orders();
        let of_noise = |name: &str| name.starts_with(['a', 'c', 'd']);
        let free = o
            .parameter_names()
            .iter()
            .zip(self.held())
            .filter(|(name, held)| of_noise(name) && !**held)
            .count();
        // A grey box has one parameter in its noise model, T_n.
        let free = if self.is_grey_box() { free.min(1) } else { free };
        Ok(Validation {
            ljung_box: ljung_box(&autocorrelation, residuals.len(), free),
            quality: Squares::default().and(output, &simulated, &predicted).quality(),
            autocorrelation,
            cross_correlation: match record.input_channel() {
                Some(input) => cross_correlation(&residuals, &centred(input.values[first..].to_vec()), LARGEST_LAG),
                None => Correlation {
                    lags: Vec::new(),
                    values: Vec::new(),
                    bound_99: 0.0,
                },
            },
            first,
            simulated,
            predicted,
        })
    }

    /// The first sample that both cover, and from there on the simulated output and the prediction one step ahead.
    fn model_outputs(&self, record: &Record) -> Result<(usize, Vec<f64>, Vec<f64>), IdentError> {
        let (simulated, predicted) = (self.simulate(record)?, self.predict(record)?);
        let first = simulated.first.max(predicted.first);
        let from_there = |mut series: Series| {
            series.values.drain(..first - series.first);
            series.values
        };
        Ok((first, from_there(simulated), from_there(predicted)))
    }

    /// Prediction of the output k samples ahead, the input being known: `u - sum_{j<k} h_j eps(t-j)` with h the impulse response
    /// of the noise filter C/(A D) (L. Ljung, *System Identification*, 1999, eq. 3.31). k = 1 is [`Fit::predict`]; for large k,
    /// and a stable noise filter, it goes over into [`Fit::simulate`].
    ///
    /// # Errors
    /// As [`Fit::residuals`]; [`IdentError::BadOption`] for k = 0.
    pub fn predict_ahead(&self, record: &Record, k: usize) -> Result<Series, IdentError> {
        if k == 0 {
            return Err(IdentError::BadOption {
                option: "the prediction horizon".to_owned(),
                found: "0".to_owned(),
                expected: "one sample or more".to_owned(),
            });
        }
        let eps = self.residuals(record)?;
        let m = self.model();
        let mut h = monic(m.c());
        h.resize(k, 0.0);
        let poles = product(&monic(m.a()), &monic(m.d()));
        hoid_core::filter::divide_in_place(&poles[1..], &mut h);
        let mut errors = vec![0.0; eps.values.len()];
        hoid_core::filter::fir(&h, 0, &eps.values, &mut errors);
        // Before that the residuals of the last k samples are not all known.
        let skipped = (k - 1).min(errors.len());
        let first = eps.first + skipped;
        let output = &record.output()[first..];
        Ok(Series {
            first,
            values: output.iter().zip(&errors[skipped..]).map(|(u, e)| u - e).collect(),
        })
    }

    /// VAF and NRMSE over several records together: the squared errors of all of them against the power (for NRMSE, the
    /// spread around the mean of each record) of all of them.
    ///
    /// # Errors
    /// As [`Fit::residuals`].
    pub fn quality(&self, records: &[Record]) -> Result<Quality, IdentError> {
        let all = records.iter().try_fold(Squares::default(), |all, record| {
            let (first, simulated, predicted) = self.model_outputs(record)?;
            Ok::<_, IdentError>(all.and(&record.output()[first..], &simulated, &predicted))
        });
        all.map(|all| all.quality())
    }
}

impl Quality {
    /// That of several records together, as [`Fit::quality`], where their validations are at hand.
    pub fn together<'a>(validated: impl Iterator<Item = (&'a Record, &'a Validation)>) -> Self {
        let with = |all: Squares, (record, v): (&'a Record, &'a Validation)| {
            all.and(&record.output()[v.first..], &v.simulated, &v.predicted)
        };
        validated.fold(Squares::default(), with).quality()
    }
}

/// Sums of squares over records.
#[derive(Default)]
struct Squares {
    power: f64,
    spread: f64,
    of_simulation: f64,
    of_prediction: f64,
}

impl Squares {
    /// With one more record.
    fn and(self, measured: &[f64], simulated: &[f64], predicted: &[f64]) -> Self {
        Self {
            power: self.power + dot(measured, measured),
            spread: self.spread + spread_of(measured),
            of_simulation: self.of_simulation + squared_distance(measured, simulated),
            of_prediction: self.of_prediction + squared_distance(measured, predicted),
        }
    }

    fn quality(&self) -> Quality {
        Quality {
            vaf_simulation: vaf_of(self.of_simulation, self.power),
            vaf_prediction: vaf_of(self.of_prediction, self.power),
            nrmse_simulation: nrmse_of(self.of_simulation, self.spread),
            nrmse_prediction: nrmse_of(self.of_prediction, self.spread),
        }
    }
}

/// Variance accounted for (eq. 39), %. Zero where the measured signal is zero.
pub fn vaf(measured: &[f64], model: &[f64]) -> f64 {
    vaf_of(squared_distance(measured, model), dot(measured, measured))
}

/// NRMSE fit, %. Zero where the measured signal is constant.
pub fn nrmse_fit(measured: &[f64], model: &[f64]) -> f64 {
    nrmse_of(squared_distance(measured, model), spread_of(measured))
}

/// Sum of the squared distances from the mean; zero for a constant.
fn spread_of(x: &[f64]) -> f64 {
    if x.is_empty() {
        0.0
    } else {
        variance(&[x]) * x.len() as f64
    }
}

fn vaf_of(squared_error: f64, power: f64) -> f64 {
    if power == 0.0 {
        0.0
    } else {
        (100.0 * (1.0 - squared_error / power)).max(0.0)
    }
}

fn nrmse_of(squared_error: f64, spread: f64) -> f64 {
    if spread == 0.0 {
        0.0
    } else {
        100.0 * (1.0 - (squared_error / spread).sqrt())
    }
}

fn squared_distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum()
}

/// Samples that are multiplied with all lags before the next ones: they stay in the memory near the processor.
const BLOCK: usize = 8192;

/// `sum_t x(t) y(t - k)` over the overlap, for each lag k; both have the same length.
fn covariances_at(x: &[f64], y: &[f64], lags: &[i64]) -> Vec<f64> {
    let n = x.len();
    let mut sums = vec![0.0; lags.len()];
    for from in (0..n).step_by(BLOCK) {
        for (sum, &lag) in sums.iter_mut().zip(lags) {
            let (late, early) = (lag.max(0).unsigned_abs() as usize, lag.min(0).unsigned_abs() as usize);
            let first = from.max(late);
            let end = (from + BLOCK).min(n.saturating_sub(early));
            if first < end {
                *sum += dot(&x[first..end], &y[first + early - late..end + early - late]);
            }
        }
    }
    sums
}

fn centred(mut x: Vec<f64>) -> Vec<f64> {
    let mean = x.iter().sum::<f64>() / x.len().max(1) as f64;
    x.iter_mut().for_each(|v| *v -= mean);
    x
}

/// Covariances over a size; zeros where that is zero.
fn relative_to(size: f64, mut covariances: Vec<f64>) -> Vec<f64> {
    covariances
        .iter_mut()
        .for_each(|c| *c = if size > 0.0 { *c / size } else { 0.0 });
    covariances
}

/// Of a signal with mean zero.
fn autocorrelation(x: &[f64], largest: usize) -> Correlation {
    let power = covariances_at(x, x, &[0])[0];
    let lags: Vec<i64> = (1..=largest.min(x.len().saturating_sub(1)) as i64).collect();
    Correlation {
        values: relative_to(power, covariances_at(x, x, &lags)),
        lags,
        bound_99: Z_99 / (x.len() as f64).sqrt(),
    }
}

/// Test of Ljung and Box on residuals whose noise model has `free` coefficients; `None` when there are fewer lags than those.
pub fn whiteness(residuals: &[f64], free: usize) -> Option<LjungBox> {
    let residuals = centred(residuals.to_vec());
    ljung_box(&autocorrelation(&residuals, LARGEST_LAG), residuals.len(), free)
}

fn ljung_box(correlation: &Correlation, n: usize, free: usize) -> Option<LjungBox> {
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

/// Of residuals and an input, both with mean zero.
fn cross_correlation(x: &[f64], y: &[f64], largest: usize) -> Correlation {
    let largest = largest.min(x.len().saturating_sub(1)) as i64;
    let lags: Vec<i64> = (-largest..=largest).collect();
    // The residuals are nearly white, so that few lags carry the sum, which has each of them on both sides of zero.
    let reach: Vec<i64> = (0..=(4 * largest).min(x.len() as i64 - 1)).collect();
    let (of_x, of_y) = (covariances_at(x, x, &reach), covariances_at(y, y, &reach));
    let zero = of_x.first().zip(of_y.first()).map_or(0.0, |(x, y)| x * y);
    let size = zero.sqrt();
    let values = relative_to(size, covariances_at(x, y, &lags));
    let sum: f64 = zero + 2.0 * of_x.iter().zip(&of_y).skip(1).map(|(x, y)| x * y).sum::<f64>();
    let variance = if size > 0.0 {
        (sum / (size * size)).max(0.0) / x.len() as f64
    } else {
        0.0
    };
    Correlation {
        lags,
        values,
        bound_99: Z_99 * variance.sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vaf_and_nrmse_of_known_signals() {
        let u = [1.0, 3.0, 1.0, 3.0];
        assert_eq!(vaf(&u, &u), 100.0);
        assert_eq!(nrmse_fit(&u, &u), 100.0);
        // Error of 1 in each sample: sum of squares 4 of 20, and as large as the spread around the mean.
        let off = [2.0, 2.0, 2.0, 2.0];
        assert!((vaf(&u, &off) - 80.0).abs() < 1e-12);
        assert!(nrmse_fit(&u, &off).abs() < 1e-12);
        assert_eq!(vaf(&u, &[-9.0; 4]), 0.0);
        assert!(nrmse_fit(&u, &[-9.0; 4]) < 0.0);
        assert_eq!(vaf(&[0.0; 3], &[1.0; 3]), 0.0);
        assert_eq!(nrmse_fit(&[2.0; 3], &[1.0; 3]), 0.0);
    }

    #[test]
    fn covariances_over_several_blocks_are_plain_sums() {
        let n = 2 * BLOCK + 77;
        let x: Vec<f64> = (0..n).map(|t| (0.37 * t as f64).sin()).collect();
        let y: Vec<f64> = (0..n).map(|t| (0.11 * t as f64).cos()).collect();
        let lags = [
            0,
            1,
            -1,
            50,
            -50,
            BLOCK as i64 + 3,
            -(BLOCK as i64) - 3,
            n as i64 - 1,
            1 - n as i64,
            n as i64,
        ];
        for (lag, found) in lags.into_iter().zip(covariances_at(&x, &y, &lags)) {
            let inside = |t: i64| (0..n as i64).contains(&(t - lag));
            let plain: f64 = (0..n as i64)
                .filter(|t| inside(*t))
                .map(|t| x[t as usize] * y[(t - lag) as usize])
                .sum();
            // Rounding of some ten thousand terms.
            assert!((found - plain).abs() < 1e-11, "lag {lag}: {found} and {plain}");
        }
    }

    #[test]
    fn correlation_of_white_noise_keeps_its_bounds_and_a_delay_shows() {
        let mut state = 5_u64;
        let mut draw = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let x: Vec<f64> = (0..20_000).map(|_| draw()).collect();
        let x = centred(x);
        let own = autocorrelation(&x, 50);
        let outside = own.values.iter().filter(|v| v.abs() > own.bound_99).count();
        // 50 values at 1 %: more than four outside has probability 1e-4.
        assert!(outside <= 4, "{outside}");
        // y leads x by seven samples: x(t) = y(t - 7).
        let y: Vec<f64> = x[7..].to_vec();
        let cross = cross_correlation(&x[..x.len() - 7], &y, 10);
        let peak = cross.lags[cross
            .values
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1))
            .unwrap()
            .0];
        assert_eq!(peak, 7);
        assert!((cross.bound_99 - Z_99 / (x.len() as f64).sqrt()).abs() < 0.1 * cross.bound_99);
    }

    #[test]
    fn ljung_and_box_as_published() {
        // r = 0.1, -0.2, n = 100: Q = 100 * 102 * (0.01/99 + 0.04/98) = 5.1936; chi-square with 2 degrees: exp(-Q/2).
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

    #[test]
    fn short_and_silent_signals_do_not_panic() {
        assert_eq!(autocorrelation(&[1.0], 50).values.len(), 0);
        assert!(autocorrelation(&[0.0; 100], 5).values.iter().all(|v| *v == 0.0));
        assert!(
            cross_correlation(&[0.0; 10], &[1.0; 10], 5)
                .values
                .iter()
                .all(|v| *v == 0.0)
        );
    }
}
