//! Upper bound on the available information: the likelihood ratio of the operators after and before a change, if both
//! are known.
//!
//! The gains s of each operator are estimated from all trials with that element (except the examined trial), in the
//! basis of the default operator. After the whitening filter of the first trial's remnant, whose variance is sigma^2,
//! the ratio is
//!
//! `log Lambda = sum ((limited (y - x' s_0))^2 - (limited (y - x' s_1))^2) / (2 sigma^2)`
//!
//! over the first seconds after the change, where each residual has its mean removed. One false alarm per hour requires
//! a value of about 12, or more if the operators are not known.
use hoid_core::adaptive::{basis::Basis, defaults::DefaultOperator};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

const ORDER: usize = 16;
const DELAY_S: f64 = 0.2;
const RESIDUAL_LIMIT: f64 = 3.5;

/// The regressors and the output of a trial, with the first row that is analysed.
pub struct TrialRows {
    x: Vec<Vector3<f64>>,
    u: Vec<f64>,
    from: usize,
}

impl TrialRows {
    /// Computes the regressors from the error; the first `from` rows are a ramp and are not analysed.
    pub fn new(e: &[f64], u: &[f64], from: usize, ts: f64) -> Self {
        let point = DefaultOperator::with_delay(DELAY_S + 0.5 * ts).point;
        let mut basis = Basis::new(point, ts).unwrap();
        let delay = basis.delay();
        let step = |k: usize| {
            let errors = [0, 1, 2].map(|j| k.checked_sub(delay + j).map_or(0.0, |at| e[at]));
            let state = basis.step(errors);
            Vector3::from(basis.regressors(&state).x)
        };
        Self {
            x: (0..e.len()).map(step).collect(),
            u: u.to_vec(),
            from,
        }
    }

    /// Returns the regressors and the output after the whitening filter `1 + d_1 q^-1 + ..`, with their means removed.
    fn whitened(&self, d: &[f64]) -> (Vec<Vector3<f64>>, Vec<f64>) {
        let rows = self.from..self.u.len();
        let x: Vec<Vector3<f64>> = rows
            .clone()
            .map(|k| (0..=ORDER).map(|j| self.x[k - j] * d[j]).sum())
            .collect();
        let y: Vec<f64> = rows.map(|k| (0..=ORDER).map(|j| self.u[k - j] * d[j]).sum()).collect();
        let n = y.len() as f64;
        let (mean_x, mean_y) = (x.iter().sum::<Vector3<f64>>() / n, y.iter().sum::<f64>() / n);
        (
            x.iter().map(|x| x - mean_x).collect(),
            y.iter().map(|y| y - mean_y).collect(),
        )
    }

    fn residuals(&self, gains: &Vector3<f64>) -> Vec<f64> {
        let left: Vec<f64> = (self.from..self.u.len())
            .map(|k| self.u[k] - self.x[k].dot(gains))
            .collect();
        let mean = left.iter().sum::<f64>() / left.len() as f64;
        left.iter().map(|v| v - mean).collect()
    }
}

fn gains(trials: &[&TrialRows], d: &[f64]) -> Vector3<f64> {
    let (mut products, mut with_output) = (Matrix3::zeros(), Vector3::zeros());
    for trial in trials {
        let (x, y) = trial.whitened(d);
        for (x, y) in x.iter().zip(&y) {
            products += x * x.transpose();
            with_output += x * *y;
        }
    }
    products.lu().solve(&with_output).unwrap()
}

/// Returns the least-squares autoregressive model of v.
fn autoregression(v: &[f64]) -> Vec<f64> {
    let before = DMatrix::from_fn(v.len() - ORDER, ORDER, |k, j| v[k + ORDER - 1 - j]);
    let mut now = DVector::from_column_slice(&v[ORDER..]);
    let triangular = before.qr();
    triangular.q_tr_mul(&mut now);
    let d = triangular.r().solve_upper_triangular(&now.rows(0, ORDER)).unwrap();
    core::iter::once(1.0).chain(d.iter().map(|d| -d)).collect()
}

/// Returns `log Lambda` over the first `samples` of the second trial. `before` are the trials with the first operator;
/// the trial `joined` of these precedes the second trial. `after` are the trials with the second operator, without the
/// examined trial.
pub fn log_ratio(
    before: &[&TrialRows],
    joined: usize,
    after: &[&TrialRows],
    second: &TrialRows,
    samples: usize,
) -> f64 {
    let first = before[joined];
    let mut d: Vec<f64> = (0..=ORDER).map(|j| f64::from(j == 0)).collect();
    for _ in 0..4 {
        d = autoregression(&first.residuals(&gains(&[first], &d)));
    }
    let of = |rows: &TrialRows, gains: &Vector3<f64>| {
        let (x, y) = rows.whitened(&d);
        x.iter().zip(&y).map(|(x, y)| y - x.dot(gains)).collect::<Vec<f64>>()
    };
    let own = of(first, &gains(&[first], &d));
    let variance = own.iter().map(|v| v * v).sum::<f64>() / own.len() as f64;
    let limit = RESIDUAL_LIMIT * variance.sqrt();
    let loss = |gains: &Vector3<f64>| {
        let left = &of(second, gains)[..samples];
        let mean = left.iter().sum::<f64>() / samples as f64;
        let squares = left.iter().map(|v| (v - mean).clamp(-limit, limit).powi(2));
        squares.sum::<f64>() / (2.0 * variance)
    };
    loss(&gains(before, &d)) - loss(&gains(after, &d))
}
