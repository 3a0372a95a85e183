//! The same filters one by one, each with its whole covariance and functions of libm: what the pairs of
//! [`super`] must give, but for rounding.
#![allow(clippy::unwrap_used)]
use super::*;

const FARTHEST: [[f64; 2]; HELD] = [[-0.5, 0.6], [-0.8, 1.5], [-0.1, 0.1]];

#[derive(Clone, Copy)]
struct Plain {
    state: [f64; STATES],
    covariance: [[f64; STATES]; STATES],
    log_weight: f64,
}

impl Plain {
    fn update(&mut self, y: f64, r: &Regressors, level: f64, variance: f64, point: Point, p: &GainPrior) -> (f64, f64) {
        let mut psi = [0.0; STATES];
        let mut predicted = level * self.state[GAINS];
        psi[GAINS] = level;
        for i in 0..GAINS {
            let mut x = r.x[i];
            for j in 0..HELD {
                x += self.state[LINEAR + j] * r.by[j][i];
                psi[LINEAR + j] += self.state[i] * r.by[j][i];
            }
            psi[i] = x;
            predicted += self.state[i] * x;
        }
        let eps = y - predicted;
        let (mut through, mut spread) = ([0.0; STATES], 0.0);
        for i in 0..STATES {
            for j in 0..STATES {
                through[i] += self.covariance[i][j] * psi[j];
            }
            spread += through[i] * psi[i];
        }
        let spread = spread.max(0.0);
        let nu = p.freedom;
        let total = spread + variance;
        let square = eps * eps / total;
        let weight = ((nu + 1.0) / (nu + square)).min(1.0);
        let log_density = -0.5 * (libm::log(total) + (nu + 1.0) * libm::log1p(square / nu));
        let most = p.limit * libm::sqrt(total);
        let limited = eps.max(-most).min(most);
        let gain = 1.0 / (spread + variance / weight);
        for i in 0..STATES {
            let g = through[i] * gain;
            self.state[i] += g * limited;
            for j in 0..STATES {
                self.covariance[i][j] -= g * through[j];
            }
        }
        for (i, of) in [point.omega, point.zeta, 1.0].into_iter().enumerate() {
            let [low, high] = FARTHEST[i];
            let correction = &mut self.state[LINEAR + i];
            *correction = correction.max(low * of).min(high * of);
        }
        (eps, log_density)
    }
}

struct Twin {
    prior: GainPrior,
    shapes: [[[f64; GAINS]; GAINS]; FORMS],
    filters: [[Plain; FILTERS]; FORMS],
    log_weights: [f64; FORMS],
    samples: u64,
    still: u64,
    /// Births that were taken for a change, and all, with those that the prior is worth.
    changes: [f64; 2],
}

fn log_sum(logs: &[f64]) -> f64 {
    let highest = logs.iter().copied().fold(-1e300, f64::max);
    highest + libm::log(logs.iter().map(|l| libm::exp((l - highest).max(-700.0))).sum())
}

impl Twin {
    /// With the states, covariances and weights of the filters in pairs.
    fn of(gains: &Gains, still: u64) -> Self {
        let plain = |form: usize, k: usize| {
            let filter = &gains.filters[k];
            Plain {
                state: filter.state_of(form),
                covariance: std::array::from_fn(|i| std::array::from_fn(|j| filter.covariance_of(form, i, j))),
                log_weight: filter.log_weight.0[form],
            }
        };
        let mut shapes = [[[0.0; GAINS]; GAINS]; FORMS];
        for i in 0..GAINS {
            for j in 0..=i {
                for form in 0..FORMS {
                    let shape = gains.shapes[i * (i + 1) / 2 + j].0[form];
                    (shapes[form][i][j], shapes[form][j][i]) = (shape, shape);
                }
            }
        }
        Self {
            prior: gains.prior,
            shapes,
            filters: std::array::from_fn(|form| std::array::from_fn(|k| plain(form, k))),
            log_weights: gains.log_weights.0,
            samples: gains.samples,
            still,
            changes: [gains.prior.odds * gains.prior.births, gains.prior.births],
        }
    }

    fn supposed(&self, k: usize) -> f64 {
        let share = self.prior.shares.get(k);
        libm::log(share.copied().unwrap_or(self.prior.odds * self.prior.shares[0]))
    }

    fn update(&mut self, y: f64, r: &Regressors, level: f64, point: Point, around: &Around) -> (f64, f64) {
        let prior = self.prior;
        let ts = prior.sample_time;
        let [among_forms, among_drifts] = prior.forgotten;
        let supposed: [f64; FILTERS] = std::array::from_fn(|k| self.supposed(k));
        let (mut innovation, mut total) = (0.0, 0.0);
        let before = log_sum(&self.log_weights);
        for form in 0..FORMS {
            let share = libm::exp(self.log_weights[form]);
            for (k, filter) in self.filters[form].iter_mut().enumerate() {
                let walk = prior.drifts.get(k).copied().unwrap_or(prior.newborn[0]) * around.unit;
                open(filter, &self.shapes[form], walk * walk * ts);
                filter.covariance[GAINS][GAINS] += around.level[usize::from(k > 0)] * ts;
                let weight = share * libm::exp(filter.log_weight);
                let (eps, log_density) = filter.update(y, r, level, around.variance, point, &prior);
                innovation += weight * eps;
                total += weight;
                if k < DRIFTS {
                    filter.log_weight += among_drifts * (supposed[k] - filter.log_weight);
                }
                filter.log_weight += log_density;
            }
            let sum = log_sum(&self.filters[form].each_ref().map(|f| f.log_weight));
            self.filters[form].iter_mut().for_each(|f| f.log_weight -= sum);
            let even = -libm::log(FORMS as f64);
            self.log_weights[form] += among_forms * (even - self.log_weights[form]) + sum;
        }
        let sum = log_sum(&self.log_weights);
        self.log_weights.iter_mut().for_each(|l| *l -= sum);
        self.samples += 1;
        self.renew(around.unit);
        (innovation / total, sum - before)
    }

