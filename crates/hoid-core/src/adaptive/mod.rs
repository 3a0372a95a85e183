//! A person who may have changed at any time: a bank of hypotheses, mixed by how well each foretells the output.
//!
//! The operator's gains stand in its output, `w = K_e x1 + K_e_dot x2`, where x1 and x2 are the responses of the neuromuscular system to the
//! delayed error and to its rate ([`response`]). Behind the whitening filter `D(q^-1)` of the noise the model is
//!
//! `D u = K_e D x1 + K_e_dot D x2 + eps`,
//!
//! linear in the gains whatever they do: a step of an estimate leaves nothing behind in a filter. omega_nm and zeta_nm enter through the derivatives
//! of x1 and x2 about a point that all hypotheses share and that follows the estimate. D is that of the start fit and stays.
//!
//! **A hypothesis** ([`hypothesis`]) says that the person last changed at its birth. It is a Kalman filter of
//! `eta = [K_e, K_e_dot, omega_nm, zeta_nm]` with an innovation variance of its own: beside a slow drift of the gains nothing changes
//! any more, so that its memory grows for as long as it lives. In its first seconds it drifts more, for what changed seldom stands still at once.
//! Every `spacing` samples one is born: a copy of the likeliest,
//! whose gains are opened by the covariance of a change that is to be expected, and whose innovation variance rests on few samples. It is
//! given the prior probability of a change in that time. With every few of them another is born in which omega_nm and zeta_nm are opened too. The probability of each is multiplied, at each sample, by the density that it
//! gave to the innovation. When there is no room, the least likely of those that have had time to prove themselves makes way.
//! (M. Basseville and I. V. Nikiforov, *Detection of Abrupt Changes*, 1993, section 7.2; P. Andersson, *International Journal of Control* 42 (1985) 1175-1193: adaptive
//! forgetting by multiple models; R. P. Adams and D. J. C. MacKay, *Bayesian online changepoint detection*, 2007.)
//!
//! **The estimate** is the mean of the mixture, its covariance that of the mixture, what the hypotheses disagree about included. T_L is
//! `E[K_e K_e_dot]/E[K_e^2]`, the T for which `E (K_e_dot - T K_e)^2` is least: it stays finite as K_e becomes zero.
//!
//! **The delay** ([`delays`]) is known, or one more thing on which hypotheses differ.
//!
//! **A change** ([`change`]) is seen in the odds of the hypotheses that were born within the last seconds against those that are older.

pub mod bank;
pub mod change;
pub mod delays;
pub mod hypothesis;
pub mod response;

use bank::Bank;
use delays::{ByDelay, Delays, Ring};
use hypothesis::{Hypothesis, LARGEST, OPERATOR};
use response::{Response, Signals};

use crate::recursion::Step;

/// What is supposed of a person. Times in samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Suppositions {
    /// Sample time in s.
    pub sample_time: f64,
    /// Least and largest value of K_e, K_e_dot, omega_nm and zeta_nm.
    pub bounds: [[f64; 2]; OPERATOR],
    /// Samples between two births.
    pub spacing: u32,
    /// Probability of a change in one sample.
    pub hazard: f64,
    /// Standard deviation of a change of K_e and of K_e_dot, in units of `g = sqrt(K_e^2 + omega^2 K_e_dot^2)` and `g/omega` at the crossover omega.
    pub jump: [f64; 2],
    /// The same for the drift of both gains in one sample.
    pub drift: f64,
    /// What K_e and K_e_dot drift in one sample just after a change, in the same units; for omega_nm and zeta_nm, where they changed, in those of
    /// [`Suppositions::neuromuscular`].
    pub unrest: [f64; OPERATOR],
    /// Time constant with which this becomes [`Suppositions::drift`], samples.
    pub unrest_for: f64,
    /// Standard deviation of a change of omega_nm and of zeta_nm, as shares of them.
    pub neuromuscular: [f64; 2],
    /// Births of hypotheses that the gains change, for one that omega_nm and zeta_nm change too; zero: never.
    pub whole_every: u32,
    /// Odds of a change of all four against one of the gains.
    pub whole_odds: f64,
    /// The crossover at which the two gains are compared, rad/s.
    pub crossover: f64,
    /// Residuals that the innovation variance rests on after a change.
    pub doubt: f64,
    /// Age in samples from which a hypothesis may be given up.
    pub protected: u64,
    /// Standard deviations beyond which an innovation counts as one at that limit.
    pub limit: f64,
    /// Age of a hypothesis in samples up to which it stands for a change.
    pub recent: u64,
    /// Age in samples from which a hypothesis can say what changed.
    pub settled: u64,
    /// Logarithm of the odds from which a change is declared.
    pub threshold: f64,
    /// The delay.
    pub delays: Delays,
}

