//! The recursion: filters for the signals, followed by the bank of hypotheses.
//!
//! A sample passes through the [`Response`] to the held error, the whitening filter D and the ring buffer of delayed
//! signals to the [`Bank`]. At regular intervals the linearisation point of the response is moved toward the estimate.

use super::{
    bank::Bank,
    hypothesis::{self, Hypothesis, OVERFLOW_LIMIT},
    prior::ChangePrior,
    response::{Response, Signals},
    signal_ring::{DelayedSignals, SignalRing},
};
use hoid_core::{bounds::clamp, recursion::Step};

/// Number of samples between two moves of the linearisation point.
const RELINEARISATION_INTERVAL: u64 = 64;
/// Largest relative move of the linearisation point; the states of the filters are moved to first order only.
const MAX_RELATIVE_MOVE: f64 = 0.1;

/// The recursion. M is the largest number of hypotheses, D the largest order of the noise model, and B the memory for
/// the signals of all delays.
#[derive(Debug, Clone, PartialEq)]
pub struct MultipleModelFilter<const M: usize, const D: usize, B = [Signals; 1]> {
    bank: Bank<M>,
    response: Response,
    ring: SignalRing<B>,
    /// Coefficients of D without the leading 1; `order` is their number.
    d: [f64; D],
    order: usize,
    /// Past values of u and of the signals, with the newest first.
    u: [f64; D],
    past: [Signals; D],
    restarts: u64,
}

hoid_core::state!([const M: usize, const D: usize, B: AsMut<[Signals]>] MultipleModelFilter<M, D, B> {
    bank, response, ring, d, order, u, past, restarts,
}, bounded);

impl<const M: usize, const D: usize, B> MultipleModelFilter<M, D, B> {
    fn bounded(&mut self) {
        self.order = self.order.min(D);
    }
}

impl<const M: usize, const D: usize> MultipleModelFilter<M, D> {
    /// Creates the filter with one hypothesis, at rest and for a known delay. `None` if the order of the noise model
    /// exceeds D or if [`Bank::new`] returns `None`.
    pub fn new(first: Hypothesis, d: &[f64], prior: ChangePrior) -> Option<Self> {
        Self::with_delays(first, d, prior, [[0.0; 6]; 1])
    }
}

impl<const M: usize, const D: usize, B: AsRef<[Signals]> + AsMut<[Signals]>> MultipleModelFilter<M, D, B> {
    /// As [`MultipleModelFilter::new`], with several candidate delays. It also returns `None` if the size of the memory
    /// differs from [`DelayPrior::count`](super::prior::DelayPrior::count).
    pub fn with_delays(first: Hypothesis, d: &[f64], prior: ChangePrior, memory: B) -> Option<Self> {
        let ring = SignalRing::new(memory);
        if d.len() > D || ring.delay_count() != prior.delay.count {
            return None;
        }
        let mut padded = [0.0; D];
        padded[..d.len()].copy_from_slice(d);
        let point = [first.eta[2], first.eta[3]];
        Some(Self {
            bank: Bank::new(first, prior)?,
            response: Response::new(point, prior.sample_time),
            ring,
            d: padded,
            order: d.len(),
            u: [0.0; D],
            past: [[0.0; 6]; D],
            restarts: 0,
        })
    }

    /// Processes a sample `x(t) = e(t - nk)`, `u(t)`, where nk is the shortest delay. Both values must be finite.
    pub fn step(&mut self, x: f64, u: f64) -> Step {
        let signals = self.response.step(x);
        let (y, r) = self.whiten(u, &signals);
        let finite = y.abs() < OVERFLOW_LIMIT && r.iter().all(|r| r.abs() < OVERFLOW_LIMIT);
        self.ring.push(if finite { r } else { [0.0; 6] });
        let sample = finite.then_some((y, self.ring.newest()));
        let innovation = self.bank.update(sample, self.response.point());
        self.store(u, signals);
        Step {
            innovation,
            shortened: !finite,
        }
    }

    /// As [`MultipleModelFilter::step`], but only the filters are updated; the estimate stays constant.
    pub fn step_without_update(&mut self, x: f64, u: f64) -> Step {
        self.bank.skip_sample();
        let signals = self.response.step(x);
        let (y, r) = self.whiten(u, &signals);
        self.ring.push(r);
        let innovation = y - self.prediction(self.ring.newest());
        self.store(u, signals);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`MultipleModelFilter::step_without_update`] for a missing output, which the one-step prediction replaces.
    pub fn bridge(&mut self, x: f64) {
        self.bank.skip_sample();
        let signals = self.response.step(x);
        let (y, r) = self.whiten(0.0, &signals);
        self.ring.push(r);
        let u = self.prediction(self.ring.newest()) - y;
        self.store(u, signals);
    }

    /// Returns `D u` and the signals filtered by D.
    #[inline(always)]
    fn whiten(&self, u: f64, signals: &Signals) -> (f64, Signals) {
        let (mut y, mut r) = (u, *signals);
        for j in 0..self.order {
            let d = self.d[j];
            y += d * self.u[j];
            for i in 0..6 {
                r[i] += d * self.past[j][i];
            }
        }
        (y, r)
    }

    /// Returns the prediction of `D u`, with the mean parameters of the mixture and the likeliest delay.
    fn prediction(&self, signals: DelayedSignals<'_>) -> f64 {
        let eta = self.bank.mixture().eta;
        let r = signals.at(self.bank.most_likely_delay());
        let psi = hypothesis::gradient(&eta, r, self.response.point());
        eta[0] * psi[0] + eta[1] * psi[1]
    }

    /// Stores a sample in the histories, and at regular intervals moves the linearisation point toward the estimate.
    fn store(&mut self, u: f64, signals: Signals) {
        if !(u.abs() < OVERFLOW_LIMIT && signals.iter().all(|s| s.abs() < OVERFLOW_LIMIT)) {
            self.response.reset();
            self.u = [0.0; D];
            self.past = [[0.0; 6]; D];
            self.ring.iter_mut().for_each(|signals| *signals = [0.0; 6]);
            self.restarts += 1;
            return;
        }
        if self.order > 0 {
            self.u.copy_within(0..self.order - 1, 1);
            self.past.copy_within(0..self.order - 1, 1);
            self.u[0] = u;
            self.past[0] = signals;
        }
        if self.bank.sample_count().is_multiple_of(RELINEARISATION_INTERVAL) {
            let [.., omega, zeta] = self.bank.mixture().eta;
            let point = self.response.point();
            let toward =
                |to: f64, from: f64| clamp(to, [(1.0 - MAX_RELATIVE_MOVE) * from, (1.0 + MAX_RELATIVE_MOVE) * from]);
            let moved = [toward(omega, point[0]), toward(zeta, point[1])];
            self.response
                .move_to(moved, self.past.iter_mut().chain(self.ring.iter_mut()));
        }
    }

    /// Returns the hypotheses with their probabilities.
    pub fn bank(&self) -> &Bank<M> {
        &self.bank
    }

    /// Returns the coefficients of D without the leading 1.
    pub fn d(&self) -> &[f64] {
        &self.d[..self.order]
    }

    /// Returns the number of overflows after which the filters were reset.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}
