//! Candidate: one pass over the data with a fixed basis, a noise model, and the mixture of hypotheses about the gains.
//!
//! A candidate processes samples in order. Its whitening filter D and its basis stay fixed, so the candidate is the
//! prediction-error method for a given D and a given linearisation (L. Ljung, *System Identification*, 1999, section
//! 7.2). For the next candidate it estimates a better point of the basis (the corrections), a better noise model
//! (`noise`, from the residuals) and how unevenly the power of the innovations is distributed in time (`volatility`).
//! [`super::filter`] runs one candidate after another over the data.
//!
//! `evidence` is the sum of the log predictive densities of the blocks (A. P. Dawid, *J. Royal Statistical Society* A
//! 147 (1984) 278-292). It is the criterion by which candidates are compared over the same data. Each block is
//! predicted from earlier blocks only, so additional parameters give no advantage. The density is Student's, with a
//! running innovation variance and as many degrees of freedom as the block has samples, so a change that was not
//! predicted does not dominate the sum. Old evidence is forgotten, so the sum measures the quality of the current
//! estimate rather than the speed of initial convergence.

use super::{
    bases::Bases,
    basis::{Complex, Point, Regressors, Signals},
    blocks::Row,
    f64x2::F64x2,
    last_blocks::LastBlocks,
    mixture::{ChangePrior, Mixture, NoiseScales},
    moments::Moments,
    noise::NoiseModel,
    segments::Segments,
    signal_history::{SignalHistory, SignalPairs, from_pairs, to_pairs},
    sizes::{
        DYNAMICS_COUNT, GAIN_COUNT, MAX_NOISE_ORDER, PARAMETER_COUNT, SIGNAL_COUNT, correction_places, delay_place,
        first_gain, input_part, is_correction,
    },
    volatility::Volatility,
};
use crate::state::{State, visit_all};

/// Magnitude of a signal beyond which the filters are reset.
pub(super) const MAX_SIGNAL: f64 = 1e100;
/// `BASIS_POINT_RANGE` limits the basis point (omega in rad/s, zeta, tau in s), and `CORRECTION_RANGE` limits the
/// change in the basis point in one step (relative for omega and zeta, in s for tau).
const BASIS_POINT_RANGE: [[f64; 2]; DYNAMICS_COUNT] = [[3.0, 35.0], [0.05, 1.4], [0.01, 0.85]];
const CORRECTION_RANGE: [[f64; 2]; DYNAMICS_COUNT] = [[-0.3, 0.4], [-0.4, 0.6], [-0.05, 0.05]];
/// Frequencies in rad/s at which K_e and K_e_dot are fitted to the numerator of the operator.
pub(super) const FIT_FREQUENCIES_RAD_S: [f64; 3] = [1.0, 2.0, 4.0];
/// Initial time in s during which blocks do not count as evidence.
const SETTLING_S: f64 = 2.0;
/// Time in s over which [`Volatility`] sums each energy.
const ENERGY_SPAN_S: f64 = 1.28;
/// Longest memory, in s, of the variance in the predictive density of the evidence.
const VARIANCE_MEMORY_S: f64 = 20.0;
/// Time constant in s with which evidence is forgotten.
const EVIDENCE_MEMORY_S: f64 = 20.0;
/// Interval in s between updates of the whitening filter if there are no replays.
const NOISE_UPDATE_S: f64 = 1.28;
/// Squared innovation, in innovation variances, above which the weight of a sample in the noise model is reduced.
const CLIP_VARIANCES: f64 = 100.0;
/// Lower limit of the innovation variance relative to the power of u.
const MIN_RELATIVE_VARIANCE: f64 = 1e-24;

/// Sample after the whitening filter.
#[derive(Debug, Clone, Copy)]
pub(super) struct WhitenedSample<const I: usize> {
    pub y: f64,
    pub signals: [Signals; I],
    pub level: f64,
}

/// One pass over the data, described in the module documentation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Candidate<const I: usize, const S: usize, const M: usize, const P: usize> {
    bases: Bases<I>,
    now: [Signals; I],
    past: [SignalHistory; I],
    outputs: [f64; MAX_NOISE_ORDER],
    d: [f64; MAX_NOISE_ORDER],
    pub noise: NoiseModel,
    /// Sums over the first p samples of the current block (p is the order of D), and over its other samples.
    early: Moments<M>,
    late: Moments<M>,
    block: u64,
    pub mixture: Mixture<S>,
    pub scales: NoiseScales<I>,
    guide: Segments<S>,
    skipped: u64,
    volatility: Volatility,
    predictive_variance: [f64; 2],
    pub evidence: f64,
    samples: u64,
    /// Number of further samples that are not used because the filter D contains predicted outputs.
    predicted: u64,
    pub blocks: LastBlocks<S, P>,
    /// Index of the sample at which the candidate started.
    pub start: u64,
}

