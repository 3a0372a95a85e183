//! Adaptive recursion: takes one sample and updates the estimate.
//!
//! The live candidate ([`super::candidate`]) processes each sample on arrival. This module decides which samples update
//! the estimate and which only advance the filters, and stores this decision for the replays (`replay`). The detector
//! tests the blocks of the live candidate.

mod replay;

pub use replay::REPLAY_SAMPLES_PER_STEP;

use super::{
    alternatives::Alternatives,
    bases::Bases,
    basis::{Basis, Complex, Point},
    candidate::{Candidate, MAX_SIGNAL},
    detector::Detector,
    history::{History, SampleUse},
    initial_estimate::InitialEstimate,
    memory::{errors_needed, min_memory_of},
    mixture::{Mixture, NoiseScales, gain_and_lead_directions},
    noise::NoiseModel,
    prior::{AdaptivePrior, DelayPrior},
    saturation::Saturation,
    sizes::{
        DYNAMICS_COUNT, GAIN_COUNT, PRODUCT_COUNT, STATE_COUNT, SUM_COUNT, correction_places, input_count,
        product_count, state_count, sum_count,
    },
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
/// Time in s that the filters take to settle after a span of constant signals.
const SETTLING_S: f64 = 2.0;

/// Adaptive recursion. E is the memory for past samples and I the number of inputs; S ([`state_count`]), M
/// ([`sum_count`]) and P ([`product_count`]) follow from I.
#[derive(Debug, Clone, PartialEq)]
pub struct AdaptiveFilter<
    E,
    const I: usize = 1,
    const S: usize = STATE_COUNT,
    const M: usize = SUM_COUNT,
    const P: usize = PRODUCT_COUNT,
> {
    prior: AdaptivePrior,
    /// Priors of the delays of all inputs.
    delays: [DelayPrior; I],
    origin: Bases<I>,
    initial: Option<InitialEstimate<I, S>>,
    prior_noise: NoiseModel,
    live: Candidate<I, S, M, P>,
    started: bool,
    trial: Candidate<I, S, M, P>,
    /// Stage of the replay: 0 for no replay, 1 for a replay from the estimate, 2 or more for a replay from another
    /// starting point.
    replay_stage: u64,
    /// Index of the next sample of the replay.
    next_sample: u64,
    replays: u64,
    alternatives: Alternatives<I>,
    detector: Detector<I, S>,
    history: History<E, I>,
    saturation: Saturation,
    /// Sums of the squares of each input.
    input_powers: [f64; I],
    /// Sums of the squares of u, and of `D u` with the prior D. The second sum gives an upper bound for the innovation
    /// variance, namely the variance for an operator that does not respond to any input.
    powers: [f64; 2],
    restarts: u64,
    age: u64,
    /// Number of samples in the current or last span of constant signals.
    constant_samples: u64,
    /// Number of samples since the end of that span of constant signals.
    settling: u64,
    /// Number of samples that advanced the filters without updating the estimate.
    passed: u64,
}

/// Adaptive recursion with one further input in addition to the error.
pub type TwoInputFilter<E> = AdaptiveFilter<E, 2, { state_count(2) }, { sum_count(2) }, { product_count(2) }>;

impl<E: AsMut<[f64]>, const I: usize, const S: usize, const M: usize, const P: usize> State
    for AdaptiveFilter<E, I, S, M, P>
{
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
                &mut self.input_powers,
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
    /// Builds the recursion at rest. If `memory` has [`memory_needed`](super::memory_needed) numbers, the replays have
    /// their full length. With fewer numbers the replays are shorter, and with [`min_memory`](super::min_memory), the
    /// minimum, there are none. Returns `None` for invalid numbers or too little memory.
    pub fn new(prior: AdaptivePrior, memory: E) -> Option<Self> {
        Self::with_inputs(prior, [], memory)
    }

    /// Takes a sample. e and u must be finite.
    pub fn step(&mut self, e: f64, u: f64) -> Step {
        self.step_inputs([e], u)
    }

    /// Like [`AdaptiveFilter::step`], but the estimate stays constant and only the filters are advanced.
    pub fn step_without_update(&mut self, e: f64, u: f64) -> Step {
        self.follow_inputs([e], u)
    }

    /// Like [`AdaptiveFilter::step_without_update`], for a sample without u; the one-step prediction replaces the
    /// missing output.
    pub fn bridge(&mut self, e: f64) {
        self.bridge_inputs([e]);
    }
}

impl<E: AsRef<[f64]> + AsMut<[f64]>> TwoInputFilter<E> {
    /// Builds the recursion at rest with a further input, given the prior of its delay. `memory` is that for two
    /// inputs; otherwise as for [`AdaptiveFilter::new`].
    pub fn with_further_input(prior: AdaptivePrior, further: DelayPrior, memory: E) -> Option<Self> {
        Self::with_inputs(prior, [further], memory)
    }
}

impl<E: AsRef<[f64]> + AsMut<[f64]>, const I: usize, const S: usize, const M: usize, const P: usize>
    AdaptiveFilter<E, I, S, M, P>
{
    fn with_inputs<const F: usize>(prior: AdaptivePrior, further: [DelayPrior; F], memory: E) -> Option<Self> {
        const { assert!(F + 1 == I && S == state_count(I) && M == sum_count(I) && P == product_count(I)) };
        let ts = prior.sample_time;
        let delays = core::array::from_fn(|input| match input.checked_sub(1) {
            Some(further_input) => further[further_input],
            None => DelayPrior {
                tau: prior.person.tau,
                deviation: prior.spread[DYNAMICS_COUNT - 1],
                starts: prior.starts.map(|start| start.tau),
            },
        });
        if !prior.is_valid() || !delays.iter().all(DelayPrior::is_valid) || memory.as_ref().len() < min_memory_of(I, ts)
        {
            return None;
        }
        let bases = Bases::new(delays.map(|DelayPrior { tau, .. }| Point { tau, ..prior.person }), ts)?;
        let detector = Detector::new(prior.detection)?;
        let prior_noise = NoiseModel::new(prior.order, prior.noise_memory, ts)?;
        let scales = NoiseScales {
            units: [1.0; I],
            size: 1.0,
            innovations: 1.0,
            sample_time: ts,
            dispersion: 1.0,
        };
        let mixture = Mixture::new(&prior.changes, &bases, &scales, &correction_variances(&prior, &delays));
        let live = Candidate::new(
            bases.clone(),
            &prior_noise,
            prior_noise.clone(),
            mixture,
            scales,
            &prior.changes,
            0,
        );
        Some(Self {
            prior,
            delays,
            origin: bases,
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
            input_powers: [0.0; I],
            powers: [0.0; 2],
            restarts: 0,
            age: 0,
            constant_samples: 0,
            settling: 0,
            passed: 0,
        })
    }

    /// Makes the recursion start immediately from an earlier estimate of the operator. Returns `None` for invalid
    /// numbers.
    pub fn with_initial_estimate(mut self, known: &InitialEstimate<I, S>) -> Option<Self> {
        if !known.is_valid() || !known.apply_to_noise(&mut self.prior_noise, self.prior.sample_time) {
            return None;
        }
        self.initial = Some(*known);
        self.live = self.build_candidate(self.origin.points(), &self.prior_noise, 1.0)?;
        self.started = true;
        Some(self)
    }

    /// Scales of the signals, from the data so far.
    fn noise_scales(&self, dispersion: f64) -> NoiseScales<I> {
        let [u, y] = self.powers;
        let samples = self.history.sample_count().max(1) as f64;
        let measured = NoiseScales {
            // |Y| is about sqrt(power of u/power of e), the scale of the prior of the gains.
            units: self.input_powers.map(|e| libm::sqrt(u / e)),
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
                units: known.units,
                size: measured.size.max(libm::sqrt(known.covariance[GAIN_COUNT][GAIN_COUNT])),
                ..measured
            },
            None => measured,
        }
    }

    /// Builds a candidate that starts at the oldest sample of a replay.
    fn build_candidate(&self, points: [Point; I], d: &NoiseModel, dispersion: f64) -> Option<Candidate<I, S, M, P>> {
        let (ts, changes) = (self.prior.sample_time, &self.prior.changes);
        let bases = Bases::new(points, ts)?;
        let scales = self.noise_scales(dispersion);
        let mixture = match &self.initial {
            Some(known) => {
                let units = self.origin.unit_conversion::<S>(&bases);
                let mut covariance = known.covariance;
                for (i, row) in covariance.iter_mut().enumerate() {
                    for (j, c) in row.iter_mut().enumerate() {
                        *c *= units[i] * units[j];
                    }
                }
                let state = self.origin.convert_state(&bases, &known.state);
                Mixture::at(changes, state, covariance, known.variance)
            }
            None => {
                // With replays, the basis changes from one replay to the next, and each replay has a trust region about
                // its point. Without replays, the corrections have the full prior for a person.
                let dynamics = match self.has_replays() {
                    true => trust_region(&points),
                    false => self.correction_variances(),
                };
                Mixture::new(changes, &bases, &scales, &dynamics)
            }
        };
        let start = self.history.sample_count().saturating_sub(self.max_replay_samples());
        let empty = NoiseModel::new(self.prior.order, self.prior.noise_memory, ts)?;
        let there = self.history.sample_count().saturating_sub(start);
        let skipped = (libm::round(REPLAY_RUN_IN_S / ts) as u64).min(there / 2);
        Some(Candidate::new(bases, d, empty, mixture, scales, changes, start).with_skipped(skipped))
    }

    /// Maximum number of samples that a replay reads.
    pub(super) fn max_replay_samples(&self) -> u64 {
        let delay = errors_needed(self.prior.sample_time);
        self.history.capacity().saturating_sub(2 * delay) as u64
    }

    fn has_replays(&self) -> bool {
        self.max_replay_samples() > 0
    }

    /// Prior variances of the corrections.
    fn correction_variances(&self) -> [f64; S] {
        correction_variances(&self.prior, &self.delays)
    }

    /// Points of all inputs for a starting point.
    fn starting_points(&self, start: usize) -> [Point; I] {
        self.delays.map(|delay| Point {
            tau: delay.starts[start],
            ..self.prior.starts[start]
        })
    }

    /// Takes a sample: the error, the further inputs, and u. All must be finite.
    pub fn step_inputs(&mut self, inputs: [f64; I], u: f64) -> Step {
        self.advance_bases(&inputs);
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
        for (power, x) in self.input_powers.iter_mut().zip(inputs) {
            *power += x * x;
        }
        self.powers[0] += u * u;
        if !self.started {
            // At the first samples the whitening filter does not yet contain enough outputs.
            if self.history.sample_count() > self.prior.order as u64 {
                let y = self.live.whiten(u).y;
                self.powers[1] += y * y;
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

    /// True once no signal has changed for longer than `STATIONARY_AFTER_S`, and afterwards until the filters have
    /// settled. The estimate is then not updated: the recorder has stopped or the person is resting, and the innovation
    /// variance would tend to zero.
    #[inline(always)]
    fn is_stationary(&mut self, u: f64) -> bool {
        let samples = self.history.sample_count();
        let moved = samples < 2 || {
            let (newest, before) = (samples - 1, samples - 2);
            let is_moving = |input| self.history.input(input, newest, 0) != self.history.input(input, before, 0);
            (0..I).any(is_moving) || u != self.history.output(before).0
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

    /// Like [`AdaptiveFilter::step_inputs`], but the estimate stays constant and only the filters are advanced.
    pub fn follow_inputs(&mut self, inputs: [f64; I], u: f64) -> Step {
        self.advance_bases(&inputs);
        self.detector.ignore_sample();
        self.process_without_update(u, SampleUse::FilterOnly)
    }

    /// Like [`AdaptiveFilter::follow_inputs`], for a sample without u; the one-step prediction replaces the missing
    /// output.
    pub fn bridge_inputs(&mut self, inputs: [f64; I]) {
        self.advance_bases(&inputs);
        self.detector.ignore_sample();
        self.process_without_update(0.0, SampleUse::Missing);
    }

    /// Advances the bases by one sample.
    #[inline(always)]
    fn advance_bases(&mut self, inputs: &[f64; I]) {
        self.history.push(inputs);
        let newest = self.history.sample_count() - 1;
        let history = &self.history;
        self.live.advance_bases(|input, age| history.input(input, newest, age));
    }

    fn store_sample(&mut self, u: f64) {
        self.history.complete(u, SampleUse::Update);
        self.live.store(u);
    }

    /// Step 12: tests the last blocks of the live candidate for a change.
    fn test_for_change(&mut self) {
        let directions = core::array::from_fn(|input| gain_and_lead_directions(self.basis_of(input)));
        self.detector
            .test(&self.live.blocks, self.live.mixture.mean(), &directions);
    }

    /// Restarts the recursion after an overflow of a signal.
    fn restart(&mut self) {
        self.history.clear();
        self.detector.ignore_sample();
        self.saturation = Saturation::new();
        (self.input_powers, self.powers) = ([0.0; I], [0.0; 2]);
        (self.replay_stage, self.age, self.replays, self.passed) = (0, 0, 0, 0);
        self.alternatives = Alternatives::EMPTY;
        self.restarts += 1;
        self.started = false;
        if let Some(live) = self.build_candidate(self.origin.points(), &self.prior_noise, 1.0) {
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

    /// Returns the basis of the error of the live candidate.
    pub fn basis(&self) -> &Basis {
        self.live.bases().first()
    }

    /// Returns the basis of an input of the live candidate.
    pub fn basis_of(&self, input: usize) -> &Basis {
        self.live.bases().of(input)
    }

    pub(super) fn alternatives(&self) -> &Alternatives<I> {
        &self.alternatives
    }

    /// Number of samples of the record, excluding those that did not update the estimate, since samples without
    /// information do not make old results obsolete.
    pub(super) fn informative_samples(&self) -> u64 {
        self.history.sample_count().saturating_sub(self.passed)
    }

    pub(super) fn live_candidate(&self) -> &Candidate<I, S, M, P> {
        &self.live
    }

    /// Returns the current basis point plus its corrections, limited to the range of the basis.
    pub fn dynamics(&self) -> Point {
        self.live.points()[0]
    }

    /// Returns the frequency responses by which the gains are multiplied, at a frequency in rad/s and at the current
    /// point.
    pub fn responses(&self, omega_rad_s: f64) -> [Complex; GAIN_COUNT] {
        self.live.responses(0, omega_rad_s)
    }

    /// Returns the frequency response Y of the operator at a frequency in rad/s.
    pub fn response(&self, omega_rad_s: f64) -> Complex {
        self.live.response(0, omega_rad_s)
    }

    /// Returns Y at a frequency in rad/s, with the derivatives of its real and imaginary parts with respect to gains,
    /// level and corrections. The derivatives are exact for the gains and finite differences for the corrections.
    pub fn response_with_derivatives(&self, omega_rad_s: f64) -> (Complex, [[f64; S]; 2]) {
        self.response_of_with_derivatives(0, omega_rad_s)
    }

    /// Like [`AdaptiveFilter::response_with_derivatives`], for the response to an input.
    pub fn response_of_with_derivatives(&self, input: usize, omega_rad_s: f64) -> (Complex, [[f64; S]; 2]) {
        self.live.response_with_derivatives(input, omega_rad_s)
    }

    /// Returns the change detector.
    pub fn detector(&self) -> &Detector<I, S> {
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

fn store<const I: usize, const S: usize, const M: usize, const P: usize>(
    candidate: &mut Candidate<I, S, M, P>,
    sample_use: SampleUse,
    u: f64,
) {
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

/// Prior variances of the corrections of omega, zeta and the delays.
fn correction_variances<const I: usize, const S: usize>(prior: &AdaptivePrior, delays: &[DelayPrior; I]) -> [f64; S] {
    let [omega, zeta, _] = prior.spread;
    corrections_of(|input| {
        [
            omega * prior.person.omega,
            zeta * prior.person.zeta,
            delays[input].deviation,
        ]
    })
}

/// Variances of the corrections in the trust region of a replay.
fn trust_region<const I: usize, const S: usize>(points: &[Point; I]) -> [f64; S] {
    let [omega, zeta, tau] = TRUST_DEVIATIONS;
    corrections_of(|input| [omega * points[input].omega, zeta * points[input].zeta, tau])
}

/// Squares of standard deviations of omega, zeta and the delay of each input, at the places of the corrections.
fn corrections_of<const S: usize>(deviations: impl Fn(usize) -> [f64; DYNAMICS_COUNT]) -> [f64; S] {
    let mut variances = [0.0; S];
    for input in 0..input_count(S) {
        for (place, s) in correction_places(input).into_iter().zip(deviations(input)) {
            variances[place] = s * s;
        }
    }
    variances
}
