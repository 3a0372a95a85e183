//! Recursive least squares for ARX and FIR.
//!
//! `eps = u - psi' theta`, `psi = [-u(t-1) .. -u(t-na), x(t) .. x(t-nb+1)]` with `x(t) = e(t - nk)`, and the step of an
//! [`Adaptation`] (eq. 5.21, 5.25, 5.26; L. Ljung and T. Söderström, *Theory and Practice of Recursive Identification*, 1983, section 2.2).

use crate::{
    adaptation::Adaptation,
    error_bars::{ErrorBars, Places, Sensitivities},
    predictor::Shape,
    recursion::{Step, share},
};

/// The recursion. N is the room for parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Rls<S, const N: usize, A> {
    shape: S,
    theta: [f64; N],
    psi: [f64; N],
    adaptation: A,
    bars: ErrorBars<N, 0>,
    restarts: u64,
}

crate::state!([S, const N: usize, A: crate::state::State] Rls<S, N, A> { theta, psi, adaptation, bars, restarts });

impl<S: Shape, const N: usize, A: Adaptation<N>> Rls<S, N, A> {
    /// Starts from theta `[a.., b..]` with zeros before the first sample. `None` when there is no parameter, more than N, or one of
    /// C, D or F.
    pub fn new(shape: S, theta: [f64; N], adaptation: A, bars: ErrorBars<N, 0>) -> Option<Self> {
        let linear = (shape.nc(), shape.nd(), shape.nf()) == (0, 0, 0);
        (linear && (1..=N).contains(&shape.parameters())).then_some(Self {
            shape,
            theta,
            psi: [0.0; N],
            adaptation,
            bars,
            restarts: 0,
        })
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)`. Both must be finite.
    #[inline]
    pub fn step(&mut self, x: f64, u: f64) -> Step {
        let innovation = self.innovation(x, u);
        let limited = self.bars.limited(innovation);
        let moved = self
            .adaptation
            .advance(&self.psi, limited, &self.theta, self.bars.variance());
        let theta: [f64; N] = core::array::from_fn(|i| self.theta[i] + moved.step[i]);
        let sound = theta.iter().all(|t| t.is_finite());
        if sound {
            self.theta = theta;
            let used = share(limited, innovation);
            let gain = moved.gain.map(|g| used * g);
            self.bars
                .take(&Places::NONE, &Sensitivities::of_gradient(&self.psi), &gain, innovation);
            self.adaptation.drift_into(&mut self.bars);
            self.shift(u);
        } else {
            self.psi = [0.0; N];
            self.restarts += 1;
        }
        Step {
            innovation,
            shortened: !sound,
        }
    }

    /// Takes a sample into the regressor alone; the estimate stays.
    pub fn follow(&mut self, x: f64, u: f64) -> Step {
        let innovation = self.innovation(x, u);
        self.shift(u);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`Rls::follow`] where the output is missing: the one-step prediction takes its place.
    pub fn bridge(&mut self, x: f64) {
        let prediction = -self.innovation(x, 0.0);
        self.shift(prediction);
    }

    #[inline(always)]
    fn innovation(&mut self, x: f64, u: f64) -> f64 {
        let (na, nb) = (self.shape.na(), self.shape.nb());
        // Through a copy: psi is then written as a whole, as it will be read.
        let mut psi = self.psi;
        if nb > 0 {
            psi[na..na + nb].copy_within(0..nb - 1, 1);
            psi[na] = x;
        }
        self.psi = psi;
        let (of_a, of_b) = psi.split_at(na);
        let (a, b) = self.theta.split_at(na);
        let mut w = 0.0;
        for (b, x) in b[..nb].iter().zip(of_b) {
            w += b * x;
        }
        let mut from_past = 0.0;
        for (a, minus_u) in a.iter().zip(of_a) {
            from_past += a * -minus_u;
        }
        u + from_past - w
    }

    #[inline(always)]
    fn shift(&mut self, u: f64) {
        let na = self.shape.na();
        if na > 0 {
            let mut psi = self.psi;
            psi[..na].copy_within(0..na - 1, 1);
            psi[0] = -u;
            self.psi = psi;
        }
    }

    /// theta.
    pub fn theta(&self) -> &[f64; N] {
        &self.theta
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

    /// How often a step was not finite and the regressor was brought to rest.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}
