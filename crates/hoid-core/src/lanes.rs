//! Recursions of several runs side by side, with one factor of forgetting and without error bars.
//!
//! [`RlsLanes`] and [`RpemLanes`] are [`crate::rls::Rls`] and [`crate::rpem::Rpem`] with [`crate::error_bars::NoBars`] and a
//! [`crate::adaptation::Covariance`] without bounds, over a [`Number`] that may hold a run in each of its lanes. Every lane has the bits of
//! its run alone. Loops instead of closures: a closure may stay a function of its own, for registers of the smallest width. What happens to few lanes at few samples (a shortened step, an overflow) is done for one lane after the other.

use crate::{
    adaptation::guard_period,
    factored::Factored,
    number::Number,
    predictor::{Predictor, Regressor, Shape, dot},
    recursion::{Stable, all_finite, allowed_share},
    stability::{MAX_ORDER, roots_inside},
};

/// P of each lane, and the factor of forgetting that they share.
#[derive(Debug, Clone)]
struct Memory<const N: usize, R> {
    factors: Factored<N, R>,
    /// P at the start.
    first: Factored<N, R>,
    growth: R,
    forgets: bool,
    period: u32,
    wait: u32,
}

impl<const N: usize, R: Number> Memory<N, R> {
    fn new(variances: [R; N], lambda: f64) -> Self {
        let factors = Factored::diagonal(variances);
        let period = guard_period(1.0 / (1.0 - lambda), N);
        Self {
            first: factors,
            factors,
            growth: variances[0].like(1.0 / lambda),
            forgets: lambda < 1.0,
            period,
            wait: period,
        }
    }

    #[inline(always)]
    fn gain(&mut self, psi: &[R; N]) -> [R; N] {
        if self.forgets {
            self.wait -= 1;
            if self.wait == 0 {
                self.wait = self.period;
                if !self.factors.all_sound() {
                    self.look();
                }
            }
        }
        self.factors.grow_and_measure(self.growth, psi, self.growth.like(1.0))
    }

    /// What an overflow has spoilt starts again.
    #[cold]
    #[inline(never)]
    fn look(&mut self) {
        for lane in 0..self.growth.lanes() {
            if !self.factors.lane(lane).is_sound() {
                self.factors.set_lane(lane, &self.first.lane(lane));
            }
        }
    }
}

/// True when every number in every lane is finite.
#[inline(always)]
fn sound<const N: usize, R: Number>(values: &[R; N]) -> bool {
    let zero = values[0].like(0.0);
    let mut sum = zero;
    // Zero times what is not finite is not a number.
    for v in values {
        sum = sum + zero * *v;
    }
    sum.all_below(zero.like(1.0))
}

fn lane_of<const N: usize, R: Number>(values: &[R; N], lane: usize) -> [f64; N] {
    values.map(|v| v.lane(lane))
}

fn set_lane<const N: usize, R: Number>(values: &mut [R; N], lane: usize, by: &[f64; N]) {
    for (value, by) in values.iter_mut().zip(by) {
        value.set_lane(lane, *by);
    }
}

/// True when the polynomial has its roots inside the unit circle in all lanes.
#[inline(always)]
fn inside<R: Number>(d: &[R]) -> bool {
    match *d {
        [] => true,
        [d1] => d1.abs().all_below(d1.like(1.0)),
        [d1, d2] => d2.abs().all_below(d2.like(1.0)) && d1.abs().all_below(d2.like(1.0) + d2),
        _ => inside_one_by_one(d),
    }
}

#[inline(never)]
fn inside_one_by_one<R: Number>(d: &[R]) -> bool {
    let mut polynomial = [0.0; MAX_ORDER];
    d.len() <= MAX_ORDER
        && (0..d[0].lanes()).all(|lane| {
            for (to, from) in polynomial.iter_mut().zip(d) {
                *to = from.lane(lane);
            }
            roots_inside(&polynomial[..d.len()], 1.0)
        })
}

/// Recursive least squares, a run in each lane.
#[derive(Debug, Clone)]
pub struct RlsLanes<S, const N: usize, R> {
    shape: S,
    theta: [R; N],
    psi: [R; N],
    memory: Memory<N, R>,
}

