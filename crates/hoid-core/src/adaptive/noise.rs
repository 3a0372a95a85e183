//! Noise model: a long autoregression `D v = eps`, fitted by least squares with a long memory.
//!
//! D minimises `sum_k lambda^{t-k} w_k (v(k) + d_1 v(k-1) + .. + d_p v(k-p))^2` with `v = u - theta' r - level` (L.
//! Ljung, *System Identification*, 1999, section 10.1). At each sample the products of `[v(t), .., v(t-p)]`, computed
//! with the gains at that sample, are added to sums; the normal equations are solved at intervals. The weights w are
//! one, or less if eps is large. The memory grows with the time since the start up to a limit, so the first seconds,
//! with unknown gains, are forgotten.
//!
//! The prior of the coefficients is normal. Its mean is the model of a typical remnant, and its standard deviation is
//! `PRIOR_DEVIATION`. This prior adds `sigma^2/PRIOR_DEVIATION^2` to the diagonal of the sums (a ridge), where sigma^2
//! is the variance of eps. The ridge scales with the variance of eps and not with the variance of v: the spectrum of a
//! remnant with more than two poles falls to a very small fraction of its power, and D has to follow it there.
//!
//! D is used only as an FIR filter, so its inverse need not be stable.

use hoid_numerics::{cholesky, elimination};

use super::{defaults::NOISE_ORDER, f64x2::F64x2, sizes::MAX_NOISE_ORDER};

const LAG_COUNT: usize = MAX_NOISE_ORDER + 1;
/// Number of pairs of adjacent lags, rounded up.
const PAIR_COUNT: usize = LAG_COUNT.div_ceil(2);
/// Array with one number for each lag, from lag zero.
pub type Lags = [f64; LAG_COUNT];
/// Time constants, in s, of the remnant assumed as the prior.
const DEFAULT_TIME_CONSTANTS_S: [f64; 2] = [0.3, 0.06];
/// Prior standard deviation of the coefficients.
const PRIOR_DEVIATION: f64 = 10.0;

/// Lower limit of the ridge, for residuals that vanish.
const MIN_RIDGE: f64 = 1e-300;

/// Fading factor below which the sums are rescaled.
const RESCALE_THRESHOLD: f64 = 0.5;

/// Noise model: the sums and the coefficients of D.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseModel {
    order: usize,
    prior_d: [f64; 2],
    /// Longest and shortest memory in samples.
    longest: f64,
    shortest: f64,
    /// Upper triangle of the sums divided by `fade`, in pairs of rows and columns. A new sample gets the weight 1/fade,
    /// so the old sums need not be reduced at each sample.
    products: [[[F64x2; PAIR_COUNT]; 2]; PAIR_COUNT],
    fade: f64,
    /// Sum of the weights, followed by the weighted sum of eps^2.
    weight: f64,
    squares: f64,
    samples: f64,
    d: [f64; MAX_NOISE_ORDER],
}

crate::state!([] NoiseModel { products, fade, weight, squares, samples, d });

impl NoiseModel {
    /// Builds the prior noise model, with `memory` and `ts` in s. Returns `None` for an order below 2 or above
    /// [`MAX_NOISE_ORDER`], or a memory that is not positive.
    pub fn new(order: usize, memory: f64, ts: f64) -> Option<Self> {
        if !(2..=MAX_NOISE_ORDER).contains(&order) || memory.is_nan() || memory <= 0.0 {
            return None;
        }
        let [a, b] = DEFAULT_TIME_CONSTANTS_S.map(|t| libm::exp(-ts / t));
        let prior_d = [-(a + b), a * b];
        let mut d = [0.0; MAX_NOISE_ORDER];
        d[..2].copy_from_slice(&prior_d);
        Some(Self {
            order,
            prior_d,
            longest: memory / ts,
            shortest: (3.0 / ts).min(memory / ts).max(2.0 * order as f64),
            products: [[[F64x2::ZERO; PAIR_COUNT]; 2]; PAIR_COUNT],
            fade: 1.0,
            weight: 0.0,
            squares: 0.0,
            samples: 0.0,
            d,
        })
    }

