//! Gains, level and corrections of what is held, by Kalman filters that differ in what they suppose.
//!
//! - **Forms.** The numerator is any, or that of a gain with a lead, `(K_e + K_e_dot s)(s + a)`: the
//!   second is the first with a covariance of the gains that leaves them no other direction, in what
//!   is not known at the beginning and in every drift.
//! - **Drifts.** Of each form one filter says that the gains hardly move, others that they walk at
//!   random. A filter whose weight has fallen below `LEAST` takes over the state of the best. Who begins
//!   with nothing does not walk for some seconds from when what is held is corrected: an error near one
//!   frequency is explained by gains that follow its phase as well as by the right poles and delay, and
//!   better than by poles and delay that are not found yet, so that they never would be.
//! - **Newborns.** Others say that the gains have just changed: they begin as the first, with a
//!   variance added, and walk at random. After their life they are born again; one that foretells
//!   better than the first then takes its place. So a change is followed at once, and what comes
//!   after it is learnt as steadily as what was before. How often this person changes is learnt too:
//!   the odds of a birth are the mean of a Beta distribution, of what is supposed of people and of the
//!   births of this one that took the place, so that they cost less and less while nothing changes.
//!
//! Weights follow the likelihood and are forgotten towards what is supposed of them, with a time
//! constant of seconds: a person's gains may be steady or not from one moment to the next, and who
//! changes may have another form from then on. (D. T. Magill, IEEE Trans. Automatic Control 10 (1965)
//! 434-439; P. Andersson, Int. J. Control 42 (1985) 1175-1193, of filters that are born where a change is
//! supposed.)
//!
//! The filters of both forms stand side by side (`kalman`), and a sample is taken step by step: all
//! foretell it, all are weighed, all learn. A weight is kept as it is beside its logarithm, so that means
//! need no exponential.

mod prior;

pub use prior::GainPrior;

use super::{
    basis::{Basis, Point, Regressors},
    kalman::{Foretold, Forms, Kalman, Move, Seen, Shapes, shapes_of},
    sizes::{DRIFTS, FILTERS, FORMS, GAINS, HELD, LINEAR, NEWBORNS, STATES},
};
use crate::adaptive::elementary::{exp_within, ln_of_normal};

/// Logarithm of the weight from which a filter starts again from the best, and that with which it
/// does, which is this.
const LEAST: f64 = -7.0;
const AGAIN: f64 = -3.5;
const WEIGHT_AGAIN: f64 = 0.030_197_383_422_318_5;
/// Logarithms of densities count from here on: less says no more.
const LOWEST: f64 = -700.0;
/// Weight below which a filter is left out of means.
const NOTHING: f64 = 1e-9;
/// Share of the square of a move that is added to the variance of a correction.
const OPEN_AGAIN: f64 = 0.3;
/// Logarithm of the weight of each form where all are alike.
const EVEN: f64 = -core::f64::consts::LN_2;
/// K_e_dot of the form with a lead is supposed to be so much of K_e, s.
const LEAD_S: f64 = 0.5;

/// What surrounds a sample: units and drifts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Around {
    /// Variance of eps.
    pub variance: f64,
    /// |Y| at the reference.
    pub unit: f64,
    /// Variances of the level's drift in one second: of the first filter, of the others.
    pub level: [f64; 2],
}

/// All filters with their weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Gains {
    prior: GainPrior,
    shapes: Shapes,
    /// What is supposed of the logarithm of each filter's weight, before they sum to one.
    supposed: [f64; FILTERS],
    /// Each with its weight among those of its form, as it is and as a logarithm.
    filters: [Kalman; FILTERS],
    /// Probabilities of the forms, and their logarithms.
    weights: Forms,
    log_weights: Forms,
    samples: u64,
    /// Samples of a newborn's life.
    life: u64,
    /// Samples for which the gains do not walk once what is held is corrected, and those up to which
    /// they do not.
    steady: u64,
    still: u64,
    /// Weight of a newborn at birth over that of the first, and how many births that rests on.
    odds: f64,
    births: f64,
}

crate::state!([] Gains { filters, weights, log_weights, samples, steady, still, odds, births });

