//! The recursion: one sample in, one estimate out.
//!
//! The live candidate ([`super::candidate`]) processes each sample on arrival. This module decides which samples update
//! the estimate and which only advance the filters, and stores the decision for the replays (`replay`). The detector
//! tests the blocks of the live candidate.

mod replay;

pub use replay::REPLAYED;

use super::{
    alternatives::Alternatives,
    basis::{Basis, Complex, Point},
    candidate::{Candidate, LARGEST, LATEST_S},
    detector::Detector,
    history::{History, Use},
    initial_estimate::InitialEstimate,
    mixture::{Mixture, NoiseScales},
    noise::NoiseModel,
    prior::AdaptivePrior,
    saturation::Saturation,
    sizes::{DYNAMICS, GAINS, LINEAR, STATES},
};
use crate::{
    recursion::Step,
    state::{State, visit_all},
};

/// Trust region of the corrections in a replay: shares of omega and zeta, and s.
const NEAR: [f64; DYNAMICS] = [0.15, 0.3, 0.03];
/// Time that a replay skips at its start, s: its filters start at rest, the signals do not.
const AT_REST_S: f64 = 2.0;
/// Time after which constant signals no longer update the estimate, s.
const STILL_S: f64 = 0.1;
/// Time after a constant span until the filters have settled, s.
const SETTLING_S: f64 = 2.0;

/// The recursion. E is the memory of past samples.
#[derive(Debug, Clone, PartialEq)]
pub struct AdaptiveFilter<E> {
    prior: AdaptivePrior,
    origin: Basis,
    initial: Option<InitialEstimate>,
    prior_noise: NoiseModel,
    live: Candidate,
    started: bool,
    trial: Candidate,
    /// 0: no replay; 1: a replay from the estimate; 2 and more: a replay from another starting
    /// point.
    stage: u64,
    /// The next sample of the replay.
    at: u64,
    replays: u64,
    alternatives: Alternatives,
    detector: Detector,
    history: History<E>,
    saturation: Saturation,
    /// Sums of the squares of e, of u, and of `D u` for the prior D: the last bounds the innovation variance from
    /// above, since it is that of a response of zero.
    powers: [f64; 3],
    restarts: u64,
    age: u64,
    /// Number of samples in which neither signal has changed.
    still: u64,
    /// Number of samples since the last of these.
    settling: u64,
    /// Number of samples that only advanced the filters.
    passed: u64,
}

impl<E: AsMut<[f64]>> State for AdaptiveFilter<E> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [
                &mut self.history,
                &mut self.live,
                &mut self.started,
                &mut self.trial,
                &mut self.stage,
                &mut self.at,
                &mut self.replays,
                &mut self.alternatives,
                &mut self.detector,
                &mut self.saturation,
                &mut self.powers,
                &mut self.restarts,
                &mut self.age,
                &mut self.still,
                &mut self.settling,
                &mut self.passed,
            ],
            each,
        );
    }
}

impl<E: AsRef<[f64]> + AsMut<[f64]>> AdaptiveFilter<E> {
    /// Builds the recursion at rest. `memory` holds [`memory_needed`] numbers, or fewer for no replays, at least
    /// [`least_memory`]. `None` for invalid numbers or too little memory.
    pub fn new(prior: AdaptivePrior, memory: E) -> Option<Self> {
        let ts = prior.sample_time;
        if !prior.is_sound() || prior.person.tau > LATEST_S || memory.as_ref().len() < least_memory(ts) {
            return None;
        }
        let basis = Basis::new(prior.person, ts)?;
        let detector = Detector::new(prior.detection)?;
        let prior_noise = NoiseModel::new(prior.order, prior.noise_memory, ts)?;
        let scales = NoiseScales {
            unit: 1.0,
            size: 1.0,
            innovations: 1.0,
            sample_time: ts,
            dispersion: 1.0,
        };
        let mixture = Mixture::new(&prior.changes, &basis, &scales, variances(&prior));
        let live = Candidate::new(
            basis.clone(),
            &prior_noise,
            prior_noise.clone(),
            mixture,
            scales,
            &prior.changes,
            0,
        );
        Some(Self {
            prior,
            origin: basis,
            initial: None,
            prior_noise,
            trial: live.clone(),
            live,
            started: false,
            stage: 0,
            at: 0,
            replays: 0,
            alternatives: Alternatives::NONE,
            detector,
            history: History::new(memory),
            saturation: Saturation::new(),
            powers: [0.0; 3],
            restarts: 0,
            age: 0,
            still: 0,
            settling: 0,
            passed: 0,
        })
    }

