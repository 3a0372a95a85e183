//! Reported estimate of a recursion in physical parameters with a fixed noise model: the polynomials of the exact hold
//! and the operator.

use hoid_core::{
    state::{State, visit_all},
    zoh_operator::zoh_operator,
};
use hoid_model::{
    SampleTime,
    uncertainty::{Estimate, OperatorEstimate},
};

use crate::start::StartState;

/// Number of parameters of the operator with a known delay: K_e, K_e_dot, omega_nm and zeta_nm.
pub const OPERATOR_PARAMETER_COUNT: usize = 4;

/// Coefficients `[b0, b1, d.., f1, f2]` with the Jacobian of b and f with respect to the parameters of the operator,
/// and the covariance of d, which does not change after the start fit.
#[derive(Debug, Clone, PartialEq)]
pub struct ReportedModel {
    sample_time_s: f64,
    tau_s: f64,
    theta: Vec<f64>,
    of_d: Vec<f64>,
    by: [[f64; OPERATOR_PARAMETER_COUNT]; OPERATOR_PARAMETER_COUNT],
}

impl State for ReportedModel {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(&mut [&mut self.theta.as_mut_slice(), &mut self.by], each);
    }
}

impl ReportedModel {
    /// Builds the reported estimate from a start in physical parameters, `[K_e, K_e_dot, omega_nm, zeta_nm, d..]`.
    pub fn new(from: &StartState, nk: usize, sample_time: SampleTime) -> Self {
        let p = from.values.len();
        let (nd, ts) = (p - OPERATOR_PARAMETER_COUNT, sample_time.s());
        let element = |i: usize, j: usize| {
            from.variance * from.spread[(OPERATOR_PARAMETER_COUNT + i) * p + OPERATOR_PARAMETER_COUNT + j]
        };
        let mut theta = vec![0.0; p];
        theta[2..p - 2].copy_from_slice(&from.values[OPERATOR_PARAMETER_COUNT..]);
        let mut reported = Self {
            sample_time_s: ts,
            tau_s: (nk as f64 - 1.0) * ts,
            theta,
            of_d: (0..nd * nd).map(|k| element(k / nd, k % nd)).collect(),
            by: [[0.0; OPERATOR_PARAMETER_COUNT]; OPERATOR_PARAMETER_COUNT],
        };
        reported.set_operator(std::array::from_fn(|i| from.values[i]));
        reported
    }

    /// Sets K_e, K_e_dot, omega_nm and zeta_nm, from which the coefficients and the Jacobian follow.
    pub fn set_operator(&mut self, eta: [f64; OPERATOR_PARAMETER_COUNT]) {
        let (values, by) = zoh_operator(eta, self.sample_time_s);
        let p = self.theta.len();
        self.theta[..2].copy_from_slice(&values[..2]);
        self.theta[p - 2..].copy_from_slice(&values[2..]);
        self.by = by;
    }

    /// Sets the coefficients of the noise polynomial D; coefficients missing in `d` become zero.
    pub fn set_noise(&mut self, d: &[f64]) {
        let p = self.theta.len();
        for (i, place) in self.theta[2..p - 2].iter_mut().enumerate() {
            *place = d.get(i).copied().unwrap_or(0.0);
        }
    }

    /// Returns the sample time, s.
    pub fn sample_time_s(&self) -> f64 {
        self.sample_time_s
    }

    /// Returns the coefficients.
    pub fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Writes the covariance of the coefficients by rows: `J C J'` for the operator, and the covariance of d.
    pub fn covariance(&self, of_eta: &[[f64; OPERATOR_PARAMETER_COUNT]; OPERATOR_PARAMETER_COUNT], into: &mut [f64]) {
        let p = self.theta.len();
        let nd = p - OPERATOR_PARAMETER_COUNT;
        into.fill(0.0);
        let place = |k: usize| if k < 2 { k } else { nd + k };
        for i in 0..OPERATOR_PARAMETER_COUNT {
            for j in 0..OPERATOR_PARAMETER_COUNT {
                let mut sum = 0.0;
                for k in 0..OPERATOR_PARAMETER_COUNT {
                    for l in 0..OPERATOR_PARAMETER_COUNT {
                        sum += self.by[i][k] * of_eta[k][l] * self.by[j][l];
                    }
                }
                into[place(i) * p + place(j)] = sum;
            }
        }
        for i in 0..nd {
            into[(2 + i) * p + 2..(2 + i) * p + 2 + nd].copy_from_slice(&self.of_d[i * nd..(i + 1) * nd]);
        }
    }

    /// Replaces the covariance of d in `into` by the covariance of a tracked noise model.
    pub fn write_noise_covariance<const D: usize>(&self, of_d: &[[f64; D]; D], into: &mut [f64]) {
        let p = self.theta.len();
        let nd = p - OPERATOR_PARAMETER_COUNT;
        for (i, row) in of_d.iter().enumerate().take(nd) {
            let shown = nd.min(D);
            into[(2 + i) * p + 2..(2 + i) * p + 2 + shown].copy_from_slice(&row[..shown]);
        }
    }

    /// Returns the operator with the covariance of eta; `lead` is T_L in s, `variance` its variance.
    pub fn operator(
        &self,
        eta: [f64; OPERATOR_PARAMETER_COUNT],
        covariance: &[[f64; OPERATOR_PARAMETER_COUNT]; OPERATOR_PARAMETER_COUNT],
        [lead, variance]: [f64; 2],
    ) -> OperatorEstimate {
        let estimate = |i: usize| Estimate::with_variance(eta[i], covariance[i][i]);
        OperatorEstimate {
            k_e: estimate(0),
            t_l_s: Estimate::with_variance(lead, variance),
            k_e_dot: estimate(1),
            omega_nm_rad_s: estimate(2),
            zeta_nm: estimate(3),
            tau_e_s: Estimate::fixed(self.tau_s),
        }
    }
}
