//! Whether a response to the error is left that a model does not have.
//!
//! Of a model that is linear in what it has to estimate, `u = X b + v`, the columns X are known: responses
//! of a basis, their derivatives by what is held, a level. With an autoregression `D v = eps` of order
//! [`NOISE`] the question is whether further taps on e say anything about eps, Z in place of the
//! impulse response that X cannot have: means of e over [`TAPS`] spans of [`TAP_S`] one after another. By the
//! statistic of the Lagrange multiplier (T. S. Breusch and A. R. Pagan, *Review of Economic Studies* 47 (1980)
//! 239-253; L. Ljung, *System Identification*, 1999, section 16.6, for the residuals of a model)
//!
//! `s(t) = z(t) eps(t)`, z what is left of D Z when D X and the lags of v are taken out,
//!
//! so that what the estimate of b and of D takes away is taken away here too: in a closed loop past e and
//! past v are correlated. Two variances: that of the model, with
//! `T = (sum s)' (sigma^2 sum z z')^-1 (sum s)`, chi-square with [`TAPS`] degrees of freedom, and the scatter of the
//! sums over blocks of 2 s, with Hotelling's `T^2`, which holds whatever the size of the remnant does (H.
//! Hotelling, *Annals of Mathematical Statistics* 2 (1931) 360-378). The larger p-value counts.
//!
//! Signals are thinned to [`RATE_HZ`] at most; residuals beyond 3.5 standard deviations count as such.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Order of the noise model.
const NOISE: usize = 16;
/// Taps, and their length in s.
pub(crate) const TAPS: usize = 6;
pub(crate) const TAP_S: f64 = 0.15;
/// Rate to which signals are thinned, Hz.
const RATE_HZ: f64 = 50.0;
/// Length of a block, s, and fewest of them.
const BLOCK_S: f64 = 2.0;
const FEWEST: usize = 10;
/// Standard deviations beyond which a residual is limited.
const LIMIT: f64 = 3.5;
/// Share of the power of u below which v is rounding.
const EXACT: f64 = 1e-18;
/// Rounds of noise model and least squares.
const ROUNDS: usize = 3;

/// What a test of a model has found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeftResponse {
    /// Probability of so much where nothing is left.
    pub p_value: f64,
    /// The two that it is the larger of: by the model, by the scatter of blocks.
    pub each: [f64; 2],
    /// Share of the variance of eps that the taps explain.
    pub share: f64,
}

/// Tests whether columns, all as long as e and u, are all that there is of a response of u to e in samples
/// `from..`. The level need not be among them. `None` where there is too little, or something is no number.
pub fn left_response(
    columns: &[Vec<f64>],
    e: &[f64],
    u: &[f64],
    from: usize,
    sample_time_s: f64,
) -> Option<LeftResponse> {
    let thin = (1.0 / (sample_time_s * RATE_HZ) + 1e-6).floor().max(1.0) as usize;
    let every_s = thin as f64 * sample_time_s;
    let tap = (TAP_S / sample_time_s).round().max(1.0) as usize;
    let first = from.max(TAPS * tap);
    let rows: Vec<usize> = (first..u.len()).step_by(thin).collect();
    let block = (BLOCK_S / every_s).round() as usize;
    let blocks = rows.len().saturating_sub(NOISE) / block.max(1);
    if blocks < FEWEST || columns.iter().any(|c| c.len() != u.len()) || e.len() != u.len() {
        return None;
    }
    let n = rows.len();
    let p = columns.len() + 1;
    let x = DMatrix::from_fn(n, p, |i, j| columns.get(j).map_or(1.0, |c| c[rows[i]]));
    let z = DMatrix::from_fn(n, TAPS, |i, j| {
        let newest = rows[i] + 1 - j * tap;
        e[newest - tap..newest].iter().sum::<f64>() / tap as f64
    });
    let y = DVector::from_fn(n, |i, _| u[rows[i]]);
    if !(x.iter().chain(&z).chain(&y).all(|v| v.is_finite())) {
        return None;
    }
    let mut d = vec![0.0; NOISE];
    let mut v = y.clone();
    for _ in 0..ROUNDS {
        let (xd, yd) = (whitened(&x, &d), whitened_vector(&y, &d));
        let b = solution(&xd, &limited(&xd, &yd)?)?;
        v = &y - &x * b;
        let lags = lags(&v);
        d = solution(&lags, &limited(&lags, &tail(&v))?)?
            .iter()
            .map(|d| -d)
            .collect();
    }
    if v.norm_squared() <= EXACT * y.norm_squared() {
        return None;
    }
    let eps = clipped(&whitened_vector(&v, &d));
    let (xd, lagged) = (whitened(&x, &d), lags(&v));
    let known = DMatrix::from_fn(n - NOISE, p + NOISE, |i, j| match j {
        j if j < p => xd[(i, j)],
        j => lagged[(i, j - p)],
    });
    let q = orthogonal(&known)?;
    let left = |m: DMatrix<f64>| -> DMatrix<f64> { &m - &q * (q.transpose() * &m) };
    let z = left(whitened(&z, &d));
    let eps = left(DMatrix::from_column_slice(eps.len(), 1, eps.as_slice()))
        .column(0)
        .into_owned();
    of_scores(&z, &eps, block, p + NOISE)
}

