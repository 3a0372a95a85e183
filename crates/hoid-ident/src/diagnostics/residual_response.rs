//! Test for a response to the error that the model does not contain.
//!
//! For a model that is linear in its unknowns, `u = X b + v`, the columns X are known: responses of a basis, their
//! derivatives with respect to the fixed dynamics, and a level. With an autoregression `D v = eps` of order
//! [`NOISE_ORDER`] the test asks whether further taps Z on e explain part of eps. The taps are means of e over
//! [`TAP_COUNT`] consecutive spans of [`TAP_S`]; they approximate an impulse response that X cannot represent. The test
//! uses the Lagrange multiplier statistic (T. S. Breusch and A. R. Pagan, *Review of Economic Studies* 47 (1980)
//! 239-253; L. Ljung, *System Identification*, 1999, section 16.6, for the residuals of a model)
//!
//! `s(t) = z(t) eps(t)`, where z is the remainder of D Z after projection onto D X and the lags of v,
//!
//! so that the effect of estimating b and D is removed: in a closed loop past e and past v are correlated. Two
//! variances are used. The variance of the model gives `T = (sum s)' (sigma^2 sum z z')^-1 (sum s)`, chi-square with
//! [`TAP_COUNT`] degrees of freedom. The scatter of the sums over blocks of 2 s gives Hotelling's `T^2`, which is valid
//! even if the size of the remnant changes (H. Hotelling, *Annals of Mathematical Statistics* 2 (1931) 360-378). The
//! larger p-value is used.
//!
//! Signals are decimated to the lowest possible rate that is not below [`MIN_RATE_HZ`]. Residuals are not limited: if a
//! person moves the stick in pulses, these pulses are the response to e, and the part removed by a limit would look
//! like a missing response.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::whitened::{NOISE_ORDER, WhitenedFit, decimation_factor, lag_matrix, orthonormal_basis, whiten};

/// Number of taps, and the length of a tap in s.
pub(crate) const TAP_COUNT: usize = 6;
pub(crate) const TAP_S: f64 = 0.15;
/// Length of a block in s, and minimum number of blocks for the test.
const BLOCK_S: f64 = 2.0;
const MIN_BLOCKS: usize = 10;

/// Result of the test for a missing response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResidualResponse {
    /// Larger of the two p-values: probability of a statistic at least this large if no response is missing.
    pub p_value: f64,
    /// The two p-values: from the variance of the model and from the scatter of blocks.
    pub p_values: [f64; 2],
    /// Share of the variance of eps that the taps explain.
    pub share: f64,
}

/// Tests whether columns of the same length as e and u explain the whole response of u to e, in the samples from `from`
/// on. The columns need not contain the level. `None` if there are too few data or a value is not a number.
pub fn residual_response(
    columns: &[Vec<f64>],
    e: &[f64],
    u: &[f64],
    from: usize,
    sample_time_s: f64,
) -> Option<ResidualResponse> {
    let thin = decimation_factor(sample_time_s);
    let every_s = thin as f64 * sample_time_s;
    let tap = (TAP_S / sample_time_s).round().max(1.0) as usize;
    let first = from.max(TAP_COUNT * tap);
    let rows: Vec<usize> = (first..u.len()).step_by(thin).collect();
    let block = (BLOCK_S / every_s).round() as usize;
    let blocks = rows.len().saturating_sub(NOISE_ORDER) / block.max(1);
    if blocks < MIN_BLOCKS || columns.iter().any(|c| c.len() != u.len()) || e.len() != u.len() {
        return None;
    }
    let n = rows.len();
    let p = columns.len() + 1;
    let z = DMatrix::from_fn(n, TAP_COUNT, |i, j| {
        // The newest errors are excluded: they already contain the new part of u if the controlled element responds
        // immediately.
        let (next, newest) = (rows[i] + 1, if j == 0 { thin } else { j * tap });
        e[next - (j + 1) * tap..next - newest.min((j + 1) * tap - 1)]
            .iter()
            .sum::<f64>()
            / tap as f64
    });
    if !z.iter().all(|v| v.is_finite()) {
        return None;
    }
    let WhitenedFit { v, d, x: xd, eps, .. } = WhitenedFit::of(columns, u, &rows, f64::INFINITY)?;
    let lagged = lag_matrix(&v);
    let known = DMatrix::from_fn(n - NOISE_ORDER, p + NOISE_ORDER, |i, j| match j {
        j if j < p => xd[(i, j)],
        j => lagged[(i, j - p)],
    });
    let q = orthonormal_basis(&known)?;
    let left = |m: DMatrix<f64>| -> DMatrix<f64> { &m - &q * (q.transpose() * &m) };
    let z = left(whiten(&z, &d));
    let eps = left(DMatrix::from_column_slice(eps.len(), 1, eps.as_slice()))
        .column(0)
        .into_owned();
    response_from_scores(&z, &eps, block, p + NOISE_ORDER)
}

