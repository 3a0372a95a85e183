//! One-step predictor of the general model, sample by sample, and its gradient.
//!
//! For `A u = (B/F) q^-nk e + (C/D) eps` (eq. 5.1) with the input `x(t) = e(t - nk)`,
//!
//! `w = B x - (F - 1) w`,  `v = A u - w`,  `eps = D v - (C - 1) eps`,
//!
//! and the negative gradient `psi = -d eps/d theta`
//!
//! | parameter | psi(t) |
//! |---|---|
//! | `a_j` | `-(D/C) u(t-j)` |
//! | `b_j` | `(D/(C F)) x(t-j)` |
//! | `c_j` | `(1/C) eps(t-j)` |
//! | `d_j` | `-(1/C) v(t-j)` |
//! | `f_j` | `-(D/(C F)) w(t-j)` |
//!
//! Each filter uses the coefficients of the current estimate; for a constant theta, eps and psi equal those of the
//! batch criterion started at rest. `D/(C F)` is **one filter in direct form**,
//! `y(t) = x(t) + sum d_j x(t-j) - sum g_j y(t-j)` with `G = C F`. A cascade of `1/F` followed by `D/C` is the same
//! filter only for a constant theta, since time-varying filters do not commute. Its inner signal `x/F` depends on the F
//! of earlier estimates until the poles of F have forgotten them, and the current D no longer cancels these poles. Near
//! the unit circle psi is then wrong for as long as theta changes ([`Regressor::Cascade`], for comparison).
//!
//! After the estimate has been updated, w, v and eps of the sample are computed again with the new estimate
//! ([`Predictor::correct`]). With these a-posteriori residuals the recursion converges faster (L. Ljung and T.
//! Söderström, *Theory and Practice of Recursive Identification*, 1983, section 3.7.3 and eq. 3.151).
//!
//! Further inputs I add their responses to w and their coefficients to the end of theta ([`crate::further_input`]).
//!
//! The last L samples of the input are stored, so B can start at any `offset` within them, and a delay can be changed
//! without a transient. N is the capacity for parameters.

use core::hint::black_box;

use hoid_numerics::products::dot;

use crate::{
    filter::{product, push},
    further_input::{FurtherInputs, NoFurtherInputs, NoiseFilters},
    sensitivities::{ErrorLayout, LinearForm, Sensitivities},
    shape::Shape,
};

/// Signals from which psi is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Regressor {
    /// Gradient of the prediction error, for the prediction-error method.
    #[default]
    Gradient,
    /// Gradient with `D/(C F)` as a cascade, `1/F` followed by `D/C`, for comparison. It equals the gradient above for
    /// a constant theta; while theta changes, the recursion converges more slowly with it.
    Cascade,
    /// Unfiltered signals: pseudo-linear regression, also called extended least squares (Ljung and Söderström, section
    /// 3.7.4). It needs fewer operations. Convergence is guaranteed only if `1/C - 1/2` (`1/F - 1/2` for an
    /// output-error model) is positive real.
    PseudoLinear,
}

/// State of the filters. The histories contain the newest value first.
#[derive(Debug, Clone, PartialEq)]
pub struct Predictor<S, const N: usize, const L: usize, I = NoFurtherInputs> {
    shape: S,
    further: I,
    regressor: Regressor,
    offset: usize,
    x: [f64; L],
    /// `(D/(C F)) x`.
    filtered_x: [f64; L],
    /// `x/F`, used by the cascade only.
    x_over_f: [f64; N],
    u: [f64; N],
    w: [f64; N],
    v: [f64; N],
    eps: [f64; N],
    /// `(D/C) u`, `eps/C`, `v/C`, `w/F` (used by the cascade only) and `(D/(C F)) w`.
    filtered_u: [f64; N],
    filtered_eps: [f64; N],
    filtered_v: [f64; N],
    w_over_f: [f64; N],
    filtered_w: [f64; N],
    /// Output and `x/F` of the sample that has been predicted but not yet corrected.
    pending: [f64; 2],
}

