//! Recursive prediction-error method for `A u = (B/F) q^-nk e + (C/D) eps`: ARX, ARMAX, OE, ARARX, Box-Jenkins and
//! general models.
//!
//! The estimate is updated by `theta <- theta + g eps`, with psi and eps from [`crate::predictor`] and the gain of an
//! [`Adaptation`] (eq. 31, 5.54; L. Ljung and T. Söderström, *Theory and Practice of Recursive Identification*, 1983,
//! section 3.7). A step that would make C or F unstable is halved until both are stable. Without C, D and F the results
//! are bit-identical to recursive least squares, [`crate::rls`].

use crate::{
    adaptation::Adaptation,
    error_bars::{ErrorBars, ErrorPropagation},
    further_input::{FurtherInputs, NoFurtherInputs},
    predictor::{Predictor, Regressor},
    recursion::{StablePolynomials, Step, backtrack, ratio},
    sensitivities::{ErrorLayout, Sensitivities},
    shape::Shape,
};

/// Recursive prediction-error method, with further inputs I. N is the capacity for parameters and K the capacity for
/// filter errors ([`ErrorLayout::filter_error_count`]). K is 0 for the default error bars and for B =
/// [`NoErrorBars`](crate::error_bars::NoErrorBars).
#[derive(Debug, Clone, PartialEq)]
#[repr(align(64))]
pub struct Rpem<S, const N: usize, const K: usize, A, B = ErrorBars<N, K>, I = NoFurtherInputs> {
    predictor: Predictor<S, N, N, I>,
    theta: [f64; N],
    psi: [f64; N],
    adaptation: A,
    bars: B,
    stable: StablePolynomials,
    restarts: u64,
}

crate::state!([S, const N: usize, const K: usize, A: crate::state::State, B: crate::state::State, I: crate::state::State] Rpem<S, N, K, A, B, I> {
    predictor, theta, psi, adaptation, bars, restarts,
});

impl<S: Shape, const N: usize, const K: usize, A: Adaptation<N>, B: ErrorPropagation<N, K>> Rpem<S, N, K, A, B> {
    /// Starts from `theta = [a.. b.. c.. d.. f..]` with filters at rest. Returns `None` if the shape exceeds N or K, if
    /// theta is not stable, or if the forgetting rule needs the innovation variance but `bars` does not estimate it.
    pub fn new(
        shape: S,
        regressor: Regressor,
        stable: StablePolynomials,
        theta: [f64; N],
        adaptation: A,
        bars: B,
    ) -> Option<Self> {
        Self::with_further_inputs(shape, NoFurtherInputs, regressor, stable, theta, adaptation, bars)
    }
}

