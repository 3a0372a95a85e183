//! Step of a recursive estimate, computed from the gradient and the innovation.
//!
//! A recursion with the negative gradient psi and the innovation eps changes its estimate by `g eps`. The gain of the
//! prediction-error method is `g = P psi/(1 + psi' P psi)`, `P <- P - g psi' P` (eq. 5.26, 31; L. Ljung and T.
//! Söderström, *Theory and Practice of Recursive Identification*, 1983, section 3.4), with P in units of the innovation
//! variance. Before this update, forgetting increases P:
//!
//! | forgetting rule | P | source |
//! |---|---|---|
//! | [`Forgetting::Exponential`] | `Lambda P Lambda`, `Lambda = diag(lambda_i)^{-1/2}`; equal lambda_i give the scalar forgetting factor | eq. 5.26 |
//! | [`Forgetting::RandomWalk`] | `P + Q`: Kalman filter for drifting parameters | Ljung and Söderström, eq. 2.104 |
//! | [`Forgetting::Variable`] | after the measurement, `P/lambda(t)`, `lambda = 1 - eps^2/((1 + psi' P psi) N_0 sigma^2)`, which keeps the weighted sum of squares constant | T. R. Fortescue, L. S. Kershenbaum and B. E. Ydstie, *Automatica* 17 (1981) 831-835 |
//! | [`Forgetting::Directional`] | forgets along psi only: measurement with `R = 1/beta`, `beta = lambda - (1 - lambda)/(psi' P psi)` | R. Kulhavý, *Automatica* 23 (1987) 589-600 |
//! | [`Forgetting::Gradient`] | no P: `g = gamma psi/(c + psi' psi)`, where c is a hundredth of the largest mean power of psi so far | Ljung and Söderström, section 3.5 |
//!
//! [`crate::covariance`] implements these rules. A rectangular window is a separate adaptation, [`crate::window`].
//! [`crate::error_bars`] computes the uncertainty of an estimate for the gain of any rule.

use crate::error_bars::{ErrorBars, ErrorPropagation};

/// Rule by which the weight of old information decays.
#[derive(Debug, Clone, PartialEq)]
pub enum Forgetting<const N: usize> {
    /// One factor `0 < lambda_i <= 1` for each parameter. Equal factors give scalar forgetting; factors of 1 give an
    /// infinite memory.
    Exponential {
        /// Forgetting factor of each parameter.
        lambda: [f64; N],
    },
    /// Random walk of the parameters. The variance of the drift per sample is relative to the innovation variance.
    RandomWalk {
        /// Diagonal of Q.
        drift: [f64; N],
    },
    /// Scalar factor that decreases if the innovations are larger than expected from their variance.
    Variable {
        /// Memory length N_0 in samples while the innovations have the expected variance.
        memory: f64,
        /// Lower limit of the forgetting factor.
        smallest: f64,
    },
    /// Scalar factor that acts along psi only.
    Directional {
        /// Forgetting factor.
        lambda: f64,
    },
    /// Normalised gradient method without P.
    Gradient {
        /// Factor gamma, between 0 and 2; 1 gives the step that would reduce the innovation to zero.
        rate: f64,
    },
}

/// Change in the estimate caused by one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterStep<const N: usize> {
    /// Change in theta.
    pub step: [f64; N],
    /// Gain g. `step = g eps`, except with a rectangular window.
    pub gain: [f64; N],
}

impl<const N: usize> ParameterStep<N> {
    /// Step of zero, at which the estimate stays constant.
    pub(crate) const ZERO: Self = Self {
        step: [0.0; N],
        gain: [0.0; N],
    };
}

/// Adaptation rule, which converts gradients into steps: [`crate::covariance::Covariance`] or
/// [`crate::window::Window`].
pub trait Adaptation<const N: usize> {
    /// Returns the step for the gradient psi and the innovation eps at theta. `variance` is sigma^2, or zero if sigma^2
    /// is unknown.
    fn update(&mut self, psi: &[f64; N], eps: f64, theta: &[f64; N], variance: f64) -> ParameterStep<N>;
    /// Returns the covariance of theta divided by sigma^2 if the adaptation itself computes it, without [`ErrorBars`];
    /// otherwise `None`.
    fn own_covariance(&self) -> Option<[[f64; N]; N]> {
        None
    }
    /// Adds to the error bars the parameter drift that the forgetting rule assumes for one sample.
    fn add_drift_to<const K: usize, B: ErrorPropagation<N, K>>(&self, _bars: &mut B) {}
    /// True if the step depends on sigma^2.
    fn needs_innovation_variance(&self) -> bool {
        false
    }
    /// Returns the covariance of theta divided by sigma^2, from the adaptation itself or from the error bars.
    fn normalised_covariance<const K: usize>(&self, bars: &ErrorBars<N, K>) -> [[f64; N]; N] {
        self.own_covariance().unwrap_or_else(|| bars.normalised_covariance())
    }
    /// True if all numbers of the adaptation are finite.
    fn is_valid(&self) -> bool;
}
