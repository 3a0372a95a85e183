//! Least squares with autoregressive noise: the white part of u that the given columns do not explain.
//!
//! In `u = X b + level + v`, `D v = eps`, the noise model D of order [`NOISE_ORDER`] and b are estimated alternately.
//! Residuals are limited to a given number of standard deviations, which may be infinite.

use nalgebra::{DMatrix, DVector};

/// Order of the noise model.
pub(super) const NOISE_ORDER: usize = 16;
/// Lowest rate after decimation, Hz.
const MIN_RATE_HZ: f64 = 50.0;
/// Number of standard deviations above which a residual is an outlier.
pub(super) const OUTLIER_LIMIT: f64 = 3.5;
/// The unexplained part v is only rounding errors if its power is below this share of the power of u.
const ROUNDING_SHARE: f64 = 1e-18;
/// Number of alternations between the estimates of the coefficients and of the noise model.
const ROUND_COUNT: usize = 3;

/// Returns the decimation factor for this sample time.
pub(super) fn decimation_factor(sample_time_s: f64) -> usize {
    (1.0 / (sample_time_s * MIN_RATE_HZ) + 1e-6).floor().max(1.0) as usize
}

/// A least-squares fit of u by columns and a level.
pub(super) struct WhitenedFit {
    /// Coefficients of the columns, the level last.
    pub b: DVector<f64>,
    /// The part of u that the columns leave unexplained.
    pub v: DVector<f64>,
    /// Coefficients `d_1 ..` of the noise model of v.
    pub d: Vec<f64>,
    /// Columns filtered by the noise model, the level last; the first [`NOISE_ORDER`] rows are lost.
    pub x: DMatrix<f64>,
    /// Whitened residuals `D v`, limited to the given number of standard deviations.
    pub eps: DVector<f64>,
}

impl WhitenedFit {
    /// Fits columns and a level to u at these samples. `None` if there are too few samples, a value is not a number,
    /// columns are linearly dependent, or only rounding errors are left. Residuals are limited to `limit` standard
    /// deviations.
    pub fn of(columns: &[Vec<f64>], u: &[f64], samples: &[usize], limit: f64) -> Option<Self> {
        let (n, p) = (samples.len(), columns.len() + 1);
        let x = DMatrix::from_fn(n, p, |i, j| columns.get(j).map_or(1.0, |c| c[samples[i]]));
        let y = DVector::from_fn(n, |i, _| u[samples[i]]);
        if n <= 2 * (NOISE_ORDER + p) || !x.iter().chain(&y).all(|v| v.is_finite()) {
            return None;
        }
        let mut d = vec![0.0; NOISE_ORDER];
        let mut v = y.clone();
        let mut b = DVector::zeros(p);
        for _ in 0..ROUND_COUNT {
            let (xd, yd) = (whiten(&x, &d), whiten_vector(&y, &d));
            b = solution(&xd, &limit_outliers(&xd, &yd, limit)?)?;
            v = &y - &x * &b;
            let lags = lag_matrix(&v);
            d = solution(&lags, &limit_outliers(&lags, &tail(&v), limit)?)?
                .iter()
                .map(|d| -d)
                .collect();
        }
        if v.norm_squared() <= ROUNDING_SHARE * y.norm_squared() {
            return None;
        }
        let eps = clip(&whiten_vector(&v, &d), limit);
        let x = whiten(&x, &d);
        Some(Self { b, v, d, x, eps })
    }
}

/// Filters the columns with `1 + d_1 q^-1 + ..`, starting at the first sample for which all lags exist.
pub(super) fn whiten(m: &DMatrix<f64>, d: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(m.nrows() - NOISE_ORDER, m.ncols(), |i, j| {
        let own = m[(i + NOISE_ORDER, j)];
        d.iter()
            .enumerate()
            .fold(own, |sum, (k, d)| sum + d * m[(i + NOISE_ORDER - 1 - k, j)])
    })
}

fn whiten_vector(v: &DVector<f64>, d: &[f64]) -> DVector<f64> {
    let m = DMatrix::from_column_slice(v.len(), 1, v.as_slice());
    whiten(&m, d).column(0).into_owned()
}

fn tail(v: &DVector<f64>) -> DVector<f64> {
    v.rows(NOISE_ORDER, v.len() - NOISE_ORDER).into_owned()
}

/// Returns the rows `v(t-1) .. v(t-p)`, where p is [`NOISE_ORDER`].
pub(super) fn lag_matrix(v: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(v.len() - NOISE_ORDER, NOISE_ORDER, |i, j| v[i + NOISE_ORDER - 1 - j])
}

/// Returns y after its residuals from the least-squares solution have been limited to `limit` standard deviations.
fn limit_outliers(x: &DMatrix<f64>, y: &DVector<f64>, limit: f64) -> Option<DVector<f64>> {
    let fit = x * solution(x, y)?;
    Some(&fit + clip(&(y - &fit), limit))
}

fn clip(eps: &DVector<f64>, limit: f64) -> DVector<f64> {
    let most = limit * (eps.norm_squared() / eps.len() as f64).sqrt();
    // If all residuals are zero, the limit could be `NaN`, which `min` and `max` ignore.
    eps.map(|v| v.max(-most).min(most))
}

/// Returns the least-squares solution, computed with columns scaled to unit length; `None` if the columns are linearly
/// dependent.
pub(super) fn solution(x: &DMatrix<f64>, y: &DVector<f64>) -> Option<DVector<f64>> {
    let (q, r, scales) = scaled_qr(x)?;
    let mut b = r.solve_upper_triangular(&(q.transpose() * y))?;
    b.iter_mut().zip(&scales).for_each(|(b, s)| *b /= s);
    Some(b)
}

pub(super) fn orthonormal_basis(x: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    scaled_qr(x).map(|(q, ..)| q)
}

fn scaled_qr(x: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>, Vec<f64>)> {
    let scales: Vec<f64> = x.column_iter().map(|c| c.norm()).collect();
    if scales.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return None;
    }
    let scaled = DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] / scales[j]);
    let (q, r) = scaled.qr().unpack();
    let least = r.diagonal().iter().fold(f64::MAX, |least, d| least.min(d.abs()));
    (least > MIN_DIAGONAL).then_some((q, r, scales))
}

/// Diagonal element of the triangular factor R below which columns are linearly dependent.
const MIN_DIAGONAL: f64 = 1e-10;

/// Pseudorandom numbers of a fixed stream, uniform with variance 1/12.
#[cfg(test)]
pub(super) fn random_number(seed: &mut u64) -> f64 {
    *seed = seed
        .wrapping_mul(6_364_136_223_846_793_005)
        .wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
}