impl Gains {
    /// With gains of zero and nothing known of them. The basis gives the scale of the gains. `None`
    /// for numbers that make no sense.
    pub fn new(prior: GainPrior, basis: &Basis) -> Option<Self> {
        let newborn = prior.odds * prior.shares[0];
        let mut gains = Self {
            prior,
            shapes: shapes(basis),
            supposed: core::array::from_fn(|k| libm::log(prior.shares.get(k).copied().unwrap_or(newborn)).max(LOWEST)),
            filters: [Kalman::ZERO; FILTERS],
            weights: Forms::ZERO,
            log_weights: Forms::ZERO,
            samples: 0,
            life: libm::round(prior.life / prior.sample_time).max(NEWBORNS as f64) as u64,
            steady: libm::round(prior.steady / prior.sample_time) as u64,
            still: 0,
            odds: prior.odds,
            births: prior.births,
        };
        gains.weigh_anew();
        prior.is_sound().then_some(gains)
    }

    fn weigh_anew(&mut self) {
        self.log_weights = Forms::both(EVEN);
        for (filter, supposed) in self.filters.iter_mut().zip(self.supposed) {
            filter.log_weight = Forms::both(supposed);
        }
        self.weigh();
    }

    /// Begins with gains of zero and these standard deviations of gains and level; what is held is
    /// as it is.
    pub fn begin(&mut self, gain: f64, level: f64) {
        for filter in &mut self.filters {
            filter.state = [Forms::ZERO; STATES];
            filter.reopen(&self.shapes, gain, level, [0.0; HELD]);
        }
        self.weigh_anew();
    }

    /// Begins with an estimate of gains, level and corrections, and its covariance.
    pub(super) fn begin_at(&mut self, state: &[f64; STATES], covariance: &[[f64; STATES]; STATES]) {
        self.filters.iter_mut().for_each(|f| f.place_at(state, covariance));
        self.walk_at_once();
        self.weigh_anew();
    }

    /// Lets the gains walk at any time.
    pub(super) fn walk_at_once(&mut self) {
        self.steady = 0;
    }

    /// Lets the level be anything within this standard deviation.
    pub(super) fn open_level(&mut self, level: f64) {
        self.filters.iter_mut().for_each(|f| f.open(GAINS, level * level));
    }

    /// Goes on from the gains of now, as if nothing were known of how good they are, and lets what is
    /// held be corrected from here on.
    pub fn reopen(&mut self, gain: f64, level: f64, point: Point) {
        let held = self.prior.held_at(point);
        for filter in &mut self.filters {
            filter.reopen(&self.shapes, gain, level, held);
        }
        self.still = self.samples + self.steady;
    }

    /// Lets the gains be anything within this standard deviation more than they were.
    pub fn open(&mut self, gain: f64) {
        for filter in &mut self.filters {
            filter.open_gains(&self.shapes, gain * gain);
        }
    }

    /// Lets what is held be anything that is supposed of people.
    pub fn open_held(&mut self, point: Point) {
        for filter in &mut self.filters {
            for (i, deviation) in (LINEAR..STATES).zip(self.prior.held_at(point)) {
                filter.open(i, deviation * deviation);
            }
        }
    }

    /// The basis was moved by these corrections. What was of first order before was wrong by some of
    /// that: the corrections are opened by a share of it.
    pub fn moved(&mut self, by: [f64; HELD]) {
        for filter in &mut self.filters {
            for (i, by) in (LINEAR..STATES).zip(by) {
                filter.state[i] -= Forms::both(by);
                filter.open(i, OPEN_AGAIN * by * by);
            }
        }
    }

