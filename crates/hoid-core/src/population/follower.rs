//! Someone who is followed from one basis: basis, noise model and gains. The errors and outputs of
//! the past are shared with others who are followed beside ([`super::contest`]).

use super::{
    basis::{Basis, Complex, Point, REFERENCE, Regressors},
    gains::{Around, Gains},
    known::Known,
    noise::NoiseModel,
    pair::Pair,
    past::{Paired, paired},
    place::Place,
    prior::PopulationPrior,
    sizes::{GAINS, HELD, LARGEST_ORDER, LINEAR, PARAMETERS, STATES},
};

/// Magnitude beyond which the filters are brought to rest.
pub(super) const LARGEST: f64 = 1e100;
/// Squares of innovations count up to so many variances, and what a normal innovation loses by that.
const CLIPPED: f64 = 9.0;
const LOST: f64 = 1.05;
/// Time constant with which |Y| at the reference is followed, and time between two solutions of the
/// noise model, s.
const UNIT_S: f64 = 5.0;
const SOLVE_S: f64 = 0.13;
/// Time in which signals that began at rest say little, s: an estimate that is known from before stands
/// still in it.
const FILLING_S: f64 = 2.0;
/// Corrections of omega and zeta (shares of theirs) and tau (s) from which the basis moves; the
/// farthest it moves at once; and where it may be: omega in rad/s, zeta, tau in s.
const NEAR: [f64; HELD] = [0.04, 0.1, 0.006];
const FAR: [f64; HELD] = [0.4, 0.6, 0.04];
const RANGE: [[f64; 2]; HELD] = [[3.0, 40.0], [0.05, 1.5], [0.0, LATEST_S]];
/// Longest delay, s.
pub(super) const LATEST_S: f64 = 0.9;
/// Time between two looks at whether it should, and time that a move takes, s.
const LOOK_S: f64 = 1.0;
const MOVE_S: f64 = 4.0;

/// Frequencies at which gain and lead are nearest, rad/s.
pub(super) const NEAR_RAD_S: [f64; 3] = [1.0, 2.0, 4.0];

/// A time in samples, at least one.
fn samples_of(seconds: f64, sample_time: f64) -> u64 {
    libm::round(seconds / sample_time).max(1.0) as u64
}

/// What was, for all: errors with the newest, and outputs, the newest first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Past<'a> {
    pub errors: &'a [f64],
    pub newest: usize,
    pub u: &'a [f64; LARGEST_ORDER],
}

impl Past<'_> {
    /// The error of so many samples ago.
    #[inline(always)]
    pub fn error(&self, age: usize) -> f64 {
        let n = self.errors.len();
        let age = age.min(n - 1);
        self.errors[if age <= self.newest {
            self.newest - age
        } else {
            self.newest + n - age
        }]
    }
}

/// A sample behind the whitening filter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Whitened {
    pub y: f64,
    pub regressors: Regressors,
    pub level: f64,
}

/// What a sample was worth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Learnt {
    pub white: Whitened,
    pub innovation: f64,
    /// Logarithm of the density that it was given before it was seen.
    pub log_density: f64,
    /// The state before the noise model saw it; none before the estimate has begun.
    pub state: Option<[f64; STATES]>,
}

/// Basis, noise model and gains.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Follower {
    pub place: Place,
    pub noise: NoiseModel,
    pub gains: Gains,
    pub samples: u64,
    pub began: bool,
    pub reopened: bool,
    /// True where a fit stood at the beginning.
    known: bool,
    /// Samples between two solutions of the noise model, and between two looks at the place.
    solve_every: u64,
    look_every: u64,
    powers: [f64; 2],
    pub variance: [f64; 2],
    pub unit: f64,
}

crate::state!([] Follower { place, noise, gains, samples, began, reopened, known, powers, variance, unit });

