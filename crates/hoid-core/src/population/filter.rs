//! The recursion: the one who is believed, their rivals, and the detector.

use super::{
    basis::{Basis, Complex, Point},
    blocks::Row,
    contest::Contest,
    detector::Detector,
    ends::Ends,
    follower::{Follower, LARGEST, LATEST_S, Learnt, Past},
    gains::Gains,
    known::Known,
    noise::NoiseModel,
    prior::PopulationPrior,
    sizes::{GAINS, HELD, LARGEST_ORDER, LINEAR, PARAMETERS, STATES},
};
use crate::{
    recursion::Step,
    state::{State, visit_all},
};

/// Time from which blocks are kept for the detector: before that D is what was supposed, s.
const SETTLED_S: f64 = 5.0;

/// The recursion. E is the memory for past errors.
#[derive(Debug, Clone, PartialEq)]
pub struct PopulationFilter<E> {
    prior: PopulationPrior,
    origin: Point,
    believed: Follower,
    contest: Contest,
    detector: Detector,
    errors: E,
    newest: usize,
    u: [f64; LARGEST_ORDER],
    ends: Ends,
    restarts: u64,
    /// Samples for which there has been an estimate that began where this one did, and those of the
    /// one that was left at the last sample.
    age: u64,
    left: u64,
}

impl<E: AsMut<[f64]>> State for PopulationFilter<E> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        self.errors.as_mut().visit(each);
        visit_all(
            &mut [
                &mut self.believed,
                &mut self.contest,
                &mut self.detector,
                &mut self.newest,
                &mut self.u,
                &mut self.ends,
                &mut self.restarts,
                &mut self.age,
                &mut self.left,
            ],
            each,
        );
    }
}

impl<E: AsRef<[f64]> + AsMut<[f64]>> PopulationFilter<E> {
    /// At rest. `errors` is memory for [`errors_needed`] numbers. `None` for numbers that make no
    /// sense, or too little memory.
    pub fn new(basis: Basis, prior: PopulationPrior, mut errors: E) -> Option<Self> {
        let ts = prior.gains.sample_time;
        if !prior.is_sound() || basis.point().tau > LATEST_S || errors.as_ref().len() < errors_needed(ts) {
            return None;
        }
        errors.as_mut().fill(0.0);
        let origin = basis.point();
        let response = basis.response(prior.detection.frequency, basis.point());
        let detector = Detector::new(prior.detection, response, ts)?;
        let believed = Follower::new(basis, &prior)?;
        let u = [0.0; LARGEST_ORDER];
        let mut contest = Contest::new(&believed);
        let past = Past {
            errors: errors.as_ref(),
            newest: 0,
            u: &u,
        };
        contest.begin(&prior, &believed, &past, false);
        Some(Self {
            prior,
            origin,
            believed,
            contest,
            detector,
            errors,
            newest: 0,
            u,
            ends: Ends::new(),
            restarts: 0,
            age: 0,
            left: 0,
        })
    }

    /// Begins at once, at what is known of the person, without rivals until a change is declared. `None`
    /// for numbers that make no sense.
    pub fn knowing(mut self, known: &Known) -> Option<Self> {
        let sound = self.believed.knowing(known, self.prior.gains.sample_time);
        self.contest.end();
        sound.then_some(self)
    }

    /// Takes a sample. Both must be finite.
    pub fn step(&mut self, e: f64, u: f64) -> Step {
        self.respond(e);
        if let Some(step) = self.at_an_end(u) {
            return step;
        }
        let past = Past {
            errors: self.errors.as_ref(),
            newest: self.newest,
            u: &self.u,
        };
        let Some(learnt) = self.believed.step(&self.prior, &past, u) else {
            self.rest();
            return Step {
                innovation: 0.0,
                shortened: true,
            };
        };
        self.age += u64::from(self.believed.began);
        if self.contest.is_open() && self.contest.step(&self.prior, &past, u, &mut self.believed, &learnt) {
            (self.left, self.age) = (self.age, 0);
            self.detector.forget();
        } else {
            if self.look_for_changes(&learnt, u) {
                let past = Past {
                    errors: self.errors.as_ref(),
                    newest: self.newest,
                    u: &self.u,
                };
                self.contest.begin(&self.prior, &self.believed, &past, true);
            }
        }
        self.remember(u);
        Step {
            innovation: learnt.innovation,
            shortened: false,
        }
    }

