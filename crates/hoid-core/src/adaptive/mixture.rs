//! Mixture of hypotheses about the time of the last change in the operator.
//!
//! After each block the likeliest hypothesis of each class has a child, which assumes that the operator changed in this
//! block. The child has the estimate of its parent before the block, with the covariance of a jump added to the
//! covariance of the gains (A. S. Willsky and H. L. Jones, *IEEE Trans. Automatic Control* 21 (1976) 108-112). The
//! child starts with the probability of the class times the hazard, the prior probability of a change since the last
//! birth; it is then weighted by its likelihood like all other hypotheses (R. P. Adams and D. J. C. MacKay, *Bayesian
//! online changepoint detection*, 2007, algorithm 1; P. Andersson, *International Journal of Control* 42 (1985)
//! 1175-1193). If there is no free slot, the least likely of the hypotheses that are old enough is pruned. Between
//! changes the estimate therefore uses all data since the last change.
//!
//! **Samples that a child skips.** For up to p samples after a change, a whitening filter D of order p contains
//! responses with the gains before and after the change: it computes `D (theta r)`, whereas the model computes
//! `theta D r`. With a steep remnant the difference amounts to hundreds of standard deviations of the innovations,
//! which no gains explain. A child therefore skips the block of its birth and the first p samples of the next block.
//!
//! **Classes.** The numerator is either free or restricted to a gain with a lead, `(K_e + K_e_dot s)(s + a)`; the
//! restricted form uses the same filter, with a covariance that allows no other direction of the gains. In both forms
//! the gains drift either slowly (steady) or fast (wandering) between changes. A child has the class of its parent,
//! except that a hypothesis with a gain and a lead may also have a child with a free numerator. The best hypothesis of
//! each class is never pruned.
//!
//! **Estimate.** The estimate is the mean of the mixture. Its covariance includes the spread of the means of the
//! hypotheses (Y. Bar-Shalom, X. R. Li and T. Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
//! 2001, section 1.4.16).

use hoid_numerics::elimination;

use super::{
    bases::Bases,
    basis::Basis,
    hypothesis::{BlockResidual, Covariance, Hypothesis},
    moments::Moments,
    segments::{Segment, Segments},
    sizes::{CLASS_COUNT, GAIN_COUNT, MAX_HYPOTHESES, first_gain, is_correction},
};

/// Prior of the changes in the operator. Gains are in units of |Y| at the reference frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChangePrior {
    /// Length of a block in s.
    pub block: f64,
    /// Mean time between changes in s.
    pub mean_interval_s: f64,
    /// Standard deviations of a change in the gain and of a change in the lead term at 2 rad/s.
    pub change_deviation: [f64; 2],
    /// Standard deviation of the drift of the gains over one second, for steady and for wandering hypotheses.
    pub drift: [f64; 2],
    /// Standard deviation of the additional drift over one second just after a change, and the time constant in s with
    /// which this drift decays.
    pub settling: [f64; 2],
    /// Standard deviation of the drift of the level of u over one second, relative to the root mean square of u.
    pub level: f64,
    /// Longest and shortest memory of the innovation variance in s; a newborn hypothesis has the shortest memory.
    pub variance: [f64; 2],
    /// Prior probability that the gains are steady.
    pub steady: f64,
    /// Prior probability that the numerator is free.
    pub free_numerator: f64,
    /// Number of blocks for which a newborn hypothesis is not pruned.
    pub protected_blocks: u64,
    /// Limit of an innovation, in standard deviations.
    pub limit: f64,
    /// Limit of an innovation in the change detector, in standard deviations.
    pub detector_limit: f64,
}

impl ChangePrior {
    pub(super) fn is_valid(&self) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let share = |x: f64| (0.0..=1.0).contains(&x);
        [self.block, self.mean_interval_s, self.settling[1]]
            .into_iter()
            .all(positive)
            && self.variance.into_iter().all(positive)
            && self.change_deviation.into_iter().chain(self.drift).all(|x| x >= 0.0)
            && self.settling[0] >= 0.0
            && self.level >= 0.0
            && self.limit > 0.0
            && self.detector_limit > 0.0
            && share(self.steady)
            && share(self.free_numerator)
    }
}