    /// Starts immediately from an earlier estimate of the person. `None` for invalid numbers.
    pub fn with_initial_estimate(mut self, known: &InitialEstimate) -> Option<Self> {
        if !known.is_sound() || !known.apply_to_noise(&mut self.prior_noise, self.prior.sample_time) {
            return None;
        }
        self.initial = Some(*known);
        self.live = self.candidate(self.origin.point(), &self.prior_noise, 1.0)?;
        self.started = true;
        Some(self)
    }

    /// Scales of the signals from the data so far.
    fn scales(&self, dispersion: f64) -> NoiseScales {
        let [e, u, y] = self.powers;
        let samples = self.history.samples().max(1) as f64;
        let measured = NoiseScales {
            // |Y| is about sqrt(power of u/power of e): the scale of the prior of the gains.
            unit: libm::sqrt(u / e),
            size: libm::sqrt(u / samples),
            innovations: match (self.started, &self.initial) {
                (true, _) => self.live.mixture.variance(),
                (false, Some(known)) => known.variance,
                (false, None) => y / samples,
            },
            sample_time: self.prior.sample_time,
            dispersion,
        };
        match &self.initial {
            Some(known) => NoiseScales {
                unit: known.unit,
                size: measured.size.max(libm::sqrt(known.covariance[GAINS][GAINS])),
                ..measured
            },
            None => measured,
        }
    }

    /// A candidate that starts at the oldest sample that a replay reads.
    fn candidate(&self, point: Point, d: &NoiseModel, dispersion: f64) -> Option<Candidate> {
        let (ts, changes) = (self.prior.sample_time, &self.prior.changes);
        let basis = Basis::new(point, ts)?;
        let scales = self.scales(dispersion);
        let mixture = match &self.initial {
            Some(known) => {
                let units = self.origin.units_of(&basis);
                let of = |i: usize| units.get(i).copied().unwrap_or(1.0);
                let mut covariance = known.covariance;
                for (i, row) in covariance.iter_mut().enumerate() {
                    for (j, c) in row.iter_mut().enumerate() {
                        *c *= of(i) * of(j);
                    }
                }
                let state = self.origin.carried(&basis, &known.state);
                Mixture::at(changes, state, covariance, known.variance)
            }
            None => {
                // With replays, the basis moves from one replay to the next, and each replay has a trust region about
                // its point; without replays, the corrections have the whole prior of people.
                let dynamics = match self.replays_anything() {
                    true => trusted(point),
                    false => variances(&self.prior),
                };
                Mixture::new(changes, &basis, &scales, dynamics)
            }
        };
        let start = self.history.samples().saturating_sub(self.window());
        let empty = NoiseModel::new(self.prior.order, self.prior.noise_memory, ts)?;
        let there = self.history.samples().saturating_sub(start);
        let skipped = (libm::round(AT_REST_S / ts) as u64).min(there / 2);
        Some(Candidate::new(basis, d, empty, mixture, scales, changes, start).with_skipped(skipped))
    }

    /// Samples that a replay reads.
    pub(super) fn window(&self) -> u64 {
        let delay = errors_needed(self.prior.sample_time);
        self.history.room().saturating_sub(2 * delay) as u64
    }

    fn replays_anything(&self) -> bool {
        self.window() > 0
    }

