//! The gains at every point of the basis, by Kalman filters that differ in their drift.
//!
//! Behind the whitening filter, `y = r' s + eps` with `s = [theta, level]`. A filter says that the
//! gains walk at random with a given variance in a second. Its innovation has the variance
//! `S = r' P r + sigma^2`, and with the Student distribution of nu degrees of freedom
//!
//! `w = min(1, (nu + 1)/(nu + eps^2/S))`, `g = P r/(r' P r + sigma^2/w)`,
//! `s <- s + g eps`, `P <- P - g (P r)'`
//!
//! with eps limited to some standard deviations. The logarithm of its weight grows by that of the
//! Student density and is forgotten with a time constant, so that weights speak of the last seconds:
//! short among the drifts, long among the points, since a person's gains may be steady or not from
//! one moment to the next, their delay not. A filter whose weight has fallen below `LEAST` takes
//! over the state of the best at its point.

use super::sizes::{DRIFTS, GAINS, POINTS, STATES};

/// Logarithm of the weight from which a filter starts again from the best, and that with which it
/// does.
const LEAST: f64 = -7.0;
const AGAIN: f64 = -3.5;
/// Weight below which a filter is left out of means.
const NOTHING: f64 = 1e-9;

/// What all filters share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GainPrior {
    /// Standard deviation of a gain's drift in one second, over |Y| at the reference.
    pub drifts: [f64; DRIFTS],
    /// Degrees of freedom of the Student distribution.
    pub freedom: f64,
    /// Standard deviations beyond which an innovation moves the estimate no further.
    pub limit: f64,
    /// Shares of the logarithms of the weights that a sample forgets, among points and drifts.
    pub forgotten: [f64; 2],
    /// Sample time, s.
    pub sample_time: f64,
}

/// One filter.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Filter {
    state: [f64; STATES],
    covariance: [[f64; STATES]; STATES],
    log_weight: f64,
}

crate::state!([] Filter { state, covariance, log_weight });

/// All filters with their weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Gains {
    prior: GainPrior,
    filters: [[Filter; DRIFTS]; POINTS],
    log_weights: [f64; POINTS],
    count: usize,
}

crate::state!([] Gains { filters, log_weights });

impl Gains {
    /// For the first `count` points, with gains of zero and nothing known of them.
    pub fn new(prior: GainPrior, count: usize) -> Option<Self> {
        let sound = (1..=POINTS).contains(&count)
            && prior.drifts.iter().all(|d| *d >= 0.0)
            && prior.freedom > 0.0
            && prior.limit > 0.0
            && prior.forgotten.iter().all(|f| (0.0..=1.0).contains(f));
        let filter = Filter {
            state: [0.0; STATES],
            covariance: [[0.0; STATES]; STATES],
            log_weight: -libm::log(DRIFTS as f64),
        };
        sound.then_some(Self {
            prior,
            filters: [[filter; DRIFTS]; POINTS],
            log_weights: [-libm::log(count as f64); POINTS],
            count,
        })
    }

    /// Begins with gains of zero and these standard deviations of gains and level.
    pub fn begin(&mut self, gain: f64, level: f64) {
        for filter in self.filters.iter_mut().flatten() {
            filter.state = [0.0; STATES];
            filter.covariance = [[0.0; STATES]; STATES];
            for i in 0..GAINS {
                filter.covariance[i][i] = gain * gain;
            }
            filter.covariance[GAINS][GAINS] = level * level;
            filter.log_weight = -libm::log(DRIFTS as f64);
        }
        self.log_weights = [-libm::log(self.count as f64); POINTS];
    }

    /// Lets the gains be anything within this standard deviation more than they were.
    pub fn open(&mut self, gain: f64) {
        for filter in self.filters.iter_mut().flatten() {
            for i in 0..GAINS {
                filter.covariance[i][i] += gain * gain;
            }
        }
    }