    /// Sets the sums as if they came from `samples` samples with the given variance of eps and the given
    /// autocovariances of v, which are relative to that variance. Returns false for invalid numbers.
    pub(super) fn set_prior(&mut self, lags: &Lags, variance: f64, samples: f64) -> bool {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !(positive(variance) && lags[0] > 0.0 && lags.iter().all(|c| c.is_finite()) && positive(samples)) {
            return false;
        }
        // The memory is half the number of samples, up to the longest memory.
        let weight = samples.min(self.longest);
        self.samples = 2.0 * weight;
        (self.weight, self.squares, self.fade) = (weight, weight * variance, 1.0);
        for i in 0..=self.order {
            for j in i..=self.order {
                self.products[i / 2][i % 2][j / 2].0[j % 2] = weight * variance * lags[j - i];
            }
        }
        self.solve();
        true
    }

    /// Returns the coefficients of D after the leading 1.
    pub fn d(&self) -> &[f64] {
        &self.d[..self.order]
    }

    /// Returns the order of D.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Returns the gain of D at zero frequency.
    pub fn dc_gain(&self) -> f64 {
        1.0 + self.d().iter().sum::<f64>()
    }

    /// Adds the last residuals v, the newest first, with a weight; eps is the innovation that the current D computes
    /// from them.
    #[inline(always)]
    pub fn update(&mut self, v: &[f64; LAG_COUNT], eps: f64, weight: f64) {
        self.samples += 1.0;
        let memory = (0.5 * self.samples).clamp(self.shortest, self.longest.max(self.shortest));
        // With lambda = 1 - 1/memory, the exponential window has the length `memory`.
        let lambda = 1.0 - 1.0 / memory;
        self.weight = lambda * self.weight + weight;
        self.squares = lambda * self.squares + weight * eps * eps;
        self.fade *= lambda;
        if self.fade < RESCALE_THRESHOLD {
            let fade = F64x2::splat(self.fade);
            self.products
                .as_flattened_mut()
                .as_flattened_mut()
                .iter_mut()
                .for_each(|p| *p = *p * fade);
            self.fade = 1.0;
        }
        let weight = weight / self.fade;
        // The default order is passed as a constant, so the loops over the lags have a constant length.
        match self.order {
            NOISE_ORDER => self.add(v, weight, NOISE_ORDER),
            order => self.add(v, weight, order),
        }
    }

    #[inline(always)]
    fn add(&mut self, v: &Lags, weight: f64, order: usize) {
        let pairs = (order / 2 + 1).min(PAIR_COUNT);
        let v: [F64x2; PAIR_COUNT] =
            core::array::from_fn(|i| F64x2([v[2 * i], v.get(2 * i + 1).copied().unwrap_or(0.0)]));
        for first in 0..pairs {
            let [above, below] = &mut self.products[first];
            let [a, b] = v[first].0.map(|v| F64x2::splat(weight * v));
            for k in first..pairs {
                above[k] += a * v[k];
                below[k] += b * v[k];
            }
        }
    }

    /// Sum of the products of the residuals at two lags, the smaller lag first.
    fn product(&self, i: usize, j: usize) -> f64 {
        self.fade * self.products[i / 2][i % 2][j / 2].0[j % 2]
    }

    /// Variance sigma^2 of eps.
    fn variance(&self) -> f64 {
        if self.weight > 0.0 {
            self.squares / self.weight
        } else {
            0.0
        }
    }

    /// Weight of the prior in the units of the sums.
    fn ridge(&self) -> f64 {
        self.variance() / (PRIOR_DEVIATION * PRIOR_DEVIATION) + MIN_RIDGE
    }

    /// Upper triangle of the sums over the lags 1 to p, plus the ridge.
    #[inline(always)]
    fn lag_sums<const N: usize>(&self, p: usize) -> [[f64; N]; N] {
        let (mut matrix, ridge) = ([[0.0; N]; N], self.ridge());
        for i in 0..p {
            let lag = i + 1;
            let sums = &self.products[lag / 2][lag % 2];
            for (lag, to) in (1..).zip(&mut matrix[i][..p]) {
                let pair: usize = lag / 2;
                *to = self.fade * sums[pair].0[lag % 2];
            }
            matrix[i][i] += ridge;
        }
        matrix
    }