    /// Takes a sample. Both must be finite.
    pub fn step(&mut self, e: f64, u: f64) -> Step {
        self.respond(e);
        let end = self.saturation.end(u).filter(|_| self.started);
        self.saturation.remember(u);
        self.detector.pass_over();
        if let Some(end) = end {
            // A previous sample with the same output was at the limit as well, which is known only now. The next
            // replay uses it.
            self.history.revise_previous(u, end);
            return self.pass(u, end);
        }
        if self.is_stationary(u) {
            return self.pass(u, Use::FilterOnly);
        }
        self.powers[0] += e * e;
        self.powers[1] += u * u;
        if !self.started {
            // Before, the whitening filter does not have all its outputs.
            if self.history.samples() > self.prior.order as u64 {
                let y = self.live.whitened(u).y;
                self.powers[2] += y * y;
            }
            self.keep(u);
            self.begin();
            return Step {
                innovation: 0.0,
                shortened: false,
            };
        }
        let white = self.live.whitened(u);
        let innovation = self.live.innovation(&white);
        if !self.live.update(&white, u, &self.prior.changes) {
            self.restart();
            return Step {
                innovation: 0.0,
                shortened: true,
            };
        }
        self.age += 1;
        self.keep(u);
        match self.replays_anything() {
            true => self.replay(),
            false => self.live.renew(),
        }
        if self.live.blocks.closed() {
            self.test_for_change();
        }
        Step {
            innovation,
            shortened: false,
        }
    }

    /// True while neither signal changes. There is then no update: the recorder has stopped or the person rests, and
    /// the innovation variance would go to zero.
    #[inline(always)]
    fn is_stationary(&mut self, u: f64) -> bool {
        let samples = self.history.samples();
        let moved = samples < 2 || {
            let (newest, before) = (samples - 1, samples - 2);
            self.history.error(newest, 0) != self.history.error(before, 0) || u != self.history.output(before).0
        };
        let seconds = |samples: u64| samples as f64 * self.prior.sample_time;
        if !moved {
            self.still += 1;
        } else if seconds(self.still) > STILL_S && seconds(self.settling) < SETTLING_S {
            // The filters lack the signals of the constant span and need time to settle.
            self.settling += 1;
        } else {
            (self.still, self.settling) = (0, 0);
        }
        seconds(self.still) > STILL_S
    }

    /// A sample without update.
    fn pass(&mut self, u: f64, use_of_it: Use) -> Step {
        let innovation = self.live.innovation(&self.live.whitened(u));
        let through = through_filters(&self.saturation, use_of_it, u, u - innovation);
        if innovation.abs() < LARGEST && through.abs() < LARGEST {
            self.history.complete(u, use_of_it);
            self.passed += 1;
            remember(&mut self.live, use_of_it, through);
            return Step {
                innovation,
                shortened: false,
            };
        }
        self.restart();
        Step {
            innovation: 0.0,
            shortened: true,
        }
    }

    /// As [`AdaptiveFilter::step`], but the estimate stays constant: only the filters are advanced.
    pub fn step_without_update(&mut self, e: f64, u: f64) -> Step {
        self.respond(e);
        self.detector.pass_over();
        self.pass(u, Use::FilterOnly)
    }

    /// As [`AdaptiveFilter::step_without_update`] for a missing output, which the one-step prediction replaces.
    pub fn bridge(&mut self, e: f64) {
        self.respond(e);
        self.detector.pass_over();
        self.pass(0.0, Use::Missing);
    }

    /// Advances the basis by a sample.
    #[inline(always)]
    fn respond(&mut self, e: f64) {
        self.history.push(e);
        let newest = self.history.samples() - 1;
        let history = &self.history;
        self.live.respond(|age| history.error(newest, age));
    }

    fn keep(&mut self, u: f64) {
        self.history.complete(u, Use::Update);
        self.live.remember(u);
    }

    /// Step 12: tests the last blocks for a change.
    fn test_for_change(&mut self) {
        let dynamics = core::array::from_fn(|j| self.live.mixture.mean()[LINEAR + j]);
        self.detector.test(&self.live.blocks, dynamics);
    }

    /// Restarts after an overflow of a signal.
    fn restart(&mut self) {
        self.history.clear();
        self.detector.pass_over();
        self.saturation = Saturation::new();
        (self.powers, self.stage, self.age, self.replays, self.passed) = ([0.0; 3], 0, 0, 0, 0);
        self.alternatives = Alternatives::NONE;
        self.restarts += 1;
        self.started = false;
        if let Some(live) = self.candidate(self.origin.point(), &self.prior_noise, 1.0) {
            self.live = live;
            self.started = self.initial.is_some();
        }
    }

    /// True once there is an estimate.
    pub fn has_started(&self) -> bool {
        self.started
    }

    /// Returns the number of samples that have updated the estimate.
    pub fn samples(&self) -> u64 {
        self.age
    }