impl Follower {
    /// At rest; `None` for numbers that make no sense.
    pub fn new(basis: Basis, prior: &PopulationPrior) -> Option<Self> {
        let ts = prior.gains.sample_time;
        Some(Self {
            solve_every: samples_of(SOLVE_S, ts),
            look_every: samples_of(LOOK_S, ts),
            noise: NoiseModel::new(prior.order, prior.noise_memory, prior.gains.sample_time)?,
            gains: Gains::new(prior.gains, &basis)?,
            place: Place::new(basis),
            samples: 0,
            began: false,
            reopened: false,
            known: false,
            powers: [0.0; 2],
            variance: [0.0; 2],
            unit: 0.0,
        })
    }

    /// Somebody else from now on, with the noise model of this one and nothing known of the gains.
    pub fn beside(&self, basis: Basis, prior: &PopulationPrior) -> Option<Self> {
        let noise = self.noise.clone();
        Self::new(basis, prior).map(|other| Self { noise, ..other })
    }

    /// Begins at once, at what is known of the person; false for numbers that make no sense.
    pub fn knowing(&mut self, known: &Known, sample_time: f64) -> bool {
        if !known.place_in(&mut self.gains, &mut self.noise, sample_time) {
            return false;
        }
        (self.variance, self.unit) = ([known.variance; 2], known.unit);
        (self.began, self.reopened, self.known) = (true, true, true);
        true
    }

    /// True where a fit stood at the beginning.
    pub fn is_known(&self) -> bool {
        self.known
    }

    /// The signals of a sample, before [`Follower::whitened`].
    #[inline(always)]
    pub fn respond(&mut self, past: &Past) {
        self.place.step(|age| past.error(age));
    }

    /// `D u`, D times the responses, and D at zero.
    #[inline(always)]
    pub fn whitened(&self, past: &Past, u: f64) -> Whitened {
        let (mut y, mut z) = (u, paired(self.place.signals()));
        let (d, u, before) = (self.noise.padded_d(), past.u, self.place.past());
        // Four lags at a time.
        let (d, u, before) = (d.as_chunks::<4>().0, u.as_chunks::<4>().0, before.as_chunks::<4>().0);
        for ((d, u), before) in d.iter().zip(u).zip(before) {
            for k in 0..4 {
                y += d[k] * u[k];
                for (z, before) in z.iter_mut().zip(before[k]) {
                    *z += Pair::both(d[k]) * before;
                }
            }
        }
        Whitened {
            y,
            regressors: self
                .place
                .basis()
                .regressors(&core::array::from_fn(|i| z[i / 2].0[i % 2])),
            level: self.noise.sum(),
        }
    }

    /// Takes a sample whose signals are there; `None` where one has overflowed. `past` is that of
    /// before it but for the error.
    #[inline(always)]
    pub fn step(&mut self, prior: &PopulationPrior, past: &Past, u: f64) -> Option<Learnt> {
        let white = self.whitened(past, u);
        let sound = |x: &f64| x.abs() < LARGEST;
        let Regressors { x, by } = &white.regressors;
        if !(sound(&white.y) && x.iter().chain(by.iter().flatten()).all(sound)) {
            return None;
        }
        self.samples += 1;
        let e = past.error(0);
        self.powers[0] += e * e;
        self.powers[1] += u * u;
        let filling = self.known && self.samples < self.filled(prior);
        Some(match self.began {
            true if filling => Learnt {
                white,
                innovation: self.gains.innovation(white.y, &white.regressors, white.level),
                log_density: 0.0,
                state: None,
            },
            true => self.learn(prior, past, u, white),
            false => {
                self.begin(prior);
                Learnt {
                    white,
                    innovation: white.y,
                    log_density: 0.0,
                    state: None,
                }
            }
        })
    }

    fn filled(&self, prior: &PopulationPrior) -> u64 {
        libm::ceil(FILLING_S / prior.gains.sample_time) as u64
    }

