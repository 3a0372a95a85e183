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
//! any more, so that its memory grows for as long as it lives. Every `spacing` samples one is born: a copy of the likeliest,
//! whose gains are opened by the covariance of a change that is to be expected, and whose innovation variance rests on few samples. It is
//! given the prior probability of a change in that time. The probability of each is multiplied, at each sample, by the density that it
//! gave to the innovation. When there is no room, the least likely of those that have had time to prove themselves makes way.
//! (M. Basseville and I. V. Nikiforov, *Detection of Abrupt Changes*, 1993, section 7.2; P. Andersson, *International Journal of Control* 42 (1985) 1175-1193: adaptive
//! forgetting by multiple models; R. P. Adams and D. J. C. MacKay, *Bayesian online changepoint detection*, 2007.)
//!
//! **The estimate** is the mean of the mixture, its covariance that of the mixture, what the hypotheses disagree about included. T_L is
//! `E[K_e K_e_dot]/E[K_e^2]`, the T for which `E (K_e_dot - T K_e)^2` is least: it stays finite as K_e becomes zero.
//!
//! **A change** ([`change`]) is seen in the odds of the hypotheses that were born within the last seconds against those that are older.

pub mod change;
pub mod hypothesis;
pub mod response;

use change::{Change, Watch};
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
}

/// The bank. M is the room for hypotheses, D the largest order of the noise model.
#[derive(Debug, Clone, PartialEq)]
pub struct Adaptive<const M: usize, const D: usize> {
    suppositions: Suppositions,
    hypotheses: [Option<Hypothesis>; M],
    response: Response,
    /// D, its order, and the past of u and of the signals, newest first.
    d: [f64; D],
    order: usize,
    u: [f64; D],
    past: [Signals; D],
    samples: u64,
    wait: u32,
    watch: Watch,
    mixture: Mixture,
    restarts: u64,
}

crate::state!([const M: usize, const D: usize] Adaptive<M, D> {
    hypotheses, response, d, order, u, past, samples, wait, watch, mixture, restarts
});

/// Mean and covariance of the mixture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture {
    /// `[K_e, K_e_dot, omega_nm, zeta_nm]`.
    pub eta: [f64; OPERATOR],
    /// Innovation variance.
    pub variance: f64,
}

crate::state!([] Mixture { eta, variance });

