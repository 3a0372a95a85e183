//! The numerator of the remnant filter after a zero-order hold, factored with all zeros inside the unit circle.

use num_complex::Complex64;

use crate::polynomial;

/// Highest order m of a remnant filter.
pub const HIGHEST_ORDER: usize = 4;

/// Pieces of the cardinal B-spline of order m: on `[j, j + 1]`, in powers of `u = t - j`.
const B_SPLINES: [&[[f64; 4]]; HIGHEST_ORDER] = [
    &[[1.0, 0.0, 0.0, 0.0]],
    &[[0.0, 1.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0]],
    &[[0.0, 0.0, 0.5, 0.0], [0.5, 1.0, -1.0, 0.0], [0.5, -1.0, 0.5, 0.0]],
    &[
        [0.0, 0.0, 0.0, 1.0 / 6.0],
        [1.0 / 6.0, 0.5, 0.5, -0.5],
        [4.0 / 6.0, 0.0, -1.0, 0.5],
        [1.0 / 6.0, -0.5, 0.5, -1.0 / 6.0],
    ],
];

/// Returns the moments `integral over [0, 1] of u^k e^{-a u} du`, k = 0 to 4.
fn moments(a: f64) -> [f64; 5] {
    let decay = (-a).exp();
    let mut m = [0.0; 5];
    if a < 8.0 {
        // The highest moment is computed from its series of positive terms, e^-a sum of a^i k!/(k + 1 + i)!, and the
        // other moments by downward recurrence (integration by parts).
        let (mut term, mut sum) = (0.2, 0.0);
        for i in 0..80 {
            sum += term;
            term *= a / f64::from(i + 6);
        }
        m[4] = decay * sum;
        for k in (1..5).rev() {
            m[k - 1] = (a * m[k] + decay) / k as f64;
        }
    } else {
        m[0] = -(-a).exp_m1() / a;
        for k in 1..5 {
            m[k] = (k as f64 * m[k - 1] - decay) / a;
        }
    }
    m
}

/// Returns the coefficients `n_1, ..., n_m` of the numerator.
pub(super) fn zoh_numerator(order: usize, a: f64) -> Vec<f64> {
    let m = moments(a);
    let pieces = B_SPLINES[order - 1].iter().enumerate();
    let integral = |piece: &[f64; 4]| -> f64 { piece.iter().zip(&m).map(|(c, m)| c * m).sum() };
    pieces
        .map(|(j, piece)| a.powi(order as i32) * (-a * j as f64).exp() * integral(piece))
        .collect()
}

/// Returns the derivatives of `n_1, ..., n_m` with respect to a.
fn zoh_numerator_derivative(order: usize, a: f64) -> Vec<f64> {
    let m = moments(a);
    let numerator = zoh_numerator(order, a);
    let pieces = B_SPLINES[order - 1].iter().zip(&numerator).enumerate();
    pieces
        .map(|(j, (piece, n))| {
            // The derivative of a moment is minus the next moment.
            let moved: f64 = piece.iter().zip(&m[1..]).map(|(c, m)| c * m).sum();
            n * (order as f64 / a - j as f64) - a.powi(order as i32) * (-a * j as f64).exp() * moved
        })
        .collect()
}

/// The numerator of the zero-order hold with its zeros inside the unit circle, for K_n = 1.
pub(crate) struct FactoredNumerator {
    pub c: Vec<f64>,
    /// Derivatives of the coefficients c with respect to `a = Ts/T_n`.
    pub c_derivative: Vec<f64>,
    pub innovation_sd: f64,
    /// Derivative of `ln innovation_sd` with respect to a.
    pub log_derivative: f64,
}

impl FactoredNumerator {
    pub fn new(order: usize, a: f64) -> Self {
        let numerator = zoh_numerator(order, a);
        let derivative = zoh_numerator_derivative(order, a);
        let mut sd = numerator[0];
        let mut log_derivative = derivative[0] / numerator[0];
        let degree = numerator.len() - 1;
        let slope: Vec<f64> = numerator[..degree]
            .iter()
            .enumerate()
            .map(|(i, n)| (degree - i) as f64 * n)
            .collect();
        let at = |p: &[f64], z: Complex64| p.iter().fold(Complex64::new(0.0, 0.0), |sum, &c| sum * z + c);
        let (mut inside, mut moves) = (Vec::with_capacity(degree), Vec::with_capacity(degree));
        // There are at most three roots, and the coefficients are positive: the roots are found unless a is so large
        // that all coefficients but n_1 vanish.
        for zero in polynomial::roots(&numerator).unwrap_or_default() {
            // From N(zeta, a) = 0, the derivative of a zero is dzeta/da = -N_a/N_zeta.
            let moved = -at(&derivative, zero) / at(&slope, zero);
            if zero.norm() <= 1.0 {
                inside.push(zero);
                moves.push(moved);
                continue;
            }
            let reflected = 1.0 / zero.conj();
            inside.push(reflected);
            moves.push(-moved.conj() * reflected * reflected);
            sd *= zero.norm();
            log_derivative += (moved / zero).re;
        }
        // dC = - sum over i of dzeta_i q^-1 prod over j != i of (1 - zeta_j q^-1).
        let mut c_derivative = vec![0.0; inside.len() + 1];
        for (i, moved) in moves.iter().enumerate() {
            let mut rest = vec![Complex64::new(1.0, 0.0)];
            for zero in inside.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, z)| z) {
                rest.push(Complex64::new(0.0, 0.0));
                for k in (1..rest.len()).rev() {
                    let lower = rest[k - 1];
                    rest[k] -= zero * lower;
                }
            }
            for (k, r) in rest.iter().enumerate() {
                c_derivative[k + 1] -= (moved * r).re;
            }
        }
        Self {
            c: polynomial::from_roots(&inside),
            c_derivative,
            innovation_sd: sd,
            log_derivative,
        }
    }
}