/// The bank behind its filters. M is the room for hypotheses, D the largest order of the noise model, B the memory for as many signals as there are
/// delays.
#[derive(Debug, Clone, PartialEq)]
pub struct Adaptive<const M: usize, const D: usize, B = [Signals; 1]> {
    bank: Bank<M>,
    response: Response,
    ring: Ring<B>,
    /// D, its order, and the past of u and of the signals, newest first.
    d: [f64; D],
    order: usize,
    u: [f64; D],
    past: [Signals; D],
    restarts: u64,
}

crate::state!([const M: usize, const D: usize, B: AsMut<[Signals]>] Adaptive<M, D, B> { bank, response, ring, d, order, u, past, restarts });

impl<const M: usize, const D: usize> Adaptive<M, D> {
    /// Starts from one hypothesis, with filters at rest, for a delay that is known. `None` for a noise model that does not fit, and as [`Bank::new`].
    pub fn new(first: Hypothesis, d: &[f64], suppositions: Suppositions) -> Option<Self> {
        Self::with_delays(first, d, suppositions, [[0.0; 6]; 1])
    }
}

impl<const M: usize, const D: usize, B: AsRef<[Signals]> + AsMut<[Signals]>> Adaptive<M, D, B> {
    /// As [`Adaptive::new`], with memory for as many signals as there are delays. `None` for another number too.
    pub fn with_delays(first: Hypothesis, d: &[f64], suppositions: Suppositions, memory: B) -> Option<Self> {
        let ring = Ring::new(memory);
        if d.len() > D || ring.count() != suppositions.delays.count {
            return None;
        }
        let mut kept = [0.0; D];
        kept[..d.len()].copy_from_slice(d);
        let about = [first.eta[2], first.eta[3]];
        Some(Self {
            bank: Bank::new(first, suppositions)?,
            response: Response::new(about, suppositions.sample_time),
            ring,
            d: kept,
            order: d.len(),
            u: [0.0; D],
            past: [[0.0; 6]; D],
            restarts: 0,
        })
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)`, with nk of the shortest delay. Both must be finite.
    pub fn step(&mut self, x: f64, u: f64) -> Step {
        let signals = self.response.step(x);
        let (y, r) = self.whitened(u, &signals);
        let finite = y.abs() < LARGEST && r.iter().all(|r| r.abs() < LARGEST);
        self.ring.put(if finite { r } else { [0.0; 6] });
        let seen = finite.then_some((y, self.ring.last()));
        let innovation = self.bank.take(seen, self.response.about());
        self.keep(u, signals);
        Step {
            innovation,
            shortened: !finite,
        }
    }

    /// Takes a sample into the filters alone; the estimate stays.
    pub fn follow(&mut self, x: f64, u: f64) -> Step {
        self.bank.pass();
        let signals = self.response.step(x);
        let (y, r) = self.whitened(u, &signals);
        self.ring.put(r);
        let innovation = y - self.foretold(self.ring.last());
        self.keep(u, signals);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`Adaptive::follow`] where the output is missing: the one-step prediction takes its place.
    pub fn bridge(&mut self, x: f64) {
        self.bank.pass();
        let signals = self.response.step(x);
        let (y, r) = self.whitened(0.0, &signals);
        self.ring.put(r);
        let u = self.foretold(self.ring.last()) - y;
        self.keep(u, signals);
    }

    /// `D u` and D times the signals.
    #[inline(always)]
    fn whitened(&self, u: f64, signals: &Signals) -> (f64, Signals) {
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

    /// `D w` of the mixture, with the likeliest delay.
    fn foretold(&self, signals: ByDelay<'_>) -> f64 {
        let eta = self.bank.mixture().eta;
        let r = signals.at(self.bank.likeliest_delay());
        let psi = hypothesis::gradient(&eta, r, self.response.about());
        eta[0] * psi[0] + eta[1] * psi[1]
    }

    /// Takes a sample into the filters' past, and lets their point follow the estimate.
    fn keep(&mut self, u: f64, signals: Signals) {
        if !(u.abs() < LARGEST && signals.iter().all(|s| s.abs() < LARGEST)) {
            self.response.rest();
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
        if self.bank.samples().is_multiple_of(FOLLOWS) {
            let [.., omega, zeta] = self.bank.mixture().eta;
            let about = self.response.about();
            let toward = |to: f64, from: f64| to.clamp((1.0 - STRIDE) * from, (1.0 + STRIDE) * from);
            let there = [toward(omega, about[0]), toward(zeta, about[1])];
            self.response
                .move_to(there, self.past.iter_mut().chain(self.ring.iter_mut()));
        }
    }

    /// The hypotheses with their probabilities.
    pub fn bank(&self) -> &Bank<M> {
        &self.bank
    }

    /// Coefficients of D behind the 1.
    pub fn d(&self) -> &[f64] {
        &self.d[..self.order]
    }

    /// How often a signal overflowed and the filters were brought to rest.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}

/// Samples after which the point of the filters follows the estimate.
const FOLLOWS: u64 = 64;
/// How far it does at most, as a share: what the filters remember moves along its derivative.
const STRIDE: f64 = 0.1;