fn response_from_scores(z: &DMatrix<f64>, eps: &DVector<f64>, block: usize, known: usize) -> Option<ResidualResponse> {
    let gram = z.transpose() * z;
    let sums = z.transpose() * eps;
    let freedom = (eps.len() - known) as f64;
    let variance = eps.norm_squared() / freedom;
    // The matrix needs no scaling, because all taps have the unit of e.
    let inverse = gram.cholesky()?.inverse();
    let explained = (sums.transpose() * &inverse * &sums)[(0, 0)];
    let of_model = ChiSquared::new(TAP_COUNT as f64).ok()?.sf(explained / variance);
    let count = eps.len() / block;
    let scores = DMatrix::from_fn(count, TAP_COUNT, |c, j| {
        (c * block..(c + 1) * block).map(|t| z[(t, j)] * eps[t]).sum::<f64>()
    });
    let mean = scores.row_mean();
    let about = DMatrix::from_fn(count, TAP_COUNT, |c, j| scores[(c, j)] - mean[j]);
    let (m, k) = (count as f64, TAP_COUNT as f64);
    let scatter = (about.transpose() * &about) / (m - 1.0);
    let t2 = m * (&mean * scatter.cholesky()?.inverse() * mean.transpose())[(0, 0)];
    let of_blocks = FisherSnedecor::new(k, m - k).ok()?.sf(t2 * (m - k) / (k * (m - 1.0)));
    let p_value = of_model.max(of_blocks);
    p_value.is_finite().then_some(ResidualResponse {
        p_value,
        p_values: [of_model, of_blocks],
        share: explained / eps.norm_squared(),
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::diagnostics::whitened::random_number;

    const TS: f64 = 0.02;

    /// Returns e, the known column and u of the loop `e(t) = .98 e(t-1) + w - .3 v(t-1)`,
    /// `u = e(t-2) + echo e(t-20) + v`, where v is autoregressive, with a larger variance where `loud` is true.
    fn simulate_loop(seed: u64, echo: f64, loud: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut seed = seed;
        let n = 3000;
        let (mut e, mut u, mut v) = (vec![0.0_f64; n], vec![0.0; n], 0.0);
        for t in 1..n {
            e[t] = 0.98 * e[t - 1] + random_number(&mut seed) - 0.3 * v;
            v = 0.9 * v + loud(t) * random_number(&mut seed);
            let past = |lag: usize| if t >= lag { e[t - lag] } else { 0.0 };
            u[t] = past(2) + echo * past(20) + v;
        }
        let known = (0..n).map(|t| if t >= 2 { e[t - 2] } else { 0.0 }).collect();
        (e, known, u)
    }

    fn loop_residual_response(seed: u64, echo: f64, loud: impl Fn(usize) -> f64) -> ResidualResponse {
        let (e, known, u) = simulate_loop(seed, echo, loud);
        residual_response(&[known], &e, &u, 100, TS).unwrap()
    }

    #[test]
    fn test_level_holds_for_unsteady_remnant() {
        // Share of 100 loops with p < 0.1: 0.1 with a standard error of 0.03; the larger of the two p-values is below
        // 0.1 less often.
        for loud in [
            |_: usize| 1.0,
            |t: usize| if (t / 250).is_multiple_of(2) { 0.2 } else { 2.0 },
        ] {
            let below = (0..100)
                .filter(|seed| loop_residual_response(1000 + seed, 0.0, loud).p_value < 0.1)
                .count();
            assert!((1..=20).contains(&below), "{below} of 100");
        }
    }

    #[test]
    fn unmodelled_response_is_found() {
        let missed = (0..20)
            .filter(|seed| loop_residual_response(*seed, 0.2, |_| 1.0).p_value > 1e-3)
            .count();
        assert!(missed <= 1, "{missed} of 20");
    }

    #[test]
    fn insufficient_and_invalid_data_give_no_result() {
        let (e, known, mut u) = simulate_loop(3, 0.0, |_| 1.0);
        let short = |n: usize| residual_response(&[known[..n].to_vec()], &e[..n], &u[..n], 100, TS);
        assert!(short(900).is_none() && short(1400).is_some());
        // Columns that are linearly dependent, or a column of zeros, give no result.
        for columns in [vec![known.clone(), known.clone()], vec![vec![0.0; e.len()]]] {
            assert!(residual_response(&columns, &e, &u, 100, TS).is_none());
        }
        // An exact fit leaves nothing to test.
        assert!(residual_response(std::slice::from_ref(&known), &e, &known, 100, TS).is_none());
        u[2000] = f64::NAN;
        assert!(residual_response(&[known], &e, &u, 100, TS).is_none());
    }
}
