//! Autocorrelation of residuals and cross-correlation of residuals and input, with 99 % bounds.

use hoid_numerics::statistics::mean;

use crate::linalg::vectors::dot;

/// Two-sided 99 % point of the normal distribution.
const Z_99: f64 = 2.575_829_303_548_901;

/// A correlation at several lags, with a 99 % bound that is the same for all lags.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlation {
    /// Lags in samples.
    pub lags: Vec<i64>,
    /// Normalised correlation at each lag.
    pub values: Vec<f64>,
    /// Bound that contains 99 % of the values if there is no correlation.
    pub bound_99: f64,
}

/// Number of samples that are processed for all lags before the next samples, so the samples remain in the processor
/// cache.
const BLOCK_LENGTH: usize = 8192;

/// Returns `sum_t x(t) y(t - k)` for each lag k, over all t for which both samples exist; x and y have the same length.
fn covariances_at(x: &[f64], y: &[f64], lags: &[i64]) -> Vec<f64> {
    let n = x.len();
    let mut sums = vec![0.0; lags.len()];
    for from in (0..n).step_by(BLOCK_LENGTH) {
        for (sum, &lag) in sums.iter_mut().zip(lags) {
            let (late, early) = (lag.max(0).unsigned_abs() as usize, lag.min(0).unsigned_abs() as usize);
            let first = from.max(late);
            let end = (from + BLOCK_LENGTH).min(n.saturating_sub(early));
            if first < end {
                *sum += dot(&x[first..end], &y[first + early - late..end + early - late]);
            }
        }
    }
    sums
}

/// Returns the signal without its mean.
pub(super) fn centred(mut x: Vec<f64>) -> Vec<f64> {
    let mean = mean(&x);
    x.iter_mut().for_each(|v| *v -= mean);
    x
}

/// Returns the covariances divided by `size`, or zeros if `size` is not positive.
fn normalise(size: f64, mut covariances: Vec<f64>) -> Vec<f64> {
    covariances
        .iter_mut()
        .for_each(|c| *c = if size > 0.0 { *c / size } else { 0.0 });
    covariances
}

/// Returns the autocorrelation of a zero-mean signal at the lags from 1 to `largest`.
pub(super) fn autocorrelation(x: &[f64], largest: usize) -> Correlation {
    let power = covariances_at(x, x, &[0])[0];
    let lags: Vec<i64> = (1..=largest.min(x.len().saturating_sub(1)) as i64).collect();
    Correlation {
        values: normalise(power, covariances_at(x, x, &lags)),
        lags,
        bound_99: Z_99 / (x.len() as f64).sqrt(),
    }
}

/// Returns the cross-correlation of zero-mean residuals and a zero-mean input at the lags from minus to plus `largest`.
pub(super) fn cross_correlation(x: &[f64], y: &[f64], largest: usize) -> Correlation {
    let largest = largest.min(x.len().saturating_sub(1)) as i64;
    let lags: Vec<i64> = (-largest..=largest).collect();
    // Since the residuals are nearly white, the lags near zero dominate the sum, and the others are omitted.
    let reach: Vec<i64> = (0..=(4 * largest).min(x.len() as i64 - 1)).collect();
    let (of_x, of_y) = (covariances_at(x, x, &reach), covariances_at(y, y, &reach));
    let zero = of_x.first().zip(of_y.first()).map_or(0.0, |(x, y)| x * y);
    let size = zero.sqrt();
    let values = normalise(size, covariances_at(x, y, &lags));
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
    fn blockwise_covariances_equal_plain_sums() {
        let n = 2 * BLOCK_LENGTH + 77;
        let x: Vec<f64> = (0..n).map(|t| (0.37 * t as f64).sin()).collect();
        let y: Vec<f64> = (0..n).map(|t| (0.11 * t as f64).cos()).collect();
        let lags = [
            0,
            1,
            -1,
            50,
            -50,
            BLOCK_LENGTH as i64 + 3,
            -(BLOCK_LENGTH as i64) - 3,
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
            // The tolerance allows for the rounding error of about ten thousand terms.
            assert!((found - plain).abs() < 1e-11, "lag {lag}: {found} and {plain}");
        }
    }

    #[test]
    fn white_noise_stays_within_bounds_and_a_delay_gives_a_peak() {
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
        // Each of the 50 values is outside with a probability of 1 %; more than four are outside with a probability of
        // about 1e-4.
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