crate::state!([S, const N: usize, const L: usize, I: crate::state::State] Predictor<S, N, L, I> {
    x, filtered_x, x_over_f, u, w, v, eps, filtered_u, filtered_eps, filtered_v, w_over_f, filtered_w, pending, further,
});

impl<S: Shape, const N: usize, const L: usize> Predictor<S, N, L> {
    /// Builds the predictor of a model with one input, with all filters at rest. Returns `None` if the shape exceeds
    /// the capacities N or L, or has no parameter.
    pub fn new(shape: S, regressor: Regressor) -> Option<Self> {
        Self::with_further_inputs(shape, regressor, NoFurtherInputs)
    }
}

impl<S: Shape, const N: usize, const L: usize, I: FurtherInputs<N>> Predictor<S, N, L, I> {
    /// Like [`Predictor::new`], with further inputs.
    pub fn with_further_inputs(shape: S, regressor: Regressor, further: I) -> Option<Self> {
        let inputs = shape.nb().max(shape.nd() + 1).max(shape.nc() + shape.nf());
        let parameters = shape.parameter_count() + further.parameter_count();
        let fits = (1..=N).contains(&parameters) && (shape.nb() == 0 || inputs <= L);
        fits.then_some(Self {
            shape,
            further,
            regressor,
            offset: 0,
            x: [0.0; L],
            filtered_x: [0.0; L],
            x_over_f: [0.0; N],
            u: [0.0; N],
            w: [0.0; N],
            v: [0.0; N],
            eps: [0.0; N],
            filtered_u: [0.0; N],
            filtered_eps: [0.0; N],
            filtered_v: [0.0; N],
            w_over_f: [0.0; N],
            filtered_w: [0.0; N],
            pending: [0.0; 2],
        })
    }

    /// Returns the further inputs.
    pub fn further_inputs(&self) -> &I {
        &self.further
    }

    /// Returns the further inputs, for the values of the next sample.
    pub fn further_inputs_mut(&mut self) -> &mut I {
        &mut self.further
    }

    /// Returns the orders of the model in the first input.
    pub fn shape(&self) -> S {
        self.shape
    }

    /// Makes B start `offset` samples before the newest input, limited to the stored inputs. The offset has an effect
    /// only if L is larger than N.
    pub fn set_offset(&mut self, offset: usize) {
        self.offset = offset.min(L - self.shape.nb().min(L));
    }

    /// Resets all filters to rest; the offset of B does not change.
    #[cold]
    #[inline(never)]
    pub fn reset(&mut self) {
        self.further.reset();
        let histories = [&mut self.x, &mut self.filtered_x];
        histories.into_iter().for_each(|history| *history = [0.0; L]);
        let histories = [
            &mut self.x_over_f,
            &mut self.u,
            &mut self.w,
            &mut self.v,
            &mut self.eps,
            &mut self.filtered_u,
            &mut self.filtered_eps,
            &mut self.filtered_v,
            &mut self.w_over_f,
            &mut self.filtered_w,
        ];
        histories.into_iter().for_each(|history| *history = [0.0; N]);
        self.pending = [0.0; 2];
    }

    /// Offset of B. If B cannot shift, the offset is the constant zero at compile time.
    #[inline(always)]
    fn offset(&self) -> usize {
        if L > N { self.offset } else { 0 }
    }