/// Time in s before which no hypothesis is born, since the filters and the estimate have not settled.
const FIRST_BIRTH_S: f64 = 3.0;
/// Factor that multiplies the probability of a class with gain and lead when its best hypothesis has a child with a
/// free numerator.
const FORM_SWITCH_FACTOR: f64 = 0.3;
/// Lower limit of a log probability.
const MIN_LOG_WEIGHT: f64 = -60.0;
/// Prior standard deviation of the gains relative to the ratio of the magnitudes of u and e.
const INITIAL_GAIN_DEVIATION: f64 = 2.0;

/// Scales of the signals and of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NoiseScales<const I: usize> {
    /// Ratio of the magnitudes of u and of each input.
    pub units: [f64; I],
    /// Root mean square of u.
    pub size: f64,
    /// Initial innovation variance.
    pub innovations: f64,
    pub sample_time: f64,
    /// Number of samples that count as one independent sample.
    pub dispersion: f64,
}

crate::state!([const I: usize] NoiseScales<I> { units, size, innovations, sample_time, dispersion });

/// Mixture of hypotheses.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mixture<const S: usize> {
    hypotheses: [Hypothesis<S>; MAX_HYPOTHESES],
    count: usize,
    pub blocks: u64,
    mean: [f64; S],
}

crate::state!([const S: usize] Mixture<S> { hypotheses, count, blocks, mean });

impl<const S: usize> Mixture<S> {
    /// Returns a mixture with one hypothesis of each class, all at the prior. `dynamics` contains the prior variances
    /// of the corrections; its other numbers are zero.
    pub fn new<const I: usize>(
        prior: &ChangePrior,
        bases: &Bases<I>,
        scales: &NoiseScales<I>,
        dynamics: &[f64; S],
    ) -> Self {
        let mut p = [[0.0; S]; S];
        for (i, variance) in dynamics.iter().enumerate() {
            p[i][i] = *variance;
        }
        p[GAIN_COUNT][GAIN_COUNT] = scales.size * scales.size;
        Self::of(prior, |class| {
            let mut p = p;
            inflate_gains(&mut p, bases, class, [INITIAL_GAIN_DEVIATION; 2], &scales.units);
            ([0.0; S], p, scales.innovations)
        })
    }

    /// Returns a mixture with one hypothesis of each class, all at a known estimate.
    pub fn at(prior: &ChangePrior, state: [f64; S], covariance: Covariance<S>, variance: f64) -> Self {
        Self::of(prior, |_| (state, covariance, variance))
    }

    fn of(prior: &ChangePrior, start: impl Fn(usize) -> ([f64; S], Covariance<S>, f64)) -> Self {
        let share = |class: usize| {
            [prior.steady, 1.0 - prior.steady][class % 2]
                * [1.0 - prior.free_numerator, prior.free_numerator][class / 2]
        };
        let mut mixture = Self {
            hypotheses: [Hypothesis::new([0.0; S], [[0.0; S]; S], 0.0, 0, MIN_LOG_WEIGHT); MAX_HYPOTHESES],
            count: 0,
            blocks: 0,
            mean: [0.0; S],
        };
        for class in (0..CLASS_COUNT).filter(|class| share(*class) > 0.0) {
            let (state, covariance, variance) = start(class);
            let weight = libm::log(share(class));
            mixture.hypotheses[mixture.count] = Hypothesis::new(state, covariance, variance, class, weight);
            mixture.count += 1;
        }
        mixture.average();
        mixture
    }

    fn hypotheses(&self) -> &[Hypothesis<S>] {
        &self.hypotheses[..self.count.min(MAX_HYPOTHESES)]
    }

    fn hypotheses_mut(&mut self) -> &mut [Hypothesis<S>] {
        &mut self.hypotheses[..self.count.min(MAX_HYPOTHESES)]
    }

