//! The hypotheses with their probabilities, updated with the output and the signals after the whitening filter.
//!
//! At each sample the probability of a hypothesis is multiplied by its predictive density of the innovation, and the
//! probabilities are normalised. At every birth the likeliest hypothesis is the parent of new hypotheses:
//!
//! - **a change in the gains**, and at every few births also a change in omega_nm and zeta_nm, with the prior
//!   probability of such a change since the last birth;
//! - **a neighbouring delay**, as an alternative that may have been true throughout: the hypothesis is as old as its
//!   parent, and the variance of each parameter is increased by the error of this parameter that the difference in
//!   delay causes; the first hypotheses with neighbouring delays are created when the bank starts;
//! - **a change in the delay**: delays spread over all candidates, with the variances of the gains increased as in any
//!   change, and probabilities proportional to the normal density of the step. The set of proposed delays is shifted by
//!   one each time, so each candidate is proposed in turn, and the number of hypotheses is bounded for any number of
//!   delays.
//!
//! A new hypothesis replaces the least likely hypothesis that is old enough to be pruned.

use hoid_core::state::{State, visit_all};

use super::{
    change::{Change, ChangeDetector, mean_delay},
    hypothesis::{Hypothesis, visit_slot},
    prior::{ChangePrior, PARAMETER_COUNT},
    signal_ring::DelayedSignals,
};

/// A bank of at most M hypotheses.
#[derive(Debug, Clone, PartialEq)]
pub struct Bank<const M: usize> {
    prior: ChangePrior,
    hypotheses: [Option<Hypothesis>; M],
    samples: u64,
    /// Number of samples until the next birth.
    samples_until_birth: u32,
    births: u32,
    /// First sample at which hypotheses of a change in omega_nm and zeta_nm may be created.
    neuromuscular_from: u64,
    detector: ChangeDetector,
}

impl<const M: usize> State for Bank<M> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        for slot in &mut self.hypotheses {
            visit_slot(slot, each);
        }
        let rest: &mut [&mut dyn State] = &mut [
            &mut self.samples,
            &mut self.samples_until_birth,
            &mut self.births,
            &mut self.neuromuscular_from,
            &mut self.detector,
        ];
        visit_all(rest, each);
        self.bounded();
    }
}

/// Mean of the mixture of hypotheses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mixture {
    /// Mean of `[K_e, K_e_dot, omega_nm, zeta_nm]`.
    pub eta: [f64; PARAMETER_COUNT],
    /// Mean innovation variance.
    pub variance: f64,
}

/// Number of delays on either side of the likeliest delay that are proposed as alternatives that may have been true
/// throughout.
const NEIGHBOUR_COUNT: usize = 3;
/// Smallest probability of a hypothesis relative to the likeliest hypothesis, so that no hypothesis is lost
/// permanently.
const MIN_PROBABILITY: f64 = 1e-12;

impl<const M: usize> Bank<M> {
    fn bounded(&mut self) {
        self.samples_until_birth = self.samples_until_birth.clamp(1, self.prior.birth_interval.max(1));
        for h in self.hypotheses.iter_mut().flatten() {
            h.birth_sample = h.birth_sample.min(self.samples);
            h.extra_delay = h.extra_delay.min(self.prior.delay.count.saturating_sub(1));
        }
    }

    /// Creates a bank with one hypothesis. `None` if M is below two, the start is not finite or not within the bounds,
    /// the bounds allow omega_nm or zeta_nm to become zero, or a value of the prior is out of range.
    pub fn new(first: Hypothesis, prior: ChangePrior) -> Option<Self> {
        let within_bounds = first
            .eta
            .iter()
            .zip(&prior.bounds)
            .all(|(e, [low, high])| low <= e && e <= high);
        let valid_start = first.is_valid() && within_bounds && first.extra_delay < prior.delay.count;
        if M < 2 || !valid_start || !prior.is_valid() {
            return None;
        }
        let mut hypotheses = std::array::from_fn(|_| None);
        hypotheses[0] = Some(first);
        let mut bank = Self {
            hypotheses,
            samples: 0,
            samples_until_birth: prior.birth_interval,
            births: 0,
            neuromuscular_from: 0,
            detector: ChangeDetector::default(),
            prior,
        };
        bank.spawn_neighbouring_delays();
        Some(bank)
    }