impl<S: Shape, const N: usize, const K: usize, A: Adaptation<N>, B: ErrorPropagation<N, K>, I: FurtherInputs<N>>
    Rpem<S, N, K, A, B, I>
{
    /// Like [`Rpem::new`], with further inputs, whose coefficients follow those of `[a.. b.. c.. d.. f..]`. The error
    /// bars of a model with further inputs have no filter errors, so the result is also `None` if K is not zero.
    pub fn with_further_inputs(
        shape: S,
        further: I,
        regressor: Regressor,
        stable: StablePolynomials,
        theta: [f64; N],
        adaptation: A,
        bars: B,
    ) -> Option<Self> {
        let (first, of_further) = (shape.parameter_count(), further.parameter_count());
        let fits = first + of_further <= N && (K == 0 || of_further == 0);
        let sound = fits && further.are_stable(&theta[first..]);
        let predictor = Predictor::with_further_inputs(shape, regressor, further).filter(|_| sound)?;
        let known = bars.variance().is_some() || !adaptation.needs_innovation_variance();
        let usable = known
            && stable.accepts(&shape, &theta)
            && ErrorLayout::for_capacity::<S, K>(&shape).filter_error_count() <= K;
        usable.then_some(Self {
            predictor,
            theta,
            psi: [0.0; N],
            adaptation,
            bars,
            stable,
            restarts: 0,
        })
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)`. x and u must be finite.
    #[inline]
    pub fn step(&mut self, x: f64, u: f64) -> Step {
        let shape = self.predictor.shape();
        // The state is read once, processed in local variables and written once.
        let theta = self.theta;
        let (psi, innovation) = self.predictor.predict(&theta, x, u);
        let (layout, rows) = self.sensitivities(&theta, &psi);
        let limited = self.bars.clip(innovation);
        let used = ratio(limited, innovation);
        let moved = self
            .adaptation
            .update(&psi, limited, &theta, self.bars.variance().unwrap_or(0.0));
        let stable = self.stable;
        // eps and psi are outputs of filters with the poles of C and F. If these poles are unstable, eps and psi
        // diverge, and with them the estimate (Ljung and Söderström 1983, section 3.7.3).
        let further = self.predictor.further_inputs();
        let (allowed, theta) = backtrack(&theta, &moved.step, |theta| {
            stable.accepts(&shape, theta) && further.are_stable(&theta[shape.parameter_count()..])
        });
        // The filters continue with the a-posteriori residuals of the new theta (Ljung and Söderström 1983, eq. 3.151).
        self.correct(&theta);
        (self.theta, self.psi) = (theta, psi);
        // The error bars use the gain that was applied: reduced by the factor `allowed` for stability and by `used` for
        // the limit on outliers.
        let gain = moved.gain.map(|g| allowed * used * g);
        self.bars.update(&layout, &rows, &gain, innovation);
        self.adaptation.add_drift_to(&mut self.bars);
        Step {
            innovation,
            shortened: allowed < 1.0,
        }
    }

    /// Like [`Rpem::step`], but the estimate stays constant and only the filters are advanced.
    pub fn step_without_update(&mut self, x: f64, u: f64) -> Step {
        let theta = self.theta;
        let (psi, innovation) = self.predictor.predict(&theta, x, u);
        self.psi = psi;
        self.propagate_error_bars();
        self.correct(&theta);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// Like [`Rpem::step_without_update`], for a sample without u; the one-step prediction replaces the missing output.
    pub fn bridge(&mut self, x: f64) {
        let theta = self.theta;
        (self.psi, _) = self.predictor.predict(&theta, x, 0.0);
        self.predictor.bridge(&theta);
        self.propagate_error_bars();
        self.correct(&theta);
    }

    fn propagate_error_bars(&mut self) {
        let (layout, rows) = self.sensitivities(&self.theta, &self.psi);
        self.bars.propagate(&layout, &rows);
    }

    #[inline(always)]
    fn sensitivities(&self, theta: &[f64; N], psi: &[f64; N]) -> (ErrorLayout, Sensitivities<N, K>) {
        let layout = ErrorLayout::for_capacity::<S, K>(&self.predictor.shape());
        let rows = if K == 0 {
            Sensitivities::from_gradient(psi)
        } else {
            self.predictor.sensitivities(theta, &layout)
        };
        (layout, rows)
    }

    #[inline(always)]
    fn correct(&mut self, theta: &[f64; N]) {
        if !self.predictor.correct(theta).is_finite() {
            self.predictor.reset();
            self.restarts += 1;
        }
    }

    /// Returns the further inputs, for the values of the next sample.
    pub fn further_inputs_mut(&mut self) -> &mut I {
        self.predictor.further_inputs_mut()
    }

    /// Returns the estimate theta.
    pub fn theta(&self) -> &[f64; N] {
        &self.theta
    }

    /// Returns psi of the last sample.
    pub fn psi(&self) -> &[f64; N] {
        &self.psi
    }

    /// Returns the adaptation, which contains the covariance.
    pub fn adaptation(&self) -> &A {
        &self.adaptation
    }

    /// Returns the adaptation for modification by the caller.
    pub fn adaptation_mut(&mut self) -> &mut A {
        &mut self.adaptation
    }

    /// Returns the number of overflows after which the filters were reset.
    pub fn restart_count(&self) -> u64 {
        self.restarts
    }
}

impl<S: Shape, const N: usize, const K: usize, A: Adaptation<N>, I: FurtherInputs<N>>
    Rpem<S, N, K, A, ErrorBars<N, K>, I>
{
    /// Returns the covariance of theta divided by sigma^2.
    pub fn normalised_covariance(&self) -> [[f64; N]; N] {
        self.adaptation.normalised_covariance(&self.bars)
    }

    /// Returns the innovation variance sigma^2.
    pub fn innovation_variance(&self) -> f64 {
        self.bars.innovation_variance()
    }
}
