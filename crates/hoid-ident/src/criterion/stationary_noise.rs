//! Initial state of stationary noise, for the treatment of the past that is called backcasting by Box and Jenkins and
//! in MATLAB's toolbox.
//!
//! In innovations form `v = (C/D) eps` has r = max(nc, nd) states,
//!
//! `x_i(t+1) = x_{i+1}(t) + c_i eps(t) - d_i v(t)`, `v = eps + x_1`, or `x(t+1) = Phi x + K eps` with
//! `K_i = c_i - d_i`.
//!
//! For a record that starts at t = 0, the predictor is `C eps = D v + g` with `g_i = -x_{i+1}(0)` and zero signals
//! before t = 0. If v is stationary, x(0) is random with the covariance `sigma^2 P`, where `P = Phi P Phi' + K K'`, and
//!
//! `S(theta) = min over g of  sum eps^2 + g' P^-1 g  =  v' Sigma_v^-1 v`
//!
//! is the *unconditional sum of squares* of G. E. P. Box and G. M. Jenkins (*Time Series Analysis*, 1976, section
//! 7.1.4), who compute it by running the model backwards. With `P = L L'` and `g = L z` the penalty is `z' z`, so z can
//! be appended to the residuals.
//!
//! The gradient of the penalty follows from the solution Z of the adjoint equation `Z = Phi' Z Phi + y y'` with
//! `y = P^-1 g`: `y' (dP/dc_i) y = 2 (Z K)_i` and `y' (dP/dd_i) y = -2 (Z K)_i - 2 (Z Phi P)_{i1}`.

use nalgebra::{DMatrix, DVector};

use crate::linalg::vectors::add_scaled;

/// Number of doublings of the Lyapunov sum: 2^60 terms suffice for any stable pole whose modulus differs from one in
/// double precision.
const MAX_DOUBLINGS: usize = 60;

/// Covariance of the initial state of a noise model.
#[derive(Debug)]
pub(crate) struct StationaryNoise {
    transition: DMatrix<f64>,
    gain: DVector<f64>,
    covariance: DMatrix<f64>,
    factor: DMatrix<f64>,
}

impl StationaryNoise {
    /// Returns the state equations of `(C/D) eps` and the covariance of its initial state for innovations of unit
    /// variance; `None` if D has a root on or outside the unit circle.
    pub fn of(c: &[f64], d: &[f64]) -> Option<Self> {
        let r = c.len().max(d.len());
        let coefficient = |p: &[f64], i: usize| p.get(i).copied().unwrap_or(0.0);
        let transition = DMatrix::from_fn(r, r, |i, j| {
            f64::from(u8::from(j == i + 1)) - if j == 0 { coefficient(d, i) } else { 0.0 }
        });
        let gain = DVector::from_fn(r, |i, _| coefficient(c, i) - coefficient(d, i));
        let covariance = lyapunov(&transition, &gain)?;
        let factor = semidefinite_factor(&covariance);
        Some(Self {
            transition,
            gain,
            covariance,
            factor,
        })
    }

    /// Returns the number of states.
    pub fn state_count(&self) -> usize {
        self.gain.len()
    }

    /// Returns the response of the residuals to `z_j`, computed from the responses to each `g_i`.
    pub fn response(&self, responses: &[Vec<f64>], j: usize) -> Vec<f64> {
        let longest = responses.iter().map(Vec::len).max().unwrap_or(0);
        let mut column = vec![0.0; longest];
        for (i, response) in responses.iter().enumerate() {
            add_scaled(&mut column[..response.len()], self.factor[(i, j)], response);
        }
        column
    }

    /// Returns `(1/2) y' dP y` with respect to the coefficients of C and of D, at the least squares z. This is the
    /// contribution of the penalty to the descent `psi' eps`.
    pub fn descent(&self, z: &[f64], nc: usize, nd: usize) -> (Vec<f64>, Vec<f64>) {
        // The noise model has no states.
        if self.state_count() == 0 {
            return (Vec::new(), Vec::new());
        }
        let y = self.solve_transposed(z);
        let Some(adjoint) = lyapunov(&self.transition.transpose(), &y) else {
            return (vec![0.0; nc], vec![0.0; nd]);
        };
        let through_gain = &adjoint * &self.gain;
        let through_transition = &adjoint * (&self.transition * &self.covariance).column(0);
        (
            (0..nc).map(|i| through_gain[i]).collect(),
            (0..nd).map(|i| -through_gain[i] - through_transition[i]).collect(),
        )
    }

    /// Returns `L^-T z`; elements of states without variance are zero.
    fn solve_transposed(&self, z: &[f64]) -> DVector<f64> {
        let r = z.len();
        let mut y = DVector::zeros(r);
        for i in (0..r).rev() {
            let rest: f64 = (i + 1..r).map(|j| self.factor[(j, i)] * y[j]).sum();
            if self.factor[(i, i)] > 0.0 {
                y[i] = (z[i] - rest) / self.factor[(i, i)];
            }
        }
        y
    }
}

