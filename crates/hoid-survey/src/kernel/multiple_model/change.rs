//! Detection of a change in the operator: its time, and the parameters that changed.
//!
//! `Lambda = ln((sum of P(h) over hypotheses born within the last T)/(sum of P(h) over older hypotheses))` is the
//! logarithm of the posterior odds of a change. Lambda corresponds to the likelihood ratio of Willsky and Jones (A. S.
//! Willsky and H. L. Jones, *IEEE Transactions on Automatic Control* 21 (1976) 108-112), but the size and the time of
//! the change are averaged out instead of maximised. Its expectation therefore does not grow with the number of
//! candidate times. A change is declared if Lambda exceeds the threshold and the likeliest recent hypothesis is old
//! enough to identify the changed parameters. The next change is declared only after Lambda has been below zero, which
//! means that the new values are established, or if further parameters have changed: the neuromuscular system, if the
//! odds of the hypotheses in which it changed against all others exceed the same threshold, or the delay, if it changed
//! by more than three standard errors.
//!
//! The likeliest recent hypothesis gives the time of the change and the estimate before it. The change of each
//! parameter divided by its standard error shows which parameters changed. For the innovation variance this ratio is
//! `ln(s2/s1)/sqrt(2/n)`, where n is the number of samples since the change.

use super::{
    hypothesis::{Hypothesis, Snapshot},
    prior::{ChangePrior, PARAMETER_COUNT},
};
use hoid_core::state::{State, visit_all};

/// A declared change.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Change {
    /// Number of samples since the change according to the likeliest recent hypothesis.
    pub samples_ago: u64,
    /// Logarithm of the posterior odds, Lambda.
    pub log_odds: f64,
    /// The operator before the change.
    pub before: Snapshot,
    /// The operator after the change.
    pub after: Snapshot,
    /// Changes in K_e, K_e_dot, omega_nm, zeta_nm, the innovation variance and the delay, each divided by its standard
    /// error.
    pub z: [f64; PARAMETER_COUNT + 2],
}

/// Lambda, and the changes declared since it rose above zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangeDetector {
    log_odds: f64,
    /// True if a change was declared; the next two fields are true if it included the neuromuscular system or the
    /// delay.
    declared: bool,
    declared_neuromuscular: bool,
    declared_delay: bool,
    change: Option<Change>,
}

hoid_core::state!([] Change { samples_ago, log_odds, before, after, z });

impl State for ChangeDetector {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let mut is_there = self.change.is_some();
        visit_all(
            &mut [
                &mut self.log_odds,
                &mut self.declared,
                &mut self.declared_neuromuscular,
                &mut self.declared_delay,
                &mut is_there,
            ],
            each,
        );
        self.change = is_there.then(|| self.change.take().unwrap_or_default());
        if let Some(change) = &mut self.change {
            change.visit(each);
        }
    }
}

impl Default for ChangeDetector {
    fn default() -> Self {
        Self {
            log_odds: f64::NEG_INFINITY,
            declared: false,
            declared_neuromuscular: false,
            declared_delay: false,
            change: None,
        }
    }
}

/// Threshold for declaring a change in the delay, in standard errors.
const DELAY_THRESHOLD: f64 = 3.0;
/// Number added to the numerator and the denominator of the odds to keep Lambda finite.
const REGULARISATION: f64 = 1e-12;

impl ChangeDetector {
    /// Updates the detector with the hypotheses after a sample. Returns true if Lambda rises above zero, which marks
    /// the start of a change.
    pub fn update(&mut self, hypotheses: &[Option<Hypothesis>], now: u64, prior: &ChangePrior) -> bool {
        let sums = Sums::from_hypotheses(hypotheses, now, prior);
        let before = self.log_odds;
        self.log_odds = log_odds(sums.recent, sums.older);
        self.change = None;
        if self.log_odds < 0.0 {
            (self.declared, self.declared_neuromuscular, self.declared_delay) = (false, false, false);
        } else if self.log_odds > prior.log_odds_threshold {
            self.declare_change(&sums, hypotheses, now, prior);
        }
        self.log_odds > 0.0 && before <= 0.0
    }