fn of_scores(z: &DMatrix<f64>, eps: &DVector<f64>, block: usize, known: usize) -> Option<LeftResponse> {
    let gram = z.transpose() * z;
    let sums = z.transpose() * eps;
    let freedom = (eps.len() - known) as f64;
    let variance = eps.norm_squared() / freedom;
    // Units are those of u and e alone: taps are alike.
    let inverse = gram.cholesky()?.inverse();
    let explained = (sums.transpose() * &inverse * &sums)[(0, 0)];
    let of_model = ChiSquared::new(TAPS as f64).ok()?.sf(explained / variance);
    let count = eps.len() / block;
    let scores = DMatrix::from_fn(count, TAPS, |c, j| {
        (c * block..(c + 1) * block).map(|t| z[(t, j)] * eps[t]).sum::<f64>()
    });
    let mean = scores.row_mean();
    let about = DMatrix::from_fn(count, TAPS, |c, j| scores[(c, j)] - mean[j]);
    let (m, k) = (count as f64, TAPS as f64);
    let scatter = (about.transpose() * &about) / (m - 1.0);
    let t2 = m * (&mean * scatter.cholesky()?.inverse() * mean.transpose())[(0, 0)];
    let of_blocks = FisherSnedecor::new(k, m - k).ok()?.sf(t2 * (m - k) / (k * (m - 1.0)));
    let p_value = of_model.max(of_blocks);
    p_value.is_finite().then_some(LeftResponse {
        p_value,
        each: [of_model, of_blocks],
        share: explained / eps.norm_squared(),
    })
}

/// Behind `1 + d_1 q^-1 + ..`, from the first sample on that has all lags.
fn whitened(m: &DMatrix<f64>, d: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(m.nrows() - NOISE, m.ncols(), |i, j| {
        let own = m[(i + NOISE, j)];
        d.iter()
            .enumerate()
            .fold(own, |sum, (k, d)| sum + d * m[(i + NOISE - 1 - k, j)])
    })
}

fn whitened_vector(v: &DVector<f64>, d: &[f64]) -> DVector<f64> {
    let m = DMatrix::from_column_slice(v.len(), 1, v.as_slice());
    whitened(&m, d).column(0).into_owned()
}

fn tail(v: &DVector<f64>) -> DVector<f64> {
    v.rows(NOISE, v.len() - NOISE).into_owned()
}

/// `v(t-1) .. v(t-p)` by rows.
fn lags(v: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(v.len() - NOISE, NOISE, |i, j| v[i + NOISE - 1 - j])
}

/// y with what is far from its fit nearer to it.
fn limited(x: &DMatrix<f64>, y: &DVector<f64>) -> Option<DVector<f64>> {
    let fit = x * solution(x, y)?;
    Some(&fit + clipped(&(y - &fit)))
}

