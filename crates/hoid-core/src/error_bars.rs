//! Covariance of a recursive estimate, for any gain.
//!
//! Let `theta~ = theta - theta^` be the error of the estimate of a constant theta. To first order the a-priori
//! innovation is `eps^ = eps + h' X`, where the vector X contains theta~ and the errors that past estimates have left
//! in the filters of the predictor,
//!
//! - `dw = w - w^ = b~' x - f~' w^ - (F^ - 1) dw`,
//! - `dv = v^ - v = dw - a~' u`,
//! - `de = eps^ - eps = D^ dv - d~' v^ + c~' eps^ - (C^ - 1) de`,
//!
//! (signals with a `~` are past signals, x includes the present sample; all three equations follow from eq. 5.4 by
//! subtraction). The vector `h` therefore contains the pseudo-linear regressor for theta~, `D^ - F^` for the past dw,
//! and `-(C^ - 1)` for the past de. With the step `theta^ <- theta^ + g eps^`
//!
//! `theta~ <- theta~ - g (eps + h' X)`,  `Sigma <- (I - g h') Sigma (I - g h')' + g g'`
//!
//! (the Joseph form, in units of sigma^2), after which the new dw, dv and de are stored in X. With `z = Sigma h` and
//! `k = z - (1 + h' z)/2 g` the update is `Sigma - g k' - k g'`. The row a of a new error differs from h in few
//! elements, so `Sigma a = z - Sigma (h - a)`, which shares two thirds of the products. No assumption is made about g.
//! The error bars are valid for a scalar forgetting factor, for which they tend to `P/(1 + lambda)` in the ARX case (L.
//! Ljung and T. Söderström, *Theory and Practice of Recursive Identification*, 1983, eq. 4.136), for a forgetting
//! matrix, a shortened step, or a gradient step. Without forgetting, `Sigma` becomes P. The default error bars use
//! `h = psi` and K = 0, so no filter errors are stored. They give the same result if the estimate hardly changes within
//! the memory of the filters. If the memory of the estimate is not much longer than the memory of 1/F, the variances of
//! the default are up to a third too small, but a step costs half as much.
//!
//! **Outliers.** An innovation beyond a limit of a few sigma changes the estimate as if it were at that limit (P. J.
//! Huber, *Robust Statistics*, 1981, section 7.3); the gain in the equations above is then the reduced gain that was
//! applied. The innovation variance uses the unclipped innovation, so it follows a lasting change in the noise.
//!
//! The innovation variance sigma^2 is the mean of `eps^2/(1 + h' Sigma h)`, whose terms each have the expected value
//! sigma^2.

use crate::{
    innovation_variance::InnovationVariance,
    sensitivities::{ErrorLayout, LinearForm, Sensitivities},
    state::State,
};

/// Largest variance of a parameter, relative to its initial variance; a parameter with this variance counts as unknown.
pub const MAX_VARIANCE_GROWTH: f64 = 1e6;
/// Number of samples between two checks of the variances.
const CHECK_PERIOD: u32 = 64;

/// Covariance Sigma in units of sigma^2, and sigma^2 itself. N is the capacity for parameters, K the capacity for the
/// errors of the filters ([`ErrorLayout::filter_error_count`]).
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorBars<const N: usize, const K: usize> {
    /// Covariance of theta, divided by sigma^2.
    theta: [[f64; N]; N],
    /// Covariance of each filter error with theta.
    cross: [[f64; N]; K],
    /// Covariance of the filter errors.
    filters: [[f64; K]; K],
    /// Initial variances of theta.
    initial_variances: [f64; N],
    innovation_variance: InnovationVariance,
    /// Multiple of sigma at which innovations are clipped.
    limit: f64,
    /// Number of samples until the next check of the variances.
    until_check: u32,
}

crate::state!([const N: usize, const K: usize] ErrorBars<N, K> {
    theta, cross, filters, initial_variances, innovation_variance, limit, until_check,
}, limit_restored);