    /// Nothing is learnt of a stick that stands at its end ([`super::ends`]).
    #[inline(always)]
    fn at_an_end(&mut self, u: f64) -> Option<Step> {
        let ends = self.ends;
        self.ends.remember(u);
        if !self.believed.began || ends.beyond(u, u).is_none() {
            return None;
        }
        let innovation = self.foretold(u);
        let u = ends.beyond(u, u - innovation)?;
        self.detector.pass_over();
        self.keep(u, innovation);
        Some(Step {
            innovation,
            shortened: false,
        })
    }

    /// As [`PopulationFilter::step`], but the estimate stays: only the filters move on.
    pub fn step_without_update(&mut self, e: f64, u: f64) -> Step {
        self.respond(e);
        self.detector.skip();
        let innovation = self.foretold(u);
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
        self.detector.skip();
        let u = -self.foretold(0.0);
        self.keep(u, u);
    }

    fn foretold(&self, u: f64) -> f64 {
        let past = Past {
            errors: self.errors.as_ref(),
            newest: self.newest,
            u: &self.u,
        };
        let white = self.believed.whitened(&past, u);
        self.believed.gains.innovation(white.y, &white.regressors, white.level)
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
        self.left = 0;
        let errors = self.errors.as_mut();
        self.newest = if self.newest + 1 >= errors.len() {
            0
        } else {
            self.newest + 1
        };
        errors[self.newest] = e;
        let past = Past {
            errors: self.errors.as_ref(),
            newest: self.newest,
            u: &self.u,
        };
        self.believed.respond(&past);
        if self.contest.is_open() {
            self.contest.respond(&past);
        }
    }

    /// What the detector says of a sample, with the responses where the corrections point.
    #[inline(always)]
    fn look_for_changes(&mut self, learnt: &Learnt, u: f64) -> bool {
        let Some(state) = learnt.state else { return false };
        let past = Past {
            errors: self.errors.as_ref(),
            newest: self.newest,
            u: &self.u,
        };
        let moved = past.error(0) != past.error(1) || u != self.u[0];
        let (p, believed) = (&self.prior, &mut self.believed);
        let Learnt {
            white, innovation: eps, ..
        } = learnt;
        if believed.is_renewed() {
            self.detector.look_at(believed.responses(p.detection.frequency));
        }
        if (believed.samples as f64) * p.gains.sample_time < SETTLED_S {
            return false;
        }
        let most = p.gains.limit * libm::sqrt(believed.variance[1]);
        let limited = white.y - eps + eps.max(-most).min(most);
        let (mut r, mut q) = ([0.0; LINEAR], [0.0; HELD]);
        for i in 0..GAINS {
            r[i] = white.regressors.x[i];
            for j in 0..HELD {
                let by = white.regressors.by[j][i];
                r[i] += state[LINEAR + j] * by;
                q[j] += state[i] * by;
            }
        }
        r[GAINS] = white.level;
        let Point { omega, zeta, tau, .. } = believed.place.basis().point();
        let at = self.origin;
        let changed = self.detector.update(
            &Row {
                r,
                q,
                p: [
                    omega - at.omega + state[LINEAR],
                    zeta - at.zeta + state[LINEAR + 1],
                    tau - at.tau + state[LINEAR + 2],
                ],
                y: limited,
                innovation: *eps,
                variance: believed.variance[1],
            },
            moved,
        );
        if changed {
            believed.gains.open(p.jump * believed.unit);
            let [_, system, delay] = self.detector.difference().changed;
            if system || delay {
                believed.gains.open_held(believed.place.basis().point());
            }
        }
        changed
    }