impl<const I: usize, const S: usize, const M: usize, const P: usize> State for Candidate<I, S, M, P> {
    fn visit(&mut self, each: &mut dyn FnMut(&mut f64)) {
        visit_all(
            &mut [
                &mut self.bases,
                &mut self.now,
                &mut self.past,
                &mut self.outputs,
                &mut self.d,
                &mut self.noise,
                &mut self.early,
                &mut self.late,
                &mut self.mixture,
                &mut self.scales,
                &mut self.guide,
                &mut self.skipped,
                &mut self.volatility,
                &mut self.predictive_variance,
                &mut self.evidence,
                &mut self.samples,
                &mut self.predicted,
                &mut self.blocks,
                &mut self.start,
            ],
            each,
        );
    }
}

impl<const I: usize, const S: usize, const M: usize, const P: usize> Candidate<I, S, M, P> {
    /// Builds a candidate at rest. `d` is the initial noise model, already solved.
    pub fn new(
        bases: Bases<I>,
        d: &NoiseModel,
        empty: NoiseModel,
        mixture: Mixture<S>,
        scales: NoiseScales<I>,
        prior: &ChangePrior,
        start: u64,
    ) -> Self {
        let block = libm::round(prior.block / scales.sample_time).max(1.0);
        let mut padded = [0.0; MAX_NOISE_ORDER];
        padded[..d.order()].copy_from_slice(d.d());
        Self {
            bases,
            now: [[0.0; SIGNAL_COUNT]; I],
            past: [SignalHistory::ZERO; I],
            outputs: [0.0; MAX_NOISE_ORDER],
            d: padded,
            noise: empty,
            early: Moments::EMPTY,
            late: Moments::EMPTY,
            block: block as u64,
            mixture,
            scales,
            guide: Segments::EMPTY,
            skipped: 0,
            volatility: Volatility::new(libm::round(ENERGY_SPAN_S / (block * scales.sample_time)).max(1.0) as u64),
            predictive_variance: [scales.innovations, 20.0],
            evidence: 0.0,
            samples: 0,
            predicted: 0,
            blocks: LastBlocks::new(scales.sample_time),
            start,
        }
    }

    /// Makes the candidate compute the residuals for the noise model with the states of the given segments instead of
    /// the mean of the mixture.
    pub fn with_guide(mut self, guide: Segments<S>) -> Self {
        self.guide = guide;
        self
    }

    /// Makes the first `samples` samples advance the filters without an update: the filters start at rest, but the
    /// recorded signals do not.
    pub fn with_skipped(mut self, samples: u64) -> Self {
        self.skipped = samples;
        self
    }

    /// Makes the candidate continue without the guide, so the noise model uses the mean of the mixture.
    pub fn clear_guide(&mut self) {
        self.guide = Segments::EMPTY;
    }

    pub fn bases(&self) -> &Bases<I> {
        &self.bases
    }

    pub fn block_samples(&self) -> u64 {
        self.block
    }

    /// Number of samples that count as one independent sample, estimated from the innovations so far.
    pub fn dispersion(&self) -> f64 {
        self.volatility.dispersion()
    }

    /// Advances the bases by one sample; `value(input, age)` is the value of an input `age` samples ago.
    #[inline(always)]
    pub fn advance_bases(&mut self, value: impl Fn(usize, usize) -> f64) {
        self.now = self.bases.step(value);
    }

    /// Step 2: returns `y = D u`, the signals of the basis filtered by D, and `D(1)`, the factor of the level.
    #[inline(always)]
    pub fn whiten(&self, u: f64) -> WhitenedSample<I> {
        let (mut y, mut z, mut level) = (u, to_pairs(&self.now[0]), 1.0);
        let order = self.noise.order().next_multiple_of(4).min(MAX_NOISE_ORDER);
        // All hypotheses are linear in the signals, so filtering the signals once by D serves every hypothesis.
        for ((d, u), before) in self.d[..order]
            .iter()
            .zip(&self.outputs)
            .zip(self.past[0].newest_first())
        {
            y += d * u;
            level += d;
            for (z, before) in z.iter_mut().zip(before) {
                *z += F64x2::splat(*d) * *before;
            }
        }
        let mut signals = [from_pairs(&z); I];
        for input in 1..I {
            let mut z = to_pairs(&self.now[input]);
            for (d, before) in self.d[..order].iter().zip(self.past[input].newest_first()) {
                for (z, before) in z.iter_mut().zip(before) {
                    *z += F64x2::splat(*d) * *before;
                }
            }
            signals[input] = from_pairs(&z);
        }
        WhitenedSample { y, signals, level }
    }