/// Propagation of the error of an estimate through its recursion: [`ErrorBars`], or [`NoErrorBars`] if error bars are
/// not needed.
pub trait ErrorPropagation<const N: usize, const K: usize>: State {
    /// Returns the innovation, clipped at the limit for outliers.
    fn clip(&self, eps: f64) -> f64;
    /// Updates the covariance for a step of the estimate, given its gain and innovation, and adds the errors that the
    /// step leaves in the filters.
    fn update(&mut self, layout: &ErrorLayout, rows: &Sensitivities<N, K>, gain: &[f64; N], eps: f64);
    /// Adds the errors that a sample leaves in the filters if the estimate stays constant.
    fn propagate(&mut self, layout: &ErrorLayout, rows: &Sensitivities<N, K>);
    /// Adds the variance by which parameter i drifts per sample, unless its variance has reached `bound`.
    fn add_drift(&mut self, i: usize, variance: f64, bound: f64);
    /// Returns the innovation variance sigma^2, or `None` if it is not estimated.
    fn variance(&self) -> Option<f64>;
}

/// No error bars, no innovation variance and no limit on outliers: only the estimate is computed, at no additional
/// cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NoErrorBars;

impl State for NoErrorBars {
    fn visit(&mut self, _each: &mut dyn FnMut(&mut f64)) {}
}

impl<const N: usize> ErrorPropagation<N, 0> for NoErrorBars {
    #[inline(always)]
    fn clip(&self, eps: f64) -> f64 {
        eps
    }

    #[inline(always)]
    fn update(&mut self, _layout: &ErrorLayout, _rows: &Sensitivities<N, 0>, _gain: &[f64; N], _eps: f64) {}

    #[inline(always)]
    fn propagate(&mut self, _layout: &ErrorLayout, _rows: &Sensitivities<N, 0>) {}

    #[inline(always)]
    fn add_drift(&mut self, _i: usize, _variance: f64, _bound: f64) {}

    #[inline(always)]
    fn variance(&self) -> Option<f64> {
        None
    }
}

impl<const N: usize, const K: usize> ErrorBars<N, K> {
    fn limit_restored(&mut self) {
        self.until_check = self.until_check.clamp(1, CHECK_PERIOD);
    }

    /// Builds the error bars from `start`, the covariance of theta divided by the innovation variance; the past signals
    /// in the filters are assumed to be correct. Innovations larger than `limit` times sigma change the estimate as if
    /// they were at this limit; infinity means no limit.
    pub fn new(start: &[[f64; N]; N], innovation_variance: InnovationVariance, limit: f64) -> Self {
        Self {
            theta: *start,
            cross: [[0.0; N]; K],
            filters: [[0.0; K]; K],
            initial_variances: core::array::from_fn(|i| start[i][i]),
            innovation_variance,
            limit,
            until_check: CHECK_PERIOD,
        }
    }

    /// Returns `Sigma a`.
    #[inline(always)]
    fn times(&self, count: usize, a: &LinearForm<N, K>) -> ([f64; N], [f64; K]) {
        let (mut theta, mut filters) = ([0.0; N], [0.0; K]);
        for j in 0..N {
            for i in 0..N {
                theta[i] += self.theta[j][i] * a.theta[j];
            }
        }
        for c in 0..count {
            for i in 0..N {
                theta[i] += self.cross[c][i] * a.filters[c];
            }
            let mut sum = 0.0;
            for i in 0..N {
                sum += self.cross[c][i] * a.theta[i];
            }
            for d in 0..count {
                sum += self.filters[c][d] * a.filters[d];
            }
            filters[c] = sum;
        }
        (theta, filters)
    }

    /// Inserts the new dw, dv and de, each in front of the past errors of its kind, given `Sigma h`.
    #[inline(always)]
    fn insert(&mut self, layout: &ErrorLayout, rows: &Sensitivities<N, K>, z: [f64; N], z_filters: [f64; K]) {
        let (with_theta, with_filters) = self.covariances_of_new_errors(layout, rows, z, z_filters);
        let among = Self::covariances_among_new_errors(layout, rows, &with_theta, &with_filters);
        self.shift(layout);
        let kinds = [layout.w, layout.v, layout.e];
        for i in 0..3 {
            let (at, n) = kinds[i];
            if n == 0 {
                continue;
            }
            self.cross[at] = with_theta[i];
            let mut row = with_filters[i];
            for (j, (first, n)) in kinds.into_iter().enumerate() {
                for at in (first + 1..first + n).rev() {
                    row[at] = row[at - 1];
                }
                if n > 0 {
                    row[first] = among[i][j];
                }
            }
            self.filters[at] = row;
            for c in 0..layout.filter_error_count() {
                self.filters[c][at] = row[c];
            }
        }
    }