    /// Takes a sample behind the whitening filter; `level` is D(1), `point` that of the basis. Returns
    /// the innovation of the mixture, and the logarithm of the density that it gave to the sample, but
    /// for a constant.
    pub fn update(&mut self, y: f64, regressors: &Regressors, level: f64, point: Point, around: &Around) -> (f64, f64) {
        let prior = &self.prior;
        let ts = prior.sample_time;
        let tails = [prior.freedom, prior.limit];
        let seen = Seen::new(y, regressors, level, around.variance, point, tails);
        let [among_forms, among_drifts] = prior.forgotten;
        let (mut innovation, mut total) = (Forms::ZERO, Forms::ZERO);
        // Each step for all filters before the next: they do not wait for one another, the steps do.
        let mut foretold = [Foretold::NOTHING; FILTERS];
        for (k, (filter, foretold)) in self.filters.iter_mut().zip(&mut foretold).enumerate() {
            let walk = prior.drifts.get(k).copied().unwrap_or(prior.newborn[0]) * around.unit;
            filter.open_gains(&self.shapes, walk * walk * ts);
            filter.open(GAINS, around.level[usize::from(k > 0)] * ts);
            *foretold = filter.foretold(&seen);
        }
        let mut moves = [Move::NONE; FILTERS];
        for (k, (filter, own)) in self.filters.iter_mut().zip(&foretold).enumerate() {
            innovation += filter.weight * own.eps;
            total += filter.weight;
            let forgotten = if k < DRIFTS { among_drifts } else { 0.0 };
            let supposed = Forms::both(self.supposed[k]);
            let (by, log_density) = own.weighed(&seen);
            moves[k] = by;
            filter.log_weight += Forms::both(forgotten) * (supposed - filter.log_weight) + log_density;
        }
        for ((filter, own), by) in self.filters.iter_mut().zip(&foretold).zip(&moves) {
            filter.learn(own, by, &seen);
        }
        let innovation = (self.weights * innovation).sum() / (self.weights * total).sum();
        let even = Forms::both(EVEN);
        self.log_weights += Forms::both(among_forms) * (even - self.log_weights);
        let log_density = self.weigh();
        self.samples += 1;
        self.renew(around.unit);
        (innovation, log_density)
    }

    /// Makes the weights of the forms, and those of each form's filters, sum to one by their logarithms;
    /// returns the logarithm of what all summed to. Densities of zero by underflow say no more than very
    /// small ones. Nothing waits for a logarithm.
    #[inline(always)]
    fn weigh(&mut self) -> f64 {
        let lowest = Forms::both(LOWEST);
        let mut highest = Forms::both(-1e300);
        for filter in &self.filters {
            highest = filter.log_weight.at_least(highest);
        }
        let of_form = self.log_weights + highest;
        let top = of_form.0.into_iter().fold(-1e300, f64::max);
        let mut sum = Forms::ZERO;
        for filter in &mut self.filters {
            filter.weight = (filter.log_weight - highest).at_least(lowest).map(exp_within);
            sum += filter.weight;
        }
        let each = (of_form - Forms::both(top)).at_least(lowest).map(exp_within) * sum;
        let (share, log_sum) = (Forms::both(1.0) / sum, sum.map(ln_of_normal));
        let log_total = top + ln_of_normal(each.sum());
        for filter in &mut self.filters {
            filter.weight = filter.weight * share;
            filter.log_weight -= highest + log_sum;
        }
        self.weights = each * Forms::both(1.0 / each.sum());
        self.log_weights = of_form + log_sum - Forms::both(log_total);
        log_total
    }

    /// Filters that are out of the question start again, and the newborns whose life is over are born
    /// again.
    fn renew(&mut self, unit: f64) {
        if self.samples < self.still {
            for k in 1..DRIFTS {
                self.filters[k] = Kalman {
                    weight: Forms::both(WEIGHT_AGAIN),
                    log_weight: Forms::both(AGAIN),
                    ..self.filters[0]
                };
            }
        }
        let out = |weight: f64| weight < LEAST;
        if self.filters[..DRIFTS]
            .iter()
            .any(|f| f.log_weight.0.into_iter().any(out))
        {
            (0..FORMS).for_each(|form| self.restart(form));
        }
        let phase = self.samples % self.life;
        for i in 0..NEWBORNS {
            // The newborn i at `samples + i life/NEWBORNS`, a multiple of the life.
            let before = i as u64 * self.life / NEWBORNS as u64;
            if phase != (self.life - before) % self.life {
                continue;
            }
            let newborn = self.filters[DRIFTS + i];
            let mut taken = 0.0;
            for form in 0..FORMS {
                if newborn.log_weight.0[form] > self.filters[0].log_weight.0[form] {
                    let first = &mut self.filters[0];
                    first.follow(&newborn, form);
                    first.weight.0[form] = newborn.weight.0[form];
                    first.log_weight.0[form] = newborn.log_weight.0[form];
                    taken += self.weights.0[form];
                }
            }
            self.births += 1.0;
            self.odds += (taken - self.odds) / self.births;
            let jump = self.prior.newborn[1] * unit;
            let mut child = self.filters[0];
            child.open_gains(&self.shapes, jump * jump);
            child.weight = child.weight * Forms::both(self.odds);
            child.log_weight += Forms::both(libm::log(self.odds));
            self.filters[DRIFTS + i] = child;
        }
    }

