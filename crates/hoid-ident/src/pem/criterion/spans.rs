//! A long record, span by span.
//!
//! What the normal equations need of a record are sums over time, and every signal in them is the output of a filter that goes forward: the
//! first part of the record ([`HEAD`](super::HEAD)) is passed as any record, the rest in spans that stay in the memory near the processor, each with
//! the last samples of the span before in front of it. Nothing then grows with the record, and a sample costs the same in a long one.
//!
//! The initial states act on the beginning alone. Their responses must have died away within the head ([`FreeResponses::have_died`](crate::pem::initial_states::FreeResponses::have_died)); where a pole is so
//! near the circle that they have not, the record is passed whole. So it is with weights, of which there is one a sample, and with a stationary
//! past, whose columns are whitened one by one. The sums differ from those over the whole by rounding alone.

use std::ops::Range;

use hoid_core::filter::divide_from;
use hoid_model::{polynomial::product, polynomial_model::monic};

use super::{Block, Criterion, Data, InitialState, Parts, Passed, Workspace, whiten_on};

/// Samples of a span: its signals fill a quarter of the second cache.
const SPAN: usize = 1 << 11;

impl Criterion<'_> {
    /// As [`Criterion::pass`] span after span, with what the pass over the head has found (for the other spans nothing); `None`, and nothing shown,
    /// where the record has to pass whole.
    pub(super) fn pass_in_spans(
        &self,
        theta: &[f64],
        blocks: &[Block],
        record: usize,
        head: usize,
        ws: &mut Workspace,
        show: &mut dyn FnMut(&Passed, Range<usize>, &Workspace),
    ) -> Option<Passed> {
        let Data { e, u } = self.data[record];
        let plain = self.weights.is_none() && self.initial != InitialState::Backcast;
        // Long lags leave the head no residuals.
        let least = 2 * (self.first + self.orders.nk) + SPAN;
        if !plain || u.len() < 2 * head || head < least {
            return None;
        }
        let begin = Data {
            e: &e[..head.min(e.len())],
            u: &u[..head],
        };
        let passed = self.residual_pass(theta, record, begin, ws);
        if !passed.free.have_died(head - self.first) {
            return None;
        }
        self.gradient_pass(theta, blocks, begin, ws);
        show(&passed, ws.pad + self.first..ws.pad + head, ws);
        let parts = Parts::split(&self.orders, theta);
        let nothing = Passed::default();
        let mut behind = head;
        for from in (head..u.len()).step_by(SPAN) {
            let to = (from + SPAN).min(u.len());
            ws.carry(behind);
            behind = to - from;
            self.go_on(&parts, blocks, self.data[record], from..to, ws);
            show(&nothing, ws.pad..ws.pad + behind, ws);
        }
        Some(passed)
    }

    /// The signals of the next span, behind their last samples, which stand in front.
    fn go_on(&self, parts: &Parts<'_>, blocks: &[Block], data: Data<'_>, span: Range<usize>, ws: &mut Workspace) {
        let o = &self.orders;
        let (pad, end) = (ws.pad, ws.pad + span.len());
        if o.nb > 0 {
            let s = &mut ws.s[..end];
            s[pad..].copy_from_slice(&data.e[span.start - o.nk..span.end - o.nk]);
            divide_from(parts.f, s, pad);
        }
        self.response(parts, data, span.clone(), pad, ws);
        let Workspace {
            s,
            w,
            v,
            eps,
            filtered: [xa, xb, xc, xd, xf],
            scratch,
            ..
        } = ws;
        let (v, w) = (&v[..end], &w[..end]);
        whiten_on(parts.c, parts.d, v, &mut eps[..end], pad);
        for block in blocks {
            match block {
                Block::A if o.na > 0 => {
                    let u = &mut scratch[..end];
                    u.copy_from_slice(&data.u[span.start - pad..span.end]);
                    whiten_on(parts.c, parts.d, u, &mut xa[..end], pad);
                }
                Block::B if o.nb > 0 => whiten_on(parts.c, parts.d, &s[..end], &mut xb[..end], pad),
                Block::C if o.nc > 0 => whiten_on(parts.c, &[], &eps[..end], &mut xc[..end], pad),
                // Without C its signal is v itself.
                Block::D if o.nd > 0 && o.nc > 0 => whiten_on(parts.c, &[], v, &mut xd[..end], pad),
                Block::F if o.nf > 0 => {
                    let poles = product(&monic(parts.c), &monic(parts.f));
                    whiten_on(&poles[1..], parts.d, w, &mut xf[..end], pad);
                }
                _ => {}
            }
        }
    }
}

impl Workspace {
    /// Takes the last samples of the span of this length to the front.
    fn carry(&mut self, length: usize) {
        let pad = self.pad;
        let Self {
            s, w, v, eps, filtered, ..
        } = self;
        for signal in [s, w, v, eps].into_iter().chain(filtered) {
            if !signal.is_empty() {
                signal.copy_within(length..length + pad, 0);
            }
        }
    }
}
