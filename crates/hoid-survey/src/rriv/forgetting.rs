//! The gain for a vector of instruments: the covariance of the kernel ([`hoid_core::adaptation`]) with z in place of
//! psi.
//!
//! The covariance of the kernel is that of a recursion with the gradient z; whether its innovation is that of a
//! gradient or of instruments does not affect the gain. If rounding makes it invalid, as after a jump of the scale by
//! 1e8 or more, it restarts.

use hoid_core::state::{State, visit_all};
use hoid_core::{
    adaptation::{Adaptation, Forgetting as Rule},
    covariance::Covariance,
    ud_covariance::UdCovariance,
};

use hoid_track::building::ROOM_WITHOUT_FIT;

/// Capacity for parameters.
pub(crate) const ROOM: usize = 16;

/// P, and its forgetting.
#[derive(Debug, Clone)]
pub(crate) struct Forgetting {
    covariance: Box<Covariance<ROOM>>,
    start: Box<Covariance<ROOM>>,
}

impl State for Forgetting {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut *self.covariance, &mut *self.start], each);
    }
}

impl Forgetting {
    /// Starts from P by rows, and a factor in (0, 1] for each parameter. `None` if P is not positive, or exceeds the
    /// capacity.
    pub fn new(start: &[f64], lambda: &[f64]) -> Option<Self> {
        let p = lambda.len();
        let mut matrix = [[0.0; ROOM]; ROOM];
        let mut factors = [1.0; ROOM];
        for (i, l) in lambda.iter().enumerate() {
            *factors.get_mut(i)? = *l;
            matrix[i][..p].copy_from_slice(&start[i * p..(i + 1) * p]);
        }
        Some(Self::of(UdCovariance::from_matrix(&matrix)?, factors))
    }

    /// Starts from a multiple of the unit matrix, with one factor for all.
    pub fn diagonal(size: f64, lambda: f64) -> Self {
        Self::of(UdCovariance::diagonal([size; ROOM]), [lambda; ROOM])
    }

    fn of(factors: UdCovariance<ROOM>, lambda: [f64; ROOM]) -> Self {
        let matrix = factors.matrix();
        let bound = std::array::from_fn(|i| ROOM_WITHOUT_FIT * matrix[i][i]);
        let covariance = Box::new(Covariance::new(factors, Rule::Exponential { lambda }, bound));
        Self {
            start: covariance.clone(),
            covariance,
        }
    }

    /// Forgets, takes z, and writes the gain.
    pub fn gain(&mut self, z: &[f64], gain: &mut [f64]) {
        let mut padded = [0.0; ROOM];
        padded[..z.len()].copy_from_slice(z);
        let moved = self.covariance.update(&padded, 0.0, &[0.0; ROOM], 0.0);
        gain.copy_from_slice(&moved.gain[..z.len()]);
        if !self.covariance.is_valid() || gain.iter().any(|g| !g.is_finite()) {
            self.covariance.clone_from(&self.start);
            gain.fill(0.0);
        }
    }
}
