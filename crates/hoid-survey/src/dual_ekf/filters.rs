//! The filter of the state and the filter of the parameters.

use std::ops::AddAssign;

use hoid_core::bounds::clamp;
use hoid_model::{SampleTime, second_order::ZohStates};
use hoid_track::building::OPERATOR_PARAMETER_COUNT;
use nalgebra::{DMatrix, DVector, RowDVector};

use super::pade;

/// Largest number of parameters: the operator parameters and the delay.
pub(super) const MAX_PARAMETERS: usize = OPERATOR_PARAMETER_COUNT + 1;

/// Relative step of the central differences of A and B.
const RELATIVE_STEP: f64 = 1e-5;
/// Largest number of times that a step of the parameters is halved.
const MAX_HALVINGS: usize = 30;

/// The filter of the state and the filter of the parameters.
#[derive(Debug, Clone)]
pub(super) struct Filters {
    pub sample_time: SampleTime,
    pub d1: f64,
    /// Order of the Padé approximation of the delay; 0 for no approximation.
    pub pade: usize,
    /// Variance of the innovation of the remnant; `input_noise_variance` is the variance of the noise added to e.
    pub innovation_variance: f64,
    pub input_noise_variance: f64,
    pub x: DVector<f64>,
    pub p: DMatrix<f64>,
    /// Parameters K_e, K_e_dot, omega_nm and zeta_nm; with a Padé approximation also tau_e.
    pub w: DVector<f64>,
    pub p_w: DMatrix<f64>,
    /// Increase in each diagonal element of P_w per sample.
    pub walk: DVector<f64>,
    /// Derivative dx/dw of the corrected state.
    pub slope: DMatrix<f64>,
}

impl Filters {
    /// Returns A and B of the state equation for given parameters.
    fn state_equation(&self, w: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let n = self.x.len();
        let (mut a, mut b) = (DMatrix::zeros(n, n), DVector::zeros(n));
        a[(n - 1, n - 1)] = -self.d1;
        let (omega, zeta) = (w[2], w[3]);
        let square = omega * omega;
        if self.pade == 0 {
            let of = ZohStates::new(2.0 * zeta * omega, square, self.sample_time);
            for i in 0..2 {
                for j in 0..2 {
                    a[(i, j)] = of.transition[i][j];
                }
                b[i] = square * of.input[i];
            }
            return (a, b);
        }
        let (own, input) = pade::delayed_second_order(omega, zeta, w[4], self.pade, self.sample_time);
        a.view_mut((0, 0), (n - 1, n - 1)).copy_from(&own);
        b.rows_mut(0, n - 1).copy_from(&input);
        (a, b)
    }

    fn output(&self) -> RowDVector<f64> {
        let n = self.x.len();
        RowDVector::from_fn(n, |_, i| match i {
            0 => self.w[0],
            1 => self.w[1],
            i if i + 1 == n => 1.0,
            _ => 0.0,
        })
    }

    /// Predicts the state x, its covariance P and its derivative dx/dw.
    pub fn predict(&mut self, e: f64) {
        let (a, b) = self.state_equation(&self.w);
        let mut slope = &a * &self.slope;
        // K_e and K_e_dot occur only in C.
        for i in 2..self.w.len() {
            let by = RELATIVE_STEP * self.w[i];
            let moved = |by: f64| {
                let mut w = self.w.clone();
                w[i] += by;
                let (a, b) = self.state_equation(&w);
                a * &self.x + b * e
            };
            let along = (moved(by) - moved(-by)) / (2.0 * by);
            slope.column_mut(i).add_assign(&along);
        }
        self.slope = slope;
        let n = self.x.len();
        self.x = &a * &self.x + &b * e;
        self.p = &a * &self.p * a.transpose() + &b * b.transpose() * self.input_noise_variance;
        self.p[(n - 1, n - 1)] += self.innovation_variance;
    }

    /// Corrects the state, and the parameters if `moves` is true. Returns the innovation and its variance.
    pub fn correct(&mut self, u: f64, moves: bool) -> [f64; 2] {
        let c = self.output();
        let innovation = u - (&c * &self.x)[0];
        // u has no measurement noise, so the second term is needed to keep the variance above zero.
        let variance = (&c * &self.p * c.transpose())[0] + 1e-9 * self.innovation_variance;
        let gain = &self.p * c.transpose() / variance;
        let h = self.prediction_gradient();
        if moves {
            self.move_parameters(&h, innovation, variance);
        }
        self.x += &gain * innovation;
        self.slope -= &gain * h;
        self.p -= &gain * (c * &self.p);
        self.p = (&self.p + self.p.transpose()) * 0.5;
        [innovation, variance]
    }

