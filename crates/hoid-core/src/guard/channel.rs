//! One signal: what its next sample may be.
//!
//! **Prediction.** With `nabla x(t) = x(t) - x(t-1)`, the polynomial of degree j-1 through the last j
//! samples goes on to a value from which x(t) differs by exactly `r_j(t) = nabla^j x(t)` (Newton's
//! backward formula). The backward differences of order 1 to 4 are therefore the errors of holding
//! the last sample, of a line, of a parabola and of a cubic, at one subtraction each. The order with
//! the smallest scale is used: 1 for a signal like white noise behind one lag, 3 or 4 for a smooth
//! one.
//!
//! **Scale.** q_j is the 99 % quantile of `|r_j|`, by stochastic approximation in its logarithm (H.
//! Robbins and S. Monro, *Annals of Mathematical Statistics* 22 (1951) 400-407):
//!
//! `q <- q (1 + g (1 - p))` where `|r| > q`, else `q <- q (1 - g p)`, with p = .01, g = .05.
//!
//! The size of an outlier does not enter: one sample moves q by 5 % whatever it is. A quantile in the
//! tail, and not a median: people's u rests and moves by pulses, and its tails are what the limit
//! must let pass.
//!
//! **Outliers.** A sample is held back where `|r_j| > max(m q_j, floor)` with m = 2.5. For Gaussian
//! errors these are 6.4 standard deviations, one of 8e9 samples; for Laplacian ones, whose tails are
//! heavy, it is `.01^2.5`, one of 1e5. The floor is a share of the signal's mean magnitude below
//! which an outlier is worth nothing.
//!
//! **While it is held back** the signal goes on along its last slope where that has a meaning (order
//! 2 or more), damped with a time constant of [`SLOPE_S`], else at its last value. It has come back
//! when it is as near to that as it may be after h samples: within `max(m q_j, floor) + h q_1` where
//! it has a slope, and `max(m q_1, floor) sqrt(h + 1)` where it wanders.

/// Orders of the differences.
pub const ORDERS: usize = 4;
/// Probability beyond the quantile, and gain of its approximation.
const BEYOND: f64 = 0.01;
const GAIN: f64 = 0.05;
/// Limit in units of the quantile.
const LIMIT: f64 = 2.5;
/// Time constant with which the slope of a signal that is held back is damped, s.
pub const SLOPE_S: f64 = 0.1;
/// Quantile over mean magnitude of Gaussian errors: what the first quantiles are made of.
pub const QUANTILE_OVER_MEAN: f64 = 3.228;

/// One signal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelGuard {
    /// The last sample as handed on, and its differences of order 1 to 3.
    last: f64,
    differences: [f64; ORDERS - 1],
    /// Samples in a row as they came, up to [`ORDERS`].
    known: usize,
    /// Quantiles; those of nothing are zero.
    quantiles: [f64; ORDERS],
    /// Order less one that is used.
    order: usize,
    /// Least limit.
    floor: f64,
    /// Samples that are being held back, the largest error among them, the sample before them, and
    /// the slope.
    held: u32,
    size: f64,
    base: f64,
    slope: f64,
    damping: f64,
}

crate::state!([] ChannelGuard {
    last, differences, known, quantiles, order, floor, held, size, base, slope, damping,
});

impl ChannelGuard {
    /// A signal of which nothing is known: everything passes until [`ChannelGuard::set_quantiles`].
    pub fn new(sample_time: f64) -> Self {
        Self {
            last: 0.0,
            differences: [0.0; ORDERS - 1],
            known: 0,
            quantiles: [0.0; ORDERS],
            order: 0,
            floor: 0.0,
            held: 0,
            size: 0.0,
            base: 0.0,
            slope: 0.0,
            damping: libm::exp(-sample_time / SLOPE_S),
        }
    }

    /// Quantiles that are known from the past of the signal, of the differences of order 1 to 4;
    /// one of zero or less is not known.
    pub fn set_quantiles(&mut self, quantiles: [f64; ORDERS]) {
        self.quantiles = quantiles;
        self.choose();
    }

    /// True once the quantiles are known.
    pub fn is_known(&self) -> bool {
        self.quantiles[0] > 0.0
    }

    /// The last sample, or what stands for it.
    pub fn last(&self) -> f64 {
        self.last
    }

    /// The last difference where the signal is foretold by more than its last value, else zero.
    pub fn slope(&self) -> f64 {
        if self.order_in_use() > 0 {
            self.differences[0]
        } else {
            0.0
        }
    }

    /// True where the signal is foretold by more than its last value.
    pub fn has_slope(&self) -> bool {
        self.order > 0
    }

    /// Least limit from now on.
    pub fn set_floor(&mut self, floor: f64) {
        self.floor = floor;
    }

    /// Backward differences of order 1 to 4 with x as the next sample: the errors of the
    /// predictions.
    #[inline(always)]
    pub fn errors(&self, x: f64) -> [f64; ORDERS] {
        let first = x - self.last;
        let second = first - self.differences[0];
        let third = second - self.differences[1];
        [first, second, third, third - self.differences[2]]
    }

    /// Order less one of the prediction in use: none that rests on samples that were made up.
    #[inline(always)]
    fn order_in_use(&self) -> usize {
        let most = self.known.saturating_sub(1);
        if self.order < most { self.order } else { most }
    }

    #[inline(always)]
    fn limit(&self, order: usize) -> f64 {
        let limit = LIMIT * self.quantiles[order];
        if limit > self.floor { limit } else { self.floor }
    }