    /// Returns `Sigma a` for the rows a of the new dw, dv and de, computed from `Sigma h`: the covariances of the new
    /// errors with theta and with the past filter errors.
    #[inline(always)]
    fn covariances_of_new_errors(
        &self,
        layout: &ErrorLayout,
        rows: &Sensitivities<N, K>,
        z: [f64; N],
        z_filters: [f64; K],
    ) -> ([[f64; N]; 3], [[f64; K]; 3]) {
        let count = layout.filter_error_count();
        let kinds = [layout.w, layout.v];
        let new = [&rows.w, &rows.v];
        let mut with_theta = [z; 3];
        let mut with_filters = [z_filters; 3];
        for kind in 0..2 {
            if kinds[kind].1 == 0 {
                continue;
            }
            // The vector h and the row differ in the elements of A (for dw), of C and D, and of the filter errors.
            let of_a = if kind == 0 { layout.na } else { 0 };
            let (first, noise) = layout.noise;
            for j in (0..of_a).chain(first..first + noise) {
                let difference = rows.e.theta[j] - new[kind].theta[j];
                for i in 0..N {
                    with_theta[kind][i] -= self.theta[j][i] * difference;
                }
                for c in 0..count {
                    with_filters[kind][c] -= self.cross[c][j] * difference;
                }
            }
            for d in 0..count {
                let difference = rows.e.filters[d] - new[kind].filters[d];
                for i in 0..N {
                    with_theta[kind][i] -= self.cross[d][i] * difference;
                }
                for c in 0..count {
                    with_filters[kind][c] -= self.filters[c][d] * difference;
                }
            }
        }
        (with_theta, with_filters)
    }

    /// Covariances between the new dw, dv and de.
    #[inline(always)]
    fn covariances_among_new_errors(
        layout: &ErrorLayout,
        rows: &Sensitivities<N, K>,
        with_theta: &[[f64; N]; 3],
        with_filters: &[[f64; K]; 3],
    ) -> [[f64; 3]; 3] {
        let kinds = [layout.w, layout.v, layout.e];
        let new = [&rows.w, &rows.v, &rows.e];
        let mut among = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..=i {
                if kinds[i].1 > 0 && kinds[j].1 > 0 {
                    let mut sum = 0.0;
                    for k in 0..N {
                        sum += new[j].theta[k] * with_theta[i][k];
                    }
                    for k in 0..layout.filter_error_count() {
                        sum += new[j].filters[k] * with_filters[i][k];
                    }
                    among[i][j] = sum;
                    among[j][i] = sum;
                }
            }
        }
        among
    }

    /// Shifts the past errors by one sample and drops the oldest error of each kind.
    #[inline(always)]
    fn shift(&mut self, layout: &ErrorLayout) {
        let kinds = [layout.w, layout.v, layout.e];
        for (first, n) in kinds {
            for at in (first + 1..first + n).rev() {
                self.cross[at] = self.cross[at - 1];
                self.filters[at] = self.filters[at - 1];
            }
        }
        for (first, n) in kinds {
            for row in &mut self.filters[..layout.filter_error_count()] {
                for at in (first + 1..first + n).rev() {
                    row[at] = row[at - 1];
                }
            }
        }
    }

    /// Limits the variances to [`MAX_VARIANCE_GROWTH`] times their initial values, since the first-order equations can
    /// be unstable for large gains for which the recursion itself is stable. After an overflow all variances are set to
    /// this limit.
    #[cold]
    fn bound_variances(&mut self) {
        if !self.is_valid() {
            self.cross = [[0.0; N]; K];
            self.filters = [[0.0; K]; K];
            self.theta = [[0.0; N]; N];
            for i in 0..N {
                self.theta[i][i] = MAX_VARIANCE_GROWTH * self.initial_variances[i];
            }
        }
        for i in 0..N {
            let limit = MAX_VARIANCE_GROWTH * self.initial_variances[i];
            if self.initial_variances[i] > 0.0 && self.theta[i][i] > limit {
                let scale = libm::sqrt(limit / self.theta[i][i]);
                for j in 0..N {
                    self.theta[i][j] *= scale;
                    self.theta[j][i] *= scale;
                }
                for cross in &mut self.cross {
                    cross[i] *= scale;
                }
            }
        }
    }

    /// Returns the covariance of theta divided by sigma^2.
    pub fn normalised_covariance(&self) -> [[f64; N]; N] {
        self.theta
    }

    /// Returns the innovation variance sigma^2.
    #[inline(always)]
    pub fn innovation_variance(&self) -> f64 {
        self.innovation_variance.variance()
    }

    /// True if all numbers are finite.
    pub fn is_valid(&self) -> bool {
        let all = self.theta.iter().chain(&self.cross).flatten();
        let mut all = all.chain(self.filters.iter().flatten());
        all.all(|s| s.is_finite()) && self.innovation_variance.variance().is_finite()
    }
}

