//! The filters of the refined recursion: signals filtered by D/F, and the response of the auxiliary model to an input.

use hoid_model::Orders;

use hoid_track::building::{History, bounded, weighted};

/// Histories of a signal and of the same signal filtered by D/F.
#[derive(Debug, Clone)]
pub(crate) struct Filtered {
    pub raw: History,
    pub out: History,
}

hoid_core::state!([] Filtered { raw, out });

impl Filtered {
    pub fn new(orders: &Orders) -> Self {
        Self {
            raw: History::new(orders.nd),
            out: History::new(orders.nf.max(orders.nb)),
        }
    }

    pub fn next(&self, d: &[f64], f: &[f64], x: f64) -> f64 {
        bounded(x + weighted(d, self.raw.newest()) - weighted(f, self.out.newest()))
    }

    pub fn push(&mut self, d: &[f64], f: &[f64], x: f64) {
        let y = self.next(d, f, x);
        self.raw.push(x);
        self.out.push(y);
    }
}

/// Histories of an input and of its response, each unfiltered and filtered by D/F.
#[derive(Debug, Clone)]
pub(crate) struct Simulated {
    pub input: History,
    pub response: History,
    pub input_filtered: Filtered,
    pub response_filtered: Filtered,
}

hoid_core::state!([] Simulated { input, response, input_filtered, response_filtered });

impl Simulated {
    pub fn new(orders: &Orders) -> Self {
        Self {
            input: History::new(orders.nk + orders.nb),
            response: History::new(orders.nf),
            input_filtered: Filtered::new(orders),
            response_filtered: Filtered::new(orders),
        }
    }

    /// Returns the current value of `(B/F) q^-nk` applied to the input.
    pub fn response(&self, b: &[f64], f: &[f64], nk: usize) -> f64 {
        bounded(weighted(b, &self.input.newest()[nk..]) - weighted(f, self.response.newest()))
    }

    /// Writes `[e_f(t-nk) .., -x_f(t-1) ..]` at the positions of B and F in theta.
    pub fn regressors(&self, p: &Parts<'_>, nk: usize, into: &mut [f64]) {
        let now = self.input_filtered.next(p.d, p.f, self.input.newest()[nk]);
        fill_b(now, &self.input_filtered, p.b.len(), into);
        fill_f(&self.response_filtered, p.f.len(), into);
    }

    /// Advances the filters to the next sample.
    pub fn advance(&mut self, p: &Parts<'_>, nk: usize) {
        let x = self.response(p.b, p.f, nk);
        self.response.push(x);
        self.response_filtered.push(p.d, p.f, x);
        let delayed = self.input.newest()[nk];
        self.input_filtered.push(p.d, p.f, delayed);
    }
}

pub(crate) fn fill_b(now: f64, input: &Filtered, nb: usize, into: &mut [f64]) {
    into[0] = now;
    into[1..nb].copy_from_slice(&input.out.newest()[..nb - 1]);
}

pub(crate) fn fill_f(output: &Filtered, nf: usize, into: &mut [f64]) {
    let first = into.len() - nf;
    for (place, y) in into[first..].iter_mut().zip(output.out.newest()) {
        *place = -y;
    }
}

/// The parts of theta, `[b, d, f]`.
pub(crate) struct Parts<'t> {
    pub b: &'t [f64],
    pub d: &'t [f64],
    pub f: &'t [f64],
}

impl<'t> Parts<'t> {
    pub fn of(theta: &'t [f64], orders: &Orders) -> Self {
        let (b, rest) = theta.split_at(orders.nb);
        let (d, f) = rest.split_at(orders.nd);
        Self { b, d, f }
    }
}
