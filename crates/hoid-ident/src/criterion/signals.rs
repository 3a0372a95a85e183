//! The signals of a record: w, v and eps with the least squares initial states, and the filtered signals whose shifts
//! are the columns of psi.

use std::{ops::Range, sync::Arc};

use hoid_core::filter::divide;

use super::{
    initial_state::InitialState,
    initial_state_responses::{InitialHistory, InitialStateResponses},
    polynomials::{Block, Polynomials},
    prediction_error::{Criterion, Data},
    stationary_noise::StationaryNoise,
    whitening::{divide_and_whiten, whiten},
    workspace::{Workspace, uses_single_pass},
};
use crate::linalg::vectors::add_scaled;

/// Initial states that a pass over a record has eliminated.
#[derive(Default)]
pub(super) struct EliminatedStates {
    pub responses: Arc<InitialStateResponses>,
    pub noise: Option<StationaryNoise>,
    pub z: Vec<f64>,
}

impl Criterion<'_> {
    /// Computes w, v and eps of a record, or of its head, with the least squares initial states.
    pub(super) fn compute_residuals(
        &self,
        theta: &[f64],
        record: usize,
        data: Data<'_>,
        ws: &mut Workspace,
    ) -> EliminatedStates {
        let parts = Polynomials::split(&self.orders, theta);
        let n = data.u.len();
        let o = &self.orders;
        ws.allocate(o, &self.further, n);
        let pad = ws.pad;
        let regressed = self.first_regressed_sample();
        let start = match self.initial {
            InitialState::Zero => 0,
            InitialState::Estimate | InitialState::Backcast => self.first,
        };

        self.filter_input(&parts, data, ws);
        let from = pad + regressed;
        ws.w[..from].fill(0.0);
        ws.v[..from].fill(0.0);
        self.compute_response(&parts, data, regressed..n, from, ws);
        self.compute_further_responses(theta, record, regressed..n, ws);
        whiten(parts.c, parts.d, &ws.v, &mut ws.eps, pad + start);

        let weights = self.weights.map(|all| all[record].as_slice());
        let eps = &mut ws.eps[pad + self.first..];
        if let Some(weights) = weights {
            eps.iter_mut().zip(weights).for_each(|(x, w)| *x *= w);
        }
        let mut states = EliminatedStates::default();
        if self.initial != InitialState::Zero {
            if self.initial == InitialState::Backcast {
                states.noise = StationaryNoise::of(parts.c, self.noise_poles(&parts));
            }
            let poles: Vec<&[f64]> = std::iter::once(parts.f)
                .chain(self.further_polynomials(theta).map(|(_, f)| f))
                .collect();
            let past = InitialHistory {
                c: parts.c,
                d: parts.d,
                f: &poles,
                lead: self.first - regressed,
                noise: states.noise.as_ref(),
                weights,
                level: data.level,
            };
            states.responses = ws.responses.of(&past, n - self.first);
            let from = pad + regressed;
            let own = std::iter::once(&mut ws.w[from..]);
            let mut w: Vec<&mut [f64]> = own.chain(ws.further.iter_mut().map(|s| &mut s.w[from..])).collect();
            states.z = states.responses.eliminate(&mut w, &mut ws.v[from..], eps);
        }
        if let Some(weights) = weights {
            eps.iter_mut().zip(weights).for_each(|(x, w)| *x /= w);
        }
        states
    }

    /// Computes `w = B s` and `v = A u - w` over these samples; the first sample has the index `from` in the workspace.
    pub(super) fn compute_response(
        &self,
        parts: &Polynomials<'_>,
        data: Data<'_>,
        samples: Range<usize>,
        from: usize,
        ws: &mut Workspace,
    ) {
        let to = from + samples.len();
        let u = &data.u[samples.clone()];
        let (w, v) = (&mut ws.w[from..to], &mut ws.v[from..to]);
        match *parts.b {
            // With two coefficients of B, the common case, one pass computes w and v.
            [b0, b1] => {
                let inputs = ws.s[from..to].iter().zip(&ws.s[from - 1..to - 1]).zip(u);
                for ((w, v), ((s0, s1), u)) in w.iter_mut().zip(&mut *v).zip(inputs) {
                    *w = b0 * s0 + b1 * s1;
                    *v = u - *w;
                }
            }
            _ => {
                w.fill(0.0);
                for (j, &bj) in parts.b.iter().enumerate() {
                    add_scaled(w, bj, &ws.s[from - j..to - j]);
                }
                for ((v, w), u) in v.iter_mut().zip(&*w).zip(u) {
                    *v = u - w;
                }
            }
        }
        for (i, &ai) in parts.a.iter().enumerate() {
            let first = samples.start.max(i + 1);
            if first < samples.end {
                add_scaled(
                    &mut v[first - samples.start..],
                    ai,
                    &data.u[first - i - 1..samples.end - i - 1],
                );
            }
        }
    }

    /// Computes the filtered signals whose shifts are the columns of psi.
    pub(super) fn compute_filtered_signals(&self, theta: &[f64], blocks: &[Block], data: Data<'_>, ws: &mut Workspace) {
        let parts = Polynomials::split(&self.orders, theta);
        let (o, pad) = (&self.orders, ws.pad);
        let regressed = self.first_regressed_sample();
        if blocks.contains(&Block::A) {
            self.filter_output(&parts, data, ws);
        }
        if blocks.contains(&Block::B) {
            self.whiten_input(&parts, ws);
        }
        if blocks.contains(&Block::Further) {
            self.whiten_further(theta, ws);
        }
        let [_, _, xc, xd, xf] = &mut ws.filtered;
        if o.nc > 0 && blocks.contains(&Block::C) {
            xc[..pad].fill(0.0);
            divide(parts.c, &ws.eps[pad..], &mut xc[pad..]);
        }
        // With nc = 0 the signal for D is v itself.
        if o.nd > 0 && o.nc > 0 && blocks.contains(&Block::D) {
            xd[..pad].fill(0.0);
            divide(parts.c, &ws.v[pad..], &mut xd[pad..]);
        }
        if o.nf > 0 && blocks.contains(&Block::F) {
            let from = pad + regressed;
            if uses_single_pass(o) {
                // w is zero before `from`.
                let d1 = parts.d.first().copied().unwrap_or(0.0);
                xf[..from].fill(0.0);
                divide_and_whiten([parts.f[0], parts.f[1]], d1, &ws.w[from..], &mut xf[from..]);
            } else {
                ws.scratch[..from].copy_from_slice(&ws.w[..from]);
                divide(parts.f, &ws.w[from..], &mut ws.scratch[from..]);
                whiten(parts.c, parts.d, &ws.scratch, xf, from);
            }
        }
    }

    /// Computes the signal `(D/C) u` for the columns of A. With a stationary past it is a copy of u, because each shift
    /// of u is truncated at the first residual before it is whitened.
    fn filter_output(&self, parts: &Polynomials<'_>, data: Data<'_>, ws: &mut Workspace) {
        if self.orders.na == 0 {
            return;
        }
        let pad = ws.pad;
        ws.scratch[..pad].fill(0.0);
        ws.scratch[pad..].copy_from_slice(data.u);
        let signal = &mut ws.filtered[Block::A as usize];
        if self.initial == InitialState::Backcast {
            signal.copy_from_slice(&ws.scratch);
        } else {
            whiten(parts.c, parts.d, &ws.scratch, signal, pad);
        }
    }

    /// Computes `s = (1/F) e(t-nk)`, from which w follows by `w = B s`. If the initial states are estimated, w may
    /// differ from the response from rest by a free response of 1/F.
    fn filter_input(&self, parts: &Polynomials<'_>, data: Data<'_>, ws: &mut Workspace) {
        let (pad, n) = (ws.pad, data.u.len());
        if self.orders.nb == 0 {
            return;
        }
        let from = pad + self.orders.nk.min(n);
        ws.s[..from].fill(0.0);
        divide(parts.f, &data.e[..pad + n - from], &mut ws.s[from..]);
    }

    /// Computes the signal `(D/C) s` for the columns of B. With a stationary past it is a copy of s.
    fn whiten_input(&self, parts: &Polynomials<'_>, ws: &mut Workspace) {
        if self.orders.nb == 0 {
            return;
        }
        let from = ws.pad + self.orders.nk.min(ws.s.len() - ws.pad);
        let signal = &mut ws.filtered[Block::B as usize];
        if self.initial == InitialState::Backcast {
            signal.copy_from_slice(&ws.s);
        } else {
            whiten(parts.c, parts.d, &ws.s, signal, from);
        }
    }
}