impl<S: Shape, const N: usize, R: Number> RlsLanes<S, N, R> {
    /// Starts from theta with P = diag(variances) and zeros before the first sample. `None` as in [`crate::rls::Rls::new`], or
    /// when lambda is not in (0, 1].
    pub fn new(shape: S, theta: [R; N], variances: [R; N], lambda: f64) -> Option<Self> {
        let linear = (shape.nc(), shape.nd(), shape.nf()) == (0, 0, 0);
        let usable = linear && (1..=N).contains(&shape.parameters()) && lambda > 0.0 && lambda <= 1.0;
        usable.then(|| Self {
            shape,
            psi: [theta[0].like(0.0); N],
            theta,
            memory: Memory::new(variances, lambda),
        })
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)` of each run and returns the a-priori innovations.
    #[inline(always)]
    pub fn step(&mut self, x: R, u: R) -> R {
        let (na, nb) = (self.shape.na(), self.shape.nb());
        let zero = x.like(0.0);
        let mut psi = self.psi;
        for j in (1..nb).rev() {
            psi[na + j] = psi[na + j - 1];
        }
        if nb > 0 {
            psi[na] = x;
        }
        let w = dot(zero, &self.theta[na..na + nb], &psi[na..]);
        let mut past = psi;
        for p in &mut past {
            *p = -*p;
        }
        let innovation = u + dot(zero, &self.theta[..na], &past) - w;
        let gain = self.memory.gain(&psi);
        let mut theta = self.theta;
        for i in 0..N {
            theta[i] = theta[i] + gain[i] * innovation;
        }
        for j in (1..na).rev() {
            psi[j] = psi[j - 1];
        }
        if na > 0 {
            psi[0] = -u;
        }
        if sound(&theta) {
            (self.theta, self.psi) = (theta, psi);
        } else {
            self.one_by_one(&theta, &psi);
        }
        innovation
    }

    #[cold]
    #[inline(never)]
    fn one_by_one(&mut self, theta: &[R; N], psi: &[R; N]) {
        for lane in 0..theta[0].lanes() {
            let moved = lane_of(theta, lane);
            if all_finite(&moved) {
                set_lane(&mut self.theta, lane, &moved);
                set_lane(&mut self.psi, lane, &lane_of(psi, lane));
            } else {
                set_lane(&mut self.psi, lane, &[0.0; N]);
            }
        }
    }

    /// theta of each run.
    #[inline(always)]
    pub fn theta(&self) -> &[R; N] {
        &self.theta
    }
}

/// The recursive prediction-error method, a run in each lane.
#[derive(Debug, Clone)]
pub struct RpemLanes<S, const N: usize, R> {
    predictor: Predictor<S, N, N, R>,
    stable: Stable,
    theta: [R; N],
    memory: Memory<N, R>,
}

impl<S: Shape, const N: usize, R: Number> RpemLanes<S, N, R> {
    /// Starts from `theta = [a.. b.. c.. d.. f..]` with P = diag(variances) and filters at rest. `None` as in
    /// [`crate::rpem::Rpem::new`], or when lambda is not in (0, 1].
    pub fn new(shape: S, stable: Stable, theta: [R; N], variances: [R; N], lambda: f64) -> Option<Self> {
        let predictor = Predictor::at_rest(shape, Regressor::Gradient, theta[0].like(0.0))?;
        let starts = (0..theta[0].lanes()).all(|lane| stable.holds(&shape, &lane_of(&theta, lane)));
        (starts && lambda > 0.0 && lambda <= 1.0).then(|| Self {
            predictor,
            stable,
            theta,
            memory: Memory::new(variances, lambda),
        })
    }

    /// Takes a sample `x(t) = e(t - nk)`, `u(t)` of each run and returns the a-priori innovations.
    #[inline(always)]
    pub fn step(&mut self, x: R, u: R) -> R {
        let shape = self.predictor.shape();
        let (psi, innovation) = self.predictor.predict(&self.theta, x, u);
        let mut step = self.memory.gain(&psi);
        let mut whole = self.theta;
        for i in 0..N {
            step[i] = step[i] * innovation;
            whole[i] = whole[i] + step[i];
        }
        let [_, _, c, d, f] = shape.split(&whole);
        if sound(&whole) && inside(c) && inside(f) && (self.stable == Stable::Predictor || inside(d)) {
            self.theta = whole;
        } else {
            self.one_by_one(&step);
        }
        let residual = self.predictor.correct(&self.theta);
        if !sound(&[residual]) {
            self.rest(residual);
        }
        innovation
    }

    #[cold]
    #[inline(never)]
    fn one_by_one(&mut self, step: &[R; N]) {
        let (shape, stable) = (self.predictor.shape(), self.stable);
        for lane in 0..step[0].lanes() {
            let (theta, step) = (lane_of(&self.theta, lane), lane_of(step, lane));
            let (_, moved) = allowed_share(&theta, &step, |theta| stable.holds(&shape, theta));
            set_lane(&mut self.theta, lane, &moved);
        }
    }

    #[cold]
    #[inline(never)]
    fn rest(&mut self, residual: R) {
        for lane in 0..residual.lanes() {
            if !residual.lane(lane).is_finite() {
                self.predictor.rest_lane(lane);
            }
        }
    }

    /// theta of each run.
    #[inline(always)]
    pub fn theta(&self) -> &[R; N] {
        &self.theta
    }
}