    /// Returns h, the total derivative of the prediction with respect to the parameters.
    pub fn prediction_gradient(&self) -> RowDVector<f64> {
        let mut h = self.output() * &self.slope;
        h[0] += self.x[0];
        h[1] += self.x[1];
        h
    }

    fn move_parameters(&mut self, h: &RowDVector<f64>, innovation: f64, variance: f64) {
        self.p_w += DMatrix::from_diagonal(&self.walk);
        let s = (h * &self.p_w * h.transpose())[0] + variance;
        let gain = &self.p_w * h.transpose() / s;
        let mut step = &gain * innovation;
        // A full step may be too large: omega_nm, zeta_nm and the delay must stay positive.
        for _ in 0..MAX_HALVINGS {
            let moved = &self.w + &step;
            if moved.rows(2, moved.len() - 2).iter().all(|x| *x > 0.0) {
                self.w = moved;
                break;
            }
            step *= 0.5;
        }
        self.p_w -= &gain * (h * &self.p_w);
        self.p_w = (&self.p_w + self.p_w.transpose()) * 0.5;
    }

    pub fn is_valid(&self) -> bool {
        let mut all = self
            .x
            .iter()
            .chain(&self.p)
            .chain(&self.w)
            .chain(&self.p_w)
            .chain(&self.slope);
        all.all(|x| x.is_finite())
    }

    /// Keeps the parameters within their bounds. Returns true if a parameter was changed.
    pub fn clamp_parameters(&mut self, bounds: &[[f64; 2]; MAX_PARAMETERS]) -> bool {
        let before = self.w.clone();
        for (w, bounds) in self.w.iter_mut().zip(bounds) {
            *w = clamp(*w, *bounds);
        }
        self.w != before
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn filters(w: &[f64], pade: usize) -> Filters {
        let (n, p) = (3 + pade, w.len());
        Filters {
            sample_time: SampleTime::new(0.01).unwrap(),
            d1: -0.8,
            pade,
            innovation_variance: 1e-4,
            input_noise_variance: 0.0,
            x: DVector::zeros(n),
            // The state is known exactly and has no noise: the gains of y_0 and y_1 are zero, and the gain of n does
            // not depend on w.
            p: DMatrix::zeros(n, n),
            w: DVector::from_row_slice(w),
            p_w: DMatrix::identity(p, p),
            walk: DVector::zeros(p),
            slope: DMatrix::zeros(n, p),
        }
    }

    /// h equals the derivative of the prediction for constant parameters, with and without a Padé approximation of the
    /// delay.
    #[test]
    fn total_derivative_agrees_with_finite_differences() {
        let e = |k: usize| (0.07 * k as f64).sin() + 0.3 * (0.31 * k as f64).cos();
        let u = |k: usize| 0.1 * (0.05 * k as f64).sin();
        for (w, pade) in [
            (&[0.07, 0.084, 11.25, 0.35][..], 0),
            (&[0.07, 0.084, 11.25, 0.35, 0.28], 2),
        ] {
            let innovations = |w: &[f64]| {
                let mut own = filters(w, pade);
                let of = |k: usize| {
                    own.predict(e(k));
                    own.correct(u(k), false)[0]
                };
                (0..200).map(of).collect::<Vec<f64>>()
            };
            let mut own = filters(w, pade);
            let mut slopes = Vec::new();
            for k in 0..200 {
                own.predict(e(k));
                slopes.push(own.prediction_gradient());
                own.correct(u(k), false);
            }
            for i in 0..w.len() {
                let step = 1e-4 * w[i];
                let moved = |by: f64| {
                    let mut w = w.to_vec();
                    w[i] += by;
                    innovations(&w)
                };
                let (forth, back) = (moved(step), moved(-step));
                for k in (50..200).step_by(50) {
                    let expected = -(forth[k] - back[k]) / (2.0 * step);
                    let found = slopes[k][i];
                    assert!(
                        (found - expected).abs() < 1e-5 * (1.0 + expected.abs()),
                        "{pade}, {i}, {k}: {found} {expected}"
                    );
                }
            }
        }
    }
}
