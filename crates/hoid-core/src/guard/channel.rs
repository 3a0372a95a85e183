//! Guard of one signal, which checks whether its next sample is plausible.
//!
//! **Prediction.** With `nabla x(t) = x(t) - x(t-1)`, the polynomial of degree j-1 through the last j samples
//! extrapolates to a value that differs from x(t) by exactly `r_j(t) = nabla^j x(t)` (Newton's backward formula). The
//! backward differences of order 1 to 4 are therefore the errors of predicting x(t) by the last sample, a line, a
//! parabola and a cubic, at the cost of one subtraction each. The order with the smallest scale is used: order 1 for a
//! signal like low-pass filtered white noise, order 3 or 4 for a smooth signal.
//!
//! **Scale.** q_j is the 99 % quantile of `|r_j|`, estimated by stochastic approximation on a logarithmic scale (H.
//! Robbins and S. Monro, *Annals of Mathematical Statistics* 22 (1951) 400-407):
//!
//! `q <- q (1 + g (1 - p))` if `|r| > q`, else `q <- q (1 - g p)`, with p = .01, g = .05.
//!
//! The size of an outlier does not matter: one sample changes q by at most 5 %. A quantile in the tail is used instead
//! of the median, because a person's u moves in pulses with rests between them, and the limit must accept the tails of
//! the distribution of its differences. p_j is the 90 % quantile, computed in the same way with g = .02. Samples at
//! which the signal stays constant carry no information about its motion and do not affect the quantiles.
//!
//! **Outliers.** A sample is held back if `|r_j| > max(m_j q_j, floor)` with
//!
//! `m_j = mean of (q_j/p_j)^2`, at least 2.5 and at most 12,
//!
//! averaged over about the last 20 s, since the ratio of two tracked quantiles is noisy. In a tail of the form
//! `P(|r| > x) = exp(-(x/s)^k)` (W. Weibull, *Journal of Applied Mechanics* 18 (1951) 293-297), the value exceeded with
//! probability P is `s (-log P)^(1/k)`. The values for P = .1 and .01 differ by the factor `2^(1/k)`, and the values
//! for 1e-2 and 1e-8 by its square, `4^(1/k)`. The limit `m q` is therefore exceeded by one in 1e8 samples, both for a
//! steady hand (k = 2: m = 2; a Gaussian tail gives 2.45) and for a hand that moves in bursts (k = 1: m = 4; k = .7: m
//! = 7). With m = 2.5, Gaussian errors are held back above 6.4 standard deviations, which one in 8e9 samples exceeds.
//! The floor is a fraction of the mean magnitude of the signal; a smaller outlier has no effect.
//!
//! **Held-back samples.** While samples are held back, the signal is continued with its last slope, damped with the
//! time constant [`SLOPE_TIME_CONSTANT_S`], if the order is 2 or more, and otherwise with its last value. After h
//! samples, the signal has returned if its distance from the continued value is at most `max(m q_j, floor) + h q_1`
//! with a slope, and `max(m q_1, floor) sqrt(h + 1)` without a slope.

/// Number of orders of the backward differences.
pub const ORDER_COUNT: usize = 4;
/// Probability that an error exceeds the quantile; `QUANTILE_GAIN` is the gain of the approximation of the quantile.
const TAIL_PROBABILITY: f64 = 0.01;
const QUANTILE_GAIN: f64 = 0.05;
/// Probability that an error exceeds the inner quantile; `INNER_QUANTILE_GAIN` is the gain of the approximation of the
/// inner quantile.
const INNER_TAIL_PROBABILITY: f64 = 0.1;
const INNER_QUANTILE_GAIN: f64 = 0.02;
/// Smallest limit of an error, relative to the quantile; `LARGEST_TAIL_RATIO` is the largest.
const MIN_TAIL_RATIO: f64 = 2.5;
const LARGEST_TAIL_RATIO: f64 = 12.0;
/// Largest mean magnitude of differences, relative to their inner quantile, at which they are typical of the signal.
/// Gaussian errors have .49 and Laplacian errors .43; errors five times as large have 2.4 and 2.2.
const MAX_TYPICAL_RATIO: f64 = 1.3;
/// Number of blocks over which the tails are averaged.
const AVERAGED_BLOCKS: u32 = 20;
/// Ratio of the inner (90 %) quantile to the 99 % quantile for Gaussian errors.
const GAUSSIAN_INNER_RATIO: f64 = 1.6449 / 2.5758;
/// Time constant in s with which the slope of a held-back signal is damped.
pub const SLOPE_TIME_CONSTANT_S: f64 = 0.1;
/// Ratio of the 99 % quantile to the mean magnitude for Gaussian errors, used for the initial quantiles.
const QUANTILE_TO_MEAN_RATIO: f64 = 3.228;

