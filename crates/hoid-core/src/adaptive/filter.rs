//! Adaptive recursion: takes one sample and updates the estimate.
//!
//! The live candidate ([`super::candidate`]) processes each sample on arrival. This module decides which samples update
//! the estimate and which only advance the filters, and stores this decision for the replays (`replay`). The detector
//! tests the blocks of the live candidate.

mod replay;

pub use replay::REPLAY_SAMPLES_PER_STEP;

use super::{
    alternatives::Alternatives,
    basis::{Basis, Complex, Point},
    candidate::{Candidate, LONGEST_DELAY_S, MAX_SIGNAL},
    detector::Detector,
    history::{History, SampleUse},
    initial_estimate::InitialEstimate,
    mixture::{Mixture, NoiseScales, gain_and_lead_directions},
    noise::NoiseModel,
    prior::AdaptivePrior,
    saturation::Saturation,
    sizes::{DYNAMICS_COUNT, GAIN_COUNT, LINEAR_COUNT, STATE_COUNT},
};
use crate::{
    recursion::Step,
    state::{State, visit_all},
};

/// Trust region of the corrections in a replay, as standard deviations: relative for omega and zeta, in s for tau.
const TRUST_DEVIATIONS: [f64; DYNAMICS_COUNT] = [0.15, 0.3, 0.03];
/// Initial part of a replay, in s, that does not update the estimate: the filters start at rest, but the recorded
/// signals do not.
const REPLAY_RUN_IN_S: f64 = 2.0;
/// Time in s for which the signals must be constant before their samples no longer update the estimate.
const STATIONARY_AFTER_S: f64 = 0.1;
/// Time in s in which the filters settle after a span of constant signals.
const SETTLING_S: f64 = 2.0;

/// Adaptive recursion. E is the memory for past samples.
#[derive(Debug, Clone, PartialEq)]
pub struct AdaptiveFilter<E> {
    prior: AdaptivePrior,
    origin: Basis,
    initial: Option<InitialEstimate>,
    prior_noise: NoiseModel,
    live: Candidate,
    started: bool,
    trial: Candidate,
    /// Stage of the replay: 0 for no replay, 1 for a replay from the estimate, 2 or more for a replay from another
    /// starting point.
    replay_stage: u64,
    /// Index of the next sample of the replay.
    next_sample: u64,
    replays: u64,
    alternatives: Alternatives,
    detector: Detector,
    history: History<E>,
    saturation: Saturation,
    /// Sums of the squares of e, of u, and of `D u` with the prior D. The third sum gives an upper bound for the
    /// innovation variance, namely the variance for an operator that does not respond to e.
    powers: [f64; 3],
    restarts: u64,
    age: u64,
    /// Number of samples in the current or last span of constant signals.
    constant_samples: u64,
    /// Number of samples since the end of that span of constant signals.
    settling: u64,
    /// Number of samples that advanced the filters without updating the estimate.
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
                &mut self.replay_stage,
                &mut self.next_sample,
                &mut self.replays,
                &mut self.alternatives,
                &mut self.detector,
                &mut self.saturation,
                &mut self.powers,
                &mut self.restarts,
                &mut self.age,
                &mut self.constant_samples,
                &mut self.settling,
                &mut self.passed,
            ],
            each,
        );
    }
}

