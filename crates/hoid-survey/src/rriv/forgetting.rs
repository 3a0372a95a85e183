//! The gain for a vector of instruments: the covariance update of the kernel ([`hoid_core::adaptation`]) with z in
//! place of psi.
//!
//! The kernel updates the covariance as for a recursion with the gradient z; the gain does not depend on whether the
//! innovation belongs to a gradient or to instruments. If rounding errors make the covariance invalid, for example
//! after a jump in scale by 1e8 or more, it is reset to its initial value.

use hoid_core::state::{State, visit_all};
use hoid_core::{
    adaptation::{Adaptation, Forgetting as Rule},
    covariance::Covariance,
    ud_covariance::UdCovariance,
};

use hoid_track::building::VARIANCE_GROWTH_WITHOUT_FIT;

/// Capacity for parameters.
pub(crate) const CAPACITY: usize = 16;

/// The matrix P with its forgetting factors.
#[derive(Debug, Clone)]
pub(crate) struct Forgetting {
    covariance: Box<Covariance<CAPACITY>>,
    start: Box<Covariance<CAPACITY>>,
}

impl State for Forgetting {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut *self.covariance, &mut *self.start], each);
    }
}

impl Forgetting {
    /// Creates the matrix from its initial value, stored by rows, and a forgetting factor in (0, 1] for each parameter.
    /// `None` if P is not positive definite or there are more parameters than the capacity.
    pub fn new(start: &[f64], lambda: &[f64]) -> Option<Self> {
        let p = lambda.len();
        let mut matrix = [[0.0; CAPACITY]; CAPACITY];
        let mut factors = [1.0; CAPACITY];
        for (i, l) in lambda.iter().enumerate() {
            *factors.get_mut(i)? = *l;
            matrix[i][..p].copy_from_slice(&start[i * p..(i + 1) * p]);
        }
        Some(Self::of(UdCovariance::from_matrix(&matrix)?, factors))
    }

    /// Creates the matrix as a multiple of the unit matrix, with one forgetting factor for all parameters.
    pub fn diagonal(size: f64, lambda: f64) -> Self {
        Self::of(UdCovariance::diagonal([size; CAPACITY]), [lambda; CAPACITY])
    }

    fn of(factors: UdCovariance<CAPACITY>, lambda: [f64; CAPACITY]) -> Self {
        let matrix = factors.matrix();
        let bound = std::array::from_fn(|i| VARIANCE_GROWTH_WITHOUT_FIT * matrix[i][i]);
        let covariance = Box::new(Covariance::new(factors, Rule::Exponential { lambda }, bound));
        Self {
            start: covariance.clone(),
            covariance,
        }
    }

    /// Updates P with forgetting and the vector z, and writes the gain.
    pub fn gain(&mut self, z: &[f64], gain: &mut [f64]) {
        let mut padded = [0.0; CAPACITY];
        padded[..z.len()].copy_from_slice(z);
        let moved = self.covariance.update(&padded, 0.0, &[0.0; CAPACITY], 0.0);
        gain.copy_from_slice(&moved.gain[..z.len()]);
        if !self.covariance.is_valid() || gain.iter().any(|g| !g.is_finite()) {
            self.covariance.clone_from(&self.start);
            gain.fill(0.0);
        }
    }
}
