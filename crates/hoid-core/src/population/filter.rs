//! The recursion: basis, noise model, gains and detector.

use super::{
    basis::{Basis, Complex, Point, REFERENCE, Regressors, Signals},
    detector::{Detection, Detector},
    gains::{Around, GainPrior, Gains},
    known::Known,
    noise::NoiseModel,
    place::Place,
    sizes::{GAINS, HELD, LARGEST_ORDER, LINEAR, STATES},
};
use crate::{
    recursion::Step,
    state::{State, visit_all},
};

/// Magnitude beyond which the filters are brought to rest.
const LARGEST: f64 = 1e100;
/// Squares of innovations count up to so many variances, and what a normal innovation loses by that.
const CLIPPED: f64 = 9.0;
const LOST: f64 = 1.05;
/// Time from which blocks are kept for the detector: before that D is what was supposed, s.
const SETTLED_S: f64 = 5.0;
/// Time constant with which |Y| at the reference is followed, and time between two solutions of the
/// noise model, s.
const UNIT_S: f64 = 5.0;
const SOLVE_S: f64 = 0.13;
/// Corrections of omega and zeta (shares of theirs) and tau (s) from which the basis moves; the
/// farthest it moves at once; and where it may be: omega in rad/s, zeta, tau in s.
const NEAR: [f64; HELD] = [0.04, 0.1, 0.006];
const FAR: [f64; HELD] = [0.4, 0.6, 0.04];
const RANGE: [[f64; 2]; HELD] = [[3.0, 40.0], [0.05, 1.5], [0.0, LATEST_S]];
/// Longest delay, s.
const LATEST_S: f64 = 0.9;
/// Time between two looks at whether it should, and time that a move takes, s.
const LOOK_S: f64 = 1.0;
const MOVE_S: f64 = 4.0;

/// What is supposed of a person and their changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PopulationPrior {
    /// Drifts, outliers and weights.
    pub gains: GainPrior,
    /// Order of the noise model.
    pub order: usize,
    /// Its memory, s.
    pub noise_memory: f64,
    /// Time constants of the variance of eps for the gains and for the detector, s.
    pub level_memory: [f64; 2],
    /// Drifts of the level of u in one second, over the root mean square of u: of the filter whose
    /// gains hardly move, and of the others.
    pub offset_drift: [f64; 2],
    /// Time after which the estimate begins, s: the ratio of u to e in it gives the prior of the
    /// gains.
    pub hold: f64,
    /// Time after which what is held is corrected, s. What was learnt before counts no more than the
    /// prior then: the noise model was not known.
    pub reopen: f64,
    /// What a declared change adds to the gains, over |Y| at the reference.
    pub jump: f64,
    /// The detector.
    pub detection: Detection,
}

/// The recursion. E is the memory for past errors.
#[derive(Debug, Clone, PartialEq)]
pub struct PopulationFilter<E> {
    prior: PopulationPrior,
    place: Place,
    noise: NoiseModel,
    gains: Gains,
    detector: Detector,
    errors: E,
    newest: usize,
    u: [f64; LARGEST_ORDER],
    samples: u64,
    began: bool,
    reopened: bool,
    powers: [f64; 2],
    variance: [f64; 2],
    unit: f64,
    restarts: u64,
    /// True where a fit stood at the beginning.
    known: bool,
}

impl<E: AsMut<[f64]>> State for PopulationFilter<E> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.errors.as_mut().visit(each);
        visit_all(
            &mut [
                &mut self.place,
                &mut self.noise,
                &mut self.gains,
                &mut self.detector,
                &mut self.newest,
                &mut self.u,
                &mut self.samples,
                &mut self.began,
                &mut self.reopened,
                &mut self.powers,
                &mut self.variance,
                &mut self.unit,
                &mut self.restarts,
                &mut self.known,
            ],
            each,
        );
    }
}

/// A sample behind the whitening filter.
struct Whitened {
    y: f64,
    regressors: Regressors,
    level: f64,
}

