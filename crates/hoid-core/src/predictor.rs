//! The one-step predictor of the general model, sample by sample, and its gradient.
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
//! Each filter works with the coefficients of its time; for a theta that stays, eps and psi are those of the batch criterion started at
//! rest. After the estimate has moved, w, v and eps of the sample are computed again with it ([`Predictor::correct`]): the
//! a-posteriori residuals, with which the recursion converges faster (L. Ljung and T. Söderström, *Theory and Practice of Recursive
//! Identification*, 1983, section 3.7.3 and eq. 3.151).
//!
//! The input is kept over L samples, so that B may begin at any `offset` within them: a delay can be changed without a transient.
//! N is the room for parameters; every order fits in it.

use crate::{
    error_bars::{Places, Row, Sensitivities},
    number::Number,
};

/// Numbers of coefficients of A, B, C, D and F.
///
/// [`AnyShape`] holds them as numbers. [`FixedShape`] has them in its type, so that the compiler writes out every loop over
/// coefficients: the same operations in the same order, at half the time.
pub trait Shape: Copy {
    /// Coefficients `a_1 ...`.
    fn na(&self) -> usize;
    /// Coefficients `b_0 ...`.
    fn nb(&self) -> usize;
    /// Coefficients `c_1 ...`.
    fn nc(&self) -> usize;
    /// Coefficients `d_1 ...`.
    fn nd(&self) -> usize;
    /// Coefficients `f_1 ...`.
    fn nf(&self) -> usize;

    /// Length of `theta = [a.. b.. c.. d.. f..]`.
    #[inline]
    fn parameters(&self) -> usize {
        self.na() + self.nb() + self.nc() + self.nd() + self.nf()
    }

    /// `[a, b, c, d, f]` of theta.
    #[inline]
    fn split<'t, R>(&self, theta: &'t [R]) -> [&'t [R]; 5] {
        let (a, rest) = theta.split_at(self.na());
        let (b, rest) = rest.split_at(self.nb());
        let (c, rest) = rest.split_at(self.nc());
        let (d, rest) = rest.split_at(self.nd());
        [a, b, c, d, &rest[..self.nf()]]
    }
}

/// Orders as numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AnyShape {
    /// Coefficients `a_1 ...`.
    pub na: usize,
    /// Coefficients `b_0 ...`.
    pub nb: usize,
    /// Coefficients `c_1 ...`.
    pub nc: usize,
    /// Coefficients `d_1 ...`.
    pub nd: usize,
    /// Coefficients `f_1 ...`.
    pub nf: usize,
}

impl Shape for AnyShape {
    #[inline]
    fn na(&self) -> usize {
        self.na
    }

    #[inline]
    fn nb(&self) -> usize {
        self.nb
    }

    #[inline]
    fn nc(&self) -> usize {
        self.nc
    }

    #[inline]
    fn nd(&self) -> usize {
        self.nd
    }

    #[inline]
    fn nf(&self) -> usize {
        self.nf
    }
}

/// Orders in the type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FixedShape<const NA: usize, const NB: usize, const NC: usize, const ND: usize, const NF: usize>;

impl<const NA: usize, const NB: usize, const NC: usize, const ND: usize, const NF: usize> Shape
    for FixedShape<NA, NB, NC, ND, NF>
{
    #[inline]
    fn na(&self) -> usize {
        NA
    }

    #[inline]
    fn nb(&self) -> usize {
        NB
    }

    #[inline]
    fn nc(&self) -> usize {
        NC
    }

    #[inline]
    fn nd(&self) -> usize {
        ND
    }

    #[inline]
    fn nf(&self) -> usize {
        NF
    }
}

/// What psi is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Regressor {
    /// The gradient: prediction-error method.
    #[default]
    Gradient,
    /// The signals without their filters: pseudo-linear regression, also called extended least squares (Ljung and Söderström,
    /// section 3.7.4). Fewer operations; it converges where 1/C (1/F ...) is positive real.
    PseudoLinear,
}

/// State of the filters, of one run or of several side by side. Histories hold the newest value first.
#[derive(Debug, Clone, PartialEq)]
pub struct Predictor<S, const N: usize, const L: usize, R = f64> {
    shape: S,
    regressor: Regressor,
    offset: usize,
    x: [R; L],
    /// `(D/(C F)) x`.
    filtered_x: [R; L],
    /// `x/F`.
    x_over_f: [R; N],
    u: [R; N],
    w: [R; N],
    v: [R; N],
    eps: [R; N],
    /// `(D/C) u`, `eps/C`, `v/C`, `w/F` and `(D/(C F)) w`.
    filtered_u: [R; N],
    filtered_eps: [R; N],
    filtered_v: [R; N],
    w_over_f: [R; N],
    filtered_w: [R; N],
    /// The output and `x/F` of the sample that was predicted and not yet corrected.
    pending: [R; 2],
}

