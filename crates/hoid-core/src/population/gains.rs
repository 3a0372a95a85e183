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
//!   after it is learnt as steadily as what was before.
//!
//! Weights follow the likelihood and are forgotten towards what is supposed of them, with a time
//! constant: short among the drifts, for a person's gains may be steady or not from one moment to the
//! next; long among the forms. (D. T. Magill, IEEE Trans. Automatic Control 10 (1965) 434-439; P. Andersson,
//! Int. J. Control 42 (1985) 1175-1193, of filters that are born where a change is supposed.)

use super::{
    basis::{Basis, Point, Regressors},
    kalman::{Kalman, Seen},
    sizes::{DRIFTS, FILTERS, FORMS, GAINS, HELD, LINEAR, NEWBORNS, STATES},
};
use crate::adaptive::elementary::exp;

/// Logarithm of the weight from which a filter starts again from the best, and that with which it
/// does.
const LEAST: f64 = -7.0;
const AGAIN: f64 = -3.5;
/// Weight below which a filter is left out of means.
const NOTHING: f64 = 1e-9;
/// Share of the square of a move that is added to the variance of a correction.
const OPEN_AGAIN: f64 = 0.3;
/// K_e_dot of the form with a lead is supposed to be so much of K_e, s.
const LEAD_S: f64 = 0.5;

/// What all filters share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainPrior {
    /// Standard deviation of a gain's drift in one second, over |Y| at the reference.
    pub drifts: [f64; DRIFTS],
    /// What is supposed of their weights.
    pub shares: [f64; DRIFTS],
    /// The newborns: drift in one second and added standard deviation, over |Y| at the reference.
    pub newborn: [f64; 2],
    /// Their weight at birth, over that of the first filter.
    pub odds: f64,
    /// Their life, s.
    pub life: f64,
    /// Time in which the gains do not walk once what is held is corrected, s.
    pub steady: f64,
    /// Degrees of freedom of the Student distribution.
    pub freedom: f64,
    /// Standard deviations beyond which an innovation moves the estimate no further.
    pub limit: f64,
    /// Shares of the logarithms of the weights that a sample forgets, among forms and drifts.
    pub forgotten: [f64; 2],
    /// Standard deviations of omega and zeta, as shares of theirs, and of tau, s.
    pub held: [f64; HELD],
    /// Sample time, s.
    pub sample_time: f64,
}

impl GainPrior {
    /// Standard deviations of what is held, in its units.
    fn held_at(&self, point: Point) -> [f64; HELD] {
        let [omega, zeta, tau] = self.held;
        [omega * point.omega, zeta * point.zeta, tau]
    }

    fn is_sound(&self) -> bool {
        let sizes = self.drifts.iter().chain(&self.newborn).chain(&self.held);
        sizes.into_iter().all(|d| *d >= 0.0)
            && self.shares.iter().all(|s| *s > 0.0 && *s <= 1.0)
            && self.odds > 0.0
            && self.life > 0.0
            && self.steady >= 0.0
            && self.freedom > 0.0
            && self.limit > 0.0
            && self.sample_time > 0.0
            && self.forgotten.iter().all(|f| (0.0..=1.0).contains(f))
    }
}

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
    shapes: [[[f64; GAINS]; GAINS]; FORMS],
    filters: [[Kalman; FILTERS]; FORMS],
    log_weights: [f64; FORMS],
    samples: u64,
    /// Samples for which the gains do not walk once what is held is corrected, and those up to which
    /// they do not.
    steady: u64,
    still: u64,
}

crate::state!([] Gains { filters, log_weights, samples, steady, still });

impl Gains {
    /// With gains of zero and nothing known of them. The basis gives the scale of the gains. `None`
    /// for numbers that make no sense.
    pub fn new(prior: GainPrior, basis: &Basis) -> Option<Self> {
        let nobody = Kalman {
            state: [0.0; STATES],
            covariance: [[0.0; STATES]; STATES],
            log_weight: 0.0,
        };
        let mut gains = Self {
            prior,
            shapes: shapes(basis),
            filters: [[nobody; FILTERS]; FORMS],
            log_weights: [-libm::log(FORMS as f64); FORMS],
            samples: 0,
            steady: libm::round(prior.steady / prior.sample_time) as u64,
            still: 0,
        };
        gains.weigh_anew();
        prior.is_sound().then_some(gains)
    }

    fn supposed(&self, filter: usize) -> f64 {
        let share = self.prior.shares.get(filter);
        libm::log(share.copied().unwrap_or(self.prior.odds * self.prior.shares[0]))
    }

