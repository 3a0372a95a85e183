//! Padé approximation of a delay by a rational function (H. Padé 1892; K. Ogata, *Modern Control Engineering*).
//!
//! `e^(-tau s) ≈ Q(-tau s)/Q(tau s)`, `Q(x) = sum_k c_k x^k`, `c_k = (2n - k)! n!/((2n)! k! (n - k)!)`, for order n.
//! The approximation is all-pass, and its phase is close to the phase of the delay up to about `omega tau = n`. Each
//! order adds a state and a pole. tau appears in the coefficients, so it can be estimated and can change.

use hoid_model::SampleTime;
use nalgebra::{DMatrix, DVector};

/// Highest order of the approximation.
pub(super) const MAX_ORDER: usize = 3;

/// Returns the coefficients c_0 to c_n.
fn coefficients(order: usize) -> Vec<f64> {
    let mut c = vec![1.0];
    for k in 1..=order {
        let (n, k) = (order as f64, k as f64);
        let last = c[c.len() - 1];
        c.push(last * (n - k + 1.0) / ((2.0 * n - k + 1.0) * k));
    }
    c
}

/// Returns the transition, over one sample of held input, of the neuromuscular system preceded by a delay. The states
/// are y_0, y_1 and the states of the delay.
///
/// The delay is in controllable canonical form, `p^(n) + sum a_k p^(k) = e`, with the output `d e + sum b_k p^(k)` and
/// the feedthrough `d = (-1)^n`; this output drives y_0. The delay and the neuromuscular system are discretised
/// together, exactly for a held input, by the exponential of the matrix of states and input.
pub(super) fn delayed_second_order(
    omega: f64,
    zeta: f64,
    tau_s: f64,
    order: usize,
    sample_time: SampleTime,
) -> (DMatrix<f64>, DVector<f64>) {
    let c = coefficients(order);
    let direct = if order.is_multiple_of(2) { 1.0 } else { -1.0 };
    // All coefficients are divided by c_n tau^n, which makes the leading coefficient of the denominator 1.
    let leading = c[order] * tau_s.powi(order as i32);
    let denominator = |k: usize| c[k] * tau_s.powi(k as i32) / leading;
    let numerator = |k: usize| {
        let sign = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        (sign - direct) * denominator(k)
    };
    let n = 2 + order;
    let square = omega * omega;
    let mut all = DMatrix::zeros(n + 1, n + 1);
    all[(0, 1)] = 1.0;
    all[(1, 0)] = -square;
    all[(1, 1)] = -2.0 * zeta * omega;
    all[(1, n)] = square * direct;
    for k in 0..order {
        all[(1, 2 + k)] = square * numerator(k);
        if k + 1 < order {
            all[(2 + k, 3 + k)] = 1.0;
        }
        all[(n - 1, 2 + k)] = -denominator(k);
    }
    all[(n - 1, n)] = 1.0;
    // The derivatives of p differ by orders of magnitude (powers of 1/tau); scaling them by powers of tau keeps the
    // matrix exponential accurate.
    let scale = |i: usize| {
        if (2..n).contains(&i) {
            tau_s.powi((i - 2) as i32)
        } else {
            1.0
        }
    };
    let scaled = DMatrix::from_fn(n + 1, n + 1, |i, j| all[(i, j)] * scale(i) / scale(j) * sample_time.s());
    let held = scaled.exp();
    let back = |i: usize, j: usize| held[(i, j)] * scale(j) / scale(i);
    (DMatrix::from_fn(n, n, back), DVector::from_fn(n, |i, _| back(i, n)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use hoid_model::Complex64;

    use super::*;

    #[test]
    fn coefficients_match_the_tables() {
        assert_eq!(coefficients(1), [1.0, 0.5]);
        assert_eq!(coefficients(2)[..2], [1.0, 0.5]);
        for (found, expected) in coefficients(3).iter().zip([1.0, 0.5, 0.1, 1.0 / 120.0]) {
            assert!((found - expected).abs() < 1e-15);
        }
    }

    /// Compares the held system with the frequency response of the delay and the second-order system.
    #[test]
    fn phase_approximates_the_delay() {
        let ts = SampleTime::new(0.01).unwrap();
        let (omega, zeta, tau) = (11.25, 0.35, 0.28);
        // Frequency and largest error for each order; the error is the phase error of the Padé approximation.
        for (order, at, most) in [(1, 1.0, 3e-3), (2, 3.0, 2e-3), (3, 6.0, 2e-3)] {
            let (a, b) = delayed_second_order(omega, zeta, tau, order, ts);
            let n = 2 + order;
            let z = Complex64::from_polar(1.0, at * ts.s());
            let matrix = DMatrix::from_fn(n, n, |i, j| (if i == j { z } else { Complex64::default() }) - a[(i, j)]);
            let state = matrix.lu().solve(&b.map(|x| Complex64::new(x, 0.0))).unwrap();
            let s = Complex64::new(0.0, at);
            let square = omega * omega;
            // A hold delays by half a sample and attenuates by sinc.
            let half = 0.5 * at * ts.s();
            let hold = Complex64::from_polar(half.sin() / half, -half);
            let expected =
                hold * Complex64::from_polar(1.0, -at * tau) * square / (s * s + 2.0 * zeta * omega * s + square);
            // The images of the spectrum above half the sampling rate contribute 1e-4.
            let off = (state[0] / expected - 1.0).norm();
            assert!(off < most, "{order}: {off}");
        }
    }
}
