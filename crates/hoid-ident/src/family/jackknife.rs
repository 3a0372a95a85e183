//! Covariances from estimates that each omit one part of the data, and from a prior.
//!
//! **The jackknife** over n estimates `x_(i)`, each without one part of the data, is
//! `(n-1)/n sum (x_(i) - mean)(x_(i) - mean)'` (B. Efron and C. Stein, *Annals of Statistics* 9 (1981) 586-596). It
//! does not change if the same fixed point is subtracted from all estimates.
//!
//! **A prior** is a measurement that no part of the data contains. If P is the curvature of the prior and H the
//! curvature of the whole criterion, its contribution is `H^-1 P H^-1`, in units of the variance of the residuals.

use crate::grey_box::objective::Penalty;

/// Returns the jackknife covariance by rows, given estimates that each omit one part of the data; `None` for fewer than
/// two estimates.
pub(super) fn jackknife(others: &[Vec<f64>]) -> Option<Vec<f64>> {
    if others.len() < 2 {
        return None;
    }
    let (n, p) = (others.len() as f64, others[0].len());
    let mean: Vec<f64> = (0..p).map(|i| others.iter().map(|x| x[i]).sum::<f64>() / n).collect();
    let mut covariance = vec![0.0; p * p];
    for x in others {
        for i in 0..p {
            for j in 0..p {
                covariance[i * p + j] += (x[i] - mean[i]) * (x[j] - mean[j]) * (n - 1.0) / n;
            }
        }
    }
    Some(covariance)
}

/// Adds the contribution `factor H^-1 P H^-1` of the prior to the covariance, with P evaluated at x; `inverse` is
/// `H^-1` by rows.
pub(super) fn add_prior_contribution(
    covariance: &mut [f64],
    factor: f64,
    prior: &[Penalty],
    x: &[f64],
    inverse: &[f64],
) {
    let p = x.len();
    for penalty in prior {
        let (place, weight) = (penalty.index, factor * penalty.curvature(x));
        for i in 0..p {
            for j in 0..p {
                covariance[i * p + j] += weight * inverse[i * p + place] * inverse[j * p + place];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jackknife_of_a_mean_is_the_variance_over_n() {
        let x = [3.0, -1.0, 4.0, 1.5, 9.0];
        let (n, sum) = (x.len() as f64, x.iter().sum::<f64>());
        let others: Vec<Vec<f64>> = x.iter().map(|one| vec![(sum - one) / (n - 1.0), -2.0]).collect();
        let variance = x.iter().map(|one| (one - sum / n).powi(2)).sum::<f64>() / (n - 1.0);
        let found = jackknife(&others).unwrap();
        assert!((found[0] - variance / n).abs() < 1e-14 * variance, "{found:?}");
        assert_eq!(found[1..], [0.0; 3]);
        assert_eq!(jackknife(&others[..1]), None);
        assert_eq!(jackknife(&[]), None);
    }

    #[test]
    fn data_and_prior_parts_add_up_to_the_inverse() {
        // H = G + P: H^-1 G H^-1 + H^-1 P H^-1 = H^-1.
        let penalty = |place, logarithmic, precision| Penalty {
            index: place,
            logarithmic,
            mean: 0.3,
            precision,
            variance: 1.0,
        };
        let (x, prior) = ([0.5, -2.0], [penalty(0, true, 0.75), penalty(1, false, 2.0)]);
        // The logarithm has the slope 2 at 0.5: P = diag(3, 2).
        let (g, h) = ([4.0, 1.0, 1.0, 5.0], [7.0, 1.0, 1.0, 7.0]);
        let inverse: Vec<f64> = [h[3], -h[1], -h[2], h[0]].iter().map(|v| v / 48.0).collect();
        let product = |a: &[f64], b: &[f64]| -> Vec<f64> {
            let of = |i: usize, j: usize| a[2 * i] * b[j] + a[2 * i + 1] * b[2 + j];
            vec![of(0, 0), of(0, 1), of(1, 0), of(1, 1)]
        };
        let mut total = product(&product(&inverse, &g), &inverse);
        let of_data = total.clone();
        add_prior_contribution(&mut total, 1.0, &prior, &x, &inverse);
        for (a, b) in total.iter().zip(&inverse) {
            assert!((a - b).abs() < 1e-15, "{total:?}");
        }
        add_prior_contribution(&mut total, -1.0, &prior, &x, &inverse);
        for (a, b) in total.iter().zip(&of_data) {
            assert!((a - b).abs() < 1e-15, "{total:?}");
        }
    }
}