    /// Predicts the sample `x(t) = e(t - nk)`, `u(t)`; returns psi and the a-priori innovation.
    #[inline(always)]
    pub fn predict(&mut self, theta: &[f64; N], x: f64, u: f64) -> ([f64; N], f64) {
        let shape = self.shape;
        let [_, _, c, d, f] = shape.split(theta);
        let offset = self.offset();
        // If B cannot shift, only the inputs that the coefficients of B and D multiply are stored.
        let (input, output) = if L > N {
            (L, L)
        } else {
            (shape.nb().max(shape.nd() + 1), shape.nb().max(shape.nc() + shape.nf()))
        };
        self.pending[0] = u;
        if shape.nb() > 0 {
            match self.regressor {
                Regressor::Gradient => {
                    let g: [f64; N] = product(c, f);
                    let poles = dot_with_recent(&g[..c.len() + f.len()], &self.filtered_x);
                    let filtered = x + dot(d, &self.x) - poles;
                    push(&mut self.filtered_x, output, filtered);
                }
                Regressor::Cascade => {
                    let over_f = x - dot_with_recent(f, &self.x_over_f);
                    let filtered = over_f + dot(d, &self.x_over_f) - dot(c, &self.filtered_x);
                    self.pending[1] = over_f;
                    push(&mut self.filtered_x, output, filtered);
                }
                Regressor::PseudoLinear => {}
            }
        }
        push(&mut self.x, input, x);
        let mut psi = if self.regressor != Regressor::PseudoLinear {
            let of = [&self.filtered_u, &self.filtered_eps, &self.filtered_v, &self.filtered_w];
            gather(&shape, &self.filtered_x[offset..], of)
        } else {
            let of = [&self.u, &self.eps, &self.v, &self.w];
            gather(&shape, &self.x[offset..], of)
        };
        let first = shape.parameter_count();
        let noise = self.noise_filters(c, d);
        self.further.predict(&theta[first..], noise, &mut psi[first..]);
        (psi, self.residual(theta)[2])
    }

    #[inline(always)]
    fn noise_filters<'a>(&self, c: &'a [f64], d: &'a [f64]) -> NoiseFilters<'a> {
        let filtered = self.regressor != Regressor::PseudoLinear;
        NoiseFilters { c, d, filtered }
    }

    /// Returns `[w, v, eps]` of the pending sample at theta.
    #[inline(always)]
    fn residual(&self, theta: &[f64; N]) -> [f64; 3] {
        let [a, b, c, d, f] = self.shape.split(theta);
        let w = dot(b, &self.x[self.offset()..]) - dot(f, &self.w);
        let all = self.further.add_responses(&theta[self.shape.parameter_count()..], w);
        let v = self.pending[0] + dot(a, &self.u) - all;
        [w, v, v + dot(d, &self.v) - dot(c, &self.eps)]
    }

    /// Advances the filters by the predicted sample with the updated estimate theta, and returns the a-posteriori
    /// residual.
    #[inline(always)]
    pub fn correct(&mut self, theta: &[f64; N]) -> f64 {
        let shape = self.shape;
        let [w, v, eps] = self.residual(theta);
        let u = self.pending[0];
        let [_, _, c, d, f] = shape.split(theta);
        let cascade = self.regressor == Regressor::Cascade;
        if self.regressor != Regressor::PseudoLinear {
            if shape.na() > 0 {
                let filtered = u + dot(d, &self.u) - dot(c, &self.filtered_u);
                push(&mut self.filtered_u, shape.na().max(shape.nc()), filtered);
            }
            if cascade && shape.nb() > 0 {
                push(&mut self.x_over_f, shape.nf().max(shape.nd()), self.pending[1]);
            }
            if shape.nc() > 0 {
                let filtered = eps - dot(c, &self.filtered_eps);
                push(&mut self.filtered_eps, shape.nc(), filtered);
            }
            if shape.nd() > 0 {
                let filtered = v - dot(c, &self.filtered_v);
                push(&mut self.filtered_v, shape.nd().max(shape.nc()), filtered);
            }
            if shape.nf() > 0 {
                let filtered = if cascade {
                    let over_f = w - dot(f, &self.w_over_f);
                    let filtered = over_f + dot(d, &self.w_over_f) - dot(c, &self.filtered_w);
                    push(&mut self.w_over_f, shape.nf().max(shape.nd()), over_f);
                    filtered
                } else {
                    let g: [f64; N] = product(c, f);
                    w + dot(d, &self.w) - dot(&g[..c.len() + f.len()], &self.filtered_w)
                };
                push(&mut self.filtered_w, shape.nf() + shape.nc(), filtered);
            }
        }
        let noise = self.noise_filters(c, d);
        self.further.correct(&theta[shape.parameter_count()..], noise);
        if shape.na() > 0 {
            push(&mut self.u, shape.na().max(shape.nd()), u);
        }
        if shape.nf() > 0 {
            push(&mut self.w, shape.nf().max(shape.nd()), w);
        }
        if shape.nd() > 0 {
            push(&mut self.v, shape.nd(), v);
        }
        if shape.nc() > 0 {
            push(&mut self.eps, shape.nc(), eps);
        }
        eps
    }