fn clipped(eps: &DVector<f64>) -> DVector<f64> {
    let most = LIMIT * (eps.norm_squared() / eps.len() as f64).sqrt();
    eps.map(|v| v.clamp(-most, most))
}

/// Least squares by columns of unit length; `None` where they are not independent.
fn solution(x: &DMatrix<f64>, y: &DVector<f64>) -> Option<DVector<f64>> {
    let (q, r, scales) = factored(x)?;
    let mut b = r.solve_upper_triangular(&(q.transpose() * y))?;
    b.iter_mut().zip(&scales).for_each(|(b, s)| *b /= s);
    Some(b)
}

fn orthogonal(x: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    factored(x).map(|(q, ..)| q)
}

fn factored(x: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>, Vec<f64>)> {
    let scales: Vec<f64> = x.column_iter().map(|c| c.norm()).collect();
    if scales.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let scaled = DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] / scales[j]);
    let (q, r) = scaled.qr().unpack();
    let least = r.diagonal().iter().fold(f64::MAX, |least, d| least.min(d.abs()));
    (least > DEPENDENT).then_some((q, r, scales))
}

/// Diagonal of R below which columns are not independent.
const DEPENDENT: f64 = 1e-10;

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const TS: f64 = 0.02;

    /// Numbers of a fixed stream, uniform with variance 1/12.
    fn stream(seed: &mut u64) -> f64 {
        *seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    /// e, the column that is known and u: `e(t) = .98 e(t-1) + w - .3 v(t-1)`, `u = e(t-2) + echo e(t-20) + v`,
    /// v autoregressive, louder where `loud` says so.
    fn loop_of(seed: u64, echo: f64, loud: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut seed = seed;
        let n = 3000;
        let (mut e, mut u, mut v) = (vec![0.0_f64; n], vec![0.0; n], 0.0);
        for t in 1..n {
            e[t] = 0.98 * e[t - 1] + stream(&mut seed) - 0.3 * v;
            v = 0.9 * v + loud(t) * stream(&mut seed);
            let past = |lag: usize| if t >= lag { e[t - lag] } else { 0.0 };
            u[t] = past(2) + echo * past(20) + v;
        }
        let known = (0..n).map(|t| if t >= 2 { e[t - 2] } else { 0.0 }).collect();
        (e, known, u)
    }

    fn found(seed: u64, echo: f64, loud: impl Fn(usize) -> f64) -> LeftResponse {
        let (e, known, u) = loop_of(seed, echo, loud);
        left_response(&[known], &e, &u, 100, TS).unwrap()
    }

    #[test]
    fn the_level_holds_also_where_the_remnant_is_not_steady() {
        // Shares of p below .1 in 100 loops: .1 with a standard error of .03; the larger of two is less often there.
        for loud in [
            |_: usize| 1.0,
            |t: usize| if (t / 250).is_multiple_of(2) { 0.2 } else { 2.0 },
        ] {
            let below = (0..100)
                .filter(|seed| found(1000 + seed, 0.0, loud).p_value < 0.1)
                .count();
            assert!((1..=20).contains(&below), "{below} of 100");
        }
    }

    #[test]
    fn what_is_left_is_found() {
        let missed = (0..20).filter(|seed| found(*seed, 0.2, |_| 1.0).p_value > 1e-3).count();
        assert!(missed <= 1, "{missed} of 20");
    }

    #[test]
    fn too_little_or_no_number_says_nothing() {
        let (e, known, mut u) = loop_of(3, 0.0, |_| 1.0);
        let short = |n: usize| left_response(&[known[..n].to_vec()], &e[..n], &u[..n], 100, TS);
        assert!(short(900).is_none() && short(1400).is_some());
        // A column twice, and one of nothing.
        for columns in [vec![known.clone(), known.clone()], vec![vec![0.0; e.len()]]] {
            assert!(left_response(&columns, &e, &u, 100, TS).is_none());
        }
        // An exact fit has nothing to test.
        assert!(left_response(std::slice::from_ref(&known), &e, &known, 100, TS).is_none());
        u[2000] = f64::NAN;
        assert!(left_response(&[known], &e, &u, 100, TS).is_none());
    }
}
