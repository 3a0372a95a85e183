//! Replays: the recursion reads the stored record again and replaces the live candidate.
//!
//! In parallel with the live candidate, a second candidate, the trial, reads the record from the start of the memory,
//! [`REPLAYED`] samples per new sample, until it has caught up. It uses the basis at the current estimate, the noise
//! model of the residuals, and the dispersion of the innovations. When it has caught up it becomes the live candidate,
//! and the next trial starts. The estimate is therefore, a few seconds late, that of a prediction error method over all
//! stored data, iterated as in a Gauss-Newton search (L. Ljung, *System Identification*, 1999, section 10.2), at a
//! bounded cost per sample and with the same digits on every machine.
//!
//! Every second trial starts at another point, against local minima. It is repeated [`STAGES`] times from its result, and
//! replaces the live candidate only if its evidence is better by [`TAKEOVER_NATS`].
//!
//! With memory for the longest delay only there are no replays: basis and noise model are those of the start, except for
//! corrections, and the noise model is renewed in place.

use core::ops::Range;

use super::{AdaptiveFilter, remember, through_filters, trusted, variances};
use crate::adaptive::{
    basis::Point,
    candidate::Candidate,
    history::{History, Use},
    mixture::ChangePrior,
    saturation::Saturation,
};

/// Number of stored samples that are read per new sample.
pub const REPLAYED: usize = 50;
/// Number of trials from another starting point, and the evidence by which the last must be better,
/// nats.
const STAGES: u64 = 3;
const TAKEOVER_NATS: f64 = 3.0;
/// Evidence by which a trial from the estimate may be worse, nats: it started with a wider prior.
const TOLERATED_NATS: f64 = 20.0;
/// Number of samples for the first estimate, in orders of the noise model.
const FEWEST: u64 = 3;

impl<E: AsRef<[f64]> + AsMut<[f64]>> AdaptiveFilter<E> {
    /// The first estimate: the best of all starting points over the samples so far.
    pub(super) fn begin(&mut self) {
        let (ts, n) = (self.prior.sample_time, self.history.samples());
        let enough = n as f64 * ts >= self.prior.hold && n >= FEWEST * self.prior.order as u64;
        if !enough || !self.powers.iter().all(|p| *p > 0.0) {
            return;
        }
        if !self.replays_anything() {
            if let Some(live) = self.candidate(self.prior.person, &self.prior_noise, 1.0) {
                self.live = live;
                self.started = true;
            }
            return;
        }
        let mut best: Option<(f64, Candidate)> = None;
        for start in self.prior.starts {
            let Some(mut candidate) = self.candidate(start, &self.prior_noise, 1.0) else {
                continue;
            };
            if !read(
                &self.history,
                &self.saturation,
                &self.prior.changes,
                &mut candidate,
                0..n,
            ) {
                continue;
            }
            let evidence = candidate.evidence + self.log_prior(start);
            if evidence.is_finite() && best.as_ref().is_none_or(|(least, _)| evidence > *least) {
                best = Some((evidence, candidate));
            }
        }
        if let Some((_, mut candidate)) = best {
            self.apply_population_prior(&mut candidate);
            (self.live, self.started) = (candidate, true);
        }
    }

    /// Logarithm of the prior density of a point, except for a constant.
    fn log_prior(&self, point: Point) -> f64 {
        let (p, is) = (self.prior.person, variances(&self.prior));
        let away = [point.omega - p.omega, point.zeta - p.zeta, point.tau - p.tau];
        -0.5 * away.iter().zip(is).map(|(a, v)| a * a / v).sum::<f64>()
    }

    /// Continues the trial, and starts the next one when it is done.
    pub(super) fn replay(&mut self) {
        if self.stage == 0 {
            self.start_replay();
            return;
        }
        let to = (self.at + REPLAYED as u64).min(self.history.samples());
        let sound = read(
            &self.history,
            &self.saturation,
            &self.prior.changes,
            &mut self.trial,
            self.at..to,
        );
        self.at = to;
        if !sound {
            self.stage = 0;
        } else if self.at >= self.history.samples() {
            self.decide();
        }
    }