    /// Covariance of d: `sigma^2 S^-1 (sum mu_k^2 w v v') S^-1`. Here mu_k is the weight of a sample by its age, w its
    /// weight by the size of eps, S the sums with the weights `mu_k w`, and sigma^2 the variance of eps. This
    /// covariance equals `sigma^2 S^-1` times the mean of mu, which is 0.5 for an exponential memory of constant length
    /// and 0.6 while the memory grows as half the time since the start; 0.6 is used. Returns `None` until the sums
    /// determine d.
    pub fn covariance(&self) -> Option<[[f64; MAX_NOISE_ORDER]; MAX_NOISE_ORDER]> {
        let upper = self.lag_sums::<MAX_NOISE_ORDER>(self.order);
        let mut matrix = core::array::from_fn(|i| core::array::from_fn(|j| upper[i.min(j)][i.max(j)]));
        if self.samples <= self.order as f64 || !cholesky::factor(&mut matrix, self.order) {
            return None;
        }
        Some(cholesky::scaled_inverse(&matrix, self.order, 0.6 * self.variance()))
    }

    /// Solves the normal equations for D. D stays unchanged if the sums do not determine it.
    pub fn solve(&mut self) {
        match self.order {
            NOISE_ORDER => self.solve_order::<NOISE_ORDER>(NOISE_ORDER),
            order => self.solve_order::<MAX_NOISE_ORDER>(order),
        }
    }