    /// Performs steps 5 to 9 for a block, given the sums over its first p samples and over its other samples. Returns
    /// the smallest residual energy among all hypotheses.
    pub fn update<const I: usize, const M: usize>(
        &mut self,
        [early, late]: [&Moments<M>; 2],
        bases: &Bases<I>,
        prior: &ChangePrior,
        scales: &NoiseScales<I>,
    ) -> f64 {
        self.blocks += 1;
        let moments = &early.merged(late);
        let (blocks, seconds) = (self.blocks, moments.samples * scales.sample_time);
        let newborn = |h: &Hypothesis<S>| h.born > 0 && h.born + 1 == blocks;
        let parents = self.likeliest_per_class().map(|best| best.map(|i| self.hypotheses[i]));
        let mut left = [BlockResidual::ZERO; MAX_HYPOTHESES];
        let (mut common, mut best) = (f64::INFINITY, self.mean);
        for (h, left) in self.hypotheses_mut().iter_mut().zip(&mut left) {
            // Step 5, P_j + Q_j: a random walk of the gains, which is faster just after a change, while the gains are
            // still settling.
            let age = (blocks - h.born.min(blocks)) as f64 * seconds;
            let mut drift = prior.drift[h.class % 2] * prior.drift[h.class % 2];
            if h.born > 0 {
                let [size, time] = prior.settling;
                drift += size * size * libm::exp(-2.0 * age / time);
            }
            let step = libm::sqrt(drift * seconds);
            inflate_gains(&mut h.covariance, bases, h.class, [step; 2], &scales.units);
            let level = prior.level * scales.size;
            h.covariance[GAIN_COUNT][GAIN_COUNT] += level * level * seconds;
            if newborn(h) {
                *left = h.update(late, bases, scales.dispersion);
                continue;
            }
            *left = h.update(moments, bases, scales.dispersion);
            if left.energy < common {
                (common, best) = (left.energy, h.state);
            }
        }
        // A newborn hypothesis skips its early samples. It is charged the residual energy that the best hypothesis has
        // at these samples, so skipping gives it neither an advantage nor a disadvantage.
        let of_early = early.residual_energy(bases, &best);
        for (_, left) in self.hypotheses().iter().zip(&mut left).filter(|(h, _)| newborn(h)) {
            left.passed = [early.samples, of_early];
            left.energy += of_early;
            common = common.min(left.energy);
        }
        // The memory of the variance is half the time since the start, so the large residuals of the start are
        // forgotten.
        let [longest, shortest] = prior.variance.map(|seconds| seconds / scales.sample_time);
        let memory = longest.min((0.5 * blocks as f64 * moments.samples).max(shortest));
        // The variance must stay positive even if the prediction is perfect.
        let least = 1e-24 * scales.size * scales.size;
        // Step 7: weights of the hypotheses.
        for (h, left) in self.hypotheses_mut().iter_mut().zip(&left) {
            h.weigh(left, moments.samples, common, scales.dispersion, memory);
            h.variance = h.variance.max(least);
        }
        self.normalise();
        self.average();
        if blocks as f64 * seconds >= FIRST_BIRTH_S {
            self.add_children(&parents, bases, prior, scales, seconds);
        }
        common
    }

    fn normalise(&mut self) {
        let finite = |x: f64| if x.is_finite() { x } else { f64::NEG_INFINITY };
        let best = self
            .hypotheses()
            .iter()
            .map(|h| finite(h.log_weight))
            .fold(f64::NEG_INFINITY, f64::max);
        if !best.is_finite() {
            let even = -libm::log(self.count.max(1) as f64);
            self.hypotheses_mut().iter_mut().for_each(|h| h.log_weight = even);
            return;
        }
        // mu_j = exp(l_j - max)/sum, where the maximum is subtracted to avoid underflow.
        let sum: f64 = (self.hypotheses().iter())
            .map(|h| libm::exp(finite(h.log_weight) - best))
            .sum();
        let all = best + libm::log(sum);
        for h in self.hypotheses_mut() {
            h.log_weight = (finite(h.log_weight) - all).max(MIN_LOG_WEIGHT);
        }
    }

    fn average(&mut self) {
        let mut mean = [0.0; S];
        for h in self.hypotheses() {
            let weight = h.weight();
            for (m, s) in mean.iter_mut().zip(h.state) {
                *m += weight * s;
            }
        }
        self.mean = mean;
    }

    fn likeliest_index(&self, of: impl Fn(&Hypothesis<S>) -> bool) -> Option<usize> {
        (0..self.hypotheses().len())
            .filter(|i| of(&self.hypotheses[*i]))
            .max_by(|a, b| {
                self.hypotheses[*a]
                    .log_weight
                    .total_cmp(&self.hypotheses[*b].log_weight)
            })
    }