    fn remember(&mut self, u: f64) {
        self.u.copy_within(0..LARGEST_ORDER - 1, 1);
        self.u[0] = u;
        self.believed.remember();
        if self.contest.is_open() {
            self.contest.remember();
        }
    }

    /// Brings the filters to rest where a signal has overflowed.
    fn rest(&mut self) {
        self.believed.place.rest();
        self.contest.end();
        self.errors.as_mut().fill(0.0);
        self.u = [0.0; LARGEST_ORDER];
        self.detector.skip();
        self.restarts += 1;
    }

    /// True from when on there is an estimate.
    pub fn began(&self) -> bool {
        self.believed.began
    }

    /// Samples that the estimate of now has seen.
    pub fn samples(&self) -> u64 {
        self.believed.samples
    }

    /// True from when on neuromuscular system and delay are corrected.
    pub fn corrects(&self) -> bool {
        self.believed.reopened
    }

    /// True where an earlier fit of the person stood at the beginning of the estimate of now.
    pub fn is_known(&self) -> bool {
        self.believed.is_known()
    }

    /// How far people are from the basis before the first sample: shares of omega and zeta, and s for the
    /// delay.
    pub fn spread(&self) -> [f64; HELD] {
        self.prior.gains.held
    }

    /// s.
    pub fn sample_time(&self) -> f64 {
        self.prior.gains.sample_time
    }

    /// The basis.
    pub fn basis(&self) -> &Basis {
        self.believed.place.basis()
    }

    /// The gains.
    pub fn gains(&self) -> &Gains {
        &self.believed.gains
    }

    pub(super) fn believed(&self) -> &Follower {
        &self.believed
    }

    /// How far the operators of others are who foretell u about as well, those that are told and those that
    /// compete: means of the products of their distances.
    pub fn scatter(&self) -> [[f64; PARAMETERS]; PARAMETERS] {
        self.contest.scatter()
    }

    /// Where what is held is now, the corrections included: never outside of where the basis may be.
    pub fn held(&self) -> Point {
        self.believed.corrected(&self.believed.gains.state())
    }

    /// The response of each gain at a frequency in rad/s, for what is held now.
    pub fn responses(&self, omega_rad_s: f64) -> [Complex; GAINS] {
        self.believed.responses(omega_rad_s)
    }

    /// Y at a frequency in rad/s.
    pub fn response(&self, omega_rad_s: f64) -> Complex {
        self.believed.response(omega_rad_s)
    }

    /// Y at a frequency in rad/s, with the derivatives of its real and its imaginary part by gains,
    /// level and corrections: exact by the gains, differences by the corrections.
    pub fn response_with_derivatives(&self, omega_rad_s: f64) -> (Complex, [[f64; STATES]; 2]) {
        self.believed.response_with_derivatives(omega_rad_s)
    }

    /// The detector.
    pub fn detector(&self) -> &Detector {
        &self.detector
    }

    /// Coefficients of D behind the 1.
    pub fn d(&self) -> &[f64] {
        self.believed.noise.d()
    }

    /// The noise model.
    pub fn noise(&self) -> &NoiseModel {
        &self.believed.noise
    }

    /// Variance of eps of the last seconds.
    pub fn variance(&self) -> f64 {
        self.believed.variance[0]
    }

    /// How often a signal overflowed and the filters were brought to rest.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }

    /// Where at the last sample an estimate that began elsewhere took the place of another: the samples
    /// for which that one was told.
    pub fn left_behind(&self) -> Option<u64> {
        (self.left > 0).then_some(self.left)
    }

    /// Where the first basis was made; the detector's values of what is held are about it.
    pub fn origin(&self) -> Point {
        self.origin
    }
}

/// Errors that are kept, for a sample time in s: those of the longest delay.
pub fn errors_needed(sample_time: f64) -> usize {
    libm::ceil(LATEST_S / sample_time) as usize + 4
}
