//! Interpolation of samples from the neighbours on both sides.
//!
//! Let `eps = A x` be the innovations of the autoregression. The most likely values of m samples from sample s on,
//! given all other samples, minimise `sum eps(t)^2` over all rows that contain one of the m samples (A. J. E. M.
//! Janssen, R. N. J. Veldhuis and L. B. Vries, *IEEE Trans. Acoustics, Speech and Signal Processing* 34 (1986)
//! 317-330). A change delta of the samples changes eps by `A delta`, so that
//!
//! `G delta = -g`, `G_ij = sum_t a(t-s-i) a(t-s-j)`, `g_i = sum_t a(t-s-i) eps(t)`
//!
//! With the Cholesky factor L of G and `y = L^-1 g`, the sum of squares falls by `|y|^2`. L and y for fewer samples are
//! the first rows of L and y for more samples, so one pass gives the decrease for every m.

use super::autoregression::Autoregression;

/// Interpolations of the samples from `start` on, for every number of samples up to `most`.
pub(super) struct Interpolation {
    /// Cholesky factor: lower triangular matrix by rows, `most` by `most`.
    factor: Vec<f64>,
    y: Vec<f64>,
    size: usize,
}

impl Interpolation {
    /// Computes the interpolations from the innovations of a channel. At the end of the channel fewer than `most`
    /// samples are interpolated.
    pub fn new(ar: &Autoregression, eps: &[f64], start: usize, most: usize) -> Self {
        let p = ar.order();
        let n = eps.len();
        let size = most.min(n - start);
        let first = start.max(p);
        let mut factor = vec![0.0; size * size];
        let mut y = vec![0.0; size];
        let a = |t: usize, i: usize| {
            let lag = t.checked_sub(start + i);
            lag.and_then(|lag| ar.a.get(lag)).copied().unwrap_or(0.0)
        };
        let mut filled = 0;
        for i in 0..size {
            let rows = first.max(start + i)..(start + i + p + 1).min(n);
            let mut g: f64 = rows.clone().map(|t| a(t, i) * eps[t]).sum();
            for j in 0..=i {
                let mut v: f64 = rows.clone().map(|t| a(t, i) * a(t, j)).sum();
                for k in 0..j {
                    v -= factor[i * size + k] * factor[j * size + k];
                }
                factor[i * size + j] = if i == j {
                    v.max(0.0).sqrt()
                } else {
                    v / factor[j * size + j]
                };
            }
            let pivot = factor[i * size + i];
            // Samples that appear in no row of the sum cannot be determined.
            if pivot.is_nan() || pivot < 1e-9 {
                break;
            }
            for k in 0..i {
                g -= factor[i * size + k] * y[k];
            }
            y[i] = g / pivot;
            filled = i + 1;
        }
        y.truncate(filled);
        Self { factor, y, size }
    }

    /// Returns the largest number of samples from `start` on that can be determined.
    pub fn max_samples(&self) -> usize {
        self.y.len()
    }

    /// Returns the decrease in the sum of squares if the first m samples are interpolated.
    pub fn sum_decrease(&self, m: usize) -> f64 {
        self.y[..m].iter().map(|y| y * y).sum()
    }

    /// Returns delta, the change in each of the first m samples.
    pub fn change(&self, m: usize) -> Vec<f64> {
        let mut delta = vec![0.0; m];
        for i in (0..m).rev() {
            let rest: f64 = (i + 1..m).map(|k| self.factor[k * self.size + i] * delta[k]).sum();
            delta[i] = (-self.y[i] - rest) / self.factor[i * self.size + i];
        }
        delta
    }
}

/// Updates the innovations after a change in the samples from `start` on.
pub(super) fn apply_change(ar: &Autoregression, eps: &mut [f64], start: usize, delta: &[f64]) {
    let p = ar.order();
    for (i, change) in delta.iter().enumerate() {
        for (lag, a) in ar.a.iter().enumerate() {
            let t = start + i + lag;
            if t >= p && t < eps.len() {
                eps[t] += a * change;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::test_signals::autoregressive_signal, *};

    #[test]
    fn interpolated_values_minimise_the_sum_of_squares() {
        let x = autoregressive_signal(600, 5);
        let ar = Autoregression::of(&x, 3.0).unwrap();
        for (start, m) in [(300, 1), (300, 4), (3, 3), (596, 4)] {
            let eps = ar.residuals(&x);
            let squares = |eps: &[f64]| eps.iter().map(|e| e * e).sum::<f64>();
            let before = squares(&eps);
            let found = Interpolation::new(&ar, &eps, start, 8.min(600 - start));
            let delta = found.change(m);
            let at = |delta: &[f64]| {
                let mut changed = eps.clone();
                apply_change(&ar, &mut changed, start, delta);
                squares(&changed)
            };
            let least = at(&delta);
            assert!(
                (before - least - found.sum_decrease(m)).abs() < 1e-9 * before,
                "{start} {m}"
            );
            // The innovations equal the innovations of the changed channel.
            let mut changed = x.clone();
            delta.iter().enumerate().for_each(|(i, d)| changed[start + i] += d);
            assert!((squares(&ar.residuals(&changed)) - least).abs() < 1e-9 * before);
            for i in 0..m {
                for step in [-1e-3, 1e-3] {
                    let mut other = delta.clone();
                    other[i] += step;
                    assert!(at(&other) > least, "{start} {m} {i}");
                }
            }
        }
    }
}
