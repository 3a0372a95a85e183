//! The state augmented by the parameters, and the model for one sample.

use hoid_core::divided_differences::DividedDifferences;

/// Length of the augmented state X.
pub(super) const N: usize = 6;
/// Index of the first parameter in X.
pub(super) const ETA_START: usize = 2;
/// Covariance of X, stored by rows.
pub(super) type Matrix = [[f64; N]; N];

/// Estimate and covariance of X.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct AugmentedState {
    pub x: [f64; N],
    pub p: Matrix,
}

hoid_core::state!([] AugmentedState { x, p });

/// Model of one sample: sample time and noise variances.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Model {
    pub ts: f64,
    /// Variance of the noise added to each element of X per sample; `noise` is the variance of n.
    pub drift: [f64; N],
    pub noise: f64,
}

/// The four coefficients of the transition of p and v, with their derivatives with respect to omega and zeta.
struct HoldCoefficients {
    /// `1 - A`, `R/omega^2`, R, `1 - A - 2 zeta R/omega`.
    values: [f64; 4],
    derivative_omega: [f64; 4],
    derivative_zeta: [f64; 4],
}

impl HoldCoefficients {
    fn at(omega: f64, zeta: f64, t: f64) -> Self {
        let d = DividedDifferences::at(-2.0 * zeta * omega * t, omega * omega * t * t);
        let s_zeta = -2.0 * omega * t;
        let rest = 1.0 - d.product * d.phi2;
        let rate = omega * omega * t * d.phi1;
        let rest_by = [-omega * t * t * d.phi1, -d.product * d.phi2_slope * s_zeta];
        let rate_by = [
            omega * t * (d.phi0() + d.phi1),
            omega * omega * t * d.phi1_slope() * s_zeta,
        ];
        let square = omega * omega;
        let by = |i: usize| {
            let (omega_by, zeta_by) = if i == 0 { (1.0, 0.0) } else { (0.0, 1.0) };
            [
                rest_by[i],
                rate_by[i] / square - 2.0 * rate / (square * omega) * omega_by,
                rate_by[i],
                rest_by[i]
                    - 2.0 * zeta * rate_by[i] / omega
                    - 2.0 * rate * (zeta_by / omega - zeta * omega_by / square),
            ]
        };
        Self {
            values: [rest, rate / square, rate, rest - 2.0 * zeta * rate / omega],
            derivative_omega: by(0),
            derivative_zeta: by(1),
        }
    }
}

impl Model {
    pub fn transition(&self, x: &[f64; N], e: f64) -> [f64; N] {
        let [a, b, c, d] = HoldCoefficients::at(x[4], x[5], self.ts).values;
        let (m, v) = (e - x[0], x[1]);
        [e - a * m + b * v, c * m + d * v, x[2], x[3], x[4], x[5]]
    }

    pub fn jacobian(&self, x: &[f64; N], e: f64) -> Matrix {
        let hold = HoldCoefficients::at(x[4], x[5], self.ts);
        let [a, b, c, d] = hold.values;
        let (m, v) = (e - x[0], x[1]);
        let mut f = [[0.0; N]; N];
        for (i, row) in f.iter_mut().enumerate().skip(ETA_START) {
            row[i] = 1.0;
        }
        let by = |h: &[f64; 4]| [-h[0] * m + h[1] * v, h[2] * m + h[3] * v];
        let (omega, zeta) = (by(&hold.derivative_omega), by(&hold.derivative_zeta));
        f[0] = [a, b, 0.0, 0.0, omega[0], zeta[0]];
        f[1] = [-c, d, 0.0, 0.0, omega[1], zeta[1]];
        f
    }

    pub fn output(x: &[f64; N]) -> f64 {
        x[2] * x[0] + x[3] * x[1]
    }

    pub fn output_gradient(x: &[f64; N]) -> [f64; N] {
        [x[2], x[3], x[0], x[1], 0.0, 0.0]
    }
}
