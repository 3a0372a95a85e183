//! The recursive prediction-error method for `A u = (B/F) q^-nk e + (C/D) eps`: ARX, ARMAX, OE, ARARX, Box-Jenkins and the general form.
//!
//! `theta <- theta + g eps` with psi and eps of [`crate::predictor`] and the gain of an [`Adaptation`] (eq. 31, 5.54; L. Ljung and
//! T. Söderström, *Theory and Practice of Recursive Identification*, 1983, section 3.7). A step that would take C or F out of the
//! stable region is halved until it does not. Without C, D and F this is recursive least squares, [`crate::rls`], to the last bit.

use crate::{
    adaptation::Adaptation,
    error_bars::{ErrorBars, Places, Sensitivities},
    predictor::{Predictor, Regressor, Shape},
    recursion::{Stable, Step, allowed_share, share},
};

/// The recursion. N is the room for parameters, K that for the errors of its filters ([`Places::filters`]), or 0
/// for the usual error bars.
#[derive(Debug, Clone, PartialEq)]
pub struct Rpem<S, const N: usize, const K: usize, A> {
    predictor: Predictor<S, N, N>,
    theta: [f64; N],
    psi: [f64; N],
    adaptation: A,
    bars: ErrorBars<N, K>,
    stable: Stable,
    restarts: u64,
}

crate::state!([S, const N: usize, const K: usize, A: crate::state::State] Rpem<S, N, K, A> {
    predictor, theta, psi, adaptation, bars, restarts,
});

impl<S: Shape, const N: usize, const K: usize, A: Adaptation<N>> Rpem<S, N, K, A> {
    /// Starts from `theta = [a.. b.. c.. d.. f..]` with filters at rest. `None` when the shape does not fit in N and K, or
    /// theta is not stable.
    pub fn new(
        shape: S,
        regressor: Regressor,
        stable: Stable,
        theta: [f64; N],
        adaptation: A,
        bars: ErrorBars<N, K>,
    ) -> Option<Self> {
        let predictor = Predictor::new(shape, regressor)?;
        let usable = stable.holds(&shape, &theta) && Places::within::<S, K>(&shape).filters() <= K;
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

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)`. Both must be finite.
    #[inline]
    pub fn step(&mut self, x: f64, u: f64) -> Step {
        let shape = self.predictor.shape();
        let innovation = self.predictor.predict(&self.theta, x, u, &mut self.psi);
        let (places, rows) = self.sensitivities();
        let limited = self.bars.limited(innovation);
        let used = share(limited, innovation);
        let moved = self
            .adaptation
            .advance(&self.psi, limited, &self.theta, self.bars.variance());
        let (allowed, theta) = allowed_share(&self.theta, &moved.step, |theta| self.stable.holds(&shape, theta));
        self.theta = theta;
        let gain = moved.gain.map(|g| allowed * used * g);
        self.bars.take(&places, &rows, &gain, innovation);
        self.adaptation.drift_into(&mut self.bars);
        self.correct();
        Step {
            innovation,
            shortened: allowed < 1.0,
        }
    }

    /// Takes a sample into the filters alone; the estimate stays.
    pub fn follow(&mut self, x: f64, u: f64) -> Step {
        let innovation = self.predictor.predict(&self.theta, x, u, &mut self.psi);
        self.follow_bars();
        self.correct();
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`Rpem::follow`] where the output is missing: the one-step prediction takes its place.
    pub fn bridge(&mut self, x: f64) {
        self.predictor.predict(&self.theta, x, 0.0, &mut self.psi);
        self.predictor.bridge(&self.theta);
        self.follow_bars();
        self.correct();
    }

    fn follow_bars(&mut self) {
        let (places, rows) = self.sensitivities();
        self.bars.follow(&places, &rows);
    }

    #[inline(always)]
    fn sensitivities(&self) -> (Places, Sensitivities<N, K>) {
        let places = Places::within::<S, K>(&self.predictor.shape());
        let rows = if K == 0 {
            Sensitivities::of_gradient(&self.psi)
        } else {
            self.predictor.sensitivities(&self.theta, &places)
        };
        (places, rows)
    }

    #[inline(always)]
    fn correct(&mut self) {
        if !self.predictor.correct(&self.theta).is_finite() {
            self.predictor.rest();
            self.restarts += 1;
        }
    }

    /// theta.
    pub fn theta(&self) -> &[f64; N] {
        &self.theta
    }

    /// psi of the last sample.
    pub fn psi(&self) -> &[f64; N] {
        &self.psi
    }

    /// The adaptation with its covariance.
    pub fn adaptation(&self) -> &A {
        &self.adaptation
    }

    /// Covariance of theta over sigma^2.
    pub fn spread(&self) -> [[f64; N]; N] {
        self.adaptation.spread_or(&self.bars)
    }

    /// Innovation variance sigma^2.
    pub fn innovation_variance(&self) -> f64 {
        self.bars.variance()
    }

    /// How often a signal overflowed and the filters were brought to rest.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}
