//! The filters of the refined recursion: signals filtered by D/F, and the response of the auxiliary model to an input.

use hoid_model::Orders;

use hoid_track::building::{History, limit_magnitude, weighted_sum};

/// Histories of a signal and of the same signal filtered by D/F.
#[derive(Debug, Clone)]
pub(crate) struct FilteredHistory {
    pub raw: History,
    pub output: History,
}

hoid_core::state!([] FilteredHistory { raw, output });

impl FilteredHistory {
    pub fn new(orders: &Orders) -> Self {
        Self {
            raw: History::new(orders.nd),
            output: History::new(orders.nf.max(orders.nb)),
        }
    }

    pub fn next(&self, d: &[f64], f: &[f64], x: f64) -> f64 {
        limit_magnitude(x + weighted_sum(d, self.raw.newest_first()) - weighted_sum(f, self.output.newest_first()))
    }

    pub fn push(&mut self, d: &[f64], f: &[f64], x: f64) {
        let y = self.next(d, f, x);
        self.raw.push(x);
        self.output.push(y);
    }
}

/// Histories of an input and of its response, each unfiltered and filtered by D/F.
#[derive(Debug, Clone)]
pub(crate) struct ResponseHistory {
    pub input: History,
    pub response: History,
    pub input_filtered: FilteredHistory,
    pub response_filtered: FilteredHistory,
}

hoid_core::state!([] ResponseHistory { input, response, input_filtered, response_filtered });

impl ResponseHistory {
    pub fn new(orders: &Orders) -> Self {
        Self {
            input: History::new(orders.nk + orders.nb),
            response: History::new(orders.nf),
            input_filtered: FilteredHistory::new(orders),
            response_filtered: FilteredHistory::new(orders),
        }
    }

    /// Returns the current value of `(B/F) q^-nk` applied to the input.
    pub fn response(&self, b: &[f64], f: &[f64], nk: usize) -> f64 {
        limit_magnitude(
            weighted_sum(b, &self.input.newest_first()[nk..]) - weighted_sum(f, self.response.newest_first()),
        )
    }

    /// Writes `[e_f(t-nk) .., -x_f(t-1) ..]` at the positions of B and F in theta.
    pub fn regressors(&self, p: &ThetaParts<'_>, nk: usize, into: &mut [f64]) {
        let now = self.input_filtered.next(p.d, p.f, self.input.newest_first()[nk]);
        fill_b(now, &self.input_filtered, p.b.len(), into);
        fill_f(&self.response_filtered, p.f.len(), into);
    }

    /// Advances the filters to the next sample.
    pub fn advance(&mut self, p: &ThetaParts<'_>, nk: usize) {
        let x = self.response(p.b, p.f, nk);
        self.response.push(x);
        self.response_filtered.push(p.d, p.f, x);
        let delayed = self.input.newest_first()[nk];
        self.input_filtered.push(p.d, p.f, delayed);
    }
}

pub(crate) fn fill_b(now: f64, input: &FilteredHistory, nb: usize, into: &mut [f64]) {
    into[0] = now;
    into[1..nb].copy_from_slice(&input.output.newest_first()[..nb - 1]);
}

pub(crate) fn fill_f(output: &FilteredHistory, nf: usize, into: &mut [f64]) {
    let first = into.len() - nf;
    for (place, y) in into[first..].iter_mut().zip(output.output.newest_first()) {
        *place = -y;
    }
}

/// The parts of theta, `[b, d, f]`.
pub(crate) struct ThetaParts<'t> {
    pub b: &'t [f64],
    pub d: &'t [f64],
    pub f: &'t [f64],
}

impl<'t> ThetaParts<'t> {
    pub fn of(theta: &'t [f64], orders: &Orders) -> Self {
        let (b, rest) = theta.split_at(orders.nb);
        let (d, f) = rest.split_at(orders.nd);
        Self { b, d, f }
    }
}