/// Solves `P = Phi P Phi' + k k'` by doubling: `P <- P + A P A'`, `A <- A^2` (B. D. O. Anderson and J. B. Moore,
/// *Optimal Filtering*, 1979, section 6.7). `None` if the sum does not converge.
fn lyapunov(transition: &DMatrix<f64>, gain: &DVector<f64>) -> Option<DMatrix<f64>> {
    let mut sum = gain * gain.transpose();
    let mut power = transition.clone();
    for _ in 0..MAX_DOUBLINGS {
        let more = &power * &sum * power.transpose();
        sum += &more;
        let (size, change) = (sum.amax(), more.amax());
        if !size.is_finite() {
            return None;
        }
        if change <= 1e-17 * size {
            return Some((&sum + sum.transpose()) * 0.5);
        }
        power = &power * &power;
    }
    None
}

/// Returns the lower triangular L with `L L' = P`; a pivot that is zero to rounding results in a column of zeros.
fn semidefinite_factor(p: &DMatrix<f64>) -> DMatrix<f64> {
    let r = p.nrows();
    let mut l = DMatrix::zeros(r, r);
    for j in 0..r {
        let pivot = p[(j, j)] - (0..j).map(|k| l[(j, k)] * l[(j, k)]).sum::<f64>();
        if pivot <= 1e-14 * p[(j, j)].max(f64::MIN_POSITIVE) {
            continue;
        }
        l[(j, j)] = pivot.sqrt();
        for i in j + 1..r {
            let rest = p[(i, j)] - (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>();
            l[(i, j)] = rest / l[(j, j)];
        }
    }
    l
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covariance_of_first_order_noise_matches_the_formula() {
        // AR(1): x = -d v, var v = 1/(1 - d^2).
        let ar = StationaryNoise::of(&[], &[-0.8]).unwrap();
        assert!((ar.covariance[(0, 0)] - 0.64 / 0.36).abs() < 1e-14);
        // MA(1): x = c eps.
        let ma = StationaryNoise::of(&[0.5], &[]).unwrap();
        assert!((ma.covariance[(0, 0)] - 0.25).abs() < 1e-15);
        // ARMA(1, 1): x' = -d x + (c - d) eps.
        let arma = StationaryNoise::of(&[0.3], &[-0.9]).unwrap();
        assert!((arma.covariance[(0, 0)] - 1.44 / 0.19).abs() < 1e-12);
    }

    #[test]
    fn covariance_solves_its_equation_and_equals_its_factor_squared() {
        let past = StationaryNoise::of(&[0.4, 0.1], &[-1.6, 0.8, -0.1]).unwrap();
        let (phi, k) = (&past.transition, &past.gain);
        let again = phi * &past.covariance * phi.transpose() + k * k.transpose();
        assert!((again - &past.covariance).amax() < 1e-12 * past.covariance.amax());
        let product = &past.factor * past.factor.transpose();
        assert!((product - &past.covariance).amax() < 1e-12 * past.covariance.amax());
    }

    #[test]
    fn nonstationary_noise_is_rejected() {
        assert!(StationaryNoise::of(&[], &[-1.0]).is_none());
        assert!(StationaryNoise::of(&[], &[-2.0, 1.1]).is_none());
        assert!(StationaryNoise::of(&[f64::NAN], &[0.1]).is_none());
        // The past of white noise carries no information.
        let white = StationaryNoise::of(&[-0.5], &[-0.5]).unwrap();
        assert_eq!(white.descent(&[0.0], 1, 1), (vec![0.0], vec![0.0]));
    }

    #[test]
    fn descent_is_half_the_derivative_of_the_penalty() {
        let (c, d) = ([0.4, 0.1], [-1.5, 0.7]);
        let g = DVector::from_vec(vec![0.7, -0.3]);
        let penalty = |c: &[f64], d: &[f64]| {
            let past = StationaryNoise::of(c, d).unwrap();
            (g.transpose() * past.covariance.try_inverse().unwrap() * &g)[(0, 0)]
        };
        let past = StationaryNoise::of(&c, &d).unwrap();
        let z = past.factor.clone().try_inverse().unwrap() * &g;
        let (by_c, by_d) = past.descent(z.as_slice(), 2, 2);
        let h = 1e-6;
        for i in 0..2 {
            let (mut up, mut down) = (c, c);
            up[i] += h;
            down[i] -= h;
            let slope = (penalty(&up, &d) - penalty(&down, &d)) / (2.0 * h);
            assert!((slope + 2.0 * by_c[i]).abs() < 1e-7, "c{}: {slope} {}", i + 1, by_c[i]);
            let (mut up, mut down) = (d, d);
            up[i] += h;
            down[i] -= h;
            let slope = (penalty(&c, &up) - penalty(&c, &down)) / (2.0 * h);
            assert!((slope + 2.0 * by_d[i]).abs() < 1e-7, "d{}: {slope} {}", i + 1, by_d[i]);
        }
    }
}
