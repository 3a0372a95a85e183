//! Prediction of a channel from its own past, by a fit that is robust to faults.
//!
//! `x(t) = -a_1 x(t-1) - ... - a_p x(t-p) + eps(t)` is fitted by least squares with bounded influence: a row counts
//! only if neither x(t) nor any of its p past values exceeds [`OUTLIER_LIMIT`] robust deviations (Mallows' weights on
//! the regressors) and, in later rounds, if eps does not exceed [`MAX_RESIDUAL`] times its robust scale (R. A.
//! Maronna, R. D. Martin, V. J. Yohai, *Robust Statistics*, 2006, sections 5.11 and 8.4). White noise of
//! [`NOISE_FLOOR`] deviations of x is assumed in addition: it keeps the normal equations of a smooth channel regular,
//! and smaller deviations are not faults.

use super::robust::quantile;
use crate::linalg::{gram::Gram, least_squares::solve_symmetric};

/// Largest order of the autoregression; a short channel has a lower order.
pub(super) const MAX_ORDER: usize = 16;
/// A row does not count if one of its values exceeds this number of deviations of the channel.
const OUTLIER_LIMIT: f64 = 6.0;
/// A row does not count if its residual exceeds this number of standard deviations of the residuals.
const MAX_RESIDUAL: f64 = 4.0;
/// Standard deviation of the additional white noise, relative to the deviation of the channel.
pub(super) const NOISE_FLOOR: f64 = 1e-3;
const ROUND_COUNT: usize = 3;
/// Number of rows that is sufficient for estimating the coefficients; of a longer channel only every k-th row is used.
const MAX_ROWS: usize = 40_000;

/// Coefficients `1, a_1 .. a_p` of the autoregression.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Autoregression {
    pub a: Vec<f64>,
}

impl Autoregression {
    /// Fits a centred channel with the given robust deviation; `None` if the channel is too short or constant.
    pub fn of(x: &[f64], deviation: f64) -> Option<Self> {
        let p = MAX_ORDER.min(x.len() / 20);
        if p == 0 || deviation <= 0.0 {
            return None;
        }
        let stride = (x.len() / MAX_ROWS).max(1);
        let mut near = 0;
        let mut rows: Vec<usize> = Vec::with_capacity(x.len() / stride);
        for (t, v) in x.iter().enumerate() {
            near = if v.abs() > OUTLIER_LIMIT * deviation {
                0
            } else {
                near + 1
            };
            if near > p && t % stride == 0 {
                rows.push(t);
            }
        }
        if rows.len() < 5 * p {
            rows = (p..x.len()).step_by(stride).collect();
        }
        let mut found = Self {
            a: least_squares(x, &rows, p, NOISE_FLOOR * deviation)?,
        };
        for _ in 1..ROUND_COUNT {
            let all: Vec<f64> = rows.iter().map(|t| found.residual(x, *t)).collect();
            let scale = quantile(&mut all.iter().map(|e| e.abs()).collect::<Vec<_>>(), 0.5) / 0.674_489_75;
            let scale = scale.max(NOISE_FLOOR * deviation);
            let kept = rows.iter().zip(&all).filter(|(_, e)| e.abs() <= MAX_RESIDUAL * scale);
            let kept: Vec<usize> = kept.map(|(t, _)| *t).collect();
            if kept.len() < 5 * p {
                break;
            }
            found.a = least_squares(x, &kept, p, NOISE_FLOOR * deviation)?;
        }
        Some(found)
    }

    pub fn order(&self) -> usize {
        self.a.len() - 1
    }

    /// Returns the Euclidean norm `|a|`.
    pub fn norm(&self) -> f64 {
        self.a.iter().map(|a| a * a).sum::<f64>().sqrt()
    }

    /// Returns eps(t); t must not be less than the order.
    pub fn residual(&self, x: &[f64], t: usize) -> f64 {
        self.a.iter().enumerate().map(|(i, a)| a * x[t - i]).sum()
    }

    /// Returns eps for all samples of the channel, with zeros for t less than the order.
    pub fn residuals(&self, x: &[f64]) -> Vec<f64> {
        (0..x.len())
            .map(|t| if t < self.order() { 0.0 } else { self.residual(x, t) })
            .collect()
    }
}

fn least_squares(x: &[f64], rows: &[usize], p: usize, floor: f64) -> Option<Vec<f64>> {
    let mut products = Gram::new(p + 1);
    for &t in rows {
        let row = &x[t - p..=t];
        products.add(|i| row[p - i]);
    }
    let (mut gram, mut past) = products.system(1..p + 1, 0);
    let white = floor * floor * rows.len() as f64;
    gram.iter_mut().step_by(p + 1).for_each(|diagonal| *diagonal += white);
    past.iter_mut().for_each(|past| *past = -*past);
    let mut a = vec![1.0];
    a.extend(solve_symmetric(&gram, &past)?);
    a.iter().all(|v| v.is_finite()).then_some(a)
}

#[cfg(test)]
mod tests {
    use super::{super::test_signals::autoregressive_signal, *};

    #[test]
    fn outliers_do_not_affect_the_fit() {
        let clean = autoregressive_signal(4000, 3);
        let fit = |x: &[f64]| Autoregression::of(x, 3.0).unwrap().a;
        let good = fit(&clean);
        assert!((good[1] + 1.6).abs() < 0.05 && (good[2] - 0.8).abs() < 0.08, "{good:?}");
        let mut bad = clean;
        for t in [100, 700, 1500, 3100] {
            bad[t] += 500.0;
        }
        let found = fit(&bad);
        for (g, f) in good.iter().zip(&found) {
            assert!((g - f).abs() < 0.03, "{good:?} {found:?}");
        }
    }

    #[test]
    fn short_and_constant_channels_give_no_autoregression() {
        assert!(Autoregression::of(&[1.0; 10], 1.0).is_none());
        assert!(Autoregression::of(&[0.0; 400], 0.0).is_none());
    }
}