    fn class_probability(&self, class: usize) -> f64 {
        self.hypotheses()
            .iter()
            .filter(|h| h.class == class)
            .map(Hypothesis::weight)
            .sum()
    }

    /// Index of the likeliest hypothesis of each class.
    fn likeliest_per_class(&self) -> [Option<usize>; CLASS_COUNT] {
        core::array::from_fn(|class| self.likeliest_index(|h| h.class == class))
    }

    /// Step 9: adds the children of a block, with the hypotheses before the block as parents. Wandering classes have
    /// children in every second block only.
    fn add_children<const I: usize>(
        &mut self,
        parents: &[Option<Hypothesis<S>>; CLASS_COUNT],
        bases: &Bases<I>,
        prior: &ChangePrior,
        scales: &NoiseScales<I>,
        seconds: f64,
    ) {
        for class in 0..CLASS_COUNT {
            let (wanders, any) = (class % 2 == 1, class >= 2);
            let turn = self.blocks + u64::from(any);
            if wanders && !turn.is_multiple_of(2) {
                continue;
            }
            let own = self.class_probability(class);
            let other = if any {
                FORM_SWITCH_FACTOR * self.class_probability(class - 2)
            } else {
                0.0
            };
            let (parent, share) = match &parents[class] {
                Some(parent) if own >= other => (Some(parent), own),
                _ if any && prior.free_numerator > 0.0 => (parents[class - 2].as_ref(), other),
                found => (found.as_ref(), own),
            };
            let Some(parent) = parent else { continue };
            // The parents are the hypotheses before the block, since a child must not contain the data of the change
            // that it explains.
            let mut child = parent.child(self.blocks);
            let every = if wanders { 2.0 } else { 1.0 };
            child.class = class;
            // The initial probability of the child is the probability mu of the class times the hazard H =
            // seconds/between (AM, equation 5, for a geometric run length).
            child.log_weight = libm::log(share.max(1e-12) * (every * seconds / prior.mean_interval_s).min(0.5));
            inflate_gains(
                &mut child.covariance,
                bases,
                class,
                prior.change_deviation,
                &scales.units,
            );
            // A change may also change the remnant, so the variance of a child adapts faster to its own data.
            let youth = prior.variance[1] / scales.sample_time / scales.dispersion;
            child.residuals = child.residuals.min(youth);
            let Some(place) = self.free_slot(prior) else {
                continue;
            };
            self.hypotheses[place] = child;
        }
        self.normalise();
    }

    /// Index of a free slot or, if there is none, of the least likely hypothesis that is old enough and not the best of
    /// its class.
    fn free_slot(&mut self, prior: &ChangePrior) -> Option<usize> {
        if self.count < MAX_HYPOTHESES {
            self.count += 1;
            return Some(self.count - 1);
        }
        let best = self.likeliest_per_class();
        let old = |i: &usize| self.blocks >= self.hypotheses[*i].born + prior.protected_blocks;
        (0..MAX_HYPOTHESES)
            .filter(|i| old(i) && !best.contains(&Some(*i)))
            .min_by(|a, b| {
                self.hypotheses[*a]
                    .log_weight
                    .total_cmp(&self.hypotheses[*b].log_weight)
            })
    }

    /// Returns `x^ = sum_j mu_j x^_j`.
    pub fn mean(&self) -> &[f64; S] {
        &self.mean
    }

    /// Returns `P = sum_j mu_j (P_j + (x^_j - x^)(x^_j - x^)')`. The second term is the spread of the means.
    pub fn covariance(&self) -> Covariance<S> {
        let mut c = [[0.0; S]; S];
        for h in self.hypotheses() {
            let weight = h.weight();
            for i in 0..S {
                for j in 0..S {
                    let apart = (h.state[i] - self.mean[i]) * (h.state[j] - self.mean[j]);
                    c[i][j] += weight * (h.covariance[i][j] + apart);
                }
            }
        }
        c
    }

    /// Returns the weighted mean, over the hypotheses, of a function of state and covariance.
    pub fn weighted_mean(&self, what: impl Fn(&[f64; S], &Covariance<S>) -> f64) -> f64 {
        self.hypotheses()
            .iter()
            .map(|h| h.weight() * what(&h.state, &h.covariance))
            .sum()
    }