    /// Takes a sample behind the whitening filter. `variance` is that of eps, `unit` |Y| at the
    /// reference, `level` the variance of the level's drift in one second. Returns the innovation of
    /// the mixture.
    pub fn update(&mut self, y: f64, r: &[[f64; STATES]; POINTS], variance: f64, unit: f64, level: f64) -> f64 {
        let prior = self.prior;
        let mut innovation = 0.0;
        let mut highest = f64::NEG_INFINITY;
        for (point, r) in r.iter().enumerate().take(self.count) {
            let share = libm::exp(self.log_weights[point]);
            let filters = &mut self.filters[point];
            let mut density = 0.0;
            for (filter, drift) in filters.iter_mut().zip(prior.drifts) {
                let weight = libm::exp(filter.log_weight);
                let walk = (drift * unit) * (drift * unit) * prior.sample_time;
                let (eps, log_density) = filter.update(y, r, variance, walk, level * prior.sample_time, &prior);
                innovation += share * weight * eps;
                density += weight * libm::exp(log_density);
                filter.log_weight = (1.0 - prior.forgotten[1]) * filter.log_weight + log_density;
            }
            normalise(filters);
            // A density of zero by underflow says no more than a very small one.
            self.log_weights[point] =
                (1.0 - prior.forgotten[0]) * self.log_weights[point] + libm::log(density.max(f64::MIN_POSITIVE));
            highest = highest.max(self.log_weights[point]);
        }
        let logs = &mut self.log_weights[..self.count];
        let sum: f64 = logs.iter().map(|l| libm::exp(l - highest)).sum();
        logs.iter_mut().for_each(|l| *l -= highest + libm::log(sum));
        innovation
    }

    /// The innovation of the mixture, without an update.
    pub fn innovation(&self, y: f64, r: &[[f64; STATES]; POINTS]) -> f64 {
        let mut innovation = 0.0;
        for (point, filter, weight) in self.weighted() {
            let predicted: f64 = filter.state.iter().zip(&r[point]).map(|(s, r)| s * r).sum();
            innovation += weight * (y - predicted);
        }
        innovation
    }

    /// Point, filter and weight of all that count.
    fn weighted(&self) -> impl Iterator<Item = (usize, &Filter, f64)> {
        self.filters[..self.count]
            .iter()
            .enumerate()
            .flat_map(move |(point, filters)| {
                let share = self.log_weights[point];
                filters
                    .iter()
                    .map(move |f| (point, f, libm::exp(share + f.log_weight)))
                    .filter(|(_, _, weight)| *weight > NOTHING)
            })
    }

    /// The likeliest point.
    pub fn likeliest(&self) -> usize {
        let logs = &self.log_weights[..self.count];
        let best = logs.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        best.map_or(0, |(point, _)| point)
    }

    /// Probability of a point.
    pub fn probability(&self, point: usize) -> f64 {
        if point < self.count {
            libm::exp(self.log_weights[point])
        } else {
            0.0
        }
    }

    /// Mean of gains and level at a point, over the drifts.
    pub fn state(&self, point: usize) -> [f64; STATES] {
        let mut mean = [0.0; STATES];
        for filter in &self.filters[point] {
            let weight = libm::exp(filter.log_weight);
            for (m, s) in mean.iter_mut().zip(filter.state) {
                *m += weight * s;
            }
        }
        mean
    }

    /// Mean and covariance of `M theta` over the mixture, with a matrix M for each point: the
    /// differences between the filters are part of the covariance.
    pub fn moments<const K: usize>(&self, maps: &[[[f64; GAINS]; K]; POINTS]) -> ([f64; K], [[f64; K]; K]) {
        let (mut mean, mut second, mut total) = ([0.0; K], [[0.0; K]; K], 0.0);
        // About the likeliest, so that nothing cancels.
        let about = apply(&maps[self.likeliest()], &self.state(self.likeliest()));
        for (point, filter, weight) in self.weighted() {
            let map = &maps[point];
            let value = apply(map, &filter.state);
            total += weight;
            for i in 0..K {
                let a = value[i] - about[i];
                mean[i] += weight * a;
                for j in 0..K {
                    let mut sum = a * (value[j] - about[j]);
                    for k in 0..GAINS {
                        for l in 0..GAINS {
                            sum += map[i][k] * filter.covariance[k][l] * map[j][l];
                        }
                    }
                    second[i][j] += weight * sum;
                }
            }
        }
        let mean = mean.map(|m| m / total);
        let covariance = core::array::from_fn(|i| core::array::from_fn(|j| second[i][j] / total - mean[i] * mean[j]));
        (core::array::from_fn(|i| about[i] + mean[i]), covariance)
    }
}

fn apply<const K: usize>(map: &[[f64; GAINS]; K], state: &[f64; STATES]) -> [f64; K] {
    core::array::from_fn(|i| map[i].iter().zip(state).map(|(m, s)| m * s).sum())
}

/// Makes the weights of a point sum to one, and starts those that are out of the question again.
fn normalise(filters: &mut [Filter; DRIFTS]) {
    let mut best = 0;
    for i in 1..DRIFTS {
        if filters[i].log_weight > filters[best].log_weight {
            best = i;
        }
    }
    let highest = filters[best].log_weight;
    let sum: f64 = filters.iter().map(|f| libm::exp(f.log_weight - highest)).sum();
    let log_sum = highest + libm::log(sum);
    let source = filters[best];
    for filter in filters {
        filter.log_weight -= log_sum;
        if filter.log_weight < LEAST {
            *filter = Filter {
                log_weight: AGAIN,
                ..source
            };
        }
    }
}

