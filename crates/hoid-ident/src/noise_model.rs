//! A noise model estimated from the disturbance v alone.

use hoid_model::polynomial::reflect_roots_inside;

use crate::linalg::{least_squares::solve_symmetric, vectors::dot};

/// Returns C and D of `v = (C/D) eps` by the method of Hannan and Rissanen (*Biometrika* 69 (1982) 81-94). For nc = 0
/// this is one autoregression; otherwise a long autoregression estimates eps, and v is then regressed on past v and
/// past eps. All coefficients are zero if a regression is singular.
pub(crate) fn noise_model(v: &[Vec<f64>], nc: usize, nd: usize) -> (Vec<f64>, Vec<f64>) {
    let nothing = (vec![0.0; nc], vec![0.0; nd]);
    if nc == 0 {
        let lags: Vec<(usize, usize)> = (1..=nd).map(|i| (0, i)).collect();
        let signals: Vec<[&[f64]; 1]> = v.iter().map(|v| [v.as_slice()]).collect();
        return match lagged_regression(&signals, &lags, nd) {
            Some(theta) => (Vec::new(), theta.iter().map(|t| -t).collect()),
            None => nothing,
        };
    }
    let long = 10 + 2 * (nc + nd);
    let (_, whitening) = noise_model(v, 0, long);
    let eps: Vec<Vec<f64>> = v
        .iter()
        .map(|v| {
            let mut eps = vec![0.0; v.len()];
            hoid_core::filter::multiply(&whitening, v, &mut eps);
            eps
        })
        .collect();
    let signals: Vec<[&[f64]; 2]> = v.iter().zip(&eps).map(|(v, e)| [v.as_slice(), e.as_slice()]).collect();
    let lags: Vec<(usize, usize)> = (1..=nc).map(|j| (1, j)).chain((1..=nd).map(|i| (0, i))).collect();
    let Some(theta) = lagged_regression(&signals, &lags, long + nc.max(nd)) else {
        return nothing;
    };
    match reflect_roots_inside(&theta[..nc]) {
        Some(c) => (c, theta[nc..].iter().map(|t| -t).collect()),
        None => nothing,
    }
}

/// Returns the coefficients of the regression of the first signal on lagged signals, given as (index of the signal,
/// lag), over the samples from `first` on of all records; `None` if the regression is singular.
fn lagged_regression<const K: usize>(
    records: &[[&[f64]; K]],
    lags: &[(usize, usize)],
    first: usize,
) -> Option<Vec<f64>> {
    let p = lags.len();
    let mut gram = vec![0.0; p * p];
    let mut rhs = vec![0.0; p];
    for signals in records {
        let n = signals[0].len();
        if n <= first {
            continue;
        }
        let column = |&(signal, lag): &(usize, usize)| &signals[signal][first - lag..n - lag];
        for (i, lag) in lags.iter().enumerate() {
            rhs[i] += dot(column(lag), &signals[0][first..]);
            for (j, other) in lags.iter().enumerate() {
                gram[i * p + j] += dot(column(lag), column(other));
            }
        }
    }
    solve_symmetric(&gram, &rhs)
}