impl<const N: usize, const K: usize> ErrorPropagation<N, K> for ErrorBars<N, K> {
    #[inline(always)]
    fn clip(&self, eps: f64) -> f64 {
        if self.innovation_variance.is_beyond(eps, self.limit) {
            libm::copysign(self.limit * libm::sqrt(self.innovation_variance.variance()), eps)
        } else {
            eps
        }
    }

    #[inline(always)]
    fn update(&mut self, layout: &ErrorLayout, rows: &Sensitivities<N, K>, gain: &[f64; N], eps: f64) {
        let count = layout.filter_error_count();
        let (mut z, z_filters) = self.times(count, &rows.e);
        let mut along = 0.0;
        for i in 0..N {
            along += rows.e.theta[i] * z[i];
        }
        for i in 0..count {
            along += rows.e.filters[i] * z_filters[i];
        }
        self.innovation_variance.update(eps * eps / (1.0 + along.max(0.0)));
        let half = 0.5 * (1.0 + along);
        let mut k = z;
        for i in 0..N {
            k[i] -= half * gain[i];
        }
        // The result is exactly symmetric: exchanging i and j exchanges the two products.
        for i in 0..N {
            for j in 0..N {
                self.theta[i][j] -= gain[i] * k[j] + k[i] * gain[j];
            }
        }
        for c in 0..count {
            for i in 0..N {
                self.cross[c][i] -= gain[i] * z_filters[c];
            }
        }
        if count > 0 {
            // The product Sigma h after the update is z - g (k' h) - k (g' h).
            let (mut k_h, mut g_h) = (0.0, 0.0);
            for i in 0..N {
                k_h += k[i] * rows.e.theta[i];
                g_h += gain[i] * rows.e.theta[i];
            }
            for i in 0..count {
                k_h += z_filters[i] * rows.e.filters[i];
            }
            for i in 0..N {
                z[i] -= gain[i] * k_h + k[i] * g_h;
            }
            let z_filters = core::array::from_fn(|c| z_filters[c] * (1.0 - g_h));
            self.insert(layout, rows, z, z_filters);
        }
        self.until_check -= 1;
        if self.until_check == 0 {
            self.until_check = CHECK_PERIOD;
            self.bound_variances();
        }
    }

    #[inline]
    fn propagate(&mut self, layout: &ErrorLayout, rows: &Sensitivities<N, K>) {
        let count = layout.filter_error_count();
        if count > 0 {
            let (z, z_filters) = self.times(count, &rows.e);
            self.insert(layout, rows, z, z_filters);
        }
    }

    #[inline]
    fn add_drift(&mut self, i: usize, variance: f64, bound: f64) {
        if self.theta[i][i] < bound {
            self.theta[i][i] += variance;
        }
    }

    #[inline(always)]
    fn variance(&self) -> Option<f64> {
        Some(self.innovation_variance.variance())
    }
}