    /// Updates the bank with one sample: the output and the signals after the whitening filter, or `None` if they are
    /// unknown. Returns the innovation.
    pub fn update(&mut self, sample: Option<(f64, DelayedSignals<'_>)>, point: [f64; 2]) -> f64 {
        let innovation = self.update_hypotheses(sample, point);
        if self.detector.update(&self.hypotheses, self.samples, &self.prior) {
            self.suspend_neuromuscular();
        }
        innovation
    }

    /// Discards the recent hypotheses of a change in omega_nm and zeta_nm, and allows new ones only after the settling
    /// time.
    ///
    /// A change in the gains passes through the neuromuscular system. Until the transient has settled, the response
    /// corresponds neither to the old nor to the new gains and could be mistaken for a change in omega_nm and zeta_nm.
    fn suspend_neuromuscular(&mut self) {
        self.neuromuscular_from = self.samples + self.prior.settling_time;
        let mut rest = 0.0;
        for h in self.hypotheses.iter().flatten() {
            rest += if self.is_recent_neuromuscular(h) {
                0.0
            } else {
                h.probability
            };
        }
        if rest > 0.0 {
            for i in 0..M {
                self.hypotheses[i] = self.hypotheses[i].filter(|h| !self.is_recent_neuromuscular(h));
                if let Some(h) = &mut self.hypotheses[i] {
                    h.probability /= rest;
                }
            }
        }
    }

    /// True if the hypothesis assumes that omega_nm and zeta_nm changed within the change window.
    fn is_recent_neuromuscular(&self, h: &Hypothesis) -> bool {
        h.neuromuscular_changed && self.samples - h.birth_sample < self.prior.change_window
    }

    /// As [`Bank::update`], but without detection of changes.
    pub fn update_hypotheses(&mut self, sample: Option<(f64, DelayedSignals<'_>)>, point: [f64; 2]) -> f64 {
        self.samples += 1;
        let mut innovation = 0.0;
        if let Some((y, signals)) = sample {
            for h in self.hypotheses.iter_mut().flatten() {
                let (eps, density) = h.step(y, signals.at(h.extra_delay), point, &self.prior);
                innovation += h.probability * eps;
                h.probability *= density;
            }
            self.normalise();
        }
        self.samples_until_birth -= 1;
        if self.samples_until_birth == 0 {
            self.samples_until_birth = self.prior.birth_interval;
            self.drift();
            self.create_hypotheses();
        }
        innovation
    }

    /// Creates the hypotheses that are due at this birth.
    fn create_hypotheses(&mut self) {
        self.births = self.births.wrapping_add(1);
        let probability = self.prior.hazard * f64::from(self.prior.birth_interval);
        self.spawn_changed(probability, false);
        let every = self.prior.neuromuscular_every;
        if every > 0 && self.births.is_multiple_of(every) && self.samples >= self.neuromuscular_from {
            self.spawn_changed(probability * f64::from(every) * self.prior.neuromuscular_odds, true);
        }
        let delay = self.prior.delay;
        if delay.count > 1 && self.births.is_multiple_of(delay.propose_every) {
            self.spawn_neighbouring_delays();
            self.spawn_changed_delays(probability * f64::from(delay.propose_every) * delay.change_odds);
        }
    }

    /// Counts a sample without changing the estimate.
    pub fn skip_sample(&mut self) {
        self.samples += 1;
    }

    /// Scales the probabilities to a sum of one. Probabilities that are too small or not finite are replaced by
    /// [`MIN_PROBABILITY`].
    fn normalise(&mut self) {
        let mut most = 0.0;
        for h in self.hypotheses.iter().flatten() {
            if h.probability > most {
                most = h.probability;
            }
        }
        let (scale, mut sum) = (1.0 / most, 0.0);
        for h in self.hypotheses.iter_mut().flatten() {
            let p = h.probability * scale;
            h.probability = if p > MIN_PROBABILITY { p } else { MIN_PROBABILITY };
            sum += h.probability;
        }
        let scale = 1.0 / sum;
        for h in self.hypotheses.iter_mut().flatten() {
            h.probability *= scale;
        }
    }

    fn drift(&mut self) {
        for h in self.hypotheses.iter_mut().flatten() {
            h.drift(self.samples, &self.prior);
        }
    }

    /// Creates the hypothesis that the gains change now; if `neuromuscular` is true, omega_nm and zeta_nm change as
    /// well.
    fn spawn_changed(&mut self, probability: f64, neuromuscular: bool) {
        if let Some((slot, parent)) = self.parent_hypothesis() {
            self.spawn(self.with_change(&parent, neuromuscular), probability, slot);
        }
    }

    /// Creates hypotheses with delays close to the likeliest delay, unless a hypothesis with the same delay and the
    /// same birth exists already.
    fn spawn_neighbouring_delays(&mut self) {
        let Some((slot, parent)) = self.parent_hypothesis() else {
            return;
        };
        let delay = self.prior.delay;
        let mut probability = 1.0;
        for away in 1..=NEIGHBOUR_COUNT {
            probability *= delay.neighbour_probability;
            for extra_delay in [parent.extra_delay.checked_sub(away), Some(parent.extra_delay + away)]
                .into_iter()
                .flatten()
            {
                let is_there = |h: &Hypothesis| h.extra_delay == extra_delay && h.birth_sample == parent.birth_sample;
                if extra_delay < delay.count && !self.hypotheses().any(is_there) {
                    self.spawn(
                        parent.with_neighbouring_delay(extra_delay, &self.prior),
                        probability,
                        slot,
                    );
                }
            }
        }
    }

    /// Creates hypotheses that the gains and the delay change now, with at most the given total probability.
    fn spawn_changed_delays(&mut self, probability: f64) {
        let Some((slot, parent)) = self.parent_hypothesis() else {
            return;
        };
        let delay = self.prior.delay;
        let apart = delay.count.div_ceil(delay.proposals);
        let first = (self.births / delay.propose_every) as usize % apart;
        let density = |extra_delay: usize| {
            let step = extra_delay.abs_diff(parent.extra_delay) as f64 / delay.jump;
            libm::exp(-0.5 * step * step)
        };
        let all: f64 = (first..delay.count).step_by(apart).map(density).sum();
        if all <= 0.0 {
            return;
        }
        for extra_delay in (first..delay.count)
            .step_by(apart)
            .filter(|extra_delay| *extra_delay != parent.extra_delay)
        {
            self.spawn(
                self.with_change(&parent, false).with_extra_delay(extra_delay),
                probability * density(extra_delay) / all,
                slot,
            );
        }
    }

    /// Returns the likeliest hypothesis and its slot. Hypotheses of a recent change in omega_nm and zeta_nm are
    /// excluded, so that the transient effect of a change in the gains on these parameters is not inherited.
    fn parent_hypothesis(&self) -> Option<(usize, Hypothesis)> {
        let (mut likeliest, mut highest) = (None, 0.0);
        for (slot, h) in self.hypotheses.iter().enumerate() {
            if let Some(h) = h
                && h.probability > highest
                && !self.is_recent_neuromuscular(h)
            {
                (likeliest, highest) = (Some((slot, *h)), h.probability);
            }
        }
        likeliest
    }

    /// Returns a child of `parent`; the child assumes that the operator changes now.
    fn with_change(&self, parent: &Hypothesis, neuromuscular: bool) -> Hypothesis {
        let mut child = parent.with_change(self.samples, neuromuscular, &self.prior);
        child.before.delay = self.delay();
        child
    }

    /// Puts a child into an empty slot, or into the slot of the least likely hypothesis that is old enough to be
    /// pruned. If that hypothesis is the parent, the child is discarded.
    fn spawn(&mut self, mut child: Hypothesis, probability: f64, parent: usize) {
        let (mut slot, mut lowest) = (None, f64::INFINITY);
        for (i, h) in self.hypotheses.iter().enumerate() {
            match h {
                None => (slot, lowest) = (Some(i), f64::NEG_INFINITY),
                Some(h) if self.samples - h.birth_sample >= self.prior.pruning_age && h.probability < lowest => {
                    (slot, lowest) = (Some(i), h.probability);
                }
                Some(_) => {}
            }
        }
        let Some(slot) = slot.filter(|slot| *slot != parent) else {
            return;
        };
        self.hypotheses[slot] = None;
        let rest: f64 = self.hypotheses.iter().flatten().map(|h| h.probability).sum();
        for h in self.hypotheses.iter_mut().flatten() {
            h.probability *= (1.0 - probability) / rest;
        }
        child.probability = probability;
        self.hypotheses[slot] = Some(child);
    }

    /// Returns the mean of the mixture.
    pub fn mixture(&self) -> Mixture {
        let mut mixture = Mixture {
            eta: [0.0; PARAMETER_COUNT],
            variance: 0.0,
        };
        for h in self.hypotheses.iter().flatten() {
            for i in 0..PARAMETER_COUNT {
                mixture.eta[i] += h.probability * h.eta[i];
            }
            mixture.variance += h.probability * h.innovation_variance.variance();
        }
        mixture
    }

    /// Returns the covariance of eta in the mixture.
    pub fn covariance(&self) -> [[f64; PARAMETER_COUNT]; PARAMETER_COUNT] {
        let mean = self.mixture().eta;
        let mut covariance = [[0.0; PARAMETER_COUNT]; PARAMETER_COUNT];
        for h in self.hypotheses.iter().flatten() {
            let p = h.covariance.matrix();
            for i in 0..PARAMETER_COUNT {
                let a = h.eta[i] - mean[i];
                for j in 0..PARAMETER_COUNT {
                    let b = h.eta[j] - mean[j];
                    covariance[i][j] += h.probability * (p[i][j] + a * b);
                }
            }
        }
        covariance
    }

    /// Returns T_L in s and its variance. T_L is `E[K_e K_e_dot]/E[K_e^2]`, the T that minimises
    /// `E (K_e_dot - T K_e)^2`.
    pub fn lead_time(&self, covariance: &[[f64; PARAMETER_COUNT]; PARAMETER_COUNT]) -> [f64; 2] {
        let [k_e, k_e_dot, ..] = self.mixture().eta;
        let square = k_e * k_e + covariance[0][0];
        let lead_time = (k_e * k_e_dot + covariance[0][1]) / square;
        // To first order dT_L = (dK_e_dot - T_L dK_e)/K_e.
        let variance = covariance[1][1] - 2.0 * lead_time * covariance[0][1] + lead_time * lead_time * covariance[0][0];
        [lead_time, variance.max(0.0) / square]
    }

    /// Returns the number of candidate delays.
    pub fn delay_count(&self) -> usize {
        self.prior.delay.count
    }

    /// Returns the mean and the variance of the delay, in samples beyond the shortest delay.
    pub fn delay(&self) -> [f64; 2] {
        mean_delay(self.hypotheses())
    }

    /// Returns the delay of the likeliest hypothesis, in samples beyond the shortest delay.
    pub fn most_likely_delay(&self) -> usize {
        let likeliest = self.hypotheses().max_by(|a, b| a.probability.total_cmp(&b.probability));
        likeliest.map_or(0, |h| h.extra_delay)
    }

    /// Returns the hypotheses.
    pub fn hypotheses(&self) -> impl Iterator<Item = &Hypothesis> {
        self.hypotheses.iter().flatten()
    }

    /// Returns the logarithm of the posterior odds that the operator changed within the change window.
    pub fn log_odds(&self) -> f64 {
        self.detector.log_odds()
    }

    /// Returns the change declared at the last sample; `None` if there was none.
    pub fn change(&self) -> Option<Change> {
        self.detector.change()
    }

    /// Returns the number of samples so far.
    pub fn sample_count(&self) -> u64 {
        self.samples
    }
}
