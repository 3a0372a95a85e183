//! Noise with a level that changes together with the operator.
//!
//! If the gain of the remnant changes, the standard deviation of the innovations changes as well:
//! `sigma(t) = sigma_1 + (sigma_2 - sigma_1) s(t)`, where s is the sigmoid of the gains without the delay. Given the
//! residuals, sigma_1 and sigma_2 minimise `sum of ln sigma(t) + eps(t)^2/(2 sigma(t)^2)` (Fisher scoring). The
//! residuals are then weighted by 1/sigma(t), and fit and levels are estimated alternately. Source: R. J. Carroll and
//! D. Ruppert, *Transformation and Weighting in Regression*, 1988, ch. 3.

use crate::linalg::vectors::dot;

/// Model of the standard deviation of the innovations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum NoiseLevel {
    /// One constant level.
    Constant,
    /// One level before and one after the change, with a transition that follows the sigmoid of the gains.
    #[default]
    Changing,
}

/// Smallest ratio of the two levels; a smaller ratio indicates a record without noise on one side of the change.
const MIN_LEVEL_RATIO: f64 = 1e-3;

/// Returns `[sigma_1, sigma_2]` from the residuals and from the share of the change at each residual; `None` if the
/// residuals on one side of the change are zero or the levels cannot be determined.
pub(crate) fn noise_levels(residuals: &[Vec<f64>], shares: &[Vec<f64>]) -> Option<[f64; 2]> {
    let pairs = || residuals.iter().flatten().zip(shares.iter().flatten());
    // The search starts from the weighted mean squares before and after the change.
    let side = |weight: &dyn Fn(f64) -> f64| {
        let (sum, total) = pairs().fold((0.0, 0.0), |(sum, total), (eps, share)| {
            (sum + weight(*share) * eps * eps, total + weight(*share))
        });
        (sum / total).sqrt()
    };
    let mut sigma = [side(&|s| 1.0 - s), side(&|s| s)];
    if !sigma.iter().all(|s| s.is_finite() && *s > 0.0) {
        return None;
    }
    for _ in 0..50 {
        let (mut slope, mut information) = ([0.0; 2], [[0.0; 2]; 2]);
        for (eps, share) in pairs() {
            let basis = [1.0 - share, *share];
            let here = dot(&sigma, &basis);
            let pull = (eps * eps / (here * here) - 1.0) / here;
            for i in 0..2 {
                slope[i] += basis[i] * pull;
                for j in 0..2 {
                    information[i][j] += 2.0 * basis[i] * basis[j] / (here * here);
                }
            }
        }
        let [[a, b], [_, c]] = information;
        let determinant = a * c - b * b;
        if determinant <= 1e-12 * a * c {
            return None;
        }
        let step = [
            (c * slope[0] - b * slope[1]) / determinant,
            (a * slope[1] - b * slope[0]) / determinant,
        ];
        let mut largest = 0.0_f64;
        for (s, d) in sigma.iter_mut().zip(step) {
            // In one step a level changes by no more than a factor of two.
            let moved = (*s + d).clamp(0.5 * *s, 2.0 * *s);
            largest = largest.max((moved - *s).abs() / *s);
            *s = moved;
        }
        if largest < 1e-10 {
            break;
        }
    }
    let ratio = sigma[0].min(sigma[1]) / sigma[0].max(sigma[1]);
    (ratio >= MIN_LEVEL_RATIO).then_some(sigma)
}

/// Returns weights `1/sigma(t)`, scaled to the geometric mean 1 over all residuals, so the weighted sum of squares can
/// replace the sum of squares in the likelihood.
pub(crate) fn weights(sigma: [f64; 2], shares: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let level = |share: f64| sigma[0] + (sigma[1] - sigma[0]) * share;
    let count: usize = shares.iter().map(Vec::len).sum();
    let mean = shares.iter().flatten().map(|s| level(*s).ln()).sum::<f64>() / count as f64;
    shares
        .iter()
        .map(|all| all.iter().map(|s| mean.exp() / level(*s)).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns residuals whose size equals the noise level at each time, with alternating signs, and the shares of the
    /// change.
    fn record(sigma: [f64; 2]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let shares: Vec<f64> = (0..400).map(|t| f64::from(t / 2) / 199.0).collect();
        let eps = shares
            .iter()
            .enumerate()
            .map(|(t, s)| (sigma[0] + (sigma[1] - sigma[0]) * s) * if t % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        (vec![eps], vec![shares])
    }

    #[test]
    fn exact_noise_levels_are_recovered() {
        for sigma in [[0.01, 0.02], [3.0, 1.0], [1.0, 1.0]] {
            let (eps, shares) = record(sigma);
            let found = noise_levels(&eps, &shares).unwrap();
            for (a, b) in found.iter().zip(sigma) {
                assert!((a - b).abs() < 1e-8 * b, "{found:?} {sigma:?}");
            }
        }
    }

    #[test]
    fn geometric_mean_of_the_weights_is_one() {
        let (eps, shares) = record([0.01, 0.02]);
        let weights = weights(noise_levels(&eps, &shares).unwrap(), &shares);
        let sum: f64 = weights[0].iter().map(|w| w.ln()).sum();
        assert!(sum.abs() < 1e-9);
        // The weighted residuals have the same size throughout.
        let sizes: Vec<f64> = eps[0].iter().zip(&weights[0]).map(|(e, w)| (e * w).abs()).collect();
        assert!(sizes.iter().all(|s| (s / sizes[0] - 1.0).abs() < 1e-8));
    }

    #[test]
    fn zero_noise_or_a_missing_side_gives_no_levels() {
        let (eps, shares) = record([0.01, 0.02]);
        assert_eq!(noise_levels(&[vec![0.0; 400]], &shares), None);
        assert_eq!(noise_levels(&eps, &[vec![0.0; 400]]), None);
        assert_eq!(noise_levels(&[vec![f64::NAN; 400]], &shares), None);
    }
}
