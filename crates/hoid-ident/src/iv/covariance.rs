//! Covariance of an instrumental variable estimate, for a residual with any spectrum.
//!
//! For a residual with the covariance matrix R, independent of Z, the covariance is `(Z' Phi)^-1 Z' R Z (Phi' Z)^-1`
//! (T. Söderström and P. Stoica, *Instrumental Variable Methods for System Identification*, 1983, ch. 5). R is computed
//! from a long autoregression `D r = eps` of the residual: `Z' R Z = lambda (H'Z)' (H'Z)`, where H' is the filter 1/D
//! run backwards in time. If the prefilter of the equation has whitened the residual, this covariance reduces to
//! Ljung's eq. 15.29, `lambda (Z'Z)^-1`, for Z = Phi.

use hoid_core::filter::{divide_in_place, multiply};
use hoid_model::polynomial::reflect_roots_inside;
use nalgebra::DMatrix;

use super::columns::{Columns, split_by_record};
use crate::{linalg::vectors::dot, noise_model::noise_model};

/// Largest order of the autoregression that describes the spectrum of a residual.
const MAX_ORDER: usize = 30;

/// Fits a long autoregression `D r = eps` to a residual and returns D and the variance of eps.
fn fit_autoregression(residual: &[Vec<f64>], parameters: usize) -> (Vec<f64>, f64) {
    let n: usize = residual.iter().map(Vec::len).sum();
    let shortest = residual.iter().map(Vec::len).min().unwrap_or(0);
    let order = MAX_ORDER.min(shortest / 10);
    let (_, d) = noise_model(residual, 0, order);
    let d = reflect_roots_inside(&d).unwrap_or_default();
    let mut total = 0.0;
    let mut rows = 0;
    for r in residual {
        let mut eps = vec![0.0; r.len()];
        multiply(&d, r, &mut eps);
        let whole = &eps[order.min(eps.len())..];
        total += dot(whole, whole);
        rows += whole.len();
    }
    // Correction for the degrees of freedom used by the parameters, as in the innovation variance.
    let freedom = n as f64 / n.saturating_sub(parameters).max(1) as f64;
    (d, total / rows.max(1) as f64 * freedom)
}

/// Returns `(Z' Phi)^-1 lambda K' K (Phi' Z)^-1` by rows. K is Z, with the filter for the spectrum of the residual
/// applied to the columns that are `independent` of the residual. `None` if `Z' Phi` is singular.
pub(super) fn covariance(
    z: &[Vec<f64>],
    phi: &[Vec<f64>],
    independent: impl Fn(usize) -> bool,
    residual: &[Vec<f64>],
) -> Option<Vec<f64>> {
    let p = z.len();
    let (d, lambda) = fit_autoregression(residual, p);
    // The columns are scaled to unit length, so the units of the parameters have no effect on the inverse.
    let length = |column: &Vec<f64>| dot(column, column).sqrt();
    let (of_z, of_phi): (Vec<f64>, Vec<f64>) = (z.iter().map(length).collect(), phi.iter().map(length).collect());
    let k: Columns = z
        .iter()
        .enumerate()
        .map(|(i, column)| {
            if !independent(i) {
                return column.clone();
            }
            let rows: Vec<usize> = residual.iter().map(Vec::len).collect();
            let mut backwards = split_by_record(column, &rows);
            for part in &mut backwards {
                part.reverse();
                divide_in_place(&d, part);
                part.reverse();
            }
            backwards.concat()
        })
        .collect();
    let inverse = DMatrix::from_fn(p, p, |i, j| dot(&z[i], &phi[j]) / (of_z[i] * of_phi[j])).try_inverse()?;
    let middle = DMatrix::from_fn(p, p, |i, j| lambda * dot(&k[i], &k[j]) / (of_z[i] * of_z[j]));
    let scaled = &inverse * middle * inverse.transpose();
    let result: Vec<f64> = (0..p * p)
        .map(|at| {
            let (i, j) = (at / p, at % p);
            scaled[(i, j)] / (of_phi[i] * of_phi[j])
        })
        .collect();
    result.iter().all(|v| v.is_finite()).then_some(result)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: u32, w: f64) -> Vec<f64> {
        (0..n)
            .map(|t| (w * f64::from(t)).sin() + 0.3 * (2.3 * w * f64::from(t)).cos())
            .collect()
    }

    fn white_noise(n: usize) -> Vec<f64> {
        // A linear congruential generator (D. E. Knuth, MMIX), shifted to zero mean.
        let mut state = 7_u64;
        (0..n)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            })
            .collect()
    }

    #[test]
    fn white_residuals_give_the_least_squares_covariance() {
        let residual = white_noise(5000);
        let z = vec![wave(5000, 0.1), wave(5000, 0.7)];
        let found = covariance(&z, &z, |_| true, &[residual]).unwrap();
        let gram = DMatrix::from_fn(2, 2, |i, j| dot(&z[i], &z[j]));
        let expected = gram.try_inverse().unwrap() / 12.0;
        for i in 0..2 {
            // The spectrum of 5000 samples at one frequency, from an autoregression of order 30, has a standard error
            // of 11 %.
            let ratio = found[3 * i] / expected[(i, i)];
            assert!((0.6..1.6).contains(&ratio), "{ratio}");
        }
    }

    #[test]
    fn covariance_uses_the_spectrum_at_the_instrument_frequency() {
        let mut residual = white_noise(20_000);
        divide_in_place(&[-0.9], &mut residual);
        for w in [0.05_f64, 0.5, 2.5] {
            let z = vec![(0..20_000).map(|t| (w * f64::from(t)).sin()).collect::<Vec<f64>>()];
            let found = covariance(&z, &z, |_| true, std::slice::from_ref(&residual)).unwrap()[0];
            let response = 1.0 / (1.0 - 2.0 * 0.9 * w.cos() + 0.81);
            let expected = response / 12.0 / dot(&z[0], &z[0]);
            // Here the standard error is 6 %.
            assert!((0.75..1.3).contains(&(found / expected)), "{w}: {}", found / expected);
        }
    }
}