    /// Counts the first samples, and begins when they are enough and not all zero.
    fn begin(&mut self, prior: &PopulationPrior) {
        let seconds = self.samples as f64 * prior.gains.sample_time;
        let [e, u] = self.powers;
        if seconds >= prior.hold && e > 0.0 && u > 0.0 {
            let n = self.samples as f64;
            self.unit = libm::sqrt(u / e);
            self.gains.begin(self.unit, libm::sqrt(u / n));
            self.variance = [0.01 * u / n; 2];
            self.began = true;
        }
    }

    fn learn(&mut self, p: &PopulationPrior, past: &Past, u: f64, white: Whitened) -> Learnt {
        let (ts, n) = (p.gains.sample_time, self.samples as f64);
        let power = self.powers[1] / n;
        let point = self.place.basis().point();
        if !self.reopened && n * ts >= p.reopen {
            self.reopened = true;
            self.gains.reopen(self.unit, libm::sqrt(power), point);
        }
        if self.known && self.samples == self.filled(p) {
            // The level of u is another in each run, and the fit does not say of what size u is.
            self.gains.open_level(libm::sqrt(power));
        }
        let around = Around {
            variance: self.variance[0],
            unit: self.unit,
            level: p.offset_drift.map(|drift| drift * drift * power),
        };
        let (eps, log_density) = self
            .gains
            .update(white.y, &white.regressors, white.level, point, &around);
        for (variance, memory) in self.variance.iter_mut().zip(p.level_memory) {
            let learnt = if self.known { memory } else { memory.min(n * ts) };
            let share = ts / learnt.max(4.0 * ts);
            let square = LOST * (eps * eps).min(CLIPPED * *variance);
            // What is foretold without an error leaves a level that is still positive.
            *variance = (*variance + share * (square - *variance)).max(1e-20 * power);
        }
        let state = self.gains.state();
        self.follow_noise(past, u, eps, &state);
        if self.is_renewed() {
            self.noise.solve();
            let [re, im] = self.response(REFERENCE);
            let share = (self.solve_every as f64 * ts / UNIT_S).min(1.0);
            self.unit += share * (libm::hypot(re, im) - self.unit);
        }
        if self.reopened && self.samples.is_multiple_of(self.look_every) {
            self.look(past, &state, samples_of(MOVE_S, ts));
        }
        Learnt {
            white,
            innovation: eps,
            log_density,
            state: Some(state),
        }
    }

    /// True at the samples at which the noise model is solved anew.
    pub fn is_renewed(&self) -> bool {
        self.samples.is_multiple_of(self.solve_every)
    }

    /// v with all its lags by the gains of now.
    fn follow_noise(&mut self, past: &Past, u: f64, eps: f64, state: &[f64; STATES]) {
        let order = self.noise.order();
        if self.samples <= order as u64 {
            return;
        }
        let weights = paired(&self.place.basis().weights(state));
        let left = |u: f64, z: &Paired| {
            let response = weights[0] * z[0] + weights[1] * z[1] + weights[2] * z[2];
            u - state[GAINS] - response.sum()
        };
        let mut v = [0.0; LARGEST_ORDER + 1];
        v[0] = left(u, &paired(self.place.signals()));
        for ((v, u), z) in v[1..=order].iter_mut().zip(past.u).zip(self.place.past()) {
            *v = left(*u, z);
        }
        let variance = self.variance[0];
        let excess = (eps * eps / (CLIPPED * variance)).max(1.0);
        self.noise.update(&v, 1.0 / (variance * excess));
    }

    /// Moves the basis where the corrections have grown.
    fn look(&mut self, past: &Past, state: &[f64; STATES], after: u64) {
        let Point { tau, omega, zeta, lag } = self.place.basis().point();
        let (of, mut to) = ([omega, zeta, 1.0], [omega, zeta, tau]);
        let mut is_far = false;
        for (i, to) in to.iter_mut().enumerate() {
            let correction = state[LINEAR + i];
            is_far |= correction.abs() > NEAR[i] * of[i];
            let most = FAR[i] * of[i];
            let [low, high] = RANGE[i];
            *to = (*to + correction.max(-most).min(most)).max(low).min(high);
        }
        if is_far && !self.place.is_moving() {
            let [omega, zeta, tau] = to;
            let delayed = self.delayed(past);
            self.place
                .begin_to_move(Point { tau, omega, zeta, lag }, delayed, after);
        }
    }