    /// Step 3: returns `nu = y - H x^`, the innovation of a whitened sample for the mean of the mixture.
    #[inline(always)]
    pub fn innovation(&self, white: &WhitenedSample<I>) -> f64 {
        let state = self.mixture.mean();
        let weights = self.bases.weights(state);
        let response = |w: &Signals, z: &Signals| (0..SIGNAL_COUNT).map(|k| w[k] * z[k]).sum::<f64>();
        let unexplained = white.y - state[GAIN_COUNT] * white.level;
        (weights.iter().zip(&white.signals)).fold(unexplained, |left, (w, z)| left - response(w, z))
    }

    /// Adds a sample to the sums of the block, to the noise model and to the detector, and completes the block if it is
    /// full. Returns false if a number has overflowed.
    #[inline(always)]
    pub fn update(&mut self, white: &WhitenedSample<I>, u: f64, prior: &ChangePrior) -> bool {
        let sound = |x: &f64| x.abs() < MAX_SIGNAL;
        if !(sound(&white.y) && white.signals.as_flattened().iter().all(sound)) {
            return false;
        }
        if self.predicted > 0 {
            // D filters the last p outputs. A predicted output lacks the noise v, so it increases the innovations while
            // it is in the filter. As many samples are skipped as there were predictions, at most p; the last
            // predictions may then still be in the filter.
            self.predicted -= 1;
            self.blocks.ignore_sample();
            return true;
        }
        self.samples += 1;
        // The whitening filter needs p outputs before its first innovation.
        let order = self.noise.order() as u64;
        if self.samples <= order.max(self.skipped) {
            return true;
        }
        self.add_residual(u);
        let innovation = self.innovation(white);
        let row = self.row(white, innovation, prior.detector_limit);
        self.blocks.add(&row);
        let y = self.limit_innovation(white.y, innovation, prior.limit);
        let part = match self.early.samples < order as f64 {
            true => &mut self.early,
            false => &mut self.late,
        };
        part.add(&white.signals, white.level, y);
        if (self.early.samples + self.late.samples) as u64 >= self.block {
            self.end_block(prior);
        }
        true
    }

    /// Returns the output with its innovation limited to `limit` standard deviations (P. J. Huber, *Robust Statistics*,
    /// 1981).
    #[inline(always)]
    fn limit_innovation(&self, y: f64, innovation: f64, limit: f64) -> f64 {
        let most = limit * libm::sqrt(self.predictive_variance[0]);
        if most == f64::INFINITY {
            return y;
        }
        y - innovation + innovation.max(-most).min(most)
    }

    /// Returns the row of the sample in the normal equations of the detector.
    #[inline(always)]
    fn row(&self, white: &WhitenedSample<I>, innovation: f64, limit: f64) -> Row<S> {
        let state = self.mixture.mean();
        let (mut row, mut shift) = ([0.0; S], 0.0);
        // The response is linearised about the current state: dy/dtheta_i = r_i + sum_j c_j dr_i/dj, dy/dc_j = sum_i
        // theta_i dr_i/dj.
        for input in 0..I {
            let Regressors { x, by } = self.bases.of(input).regressors(&white.signals[input]);
            let (first, places) = (first_gain(input), correction_places(input));
            for i in 0..GAIN_COUNT {
                row[first + i] = x[i];
                for (j, place) in places.into_iter().enumerate() {
                    row[first + i] += state[place] * by[j][i];
                    row[place] += state[first + i] * by[j][i];
                }
            }
        }
        row[GAIN_COUNT] = white.level;
        // The products theta_i c_j appear in both derivatives; H_c c is added once to y so that y = H x is exact at the
        // state.
        for j in (0..S).filter(|j| is_correction(*j)) {
            shift += row[j] * state[j];
        }
        Row {
            x: row,
            y: self.limit_innovation(white.y, innovation, limit) + shift,
            innovation,
            variance: self.predictive_variance[0],
        }
    }

