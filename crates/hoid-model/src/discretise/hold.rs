//! Zero-order and first-order hold, computed by the matrix exponential.

use nalgebra::{DMatrix, DVector};

use crate::ContinuousTransferFunction;

/// Returns the numerator and the denominator of the held system in ascending powers of `z^-1`, for a delay of a
/// `fraction` of a sample. A nonzero fraction makes the numerator longer by one coefficient. `None` if the matrix
/// exponential is not finite.
pub(super) fn zoh_equivalent(
    h: &ContinuousTransferFunction,
    ts: f64,
    fraction: f64,
    triangle: bool,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let n = h.den().len() - 1;
    let feedthrough = if h.num().len() == n + 1 { h.num()[0] } else { 0.0 };
    let magnitude = (1..=n).map(|k| h.den()[k].abs().powf(1.0 / k as f64));
    let alpha = magnitude.fold(1.0 / ts, f64::max);

    // The state is in controllable canonical form in p = s/alpha: x[i] = p^i / den(p) u.
    let mut extended = DMatrix::zeros(n + 2, n + 2);
    let mut output = DVector::zeros(n);
    let offset = n + 1 - h.num().len();
    let mut power = 1.0;
    for k in 1..=n {
        power *= alpha;
        let b = if k >= offset { h.num()[k - offset] } else { 0.0 };
        output[n - k] = (b - feedthrough * h.den()[k]) / power;
        extended[(n - 1, n - k)] = -h.den()[k] / power * (alpha * ts);
    }
    for i in 1..n {
        extended[(i - 1, i)] = alpha * ts;
    }
    if n > 0 {
        extended[(n - 1, n)] = alpha * ts;
    }
    extended[(n, n + 1)] = 1.0;

    let over_sample = Propagation::new(&extended, 1.0)?;
    let mut difference = over_sample.phi.clone();
    for i in 0..n {
        difference[(i, i)] -= 1.0;
    }
    // With the triangle hold, the state x depends on u(k) and u(k + 1), but x - Gamma_2 u depends only on u(k).
    let drive = if triangle {
        &over_sample.constant + &difference * &over_sample.slope
    } else {
        over_sample.constant.clone()
    };
    let (row, direct, ahead) = if fraction == 0.0 {
        let direct = if triangle {
            feedthrough + output.dot(&over_sample.slope)
        } else {
            feedthrough
        };
        (output, direct, 0.0)
    } else {
        let part = 1.0 - fraction;
        let inside = Propagation::new(&extended, part)?;
        let row = inside.phi.transpose() * &output;
        let constant = feedthrough + output.dot(&inside.constant);
        if triangle {
            let ahead = feedthrough * part + output.dot(&inside.slope);
            (row.clone(), constant - ahead + row.dot(&over_sample.slope), ahead)
        } else {
            (row, constant, 0.0)
        }
    };

    let (proper, characteristic) = transfer_function_in_delta(&row, &difference, &drive);
    let den = from_delta_to_z(&characteristic);
    let proper = from_delta_to_z(&proper);
    let mut num: Vec<f64> = den.iter().map(|d| direct * d).collect();
    for (i, b) in proper.iter().enumerate() {
        num[i + 1] += b;
    }
    if fraction != 0.0 {
        // An output read within a sample depends on the inputs at the start and, with the triangle hold, at the end of
        // that sample; `ahead` is the coefficient of the input at the end.
        num.insert(0, 0.0);
        for (n, d) in num.iter_mut().zip(&den) {
            *n += ahead * d;
        }
    }
    Some((num, den))
}

/// State after a fraction of a sample: `phi x(0) + constant u(0) + slope (u(1) - u(0))`.
struct Propagation {
    phi: DMatrix<f64>,
    constant: DVector<f64>,
    slope: DVector<f64>,
}

impl Propagation {
    fn new(extended: &DMatrix<f64>, part: f64) -> Option<Self> {
        let scaled = extended * part;
        if scaled.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let e = scaled.exp();
        if e.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let n = extended.nrows() - 2;
        Some(Self {
            phi: e.view((0, 0), (n, n)).into_owned(),
            constant: e.view((0, n), (n, 1)).column(0).into_owned(),
            slope: e.view((0, n + 1), (n, 1)).column(0).into_owned(),
        })
    }
}

/// Numerator (degree n - 1) and denominator (degree n) of `row (delta I - m)^-1 column` in descending powers of delta,
/// by the Faddeev-LeVerrier recursion.
fn transfer_function_in_delta(row: &DVector<f64>, m: &DMatrix<f64>, column: &DVector<f64>) -> (Vec<f64>, Vec<f64>) {
    let n = m.nrows();
    let (mut num, mut den) = (Vec::with_capacity(n), vec![1.0]);
    let mut adjugate = DMatrix::identity(n, n);
    for k in 1..=n {
        num.push(row.dot(&(&adjugate * column)));
        let mut next = m * &adjugate;
        let c = -next.trace() / k as f64;
        for i in 0..n {
            next[(i, i)] += c;
        }
        den.push(c);
        adjugate = next;
    }
    (num, den)
}

/// Converts a polynomial in descending powers of `delta = z - 1` to powers of z.
fn from_delta_to_z(p: &[f64]) -> Vec<f64> {
    let mut result: Vec<f64> = Vec::with_capacity(p.len());
    for &c in p {
        result.push(0.0);
        for i in (1..result.len()).rev() {
            let higher = result[i - 1];
            result[i] -= higher;
        }
        if let Some(last) = result.last_mut() {
            *last += c;
        }
    }
    result
}