    /// The delayed error of now.
    pub fn delayed(&self, past: &Past) -> f64 {
        let basis = self.place.basis();
        let l = basis.delay();
        basis.delayed([past.error(l), past.error(l + 1)])
    }

    /// Ends a sample.
    #[inline(always)]
    pub fn remember(&mut self) {
        if let Some(by) = self.place.remember() {
            self.gains.moved(by);
        }
    }

    /// Where what is held is by a state: never outside of where the basis may be.
    pub fn corrected(&self, state: &[f64; STATES]) -> Point {
        let at = self.place.basis().point();
        let Point { tau, omega, zeta, lag } = at.moved([state[LINEAR], state[LINEAR + 1], state[LINEAR + 2]]);
        let within = |x: f64, [low, high]: [f64; 2]| x.max(low).min(high);
        Point {
            omega: within(omega, RANGE[0]),
            zeta: within(zeta, RANGE[1]),
            tau: within(tau, RANGE[2]),
            lag,
        }
    }

    /// K_e, K_e_dot, omega, zeta and tau.
    pub fn operator(&self) -> [f64; PARAMETERS] {
        let (map, state) = (self.place.basis().gain_and_lead(&NEAR_RAD_S), self.gains.state());
        let Point { omega, zeta, tau, .. } = self.corrected(&state);
        let gain = |i: usize| (0..GAINS).map(|k| map[i][k] * state[k]).sum();
        [gain(0), gain(1), omega, zeta, tau]
    }

    /// The response of each gain at a frequency in rad/s, for what is held now.
    pub fn responses(&self, omega_rad_s: f64) -> [Complex; GAINS] {
        self.responses_at(&self.gains.state(), omega_rad_s)
    }

    fn responses_at(&self, state: &[f64; STATES], omega_rad_s: f64) -> [Complex; GAINS] {
        self.place.basis().response(omega_rad_s, self.corrected(state))
    }

    /// Y at a frequency in rad/s.
    pub fn response(&self, omega_rad_s: f64) -> Complex {
        let state = self.gains.state();
        let h = self.responses_at(&state, omega_rad_s);
        [0, 1].map(|part| (0..GAINS).map(|i| state[i] * h[i][part]).sum())
    }

    /// As [`Follower::response`], with the derivatives of its real and its imaginary part by gains,
    /// level and corrections: exact by the gains, differences by the corrections.
    pub fn response_with_derivatives(&self, omega_rad_s: f64) -> (Complex, [[f64; STATES]; 2]) {
        let state = self.gains.state();
        let point = self.corrected(&state);
        let basis = self.place.basis();
        let h = basis.response(omega_rad_s, point);
        let of = |h: &[Complex; GAINS]| [0, 1].map(|part| (0..GAINS).map(|i| state[i] * h[i][part]).sum::<f64>());
        let mut by = [[0.0; STATES]; 2];
        for part in 0..2 {
            for i in 0..GAINS {
                by[part][i] = h[i][part];
            }
        }
        for (j, size) in [point.omega, point.zeta, 0.1].into_iter().enumerate() {
            let step = 1e-5 * size;
            let at = |sign: f64| {
                let mut by = [0.0; HELD];
                by[j] = sign * step;
                of(&basis.response(omega_rad_s, point.moved(by)))
            };
            let (up, down) = (at(1.0), at(-1.0));
            for part in 0..2 {
                by[part][LINEAR + j] = (up[part] - down[part]) / (2.0 * step);
            }
        }
        (of(&h), by)
    }
}