    fn renew(&mut self, unit: f64) {
        let life = libm::round(self.prior.life / self.prior.sample_time).max(NEWBORNS as f64) as u64;
        let jump = self.prior.newborn[1] * unit;
        for filters in &mut self.filters {
            let again = |filter: Plain| Plain {
                log_weight: AGAIN,
                ..filter
            };
            if self.samples < self.still {
                let steady = again(filters[0]);
                filters[1..DRIFTS].fill(steady);
            }
            let mut best = filters[0];
            for filter in &filters[1..] {
                if filter.log_weight > best.log_weight {
                    best = *filter;
                }
            }
            for filter in &mut filters[..DRIFTS] {
                if filter.log_weight < LEAST {
                    *filter = again(best);
                }
            }
        }
        for i in (0..NEWBORNS).map(|i| i as u64) {
            if !(self.samples + i * life / NEWBORNS as u64).is_multiple_of(life) {
                continue;
            }
            let newborn = DRIFTS + i as usize;
            self.changes[1] += 1.0;
            for (filters, share) in self.filters.iter_mut().zip(self.log_weights) {
                if filters[newborn].log_weight > filters[0].log_weight {
                    filters[0] = filters[newborn];
                    self.changes[0] += libm::exp(share);
                }
            }
            for (filters, shape) in self.filters.iter_mut().zip(&self.shapes) {
                let mut child = filters[0];
                open(&mut child, shape, jump * jump);
                child.log_weight += libm::log(self.changes[0] / self.changes[1]);
                filters[newborn] = child;
            }
        }
    }

    fn state(&self) -> [f64; STATES] {
        let (mut mean, mut total) = ([0.0; STATES], 0.0);
        for (filters, share) in self.filters.iter().zip(self.log_weights) {
            for filter in filters {
                let weight = libm::exp(share + filter.log_weight);
                if weight > NOTHING {
                    total += weight;
                    (0..STATES).for_each(|i| mean[i] += weight * filter.state[i]);
                }
            }
        }
        mean.map(|m| m / total)
    }
}

fn open(filter: &mut Plain, shape: &[[f64; GAINS]; GAINS], variance: f64) {
    for i in 0..GAINS {
        for j in 0..GAINS {
            filter.covariance[i][j] += variance * shape[i][j];
        }
    }
}

/// All that may happen to the gains: they walk, jump, stand still for a while, are born again and start
/// again, and samples lie far out.
#[test]
fn pairs_give_what_one_after_another_does() {
    let point = Point {
        tau: 0.2,
        omega: 11.0,
        zeta: 0.25,
        lag: 3.0,
    };
    let prior = GainPrior {
        drifts: [0.0005, 0.07, 0.3],
        shares: [0.9, 0.05, 0.05],
        newborn: [0.1, 0.5],
        odds: 0.01,
        births: 20.0,
        life: 2.0,
        steady: 3.0,
        freedom: 5.0,
        limit: 3.5,
        forgotten: [0.01 / 60.0, 0.01 / 5.0],
        held: [0.3, 0.5, 0.04],
        sample_time: 0.01,
    };
    let mut gains = Gains::new(prior, &Basis::new(point, 0.01).unwrap()).unwrap();
    gains.begin(2.0, 0.5);
    gains.reopen(2.0, 0.5, point);
    let mut twin = Twin::of(&gains, 300);
    let mut seed = 9_u64;
    let mut noise = || {
        seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    for t in 0..4000 {
        let x = [0; GAINS].map(|_| 2.0 * noise());
        let by = [0.2, 1.0, 8.0].map(|size| [0; GAINS].map(|_| size * noise()));
        let jumped = if t < 2500 { 1.0 } else { 0.4 };
        let mut y = 0.1 + jumped * (0.7 * (x[0] + 0.5 * by[0][0]) - 0.3 * x[1]) + 0.2 * noise();
        if t % 97 == 0 {
            y += 4.0;
        }
        let around = Around {
            variance: 0.0033,
            unit: 0.8,
            level: [2.5e-5, 1e-4],
        };
        let r = Regressors { x, by };
        let (eps, log_density) = gains.update(y, &r, 0.3, point, &around);
        let (expected, expected_density) = twin.update(y, &r, 0.3, point, &around);
        // Rounding grows with the ratio of the largest to the smallest variance of the corrections.
        assert!((eps - expected).abs() < 1e-12, "{t}: {eps} {expected}");
        assert!((log_density - expected_density).abs() < 1e-10, "{t}");
        for (s, e) in gains.state().iter().zip(twin.state()) {
            assert!((s - e).abs() < 1e-11, "{t}: {s} {e}");
        }
    }
    for form in 0..FORMS {
        assert!((gains.probability(form) - libm::exp(twin.log_weights[form])).abs() < 1e-10);
        for (k, plain) in twin.filters[form].iter().enumerate() {
            let filter = &gains.filters[k];
            assert!((filter.log_weight.0[form] - plain.log_weight).abs() < 1e-9);
            for i in 0..STATES {
                for j in 0..STATES {
                    let (own, size) = (plain.covariance[i][j], plain.covariance[i][i] * plain.covariance[j][j]);
                    assert!((filter.covariance_of(form, i, j) - own).abs() < 1e-9 * size.sqrt() + 1e-18);
                }
            }
        }
    }
}
