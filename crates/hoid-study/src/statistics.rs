//! Statistics of the replications of a cell.
//!
//! - Quantiles interpolate linearly between order statistics (type 7 of Hyndman and Fan, *The
//!   American Statistician* 50, 1996; the default of NumPy and R).
//! - Whiskers extend to the last value within 1.5 interquartile ranges of the box; any value beyond them is an outlier
//!   (Tukey, 1977).
//! - Monte Carlo errors: for the mean, `s / sqrt(n)`; for the standard deviation,
//!   `sqrt((m4 - s^4 (n-3)/(n-1)) / n) / (2 s)` with the fourth central moment m4 (Rao, *Linear Statistical Inference*,
//!   1973); for the median of any distribution, half the distance between the order statistics one binomial standard
//!   deviation on either side of the middle; for a rate, `sqrt(p (1 - p) / n)`.

use hoid_numerics::statistics::{self, mean, sorted_finite_values};

/// Statistics of a set of values, for box plots and tables.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Statistics {
    /// Number of values, without those that are not finite.
    pub count: usize,
    /// Number of values that are not finite.
    pub missing: usize,
    /// Mean.
    pub mean: f64,
    /// Monte Carlo error of the mean.
    pub mean_se: f64,
    /// Standard deviation (divisor n - 1).
    pub sd: f64,
    /// Monte Carlo error of the standard deviation.
    pub sd_se: f64,
    /// Smallest value.
    pub min: f64,
    /// Lower end of the lower whisker.
    pub lower_whisker: f64,
    /// 25 % quantile.
    pub lower_quartile: f64,
    /// Median.
    pub median: f64,
    /// Monte Carlo error of the median.
    pub median_se: f64,
    /// 75 % quantile.
    pub upper_quartile: f64,
    /// Upper end of the upper whisker.
    pub upper_whisker: f64,
    /// Largest value.
    pub max: f64,
    /// Values beyond the whiskers, in ascending order.
    pub outliers: Vec<f64>,
}

impl Statistics {
    /// Computes the statistics of values. If there are no finite values, all statistics except the counts are NaN.
    pub fn of(values: &[f64]) -> Self {
        let sorted = sorted_finite_values(values.iter().copied());
        let (n, missing) = (sorted.len(), values.len() - sorted.len());
        let (Some(&min), Some(&max)) = (sorted.first(), sorted.last()) else {
            return Self {
                missing,
                ..Self::empty()
            };
        };
        let mean = mean(&sorted);
        let moment = |p: i32| sorted.iter().map(|v| (v - mean).powi(p)).sum::<f64>();
        let (sd, sd_se) = deviation(moment(2), moment(4), n);
        let [lower_quartile, median, upper_quartile] = [0.25, 0.5, 0.75].map(|p| quantile(&sorted, p));
        let reach = 1.5 * (upper_quartile - lower_quartile);
        let within = |v: &&f64| (lower_quartile - reach..=upper_quartile + reach).contains(*v);
        let lower_whisker = sorted.iter().find(within).copied().unwrap_or(min).min(lower_quartile);
        let upper_whisker = sorted
            .iter()
            .rev()
            .find(within)
            .copied()
            .unwrap_or(max)
            .max(upper_quartile);
        Self {
            count: n,
            missing,
            mean,
            mean_se: sd / (n as f64).sqrt(),
            sd,
            sd_se,
            min,
            lower_whisker,
            lower_quartile,
            median,
            median_se: error_of_median(&sorted),
            upper_quartile,
            upper_whisker,
            max,
            outliers: sorted.iter().filter(|v| !within(v)).copied().collect(),
        }
    }

    fn empty() -> Self {
        Self {
            mean: f64::NAN,
            mean_se: f64::NAN,
            sd: f64::NAN,
            sd_se: f64::NAN,
            min: f64::NAN,
            lower_whisker: f64::NAN,
            lower_quartile: f64::NAN,
            median: f64::NAN,
            median_se: f64::NAN,
            upper_quartile: f64::NAN,
            upper_whisker: f64::NAN,
            max: f64::NAN,
            ..Self::default()
        }
    }
}

fn deviation(second: f64, fourth: f64, n: usize) -> (f64, f64) {
    if n < 2 {
        return (f64::NAN, f64::NAN);
    }
    let count = n as f64;
    let variance = second / (count - 1.0);
    let sd = variance.sqrt();
    let of_variance = (fourth / count - variance * variance * (count - 3.0) / (count - 1.0)) / count;
    let se = if sd > 0.0 {
        of_variance.max(0.0).sqrt() / (2.0 * sd)
    } else {
        0.0
    };
    (sd, se)
}

