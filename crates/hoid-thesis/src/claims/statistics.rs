//! Statistics over replications with Monte Carlo errors: medians, shares, and jackknifed functions of paired values.
//!
//! - The error of a median is computed by the module [`hoid_study::statistics`].
//! - The error of any other function of the replications is computed by the delete-a-group jackknife (Kott, *Journal of
//!   Official Statistics* 17, 2001): x_g is the value with the g-th tenth of the replications omitted from all samples,
//!   and `s^2 = (G - 1)/G sum (x_g - mean x_g)^2`. Estimators applied to the same records stay paired.

use hoid_numerics::statistics::{mean, sum_of_squared_deviations};
use hoid_study::{Statistics, statistics::median};

use super::value::Value;

/// Number of groups of the jackknife.
const GROUP_COUNT: usize = 10;
/// Smallest share of the replications that must give a value.
pub(super) const MIN_VALID_SHARE: f64 = 0.5;

/// Missing value, used if too few replications give a value.
pub(super) const MISSING_VALUE: Value = Value {
    value: f64::NAN,
    error: f64::NAN,
};

/// Magnitudes of the values.
pub(super) fn magnitudes(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| v.abs()).collect()
}

/// True if the share of replications that give a value is at least [`MIN_VALID_SHARE`].
fn has_enough_values(values: &[f64]) -> bool {
    let finite = values.iter().filter(|v| v.is_finite()).count();
    finite > 0 && finite as f64 >= MIN_VALID_SHARE * values.len() as f64
}

fn statistic_value(values: &[f64], figure: fn(&Statistics) -> (f64, f64)) -> Value {
    if !has_enough_values(values) {
        return MISSING_VALUE;
    }
    let (value, error) = figure(&Statistics::of(values));
    Value {
        value,
        // A scenario without remnant has a single replication, which suffices.
        error: if values.len() == 1 { 0.0 } else { error },
    }
}

pub(super) fn median_of(values: &[f64]) -> Value {
    statistic_value(values, |s| (s.median, s.median_se))
}

pub(super) fn mean_of(values: &[f64]) -> Value {
    statistic_value(values, |s| (s.mean, s.mean_se))
}

pub(super) fn share_value(values: &[f64]) -> Value {
    let finite: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    let (n, p) = (finite.len() as f64, mean(&finite));
    Value {
        value: p,
        error: (p * (1.0 - p) / n).sqrt().max(1.5 / n),
    }
}

/// The median; NaN if there are not enough values.
pub(super) fn median_or_nan(values: &[f64]) -> f64 {
    if has_enough_values(values) {
        median(values)
    } else {
        f64::NAN
    }
}

/// The magnitude of the median.
pub(super) fn median_bias(values: &[f64]) -> f64 {
    median_or_nan(values).abs()
}

/// The median of the magnitude.
pub(super) fn median_magnitude(values: &[f64]) -> f64 {
    median_or_nan(&magnitudes(values))
}

/// The interquartile range.
pub(super) fn interquartile_range(values: &[f64]) -> f64 {
    if !has_enough_values(values) {
        return f64::NAN;
    }
    let s = Statistics::of(values);
    s.upper_quartile - s.lower_quartile
}

/// Largest minus smallest value.
pub(super) fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values {
        if value.is_nan() {
            return value;
        }
        least = least.min(value);
        most = most.max(value);
    }
    most - least
}

/// R^2 of the straight line fitted to evenly spaced values.
pub(super) fn linearity(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let (x0, y0) = (0.5 * (n - 1.0), mean(values));
    let [mut xx, mut xy, mut yy] = [0.0; 3];
    for (k, y) in values.iter().enumerate() {
        let (x, y) = (k as f64 - x0, y - y0);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    xy * xy / (xx * yy)
}

/// Value of a function of samples, with its error by the delete-a-group jackknife.
pub(super) fn jackknife(samples: &[Vec<f64>], f: &dyn Fn(&[Vec<f64>]) -> f64) -> Value {
    let value = f(samples);
    let n = samples.iter().map(Vec::len).max().unwrap_or(0);
    let groups = GROUP_COUNT.min(n);
    if groups < 2 {
        return Value { value, error: 0.0 };
    }
    let left: Vec<f64> = (0..groups)
        .map(|group| {
            let without = |sample: &Vec<f64>| match sample.len() {
                1 => sample.clone(),
                _ => sample
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| i % groups != group)
                    .map(|(_, v)| *v)
                    .collect(),
            };
            f(&samples.iter().map(without).collect::<Vec<_>>())
        })
        .collect();
    let g = groups as f64;
    Value {
        value,
        error: ((g - 1.0) / g * sum_of_squared_deviations(&left)).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normals(n: usize, seed: u64) -> Vec<f64> {
        let mut state = seed;
        let mut uniform = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..n).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
    }

    #[test]
    fn jackknife_error_of_a_mean_is_its_standard_error() {
        // For a mean, the expectation of s^2 is exact. With 9 degrees of freedom s has a spread of 24 %, which
        // averaging over 400 samples reduces to 1.2 %, and its mean is 2.7 % too small (square root of a chi-square
        // variable).
        let errors: f64 = (0..400)
            .map(|seed| jackknife(&[normals(100, seed)], &|s| s[0].iter().sum::<f64>() / s[0].len() as f64).error)
            .sum();
        assert!((errors / 400.0 - 0.1 * 0.973).abs() < 0.005, "{}", errors / 400.0);
    }

    #[test]
    fn jackknife_keeps_pairs_together() {
        let a = normals(100, 3);
        let b: Vec<f64> = a.iter().map(|a| a + 1.0).collect();
        let found = jackknife(&[a, b], &|s| median_or_nan(&s[1]) - median_or_nan(&s[0]));
        assert!((found.value - 1.0).abs() < 1e-12 && found.error < 1e-12, "{found:?}");
    }

    #[test]
    fn too_few_values_give_no_estimate() {
        let most = [1.0, 2.0, f64::NAN];
        let few = [1.0, f64::NAN, f64::NAN];
        assert_eq!(median_of(&most).value, 1.5);
        assert!(
            median_of(&few).value.is_nan()
                && median_or_nan(&few).is_nan()
                && median_magnitude(&few).is_nan()
                && interquartile_range(&few).is_nan()
        );
        assert_eq!(median_of(&[7.0]), Value { value: 7.0, error: 0.0 });
        assert_eq!(jackknife(&[vec![7.0]], &|s| s[0][0]), Value { value: 7.0, error: 0.0 });
        assert_eq!(
            share_value(&[0.0; 30]),
            Value {
                value: 0.0,
                error: 0.05
            }
        );
        assert_eq!(spread([3.0, -1.0, 2.0].into_iter()), 4.0);
        assert!(spread([3.0, f64::NAN].into_iter()).is_nan());
    }

    #[test]
    fn linearity_is_one_for_a_line_and_less_for_a_parabola() {
        assert!((linearity(&[1.0, 3.0, 5.0, 7.0]) - 1.0).abs() < 1e-12);
        assert!(linearity(&[1.0, 0.0, 0.0, 1.0]) < 1e-12);
        // In NumPy, corrcoef([0, 1, 2, 3], [0, 1, 4, 9])^2 = 0.9184.
        assert!((linearity(&[0.0, 1.0, 4.0, 9.0]) - 0.918_4).abs() < 1e-4);
    }
}