    /// True for errors beyond the limit, and for those that are no numbers. Nothing is beyond it
    /// while the quantiles, or a sample before, are not known.
    #[inline(always)]
    pub fn is_outlier(&self, errors: &[f64; ORDERS]) -> bool {
        let order = self.order_in_use();
        // False for NaN.
        let within = errors[order].abs() <= self.limit(order);
        !within && (self.quantiles[0] > 0.0 && self.known > 0 || !errors[0].is_finite())
    }

    /// Takes a sample into the prediction as it is, and its errors into the quantiles.
    #[inline(always)]
    pub fn accept(&mut self, x: f64, errors: &[f64; ORDERS]) {
        for (q, r) in self.quantiles.iter_mut().zip(errors) {
            *q *= if r.abs() > *q {
                1.0 + GAIN * (1.0 - BEYOND)
            } else {
                1.0 - GAIN * BEYOND
            };
        }
        self.follow(x, errors);
    }

    /// Takes a sample into the prediction alone.
    #[inline(always)]
    pub fn follow(&mut self, x: f64, errors: &[f64; ORDERS]) {
        self.last = x;
        self.differences = [errors[0], errors[1], errors[2]];
        self.known = if self.known < ORDERS { self.known + 1 } else { ORDERS };
    }

    /// Chooses the order of the prediction anew, from time to time.
    pub fn choose(&mut self) {
        for (order, q) in self.quantiles.iter().enumerate() {
            if *q < self.quantiles[self.order] {
                self.order = order;
            }
        }
    }

    /// Samples that are being held back.
    pub fn held(&self) -> u32 {
        self.held
    }

    /// The largest error among them.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Holds back a sample, or a missing one (NaN); returns what stands for it.
    pub fn hold(&mut self, x: f64) -> f64 {
        if self.held == 0 {
            (self.size, self.base) = (0.0, self.last);
            self.slope = self.slope();
        }
        self.held += 1;
        let error = (x - self.last).abs();
        if error > self.size {
            self.size = error;
        }
        self.slope *= self.damping;
        self.last += self.slope;
        self.last
    }

    /// True where a signal that is held back has come back with this sample.
    pub fn is_back(&self, x: f64) -> bool {
        let expected = self.last + self.damping * self.slope;
        let (limit, held) = (self.limit(self.order_in_use()), f64::from(self.held));
        let room = if self.order > 0 {
            limit + held * self.quantiles[0]
        } else {
            limit * libm::sqrt(held + 1.0)
        };
        (x - expected).abs() <= room
    }

    /// Goes on from a sample that has come back, with the mean slope since the last good one.
    pub fn resume(&mut self, x: f64) {
        let slope = (x - self.base) / (f64::from(self.held) + 1.0);
        self.last = x;
        self.differences = [slope, 0.0, 0.0];
        self.known = 1;
        (self.held, self.size) = (0, 0.0);
    }

    /// Goes on from the last samples of the signal as they came, the newest last.
    pub fn restart(&mut self, samples: impl Iterator<Item = f64>) {
        (self.known, self.held, self.size, self.slope) = (0, 0, 0.0, 0.0);
        let mut first = true;
        for x in samples {
            if first {
                self.last = x;
                self.differences = [0.0; ORDERS - 1];
                self.known = 1;
                first = false;
            } else {
                let errors = self.errors(x);
                self.follow(x, &errors);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Twin: a polynomial of degree j-1 through the last j samples, by Lagrange's formula.
    #[test]
    fn errors_are_those_of_the_extrapolated_polynomials() {
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
            channel.follow(x, &errors);
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

    /// The 99 % quantile of a Gaussian first difference of a random walk is 2.576; its standard
    /// error by this approximation is about sqrt(g p/2)/(q f(q)/...) = 8 %.
    #[test]
    fn quantiles_are_found_from_far_off_and_one_outlier_hardly_moves_them() {
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
    fn an_outlier_is_held_back_until_the_signal_comes_back() {
        let signal = |t: i32| libm::sin(0.03 * f64::from(t));
        let mut channel = ChannelGuard::new(0.01);
        channel.set_quantiles([0.04, 0.002, 2e-4, 2e-5]);
        for t in 0..300 {
            let x = signal(t);
            let errors = channel.errors(x);
            channel.follow(x, &errors);
        }
        for t in 300..308 {
            let x = signal(t) + 5.0;
            assert!(channel.is_outlier(&channel.errors(x)) || channel.held() > 0);
            assert!(channel.held() == 0 || !channel.is_back(x), "{t}");
            let stands = channel.hold(x);
            assert!((stands - signal(t)).abs() < 0.1, "{t}: {stands}");
        }
        assert!(channel.is_back(signal(308)) && (channel.size() - 5.0).abs() < 0.1);
        channel.resume(signal(308));
        for t in 309..400 {
            let errors = channel.errors(signal(t));
            assert!(!channel.is_outlier(&errors), "{t}: {errors:?}");
            channel.accept(signal(t), &errors);
        }
    }

    #[test]
    fn nothing_known_lets_numbers_pass_and_nothing_else() {
        let mut channel = ChannelGuard::new(0.01);
        assert!(!channel.is_outlier(&channel.errors(1e9)));
        assert!(channel.is_outlier(&channel.errors(f64::NAN)));
        assert!(channel.hold(f64::NAN).is_finite() && channel.held() == 1);
        // A signal that never moves has no scale, and no outliers but by its floor.
        channel.restart([3.0; 9].into_iter());
        channel.set_quantiles([1e-300; ORDERS]);
        channel.set_floor(0.1);
        assert!(!channel.is_outlier(&channel.errors(3.05)));
        assert!(channel.is_outlier(&channel.errors(3.2)));
    }
}
