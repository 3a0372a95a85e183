//! Least squares by normal equations, for regressions with several hundred coefficients over thousands of samples.
//!
//! `theta = (Phi' Phi + D)^-1 Phi' y`, computed from the Cholesky factor of the sum; D is the prior precision of theta
//! (A. N. Tikhonov 1963; A. E. Hoerl and R. W. Kennard, *Technometrics* 12 (1970) 55-67). Squaring the condition number
//! of Phi is harmless if D bounds the condition number of the sum.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::ThesisError;

/// Normal equations: sums of products of the regressors with each other and with y.
#[derive(Debug, Clone)]
pub(super) struct NormalEquations {
    /// Lower triangle of Phi' Phi.
    pub gram: DMatrix<f64>,
    /// Phi' y, one column for each output.
    pub moments: DMatrix<f64>,
}

impl NormalEquations {
    /// Creates equations without data.
    pub fn new(coefficients: usize, outputs: usize) -> Self {
        Self {
            gram: DMatrix::zeros(coefficients, coefficients),
            moments: DMatrix::zeros(coefficients, outputs),
        }
    }

    /// Multiplies the sums by lambda and adds one sample.
    pub fn add(&mut self, lambda: f64, regressors: &[f64], outputs: &[f64]) {
        for (j, x) in regressors.iter().enumerate() {
            let mut column = self.gram.column_mut(j);
            let below = &mut column.as_mut_slice()[j..];
            for (entry, other) in below.iter_mut().zip(&regressors[j..]) {
                *entry = lambda * *entry + x * other;
            }
        }
        for (j, y) in outputs.iter().enumerate() {
            for (i, x) in regressors.iter().enumerate() {
                self.moments[(i, j)] = lambda * self.moments[(i, j)] + x * y;
            }
        }
    }

    /// Returns theta. `prior` is D, of which only the lower triangle is read.
    pub fn solve(&self, method: &'static str, prior: &DMatrix<f64>) -> Result<DMatrix<f64>, ThesisError> {
        // The Cholesky factorisation reads only the lower triangle.
        let factor: Option<Cholesky<f64, Dyn>> = (&self.gram + prior).cholesky();
        let singular = || ThesisError::Unsuited {
            method,
            quantity: "the matrix of the normal equations".to_owned(),
            found: "singular".to_owned(),
            expected: "an input that excites all regressors".to_owned(),
        };
        let theta = factor.ok_or_else(singular)?.solve(&self.moments);
        if theta.iter().all(|x| x.is_finite()) {
            Ok(theta)
        } else {
            Err(singular())
        }
    }

    /// Returns a prior that only keeps the matrix positive definite: `share` times the mean of its diagonal, for every
    /// coefficient.
    pub fn ridge(&self, share: f64) -> DMatrix<f64> {
        let n = self.gram.nrows();
        let level = share * self.gram.trace() / n as f64;
        DMatrix::from_diagonal(&DVector::from_element(n, level))
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn normal_equations_solve_weighted_least_squares() {
        // y = 2 x_1 - x_2 exactly, for any weights.
        let mut all = NormalEquations::new(2, 1);
        for k in 0..20 {
            let x = [f64::from(k).sin(), (1.7 * f64::from(k)).cos()];
            all.add(0.9, &x, &[2.0 * x[0] - x[1]]);
        }
        let theta = all.solve("test", &all.ridge(0.0)).unwrap();
        assert!(
            (theta[0] - 2.0).abs() < 1e-12 && (theta[1] + 1.0).abs() < 1e-12,
            "{theta}"
        );
        // Computed by hand: one regressor with the weights .5 and 1 and y = 1 and 3 gives (.5 1 + 3)/(1.5).
        let mut one = NormalEquations::new(1, 1);
        one.add(0.5, &[1.0], &[1.0]);
        one.add(0.5, &[1.0], &[3.0]);
        assert!((one.solve("test", &one.ridge(0.0)).unwrap()[0] - 3.5 / 1.5).abs() < 1e-15);
    }

    #[test]
    fn without_excitation_there_is_no_solution() {
        let mut none = NormalEquations::new(2, 1);
        none.add(1.0, &[0.0, 0.0], &[1.0]);
        assert!(none.solve("test", &none.ridge(0.0)).is_err());
    }
}
