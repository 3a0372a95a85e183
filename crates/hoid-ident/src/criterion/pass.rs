//! A pass over a record at one theta; a long record is passed span by span.
//!
//! The terms of the normal equations are sums over time, and every signal in them is the output of a causal filter: the
//! first part of the record (32 768 samples) is processed like any record, and the rest in spans that fit into the
//! processor cache, each preceded by the last samples of the previous span. Memory and time per sample then do not grow
//! with the length of the record.
//!
//! The initial states affect only the start. Their responses must have died away within the head
//! ([`InitialStateResponses::have_died`](crate::criterion::initial_state_responses::InitialStateResponses::have_died));
//! if a pole is so near the unit circle that they have not, the record is processed as a whole. The same holds with
//! weights, of which there is one per sample, with further inputs, and with a stationary past, whose columns are
//! whitened one by one. The sums differ from those over the whole by rounding only.

use std::ops::Range;

use hoid_core::filter::divide_from;
use hoid_model::{polynomial::product, polynomial_model::monic};

use super::{
    initial_state::InitialState,
    polynomials::{Block, Polynomials},
    prediction_error::{Criterion, Data},
    signals::EliminatedStates,
    whitening::whiten_on,
    workspace::Workspace,
};

/// Samples of a span: its signals fill a quarter of the second-level cache.
const SPAN: usize = 1 << 11;

/// Samples of the first part. Only a record of twice this length is processed in spans; others, up to some minutes, as
/// a whole.
const HEAD: usize = 1 << 15;

impl Criterion<'_> {
    /// Processes a record and calls `show` with the eliminated initial states, the rows of the workspace with the
    /// residuals that count, and the workspace; for a long record, once for each span. Returns the eliminated initial
    /// states.
    pub(super) fn pass(
        &self,
        theta: &[f64],
        blocks: &[Block],
        record: usize,
        ws: &mut Workspace,
        mut show: impl FnMut(&EliminatedStates, Range<usize>, &Workspace),
    ) -> EliminatedStates {
        if let Some(states) = self.pass_in_spans(theta, blocks, record, HEAD, ws, &mut show) {
            return states;
        }
        let data = self.data[record];
        let states = self.residual_pass(theta, record, data, ws);
        self.gradient_pass(theta, blocks, data, ws);
        show(&states, ws.pad + self.first..ws.pad + data.u.len(), ws);
        states
    }

    /// Processes a record span by span, with the results of the pass over the head (none for the other spans); `None`,
    /// without a call of `show`, if the record has to be processed as a whole.
    pub(super) fn pass_in_spans(
        &self,
        theta: &[f64],
        blocks: &[Block],
        record: usize,
        head: usize,
        ws: &mut Workspace,
        show: &mut dyn FnMut(&EliminatedStates, Range<usize>, &Workspace),
    ) -> Option<EliminatedStates> {
        let Data { e, u, .. } = self.data[record];
        let plain = self.weights.is_none() && self.initial != InitialState::Backcast && self.further.is_empty();
        // With long lags the head has no residuals.
        let least = 2 * (self.first + self.orders.nk) + SPAN;
        if !plain || u.len() < 2 * head || head < least {
            return None;
        }
        let begin = Data {
            e: &e[..head.min(e.len())],
            u: &u[..head],
            ..self.data[record]
        };
        let states = self.residual_pass(theta, record, begin, ws);
        if !states.responses.have_died(head - self.first) {
            return None;
        }
        self.gradient_pass(theta, blocks, begin, ws);
        show(&states, ws.pad + self.first..ws.pad + head, ws);
        let parts = Polynomials::split(&self.orders, theta);
        let nothing = EliminatedStates::default();
        let mut behind = head;
        for from in (head..u.len()).step_by(SPAN) {
            let to = (from + SPAN).min(u.len());
            ws.carry(behind);
            behind = to - from;
            self.next_span(&parts, blocks, self.data[record], from..to, ws);
            show(&nothing, ws.pad..ws.pad + behind, ws);
        }
        Some(states)
    }

    /// Computes the signals of the next span, after the last samples of the previous one at the front.
    fn next_span(
        &self,
        parts: &Polynomials<'_>,
        blocks: &[Block],
        data: Data<'_>,
        span: Range<usize>,
        ws: &mut Workspace,
    ) {
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
    /// Copies the last samples of the span of this length to the front.
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