impl<E: AsRef<[f64]> + AsMut<[f64]>> AdaptiveFilter<E> {
    /// Builds the recursion at rest. If `memory` has [`memory_needed`] numbers, the replays have their full length.
    /// With fewer numbers the replays are shorter, and with [`min_memory`], the minimum, there are none. Returns
    /// `None` for invalid numbers or too little memory.
    pub fn new(prior: AdaptivePrior, memory: E) -> Option<Self> {
        let ts = prior.sample_time;
        if !prior.is_valid() || prior.person.tau > LONGEST_DELAY_S || memory.as_ref().len() < min_memory(ts) {
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
        let mixture = Mixture::new(&prior.changes, &basis, &scales, correction_variances(&prior));
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
            replay_stage: 0,
            next_sample: 0,
            replays: 0,
            alternatives: Alternatives::EMPTY,
            detector,
            history: History::new(memory),
            saturation: Saturation::new(),
            powers: [0.0; 3],
            restarts: 0,
            age: 0,
            constant_samples: 0,
            settling: 0,
            passed: 0,
        })
    }

    /// Makes the recursion start immediately from an earlier estimate of the operator. Returns `None` for invalid
    /// numbers.
    pub fn with_initial_estimate(mut self, known: &InitialEstimate) -> Option<Self> {
        if !known.is_valid() || !known.apply_to_noise(&mut self.prior_noise, self.prior.sample_time) {
            return None;
        }
        self.initial = Some(*known);
        self.live = self.build_candidate(self.origin.point(), &self.prior_noise, 1.0)?;
        self.started = true;
        Some(self)
    }

    /// Scales of the signals, from the data so far.
    fn noise_scales(&self, dispersion: f64) -> NoiseScales {
        let [e, u, y] = self.powers;
        let samples = self.history.sample_count().max(1) as f64;
        let measured = NoiseScales {
            // |Y| is about sqrt(power of u/power of e), the scale of the prior of the gains.
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
                size: measured.size.max(libm::sqrt(known.covariance[GAIN_COUNT][GAIN_COUNT])),
                ..measured
            },
            None => measured,
        }
    }

    /// Builds a candidate that starts at the oldest sample of a replay.
    fn build_candidate(&self, point: Point, d: &NoiseModel, dispersion: f64) -> Option<Candidate> {
        let (ts, changes) = (self.prior.sample_time, &self.prior.changes);
        let basis = Basis::new(point, ts)?;
        let scales = self.noise_scales(dispersion);
        let mixture = match &self.initial {
            Some(known) => {
                let units = self.origin.gain_conversion(&basis);
                let of = |i: usize| units.get(i).copied().unwrap_or(1.0);
                let mut covariance = known.covariance;
                for (i, row) in covariance.iter_mut().enumerate() {
                    for (j, c) in row.iter_mut().enumerate() {
                        *c *= of(i) * of(j);
                    }
                }
                let state = self.origin.convert_state(&basis, &known.state);
                Mixture::at(changes, state, covariance, known.variance)
            }
            None => {
                // With replays, the basis changes from one replay to the next, and each replay has a trust region about
                // its point. Without replays, the corrections have the full prior for a person.
                let dynamics = match self.has_replays() {
                    true => trust_region(point),
                    false => correction_variances(&self.prior),
                };
                Mixture::new(changes, &basis, &scales, dynamics)
            }
        };
        let start = self.history.sample_count().saturating_sub(self.max_replay_samples());
        let empty = NoiseModel::new(self.prior.order, self.prior.noise_memory, ts)?;
        let there = self.history.sample_count().saturating_sub(start);
        let skipped = (libm::round(REPLAY_RUN_IN_S / ts) as u64).min(there / 2);
        Some(Candidate::new(basis, d, empty, mixture, scales, changes, start).with_skipped(skipped))
    }

    /// Maximum number of samples that a replay reads.
    pub(super) fn max_replay_samples(&self) -> u64 {
        let delay = errors_needed(self.prior.sample_time);
        self.history.capacity().saturating_sub(2 * delay) as u64
    }

    fn has_replays(&self) -> bool {
        self.max_replay_samples() > 0
    }

    /// Takes a sample. e and u must be finite.
    pub fn step(&mut self, e: f64, u: f64) -> Step {
        self.advance_basis(e);
        let end = self.saturation.limit_reached(u).filter(|_| self.started);
        self.saturation.update(u);
        self.detector.ignore_sample();
        if let Some(end) = end {
            // When a limit is first recognised, the previous sample, which had the same output, was already at this
            // limit. Its correction takes effect in the next replay.
            self.history.revise_previous(u, end);
            return self.process_without_update(u, end);
        }
        if self.is_stationary(u) {
            return self.process_without_update(u, SampleUse::FilterOnly);
        }
        self.powers[0] += e * e;
        self.powers[1] += u * u;
        if !self.started {
            // At the first samples the whitening filter does not yet contain enough outputs.
            if self.history.sample_count() > self.prior.order as u64 {
                let y = self.live.whiten(u).y;
                self.powers[2] += y * y;
            }
            self.store_sample(u);
            self.try_to_start();
            return Step {
                innovation: 0.0,
                shortened: false,
            };
        }
        let white = self.live.whiten(u);
        let innovation = self.live.innovation(&white);
        if !self.live.update(&white, u, &self.prior.changes) {
            self.restart();
            return Step {
                innovation: 0.0,
                shortened: true,
            };
        }
        self.age += 1;
        self.store_sample(u);
        match self.has_replays() {
            true => self.replay(),
            false => self.live.update_whitening(),
        }
        if self.live.blocks.is_block_complete() {
            self.test_for_change();
        }
        Step {
            innovation,
            shortened: false,
        }
    }

    /// True once neither signal has changed for longer than `STATIONARY_AFTER_S`, and afterwards until the filters have settled.
    /// The estimate is then not updated: the recorder has stopped or the person is resting, and the innovation variance
    /// would tend to zero.
    #[inline(always)]
    fn is_stationary(&mut self, u: f64) -> bool {
        let samples = self.history.sample_count();
        let moved = samples < 2 || {
            let (newest, before) = (samples - 1, samples - 2);
            self.history.error(newest, 0) != self.history.error(before, 0) || u != self.history.output(before).0
        };
        let seconds = |samples: u64| samples as f64 * self.prior.sample_time;
        if !moved {
            self.constant_samples += 1;
        } else if seconds(self.constant_samples) > STATIONARY_AFTER_S && seconds(self.settling) < SETTLING_S {
            // The filters contain constant signals and need time to settle.
            self.settling += 1;
        } else {
            (self.constant_samples, self.settling) = (0, 0);
        }
        seconds(self.constant_samples) > STATIONARY_AFTER_S
    }

    /// Processes a sample without an update of the estimate.
    fn process_without_update(&mut self, u: f64, sample_use: SampleUse) -> Step {
        let innovation = self.live.innovation(&self.live.whiten(u));
        let through = filter_output(&self.saturation, sample_use, u, u - innovation);
        if innovation.abs() < MAX_SIGNAL && through.abs() < MAX_SIGNAL {
            self.history.complete(u, sample_use);
            self.passed += 1;
            store(&mut self.live, sample_use, through);
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

    /// Like [`AdaptiveFilter::step`], but the estimate stays constant and only the filters are advanced.
    pub fn step_without_update(&mut self, e: f64, u: f64) -> Step {
        self.advance_basis(e);
        self.detector.ignore_sample();
        self.process_without_update(u, SampleUse::FilterOnly)
    }

    /// Like [`AdaptiveFilter::step_without_update`], for a sample without u; the one-step prediction replaces the
    /// missing output.
    pub fn bridge(&mut self, e: f64) {
        self.advance_basis(e);
        self.detector.ignore_sample();
        self.process_without_update(0.0, SampleUse::Missing);
    }

    /// Advances the basis by one sample.
    #[inline(always)]
    fn advance_basis(&mut self, e: f64) {
        self.history.push(e);
        let newest = self.history.sample_count() - 1;
        let history = &self.history;
        self.live.advance_basis(|age| history.error(newest, age));
    }

    fn store_sample(&mut self, u: f64) {
        self.history.complete(u, SampleUse::Update);
        self.live.store(u);
    }

    /// Step 12: tests the last blocks of the live candidate for a change.
    fn test_for_change(&mut self) {
        let dynamics = core::array::from_fn(|j| self.live.mixture.mean()[LINEAR_COUNT + j]);
        let directions = gain_and_lead_directions(self.live.basis());
        self.detector.test(&self.live.blocks, dynamics, directions);
    }

    /// Restarts the recursion after an overflow of a signal.
    fn restart(&mut self) {
        self.history.clear();
        self.detector.ignore_sample();
        self.saturation = Saturation::new();
        (self.powers, self.replay_stage, self.age, self.replays, self.passed) = ([0.0; 3], 0, 0, 0, 0);
        self.alternatives = Alternatives::EMPTY;
        self.restarts += 1;
        self.started = false;
        if let Some(live) = self.build_candidate(self.origin.point(), &self.prior_noise, 1.0) {
            self.live = live;
            self.started = self.initial.is_some();
        }
    }

    /// True once there is an estimate.
    pub fn has_started(&self) -> bool {
        self.started
    }

    /// Returns the number of samples that have updated the estimate.
    pub fn update_count(&self) -> u64 {
        self.age
    }

    /// True if the recursion started from an earlier fit of the person.
    pub fn has_initial_estimate(&self) -> bool {
        self.initial.is_some()
    }

    /// Returns the sample time in s.
    pub fn sample_time(&self) -> f64 {
        self.prior.sample_time
    }

    /// Returns the basis of the live candidate.
    pub fn basis(&self) -> &Basis {
        self.live.basis()
    }

    pub(super) fn alternatives(&self) -> &Alternatives {
        &self.alternatives
    }

    /// Number of samples of the record, excluding those that did not update the estimate, since samples without
    /// information do not make old results obsolete.
    pub(super) fn informative_samples(&self) -> u64 {
        self.history.sample_count().saturating_sub(self.passed)
    }

    pub(super) fn live_candidate(&self) -> &Candidate {
        &self.live
    }

    /// Returns the current basis point plus its corrections, limited to the range of the basis.
    pub fn dynamics(&self) -> Point {
        self.live.point()
    }

    /// Returns the frequency responses by which the gains are multiplied, at a frequency in rad/s and at the current
    /// point.
    pub fn responses(&self, omega_rad_s: f64) -> [Complex; GAIN_COUNT] {
        self.live.responses(omega_rad_s)
    }

    /// Returns the frequency response Y of the operator at a frequency in rad/s.
    pub fn response(&self, omega_rad_s: f64) -> Complex {
        self.live.response(omega_rad_s)
    }

    /// Returns Y at a frequency in rad/s, with the derivatives of its real and imaginary parts with respect to gains,
    /// level and corrections. The derivatives are exact for the gains and finite differences for the corrections.
    pub fn response_with_derivatives(&self, omega_rad_s: f64) -> (Complex, [[f64; STATE_COUNT]; 2]) {
        self.live.response_with_derivatives(omega_rad_s)
    }

    /// Returns the change detector.
    pub fn detector(&self) -> &Detector {
        &self.detector
    }

    /// Returns the coefficients of the whitening filter D after the leading 1.
    pub fn d(&self) -> &[f64] {
        self.live.d()
    }

    /// Returns the noise model.
    pub fn noise_model(&self) -> &NoiseModel {
        &self.live.noise
    }

    /// Returns the innovation variance.
    pub fn variance(&self) -> f64 {
        self.live.mixture.variance()
    }

    /// Returns the number of overflows after which the filters were reset.
    pub fn restart_count(&self) -> u64 {
        self.restarts
    }
}

fn store(candidate: &mut Candidate, sample_use: SampleUse, u: f64) {
    match sample_use {
        SampleUse::Update => {}
        SampleUse::FilterOnly | SampleUse::Missing => candidate.blocks.count_unused_sample(),
        SampleUse::AtUpperLimit | SampleUse::AtLowerLimit => candidate.blocks.ignore_sample(),
    }
    match sample_use {
        SampleUse::Update | SampleUse::FilterOnly => candidate.store(u),
        _ => candidate.store_prediction(u),
    }
}

/// Output that the filters receive for a sample: measured, predicted, or beyond a limit of the stick.
fn filter_output(saturation: &Saturation, sample_use: SampleUse, u: f64, predicted: f64) -> f64 {
    match sample_use {
        SampleUse::Missing => predicted,
        _ => saturation.replacement(sample_use, u, predicted),
    }
}

/// Prior variances of the corrections of omega, zeta and tau.
fn correction_variances(prior: &AdaptivePrior) -> [f64; DYNAMICS_COUNT] {
    let [omega, zeta, tau] = prior.spread;
    [omega * prior.person.omega, zeta * prior.person.zeta, tau].map(|s| s * s)
}

/// Variances of the corrections in the trust region of a replay.
fn trust_region(point: Point) -> [f64; DYNAMICS_COUNT] {
    let [omega, zeta, tau] = TRUST_DEVIATIONS;
    [omega * point.omega, zeta * point.zeta, tau].map(|s| s * s)
}

/// Returns the number of past errors that must be stored for the longest delay. The sample time is in s.
pub fn errors_needed(sample_time: f64) -> usize {
    libm::ceil(LONGEST_DELAY_S / sample_time) as usize + 4
}

/// Returns the minimum length of the memory in numbers. The sample time is in s.
pub fn min_memory(sample_time: f64) -> usize {
    3 * errors_needed(sample_time)
}

/// Maximum number of samples in a replay.
const MAX_REPLAY_SAMPLES: f64 = 12_000.0;

/// Returns the length of the memory, in numbers, for replays over `seconds`. The sample time is in s.
pub fn memory_needed(sample_time: f64, seconds: f64) -> usize {
    let samples = (seconds / sample_time).clamp(0.0, MAX_REPLAY_SAMPLES);
    3 * (2 * errors_needed(sample_time) + libm::ceil(samples) as usize)
}