impl<E: AsRef<[f64]> + AsMut<[f64]>> PopulationFilter<E> {
    /// At rest. `errors` is memory for [`errors_needed`] numbers. `None` for numbers that make no
    /// sense, or too little memory.
    pub fn new(basis: Basis, prior: PopulationPrior, mut errors: E) -> Option<Self> {
        let ts = prior.gains.sample_time;
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let sound = prior.level_memory.iter().all(|m| positive(*m))
            && positive(prior.hold)
            && prior.reopen >= prior.hold
            && prior.offset_drift.iter().all(|d| *d >= 0.0)
            && prior.jump >= 0.0
            && basis.point().tau <= LATEST_S;
        if !sound || errors.as_ref().len() < errors_needed(ts) {
            return None;
        }
        errors.as_mut().fill(0.0);
        let response = basis.response(prior.detection.frequency, basis.point());
        Some(Self {
            noise: NoiseModel::new(prior.order, prior.noise_memory, ts)?,
            gains: Gains::new(prior.gains, &basis)?,
            detector: Detector::new(prior.detection, response, ts)?,
            place: Place::new(basis),
            prior,
            errors,
            newest: 0,
            u: [0.0; LARGEST_ORDER],
            samples: 0,
            began: false,
            reopened: false,
            powers: [0.0; 2],
            variance: [0.0; 2],
            unit: 0.0,
            restarts: 0,
            known: false,
        })
    }

    /// Begins at once, at what is known of the person. `None` for numbers that make no sense.
    pub fn knowing(mut self, known: &Known) -> Option<Self> {
        let ts = self.prior.gains.sample_time;
        if !known.place_in(&mut self.gains, &mut self.noise, ts) {
            return None;
        }
        (self.variance, self.unit) = ([known.variance; 2], known.unit);
        (self.began, self.reopened, self.known) = (true, true, true);
        Some(self)
    }

    /// Takes a sample. Both must be finite.
    pub fn step(&mut self, e: f64, u: f64) -> Step {
        self.respond(e);
        let white = self.whitened(u);
        let sound = |x: &f64| x.abs() < LARGEST;
        let Regressors { x, by } = &white.regressors;
        if !(sound(&white.y) && x.iter().chain(by.iter().flatten()).all(sound)) {
            self.rest();
            return Step {
                innovation: 0.0,
                shortened: true,
            };
        }
        self.samples += 1;
        self.powers[0] += e * e;
        self.powers[1] += u * u;
        let innovation = if self.began {
            self.learn(u, &white)
        } else {
            self.begin(white.y)
        };
        self.remember(u);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`PopulationFilter::step`], but the estimate stays: only the filters move on.
    pub fn step_without_update(&mut self, e: f64, u: f64) -> Step {
        self.respond(e);
        let white = self.whitened(u);
        self.detector.skip();
        let innovation = self.foretold(&white);
        self.keep(u, innovation);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`PopulationFilter::step_without_update`] where the output is missing: the one-step
    /// prediction takes its place.
    pub fn bridge(&mut self, e: f64) {
        self.respond(e);
        let white = self.whitened(0.0);
        self.detector.skip();
        let u = -self.foretold(&white);
        self.keep(u, u);
    }

    fn foretold(&self, white: &Whitened) -> f64 {
        self.gains.innovation(white.y, &white.regressors, white.level)
    }

    fn keep(&mut self, u: f64, innovation: f64) {
        if innovation.abs() < LARGEST && u.abs() < LARGEST {
            self.remember(u);
        } else {
            self.rest();
        }
    }

    /// The signals of a sample.
    #[inline(always)]
    fn respond(&mut self, e: f64) {
        let errors = self.errors.as_mut();
        let n = errors.len();
        self.newest = if self.newest + 1 >= n { 0 } else { self.newest + 1 };
        errors[self.newest] = e;
        let newest = self.newest;
        let at = |age: usize| {
            let age = age.min(n - 1);
            errors[if age <= newest { newest - age } else { newest + n - age }]
        };
        self.place.step(at);
    }