    /// Step 10: updates the noise model with `v = u - level - w' z` at the current and the preceding samples, computed
    /// with the gains of the guide or, without a guide, with the current gains.
    #[inline(always)]
    fn add_residual(&mut self, u: f64) {
        let order = self.noise.order();
        if self.samples <= 2 * order as u64 {
            return;
        }
        let state = self.guide.at(self.mixture.blocks).unwrap_or(self.mixture.mean());
        let level = state[GAIN_COUNT];
        let weights = self.bases.weights(state).map(|weights| to_pairs(&weights));
        let response = |weights: &SignalPairs, z: &SignalPairs| {
            let response = weights[0] * z[0] + weights[1] * z[1] + weights[2] * z[2];
            response.sum()
        };
        let mut v = [0.0; MAX_NOISE_ORDER + 1];
        v[0] = u - level - response(&weights[0], &to_pairs(&self.now[0]));
        for ((v, u), z) in (v[1..=order].iter_mut().zip(&self.outputs)).zip(self.past[0].newest_first()) {
            *v = u - level - response(&weights[0], z);
        }
        for input in 1..I {
            v[0] -= response(&weights[input], &to_pairs(&self.now[input]));
            for (v, z) in v[1..=order].iter_mut().zip(self.past[input].newest_first()) {
                *v -= response(&weights[input], z);
            }
        }
        // After a change in the operator, v contains the unmodelled part of the response. The weight
        // `min(1, c sigma^2/eps^2)` limits the contribution of samples with a large residual to the sums of D.
        let eps = v[0] + self.d.iter().zip(&v[1..]).map(|(d, v)| d * v).sum::<f64>();
        let excess = eps * eps / (CLIP_VARIANCES * self.predictive_variance[0]);
        self.noise.update(&v, eps, 1.0 / excess.max(1.0));
    }

    fn end_block(&mut self, prior: &ChangePrior) {
        let [early, late] = [&mut self.early, &mut self.late].map(|part| core::mem::replace(part, Moments::EMPTY));
        let moments = early.merged(&late);
        let (n, ts) = (moments.samples, self.scales.sample_time);
        let least = MIN_RELATIVE_VARIANCE * self.scales.size * self.scales.size;
        let energy = moments.residual_energy(&self.bases, self.mixture.mean()).max(n * least);
        let settled = self.samples as f64 * ts > SETTLING_S;
        let [predictive_variance, rests_on] = &mut self.predictive_variance;
        if settled {
            // Student's density with n degrees of freedom, without the constants that cancel in differences between
            // candidates.
            let density =
                -0.5 * n * (libm::log(*predictive_variance) + 2.0 * libm::log1p(energy / (n * *predictive_variance)));
            self.evidence = density + libm::exp(-n * ts / EVIDENCE_MEMORY_S) * self.evidence;
        }
        *rests_on = (*rests_on + n).min(VARIANCE_MEMORY_S / ts).max(n);
        *predictive_variance = (*predictive_variance + n / *rests_on * (energy / n - *predictive_variance)).max(least);
        // The variance in the predictive density follows the mean energy per sample with a memory that grows to at most
        // `VARIANCE_MEMORY_S`.
        let left = self.mixture.update([&early, &late], &self.bases, prior, &self.scales);
        if settled {
            self.volatility.add(left, n);
        }
    }

    /// At regular intervals, replaces D by the candidate's own noise model and updates the dispersion. Without replays
    /// there is no next candidate that could use this noise model.
    pub fn update_whitening(&mut self) {
        let every = (libm::round(NOISE_UPDATE_S / self.scales.sample_time).max(1.0)) as u64;
        if self.samples.is_multiple_of(every) {
            self.noise.solve();
            let order = self.noise.order();
            self.d[..order].copy_from_slice(self.noise.d());
            self.scales.dispersion = self.volatility.dispersion();
        }
    }

    /// Stores the output and the signals of a sample for the whitening filter.
    #[inline(always)]
    pub fn store(&mut self, u: f64) {
        self.outputs.copy_within(0..MAX_NOISE_ORDER - 1, 1);
        self.outputs[0] = u;
        for (past, now) in self.past.iter_mut().zip(&self.now) {
            past.push(now);
        }
    }

    /// Stores, for the whitening filter, a sample whose output is a prediction or was recorded at a limit of the stick.
    pub fn store_prediction(&mut self, u: f64) {
        // Each prediction causes one later sample not to be used, up to the order of D.
        self.predicted = (self.predicted + 1).min(self.noise.order() as u64);
        self.store(u);
    }

    /// Coefficients of the whitening filter D after the leading 1.
    pub fn d(&self) -> &[f64] {
        &self.d[..self.noise.order()]
    }