    /// Returns the innovation variance, averaged over the hypotheses.
    pub fn variance(&self) -> f64 {
        self.hypotheses().iter().map(|h| h.weight() * h.variance).sum()
    }

    /// Returns the segments of the likeliest hypothesis: the states before each of the changes that it assumes, the
    /// oldest first, followed by the current state.
    pub fn segments(&self) -> Segments<S> {
        let mut segments = Segments::EMPTY;
        if let Some(best) = self.likeliest_index(|_| true) {
            for segment in self.hypotheses[best].segments() {
                segments.push(*segment);
            }
            segments.push(Segment {
                until: u64::MAX >> 12,
                state: self.hypotheses[best].state,
            });
        }
        segments
    }

    /// Replaces the prior of the corrections. The old prior is normal with mean zero and variances `was`, the new
    /// prior, for people, is normal with `mean` and variances `is`: `P' = (I + P D)^-1 P`, `D = 1/is - 1/was`,
    /// `x' = x + P' (mean/is - D x)`. In information form this subtracts the old prior and adds the new one. Only the
    /// entries for the corrections are used.
    pub fn replace_prior(&mut self, was: &[f64; S], is: &[f64; S], mean: &[f64; S]) {
        for h in self.hypotheses_mut() {
            let mut matrix: Covariance<S> = [[0.0; S]; S];
            for (i, row) in matrix.iter_mut().enumerate() {
                row[i] = 1.0;
                for j in (0..S).filter(|j| is_correction(*j)) {
                    row[j] += h.covariance[i][j] * (1.0 / is[j] - 1.0 / was[j]);
                }
            }
            let mut after = h.covariance;
            elimination::solve_general(&mut matrix, &mut after);
            let sound = after.iter().flatten().all(|p| p.is_finite()) && (0..S).all(|i| after[i][i] >= 0.0);
            if !sound {
                continue;
            }
            let pull = |j: usize, s: f64| (mean[j] - s) / is[j] + s / was[j];
            let pulls: [f64; S] = core::array::from_fn(|j| if is_correction(j) { pull(j, h.state[j]) } else { 0.0 });
            for i in 0..S {
                let corrections = (0..S).filter(|j| is_correction(*j));
                h.state[i] += corrections.map(|j| after[i][j] * pulls[j]).sum::<f64>();
                for j in 0..i {
                    let half = 0.5 * (after[i][j] + after[j][i]);
                    (after[i][j], after[j][i]) = (half, half);
                }
            }
            h.covariance = after;
        }
        self.average();
    }
}

/// Directions of a gain K and of a lead K_dot in the space of the gains: `n_0 = K a`, `n_1 = K + K_dot a`,
/// `n_2 = K_dot`, each divided by the scale of its response. K_dot is in units of K at 2 rad/s.
pub(super) fn gain_and_lead_directions(basis: &Basis) -> [[f64; GAIN_COUNT]; 2] {
    let (a, [s0, s1, s2]) = (1.0 / basis.point().lag, basis.scale_factors());
    [
        [a / s0, 1.0 / s1, 0.0],
        [0.0, a / s1, 1.0 / s2].map(|x| x / super::basis::REFERENCE_RAD_S),
    ]
}

