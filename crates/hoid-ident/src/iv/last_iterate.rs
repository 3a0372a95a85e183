//! The last iterate of instrumental variables.

use crate::{Termination, linalg::least_squares::dot};

use super::equation::{Equation, Prefilter};

/// Numerator and denominator of the noise model.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct NoiseModel {
    pub c: Vec<f64>,
    pub d: Vec<f64>,
}

impl NoiseModel {
    /// Returns the filter `D/(C F)` with these poles.
    pub fn prefilter<'p>(&'p self, f: &'p [f64]) -> Prefilter<'p> {
        Prefilter {
            d: &self.d,
            c: &self.c,
            f,
        }
    }
}

/// The last iterate.
pub(super) struct LastIterate {
    pub system: Vec<f64>,
    pub noise: NoiseModel,
    /// The last filtered equation.
    pub equation: Equation,
    pub termination: Termination,
}

impl LastIterate {
    /// Returns the mean square of the filtered residual.
    pub fn variance(&self) -> f64 {
        let residual = self.equation.residual(&self.system);
        dot(&residual, &residual) / residual.len() as f64
    }
}
