//! The recursion: basis, noise model, gains and detector.

use super::{
    basis::{Basis, REFERENCE},
    detector::{Detection, Detector},
    gains::{GainPrior, Gains},
    noise::NoiseModel,
    sizes::{GAINS, LARGEST_ORDER, POINTS, STATES},
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
    /// Drift of the level of u in one second, over the root mean square of u.
    pub offset_drift: f64,
    /// Time after which the estimate begins, s: the ratio of u to e in it gives the prior of the
    /// gains.
    pub hold: f64,
    /// What a declared change adds to the gains, over |Y| at the reference.
    pub jump: f64,
    /// The detector.
    pub detection: Detection,
}

/// The recursion. E is the memory for past errors.
#[derive(Debug, Clone, PartialEq)]
pub struct PopulationFilter<E> {
    prior: PopulationPrior,
    bases: [Basis; POINTS],
    /// Response of each basis at the reference.
    at_reference: [[[f64; GAINS]; 2]; POINTS],
    noise: NoiseModel,
    gains: Gains,
    detector: Detector,
    errors: E,
    newest: usize,
    u: [f64; LARGEST_ORDER],
    x: [[[f64; GAINS]; POINTS]; LARGEST_ORDER],
    samples: u64,
    began: bool,
    powers: [f64; 2],
    variance: [f64; 2],
    unit: f64,
    restarts: u64,
}

impl<E: AsMut<[f64]>> State for PopulationFilter<E> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.errors.as_mut().visit(each);
        visit_all(
            &mut [
                &mut self.bases,
                &mut self.noise,
                &mut self.gains,
                &mut self.detector,
                &mut self.newest,
                &mut self.u,
                &mut self.x,
                &mut self.samples,
                &mut self.began,
                &mut self.powers,
                &mut self.variance,
                &mut self.unit,
                &mut self.restarts,
            ],
            each,
        );
    }
}

impl<E: AsRef<[f64]> + AsMut<[f64]>> PopulationFilter<E> {
    /// At rest. The first point is the one in which changes are looked for. `errors` is memory for
    /// [`errors_needed`] numbers. `None` for numbers that make no sense, or too little memory.
    pub fn new(points: [Basis; POINTS], prior: PopulationPrior, mut errors: E) -> Option<Self> {
        let ts = prior.gains.sample_time;
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let sound = prior.level_memory.iter().all(|m| positive(*m))
            && positive(prior.hold)
            && prior.offset_drift >= 0.0
            && prior.jump >= 0.0;
        if !sound || errors.as_ref().len() < errors_needed(&points) {
            return None;
        }
        errors.as_mut().fill(0.0);
        let parts = |basis: &Basis| {
            let h = basis.response(REFERENCE);
            [h.map(|h| h[0]), h.map(|h| h[1])]
        };
        let response = points[0].response(prior.detection.frequency);
        Some(Self {
            at_reference: core::array::from_fn(|i| parts(&points[i])),
            noise: NoiseModel::new(prior.order, prior.noise_memory, ts)?,
            gains: Gains::new(prior.gains, POINTS)?,
            detector: Detector::new(prior.detection, response, ts)?,
            bases: points,
            prior,
            errors,
            newest: 0,
            u: [0.0; LARGEST_ORDER],
            x: [[[0.0; GAINS]; POINTS]; LARGEST_ORDER],
            samples: 0,
            began: false,
            powers: [0.0; 2],
            variance: [0.0; 2],
            unit: 0.0,
            restarts: 0,
        })
    }

    /// Takes a sample. Both must be finite.
    pub fn step(&mut self, e: f64, u: f64) -> Step {
        let x = self.respond(e);
        let (y, r) = self.whitened(u, &x);
        if !(y.abs() < LARGEST && r.iter().flatten().all(|r| r.abs() < LARGEST)) {
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
            self.learn(y, u, &r, &x)
        } else {
            self.begin(y)
        };
        self.remember(u, x);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`PopulationFilter::step`], but the estimate stays: only the filters move on.
    pub fn step_without_update(&mut self, e: f64, u: f64) -> Step {
        let x = self.respond(e);
        let (y, r) = self.whitened(u, &x);
        self.detector.skip();
        let innovation = self.gains.innovation(y, &r);
        self.keep(u, x, innovation);
        Step {
            innovation,
            shortened: false,
        }
    }

    /// As [`PopulationFilter::step_without_update`] where the output is missing: the one-step
    /// prediction takes its place.
    pub fn bridge(&mut self, e: f64) {
        let x = self.respond(e);
        let (y, r) = self.whitened(0.0, &x);
        self.detector.skip();
        let u = -self.gains.innovation(y, &r);
        self.keep(u, x, u);
    }

    fn keep(&mut self, u: f64, x: [[f64; GAINS]; POINTS], innovation: f64) {
        if innovation.abs() < LARGEST && u.abs() < LARGEST {
            self.remember(u, x);
        } else {
            self.rest();
        }
    }

