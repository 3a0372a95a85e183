//! Estimates of level and scale that are robust to faults.
//!
//! The deviation of a channel is the larger of two estimates, which agree for a normally distributed channel: its
//! median absolute deviation from the median over 0.6745, and the 90 % quantile of the absolute deviation over 1.6449.
//! The second remains valid if a hand rests more than half of the time. If both vanish, the deviation is the root mean
//! square deviation without the largest half per cent (P. J. Huber, *Robust Statistics*, 1981, ch. 5).

use hoid_numerics::statistics::{nearest_quantile, upper_median};

/// Returns the `share` quantile of the values, or zero if there are no values; reorders the values.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    nearest_quantile(values, share).unwrap_or(0.0)
}

/// Returns the median of the values, or zero if there are no values.
pub(super) fn median(values: &[f64]) -> f64 {
    upper_median(&mut values.to_vec()).unwrap_or(0.0)
}

/// Returns the median of the values and their robust deviation.
pub(super) fn level_and_deviation(values: &[f64]) -> (f64, f64) {
    if values.is_empty() {
        return (0.0, 0.0);
    }
    let level = median(values);
    let mut off: Vec<f64> = values.iter().map(|v| (v - level).abs()).collect();
    let found = (quantile(&mut off, 0.5) / 0.674_489_75).max(quantile(&mut off, 0.9) / 1.644_853_63);
    if found > 0.0 {
        return (level, found);
    }
    off.sort_unstable_by(f64::total_cmp);
    let kept = &off[..off.len() - off.len().div_ceil(200).min(off.len())];
    let squares: f64 = kept.iter().map(|v| v * v).sum();
    (level, (squares / kept.len().max(1) as f64).sqrt())
}

/// Returns the quantisation step of a channel that often holds its value; zero for a channel in full precision.
pub(super) fn quantisation_step(values: &[f64]) -> f64 {
    let changes = || values.windows(2).map(|w| (w[1] - w[0]).abs());
    let held = changes().filter(|c| *c == 0.0).count();
    if 20 * held < values.len() {
        return 0.0;
    }
    changes()
        .filter(|c| *c > 0.0)
        .fold(f64::INFINITY, f64::min)
        .min(f64::MAX)
}

#[cfg(test)]
mod tests {
    use super::{super::test_signals::autoregressive_signal, *};

    #[test]
    fn robust_scale_of_normal_resting_and_constant_channels() {
        let normal: Vec<f64> = autoregressive_signal(4000, 9)
            .windows(3)
            .map(|w| w[2] - 1.6 * w[1] + 0.8 * w[0] + 3.0)
            .collect();
        let (level, deviation) = level_and_deviation(&normal);
        assert!(
            (level - 3.0).abs() < 0.1 && (deviation - 1.0).abs() < 0.1,
            "{level} {deviation}"
        );
        let mut resting = vec![0.0; 1000];
        resting
            .iter_mut()
            .step_by(5)
            .enumerate()
            .for_each(|(k, v)| *v = if k % 2 == 0 { 2.0 } else { -2.0 });
        assert!(level_and_deviation(&resting).1 > 1.0);
        assert_eq!(level_and_deviation(&[4.0; 9]), (4.0, 0.0));
        assert_eq!(quantisation_step(&[0.0, 0.0, 0.5, 0.5, 1.0]), 0.5);
        assert_eq!(quantisation_step(&[0.0, 0.1, 0.5]), 0.0);
    }
}