    fn weigh_anew(&mut self) {
        self.log_weights = [-libm::log(FORMS as f64); FORMS];
        for k in 0..FILTERS {
            let log_weight = self.supposed(k);
            self.filters.iter_mut().for_each(|form| form[k].log_weight = log_weight);
        }
        for filters in &mut self.filters {
            normalise(filters);
        }
    }

    /// Begins with gains of zero and these standard deviations of gains and level; what is held is
    /// as it is.
    pub fn begin(&mut self, gain: f64, level: f64) {
        for (filters, shape) in self.filters.iter_mut().zip(&self.shapes) {
            for filter in filters {
                filter.state = [0.0; STATES];
                filter.reopen(shape, gain, level, [0.0; HELD]);
            }
        }
        self.weigh_anew();
    }

    /// Begins with an estimate of gains, level and corrections, and its covariance.
    pub(super) fn begin_at(&mut self, state: &[f64; STATES], covariance: &[[f64; STATES]; STATES]) {
        for filter in self.filters.iter_mut().flatten() {
            (filter.state, filter.covariance) = (*state, *covariance);
        }
        self.walk_at_once();
        self.weigh_anew();
    }

    /// Lets the gains walk at any time.
    pub(super) fn walk_at_once(&mut self) {
        self.steady = 0;
    }

    /// Lets the level be anything within this standard deviation.
    pub(super) fn open_level(&mut self, level: f64) {
        for filter in self.filters.iter_mut().flatten() {
            filter.covariance[GAINS][GAINS] += level * level;
        }
    }

    /// Goes on from the gains of now, as if nothing were known of how good they are, and lets what is
    /// held be corrected from here on.
    pub fn reopen(&mut self, gain: f64, level: f64, point: Point) {
        let held = self.prior.held_at(point);
        for (filters, shape) in self.filters.iter_mut().zip(&self.shapes) {
            filters.iter_mut().for_each(|f| f.reopen(shape, gain, level, held));
        }
        self.still = self.samples + self.steady;
    }

    /// Lets the gains be anything within this standard deviation more than they were.
    pub fn open(&mut self, gain: f64) {
        for (filters, shape) in self.filters.iter_mut().zip(&self.shapes) {
            filters.iter_mut().for_each(|f| f.open_gains(shape, gain * gain));
        }
    }

    /// Lets what is held be anything that is supposed of people.
    pub fn open_held(&mut self, point: Point) {
        for filter in self.filters.iter_mut().flatten() {
            for (i, deviation) in (LINEAR..STATES).zip(self.prior.held_at(point)) {
                filter.covariance[i][i] += deviation * deviation;
            }
        }
    }

    /// The basis was moved by these corrections. What was of first order before was wrong by some of
    /// that: the corrections are opened by a share of it.
    pub fn moved(&mut self, by: [f64; HELD]) {
        for filter in self.filters.iter_mut().flatten() {
            for (i, by) in (LINEAR..STATES).zip(by) {
                filter.state[i] -= by;
                filter.covariance[i][i] += OPEN_AGAIN * by * by;
            }
        }
    }

    /// Takes a sample behind the whitening filter; `level` is D(1), `point` that of the basis. Returns
    /// the innovation of the mixture, and the logarithm of the density that it gave to the sample, but
    /// for a constant.
    pub fn update(&mut self, y: f64, regressors: &Regressors, level: f64, point: Point, around: &Around) -> (f64, f64) {
        let prior = self.prior;
        let ts = prior.sample_time;
        let seen = Seen {
            y,
            regressors,
            level,
            variance: around.variance,
            point,
            tails: [prior.freedom, prior.limit],
        };
        let walks: [f64; FILTERS] = core::array::from_fn(|k| {
            let drift = prior.drifts.get(k).copied().unwrap_or(prior.newborn[0]) * around.unit;
            drift * drift * ts
        });
        let [among_forms, among_drifts] = prior.forgotten;
        let supposed: [f64; FILTERS] = core::array::from_fn(|k| self.supposed(k));
        let (mut innovation, mut total) = (0.0, 0.0);
        let before = log_sum(&self.log_weights);
        for form in 0..FORMS {
            let share = exp(self.log_weights[form]);
            let filters = &mut self.filters[form];
            for (k, filter) in filters.iter_mut().enumerate() {
                filter.open_gains(&self.shapes[form], walks[k]);
                filter.covariance[GAINS][GAINS] += around.level[usize::from(k > 0)] * ts;
                let weight = share * exp(filter.log_weight);
                let (eps, log_density) = filter.update(&seen);
                innovation += weight * eps;
                total += weight;
                if k < DRIFTS {
                    filter.log_weight += among_drifts * (supposed[k] - filter.log_weight);
                }
                filter.log_weight += log_density;
            }
            let log_density = normalise(filters);
            let even = -libm::log(FORMS as f64);
            self.log_weights[form] += among_forms * (even - self.log_weights[form]) + log_density;
        }
        let log_sum = log_sum(&self.log_weights);
        self.log_weights.iter_mut().for_each(|l| *l -= log_sum);
        self.samples += 1;
        self.renew(around.unit);
        (innovation / total, log_sum - before)
    }

