//! The part of the input that follows an external signal, computed sample by sample.
//!
//! As in the batch method ([`hoid_ident::iv`]), the response of e to f_t is an expansion in Laguerre filters. The
//! filters are `L_0 = sqrt(1 - p^2)/(1 - p q^-1)` and `L_k = L_{k-1} (q^-1 - p)/(1 - p q^-1)` (B. Wahlberg, *IEEE
//! Trans. Automatic Control* 36 (1991) 551-562). The weights are estimated by recursive least squares with a long
//! memory. The value at t is computed with the weights of t - 1, which contain only past noise, attenuated by the ratio
//! of the number of filters to the memory length.

use super::forgetting::Forgetting;
use hoid_track::building::{limit_magnitude, weighted_sum};

/// Number of filters. The response of a loop lasts a second or two; 16 filters with a time constant of 16 samples span
/// about 500 samples.
const FILTER_COUNT: usize = 16;
/// Time constant of the filters in samples.
const TIME_CONSTANT_SAMPLES: f64 = 16.0;
/// Memory length of the weights in samples.
const MEMORY_SAMPLES: f64 = 4096.0;
/// Initial variance of the weights for signals of unit power; the prior at zero has the weight of a hundredth of a
/// sample.
const INITIAL_VARIANCE: f64 = 100.0;

/// The Laguerre filters and their weights.
#[derive(Debug, Clone)]
pub(crate) struct LaguerreRegression {
    pole: f64,
    filters: [f64; FILTER_COUNT],
    weights: [f64; FILTER_COUNT],
    p: Forgetting,
    /// Mean square of the external signal; `samples` is the number of samples.
    power: f64,
    samples: f64,
}

hoid_core::state!([] LaguerreRegression { pole, filters, weights, p, power, samples });

impl LaguerreRegression {
    /// Creates filters at rest with zero weights.
    pub fn new() -> Self {
        Self {
            pole: (-1.0 / TIME_CONSTANT_SAMPLES).exp(),
            filters: [0.0; FILTER_COUNT],
            weights: [0.0; FILTER_COUNT],
            p: Forgetting::diagonal(INITIAL_VARIANCE, 1.0 - 1.0 / MEMORY_SAMPLES),
            power: 0.0,
            samples: 0.0,
        }
    }

    /// Returns the part of e(t) that follows the external signal up to t.
    pub fn step(&mut self, external: f64, e: f64) -> f64 {
        let external = limit_magnitude(external);
        self.filter(external);
        let following = limit_magnitude(weighted_sum(&self.weights, &self.filters));
        self.samples += 1.0;
        self.power += (external * external - self.power) / self.samples.min(MEMORY_SAMPLES);
        // The external signal is scaled to unit power, so P does not depend on its scale.
        let scale = self.power.sqrt().recip();
        if scale.is_finite() {
            let z = self.filters.map(|v| limit_magnitude(scale * v));
            let mut gain = [0.0; FILTER_COUNT];
            self.p.gain(&z, &mut gain);
            let error = limit_magnitude(scale * (e - following));
            for (w, g) in self.weights.iter_mut().zip(gain) {
                *w = limit_magnitude(*w + g * error);
            }
        }
        following
    }

    fn filter(&mut self, external: f64) {
        let p = self.pole;
        // v_k(t) = p v_k(t-1) + v_{k-1}(t-1) - p v_{k-1}(t).
        let (mut before, mut now) = (self.filters[0], 0.0);
        for (k, v) in self.filters.iter_mut().enumerate() {
            let old = *v;
            *v = if k == 0 {
                p * old + (1.0 - p * p).sqrt() * external
            } else {
                p * old + before - p * now
            };
            (before, now) = (old, *v);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_are_orthonormal() {
        let mut following = LaguerreRegression::new();
        let mut gram = [[0.0; FILTER_COUNT]; FILTER_COUNT];
        for t in 0..4000 {
            following.filter(f64::from(u8::from(t == 0)));
            for i in 0..FILTER_COUNT {
                for j in 0..FILTER_COUNT {
                    gram[i][j] += following.filters[i] * following.filters[j];
                }
            }
        }
        for i in 0..FILTER_COUNT {
            for j in 0..FILTER_COUNT {
                // The impulse responses have decayed to the level of rounding errors.
                assert!((gram[i][j] - f64::from(u8::from(i == j))).abs() < 1e-12, "{i} {j}");
            }
        }
    }

    #[test]
    fn delayed_response_is_followed_at_any_scale() {
        for scale in [1e-6, 1.0, 1e6] {
            let mut following = LaguerreRegression::new();
            let f = |t: i32| scale * ((0.05 * f64::from(t)).sin() + (0.31 * f64::from(t)).sin());
            let (mut y, mut rest, mut power) = (0.0, 0.0, 0.0);
            for t in 0..4000 {
                y = 0.8 * y + 0.2 * f(t - 20);
                let found = following.step(f(t), y);
                if t > 2000 {
                    rest += (found - y).powi(2);
                    power += y * y;
                }
            }
            assert!(rest < 1e-4 * power, "{}", rest / power);
        }
    }
}