    fn start_replay(&mut self) {
        self.replays += 1;
        let elsewhere = self.replays.is_multiple_of(2) && self.initial.is_none();
        let (point, stage) = match elsewhere {
            true => (self.prior.starts[self.turn()], 2),
            false => (self.live.point(), 1),
        };
        let live = self.live.clone();
        self.start_from(&live, point, stage);
    }

    /// Index of the starting point of this trial, or of the last one from another point.
    fn turn(&self) -> usize {
        (self.replays / 2) as usize % self.prior.starts.len()
    }

    /// Starts a trial at a point, with the noise model and dispersion of another candidate.
    fn start_from(&mut self, from: &Candidate, point: Point, stage: u64) {
        let mut d = from.noise.clone();
        d.solve();
        let Some(trial) = self.candidate(point, &d, from.dispersion()) else {
            self.stage = 0;
            return;
        };
        // The guide: the gains of each segment of the other candidate, so that the residuals of D are right from the
        // first block on, before the trial has found the gains itself.
        let later = (trial.start.saturating_sub(from.start)) / from.block_samples().max(1);
        let guide = from.mixture.segments();
        let basis = trial.basis().clone();
        self.trial = trial.with_guide(guide.carried(later, |state| from.carried(&basis, state)));
        (self.stage, self.at) = (stage, self.trial.start);
    }

    /// Decides about a trial that has caught up.
    fn decide(&mut self) {
        let mut trial = self.trial.clone();
        trial.clear_guide();
        let evidence = trial.evidence;
        let stage = core::mem::replace(&mut self.stage, 0);
        if !(evidence.is_finite() && trial.mixture.mean().iter().all(|s| s.is_finite())) {
            return;
        }
        // Evidence is comparable only over the same samples.
        let same = trial.start == self.live.start;
        self.apply_population_prior(&mut trial);
        if stage > 1 && stage <= STAGES {
            let point = trial.point();
            self.start_from(&trial, point, stage + 1);
            return;
        }
        let takes_over = match stage {
            1 => !same || evidence > self.live.evidence - TOLERATED_NATS,
            _ => same && evidence > self.live.evidence + TAKEOVER_NATS,
        };
        // The losing point still predicts nearly as well: it widens the reported errors.
        if stage > 1 && same {
            let loser = if takes_over { &self.live } else { &trial };
            let deficit = (evidence - self.live.evidence).abs();
            self.alternatives
                .put(self.turn(), loser.operator(), deficit, self.read());
        }
        if takes_over {
            self.live = trial;
        }
    }

    /// Replaces the trust region of a replay by the prior of people.
    fn apply_population_prior(&self, candidate: &mut Candidate) {
        if self.initial.is_some() {
            return;
        }
        let (p, at) = (self.prior.person, candidate.basis().point());
        let mean = [p.omega - at.omega, p.zeta - at.zeta, p.tau - at.tau];
        candidate
            .mixture
            .replace_prior(trusted(at), variances(&self.prior), mean);
    }
}

/// Reads samples of the history; false if a number has overflowed.
fn read<E: AsRef<[f64]> + AsMut<[f64]>>(
    history: &History<E>,
    saturation: &Saturation,
    changes: &ChangePrior,
    candidate: &mut Candidate,
    samples: Range<u64>,
) -> bool {
    for sample in samples {
        candidate.respond(|age| history.error(sample, age));
        let (u, use_of_it) = history.output(sample);
        let through = match use_of_it {
            Use::Update => {
                let white = candidate.whitened(u);
                if !candidate.update(&white, u, changes) {
                    return false;
                }
                u
            }
            Use::FilterOnly => u,
            _ => {
                let predicted = u - candidate.innovation(&candidate.whitened(u));
                through_filters(saturation, use_of_it, u, predicted)
            }
        };
        remember(candidate, use_of_it, through);
    }
    true
}
