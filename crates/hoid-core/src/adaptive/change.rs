//! When a person changed, and in what.
//!
//! `Lambda = ln(sum of P(h) over those born within the last T)/(sum of P(h) over those that are older))`: the logarithm of the posterior odds of a
//! change. It is the likelihood ratio of Willsky and Jones (A. S. Willsky and H. L. Jones, *IEEE Transactions on Automatic Control* 21 (1976) 108-112),
//! with the size of the change and its time averaged out instead of maximised, so that its expectation does not grow with the number of
//! times that are tried. A change is declared when Lambda is over the threshold and the likeliest of the recent hypotheses is old enough to
//! say what changed; the next only after Lambda has been below zero, when
//! what changed has become what holds.
//!
//! The likeliest of the recent hypotheses says since when, and what held before: the change of each quantity over its standard
//! error tells in what the person changed. For the innovation variance that is `ln(s2/s1)/sqrt(2/n)` with the n samples since.

use super::{
    Suppositions,
    hypothesis::{Before, Hypothesis},
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
    /// Change of K_e, K_e_dot and of the innovation variance, each over its standard error.
    pub z: [f64; 3],
}

/// Odds, and whether a change is being declared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watch {
    odds: f64,
    raised: bool,
    change: Option<Change>,
}

crate::state!([] Change { samples_ago, odds, before, now, z });

impl State for Watch {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        let mut is_there = self.change.is_some();
        visit_all(&mut [&mut self.odds, &mut self.raised, &mut is_there], each);
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
            change: None,
        }
    }
}

/// Least share of either side of the odds.
const LEAST: f64 = 1e-12;

impl Watch {
    /// Looks at the hypotheses after a sample.
    pub fn look(&mut self, hypotheses: &[Option<Hypothesis>], now: u64, suppositions: &Suppositions) {
        let (mut recent, mut older) = (0.0, 0.0);
        for h in hypotheses.iter().flatten() {
            if is_recent(h, now, suppositions) {
                recent += h.weight;
            } else {
                older += h.weight;
            }
        }
        self.odds = libm::log((recent + LEAST) / (older + LEAST));
        self.change = None;
        if self.odds > suppositions.threshold && !self.raised {
            let mut likeliest: Option<&Hypothesis> = None;
            for h in hypotheses.iter().flatten() {
                if is_recent(h, now, suppositions) && likeliest.is_none_or(|l| h.weight > l.weight) {
                    likeliest = Some(h);
                }
            }
            let settled = likeliest.filter(|h| now - h.born >= suppositions.settled);
            self.change = settled.map(|h| of(h, now, self.odds));
            self.raised = self.change.is_some();
        } else if self.odds < 0.0 {
            self.raised = false;
        }
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

fn of(h: &Hypothesis, now: u64, odds: f64) -> Change {
    let (before, after) = (h.before, h.now());
    let samples_ago = now - h.born;
    let mut z = [0.0; 3];
    for i in 0..2 {
        let variance = before.gains[i] + after.gains[i];
        if variance > 0.0 {
            z[i] = (after.eta[i] - before.eta[i]) / libm::sqrt(variance);
        }
    }
    if samples_ago > 0 && before.variance > 0.0 && after.variance > 0.0 {
        z[2] = libm::log(after.variance / before.variance) / libm::sqrt(2.0 / samples_ago as f64);
    }
    Change {
        samples_ago,
        odds,
        before,
        now: after,
        z,
    }
}
