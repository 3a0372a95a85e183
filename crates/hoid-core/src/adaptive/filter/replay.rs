//! Replays: a new candidate reads the stored record again and then replaces the live candidate.
//!
//! In parallel with the live candidate, a second candidate, the trial, reads the stored record from its start,
//! [`REPLAY_SAMPLES_PER_STEP`] samples for each new sample, until it has caught up. Its basis is at the current
//! estimate, its whitening filter is the noise model of the residuals, and its dispersion comes from the innovations of
//! the live candidate. When the trial has caught up, it becomes the live candidate and the next trial starts. With a
//! delay of a few seconds, the estimate therefore equals the result of a prediction-error method over all stored data,
//! iterated as in a Gauss-Newton search (L. Ljung, *System Identification*, 1999, section 10.2), at a bounded cost per
//! sample and with bit-identical results on every machine.
//!
//! To escape local minima, every second trial starts from another point. It makes [`STAGE_COUNT`] passes over the
//! record, each from the result of the previous pass. It replaces the live candidate only if its evidence is better by
//! [`TAKEOVER_NATS`].
//!
//! If the memory suffices for the longest delay only, there are no replays: the filters keep the initial basis, the
//! corrections are added to its point, and the noise model is updated at regular intervals.

use core::ops::Range;

use super::{AdaptiveFilter, filter_output, store, trust_region};
use crate::adaptive::{
    basis::Point,
    candidate::Candidate,
    history::{History, SampleUse},
    mixture::ChangePrior,
    saturation::Saturation,
    sizes::is_correction,
};

/// Number of stored samples that a replay reads for each new sample.
pub const REPLAY_SAMPLES_PER_STEP: usize = 50;
/// Number of passes of a trial from another starting point. After the last pass the evidence of the trial must be
/// better by `TAKEOVER_NATS`.
const STAGE_COUNT: u64 = 3;
const TAKEOVER_NATS: f64 = 3.0;
/// Amount in nats by which the evidence of a trial from the estimate may be lower than the evidence of the live
/// candidate, since the trial starts with a wider prior.
const TOLERATED_DEFICIT_NATS: f64 = 20.0;
/// Minimum number of samples for the first estimate, as a multiple of the order of the noise model.
const MIN_SAMPLES_PER_ORDER: u64 = 3;

