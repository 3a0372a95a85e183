//! From the gradient and the innovation to the step of the estimate.
//!
//! A recursion with the negative gradient psi and the innovation eps moves by `g eps`. The gain is
//! that of the prediction-error method, `g = P psi/(1 + psi' P psi)`, `P <- P - g psi' P` (eq.
//! 5.26, 31; L. Ljung and T. Söderström, *Theory and Practice of Recursive Identification*, 1983,
//! section 3.4), with P in units of the innovation variance. Before that, P grows by forgetting:
//!
//! | way of forgetting | P | source |
//! |---|---|---|
//! | [`Forgetting::Exponential`] | `Lambda P Lambda`, `Lambda = diag(lambda_i)^{-1/2}`; equal entries are the scalar factor | eq. 5.26 |
//! | [`Forgetting::RandomWalk`] | `P + Q`: the Kalman filter of parameters that drift | Ljung and Söderström, eq. 2.104 |
//! | [`Forgetting::Variable`] | `P/lambda(t)`, `lambda = 1 - eps^2/((1 + psi' P psi) N_0 sigma^2)` after the measurement: the weighted sum of squares stays constant | T. R. Fortescue, L. S. Kershenbaum and B. E. Ydstie, *Automatica* 17 (1981) 831-835 |
//! | [`Forgetting::Directional`] | along psi only: measurement with `R = 1/beta`, `beta = lambda - (1 - lambda)/(psi' P psi)` | R. Kulhavý, *Automatica* 23 (1987) 589-600 |
//! | [`Forgetting::Gradient`] | none: `g = gamma psi/(c + psi' psi)`, c a hundredth of the largest mean power of psi so far | Ljung and Söderström, section 3.5 |
//!
//! [`crate::covariance`] implements these rules; a rectangular window is a separate adaptation,
//! [`crate::window`]. The uncertainty of an estimate with such a gain is in [`crate::error_bars`].

use crate::error_bars::{ErrorBars, ErrorPropagation};

/// Rule by which the weight of old information decays.
#[derive(Debug, Clone, PartialEq)]
pub enum Forgetting<const N: usize> {
    /// A factor `0 < lambda_i <= 1` for each parameter; all equal for the scalar factor, all 1 for an infinite memory.
    Exponential {
        /// The factors.
        lambda: [f64; N],
    },
    /// Variance by which each parameter drifts in a sample, over the innovation variance.
    RandomWalk {
        /// Diagonal of Q.
        drift: [f64; N],
    },
    /// A scalar factor that falls if the innovations are larger than expected from their variance.
    Variable {
        /// Memory N_0 in samples while the innovations have the expected variance.
        memory: f64,
        /// Smallest factor.
        smallest: f64,
    },
    /// A scalar factor that acts along psi only.
    Directional {
        /// The factor.
        lambda: f64,
    },
    /// Normalised gradient.
    Gradient {
        /// Factor gamma, between 0 and 2: 1 is the step that would bring the innovation to zero.
        rate: f64,
    },
}

/// The step for one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterStep<const N: usize> {
    /// The change of theta.
    pub step: [f64; N],
    /// The gain g; `step = g eps` except in a window.
    pub gain: [f64; N],
}

impl<const N: usize> ParameterStep<N> {
    /// No step: the estimate stays constant.
    pub(crate) const NONE: Self = Self {
        step: [0.0; N],
        gain: [0.0; N],
    };
}

/// An adaptation, which converts gradients into steps: [`crate::covariance::Covariance`] and
/// [`crate::window::Window`].
pub trait Adaptation<const N: usize> {
    /// Returns the step for psi and the innovation eps at theta. `variance` is sigma^2, zero if it is not known.
    fn update(&mut self, psi: &[f64; N], eps: f64, theta: &[f64; N], variance: f64) -> ParameterStep<N>;
    /// Returns the covariance of theta over sigma^2, for an adaptation that computes it without [`ErrorBars`].
    fn own_covariance(&self) -> Option<[[f64; N]; N]> {
        None
    }
    /// Adds the drift of the parameters in a sample to the error bars.
    fn add_drift_to<const K: usize, B: ErrorPropagation<N, K>>(&self, _bars: &mut B) {}
    /// True if the step depends on sigma^2.
    fn needs_innovation_variance(&self) -> bool {
        false
    }
    /// Returns the covariance of theta over sigma^2.
    fn normalised_covariance<const K: usize>(&self, bars: &ErrorBars<N, K>) -> [[f64; N]; N] {
        self.own_covariance().unwrap_or_else(|| bars.normalised_covariance())
    }
    /// True if all numbers are finite.
    fn is_valid(&self) -> bool;
}