    /// The responses of all points.
    #[inline(always)]
    fn respond(&mut self, e: f64) -> [[f64; GAINS]; POINTS] {
        let errors = self.errors.as_mut();
        let n = errors.len();
        self.newest = if self.newest + 1 == n { 0 } else { self.newest + 1 };
        errors[self.newest] = e;
        let newest = self.newest;
        let at = |age: usize| errors[if age <= newest { newest - age } else { newest + n - age }];
        let mut x = [[0.0; GAINS]; POINTS];
        for (x, basis) in x.iter_mut().zip(&mut self.bases) {
            let l = basis.delay();
            *x = basis.step([at(l), at(l + 1), at(l + 2)]);
        }
        x
    }

    /// `D u`, and D times the responses and the level.
    #[inline(always)]
    fn whitened(&self, u: f64, x: &[[f64; GAINS]; POINTS]) -> (f64, [[f64; STATES]; POINTS]) {
        let (mut y, mut through) = (u, *x);
        for (j, d) in self.noise.d().iter().enumerate() {
            y += d * self.u[j];
            for (through, past) in through.iter_mut().zip(&self.x[j]) {
                for i in 0..GAINS {
                    through[i] += d * past[i];
                }
            }
        }
        let level = self.noise.sum();
        (y, through.map(|[a, b, c]| [a, b, c, level]))
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

    fn learn(&mut self, y: f64, u: f64, r: &[[f64; STATES]; POINTS], x: &[[f64; GAINS]; POINTS]) -> f64 {
        let p = &self.prior;
        let (ts, n) = (p.gains.sample_time, self.samples as f64);
        let power = self.powers[1] / n;
        let offset = p.offset_drift * p.offset_drift * power;
        let variance = self.variance[0];
        let eps = self.gains.update(y, r, variance, self.unit, offset);
        for (variance, memory) in self.variance.iter_mut().zip(p.level_memory) {
            let share = ts / memory.min(n * ts).max(4.0 * ts);
            let square = LOST * (eps * eps).min(CLIPPED * *variance);
            // What is foretold without an error leaves a level that is still positive.
            *variance = (*variance + share * (square - *variance)).max(1e-20 * power);
        }
        let most = p.gains.limit * libm::sqrt(self.variance[1]);
        let limited = y - eps + eps.clamp(-most, most);
        let settled = n * ts >= SETTLED_S;
        if settled && self.detector.update(&r[0], limited, eps, self.variance[1]) {
            self.gains.open(p.jump * self.unit);
        }
        self.follow_noise(u, eps, x);
        let every = libm::round(SOLVE_S / ts).max(1.0) as u64;
        if self.samples.is_multiple_of(every) {
            self.noise.solve();
            let ([re, im], _) = self.gains.moments(&self.at_reference);
            let share = (every as f64 * ts / UNIT_S).min(1.0);
            self.unit += share * (libm::hypot(re, im) - self.unit);
        }
        eps
    }

    /// v with all its lags by the gains of now.
    fn follow_noise(&mut self, u: f64, eps: f64, x: &[[f64; GAINS]; POINTS]) {
        let order = self.noise.order();
        if self.samples <= order as u64 {
            return;
        }
        let point = self.gains.likeliest();
        let [a, b, c, level] = self.gains.state(point);
        let left = |u: f64, x: &[f64; GAINS]| u - level - a * x[0] - b * x[1] - c * x[2];
        let mut v = [0.0; LARGEST_ORDER + 1];
        v[0] = left(u, &x[point]);
        for j in 0..order {
            v[j + 1] = left(self.u[j], &self.x[j][point]);
        }
        let variance = self.variance[0];
        let excess = (eps * eps / (CLIPPED * variance)).max(1.0);
        self.noise.update(&v, 1.0 / (variance * excess));
    }

    fn remember(&mut self, u: f64, x: [[f64; GAINS]; POINTS]) {
        let order = self.noise.order();
        self.u.copy_within(0..order - 1, 1);
        self.x.copy_within(0..order - 1, 1);
        self.u[0] = u;
        self.x[0] = x;
    }

    /// Brings the filters to rest where a signal has overflowed.
    fn rest(&mut self) {
        self.bases.iter_mut().for_each(Basis::reset);
        self.errors.as_mut().fill(0.0);
        self.u = [0.0; LARGEST_ORDER];
        self.x = [[[0.0; GAINS]; POINTS]; LARGEST_ORDER];
        self.detector.skip();
        self.restarts += 1;
    }

    /// True from when on there is an estimate.
    pub fn began(&self) -> bool {
        self.began
    }

    /// The points of the basis.
    pub fn bases(&self) -> &[Basis; POINTS] {
        &self.bases
    }

    /// The gains.
    pub fn gains(&self) -> &Gains {
        &self.gains
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

/// Errors that the bases need.
pub fn errors_needed(points: &[Basis]) -> usize {
    points.iter().map(Basis::delay).max().unwrap_or(0) + 3
}