    /// True if the estimate started at an earlier fit of the person.
    pub fn has_initial_estimate(&self) -> bool {
        self.initial.is_some()
    }

    /// Returns the sample time, s.
    pub fn sample_time(&self) -> f64 {
        self.prior.sample_time
    }

    /// Returns the basis.
    pub fn basis(&self) -> &Basis {
        self.live.basis()
    }

    pub(super) fn alternatives(&self) -> &Alternatives {
        &self.alternatives
    }

    /// Number of samples of the record that updated the estimate: samples without information do
    /// not age old results.
    pub(super) fn read(&self) -> u64 {
        self.history.samples().saturating_sub(self.passed)
    }

    pub(super) fn live(&self) -> &Candidate {
        &self.live
    }

    /// Returns the current basis point with its corrections, limited to the range of the basis.
    pub fn dynamics(&self) -> Point {
        self.live.point()
    }

    /// Returns the response of each gain at a frequency in rad/s, at the current point.
    pub fn responses(&self, omega_rad_s: f64) -> [Complex; GAINS] {
        self.live.responses(omega_rad_s)
    }

    /// Returns Y at a frequency in rad/s.
    pub fn response(&self, omega_rad_s: f64) -> Complex {
        self.live.response(omega_rad_s)
    }

    /// Returns Y at a frequency in rad/s, with the derivatives of its real and its imaginary part with respect to
    /// gains, level and corrections: exact for the gains, finite differences for the corrections.
    pub fn response_with_derivatives(&self, omega_rad_s: f64) -> (Complex, [[f64; STATES]; 2]) {
        self.live.response_with_derivatives(omega_rad_s)
    }

    /// Returns the detector.
    pub fn detector(&self) -> &Detector {
        &self.detector
    }

    /// Returns the coefficients of D after the 1.
    pub fn d(&self) -> &[f64] {
        self.live.d()
    }

    /// Returns the noise model.
    pub fn noise(&self) -> &NoiseModel {
        &self.live.noise
    }

    /// Returns the variance of eps.
    pub fn variance(&self) -> f64 {
        self.live.mixture.variance()
    }

    /// Returns the number of overflows after which the filters were reset.
    pub fn restarts(&self) -> u64 {
        self.restarts
    }
}

fn remember(candidate: &mut Candidate, use_of_it: Use, u: f64) {
    match use_of_it {
        Use::Update => {}
        Use::FilterOnly | Use::Missing => candidate.blocks.skip(),
        Use::AtUpperLimit | Use::AtLowerLimit => candidate.blocks.pass_over(),
    }
    match use_of_it {
        Use::Update | Use::FilterOnly => candidate.remember(u),
        _ => candidate.remember_prediction(u),
    }
}

/// The output that enters the filters.
fn through_filters(saturation: &Saturation, use_of_it: Use, u: f64, predicted: f64) -> f64 {
    match use_of_it {
        Use::Missing => predicted,
        _ => saturation.beyond(use_of_it, u, predicted),
    }
}

/// Prior variances of the corrections.
fn variances(prior: &AdaptivePrior) -> [f64; DYNAMICS] {
    let [omega, zeta, tau] = prior.spread;
    [omega * prior.person.omega, zeta * prior.person.zeta, tau].map(|s| s * s)
}

/// Variances of the trust region of a replay.
fn trusted(point: Point) -> [f64; DYNAMICS] {
    let [omega, zeta, tau] = NEAR;
    [omega * point.omega, zeta * point.zeta, tau].map(|s| s * s)
}

/// Returns the number of past errors for the longest delay, for a sample time in s.
pub fn errors_needed(sample_time: f64) -> usize {
    libm::ceil(LATEST_S / sample_time) as usize + 4
}

/// Returns the least number of memory entries, for a sample time in s.
pub fn least_memory(sample_time: f64) -> usize {
    3 * errors_needed(sample_time)
}

/// Largest number of samples of a replay.
const MOST_REPLAYED: f64 = 12_000.0;

/// Returns the number of memory entries for replays over `seconds`, for a sample time in s.
pub fn memory_needed(sample_time: f64, seconds: f64) -> usize {
    let samples = (seconds / sample_time).clamp(0.0, MOST_REPLAYED);
    3 * (2 * errors_needed(sample_time) + libm::ceil(samples) as usize)
}