/// Guard of one signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelGuard {
    /// Last accepted sample, and its backward differences of order 1 to 3.
    last: f64,
    differences: [f64; ORDER_COUNT - 1],
    /// Number of consecutive samples that were not replaced, up to [`ORDER_COUNT`].
    known: usize,
    /// 99 % quantiles of the magnitudes of the differences; zero if unknown.
    quantiles: [f64; ORDER_COUNT],
    /// Inner (90 %) quantiles, from which the tail is extrapolated.
    inner: [f64; ORDER_COUNT],
    /// Mean of the squared ratio of the 99 % quantile to the inner quantile, and number of blocks over which it was
    /// averaged.
    tail_ratio: [f64; ORDER_COUNT],
    averaged: u32,
    /// True once outliers are being detected.
    detects_outliers: bool,
    /// Largest first difference with which the signal counts as constant.
    resting: f64,
    /// Order of the prediction minus one.
    order: usize,
    /// Lower bound of the limit of the prediction error.
    floor: f64,
    /// Number of held-back samples, the largest deviation of one of them from the continued signal, the last sample
    /// before them, and the slope of the signal.
    held: u32,
    largest_error: f64,
    base: f64,
    slope: f64,
    damping: f64,
}

crate::state!([] ChannelGuard {
    last, differences, known, quantiles, inner, tail_ratio, averaged, detects_outliers, resting, order, floor, held,
    largest_error, base, slope, damping,
}, limit_restored);

impl ChannelGuard {
    fn limit_restored(&mut self) {
        self.known = self.known.min(ORDER_COUNT);
        self.order = self.order.min(ORDER_COUNT - 1);
    }

    /// Builds the guard of a signal without prior knowledge. Until [`ChannelGuard::set_quantiles`] or
    /// [`ChannelGuard::start_detection`] is called, the guard accepts all finite samples.
    pub fn new(sample_time: f64) -> Self {
        Self {
            last: 0.0,
            differences: [0.0; ORDER_COUNT - 1],
            known: 0,
            quantiles: [0.0; ORDER_COUNT],
            inner: [0.0; ORDER_COUNT],
            tail_ratio: [0.0; ORDER_COUNT],
            averaged: 0,
            detects_outliers: false,
            resting: 0.0,
            order: 0,
            floor: 0.0,
            held: 0,
            largest_error: 0.0,
            base: 0.0,
            slope: 0.0,
            damping: libm::exp(-sample_time / SLOPE_TIME_CONSTANT_S),
        }
    }

    /// Sets the 99 % quantiles of the magnitudes of the differences of order 1 to 4, known from the past of the signal,
    /// and starts the detection of outliers. A quantile of zero or less counts as unknown. The tails are assumed to be
    /// Gaussian until they are learnt.
    pub fn set_quantiles(&mut self, quantiles: [f64; ORDER_COUNT]) {
        self.set_tails(quantiles, quantiles.map(|q| GAUSSIAN_INNER_RATIO * q));
    }

    /// Like [`ChannelGuard::set_quantiles`], with `inner` as the 90 % quantiles.
    pub fn set_tails(&mut self, quantiles: [f64; ORDER_COUNT], inner: [f64; ORDER_COUNT]) {
        (self.quantiles, self.inner) = (quantiles, inner);
        self.averaged = 0;
        self.average_tails();
        self.averaged = AVERAGED_BLOCKS;
        self.start_detection();
    }