impl Filter {
    /// Innovation, and logarithm of its density.
    #[inline(always)]
    fn update(
        &mut self,
        y: f64,
        r: &[f64; STATES],
        variance: f64,
        walk: f64,
        level: f64,
        prior: &GainPrior,
    ) -> (f64, f64) {
        let (mut through, mut spread, mut eps) = ([0.0; STATES], 0.0, y);
        for i in 0..STATES {
            self.covariance[i][i] += if i < GAINS { walk } else { level };
            eps -= self.state[i] * r[i];
        }
        for i in 0..STATES {
            for j in 0..STATES {
                through[i] += self.covariance[i][j] * r[j];
            }
            spread += through[i] * r[i];
        }
        let (total, nu) = (spread + variance, prior.freedom);
        let square = eps * eps / total;
        let weight = ((nu + 1.0) / (nu + square)).min(1.0);
        let log_density = -0.5 * (libm::log(total) + (nu + 1.0) * libm::log1p(square / nu));
        let most = prior.limit * libm::sqrt(total);
        let limited = eps.clamp(-most, most);
        let gain = 1.0 / (spread + variance / weight);
        for i in 0..STATES {
            self.state[i] += through[i] * gain * limited;
            for j in 0..STATES {
                self.covariance[i][j] -= through[i] * gain * through[j];
            }
        }
        (eps, log_density)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::population::cholesky;

    const PRIOR: GainPrior = GainPrior {
        drifts: [0.0; DRIFTS],
        freedom: 1e300,
        limit: f64::INFINITY,
        forgotten: [0.0; 2],
        sample_time: 0.01,
    };

    fn sample(t: u32) -> (f64, [f64; STATES]) {
        let wave = |by: u32| f64::from((t * t * by + 3 * t) % 101) / 50.0 - 1.0;
        let r = [wave(1), wave(7), wave(13), 0.3];
        let y = 1.5 * r[0] - 0.7 * r[1] + 0.2 * r[2] + 0.1 + 0.2 * wave(29);
        (y, r)
    }

    #[test]
    fn without_drift_it_is_weighted_least_squares() {
        let mut gains = Gains::new(PRIOR, POINTS).unwrap();
        gains.begin(2.0, 0.5);
        // (sum r r'/sigma^2 + P_0^-1) s = sum r y/sigma^2, with a variance that changes.
        let (mut a, mut b) = ([[0.0; STATES]; STATES], [0.0; STATES]);
        for i in 0..STATES {
            a[i][i] = if i < GAINS { 0.25 } else { 4.0 };
        }
        for t in 0..300 {
            let (y, r) = sample(t);
            let variance = if t < 150 { 0.02 } else { 0.1 };
            gains.update(y, &[r; POINTS], variance, 1.0, 0.0);
            for i in 0..STATES {
                b[i] += r[i] * y / variance;
                for j in 0..STATES {
                    a[i][j] += r[i] * r[j] / variance;
                }
            }
        }
        assert!(cholesky::factor(&mut a, STATES));
        cholesky::solve(&a, STATES, &mut b);
        for (s, b) in gains.state(3).iter().zip(b) {
            assert!((s - b).abs() < 1e-9, "{s} {b}");
        }
        // The covariance of the mixture of equals is the inverse of the same matrix.
        let mut unit = [[[0.0; GAINS]; GAINS]; POINTS];
        unit.iter_mut().for_each(|m| (0..GAINS).for_each(|i| m[i][i] = 1.0));
        let (mean, covariance) = gains.moments(&unit);
        for i in 0..GAINS {
            let mut column = [0.0; STATES];
            column[i] = 1.0;
            cholesky::solve(&a, STATES, &mut column);
            assert!((mean[i] - b[i]).abs() < 1e-9);
            for j in 0..GAINS {
                assert!((covariance[i][j] - column[j]).abs() < 1e-9 * column[i].abs());
            }
        }
    }

    #[test]
    fn the_point_that_foretells_wins() {
        let mut gains = Gains::new(PRIOR, POINTS).unwrap();
        gains.begin(2.0, 0.5);
        for t in 0..300 {
            let (y, r) = sample(t);
            let mut wrong = [sample(t + 1).1; POINTS];
            wrong[4] = r;
            gains.update(y, &wrong, 0.02, 1.0, 0.0);
        }
        assert_eq!(gains.likeliest(), 4);
        assert!(gains.probability(4) > 0.999 && gains.probability(POINTS) == 0.0);
        assert!(Gains::new(PRIOR, 0).is_none() && Gains::new(PRIOR, POINTS + 1).is_none());
    }
}
