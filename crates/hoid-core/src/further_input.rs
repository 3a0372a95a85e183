//! Responses to further inputs in the one-step predictor.
//!
//! A model with several inputs is `A u = (B/F) q^-nk e + sum_i (B_i/F_i) q^-nk_i x_i + (C/D) eps` (L. Ljung, *System
//! Identification*, 1999, section 4.2, eq. 4.35). A further input adds its response `w_i = B_i x_i - (F_i - 1) w_i` to
//! the response of the first input, and its coefficients add `(D/(C F_i)) x_i(t-j)` for B_i and `-(D/(C F_i)) w_i(t-j)`
//! for F_i to psi, by the same filters as in the [`crate::predictor`]. In theta the coefficients of a further input
//! follow those of `[a, b, c, d, f]`: first B_i, then F_i.

use hoid_numerics::products::dot;

use crate::{
    filter::{product, push},
    stability::roots_inside,
    state::State,
};

/// Coefficients of the noise model of the current estimate, without their leading 1.
#[derive(Debug, Clone, Copy)]
pub struct NoiseFilters<'a> {
    /// Coefficients of C.
    pub c: &'a [f64],
    /// Coefficients of D.
    pub d: &'a [f64],
    /// True if psi contains filtered signals, false for pseudo-linear regression.
    pub filtered: bool,
}

/// The further inputs of a predictor with capacity for N coefficients. `own` is the part of theta after `[a, b, c, d,
/// f]`.
pub trait FurtherInputs<const N: usize>: State {
    /// Number of coefficients.
    fn parameter_count(&self) -> usize;
    /// True if all roots of every F_i are inside the unit circle.
    fn are_stable(&self, own: &[f64]) -> bool;
    /// Sets the values `x_i(t) = r_i(t - nk_i)` of this sample, in the order of the inputs. They must be finite.
    fn set(&mut self, values: &[f64]);
    /// Takes the values of this sample and writes their part of psi.
    fn predict(&mut self, own: &[f64], noise: NoiseFilters<'_>, psi: &mut [f64]);
    /// Returns the response `w` of the first input plus the responses to the further inputs.
    fn add_responses(&self, own: &[f64], w: f64) -> f64;
    /// Advances the filters with the updated estimate.
    fn correct(&mut self, own: &[f64], noise: NoiseFilters<'_>);
    /// Resets the filters to rest.
    fn reset(&mut self);
}

/// No further inputs, at no cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NoFurtherInputs;

impl State for NoFurtherInputs {
    fn visit(&mut self, _each: &mut dyn FnMut(&mut f64)) {}
}

impl<const N: usize> FurtherInputs<N> for NoFurtherInputs {
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        0
    }

    #[inline(always)]
    fn are_stable(&self, _own: &[f64]) -> bool {
        true
    }

    #[inline(always)]
    fn set(&mut self, _values: &[f64]) {}

    #[inline(always)]
    fn predict(&mut self, _own: &[f64], _noise: NoiseFilters<'_>, _psi: &mut [f64]) {}

    #[inline(always)]
    fn add_responses(&self, _own: &[f64], w: f64) -> f64 {
        w
    }

    #[inline(always)]
    fn correct(&mut self, _own: &[f64], _noise: NoiseFilters<'_>) {}

    #[inline(always)]
    fn reset(&mut self) {}
}

/// Orders, input value and filters of one further input. N is the capacity for coefficients of the whole model. The
/// histories contain the newest value first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FurtherInput<const N: usize> {
    nb: usize,
    nf: usize,
    /// Input of the current sample, already delayed.
    value: f64,
    x: [f64; N],
    /// `(D/(C F)) x`.
    filtered_x: [f64; N],
    w: [f64; N],
    /// `(D/(C F)) w`.
    filtered_w: [f64; N],
}

crate::state!([const N: usize] FurtherInput<N> { value, x, filtered_x, w, filtered_w });

impl<const N: usize> FurtherInput<N> {
    /// Returns an input at rest with `nb` coefficients of B and `nf` coefficients of F; with zero coefficients it is
    /// an unused place.
    pub fn new(nb: usize, nf: usize) -> Self {
        Self {
            nb,
            nf,
            value: 0.0,
            x: [0.0; N],
            filtered_x: [0.0; N],
            w: [0.0; N],
            filtered_w: [0.0; N],
        }
    }

    /// Splits the input's part of theta or psi from the rest.
    fn split<'t>(&self, own: &'t [f64]) -> (&'t [f64], &'t [f64], &'t [f64]) {
        let (b, rest) = own.split_at(self.nb);
        let (f, rest) = rest.split_at(self.nf);
        (b, f, rest)
    }

    fn response(&self, b: &[f64], f: &[f64]) -> f64 {
        dot(b, &self.x) - dot(f, &self.w)
    }
}

impl<const N: usize, const M: usize> FurtherInputs<N> for [FurtherInput<N>; M] {
    fn parameter_count(&self) -> usize {
        self.iter().map(|input| input.nb + input.nf).sum()
    }

    fn are_stable(&self, mut own: &[f64]) -> bool {
        self.iter().all(|input| {
            let (_, f, rest) = input.split(own);
            own = rest;
            roots_inside(f, 1.0)
        })
    }

    fn set(&mut self, values: &[f64]) {
        for (input, value) in self.iter_mut().zip(values) {
            input.value = *value;
        }
    }

    fn predict(&mut self, mut own: &[f64], noise: NoiseFilters<'_>, mut psi: &mut [f64]) {
        let NoiseFilters { c, d, filtered } = noise;
        for input in self {
            let (_, f, rest) = input.split(own);
            if input.nb > 0 && filtered {
                let g: [f64; N] = product(c, f);
                let poles = dot(&g[..c.len() + f.len()], &input.filtered_x);
                let value = input.value + dot(d, &input.x) - poles;
                push(&mut input.filtered_x, N, value);
            }
            push(&mut input.x, N, input.value);
            let (x, w) = match filtered {
                true => (&input.filtered_x, &input.filtered_w),
                false => (&input.x, &input.w),
            };
            let (of_b, after) = psi.split_at_mut(input.nb);
            let (of_f, after) = after.split_at_mut(input.nf);
            of_b.copy_from_slice(&x[..input.nb]);
            for (psi, w) in of_f.iter_mut().zip(w) {
                *psi = -w;
            }
            (own, psi) = (rest, after);
        }
    }

    fn add_responses(&self, mut own: &[f64], w: f64) -> f64 {
        self.iter().fold(w, |w, input| {
            let (b, f, rest) = input.split(own);
            own = rest;
            w + input.response(b, f)
        })
    }

    fn correct(&mut self, mut own: &[f64], noise: NoiseFilters<'_>) {
        let NoiseFilters { c, d, filtered } = noise;
        for input in self {
            let (b, f, rest) = input.split(own);
            let w = input.response(b, f);
            if input.nf > 0 && filtered {
                let g: [f64; N] = product(c, f);
                let value = w + dot(d, &input.w) - dot(&g[..c.len() + f.len()], &input.filtered_w);
                push(&mut input.filtered_w, N, value);
            }
            if input.nf > 0 {
                push(&mut input.w, N, w);
            }
            own = rest;
        }
    }

    fn reset(&mut self) {
        for input in self {
            *input = FurtherInput::new(input.nb, input.nf);
        }
    }
}