    /// Sets the initial values of unknown quantiles from the mean magnitudes of the differences. The quantiles are then
    /// learnt; until [`ChannelGuard::start_detection`], no sample counts as an outlier.
    pub fn start_estimation(&mut self, means: [f64; ORDER_COUNT]) {
        for (j, mean) in means.into_iter().enumerate() {
            if self.quantiles[j] <= 0.0 {
                self.quantiles[j] = QUANTILE_TO_MEAN_RATIO * mean;
                self.inner[j] = GAUSSIAN_INNER_RATIO * self.quantiles[j];
            }
        }
    }

    /// Starts the detection of outliers if the quantiles are known.
    pub fn start_detection(&mut self) {
        self.detects_outliers = self.quantiles[0] > 0.0;
        self.select_order();
    }

    /// True if the quantiles are known and outliers are detected.
    pub fn is_known(&self) -> bool {
        self.detects_outliers
    }

    /// True if consecutive samples, the first of them after a jump, move like the signal: the mean magnitude of the
    /// prediction errors, of the order in use, is below the value for a signal about three times as large.
    pub fn moves_typically(&self, samples: impl Iterator<Item = f64>) -> bool {
        let (mut past, mut count, mut sum) = ([0.0; ORDER_COUNT], 0, 0.0);
        for x in samples {
            let mut difference = x;
            for (j, kept) in past.iter_mut().enumerate() {
                let next = difference - *kept;
                *kept = difference;
                difference = next;
                if j == self.order {
                    break;
                }
            }
            count += 1;
            if count > self.order + 1 {
                sum += difference.abs();
            }
        }
        let counted = count as f64 - self.order as f64 - 1.0;
        counted > 0.0 && sum <= MAX_TYPICAL_RATIO * self.inner[self.order] * counted
    }

    /// Returns the first difference above which a sample counts as a jump.
    pub fn jump_threshold(&self) -> f64 {
        self.limit(0)
    }

    /// Sets the largest first difference with which the signal counts as constant.
    pub fn set_constant_tolerance(&mut self, difference: f64) {
        self.resting = difference;
    }

    /// Returns the largest first difference with which the signal counts as constant.
    pub fn constant_tolerance(&self) -> f64 {
        self.resting
    }

    /// Returns the last sample or, if it was held back, its replacement.
    pub fn last(&self) -> f64 {
        self.last
    }

    /// Returns the difference between the last two samples if the order of the prediction is 2 or more, otherwise zero.
    pub fn slope(&self) -> f64 {
        if self.order_index() > 0 {
            self.differences[0]
        } else {
            0.0
        }
    }

    /// True if the order of the prediction is 2 or more.
    pub fn has_slope(&self) -> bool {
        self.order > 0
    }

    /// Sets the lower bound of the limit of the prediction error.
    pub fn set_limit_floor(&mut self, floor: f64) {
        self.floor = floor;
    }

    /// Returns the prediction errors of x as the next sample: its backward differences of order 1 to 4.
    #[inline(always)]
    pub fn errors(&self, x: f64) -> [f64; ORDER_COUNT] {
        let first = x - self.last;
        let second = first - self.differences[0];
        let third = second - self.differences[1];
        [first, second, third, third - self.differences[2]]
    }

    /// Order of the prediction in use minus one, limited so that the differences contain no replaced samples.
    #[inline(always)]
    fn order_index(&self) -> usize {
        let most = self.known.saturating_sub(1);
        if self.order < most { self.order } else { most }
    }

    #[inline(always)]
    fn limit(&self, order: usize) -> f64 {
        let limit = self.tail_ratio[order].max(MIN_TAIL_RATIO) * self.quantiles[order];
        if limit > self.floor { limit } else { self.floor }
    }

    /// True if the error exceeds the limit, provided that outliers are detected and a preceding sample is known; always
    /// true for a sample that is not finite.
    #[inline(always)]
    pub fn is_outlier(&self, errors: &[f64; ORDER_COUNT]) -> bool {
        let order = self.order_index();
        // The comparison is false if the error is NaN.
        let within = errors[order].abs() <= self.limit(order);
        !within && (self.detects_outliers && self.known > 0 || !errors[0].is_finite())
    }