    /// The filters of a form that are out of the question start again from the best.
    fn restart(&mut self, form: usize) {
        let log_weight = |filter: &Kalman| filter.log_weight.0[form];
        let mut best = 0;
        for k in 1..FILTERS {
            if log_weight(&self.filters[k]) > log_weight(&self.filters[best]) {
                best = k;
            }
        }
        let best = self.filters[best];
        for filter in &mut self.filters[..DRIFTS] {
            if log_weight(filter) < LEAST {
                filter.follow(&best, form);
                (filter.weight.0[form], filter.log_weight.0[form]) = (WEIGHT_AGAIN, AGAIN);
            }
        }
    }

    /// The innovation of the mixture, without an update.
    pub fn innovation(&self, y: f64, regressors: &Regressors, level: f64) -> f64 {
        // Variance, point and tails are none of the prediction.
        let nowhere = Point {
            tau: 0.0,
            omega: 0.0,
            zeta: 0.0,
            lag: 0.0,
        };
        let seen = Seen::new(y, regressors, level, 0.0, nowhere, [1.0; 2]);
        let (mut innovation, mut total) = (Forms::ZERO, Forms::ZERO);
        for filter in &self.filters {
            let weight = self.weight_in_means(filter);
            innovation += weight * filter.innovation(&seen);
            total += weight;
        }
        innovation.sum() / total.sum()
    }

    /// Weight of a filter among all; zero where it is next to nothing.
    #[inline(always)]
    fn weight_in_means(&self, filter: &Kalman) -> Forms {
        (self.weights * filter.weight).map(|weight| if weight > NOTHING { weight } else { 0.0 })
    }

    /// Probability of a form.
    pub fn probability(&self, form: usize) -> f64 {
        self.weights.0.get(form).copied().unwrap_or(0.0)
    }

    /// Mean of gains, level and corrections.
    #[inline]
    pub fn state(&self) -> [f64; STATES] {
        let weights = self.filters.each_ref().map(|filter| self.weight_in_means(filter));
        let share = 1.0 / weights.iter().fold(Forms::ZERO, |sum, weight| sum + *weight).sum();
        core::array::from_fn(|i| {
            let mut mean = Forms::ZERO;
            for (filter, weight) in self.filters.iter().zip(&weights) {
                mean += *weight * filter.state[i];
            }
            mean.sum() * share
        })
    }

    /// Covariance of the mixture: the differences between the filters are part of it. A newborn counts for
    /// what it has gained since it was born: that somebody may be born is no news, and would make the
    /// covariance grow at each birth.
    pub fn covariance(&self) -> [[f64; STATES]; STATES] {
        let mean = self.state();
        let (mut sum, mut total) = ([[0.0; STATES]; STATES], 0.0);
        let born = self.weight_in_means(&self.filters[0]).0.map(|first| self.odds * first);
        for (k, filter) in self.filters.iter().enumerate() {
            for (form, weight) in self.weight_in_means(filter).0.into_iter().enumerate() {
                let weight = if k < DRIFTS {
                    weight
                } else {
                    (weight - born[form]).max(0.0)
                };
                let state = filter.state_of(form);
                total += weight;
                for i in 0..STATES {
                    let a = state[i] - mean[i];
                    for j in 0..STATES {
                        sum[i][j] += weight * (filter.covariance_of(form, i, j) + a * (state[j] - mean[j]));
                    }
                }
            }
        }
        sum.map(|row| row.map(|c| c / total))
    }
}

/// The covariances of the gains of each form, for a |Y| of one.
fn shapes(basis: &Basis) -> Shapes {
    let mut shapes = [[[0.0; GAINS]; GAINS]; FORMS];
    (0..GAINS).for_each(|i| shapes[0][i][i] = 1.0);
    let a = 1.0 / basis.point().lag;
    for column in [[a, 1.0, 0.0], [0.0, LEAD_S * a, LEAD_S]] {
        let scaled: [f64; GAINS] = core::array::from_fn(|i| column[i] / basis.scale()[i]);
        for i in 0..GAINS {
            for j in 0..GAINS {
                shapes[1][i][j] += scaled[i] * scaled[j];
            }
        }
    }
    shapes_of(&shapes)
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod twin;