    #[inline(always)]
    fn solve_order<const N: usize>(&mut self, p: usize) {
        let ridge = self.ridge();
        // The ridge is on both sides of the normal equations S d = -s_0: (S + r I) d = r d_prior - s_0.
        let mut d = [0.0; N];
        for (i, d) in d.iter_mut().enumerate().take(p) {
            *d = ridge * self.prior_d.get(i).copied().unwrap_or(0.0) - self.product(0, i + 1);
        }
        let solved = elimination::solve(&mut self.lag_sums(p), p, &mut d);
        if solved && d.iter().all(|d| d.is_finite()) {
            self.d[..N].copy_from_slice(&d);
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    /// Returns uniform noise with variance 1/12 from a fixed stream.
    fn uniform_noise(seed: &mut u64) -> f64 {
        *seed = seed
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    #[test]
    fn autoregression_is_found() {
        // The poles .95 and .6 give D = 1 - 1.55 q^-1 + .57 q^-2.
        let (mut model, mut seed) = (NoiseModel::new(6, 100.0, 0.01).unwrap(), 7);
        let mut v = [0.0; LAG_COUNT];
        for t in 0..10_000 {
            v.copy_within(0..LAG_COUNT - 1, 1);
            let eps = uniform_noise(&mut seed);
            v[0] = 1.55 * v[1] - 0.57 * v[2] + eps;
            model.update(&v, eps, 1.0);
            if t % 25 == 0 {
                model.solve();
            }
        }
        // With a memory of half the elapsed time, the weights are (s/t)^2, and 10 000 samples count as 5/9 of their
        // number. The variance of a coefficient is at most (1 + 1.55^2 + .57^2)/5556, a standard error of .026; the
        // tolerance is four of these.
        for (d, expected) in model.d().iter().zip([-1.55, 0.57, 0.0, 0.0, 0.0, 0.0]) {
            assert!((d - expected).abs() < 0.104, "{:?}", model.d());
        }
        assert!((model.dc_gain() - 1.0 - model.d().iter().sum::<f64>()).abs() < 1e-15);
    }

    #[test]
    fn steep_remnant_spectrum_is_whitened() {
        // Four poles at .85: v has 1.6e4 times the power of eps, and its spectrum falls by 5e8 up to half the sampling
        // frequency. With a prior that scales with the power of v, D would not follow the remnant there.
        let (mut model, mut seed) = (NoiseModel::new(8, 100.0, 0.01).unwrap(), 3);
        let (mut v, mut poles, mut power) = ([0.0; LAG_COUNT], [0.0; 4], 0.0);
        for t in 0..20_000 {
            let mut z = uniform_noise(&mut seed);
            for pole in &mut poles {
                z += 0.85 * *pole;
                *pole = z;
            }
            v.copy_within(0..LAG_COUNT - 1, 1);
            v[0] = z;
            let eps = v[0] + model.d().iter().zip(&v[1..]).map(|(d, v)| d * v).sum::<f64>();
            if t >= 10_000 {
                power += eps * eps / 10_000.0;
            }
            model.update(&v, eps, 1.0);
            if t % 25 == 24 {
                model.solve();
            }
        }
        // The power is 1/12 with a standard error of .9 %, plus a share of 8/5556 due to the errors of D.
        assert!((12.0 * power - 1.0).abs() < 0.04, "{power}");
    }

    #[test]
    fn covariance_of_d_matches_the_scatter() {
        // Squared errors of four coefficients in 100 runs, divided by their variances: their mean has a standard error
        // of .07, or .14 if the four were fully correlated. This is tested while the memory grows and when it has its
        // full length.
        for memory in [1000.0, 10.0] {
            let (mut squares, mut seed) = (0.0, 11);
            for _ in 0..100 {
                let (mut model, mut v) = (NoiseModel::new(4, memory, 0.01).unwrap(), [0.0; LAG_COUNT]);
                for _ in 0..5000 {
                    v.copy_within(0..LAG_COUNT - 1, 1);
                    let eps = uniform_noise(&mut seed);
                    v[0] = 1.55 * v[1] - 0.57 * v[2] + eps;
                    model.update(&v, eps, 1.0);
                }
                model.solve();
                let covariance = model.covariance().unwrap();
                for (i, expected) in [-1.55, 0.57, 0.0, 0.0].into_iter().enumerate() {
                    squares += (model.d()[i] - expected).powi(2) / covariance[i][i] / 400.0;
                }
            }
            assert!((0.58..1.42).contains(&squares), "{memory}: {squares}");
        }
        assert!(NoiseModel::new(4, 40.0, 0.01).unwrap().covariance().is_none());
    }

    #[test]
    fn prior_remnant_is_used_first_and_forgotten_with_data() {
        // An autoregression of order 1 with the pole .9 has the autocovariances .9^k/(1 - .81).
        let (mut model, mut seed) = (NoiseModel::new(6, 40.0, 0.01).unwrap(), 5);
        let lags: Lags = core::array::from_fn(|k| 0.9_f64.powi(k as i32) / 0.19);
        assert!(model.set_prior(&lags, 1.0 / 12.0, 2000.0));
        assert!(
            (model.d()[0] + 0.9).abs() < 1e-3 && model.d()[1].abs() < 1e-3,
            "{:?}",
            model.d()
        );
        let mut v = [0.0; LAG_COUNT];
        for _ in 0..40_000 {
            v.copy_within(0..LAG_COUNT - 1, 1);
            let eps = uniform_noise(&mut seed);
            v[0] = 0.5 * v[1] + eps;
            model.update(&v, eps, 1.0);
        }
        model.solve();
        // 4000 samples are ten memories: the prior is forgotten, and d1 has a standard error of .01.
        assert!((model.d()[0] + 0.5).abs() < 0.05, "{:?}", model.d());
        let mut other = NoiseModel::new(6, 40.0, 0.01).unwrap();
        assert!(!other.set_prior(&[0.0; LAG_COUNT], 1.0, 2000.0) && !other.set_prior(&lags, 1.0, f64::NAN));
    }

    #[test]
    fn zero_signals_keep_the_prior_model() {
        let mut model = NoiseModel::new(4, 40.0, 0.01).unwrap();
        let before = model.d().to_vec();
        for _ in 0..1000 {
            model.update(&[0.0; LAG_COUNT], 0.0, 1.0);
            model.solve();
        }
        for (d, b) in model.d().iter().zip(&before) {
            assert!((d - b).abs() < 1e-9);
        }
        assert!(NoiseModel::new(1, 40.0, 0.01).is_none() && NoiseModel::new(25, 40.0, 0.01).is_none());
        assert!(NoiseModel::new(4, f64::NAN, 0.01).is_none());
    }
}