    /// Accepts a sample: updates the prediction with the sample and the quantiles with its errors.
    #[inline(always)]
    pub fn accept(&mut self, x: f64, errors: &[f64; ORDER_COUNT]) {
        if errors[0].abs() > self.resting {
            for (q, r) in self.quantiles.iter_mut().zip(errors) {
                *q *= if r.abs() > *q {
                    1.0 + QUANTILE_GAIN * (1.0 - TAIL_PROBABILITY)
                } else {
                    1.0 - QUANTILE_GAIN * TAIL_PROBABILITY
                };
            }
            for (p, r) in self.inner.iter_mut().zip(errors) {
                *p *= if r.abs() > *p {
                    1.0 + INNER_QUANTILE_GAIN * (1.0 - INNER_TAIL_PROBABILITY)
                } else {
                    1.0 - INNER_QUANTILE_GAIN * INNER_TAIL_PROBABILITY
                };
            }
        }
        self.update_prediction(x, errors);
    }

    /// Updates the prediction with a sample, but not the quantiles.
    #[inline(always)]
    pub fn update_prediction(&mut self, x: f64, errors: &[f64; ORDER_COUNT]) {
        self.last = x;
        self.differences = [errors[0], errors[1], errors[2]];
        self.known = if self.known < ORDER_COUNT {
            self.known + 1
        } else {
            ORDER_COUNT
        };
    }

    fn average_tails(&mut self) {
        self.averaged = self.averaged.saturating_add(1).min(AVERAGED_BLOCKS);
        let weight = 1.0 / f64::from(self.averaged);
        for ((tail_ratio, q), p) in self.tail_ratio.iter_mut().zip(&self.quantiles).zip(&self.inner) {
            let quotient = q / p;
            // Unknown quantiles give 0/0; the limit of a signal with such quantiles is the lower bound
            // `MIN_TAIL_RATIO`, which is about the limit for a Gaussian tail. `clamp` would return NaN, which would
            // stay in the average for ever.
            let square = match quotient.is_nan() {
                true => MIN_TAIL_RATIO,
                false => (quotient * quotient).clamp(MIN_TAIL_RATIO, LARGEST_TAIL_RATIO),
            };
            *tail_ratio += weight * (square - *tail_ratio);
        }
    }

    /// Ends a block: updates the averages of the tails and selects the order of the prediction.
    pub fn end_block(&mut self) {
        self.average_tails();
        self.select_order();
    }

    fn select_order(&mut self) {
        for (order, q) in self.quantiles.iter().enumerate() {
            if *q < self.quantiles[self.order] {
                self.order = order;
            }
        }
    }

    /// Returns the number of consecutive held-back samples.
    pub fn held_count(&self) -> u32 {
        self.held
    }

    /// Returns the largest deviation of a held-back sample from the last value of the continued signal.
    pub fn largest_held_error(&self) -> f64 {
        self.largest_error
    }

    /// Holds back a sample, which may be missing (NaN), and returns its replacement.
    pub fn hold_back(&mut self, x: f64) -> f64 {
        if self.held == 0 {
            (self.largest_error, self.base) = (0.0, self.last);
            self.slope = self.slope();
        }
        self.held += 1;
        let error = (x - self.last).abs();
        if error > self.largest_error {
            self.largest_error = error;
        }
        self.slope *= self.damping;
        self.last += self.slope;
        self.last
    }

    /// True if a held-back signal has returned to a plausible value with this sample.
    pub fn has_returned(&self, x: f64) -> bool {
        let expected = self.last + self.damping * self.slope;
        let (limit, held) = (self.limit(self.order_index()), f64::from(self.held));
        let room = if self.order > 0 {
            limit + held * self.quantiles[0]
        } else {
            limit * libm::sqrt(held + 1.0)
        };
        (x - expected).abs() <= room
    }

    /// Continues from the sample with which the signal has returned, with the mean slope since the last sample before
    /// those held back.
    pub fn resume(&mut self, x: f64) {
        let slope = (x - self.base) / (f64::from(self.held) + 1.0);
        self.last = x;
        self.differences = [slope, 0.0, 0.0];
        self.known = 1;
        (self.held, self.largest_error) = (0, 0.0);
    }