crate::state!([S, const N: usize, const L: usize] Predictor<S, N, L> {
    x, filtered_x, x_over_f, u, w, v, eps, filtered_u, filtered_eps, filtered_v, w_over_f, filtered_w, pending,
});

/// `sum_j c_j h_j` over the coefficients; `zero` where there is none.
#[inline(always)]
pub(crate) fn dot<R: Number>(zero: R, coefficients: &[R], history: &[R]) -> R {
    // Not from zero: every addition is one more that the next sample waits for.
    let mut pairs = coefficients.iter().zip(history);
    let Some((c, h)) = pairs.next() else {
        return zero;
    };
    let mut sum = *c * *h;
    for (c, h) in pairs {
        sum = sum + *c * *h;
    }
    sum
}

/// The same, of a history that the sample before has pushed into number by number; see [`Number::apart`].
#[inline(always)]
fn dot_apart<R: Number>(zero: R, coefficients: &[R], history: &[R]) -> R {
    let mut pairs = coefficients.iter().zip(history);
    let Some((c, h)) = pairs.next() else {
        return zero;
    };
    let mut sum = *c * h.apart();
    for (c, h) in pairs {
        sum = sum + *c * h.apart();
    }
    sum
}

/// Puts a value in front of the n newest ones.
#[inline(always)]
fn push<R: Copy>(history: &mut [R], n: usize, value: R) {
    if n > 0 {
        history.copy_within(0..n - 1, 1);
        history[0] = value;
    }
}