    /// Declares the change of the likeliest recent hypothesis, provided that this hypothesis is old enough and that the
    /// change, or a part of it, has not been declared yet.
    fn declare_change(&mut self, sums: &Sums<'_>, hypotheses: &[Option<Hypothesis>], now: u64, prior: &ChangePrior) {
        let Some(h) = sums.most_likely.filter(|h| now - h.birth_sample >= prior.settling_time) else {
            return;
        };
        let others = sums.recent + sums.older - sums.neuromuscular;
        let neuromuscular_changed =
            h.neuromuscular_changed && log_odds(sums.neuromuscular, others.max(0.0)) > prior.log_odds_threshold;
        let new_neuromuscular = neuromuscular_changed && !self.declared_neuromuscular;
        let delay_may_be_new = prior.delay.count > 1 && !self.declared_delay;
        // At most samples, a change has already been declared and nothing new can be declared.
        if self.declared && !new_neuromuscular && !delay_may_be_new {
            return;
        }
        let recent = hypotheses.iter().flatten().filter(|h| is_recent(h, now, prior));
        let change = change_of(h, mean_delay(recent), now, self.log_odds);
        let delay_changed = change.z[PARAMETER_COUNT + 1].abs() > DELAY_THRESHOLD;
        let new_delay = delay_changed && !self.declared_delay;
        if !self.declared || new_neuromuscular || new_delay {
            self.change = Some(change);
            self.declared = true;
            self.declared_neuromuscular |= h.neuromuscular_changed;
            self.declared_delay |= delay_changed;
        }
    }

    /// Returns Lambda.
    pub fn log_odds(&self) -> f64 {
        self.log_odds
    }

    /// Returns the change declared at the last sample; `None` if there was none.
    pub fn change(&self) -> Option<Change> {
        self.change
    }
}

/// Sums of probabilities, and the likeliest recent hypothesis.
struct Sums<'a> {
    recent: f64,
    older: f64,
    /// Sum over the recent hypotheses in which omega_nm and zeta_nm changed as well.
    neuromuscular: f64,
    most_likely: Option<&'a Hypothesis>,
}

impl<'a> Sums<'a> {
    fn from_hypotheses(hypotheses: &'a [Option<Hypothesis>], now: u64, prior: &ChangePrior) -> Self {
        let mut sums = Self {
            recent: 0.0,
            older: 0.0,
            neuromuscular: 0.0,
            most_likely: None,
        };
        for h in hypotheses.iter().flatten() {
            if !is_recent(h, now, prior) {
                sums.older += h.probability;
                continue;
            }
            sums.recent += h.probability;
            sums.neuromuscular += if h.neuromuscular_changed { h.probability } else { 0.0 };
            if sums.most_likely.is_none_or(|l| h.probability > l.probability) {
                sums.most_likely = Some(h);
            }
        }
        sums
    }
}

fn log_odds(probability: f64, of_others: f64) -> f64 {
    libm::log((probability + REGULARISATION) / (of_others + REGULARISATION))
}

/// True if the hypothesis was born within the change window. The first hypothesis, born at sample 0, does not represent
/// a change.
fn is_recent(h: &Hypothesis, now: u64, prior: &ChangePrior) -> bool {
    h.birth_sample > 0 && now - h.birth_sample < prior.change_window
}

/// Mean and variance of the delay over hypotheses, in samples beyond the shortest delay. The variance includes 1/12 for
/// rounding to whole samples.
pub(super) fn mean_delay<'a>(hypotheses: impl Iterator<Item = &'a Hypothesis>) -> [f64; 2] {
    let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
    for h in hypotheses {
        let delay = h.extra_delay as f64;
        sum += h.probability;
        first += h.probability * delay;
        second += h.probability * delay * delay;
    }
    let mean = first / sum;
    [mean, (second / sum - mean * mean).max(0.0) + 1.0 / 12.0]
}

/// Returns the change that a hypothesis represents; `delay` is the delay after the change.
fn change_of(h: &Hypothesis, delay: [f64; 2], now: u64, log_odds: f64) -> Change {
    let (before, after) = (h.before, Snapshot { delay, ..h.snapshot() });
    let samples_ago = now - h.birth_sample;
    let mut z = [0.0; PARAMETER_COUNT + 2];
    for i in 0..PARAMETER_COUNT {
        let variance_of = |s: &Snapshot| {
            if i < 2 {
                s.gain_covariance[i]
            } else {
                s.neuromuscular_variance[i - 2]
            }
        };
        let variance = variance_of(&before) + variance_of(&after);
        if variance > 0.0 {
            z[i] = (after.eta[i] - before.eta[i]) / libm::sqrt(variance);
        }
    }
    if samples_ago > 0 && before.innovation_variance > 0.0 && after.innovation_variance > 0.0 {
        z[PARAMETER_COUNT] =
            libm::log(after.innovation_variance / before.innovation_variance) / libm::sqrt(2.0 / samples_ago as f64);
    }
    z[PARAMETER_COUNT + 1] = (after.delay[0] - before.delay[0]) / libm::sqrt(before.delay[1] + after.delay[1]);
    Change {
        samples_ago,
        log_odds,
        before,
        after,
        z,
    }
}