/// Returns a quantile of sorted values by linear interpolation; NaN if there are no values.
pub fn quantile(sorted: &[f64], p: f64) -> f64 {
    statistics::quantile(sorted, p).unwrap_or(f64::NAN)
}

/// Returns the median of the finite values; NaN if there are none.
pub fn median(values: &[f64]) -> f64 {
    statistics::finite_quantile(values, 0.5).unwrap_or(f64::NAN)
}

/// Returns the standard error of the median of sorted values.
fn error_of_median(sorted: &[f64]) -> f64 {
    let n = sorted.len();
    if n < 2 {
        return f64::NAN;
    }
    let middle = 0.5 * (n as f64 - 1.0);
    let away = 0.5 * (n as f64).sqrt();
    let last = n as f64 - 1.0;
    let low = quantile(sorted, (middle - away) / last);
    let high = quantile(sorted, (middle + away) / last);
    0.5 * (high - low)
}

/// Returns a rate and its Monte Carlo error.
pub fn rate(hits: usize, of: usize) -> (f64, f64) {
    if of == 0 {
        return (f64::NAN, f64::NAN);
    }
    let p = hits as f64 / of as f64;
    (p, (p * (1.0 - p) / of as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_statistics_match_a_manual_example() {
        // In NumPy, quantile([1..9, 100], [.25, .5, .75]) = 3.25, 5.5, 7.75; the whiskers are within 3.25 - 6.75 and
        // 7.75 + 6.75.
        let values = [5.0, 1.0, 9.0, 100.0, 2.0, 8.0, 3.0, 7.0, 4.0, 6.0];
        let s = Statistics::of(&values);
        assert_eq!((s.lower_quartile, s.median, s.upper_quartile), (3.25, 5.5, 7.75));
        assert_eq!((s.lower_whisker, s.upper_whisker), (1.0, 9.0));
        assert_eq!(s.outliers, [100.0]);
        assert_eq!((s.count, s.mean), (10, 14.5));
        assert!((s.sd - 30.152_4).abs() < 1e-3, "{}", s.sd);
    }

    #[test]
    fn few_equal_or_missing_values_are_handled() {
        let none = Statistics::of(&[f64::NAN, f64::INFINITY]);
        assert_eq!((none.count, none.missing), (0, 2));
        assert!(none.median.is_nan());
        let one = Statistics::of(&[3.0]);
        assert_eq!((one.median, one.lower_whisker, one.upper_whisker), (3.0, 3.0, 3.0));
        assert!(one.sd.is_nan() && one.outliers.is_empty());
        let same = Statistics::of(&[2.0; 8]);
        assert_eq!((same.sd, same.sd_se, same.median_se), (0.0, 0.0, 0.0));
        assert!(rate(0, 0).0.is_nan());
        assert_eq!(rate(1, 4), (0.25, (0.1875_f64 / 4.0).sqrt()));
    }

    /// Compares the computed Monte Carlo errors with the spread of mean, standard deviation and median over many
    /// samples of 100 normal and of 100 uniform numbers.
    #[test]
    fn monte_carlo_errors_match_the_observed_spread() {
        // With 4000 samples, the standard error of a standard deviation is 1.1 %; the mean of the computed errors is
        // much more accurate. At n = 100, the error of the median of uniform numbers from order statistics is 6 % too
        // small, a small-sample effect of the interpolation.
        let mut state = 12345u64;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for normal in [true, false] {
            let samples: Vec<Statistics> = (0..4000)
                .map(|_| {
                    let values: Vec<f64> = (0..100)
                        .map(|_| {
                            if normal {
                                (0..12).map(|_| uniform()).sum::<f64>() - 6.0
                            } else {
                                uniform()
                            }
                        })
                        .collect();
                    Statistics::of(&values)
                })
                .collect();
            let spread = |of: fn(&Statistics) -> f64| Statistics::of(&samples.iter().map(of).collect::<Vec<_>>()).sd;
            let claimed = |of: fn(&Statistics) -> f64| Statistics::of(&samples.iter().map(of).collect::<Vec<_>>()).mean;
            let ratio = |a: f64, b: f64| a / b;
            let of_mean = ratio(claimed(|s| s.mean_se), spread(|s| s.mean));
            let of_sd = ratio(claimed(|s| s.sd_se), spread(|s| s.sd));
            let of_median = ratio(claimed(|s| s.median_se), spread(|s| s.median));
            assert!((of_mean - 1.0).abs() < 0.04, "{of_mean}");
            assert!((of_sd - 1.0).abs() < 0.06, "{of_sd}");
            assert!((of_median - 1.0).abs() < 0.12, "{of_median}");
        }
    }
}
