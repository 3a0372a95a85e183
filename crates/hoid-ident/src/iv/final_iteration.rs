//! Final state of an instrumental variable iteration.

use crate::{Termination, linalg::vectors::dot};

use super::equation::{Equation, Prefilter};

/// Noise model C/D.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct NoiseModel {
    pub c: Vec<f64>,
    pub d: Vec<f64>,
}

impl NoiseModel {
    /// Returns the filter `D/(C F)` for F given by its coefficients.
    pub fn prefilter<'p>(&'p self, f: &'p [f64]) -> Prefilter<'p> {
        Prefilter {
            d: &self.d,
            c: &self.c,
            f,
        }
    }
}

/// System, noise model and equation of the last iteration.
pub(super) struct LastIterate {
    pub system: Vec<f64>,
    pub noise: NoiseModel,
    /// Filtered equation of the last iteration.
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