/// psi of the histories of x and of u, eps, v and w.
// One move for each number: a wide copy of what was just pushed would wait as in `dot_apart`.
#[allow(clippy::manual_memcpy)]
#[inline(always)]
fn regressor<S: Shape, R: Number, const N: usize>(shape: &S, zero: R, x: &[R], [u, eps, v, w]: [&[R; N]; 4]) -> [R; N] {
    let mut psi = [zero; N];
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

impl<S: Shape, const N: usize, const L: usize> Predictor<S, N, L> {
    /// All filters at rest. `None` when the shape does not fit in N and L, or has no parameter.
    pub fn new(shape: S, regressor: Regressor) -> Option<Self> {
        Self::at_rest(shape, regressor, 0.0)
    }

    /// How dw, dv and de of the pending sample follow from the errors X of [`crate::error_bars`].
    #[inline(always)]
    pub fn sensitivities<const K: usize>(&self, theta: &[f64; N], places: &Places) -> Sensitivities<N, K> {
        let shape = self.shape;
        let (na, nb, nc, nd, nf) = (shape.na(), shape.nb(), shape.nc(), shape.nd(), shape.nf());
        let [_, _, c, d, f] = shape.split(theta);
        let mut w = Row {
            theta: [0.0; N],
            filters: [0.0; K],
        };
        for j in 0..nb {
            w.theta[na + j] = self.x[self.offset() + j];
        }
        for j in 0..nf {
            w.theta[na + nb + nc + nd + j] = -self.w[j];
            w.filters[places.w.0 + j] = -f[j];
        }
        let mut v = w;
        for j in 0..na {
            v.theta[j] = -self.u[j];
        }
        let mut e = v;
        let of_v = if na == 0 { places.w.0 } else { places.v.0 };
        for j in 0..nd {
            e.theta[na + nb + nc + j] = -self.v[j];
            e.filters[of_v + j] += d[j];
        }
        for j in 0..nc {
            e.theta[na + nb + j] = self.eps[j];
            e.filters[places.e.0 + j] = -c[j];
        }
        Sensitivities { w, v, e }
    }

    /// Puts the one-step prediction in the place of the pending output, which is missing.
    pub fn bridge(&mut self, theta: &[f64; N]) {
        self.pending[0] = 0.0;
        // eps is the output less its prediction.
        self.pending[0] = -self.residual(theta)[2];
    }
}

impl<S: Shape, const N: usize, const L: usize, R: Number> Predictor<S, N, L, R> {
    /// All filters at rest, with the zero of the numbers. `None` when the shape does not fit in N and L, or has no parameter.
    pub fn at_rest(shape: S, regressor: Regressor, zero: R) -> Option<Self> {
        let fits = (1..=N).contains(&shape.parameters()) && shape.nb().max(shape.nc()) <= L;
        fits.then_some(Self {
            shape,
            regressor,
            offset: 0,
            x: [zero; L],
            filtered_x: [zero; L],
            x_over_f: [zero; N],
            u: [zero; N],
            w: [zero; N],
            v: [zero; N],
            eps: [zero; N],
            filtered_u: [zero; N],
            filtered_eps: [zero; N],
            filtered_v: [zero; N],
            w_over_f: [zero; N],
            filtered_w: [zero; N],
            pending: [zero; 2],
        })
    }

    /// Orders.
    pub fn shape(&self) -> S {
        self.shape
    }

    /// Lets B begin `offset` samples after x(t), as far as the kept input reaches; it reaches where L is larger than N.
    pub fn set_offset(&mut self, offset: usize) {
        self.offset = offset.min(L - self.shape.nb().min(L));
    }

    /// Brings all filters to rest.
    #[cold]
    #[inline(never)]
    pub fn rest(&mut self) {
        let offset = self.offset;
        if let Some(rested) = Self::at_rest(self.shape, self.regressor, self.zero()) {
            *self = rested;
            self.offset = offset;
        }
    }

    /// Brings the filters of one lane to rest.
    pub fn rest_lane(&mut self, lane: usize) {
        let of_input = [&mut self.x, &mut self.filtered_x];
        let of_filters = [
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
        let all = of_input.into_iter().flatten().chain(of_filters.into_iter().flatten());
        for value in all.chain(&mut self.pending) {
            value.set_lane(lane, 0.0);
        }
    }

    #[inline(always)]
    fn zero(&self) -> R {
        self.pending[0].like(0.0)
    }

    /// Where B begins. Without room for shifts it is at the newest input, which the compiler then knows.
    #[inline(always)]
    fn offset(&self) -> usize {
        if L > N { self.offset } else { 0 }
    }

    /// psi, and the a-priori innovation of the sample `x(t) = e(t - nk)`, `u(t)`.
    #[inline(always)]
    pub fn predict(&mut self, theta: &[R; N], x: R, u: R) -> ([R; N], R) {
        let (shape, zero) = (self.shape, self.zero());
        let [_, _, c, d, f] = shape.split(theta);
        let offset = self.offset();
        // Without a room for shifts of B, its own coefficients are all that is kept.
        let input = if L > N { L } else { shape.nb() };
        push(&mut self.x, input, x);
        self.pending[0] = u;
        let gradient = self.regressor == Regressor::Gradient;
        if gradient && shape.nb() > 0 {
            let over_f = x - dot_apart(zero, f, &self.x_over_f);
            let filtered = over_f + dot(zero, d, &self.x_over_f) - dot(zero, c, &self.filtered_x);
            self.pending[1] = over_f;
            push(&mut self.filtered_x, input.max(shape.nc()), filtered);
        }
        let psi = if gradient {
            let of = [&self.filtered_u, &self.filtered_eps, &self.filtered_v, &self.filtered_w];
            regressor(&shape, zero, &self.filtered_x[offset..], of)
        } else {
            let of = [&self.u, &self.eps, &self.v, &self.w];
            regressor(&shape, zero, &self.x[offset..], of)
        };
        (psi, self.residual(theta)[2])
    }

    /// `[w, v, eps]` of the pending sample at theta.
    #[inline(always)]
    fn residual(&self, theta: &[R; N]) -> [R; 3] {
        let zero = self.zero();
        let [a, b, c, d, f] = self.shape.split(theta);
        let w = dot(zero, b, &self.x[self.offset()..]) - dot(zero, f, &self.w);
        let v = self.pending[0] + dot(zero, a, &self.u) - w;
        [w, v, v + dot(zero, d, &self.v) - dot(zero, c, &self.eps)]
    }

    /// Takes the predicted sample into the filters, with the estimate after it. Returns the a-posteriori residual.
    #[inline(always)]
    pub fn correct(&mut self, theta: &[R; N]) -> R {
        let (shape, zero) = (self.shape, self.zero());
        let [w, v, eps] = self.residual(theta);
        let u = self.pending[0];
        let [_, _, c, d, f] = shape.split(theta);
        if self.regressor == Regressor::Gradient {
            if shape.na() > 0 {
                let filtered = u + dot(zero, d, &self.u) - dot(zero, c, &self.filtered_u);
                push(&mut self.filtered_u, shape.na().max(shape.nc()), filtered);
            }
            if shape.nb() > 0 {
                push(&mut self.x_over_f, shape.nf().max(shape.nd()), self.pending[1]);
            }
            if shape.nc() > 0 {
                let filtered = eps - dot(zero, c, &self.filtered_eps);
                push(&mut self.filtered_eps, shape.nc(), filtered);
            }
            if shape.nd() > 0 {
                let filtered = v - dot(zero, c, &self.filtered_v);
                push(&mut self.filtered_v, shape.nd().max(shape.nc()), filtered);
            }
            if shape.nf() > 0 {
                let over_f = w - dot(zero, f, &self.w_over_f);
                let filtered = over_f + dot(zero, d, &self.w_over_f) - dot(zero, c, &self.filtered_w);
                push(&mut self.w_over_f, shape.nf().max(shape.nd()), over_f);
                push(&mut self.filtered_w, shape.nf().max(shape.nc()), filtered);
            }
        }
        if shape.na() > 0 {
            push(&mut self.u, shape.na().max(shape.nd()), u);
        }
        if shape.nf() > 0 {
            push(&mut self.w, shape.nf(), w);
        }
        if shape.nd() > 0 {
            push(&mut self.v, shape.nd(), v);
        }
        if shape.nc() > 0 {
            push(&mut self.eps, shape.nc(), eps);
        }
        eps
    }
}