    /// Returns the basis point of each input plus the corrections of a state; each correction is limited to the largest
    /// step, and the resulting points to the range of the basis.
    pub fn corrected_points(&self, state: &[f64; S]) -> [Point; I] {
        core::array::from_fn(|input| {
            let (at, (_, corrections)) = (self.bases.of(input).point(), input_part(state, input));
            let of = [at.omega, at.zeta, 1.0];
            let [omega, zeta, tau] = core::array::from_fn(|j| {
                let [down, up] = CORRECTION_RANGE[j].map(|far| far * of[j]);
                let [low, high] = BASIS_POINT_RANGE[j];
                let from = [at.omega, at.zeta, at.tau][j];
                (from + corrections[j].max(down).min(up)).max(low).min(high)
            });
            Point { omega, zeta, tau, ..at }
        })
    }

    /// Returns the basis point of each input plus the current corrections, within the same limits.
    pub fn points(&self) -> [Point; I] {
        self.corrected_points(self.mixture.mean())
    }

    /// Estimates of K_e, K_e_dot, omega, zeta and tau for each input.
    pub fn operators(&self) -> [[f64; PARAMETER_COUNT]; I] {
        let (state, points) = (self.mixture.mean(), self.points());
        core::array::from_fn(|input| {
            let (map, (gains, _)) = (self.gain_and_lead_matrix(input), input_part(state, input));
            let Point { omega, zeta, tau, .. } = points[input];
            let gain = |i: usize| (0..GAIN_COUNT).map(|k| map[i][k] * gains[k]).sum();
            [gain(0), gain(1), omega, zeta, tau]
        })
    }

    /// Matrix that maps the gains of an input to K_e and K_e_dot.
    pub fn gain_and_lead_matrix(&self, input: usize) -> [[f64; GAIN_COUNT]; 2] {
        self.bases.of(input).gain_and_lead_matrix(&FIT_FREQUENCIES_RAD_S)
    }

    /// Frequency responses by which the gains of an input are multiplied, at a frequency in rad/s and at the current
    /// point.
    pub fn responses(&self, input: usize, omega_rad_s: f64) -> [Complex; GAIN_COUNT] {
        self.bases.of(input).response(omega_rad_s, self.points()[input])
    }

    /// Frequency response to an input at a frequency in rad/s.
    pub fn response(&self, input: usize, omega_rad_s: f64) -> Complex {
        let (gains, h) = (self.gains(input), self.responses(input, omega_rad_s));
        [0, 1].map(|part| (0..GAIN_COUNT).map(|i| gains[i] * h[i][part]).sum())
    }

    fn gains(&self, input: usize) -> [f64; GAIN_COUNT] {
        input_part(self.mixture.mean(), input).0
    }

    /// Like [`Candidate::response`], with the derivatives of the real and imaginary parts with respect to the state.
    /// The derivatives are exact for the gains and finite differences for the corrections.
    pub fn response_with_derivatives(&self, input: usize, omega_rad_s: f64) -> (Complex, [[f64; S]; 2]) {
        let (gains, basis, point) = (self.gains(input), self.bases.of(input), self.points()[input]);
        let h = basis.response(omega_rad_s, point);
        let of =
            |h: &[Complex; GAIN_COUNT]| [0, 1].map(|part| (0..GAIN_COUNT).map(|i| gains[i] * h[i][part]).sum::<f64>());
        let mut by = [[0.0; S]; 2];
        for part in 0..2 {
            for i in 0..GAIN_COUNT {
                by[part][first_gain(input) + i] = h[i][part];
            }
        }
        let places = correction_places(input);
        for (j, size) in [point.omega, point.zeta, 0.1].into_iter().enumerate() {
            let step = 1e-5 * size;
            let at = |sign: f64| {
                let mut by = [0.0; DYNAMICS_COUNT];
                by[j] = sign * step;
                of(&basis.response(omega_rad_s, point.moved(by)))
            };
            let (up, down) = (at(1.0), at(-1.0));
            for part in 0..2 {
                by[part][places[j]] = (up[part] - down[part]) / (2.0 * step);
            }
        }
        (of(&h), by)
    }

    /// Returns a state in the coordinates of other bases; if their points are far apart, the corrections are set to
    /// zero.
    pub fn convert_state(&self, to: &Bases<I>, state: &[f64; S]) -> [f64; S] {
        let mut carried = self.bases.convert_state(to, state);
        let [omega, ..] = correction_places(0).map(|place| carried[place]);
        let is_far = |input: usize| carried[delay_place(input)].abs() > 0.03;
        if (0..I).any(is_far) || omega.abs() > 0.3 * to.first().point().omega {
            for (_, correction) in carried.iter_mut().enumerate().filter(|(i, _)| is_correction(*i)) {
                *correction = 0.0;
            }
        }
        carried
    }
}