    /// `D u`, D times the responses, and D at zero.
    #[inline(always)]
    fn whitened(&self, u: f64) -> Whitened {
        let (mut y, mut z): (f64, Signals) = (u, *self.place.signals());
        for ((d, u), past) in self.noise.d().iter().zip(&self.u).zip(self.place.past()) {
            y += d * u;
            for (z, past) in z.iter_mut().zip(past) {
                *z += d * past;
            }
        }
        Whitened {
            y,
            regressors: self.place.basis().regressors(&z),
            level: self.noise.sum(),
        }
    }

    /// Counts the first samples, and begins when they are enough and not all zero.
    fn begin(&mut self, y: f64) -> f64 {
        let seconds = self.samples as f64 * self.prior.gains.sample_time;
        let [e, u] = self.powers;
        if seconds >= self.prior.hold && e > 0.0 && u > 0.0 {
            let n = self.samples as f64;
            self.unit = libm::sqrt(u / e);
            self.gains.begin(self.unit, libm::sqrt(u / n));
            self.variance = [0.01 * u / n; 2];
            self.began = true;
        }
        y
    }

    fn learn(&mut self, u: f64, white: &Whitened) -> f64 {
        let p = self.prior;
        let (ts, n) = (p.gains.sample_time, self.samples as f64);
        let power = self.powers[1] / n;
        let point = self.place.basis().point();
        if !self.reopened && n * ts >= p.reopen {
            self.reopened = true;
            self.gains.reopen(self.unit, libm::sqrt(power), point);
        }
        if self.known && self.samples == libm::ceil(p.hold / ts) as u64 {
            // The level of u is another in each run, and the fit does not say of what size u is.
            self.gains.open_level(libm::sqrt(power));
        }
        let around = Around {
            variance: self.variance[0],
            unit: self.unit,
            level: p.offset_drift.map(|drift| drift * drift * power),
        };
        let eps = self
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
        if n * ts >= SETTLED_S && self.is_changed(white, eps, &state) {
            self.gains.open(p.jump * self.unit);
        }
        self.follow_noise(u, eps, &state);
        let every = |seconds: f64| libm::round(seconds / ts).max(1.0) as u64;
        if self.samples.is_multiple_of(every(SOLVE_S)) {
            self.noise.solve();
            self.detector.look_at(self.responses(p.detection.frequency));
            let [re, im] = self.response(REFERENCE);
            let share = (every(SOLVE_S) as f64 * ts / UNIT_S).min(1.0);
            self.unit += share * (libm::hypot(re, im) - self.unit);
        }
        if self.reopened && self.samples.is_multiple_of(every(LOOK_S)) {
            self.look(&state, every(MOVE_S));
        }
        eps
    }

    /// What the detector says of a sample, with the responses where the corrections point.
    fn is_changed(&mut self, white: &Whitened, eps: f64, state: &[f64; STATES]) -> bool {
        let most = self.prior.gains.limit * libm::sqrt(self.variance[1]);
        let limited = white.y - eps + eps.max(-most).min(most);
        let mut r = [0.0; LINEAR];
        for i in 0..GAINS {
            r[i] = white.regressors.x[i];
            for j in 0..HELD {
                r[i] += state[LINEAR + j] * white.regressors.by[j][i];
            }
        }
        r[GAINS] = white.level;
        self.detector.update(&r, limited, eps, self.variance[1])
    }

    /// v with all its lags by the gains of now.
    fn follow_noise(&mut self, u: f64, eps: f64, state: &[f64; STATES]) {
        let order = self.noise.order();
        if self.samples <= order as u64 {
            return;
        }
        let weights = self.place.basis().weights(state);
        let left = |u: f64, z: &Signals| {
            let response: f64 = weights.iter().zip(z).map(|(w, z)| w * z).sum();
            u - state[GAINS] - response
        };
        let mut v = [0.0; LARGEST_ORDER + 1];
        v[0] = left(u, self.place.signals());
        for ((v, u), z) in v[1..=order].iter_mut().zip(&self.u).zip(self.place.past()) {
            *v = left(*u, z);
        }
        let variance = self.variance[0];
        let excess = (eps * eps / (CLIPPED * variance)).max(1.0);
        self.noise.update(&v, 1.0 / (variance * excess));
    }