/// Adds variances to the covariance of the gains of all inputs (for `Q_j`, the jump of a child, or the prior): along
/// gain and lead, or in all directions if the class has a free numerator. The deviations are relative to the units of
/// the inputs.
fn inflate_gains<const I: usize, const S: usize>(
    p: &mut Covariance<S>,
    bases: &Bases<I>,
    class: usize,
    deviations: [f64; 2],
    units: &[f64; I],
) {
    for input in 0..I {
        let (first, [gain, lead]) = (first_gain(input), deviations.map(|size| size * units[input]));
        if class >= 2 {
            for (i, size) in [gain, lead, lead].into_iter().enumerate() {
                p[first + i][first + i] += size * size;
            }
            continue;
        }
        let directions = gain_and_lead_directions(bases.of(input));
        for (direction, size) in directions.into_iter().zip([gain, lead]) {
            for i in 0..GAIN_COUNT {
                for j in 0..GAIN_COUNT {
                    p[first + i][first + j] += size * size * direction[i] * direction[j];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::adaptive::{
        basis::Point,
        defaults::DefaultOperator,
        sizes::{SIGNAL_COUNT, STATE_COUNT, SUM_COUNT},
    };

    /// Sample of the change: two samples before the end of block 56.
    const CHANGE_SAMPLE: usize = 32 * 56 - 2;

    /// Returns the distance of the gains from those of the changed operator after a given number of blocks, relative to
    /// the change. The remnant has four poles; `first` is the number of early samples of each block.
    fn gain_distance(first: usize, blocks: usize) -> f64 {
        let point = Point {
            tau: 0.2,
            omega: 11.0,
            zeta: 0.3,
            lag: 3.0,
        };
        let (mut bases, prior) = (
            Bases::new([point], 0.01).unwrap(),
            DefaultOperator::with_delay(0.2).prior(0.01).changes,
        );
        let scales = NoiseScales {
            units: [1.0],
            size: 1.0,
            innovations: 1e-8,
            sample_time: 0.01,
            dispersion: 1.0,
        };
        let mut mixture = Mixture::new(&prior, &bases, &scales, &[0.0, 0.0, 0.0, 0.0, 1e-6, 1e-8, 1e-8]);
        let gains = [[0.2, 0.6, 0.3], [0.2, 1.0, 0.5]];
        let bases_delay = bases.first().delay();
        let a: f64 = 0.85;
        let d = [-4.0 * a, 6.0 * a * a, -4.0 * a.powi(3), a.powi(4)];
        let (mut past, mut v, mut seed) = ([([0.0; SIGNAL_COUNT], 0.0); 4], [0.0; 4], 5_u64);
        for block in 0..blocks {
            let mut parts = [Moments::<SUM_COUNT>::EMPTY; 2];
            for k in 0..32 {
                seed = seed
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                let eps = 2e-4 * ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
                let t = (32 * block + k) as f64;
                let e = |age: f64| {
                    libm::sin(0.031 * (t - age)) + libm::cos(0.012 * (t - age)) + libm::sin(0.07 * (t - age))
                };
                let [z] = bases.step(|_, age| e((age - bases_delay) as f64));
                let mut state = [0.0; STATE_COUNT];
                state[..GAIN_COUNT].copy_from_slice(&gains[usize::from(32 * block + k >= CHANGE_SAMPLE)]);
                let noise = eps - d.iter().zip(v).map(|(d, v)| d * v).sum::<f64>();
                let u = noise + bases.weights(&state)[0].iter().zip(z).map(|(w, z)| w * z).sum::<f64>();
                let (mut white, mut y) = (z, u);
                for (d, (z, u)) in d.iter().zip(past) {
                    y += d * u;
                    white.iter_mut().zip(z).for_each(|(w, z)| *w += d * z);
                }
                parts[usize::from(k >= first)].add(&[white], 1.0 + d.iter().sum::<f64>(), y);
                past.rotate_right(1);
                v.rotate_right(1);
                (past[0], v[0]) = ((z, u), noise);
            }
            let [early, late] = &parts;
            mixture.update([early, late], &bases, &prior, &scales);
        }
        let [before, after] = gains.map(|g| response(bases.first(), &g));
        let now = response(bases.first(), &mixture.mean()[..GAIN_COUNT]);
        libm::hypot(now[0] - after[0], now[1] - after[1]) / libm::hypot(after[0] - before[0], after[1] - before[1])
    }

    fn response(basis: &Basis, gains: &[f64]) -> [f64; 2] {
        let h = basis.response(3.0, basis.point());
        [0, 1].map(|part| gains.iter().zip(h).map(|(g, h)| g * h[part]).sum())
    }

    #[test]
    fn child_ignores_the_transient_of_a_change() {
        let (with, without) = (gain_distance(4, 60), gain_distance(0, 60));
        assert!(with < 0.05 && with < 0.5 * without, "{with} {without}");
    }

    #[test]
    fn blocks_shorter_than_the_whitening_filter_are_allowed() {
        // A child then skips its whole first block, and its variance comes from the next blocks.
        let all = gain_distance(32, 63);
        assert!(all < 0.2, "{all}");
    }
}