    /// Replaces the missing output of the pending sample by its one-step prediction.
    pub fn bridge(&mut self, theta: &[f64; N]) {
        self.pending[0] = 0.0;
        // The residual is the output minus its prediction, so at an output of zero it is the negative prediction.
        self.pending[0] = -self.residual(theta)[2];
    }

    /// Returns the sensitivities of dw, dv and de of the pending sample to the errors X of
    /// [`crate::error_bars`].
    #[inline(always)]
    pub fn sensitivities<const K: usize>(&self, theta: &[f64; N], layout: &ErrorLayout) -> Sensitivities<N, K> {
        let shape = self.shape;
        let (na, nb, nc, nd, nf) = (shape.na(), shape.nb(), shape.nc(), shape.nd(), shape.nf());
        let [_, _, c, d, f] = shape.split(theta);
        let mut w = LinearForm {
            theta: [0.0; N],
            filters: [0.0; K],
        };
        for j in 0..nb {
            w.theta[na + j] = self.x[self.offset() + j];
        }
        for j in 0..nf {
            w.theta[na + nb + nc + nd + j] = -self.w[j];
            w.filters[layout.w.0 + j] = -f[j];
        }
        let mut v = w;
        for j in 0..na {
            v.theta[j] = -self.u[j];
        }
        let mut e = v;
        let of_v = if na == 0 { layout.w.0 } else { layout.v.0 };
        for j in 0..nd {
            e.theta[na + nb + nc + j] = -self.v[j];
            e.filters[of_v + j] += d[j];
        }
        for j in 0..nc {
            e.theta[na + nb + j] = self.eps[j];
            e.filters[layout.e.0 + j] = -c[j];
        }
        Sensitivities { w, v, e }
    }
}

/// Product of coefficients and a history whose numbers were stored one by one just before.
///
/// Each number is read separately. A wide load right after several narrow stores would wait until all stores have
/// reached the memory, so successive samples could not overlap. The compiler tends to generate such loads.
#[inline(always)]
fn dot_with_recent(coefficients: &[f64], history: &[f64]) -> f64 {
    let mut pairs = coefficients.iter().zip(history);
    let Some((c, h)) = pairs.next() else {
        return 0.0;
    };
    let mut sum = c * black_box(*h);
    for (c, h) in pairs {
        sum += c * black_box(*h);
    }
    sum
}

/// Returns psi, assembled from the histories of x, u, eps, v and w.
// Each number is moved separately, since a wide copy of numbers just stored would wait as in [`dot_with_recent`].
#[allow(clippy::manual_memcpy)]
#[inline(always)]
fn gather<S: Shape, const N: usize>(shape: &S, x: &[f64], [u, eps, v, w]: [&[f64; N]; 4]) -> [f64; N] {
    let mut psi = [0.0; N];
    let (psi_a, rest) = psi.split_at_mut(shape.na());
    let (psi_b, rest) = rest.split_at_mut(shape.nb());
    let (psi_c, rest) = rest.split_at_mut(shape.nc());
    let (psi_d, rest) = rest.split_at_mut(shape.nd());
    let psi_f = &mut rest[..shape.nf()];
    for j in 0..shape.na() {
        psi_a[j] = -u[j];
    }
    for j in 0..shape.nb() {
        psi_b[j] = x[j];
    }
    for j in 0..shape.nc() {
        psi_c[j] = eps[j];
    }
    for j in 0..shape.nd() {
        psi_d[j] = -v[j];
    }
    for j in 0..shape.nf() {
        psi_f[j] = -w[j];
    }
    psi
}