    /// Moves the basis where the corrections have grown.
    fn look(&mut self, state: &[f64; STATES], after: u64) {
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
            let l = self.place.basis().delay();
            let errors = self.errors.as_ref();
            let at = |age: usize| errors[(self.newest + errors.len() - age.min(errors.len())) % errors.len()];
            let delayed = self.place.basis().delayed([at(l), at(l + 1)]);
            self.place
                .begin_to_move(Point { tau, omega, zeta, lag }, delayed, after);
        }
    }

    fn remember(&mut self, u: f64) {
        self.u.copy_within(0..LARGEST_ORDER - 1, 1);
        self.u[0] = u;
        if let Some(by) = self.place.remember() {
            self.gains.moved(by);
        }
    }

    /// Brings the filters to rest where a signal has overflowed.
    fn rest(&mut self) {
        self.place.rest();
        self.errors.as_mut().fill(0.0);
        self.u = [0.0; LARGEST_ORDER];
        self.detector.skip();
        self.restarts += 1;
    }

    /// True from when on there is an estimate.
    pub fn began(&self) -> bool {
        self.began
    }

    /// True from when on neuromuscular system and delay are corrected.
    pub fn corrects(&self) -> bool {
        self.reopened
    }

    /// The basis.
    pub fn basis(&self) -> &Basis {
        self.place.basis()
    }

    /// The gains.
    pub fn gains(&self) -> &Gains {
        &self.gains
    }

    /// Where what is held is now, the corrections included: never outside of where the basis may be.
    pub fn held(&self) -> Point {
        self.corrected(&self.gains.state())
    }

    fn corrected(&self, state: &[f64; STATES]) -> Point {
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

    /// The response of each gain at a frequency in rad/s, for what is held now.
    pub fn responses(&self, omega_rad_s: f64) -> [Complex; GAINS] {
        self.place.basis().response(omega_rad_s, self.held())
    }

    /// Y at a frequency in rad/s.
    pub fn response(&self, omega_rad_s: f64) -> Complex {
        self.response_of(&self.gains.state(), omega_rad_s)
    }

    fn response_of(&self, state: &[f64; STATES], omega_rad_s: f64) -> Complex {
        let h = self.place.basis().response(omega_rad_s, self.corrected(state));
        [0, 1].map(|part| (0..GAINS).map(|i| state[i] * h[i][part]).sum())
    }

    /// Y at a frequency in rad/s, with the derivatives of its real and its imaginary part by gains,
    /// level and corrections: exact by the gains, differences by the corrections.
    pub fn response_with_derivatives(&self, omega_rad_s: f64) -> (Complex, [[f64; STATES]; 2]) {
        let state = self.gains.state();
        let point = self.corrected(&state);
        let h = self.place.basis().response(omega_rad_s, point);
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
                let h = self.place.basis().response(omega_rad_s, point.moved(by));
                [0, 1].map(|part| (0..GAINS).map(|i| state[i] * h[i][part]).sum::<f64>())
            };
            let (up, down) = (at(1.0), at(-1.0));
            for part in 0..2 {
                by[part][LINEAR + j] = (up[part] - down[part]) / (2.0 * step);
            }
        }
        (self.response_of(&state, omega_rad_s), by)
    }

    /// The detector.
    pub fn detector(&self) -> &Detector {
        &self.detector
    }

    /// Coefficients of D behind the 1.
    pub fn d(&self) -> &[f64] {
        self.noise.d()
    }

    /// The noise model.
    pub fn noise(&self) -> &NoiseModel {
        &self.noise
    }

    /// Variance of eps of the last seconds.
    pub fn variance(&self) -> f64 {
        self.variance[0]
    }

    /// How often a signal overflowed and the filters were brought to rest.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}

/// Errors that are kept, for a sample time in s: those of the longest delay.
pub fn errors_needed(sample_time: f64) -> usize {
    libm::ceil(LATEST_S / sample_time) as usize + 4
}