    /// Filters that are out of the question start again, and the newborns whose life is over are born
    /// again.
    fn renew(&mut self, unit: f64) {
        let life = libm::round(self.prior.life / self.prior.sample_time).max(NEWBORNS as f64) as u64;
        let jump = self.prior.newborn[1] * unit;
        let odds = libm::log(self.prior.odds);
        for (filters, shape) in self.filters.iter_mut().zip(&self.shapes) {
            if self.samples < self.still {
                let steady = filters[0];
                filters[1..DRIFTS].fill(Kalman {
                    log_weight: AGAIN,
                    ..steady
                });
            }
            let best = best_of(filters);
            for k in 0..DRIFTS {
                if filters[k].log_weight < LEAST {
                    filters[k] = Kalman {
                        log_weight: AGAIN,
                        ..best
                    };
                }
            }
            for i in 0..NEWBORNS {
                if !(self.samples + i as u64 * life / NEWBORNS as u64).is_multiple_of(life) {
                    continue;
                }
                if filters[DRIFTS + i].log_weight > filters[0].log_weight {
                    filters[0] = filters[DRIFTS + i];
                }
                let mut child = filters[0];
                child.open_gains(shape, jump * jump);
                child.log_weight += odds;
                filters[DRIFTS + i] = child;
            }
        }
    }

    /// The innovation of the mixture, without an update.
    pub fn innovation(&self, y: f64, regressors: &Regressors, level: f64) -> f64 {
        let (mut innovation, mut total) = (0.0, 0.0);
        self.each(|filter, weight| {
            innovation += weight * (y - filter.predicted(regressors, level).0);
            total += weight;
        });
        innovation / total
    }

    /// All that count, with their weights.
    fn each(&self, mut of: impl FnMut(&Kalman, f64)) {
        for (filters, share) in self.filters.iter().zip(self.log_weights) {
            for filter in filters {
                let weight = exp(share + filter.log_weight);
                if weight > NOTHING {
                    of(filter, weight);
                }
            }
        }
    }

    /// Probability of a form.
    pub fn probability(&self, form: usize) -> f64 {
        self.log_weights.get(form).map_or(0.0, |l| exp(*l))
    }

    /// Mean of gains, level and corrections.
    pub fn state(&self) -> [f64; STATES] {
        let (mut mean, mut total) = ([0.0; STATES], 0.0);
        self.each(|filter, weight| {
            total += weight;
            for (m, s) in mean.iter_mut().zip(filter.state) {
                *m += weight * s;
            }
        });
        mean.map(|m| m / total)
    }

    /// Covariance of the mixture: the differences between the filters are part of it.
    pub fn covariance(&self) -> [[f64; STATES]; STATES] {
        let mean = self.state();
        let (mut sum, mut total) = ([[0.0; STATES]; STATES], 0.0);
        self.each(|filter, weight| {
            total += weight;
            for i in 0..STATES {
                let a = filter.state[i] - mean[i];
                for j in 0..STATES {
                    sum[i][j] += weight * (filter.covariance[i][j] + a * (filter.state[j] - mean[j]));
                }
            }
        });
        sum.map(|row| row.map(|c| c / total))
    }
}

/// The covariances of the gains of each form, for a |Y| of one.
fn shapes(basis: &Basis) -> [[[f64; GAINS]; GAINS]; FORMS] {
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
    shapes
}

fn best_of(filters: &[Kalman; FILTERS]) -> Kalman {
    let mut best = filters[0];
    for filter in &filters[1..] {
        if filter.log_weight > best.log_weight {
            best = *filter;
        }
    }
    best
}

/// `ln sum e^x`. Densities of zero by underflow say no more than very small ones.
fn log_sum(logs: &[f64]) -> f64 {
    let highest = logs.iter().copied().fold(-1e300, f64::max);
    highest + libm::log(logs.iter().map(|l| exp((l - highest).max(-700.0))).sum())
}

/// Makes the weights of a form sum to one; returns the logarithm of what they summed to.
fn normalise(filters: &mut [Kalman; FILTERS]) -> f64 {
    let sum = log_sum(&filters.each_ref().map(|f| f.log_weight));
    filters.iter_mut().for_each(|f| f.log_weight -= sum);
    sum
}

#[cfg(test)]
mod tests;