impl<const M: usize, const D: usize> Adaptive<M, D> {
    /// Starts from one hypothesis, with filters at rest. `None` without room for two, for a noise model that does not fit, for a start that is not
    /// within the bounds or not finite, or for bounds that let omega_nm or zeta_nm become zero.
    pub fn new(first: Hypothesis, d: &[f64], suppositions: Suppositions) -> Option<Self> {
        let s = &suppositions;
        let eta = first.eta;
        let inside = eta.iter().zip(&s.bounds).all(|(e, [low, high])| low <= e && e <= high);
        let sound = M >= 2
            && d.len() <= D
            && inside
            && s.bounds[2][0] > 0.0
            && s.bounds[3][0] > 0.0
            && s.sample_time > 0.0
            && s.spacing > 0
            && (0.0..1.0).contains(&(s.hazard * f64::from(s.spacing)))
            && first.is_sound();
        if !sound {
            return None;
        }
        let mut kept = [0.0; D];
        kept[..d.len()].copy_from_slice(d);
        let mut hypotheses = core::array::from_fn(|_| None);
        hypotheses[0] = Some(first);
        Some(Self {
            hypotheses,
            response: Response::new([eta[2], eta[3]], s.sample_time),
            d: kept,
            order: d.len(),
            u: [0.0; D],
            past: [[0.0; 6]; D],
            samples: 0,
            wait: s.spacing,
            watch: Watch::default(),
            mixture: Mixture {
                eta,
                variance: first.level.variance(),
            },
            restarts: 0,
            suppositions,
        })
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)`. Both must be finite.
    pub fn step(&mut self, x: f64, u: f64) -> Step {
        self.samples += 1;
        let signals = self.response.step(x);
        let (y, r) = self.whitened(u, &signals);
        let finite = y.abs() < LARGEST && r.iter().all(|r| r.abs() < LARGEST);
        let mut innovation = 0.0;
        if finite {
            let mut logs = [f64::NEG_INFINITY; M];
            let mut most = f64::NEG_INFINITY;
            for (h, log) in self.hypotheses.iter_mut().zip(&mut logs) {
                let Some(h) = h else { continue };
                let before = h.weight;
                let (eps, density) = h.step(y, &r, self.response.about(), &self.suppositions);
                innovation += before * eps;
                *log = libm::log(before) + density;
                if *log > most {
                    most = *log;
                }
            }
            self.weigh(&logs, most);
        }
        self.wait -= 1;
        if self.wait == 0 {
            self.wait = self.suppositions.spacing;
            self.drift();
            self.bear();
        }
        self.mix();
        self.watch.look(&self.hypotheses, self.samples, &self.suppositions);
        self.keep(u, signals);
        Step {
            innovation,
            shortened: !finite,
        }
    }

    /// Takes a sample into the filters alone; the estimate stays.
    pub fn follow(&mut self, x: f64, u: f64) -> Step {
        self.samples += 1;
        let signals = self.response.step(x);
        let (y, r) = self.whitened(u, &signals);
        let innovation = y - self.foretold(&r);
        self.keep(u, signals);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`Adaptive::follow`] where the output is missing: the one-step prediction takes its place.
    pub fn bridge(&mut self, x: f64) {
        self.samples += 1;
        let signals = self.response.step(x);
        let (y, r) = self.whitened(0.0, &signals);
        let u = self.foretold(&r) - y;
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

    /// `D w` of the mixture.
    fn foretold(&self, r: &Signals) -> f64 {
        let eta = &self.mixture.eta;
        let psi = hypothesis::gradient(eta, r, self.response.about());
        eta[0] * psi[0] + eta[1] * psi[1]
    }

    /// Takes a sample into the filters' past, and lets their point follow the estimate.
    fn keep(&mut self, u: f64, signals: Signals) {
        if !(u.abs() < LARGEST && signals.iter().all(|s| s.abs() < LARGEST)) {
            self.response.rest();
            self.u = [0.0; D];
            self.past = [[0.0; 6]; D];
            self.restarts += 1;
            return;
        }
        if self.order > 0 {
            self.u.copy_within(0..self.order - 1, 1);
            self.past.copy_within(0..self.order - 1, 1);
            self.u[0] = u;
            self.past[0] = signals;
        }
        if self.samples.is_multiple_of(FOLLOWS) {
            self.response
                .move_to([self.mixture.eta[2], self.mixture.eta[3]], &mut self.past);
        }
    }

    /// Probabilities from their logarithms. What has become impossible, or not finite, is nearly so.
    fn weigh(&mut self, logs: &[f64; M], most: f64) {
        let mut sum = 0.0;
        for (h, log) in self.hypotheses.iter_mut().zip(logs) {
            let Some(h) = h else { continue };
            let weight = libm::exp(log - most);
            h.weight = if weight > LEAST { weight } else { LEAST };
            sum += h.weight;
        }
        for h in self.hypotheses.iter_mut().flatten() {
            h.weight /= sum;
        }
    }

    fn drift(&mut self) {
        for h in self.hypotheses.iter_mut().flatten() {
            h.drift(&self.suppositions);
        }
    }

    /// A hypothesis that the person changes now.
    fn bear(&mut self) {
        let (mut likeliest, mut place) = (None, None);
        let (mut highest, mut lowest) = (0.0, f64::INFINITY);
        for (i, h) in self.hypotheses.iter().enumerate() {
            let Some(h) = h else {
                (place, lowest) = (Some(i), f64::NEG_INFINITY);
                continue;
            };
            if h.weight > highest {
                (likeliest, highest) = (Some(h), h.weight);
            }
            if self.samples - h.born >= self.suppositions.protected && h.weight < lowest {
                (place, lowest) = (Some(i), h.weight);
            }
        }
        let (Some(parent), Some(place)) = (likeliest, place) else {
            return;
        };
        if highest == lowest {
            return;
        }
        let mut child = parent.opened(self.samples, &self.suppositions);
        let share = self.suppositions.hazard * f64::from(self.suppositions.spacing);
        self.hypotheses[place] = None;
        let rest: f64 = self.hypotheses.iter().flatten().map(|h| h.weight).sum();
        for h in self.hypotheses.iter_mut().flatten() {
            h.weight *= (1.0 - share) / rest;
        }
        child.weight = share;
        self.hypotheses[place] = Some(child);
    }

    fn mix(&mut self) {
        let mut mixture = Mixture {
            eta: [0.0; OPERATOR],
            variance: 0.0,
        };
        for h in self.hypotheses.iter().flatten() {
            for i in 0..OPERATOR {
                mixture.eta[i] += h.weight * h.eta[i];
            }
            mixture.variance += h.weight * h.level.variance();
        }
        self.mixture = mixture;
    }

    /// Mean of the mixture.
    pub fn mixture(&self) -> &Mixture {
        &self.mixture
    }

    /// Covariance of eta.
    pub fn covariance(&self) -> [[f64; OPERATOR]; OPERATOR] {
        let mut covariance = [[0.0; OPERATOR]; OPERATOR];
        for h in self.hypotheses.iter().flatten() {
            let p = h.covariance.matrix();
            for i in 0..OPERATOR {
                let a = h.eta[i] - self.mixture.eta[i];
                for j in 0..OPERATOR {
                    let b = h.eta[j] - self.mixture.eta[j];
                    covariance[i][j] += h.weight * (p[i][j] + a * b);
                }
            }
        }
        covariance
    }

    /// T_L in s and its variance, from `E[K_e K_e_dot]/E[K_e^2]`.
    pub fn lead(&self, covariance: &[[f64; OPERATOR]; OPERATOR]) -> [f64; 2] {
        let [k_e, k_e_dot, ..] = self.mixture.eta;
        let square = k_e * k_e + covariance[0][0];
        let lead = (k_e * k_e_dot + covariance[0][1]) / square;
        // d T_L = (d K_e_dot - T_L d K_e)/K_e.
        let of_ratio = covariance[1][1] - 2.0 * lead * covariance[0][1] + lead * lead * covariance[0][0];
        [lead, of_ratio.max(0.0) / square]
    }

    /// Coefficients of D behind the 1.
    pub fn d(&self) -> &[f64] {
        &self.d[..self.order]
    }

    /// The hypotheses that there are.
    pub fn hypotheses(&self) -> impl Iterator<Item = &Hypothesis> {
        self.hypotheses.iter().flatten()
    }

    /// Logarithm of the odds that the person changed within the last `recent` samples.
    pub fn odds(&self) -> f64 {
        self.watch.odds()
    }

    /// The change that was declared at the last sample, if it was then.
    pub fn change(&self) -> Option<Change> {
        self.watch.change()
    }

    /// Samples so far.
    pub fn samples(&self) -> u64 {
        self.samples
    }

    /// How often a signal overflowed and the filters were brought to rest.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}

/// Least probability of a hypothesis.
const LEAST: f64 = 1e-12;
/// Samples after which the point of the filters follows the estimate.
const FOLLOWS: u64 = 64;
