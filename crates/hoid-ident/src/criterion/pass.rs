//! A pass over a record for one theta, in spans if the record is long.
//!
//! The terms of the normal equations are sums over time, and every signal in them is the output of a causal filter. The
//! head of a long record (its first 32 768 samples) is therefore processed in the same way as a short record. The rest
//! is processed in spans that fit into the processor cache, each preceded by the last samples of the previous span. The
//! memory needed and the time per sample then do not grow with the length of the record.
//!
//! The initial states affect only the start of the record. The responses to them must have decayed within the head
//! ([`have_decayed`](crate::criterion::initial_state_responses::InitialStateResponses::have_decayed)). If a pole is so
//! close to the unit circle that the responses have not decayed, the record is processed as a whole. Records with
//! weights (one per sample), with further inputs, or with a stationary past (whose columns are whitened one by one) are
//! also processed as a whole. The sums over spans differ from the sum over the whole record only by rounding.

use std::ops::Range;

use hoid_core::filter::divide_from;
use hoid_model::{polynomial::product, polynomial_model::monic};

use super::{
    initial_state::InitialState,
    polynomials::{Block, Polynomials},
    prediction_error::{Criterion, Data},
    signals::EliminatedStates,
    whitening::continue_whitening,
    workspace::Workspace,
};

/// Number of samples in a span: the signals of a span fill a quarter of the second-level cache.
const SPAN_SAMPLES: usize = 1 << 11;

/// Number of samples in the head. Only a record of at least twice this length is processed in spans; shorter records,
/// up to several minutes, are processed as a whole.
const HEAD_SAMPLES: usize = 1 << 15;

impl Criterion<'_> {
    /// Processes a record and calls `visit` with the eliminated initial states, the rows of the workspace that contain
    /// the counted residuals, and the workspace. For a long record `visit` is called once per span. Returns the
    /// eliminated initial states.
    pub(super) fn process_record(
        &self,
        theta: &[f64],
        blocks: &[Block],
        record: usize,
        ws: &mut Workspace,
        mut visit: impl FnMut(&EliminatedStates, Range<usize>, &Workspace),
    ) -> EliminatedStates {
        if let Some(states) = self.process_in_spans(theta, blocks, record, HEAD_SAMPLES, ws, &mut visit) {
            return states;
        }
        let data = self.data[record];
        let states = self.compute_residuals(theta, record, data, ws);
        self.compute_filtered_signals(theta, blocks, data, ws);
        visit(&states, ws.pad + self.first..ws.pad + data.u.len(), ws);
        states
    }

    /// Processes a record in spans. `visit` receives the eliminated initial states with the head, and empty states with
    /// the other spans. Returns `None`, without calling `visit`, if the record must be processed as a whole.
    pub(super) fn process_in_spans(
        &self,
        theta: &[f64],
        blocks: &[Block],
        record: usize,
        head: usize,
        ws: &mut Workspace,
        visit: &mut dyn FnMut(&EliminatedStates, Range<usize>, &Workspace),
    ) -> Option<EliminatedStates> {
        let Data { e, u, .. } = self.data[record];
        let plain = self.weights.is_none() && self.initial != InitialState::Backcast && self.further.is_empty();
        // A head that is not longer than the lags would contain no residuals.
        let least = 2 * (self.first + self.orders.nk) + SPAN_SAMPLES;
        if !plain || u.len() < 2 * head || head < least {
            return None;
        }
        let head_data = Data {
            e: &e[..head.min(e.len())],
            u: &u[..head],
            ..self.data[record]
        };
        let states = self.compute_residuals(theta, record, head_data, ws);
        if !states.responses.have_decayed(head - self.first) {
            return None;
        }
        self.compute_filtered_signals(theta, blocks, head_data, ws);
        visit(&states, ws.pad + self.first..ws.pad + head, ws);
        let parts = Polynomials::split(&self.orders, theta);
        let nothing = EliminatedStates::default();
        let mut carried = head;
        for from in (head..u.len()).step_by(SPAN_SAMPLES) {
            let to = (from + SPAN_SAMPLES).min(u.len());
            ws.carry_over_tail(carried);
            carried = to - from;
            self.compute_next_span(&parts, blocks, self.data[record], from..to, ws);
            visit(&nothing, ws.pad..ws.pad + carried, ws);
        }
        Some(states)
    }

    /// Computes the signals of the next span; the workspace starts with the last samples of the previous span.
    fn compute_next_span(
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
        self.compute_response(parts, data, span.clone(), pad, ws);
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
        continue_whitening(parts.c, parts.d, v, &mut eps[..end], pad);
        for block in blocks {
            match block {
                Block::A if o.na > 0 => {
                    let u = &mut scratch[..end];
                    u.copy_from_slice(&data.u[span.start - pad..span.end]);
                    continue_whitening(parts.c, parts.d, u, &mut xa[..end], pad);
                }
                Block::B if o.nb > 0 => continue_whitening(parts.c, parts.d, &s[..end], &mut xb[..end], pad),
                Block::C if o.nc > 0 => continue_whitening(parts.c, &[], &eps[..end], &mut xc[..end], pad),
                // With nc = 0 the signal for D is v itself.
                Block::D if o.nd > 0 && o.nc > 0 => continue_whitening(parts.c, &[], v, &mut xd[..end], pad),
                Block::F if o.nf > 0 => {
                    let poles = product(&monic(parts.c), &monic(parts.f));
                    continue_whitening(&poles[1..], parts.d, w, &mut xf[..end], pad);
                }
                _ => {}
            }
        }
    }
}

impl Workspace {
    /// Copies the last samples of a span of this length to the front of the workspace.
    fn carry_over_tail(&mut self, length: usize) {
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
