//! Recursive least squares for ARX and FIR models.
//!
//! `eps = u - psi' theta`, `psi = [-u(t-1) .. -u(t-na), x(t) .. x(t-nb+1)]` with
//! `x(t) = e(t - nk)`, and the step of an [`Adaptation`] (eq. 5.21, 5.25, 5.26; L. Ljung and T.
//! Söderström, *Theory and Practice of Recursive Identification*, 1983, section 2.2).

use hoid_numerics::products::dot;

use crate::{
    adaptation::Adaptation,
    error_bars::{ErrorBars, ErrorPropagation},
    recursion::{Step, all_finite, ratio},
    sensitivities::{ErrorLayout, Sensitivities},
    shape::Shape,
};

/// Recursive least squares. N is the capacity for parameters, A the adaptation, and B the error bars or
/// [`NoErrorBars`](crate::error_bars::NoErrorBars).
#[derive(Debug, Clone, PartialEq)]
#[repr(align(64))]
pub struct Rls<S, const N: usize, A, B = ErrorBars<N, 0>> {
    shape: S,
    theta: [f64; N],
    psi: [f64; N],
    adaptation: A,
    bars: B,
    restarts: u64,
}

crate::state!([S, const N: usize, A: crate::state::State, B: crate::state::State] Rls<S, N, A, B> { theta, psi, adaptation, bars, restarts });

impl<S: Shape, const N: usize, A: Adaptation<N>, B: ErrorPropagation<N, 0>> Rls<S, N, A, B> {
    /// Starts from theta `[a.., b..]` with zeros before the first sample. Returns `None` if there is no parameter, if
    /// there are more than N parameters, if C, D or F has parameters, or if the forgetting rule needs the innovation
    /// variance but `bars` does not estimate it.
    pub fn new(shape: S, theta: [f64; N], adaptation: A, bars: B) -> Option<Self> {
        let linear = (shape.nc(), shape.nd(), shape.nf()) == (0, 0, 0);
        let known = bars.variance().is_some() || !adaptation.needs_innovation_variance();
        (linear && known && (1..=N).contains(&shape.parameter_count())).then_some(Self {
            shape,
            theta,
            psi: [0.0; N],
            adaptation,
            bars,
            restarts: 0,
        })
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)`. x and u must be finite.
    #[inline]
    pub fn step(&mut self, x: f64, u: f64) -> Step {
        // The state is read once, processed in local variables and written once.
        let theta = self.theta;
        let (psi, innovation) = self.innovation(&theta, x, u);
        // The clipped innovation limits the step that an outlier causes.
        let limited = self.bars.clip(innovation);
        let moved = self
            .adaptation
            .update(&psi, limited, &theta, self.bars.variance().unwrap_or(0.0));
        let theta: [f64; N] = core::array::from_fn(|i| theta[i] + moved.step[i]);
        let sound = all_finite(&theta);
        if sound {
            self.theta = theta;
            // theta changed by g eps_limited = (eps_limited/eps) g eps, so the error bars use the gain
            // (eps_limited/eps) g.
            let used = ratio(limited, innovation);
            let gain = moved.gain.map(|g| used * g);
            self.bars.update(
                &ErrorLayout::NO_FILTER_ERRORS,
                &Sensitivities::from_gradient(&psi),
                &gain,
                innovation,
            );
            self.adaptation.add_drift_to(&mut self.bars);
            self.shift(psi, u);
        // The regressor is reset, since a number that is not finite would stay in it for max(na, nb) samples.
        } else {
            self.psi = [0.0; N];
            self.restarts += 1;
        }
        Step {
            innovation,
            shortened: !sound,
        }
    }

    /// Like [`Rls::step`], but the estimate stays constant and only the regressor is advanced.
    pub fn step_without_update(&mut self, x: f64, u: f64) -> Step {
        let (psi, innovation) = self.innovation(&self.theta, x, u);
        self.shift(psi, u);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// Like [`Rls::step_without_update`], for a sample without u; the one-step prediction replaces the missing output.
    pub fn bridge(&mut self, x: f64) {
        let (psi, innovation) = self.innovation(&self.theta, x, 0.0);
        // With u = 0 the innovation is minus the one-step prediction, which replaces the missing output.
        self.shift(psi, -innovation);
    }

    /// Returns psi, including the new input x, and the innovation.
    #[inline(always)]
    fn innovation(&self, theta: &[f64; N], x: f64, u: f64) -> ([f64; N], f64) {
        let (na, nb) = (self.shape.na(), self.shape.nb());
        // Each number is read separately, since a wide load right after the narrow stores of the previous sample would
        // have to wait for the memory.
        let mut psi = self.psi.map(core::hint::black_box);
        for j in (1..nb).rev() {
            psi[na + j] = psi[na + j - 1];
        }
        if nb > 0 {
            psi[na] = x;
        }
        let w = dot(&theta[na..na + nb], &psi[na..]);
        // The result is bit-identical to the predictor of the general model, which stores u itself.
        (psi, u - dot(&theta[..na], &psi) - w)
    }

    #[inline(always)]
    fn shift(&mut self, mut psi: [f64; N], u: f64) {
        let na = self.shape.na();
        for j in (1..na).rev() {
            psi[j] = psi[j - 1];
        }
        if na > 0 {
            psi[0] = -u;
        }
        self.psi = psi;
    }

    /// Returns the estimate theta.
    pub fn theta(&self) -> &[f64; N] {
        &self.theta
    }

    /// Returns the adaptation, which contains the covariance.
    pub fn adaptation(&self) -> &A {
        &self.adaptation
    }

    /// Returns the adaptation for modification by the caller.
    pub fn adaptation_mut(&mut self) -> &mut A {
        &mut self.adaptation
    }

    /// Returns the number of restarts: steps that were not finite, after which the regressor was reset.
    pub fn restart_count(&self) -> u64 {
        self.restarts
    }
}

impl<S: Shape, const N: usize, A: Adaptation<N>> Rls<S, N, A> {
    /// Returns the covariance of theta divided by sigma^2.
    pub fn normalised_covariance(&self) -> [[f64; N]; N] {
        self.adaptation.normalised_covariance(&self.bars)
    }

    /// Returns the innovation variance sigma^2.
    pub fn innovation_variance(&self) -> f64 {
        self.bars.innovation_variance()
    }
}
