//! The criterion and its derivatives for several records at once, each with a theta of its own.
//!
//! What [`crate::pem::criterion`] says of one Box-Jenkins model without C, with its initial states eliminated, for a record in each lane:
//!
//! `s = e(t-nk)/F`,  `w = B s`,  `v = u - w`,  `eps = D v`,  `x_b = D s`,  `r = w/F`,  `x_f = D r`
//!
//! The columns of psi are shifts of `x_b`, `-v` and `-x_f`. A recursion over t waits for its own last value, and eight records fill the
//! waiting time. All signals of some samples are made and multiplied before the next samples are begun, so that they stay in the
//! nearest memory; only the record itself is read from further away. The first of these spans reaches as far as the free responses
//! do, because the initial states must be known before w is filtered again.
//!
//! Every operation acts on each lane alone, and what one lane needs longer than another is zero there: the bits of a lane depend
//! neither on the registers nor on its neighbours. The sums run over time in another order than those of the criterion alone: they
//! differ from it by rounding.

use hoid_lanes::LaneTask;
use hoid_lanes::Number;
use hoid_model::Orders;

use super::{
    columns::Columns,
    filters::{all_at_once, filter_response, respond, whiten},
    initial_state_responses::FreeResponses,
    rows::Rows,
};

/// Samples that are made and multiplied at a time.
const SPAN: usize = 64;

/// Signals of a span, a row for each sample and in it a number for each lane. The rows before the first hold the end of the span before.
#[derive(Debug, Default)]
pub(super) struct Room {
    pub s: Rows,
    pub v: Rows,
    pub eps: Rows,
    pub x_b: Rows,
    pub r: Rows,
    pub x_f: Rows,
    /// Impulse responses of 1/F and of D/F.
    pub h: Rows,
    pub g: Rows,
    /// Responses to the initial states, orthogonal, one after the other.
    pub q: Rows,
}

/// Sums over one record in each lane.
#[derive(Debug, Default)]
pub(super) struct Sums {
    /// Products of eps and the columns of psi without their signs, `[eps, x_b.., v.., x_f..]` by rows, the initial states projected out.
    pub products: Vec<f64>,
    /// Lanes whose free responses are not independent: nothing is said of them.
    pub dependent: Vec<bool>,
}

/// One pass.
pub(super) struct Pass<'a> {
    pub orders: Orders,
    /// First residual.
    pub first: usize,
    /// Samples.
    pub n: usize,
    /// Input and output, by rows.
    pub e: &'a [f64],
    pub u: &'a [f64],
    /// theta, a row for each parameter.
    pub theta: &'a [f64],
    pub room: &'a mut Room,
    pub sums: &'a mut Sums,
}

impl LaneTask for Pass<'_> {
    type Output = ();

    #[inline(always)]
    fn run<R: Number>(self, zero: R) {
        let width = zero.lanes();
        let Self {
            orders: o,
            first,
            n,
            e,
            u,
            theta,
            room,
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
        let states = FreeResponses::of(zero, [d, f], n - first, room, &mut sums.dependent);
        let begin = o.nk;
        let mut to = first + states.rows;
        room.begin(history, (to - begin).max(SPAN), width);
        sums.products.clear();
        sums.products.resize(columns.count() * columns.count() * width, 0.0);
        let products = &mut sums.products;
        let mut inside = Vec::new();

        let mut from = begin;
        loop {
            let count = to - from;
            let at = history * width;
            let end = at + count * width;
            let (inputs, outputs) = (
                &e[(from - o.nk) * width..(to - o.nk) * width],
                &u[from * width..to * width],
            );
            let mut counted = history;
            if from == begin || !all_at_once(zero, [b, d, f], [inputs, outputs], room, at) {
                respond(zero, [b, f], [inputs, outputs], room, at);
                if from == begin {
                    // Nothing is known of w before all of its regressors lie inside the record.
                    room.r[at..at + (regressed - begin) * width].fill(0.0);
                    room.v[at..at + (regressed - begin) * width].fill(0.0);
                }
                whiten(zero, d, &room.v, &mut room.eps[at..end], at);
                whiten(zero, d, &room.s, &mut room.x_b[at..end], at);
                if from == begin {
                    counted += first - begin;
                    states.eliminate(zero, room, history + regressed - begin, counted);
                }
                filter_response(zero, [d, f], &mut room.r[..end], &mut room.x_f[at..end], at);
            }
            if from == begin {
                inside = states.components(zero, &columns, room, counted);
                columns.add_row(zero, room, counted, 1.0, products);
            }
            // In spans of the same samples however long the first is: its length is that of the slowest lane.
            let mut done = counted;
            while done < history + count {
                let next = if done == counted && from == begin {
                    done + o.nf - 1 + SPAN
                } else {
                    done + SPAN
                };
                let next = next.min(history + count);
                columns.add_products(zero, room, done, next, products);
                done = next;
            }
            if to == n {
                // One row later than the last, a column that follows is the one before it in the last.
                columns.add_row(zero, room, history + count, -1.0, products);
                break;
            }
            room.go_on(history, count, width);
            (from, to) = (to, (to + SPAN).min(n));
        }
        columns.complete(zero, &inside, o.nf, products);
    }
}

impl Room {
    /// Room for spans of so many samples, with zeros before the first.
    fn begin(&mut self, history: usize, longest: usize, width: usize) {
        for signal in [
            &mut self.s,
            &mut self.v,
            &mut self.eps,
            &mut self.x_b,
            &mut self.r,
            &mut self.x_f,
        ] {
            signal.make_room((history + longest) * width);
            signal[..history * width].fill(0.0);
        }
    }

    /// Keeps the end of a span for the next.
    fn go_on(&mut self, history: usize, count: usize, width: usize) {
        for signal in [&mut self.s, &mut self.v, &mut self.x_b, &mut self.r, &mut self.x_f] {
            signal.copy_within(count * width..(count + history) * width, 0);
        }
    }
}

/// `y += k x`.
#[inline(always)]
pub(super) fn add_scaled<R: Number>(k: R, x: &[f64], y: &mut [f64]) {
    let width = k.lanes();
    for (y, x) in y.chunks_exact_mut(width).zip(x.chunks_exact(width)) {
        (k.load(y) + k * k.load(x)).store(y);
    }
}
