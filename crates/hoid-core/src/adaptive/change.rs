//! When a person changed, and in what.
//!
//! `Lambda = ln(sum of P(h) over those born within the last T)/(sum of P(h) over those that are older))`: the logarithm of the posterior odds of a
//! change. It is the likelihood ratio of Willsky and Jones (A. S. Willsky and H. L. Jones, *IEEE Transactions on Automatic Control* 21 (1976) 108-112),
//! with the size of the change and its time averaged out instead of maximised, so that its expectation does not grow with the number of
//! times that are tried. A change is declared when Lambda is over the threshold and the likeliest of the recent hypotheses is old enough to
//! say what changed; the next only after Lambda has been below zero, when
//! what changed has become what holds, or when more turns out to have changed: the neuromuscular system, by the same odds of such hypotheses against all
//! others, or the delay, by three standard errors.
//!
//! The likeliest of the recent hypotheses says since when, and what held before: the change of each quantity over its standard
//! error tells in what the person changed. For the innovation variance that is `ln(s2/s1)/sqrt(2/n)` with the n samples since.

use super::{
    Suppositions,
    hypothesis::{Before, Hypothesis, OPERATOR},
};
use crate::state::{State, visit_all};

/// A change that was declared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Change {
    /// Samples since the change, as the likeliest hypothesis has it.
    pub samples_ago: u64,
    /// Logarithm of the odds.
    pub odds: f64,
    /// What held before.
    pub before: Before,
    /// What holds now.
    pub now: Before,
    /// Change of K_e, K_e_dot, omega_nm, zeta_nm, of the innovation variance and of the delay, each over its standard error.
    pub z: [f64; OPERATOR + 2],
}

/// Odds, and whether a change is being declared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watch {
    odds: f64,
    raised: bool,
    /// The same for one in which the neuromuscular system changed too, and for one in which the delay did.
    raised_whole: bool,
    raised_delay: bool,
    change: Option<Change>,
}

crate::state!([] Change { samples_ago, odds, before, now, z });

impl State for Watch {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let mut is_there = self.change.is_some();
        visit_all(
            &mut [
                &mut self.odds,
                &mut self.raised,
                &mut self.raised_whole,
                &mut self.raised_delay,
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

impl Default for Watch {
    fn default() -> Self {
        Self {
            odds: f64::NEG_INFINITY,
            raised: false,
            raised_whole: false,
            raised_delay: false,
            change: None,
        }
    }
}

/// Change of the delay over its standard error that is declared where a change was declared without one.
const OTHER_DELAY: f64 = 3.0;
/// Least share of either side of the odds.
const LEAST: f64 = 1e-12;

impl Watch {
    /// Looks at the hypotheses after a sample. True where Lambda rises above zero: a change begins.
    pub fn look(&mut self, hypotheses: &[Option<Hypothesis>], now: u64, suppositions: &Suppositions) -> bool {
        let (mut recent, mut older, mut whole) = (0.0, 0.0, 0.0);
        let mut likeliest: Option<&Hypothesis> = None;
        for h in hypotheses.iter().flatten() {
            if !is_recent(h, now, suppositions) {
                older += h.weight;
                continue;
            }
            recent += h.weight;
            whole += if h.whole { h.weight } else { 0.0 };
            if likeliest.is_none_or(|l| h.weight > l.weight) {
                likeliest = Some(h);
            }
        }
        let before = self.odds;
        self.odds = libm::log((recent + LEAST) / (older + LEAST));
        self.change = None;
        if self.odds < 0.0 {
            (self.raised, self.raised_whole, self.raised_delay) = (false, false, false);
        } else if self.odds > suppositions.threshold {
            let settled = likeliest.filter(|h| now - h.born >= suppositions.settled);
            let others = recent + older - whole;
            let is_whole = libm::log((whole + LEAST) / (others.max(0.0) + LEAST)) > suppositions.threshold;
            // What is only asked for while it may be declared: this stands in every sample after a change.
            let unsaid = |h: &&Hypothesis| {
                !self.raised
                    || is_whole && h.whole && !self.raised_whole
                    || suppositions.delays.count > 1 && !self.raised_delay
            };
            if let Some(h) = settled.filter(unsaid) {
                let of_recent = |h: &&Hypothesis| is_recent(h, now, suppositions);
                let delay = delay_of(hypotheses.iter().flatten().filter(of_recent));
                let change = of(h, delay, now, self.odds);
                let other_delay = change.z[OPERATOR + 1].abs() > OTHER_DELAY;
                let more = is_whole && h.whole && !self.raised_whole || other_delay && !self.raised_delay;
                if !self.raised || more {
                    self.change = Some(change);
                    self.raised = true;
                    self.raised_whole |= h.whole;
                    self.raised_delay |= other_delay;
                }
            }
        }
        self.odds > 0.0 && before <= 0.0
    }

    /// Lambda.
    pub fn odds(&self) -> f64 {
        self.odds
    }

    /// The change that was declared at the last sample.
    pub fn change(&self) -> Option<Change> {
        self.change
    }
}

/// The first hypothesis, born at sample 0, stands for no change.
fn is_recent(h: &Hypothesis, now: u64, suppositions: &Suppositions) -> bool {
    h.born > 0 && now - h.born < suppositions.recent
}

/// Mean and variance of the delay of hypotheses, in samples beyond the shortest; that of rounding to whole samples included.
pub(super) fn delay_of<'a>(hypotheses: impl Iterator<Item = &'a Hypothesis>) -> [f64; 2] {
    let (mut sum, mut first, mut second) = (0.0, 0.0, 0.0);
    for h in hypotheses {
        let later = h.later as f64;
        sum += h.weight;
        first += h.weight * later;
        second += h.weight * later * later;
    }
    let mean = first / sum;
    [mean, (second / sum - mean * mean).max(0.0) + 1.0 / 12.0]
}

fn of(h: &Hypothesis, delay: [f64; 2], now: u64, odds: f64) -> Change {
    let (before, after) = (h.before, Before { delay, ..h.now() });
    let samples_ago = now - h.born;
    let mut z = [0.0; OPERATOR + 2];
    for i in 0..OPERATOR {
        let of = |b: &Before| if i < 2 { b.gains[i] } else { b.neuromuscular[i - 2] };
        let variance = of(&before) + of(&after);
        if variance > 0.0 {
            z[i] = (after.eta[i] - before.eta[i]) / libm::sqrt(variance);
        }
    }
    if samples_ago > 0 && before.variance > 0.0 && after.variance > 0.0 {
        z[OPERATOR] = libm::log(after.variance / before.variance) / libm::sqrt(2.0 / samples_ago as f64);
    }
    z[OPERATOR + 1] = (after.delay[0] - before.delay[0]) / libm::sqrt(before.delay[1] + after.delay[1]);
    Change {
        samples_ago,
        odds,
        before,
        now: after,
        z,
    }
}