    /// Continues the prediction from the given samples of the signal, the newest last.
    pub fn restart(&mut self, samples: impl Iterator<Item = f64>) {
        (self.known, self.held, self.largest_error, self.slope) = (0, 0, 0.0, 0.0);
        let mut first = true;
        for x in samples {
            if first {
                self.last = x;
                self.differences = [0.0; ORDER_COUNT - 1];
                self.known = 1;
                first = false;
            } else {
                let errors = self.errors(x);
                self.update_prediction(x, &errors);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Reference: a polynomial of degree j-1 through the last j samples, by Lagrange's formula.
    #[test]
    fn errors_match_polynomial_extrapolation() {
        let signal = |t: f64| libm::sin(0.31 * t) + 0.2 * libm::cos(1.7 * t);
        let mut channel = ChannelGuard::new(0.01);
        for t in 0..40 {
            let x = signal(f64::from(t));
            let errors = channel.errors(x);
            if t >= 4 {
                for (order, error) in errors.iter().enumerate() {
                    let nodes: Vec<f64> = (0..=order).map(|i| f64::from(t - 1 - i as i32)).collect();
                    let value = |i: usize| -> f64 {
                        let others = nodes.iter().enumerate().filter(|(k, _)| *k != i);
                        others.map(|(_, n)| (f64::from(t) - n) / (nodes[i] - n)).product()
                    };
                    let predicted: f64 = (0..=order).map(|i| value(i) * signal(nodes[i])).sum();
                    assert!((x - predicted - error).abs() < 1e-12, "{t} {order}: {error}");
                }
            }
            channel.update_prediction(x, &errors);
        }
    }

    fn noise(state: &mut u64) -> f64 {
        // Sum of twelve uniform numbers: standard deviation 1.
        (0..12).fold(-6.0, |sum, _| {
            *state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum + (*state >> 11) as f64 / (1_u64 << 53) as f64
        })
    }

    /// The 99 % quantile of the magnitude of the first differences of a Gaussian random walk is 2.576; this
    /// approximation has a standard error of about 8 %.
    #[test]
    fn quantiles_converge_and_resist_outliers() {
        let (mut state, mut x) = (1, 0.0);
        let mut channel = ChannelGuard::new(0.01);
        channel.set_quantiles([0.01, 1.0, 1.0, 1.0]);
        let (mut mean, mut count) = (0.0, 0.0);
        for t in 0..40_000 {
            x += noise(&mut state);
            let errors = channel.errors(x);
            channel.accept(x, &errors);
            if t > 2000 {
                mean += channel.quantiles[0];
                count += 1.0;
            }
        }
        let q = mean / count;
        assert!((q / 2.576 - 1.0).abs() < 0.08, "{q}");
        assert_eq!(channel.order, 0);
        let before = channel.quantiles[0];
        let errors = channel.errors(x + 1e9);
        assert!(channel.is_outlier(&errors));
        channel.accept(x + 1e9, &errors);
        assert!((channel.quantiles[0] / before - 1.0).abs() < 0.051);
    }

    #[test]
    fn outlier_is_replaced_until_the_signal_returns() {
        let signal = |t: i32| libm::sin(0.03 * f64::from(t));
        let mut channel = ChannelGuard::new(0.01);
        channel.set_quantiles([0.04, 0.002, 2e-4, 2e-5]);
        for t in 0..300 {
            let x = signal(t);
            let errors = channel.errors(x);
            channel.update_prediction(x, &errors);
        }
        for t in 300..308 {
            let x = signal(t) + 5.0;
            assert!(channel.is_outlier(&channel.errors(x)) || channel.held_count() > 0);
            assert!(channel.held_count() == 0 || !channel.has_returned(x), "{t}");
            let replacement = channel.hold_back(x);
            assert!((replacement - signal(t)).abs() < 0.1, "{t}: {replacement}");
        }
        assert!(channel.has_returned(signal(308)) && (channel.largest_held_error() - 5.0).abs() < 0.1);
        channel.resume(signal(308));
        for t in 309..400 {
            let errors = channel.errors(signal(t));
            assert!(!channel.is_outlier(&errors), "{t}: {errors:?}");
            channel.accept(signal(t), &errors);
        }
    }

    /// Weibull's distribution gives m = 4^(1/k), limited to at least 2.5: the limit is 2.5 times the quantile for k = 2
    /// and about seven times for k = .7. The largest of 1e5 samples is within the limit, a spike is not. Rests have no
    /// effect.
    #[test]
    fn bursts_raise_the_limit_and_spikes_are_still_detected() {
        for (shape, least, most) in [(2.0, 2.4, 2.6), (1.0, 3.0, 5.5), (0.7, 5.0, 10.5)] {
            let mut state = 7_u64;
            let mut uniform = || {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
            };
            let mut channel = ChannelGuard::new(0.01);
            channel.set_quantiles([1.0; ORDER_COUNT]);
            let (mut beyond, mut factor, mut x) = (0, 0.0, 0.0);
            for t in 0..100_000 {
                // Moves for half a second and rests for half a second.
                if t / 50 % 2 == 0 {
                    let size = libm::pow(-libm::log(uniform()), 1.0 / shape);
                    x += if uniform() < 0.5 { size } else { -size };
                }
                let errors = channel.errors(x);
                if t > 10_000 {
                    beyond += i32::from(channel.is_outlier(&errors));
                    factor += channel.limit(0) / channel.quantiles[0] / 89_999.0;
                    assert!(channel.is_outlier(&channel.errors(x + 40.0 * channel.quantiles[0])));
                }
                channel.accept(x, &errors);
                if t % 100 == 99 {
                    channel.end_block();
                }
            }
            assert!(beyond <= 1, "{shape}: {beyond}");
            assert!((least..most).contains(&factor), "{shape}: {factor}");
        }
    }

    #[test]
    fn offset_after_a_step_is_accepted_and_rescaling_is_not() {
        for order in 0..ORDER_COUNT {
            let mut channel = ChannelGuard::new(0.01);
            let mut state = 3;
            let mut quantiles = [9.0; ORDER_COUNT];
            quantiles[order] = 2.576;
            channel.set_quantiles(quantiles);
            assert_eq!(channel.order, order);
            // White noise, summed once for each order.
            let mut sums = [0.0; ORDER_COUNT];
            let signal: [f64; 11] = core::array::from_fn(|_| {
                let mut x = noise(&mut state);
                for sum in &mut sums[..=order] {
                    *sum += x;
                    x = *sum;
                }
                x
            });
            assert!(channel.moves_typically(signal.iter().map(|x| x + 1e3)), "{order}");
            assert!(!channel.moves_typically(signal.iter().map(|x| 5.0 * x)), "{order}");
            assert!(!channel.moves_typically(signal[..=order].iter().copied()), "{order}");
        }
    }

    #[test]
    fn no_outliers_are_detected_while_quantiles_are_estimated() {
        let mut channel = ChannelGuard::new(0.01);
        channel.update_prediction(0.0, &[0.0; ORDER_COUNT]);
        channel.start_estimation([0.0; ORDER_COUNT]);
        channel.start_detection();
        assert!(!channel.is_known());
        channel.start_estimation([0.1; ORDER_COUNT]);
        assert!(!channel.is_outlier(&channel.errors(1e9)));
        channel.start_detection();
        assert!(channel.is_known() && channel.is_outlier(&channel.errors(1e9)));
    }

    #[test]
    fn tail_ratio_is_set_after_empty_blocks() {
        let mut channel = ChannelGuard::new(0.01);
        channel.end_block();
        assert_eq!(channel.tail_ratio, [MIN_TAIL_RATIO; ORDER_COUNT]);
        channel.set_tails([3.0; ORDER_COUNT], [1.0; ORDER_COUNT]);
        let expected = 9.0_f64.clamp(MIN_TAIL_RATIO, LARGEST_TAIL_RATIO);
        assert!(channel.tail_ratio.iter().all(|heavy| (heavy - expected).abs() < 1e-12));
    }

    #[test]
    fn unknown_channel_accepts_only_finite_values() {
        let mut channel = ChannelGuard::new(0.01);
        assert!(!channel.is_outlier(&channel.errors(1e9)));
        assert!(channel.is_outlier(&channel.errors(f64::NAN)));
        assert!(channel.hold_back(f64::NAN).is_finite() && channel.held_count() == 1);
        // A signal that never moves has no scale, and only its floor detects outliers.
        channel.restart([3.0; 9].into_iter());
        channel.set_quantiles([1e-300; ORDER_COUNT]);
        channel.set_limit_floor(0.1);
        assert!(!channel.is_outlier(&channel.errors(3.05)));
        assert!(channel.is_outlier(&channel.errors(3.2)));
    }
}
