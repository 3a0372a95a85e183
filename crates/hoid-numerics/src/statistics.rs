//! Basic statistics of a set of values.
//!
//! **Quantiles** follow R. J. Hyndman and Y. Fan, *The American Statistician* 50 (1996) 361-365. With the order
//! statistics `x_0 <= .. <= x_(n-1)` and a fraction p:
//!
//! | function | value | definition |
//! |---|---|---|
//! | [`quantile`] | x at the position `(n-1) p`, by linear interpolation | type 7, the default of NumPy and R |
//! | [`nearest_quantile`] | `x_k`, where k is the integer nearest to `(n-1) p` | type 7 without interpolation |
//! | [`upper_quantile`] | `x_k`, where k is the largest integer not above `n p` | right-continuous inverse of the empirical distribution, type 1 except where `n p` is an integer |
//!
//! [`quantile`] is used in tables and figures. [`nearest_quantile`] and [`upper_quantile`] return one of the values and
//! do not need a full sort. They are used for robust scale estimates from many samples, and for thresholds whose
//! results depend on the definition. For the median, both return the upper of the two middle values.
//!
//! Values are ordered by [`f64::total_cmp`].

#[cfg(feature = "alloc")]
use alloc::vec::Vec;

/// Returns the mean; NaN for no values.
#[inline]
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Returns the sum of the squared deviations from the mean.
#[inline]
pub fn sum_of_squared_deviations(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|v| (v - mean) * (v - mean)).sum()
}

/// Returns the variance about the mean with the divisor n; NaN for no values.
#[inline]
pub fn variance(values: &[f64]) -> f64 {
    sum_of_squared_deviations(values) / values.len() as f64
}

/// Returns the unbiased variance about the mean with the divisor n - 1; NaN for fewer than two values.
#[inline]
pub fn sample_variance(values: &[f64]) -> f64 {
    sum_of_squared_deviations(values) / (values.len() as f64 - 1.0)
}

/// Returns the square root of the variance about the mean with the divisor n; zero for no values, unlike [`variance`].
#[inline]
pub fn standard_deviation(values: &[f64]) -> f64 {
    libm::sqrt(sum_of_squared_deviations(values) / values.len().max(1) as f64)
}

/// Returns the mean of the squares; NaN for no values.
#[inline]
pub fn mean_square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

/// Returns the root mean square; NaN for no values.
#[inline]
pub fn root_mean_square(values: &[f64]) -> f64 {
    libm::sqrt(mean_square(values))
}

/// Returns the quantile of sorted values for a fraction from 0 to 1, by linear interpolation; `None` for no values.
pub fn quantile(sorted: &[f64], fraction: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let at = fraction.clamp(0.0, 1.0) * last as f64;
    let below = at as usize;
    let (low, high) = (sorted[below], sorted[(below + 1).min(last)]);
    Some(low + (at - below as f64) * (high - low))
}

/// Returns the order statistic nearest to the position of a quantile, or the upper of two that are equally near.
/// Reorders the values. Returns `None` for no values.
pub fn nearest_quantile(values: &mut [f64], fraction: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    order_statistic(values, libm::round(last as f64 * fraction) as usize)
}

/// Returns the smallest value for which more than the given fraction of the values is at or below it, or the largest
/// value if there is none. Reorders the values. Returns `None` for no values.
pub fn upper_quantile(values: &mut [f64], fraction: f64) -> Option<f64> {
    order_statistic(values, (fraction * values.len() as f64) as usize)
}

/// Returns the median, or the upper of the two middle values. Reorders the values. Returns `None` for no values.
pub fn upper_median(values: &mut [f64]) -> Option<f64> {
    order_statistic(values, values.len() / 2)
}

/// Returns the value with this index in ascending order, or the largest value if the index is too large.
fn order_statistic(values: &mut [f64], index: usize) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    Some(*values.select_nth_unstable_by(index.min(last), f64::total_cmp).1)
}

/// Returns the finite values in ascending order.
#[cfg(feature = "alloc")]
pub fn sorted_finite_values(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut finite: Vec<f64> = values.into_iter().filter(|v| v.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    finite
}

/// Returns the quantile of the finite values for a fraction from 0 to 1, by linear interpolation; `None` if no value is
/// finite.
#[cfg(feature = "alloc")]
pub fn finite_quantile(values: &[f64], fraction: f64) -> Option<f64> {
    quantile(&sorted_finite_values(values.iter().copied()), fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_match_hand_calculation() {
        let x = [1.0, 2.0, 4.0, 5.0];
        assert_eq!((mean(&x), sum_of_squared_deviations(&x)), (3.0, 10.0));
        assert_eq!((variance(&x), sample_variance(&x)), (2.5, 10.0 / 3.0));
        assert_eq!(
            (mean_square(&x), root_mean_square(&[3.0, -4.0, 5.0, 0.0])),
            (11.5, 12.5_f64.sqrt())
        );
        assert!(mean(&[]).is_nan() && variance(&[]).is_nan() && root_mean_square(&[]).is_nan());
        assert!(sample_variance(&[7.0]).is_nan());
        assert_eq!((standard_deviation(&x), standard_deviation(&[])), (2.5_f64.sqrt(), 0.0));
    }

    #[test]
    fn quantile_definitions_match_known_values() {
        // NumPy: quantile([1..9, 100], [.25, .5, .75]) = 3.25, 5.5, 7.75.
        let sorted = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 100.0];
        let mut mixed = [5.0, 1.0, 9.0, 100.0, 2.0, 8.0, 3.0, 7.0, 4.0, 6.0];
        for (share, by_line, nearest, upper) in [
            (0.0, 1.0, 1.0, 1.0),
            (0.25, 3.25, 3.0, 3.0),
            (0.5, 5.5, 6.0, 6.0),
            (0.75, 7.75, 8.0, 8.0),
            (0.9, 18.1, 9.0, 100.0),
            (1.0, 100.0, 100.0, 100.0),
        ] {
            let found = quantile(&sorted, share).unwrap_or(f64::NAN);
            assert!((found - by_line).abs() < 1e-13, "{share}: {found}");
            assert_eq!(nearest_quantile(&mut mixed, share), Some(nearest), "{share}");
            assert_eq!(upper_quantile(&mut mixed, share), Some(upper), "{share}");
        }
        assert_eq!(upper_median(&mut mixed), Some(6.0));
        assert_eq!(
            (quantile(&[3.0], 0.3), quantile(&sorted, 2.0)),
            (Some(3.0), Some(100.0))
        );
        assert_eq!((quantile(&[], 0.5), nearest_quantile(&mut [], 0.5)), (None, None));
        assert_eq!((upper_quantile(&mut [], 0.5), upper_median(&mut [])), (None, None));
    }

    #[test]
    fn median_definitions_agree_for_any_count() {
        for n in 1..30 {
            let of = || (0..n).map(|i| f64::from(i * 7 % n)).collect::<std::vec::Vec<_>>();
            let median = upper_median(&mut of());
            assert_eq!(nearest_quantile(&mut of(), 0.5), median);
            assert_eq!(upper_quantile(&mut of(), 0.5), median);
        }
    }

    #[cfg(feature = "alloc")]
    #[test]
    fn non_finite_values_are_ignored() {
        let values = [3.0, f64::NAN, 1.0, 2.0, f64::INFINITY];
        assert_eq!(sorted_finite_values(values), [1.0, 2.0, 3.0]);
        assert_eq!(
            (finite_quantile(&values, 0.25), finite_quantile(&values, 1.0)),
            (Some(1.5), Some(3.0))
        );
        assert_eq!(finite_quantile(&[f64::NAN], 0.5), None);
    }
}
