//! The criterion and its derivatives for several records at the same time, each record with its own theta.
//!
//! The criterion is that of a Box-Jenkins model without C ([`crate::criterion`]), with the initial states eliminated.
//! For the record in each lane,
//!
//! `s = e(t-nk)/F`,  `w = B s`,  `v = u - w`,  `eps = D v`,  `x_b = D s`,  `r = w/F`,  `x_f = D r`
//!
//! The columns of psi are shifts of `x_b`, `-v` and `-x_f`. A recursion over t has a latency per sample, which is
//! hidden if eight records are processed in parallel. All signals of a span of samples are computed and multiplied
//! before the next span, so they remain in the first-level cache; only the record itself is read from slower memory.
//! The first span covers the free responses, because the initial states must be known before w is filtered again.
//!
//! Every operation acts on each lane separately, and if one lane needs more samples than another, the shorter signal is
//! padded with zeros. The result of a lane is therefore bitwise independent of the type of registers and of the other
//! lanes. The sums over time are taken in a different order from the criterion for single records and differ from it by
//! rounding.

use hoid_lanes::LaneTask;
use hoid_lanes::Number;
use hoid_model::Orders;

use super::{
    columns::Columns,
    filters::{compute_response, filter_all, filter_response, whiten},
    initial_state_responses::InitialStateResponses,
    normal_equations::NormalEquations,
    signal_buffers::SignalBuffers,
};

/// Number of samples that are computed and multiplied at a time.
const SPAN_LENGTH: usize = 64;

/// Input and memory of one pass over the records in all lanes.
pub(super) struct Pass<'a> {
    pub orders: Orders,
    /// Sample of the first residual.
    pub first: usize,
    /// Number of samples of each record.
    pub n: usize,
    /// Input and output, with one row per sample.
    pub e: &'a [f64],
    pub u: &'a [f64],
    /// Parameters theta, with one row per parameter.
    pub theta: &'a [f64],
    pub signals: &'a mut SignalBuffers,
    pub sums: &'a mut NormalEquations,
}

impl LaneTask for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Number>(self, zero: R) {
        let width = zero.lane_count();
        let Self {
            orders: o,
            first,
            n,
            e,
            u,
            theta,
            signals,
            sums,
        } = self;
        let (b, rest) = theta.split_at(o.nb * width);
        let (d, f) = rest.split_at(o.nd * width);
        let regressed = first - o.nd;
        let history = o.nb.max(o.nd).max(o.nf);
        let columns = Columns {
            nb: o.nb,
            nd: o.nd,
            nf: o.nf,
        };
        let states = InitialStateResponses::of(zero, [d, f], n - first, signals, &mut sums.dependent);
        let first_row = o.nk;
        let mut to = first + states.rows;
        signals.prepare(history, (to - first_row).max(SPAN_LENGTH), width);
        sums.products.clear();
        sums.products.resize(columns.count() * columns.count() * width, 0.0);
        let products = &mut sums.products;
        let mut inside = Vec::new();

        let mut from = first_row;
        loop {
            let count = to - from;
            let at = history * width;
            let end = at + count * width;
            let (inputs, outputs) = (
                &e[(from - o.nk) * width..(to - o.nk) * width],
                &u[from * width..to * width],
            );
            let mut counted = history;
            if from == first_row || !filter_all(zero, [b, d, f], [inputs, outputs], signals, at) {
                compute_response(zero, [b, f], [inputs, outputs], signals, at);
                if from == first_row {
                    // w is unknown until all of its regressors are inside the record.
                    signals.r[at..at + (regressed - first_row) * width].fill(0.0);
                    signals.v[at..at + (regressed - first_row) * width].fill(0.0);
                }
                whiten(zero, d, &signals.v, &mut signals.eps[at..end], at);
                whiten(zero, d, &signals.s, &mut signals.x_b[at..end], at);
                if from == first_row {
                    counted += first - first_row;
                    states.eliminate(zero, signals, history + regressed - first_row, counted);
                }
                filter_response(zero, [d, f], &mut signals.r[..end], &mut signals.x_f[at..end], at);
            }
            if from == first_row {
                inside = states.components(zero, &columns, signals, counted);
                columns.add_row(zero, signals, counted, 1.0, products);
            }
            // The later spans contain the same samples regardless of the length of the first span, which depends on the
            // slowest lane.
            let mut done = counted;
            while done < history + count {
                let next = if done == counted && from == first_row {
                    done + o.nf - 1 + SPAN_LENGTH
                } else {
                    done + SPAN_LENGTH
                };
                let next = next.min(history + count);
                columns.add_products(zero, signals, done, next, products);
                done = next;
            }
            if to == n {
                // In the row after the last row, a shifted column has the last value of the column before it.
                columns.add_row(zero, signals, history + count, -1.0, products);
                break;
            }
            signals.carry_over_tail(history, count, width);
            (from, to) = (to, (to + SPAN_LENGTH).min(n));
        }
        columns.complete(zero, &inside, o.nf, products);
    }
}