impl<E: AsRef<[f64]> + AsMut<[f64]>, const I: usize, const S: usize, const M: usize, const P: usize>
    AdaptiveFilter<E, I, S, M, P>
{
    /// Makes the first estimate once there are enough samples: the best of the candidates from all starting points over
    /// the samples so far or, without replays, the candidate at the point of the person.
    pub(super) fn try_to_start(&mut self) {
        let (ts, n) = (self.prior.sample_time, self.history.sample_count());
        let enough = n as f64 * ts >= self.prior.hold && n >= MIN_SAMPLES_PER_ORDER * self.prior.order as u64;
        if !enough || !self.input_powers.iter().chain(&self.powers).all(|p| *p > 0.0) {
            return;
        }
        if !self.has_replays() {
            if let Some(live) = self.build_candidate(self.origin.points(), &self.prior_noise, 1.0) {
                self.live = live;
                self.started = true;
            }
            return;
        }
        // n exceeds the capacity of the memory only after altered numbers have been restored.
        let first = n.saturating_sub(self.history.capacity() as u64);
        let mut best: Option<(f64, Candidate<I, S, M, P>)> = None;
        for start in 0..self.prior.starts.len() {
            let points = self.starting_points(start);
            let Some(mut candidate) = self.build_candidate(points, &self.prior_noise, 1.0) else {
                continue;
            };
            if !feed_samples(
                &self.history,
                &self.saturation,
                &self.prior.changes,
                &mut candidate,
                first..n,
            ) {
                continue;
            }
            let evidence = candidate.evidence + self.log_prior(&points);
            if evidence.is_finite() && best.as_ref().is_none_or(|(least, _)| evidence > *least) {
                best = Some((evidence, candidate));
            }
        }
        if let Some((_, mut candidate)) = best {
            self.apply_population_prior(&mut candidate);
            (self.live, self.started) = (candidate, true);
        }
    }

    /// Log prior density of the points of all inputs, up to a constant.
    fn log_prior(&self, points: &[Point; I]) -> f64 {
        let (away, is) = (self.origin.corrections::<S>(points), self.correction_variances());
        let each = (0..S).filter(|i| is_correction(*i)).map(|i| away[i] * away[i] / is[i]);
        -0.5 * each.sum::<f64>()
    }

    /// Starts a trial if none is running. Otherwise continues the trial and, when it has caught up, decides whether it
    /// replaces the live candidate.
    pub(super) fn replay(&mut self) {
        if self.replay_stage == 0 {
            self.start_replay();
            return;
        }
        let to = (self.next_sample + REPLAY_SAMPLES_PER_STEP as u64).min(self.history.sample_count());
        let sound = feed_samples(
            &self.history,
            &self.saturation,
            &self.prior.changes,
            &mut self.trial,
            self.next_sample..to,
        );
        self.next_sample = to;
        if !sound {
            self.replay_stage = 0;
        } else if self.next_sample >= self.history.sample_count() {
            self.finish_trial();
        }
    }

    fn start_replay(&mut self) {
        self.replays += 1;
        let elsewhere = self.replays.is_multiple_of(2) && self.initial.is_none();
        let (points, stage) = match elsewhere {
            true => (self.starting_points(self.starting_point_index()), 2),
            false => (self.live.points(), 1),
        };
        let live = self.live.clone();
        self.start_from(&live, points, stage);
    }

    /// Index of the starting point of the current trial or, if the current trial started from the estimate, of the last
    /// trial from another point.
    fn starting_point_index(&self) -> usize {
        (self.replays / 2) as usize % self.prior.starts.len()
    }

    /// Starts a trial at a point, with the noise model and the dispersion of another candidate.
    fn start_from(&mut self, from: &Candidate<I, S, M, P>, points: [Point; I], stage: u64) {
        let mut d = from.noise.clone();
        d.solve();
        let Some(trial) = self.build_candidate(points, &d, from.dispersion()) else {
            self.replay_stage = 0;
            return;
        };
        // The guide contains the gains of each segment of the other candidate. With the guide, the residuals for D are
        // right from the first block, before the trial has estimated the gains itself.
        let later = (trial.start.saturating_sub(from.start)) / from.block_samples().max(1);
        let guide = from.mixture.segments();
        let bases = trial.bases().clone();
        self.trial = trial.with_guide(guide.converted(later, |state| from.convert_state(&bases, state)));
        (self.replay_stage, self.next_sample) = (stage, self.trial.start);
    }

    /// Decides whether a trial that has caught up replaces the live candidate.
    fn finish_trial(&mut self) {
        let mut trial = self.trial.clone();
        trial.clear_guide();
        let evidence = trial.evidence;
        let stage = core::mem::replace(&mut self.replay_stage, 0);
        if !(evidence.is_finite() && trial.mixture.mean().iter().all(|s| s.is_finite())) {
            return;
        }
        // The evidence of two candidates can be compared only over the same samples.
        let same = trial.start == self.live.start;
        self.apply_population_prior(&mut trial);
        if stage > 1 && stage <= STAGE_COUNT {
            let points = trial.points();
            self.start_from(&trial, points, stage + 1);
            return;
        }
        let takes_over = match stage {
            1 => !same || evidence > self.live.evidence - TOLERATED_DEFICIT_NATS,
            _ => same && evidence > self.live.evidence + TAKEOVER_NATS,
        };
        // The operator that lost the comparison may predict nearly as well, so it widens the reported errors.
        if stage > 1 && same {
            let loser = if takes_over { &self.live } else { &trial };
            let deficit = (evidence - self.live.evidence).abs();
            self.alternatives.store(
                self.starting_point_index(),
                loser.operators(),
                deficit,
                self.informative_samples(),
            );
        }
        if takes_over {
            self.live = trial;
        }
    }

    /// Replaces, in a candidate, the trust region of a replay by the prior for a person.
    fn apply_population_prior(&self, candidate: &mut Candidate<I, S, M, P>) {
        if self.initial.is_some() {
            return;
        }
        let bases = candidate.bases();
        let mean = bases.corrections(&self.origin.points());
        let trusted = trust_region(&bases.points());
        candidate
            .mixture
            .replace_prior(&trusted, &self.correction_variances(), &mean);
    }
}

/// Passes samples of the history to a candidate; returns false if a number has overflowed.
fn feed_samples<E: AsRef<[f64]> + AsMut<[f64]>, const I: usize, const S: usize, const M: usize, const P: usize>(
    history: &History<E, I>,
    saturation: &Saturation,
    changes: &ChangePrior,
    candidate: &mut Candidate<I, S, M, P>,
    samples: Range<u64>,
) -> bool {
    for sample in samples {
        candidate.advance_bases(|input, age| history.input(input, sample, age));
        let (u, sample_use) = history.output(sample);
        let through = match sample_use {
            SampleUse::Update => {
                let white = candidate.whiten(u);
                if !candidate.update(&white, u, changes) {
                    return false;
                }
                u
            }
            SampleUse::FilterOnly => u,
            _ => {
                let predicted = u - candidate.innovation(&candidate.whiten(u));
                filter_output(saturation, sample_use, u, predicted)
            }
        };
        store(candidate, sample_use, through);
    }
    true
}
